"""What to measure next: which of some candidates make estimates surer, and by how much."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from symhbm.design.identification.objective import objective_of
from symhbm.design.identification.observations import Rows
from symhbm.numerics import FloatArray, check, on_one_thread
from symhbm.results import check_present
from symhbm.results.archive import rebuild

_CRITERIA = ("D", "A")


@on_one_thread
def next_measurements(
    fit: xr.Dataset, candidates: xr.Dataset, *, unknown: Any = None, criterion: str = "D"
) -> xr.Dataset:
    """Which sweeps make the estimates of a fit surest, by exact derivatives at the estimates.

    Parameters
    ----------
    fit
        A result of `symhbm.identify`.
    candidates
        Measurements that might be made, as of `symhbm.datasets.measured` with standard deviations;
        their values do not count. What has the same parameters of the test is one candidate.
    unknown
        The unknowns as `symhbm.identify` was given them; needed where some are functions of others,
        or alike in a pattern.
    criterion
        ``"D"`` ranks by the volume of the joint confidence region, ``"A"`` by the mean square of
        the standard errors, both of logarithms, or of values over their scale.

    Returns
    -------
    Dataset along ``candidate``, the best first: ``candidate_<parameter>`` of its test,
    ``information_gain`` (decrease of the logarithm of the volume), ``mean_square_error``, and along
    ``unknown`` the ``expected_error``, the standard error of each once it is measured, too, beside
    ``estimate`` and ``standard_error`` of the fit. `symhbm.plot.next_measurements` draws it.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, and candidates without standard deviations.

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
    >>> at, nothing = np.linspace(15, 24, 7), np.zeros(7) + 0j
    >>> response = sh.solve(problem, 20.0).coefficient.values.ravel() @ [1, -1j]
    >>> data = sh.datasets.measured(20.0, response, units="m", deviation=1e-6)
    >>> fit = sh.identify(problem, data, ["normal_load", "contact_stiffness"], progress=False)
    >>> levels = [[1e-5], [1.0], [3.0]]
    >>> candidates = sh.datasets.measured(
    ...     at, nothing, units="m", deviation=1e-6, force_amplitude=levels
    ... )
    >>> ranked = next_measurements(fit, candidates)
    >>> ranked.candidate_force_amplitude.values.tolist()  # where nothing slips, nothing is learned
    [3.0, 1.0, 1e-05]
    """
    if not isinstance(fit, xr.Dataset) or "estimate_information" not in fit.variables:
        raise TypeError(f"fit={check.shown(fit)}: expected a result of symhbm.identify")
    check.one_of("criterion", criterion, _CRITERIA)
    check_present(fit, "unknown", "estimate")
    rows = Rows.of(candidates)
    if not rows.has_noise:
        raise ValueError("candidates: expected standard deviations, of the response in its units")
    labels = fit["unknown"].values.tolist()
    ends = np.column_stack([fit["estimate_lower"], fit["estimate_upper"]]).tolist()
    given = dict(zip(labels, ends, strict=True)) if unknown is None else unknown
    objective = objective_of(rebuild(fit), rows, given, fit, checked=False)
    if objective.unknowns.labels != labels:
        raise ValueError(f"unknown: expected those of the fit, {', '.join(map(str, labels))}")
    point = objective.at(objective.unknowns.start)
    slopes = point.all_slopes / rows.scales[:, None]
    known = fit["estimate_information"].values
    table: dict[str, list[Any]] = {name: [] for name in ("gain", "square", "errors")}
    for curve in objective.curves:
        own = slopes[np.concatenate(curve.rows)]
        errors = _variances(known + own.T @ own)
        table["gain"].append(_volume(known + own.T @ own) - _volume(known))
        table["square"].append(float(np.mean(errors)))
        steps = zip(objective.unknowns.each, point.x, strict=True)
        scale = np.array([abs(one.of_variable(x)[1]) for one, x in steps])
        table["errors"].append(scale * np.sqrt(errors))
    key = -np.array(table["gain"]) if criterion == "D" else np.array(table["square"])
    order = np.argsort(key, kind="stable")
    settings = [objective.curves[i].setting for i in order]
    variables: dict[str, Any] = {
        f"candidate_{name}": ("candidate", [one.get(name, np.nan) for one in settings], {})
        for name in dict.fromkeys(name for one in settings for name in one)
    }
    about = {"units": "1", "long_name": "decrease of the logarithm of the confidence volume"}
    variables["information_gain"] = "candidate", np.array(table["gain"])[order], about
    about = {"units": "1", "long_name": "mean square of expected errors of the variables"}
    variables["mean_square_error"] = "candidate", np.array(table["square"])[order], about
    about = {"units": "unknown_units", "long_name": "standard error once it is measured, too"}
    dims = "candidate", "unknown"
    variables["expected_error"] = dims, np.array(table["errors"])[order], about
    known_too = {name: fit[name] for name in ("estimate", "standard_error")}
    named = {name: fit[name] for name in ("unknown", "unknown_units")}
    return xr.Dataset(variables | known_too, named)


def _volume(information: FloatArray) -> float:
    """Logarithm of the inverse volume of a confidence region, minus infinity where it has none."""
    sign, size = np.linalg.slogdet(information)
    return float(size) / 2 if sign > 0 else -np.inf


def _variances(information: FloatArray) -> FloatArray:
    """Variances of the variables, infinite where nothing is known of them."""
    values, directions = np.linalg.eigh(information)
    seen = values > 1e-14 * max(values[-1], 0.0)
    variances = (directions[:, seen] ** 2 / values[seen]).sum(axis=1)
    hidden = (directions[:, ~seen] ** 2).sum(axis=1) > 1e-12
    return np.where(hidden, np.inf, variances)
