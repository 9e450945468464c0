"""What to measure next: how sure each of some candidates would make the estimates of a fit."""

from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.plot.drawing import LINE_STYLES, axis_label, is_wide, shades
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.results import check_dataset, check_present

_CANDIDATE = "candidate_"


@pictured
def next_measurements(dataset: xr.Dataset, **common: Unpack[Look]) -> Picture:
    """Draw the standard errors of estimates after each of some measurements, relative to these.

    Over the one parameter that candidates differ by, or else over their rank; thin lines are the
    errors of the fit as it is, and the filled marks are those of the best candidate.

    Parameters
    ----------
    dataset
        A result of `symhbm.design.identification.next_measurements`.
    common
        As of all pictures.

    Returns
    -------
    The figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For no dataset, one without candidates, and axes that are none.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> from symhbm.design.identification import next_measurements
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> response = sh.solve(problem, 20.0).coefficient.values.ravel() @ [1, -1j]
    >>> data = sh.datasets.measured(20.0, response, units="m", deviation=1e-6)
    >>> fit = sh.identify(problem, data, ["normal_load", "contact_stiffness"], progress=False)
    >>> candidates = sh.datasets.measured(
    ...     20.0, 0j, units="m", deviation=1e-6, force_amplitude=[0.5, 1, 2]
    ... )
    >>> sh.plot.next_measurements(next_measurements(fit, candidates)).savefig("next.png")
    """
    check_dataset("dataset", dataset)
    if "expected_error" not in dataset.variables:
        raise TypeError("dataset: expected a result of next_measurements")
    check_present(dataset, "unknown", "estimate", "standard_error")
    size, label = dataset.sizes["candidate"], "rank"
    values = np.arange(1.0, size + 1)
    names = [str(name) for name in dataset.variables if str(name).startswith(_CANDIDATE)]
    differ = [name for name in names if len({*dataset[name].values.tolist()}) > 1]
    if len(differ) == 1:
        values = dataset[differ[0]].values.astype(float)
        label = axis_label(dataset, differ[0].removeprefix(_CANDIDATE))
    errors = dataset["expected_error"].values / np.abs(dataset["estimate"].values)
    known = dataset["standard_error"].values / np.abs(dataset["estimate"].values)
    drawn = np.concatenate([errors.ravel(), known])
    drawn = drawn[np.isfinite(drawn)]
    panel = Panel(
        Axis(label, log=is_wide(values)), Axis("standard error, relative", log=is_wide(drawn))
    )
    order = np.argsort(values, kind="stable")
    ends = values[order[[0, -1]]]
    labels = [str(one).replace("_", " ") for one in dataset["unknown"].values]
    for number, (text, color) in enumerate(zip(labels, shades(len(labels)), strict=True)):
        look: Any = dict(color=color, linestyle=LINE_STYLES[number % len(LINE_STYLES)])
        mark: Any = dict(marker="o", markersize=5)
        white = look | mark | dict(markerfacecolor="white")
        panel.line(values[order], errors[order, number], text, **white)
        panel.line(values[:1], errors[:1, number], color=color, linestyle="", **mark)
        panel.line(ends, np.full(2, known[number]), linewidth=0.6, **look)
    return Picture([panel])
