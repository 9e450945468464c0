"""Results as told of something else than their displacements, for all that reads these.

`output` puts one of the linear outputs in their place; `seen_from` makes absolute displacements
from those relative to a moving base, and the reverse.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import xarray as xr

from symhbm.model import Output
from symhbm.model.records import plain
from symhbm.numerics import RADIANS, FloatArray, check
from symhbm.results.description import OUTPUT, Description, largest_of, motions_of
from symhbm.results.provenance import DISPLACEMENTS, SEEN
from symhbm.results.schema import check_dataset, check_present

_PARTS = ("amplitude", "coefficient")
_FROM = {"ground": "absolute", "base": "relative"}


def output(result: xr.Dataset, name: str) -> xr.Dataset:
    """A result in which a linear output takes the place of displacements.

    ``amplitude`` and ``coefficient`` are those of the output in its units, and ``dof`` numbers its
    rows, so that `symhbm.datasets.motion`, `symhbm.datasets.table`, `symhbm.statistics` and
    `symhbm.plot.response` take it as they take any result. Peaks are there where they are those of
    this output, of a problem with ``peaks_of=name``.

    Parameters
    ----------
    result
        A result of `frf`, `follow`, `solve` or `recover` of a model with outputs, in memory or
        loaded.
    name
        What the output is called.

    Raises
    ------
    TypeError, KeyError
        For what is no dataset, and for an output that it does not hold.

    Examples
    --------
    >>> import symhbm as sh
    >>> pair = sh.Model(
    ...     [[1, 0], [0, 1]], [[0.5, 0], [0, 0.5]], [[2e4, -1e4], [-1e4, 1e4]]
    ... ).with_outputs({"stress": {0: -1e9, 1: 1e9}}, units="Pa")
    >>> problem = sh.HarmonicBalance(pair, sh.forces.PointForce(), peaks_of="stress")
    >>> stress = sh.datasets.output(sh.frf(problem, (5, 40)), "stress")
    >>> sh.datasets.motion(stress, "peaks").phase_lag.dims, stress.peak_amplitude.values.round(0)
    (('peak', 'dof', 'harmonic'), array([ 5528121., 14472141.]))
    """
    check_dataset("result", result)
    description = Description(result)
    outputs = description.outputs
    check.known(check.text("name", name), outputs, "output of the result")
    about = outputs[name]
    check_present(result, f"{name}_amplitude", container="result")
    own = description.problem.get("peaks_of") == name
    dropped = [str(n) for n in result.variables if _is_dropped(result, str(n), description, own)]
    view = result.drop_vars(dropped)
    if "dof" in view.dims:
        view = view.rename({"dof": "blade"})
    for part in _PARTS:
        if f"{name}_{part}" not in result.variables:
            continue
        values = result[f"{name}_{part}"].variable
        if about.several:
            dims = ["dof" if dim == about.inner[0] else dim for dim in values.dims]
            view[part] = xr.Variable(dims, values.data, values.attrs)
        else:
            outer = values.ndim - sum(dim in ("harmonic", "component") for dim in values.dims)
            dims = (*values.dims[:outer], "dof", *values.dims[outer:])
            view[part] = xr.Variable(dims, np.expand_dims(values.values, outer), values.attrs)
    if own and "peak_coefficient" in result.variables:
        stored = result["peak_coefficient"].variable
        of_dofs = stored.transpose("dof", ...)
        flat = of_dofs.values.reshape(of_dofs.shape[0], -1)
        rows = np.where(np.isnan(flat).any(axis=0), np.nan, about.rows @ flat)
        words = f"Fourier coefficient of the {name.replace('_', ' ')} at the peak"
        attributes = {"units": about.units, "long_name": words}
        peaks = xr.Variable(of_dofs.dims, rows.reshape(len(rows), *of_dofs.shape[1:]), attributes)
        view["peak_coefficient"] = peaks.transpose(*stored.dims)
    numbers = np.arange(about.rows.shape[0])
    words = {"long_name": f"row of the {name.replace('_', ' ')}", "units": "1"}
    return view.assign_coords(dof=("dof", numbers, words)).assign_attrs({OUTPUT: name})


def _is_dropped(result: xr.Dataset, name: str, description: Description, own: bool) -> bool:
    """Whether a variable is of displacements, of another output or of places."""
    variable = result.variables[name]
    if "peak" in variable.dims:
        return not own or name == "peak_coefficient"
    kept = {*description.parameters, *description.swept}
    kept |= {f"{parameter}_nominal" for parameter in kept}
    return "dof" in variable.dims and (name not in kept or not description.lumped)


def seen_from(
    result: xr.Dataset,
    where: Literal["ground", "base"],
    kind: Literal["points", "peaks"] = "points",
) -> xr.Dataset:
    """Motions of a result under a `symhbm.forces.BaseMotion` as seen from the ground or the base.

    Parameters
    ----------
    result
        A result with ``coefficient``, from `frf`, `follow` or `solve`, under a moving base.
    where
        ``"ground"`` for absolute displacements, ``"base"`` for those relative to it.
    kind
        The motions at ``"points"``, or those at ``"peaks"``, which are peaks of the displacements
        that were solved for.

    Returns
    -------
    Dataset with ``coefficient`` and ``amplitude`` [m] of these displacements, the frequency, and
    all coordinates of the result; the attribute ``displacements`` tells which they are. Linear
    outputs are left out, they are those of the displacements that were solved for; of a result that
    `symhbm.datasets.output` made they are those of the others.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no dataset, a result without the coefficients or without a moving base, and for
        displacements of contacts kept in a condensed structure.

    Examples
    --------
    The transmissibility of a linear oscillator at its natural frequency:

    >>> import symhbm as sh
    >>> oscillator = sh.Model([[1.0]], [[10.0]], [[1e4]])
    >>> problem = sh.HarmonicBalance(oscillator, sh.forces.BaseMotion(displacement=1e-3))
    >>> point = sh.solve(problem, 100 / 6.283185307179586)
    >>> absolute = sh.datasets.seen_from(point, "ground")
    >>> round(point.amplitude.item(), 9), round(absolute.amplitude.item(), 9)
    (0.01, 0.010049876)
    """
    check_dataset("result", result)
    motion = _FROM[check.one_of("where", where, _FROM)]
    prefix = {"points": "", "peaks": "peak_"}[check.one_of("kind", kind, ("points", "peaks"))]
    description = Description(result)
    bases = [b | {"motion": plain(b["motion"])} for b in description.problem.get("bases", [])]
    if not bases:
        raise ValueError(
            "result: expected a response to a symhbm.forces.BaseMotion, its base stands still"
        )
    name = f"{prefix}frequency" if f"{prefix}frequency" in result else "frequency"
    check_present(result, f"{prefix}coefficient", name, "force_amplitude", container="result")
    coefficient = result[f"{prefix}coefficient"].transpose(..., "dof", "harmonic", "component")
    about = None if description.output is None else description.outputs[description.output]
    for base in bases:
        if base["motion"]["motion"] != motion:
            sign = 1.0 if motion == "absolute" else -1.0
            moved = _moved(base, about)
            added = _added(base, moved, result, coefficient, result[name])
            coefficient = coefficient + sign * added
    coefficient = coefficient.transpose(..., "dof", "harmonic", "component")
    coefficient.attrs = dict(result[f"{prefix}coefficient"].attrs)
    what = "displacement" if about is None else f"{about.name.replace('_', ' ')} of displacements"
    units = "m" if about is None else about.units
    words = {"units": units, "long_name": f"largest {motion} {what} over the period"}
    amplitudes = xr.Variable(coefficient.dims[:-2], largest_of(*motions_of(coefficient)), words)
    attributes = result.attrs | {DISPLACEMENTS: SEEN[motion]}
    variables = {"coefficient": coefficient, "amplitude": amplitudes, name: result[name]}
    return xr.Dataset(variables, attrs=attributes)


def _moved(base: dict[str, Any], about: Output | None) -> FloatArray:
    """Where a unit motion of the base takes degrees of freedom, or rows of an output."""
    moved = np.array(base["influence"], dtype=float)
    if about is None:
        return moved
    unknown = abs(about.rows) @ np.isnan(moved).astype(float) > 0
    return np.where(unknown, np.nan, about.rows @ np.nan_to_num(moved))


def _added(
    base: dict[str, Any],
    moved: FloatArray,
    result: xr.Dataset,
    coefficient: xr.DataArray,
    frequency: xr.DataArray,
) -> xr.DataArray:
    """Coefficients of the motion of the base at all degrees of freedom."""
    dofs = np.atleast_1d(coefficient["dof"].values)
    if np.isnan(moved[dofs]).any():
        raise ValueError(
            "result: expected degrees of freedom, displacements of contacts do not tell how they "
            "move with the base; select others along dof"
        )
    given = base["motion"]
    order, number = next(
        (order, given[name])
        for order, name in enumerate(("displacement", "velocity", "acceleration"))
        if given[name] is not None
    )
    n = given["harmonic"]
    phase = number / abs(number) if number else 1.0
    size = result["force_amplitude"] * base["share"]
    phasor = size * phase / (1j * n * RADIANS * frequency) ** order
    unit = np.zeros((coefficient.sizes["harmonic"], 2))
    cosine, sine = unit.copy(), unit.copy()
    at = np.flatnonzero(np.atleast_1d(coefficient["harmonic"].values) == n)
    cosine[at, 0], sine[at, 1] = 1.0, -1.0
    dims = ("harmonic", "component")
    components = phasor.real * xr.DataArray(cosine, dims=dims)
    components = components + phasor.imag * xr.DataArray(sine, dims=dims)
    return components * xr.DataArray(moved[dofs], dims="dof")
