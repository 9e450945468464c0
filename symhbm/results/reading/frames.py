"""`table`: a result as a table of pandas."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr

from symhbm.numerics import check
from symhbm.results.reading.rows import EACH, KINDS, rows_of
from symhbm.results.schema import check_dataset


def table(
    result: xr.Dataset,
    kind: str = "points",
    *,
    variables: Sequence[str] | None = None,
    each: str | None = None,
) -> pd.DataFrame:
    """A result as a table of pandas: one row per point, peak, event or parameter set.

    Parameters
    ----------
    result
        A result of this library: of one curve, a sweep or an ensemble. An archive that was opened
        by ``load(..., lazy=True)`` is read part by part, and only the variables of the columns.
    kind
        What a row is: one of the ``"points"`` of curves (of a motion, an angle), of their
        ``"peaks"``, of their ``"events"``, or of the parameter ``"sets"``, which tell ``status``
        and counts.
    variables
        Names of the variables to show beside those that place a row; by default all that belong to
        the rows but Fourier coefficients, and ``["all"]`` means these, too.
    each
        ``"dof"`` or ``"contact"`` for a row of each degree of freedom or contact, in a column
        ``dof`` or ``contact``; by default they are columns beside each other.

    Returns
    -------
    Table without padding: curves of a sweep have as many rows as they have points. Columns that
    place a row come first: the values of swept parameters or the number of the ``sample``, the
    number of the ``point``, ``peak`` or ``event``, and the parameter that moves, mostly
    ``frequency`` [Hz]. Then come the variables; ``amplitude_3`` [m] is that of degree of freedom 3,
    ``contact_state_0`` that of contact 0, ``coefficient_dof0_h1_cos`` [m] a Fourier coefficient.
    Of points these are ``amplitude`` [m], ``residual_norm`` [-], ``converged`` and more; of peaks
    ``peak_frequency`` [Hz], ``peak_amplitude`` [m], ``peak_dof``, ``peak_kind``; of events
    ``event_frequency`` [Hz], ``event_kind``, ``event_contact``; of sets ``status``, ``n_points``,
    ``n_peaks``. ``attrs["units"]`` has the unit of each column and ``attrs["long_name"]`` what it
    means; the glossary of the documentation has all variables.

    Raises
    ------
    TypeError
        For what is no dataset.
    KeyError
        For unknown names of variables, or of ``each``.
    ValueError
        For an unknown kind, a table that the result does not have, and variables that misfit.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> sweep = sh.frf(problem, (10, 30), over={"normal_load": [1, 3]})
    >>> peaks = sh.datasets.table(sweep, "peaks")
    >>> peaks[["normal_load", "peak_frequency", "peak_kind"]].round(3).values.tolist()
    [[1.0, 15.923, 'smooth'], [3.0, 19.374, 'smooth']]
    >>> peaks.attrs["units"]["peak_amplitude"]
    'm'
    """
    check_dataset("result", result)
    kind = check.one_of("kind", kind, KINDS)
    if isinstance(variables, str):
        raise TypeError(f"variables={variables!r}: expected a sequence of names")
    if each is not None:
        check.one_of("each", each, EACH)
    columns, blocks = rows_of(result, kind, variables, each)
    parts = [*blocks]
    series = {}
    for number, column in enumerate(columns):
        pieces = [part[number] for part in parts]
        series[column.name] = np.concatenate(pieces) if pieces else np.empty(0)
    frame = pd.DataFrame(series)
    frame.attrs["units"] = {column.name: column.units for column in columns}
    frame.attrs["long_name"] = {column.name: column.long_name for column in columns}
    return frame
