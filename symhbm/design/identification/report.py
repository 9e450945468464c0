"""A fit as a labelled dataset: estimates, errors, residuals, and sentences on all of it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.design.identification.certainty import Certainty, Remains, probability_of, remains
from symhbm.design.identification.estimate import Descent
from symhbm.design.identification.kinds import Curve
from symhbm.design.identification.observations import Rows
from symhbm.numerics import RADIANS, FloatArray
from symhbm.response import frf, nonlinear_modes
from symhbm.results.reading import with_curve_status

_BESIDE = 0.1
"""How far beside a single frequency, relative, the response is followed."""
_UNLIKELY = 1e-3
"""Probability below which residuals are told to be more than noise."""
FOUND = "the optimum was found"
_MEANINGS = {
    "unknown": ("1", "name of an unknown of the fit"),
    "unknown_units": ("1", "unit of the unknown"),
    "estimate": ("unknown_units", "estimated value"),
    "estimate_lower": ("unknown_units", "lower bound of the unknown"),
    "estimate_upper": ("unknown_units", "upper bound of the unknown"),
    "standard_error": ("unknown_units", "standard error by the Jacobian"),
    "exact_standard_error": ("unknown_units", "standard error by the exact Hessian"),
    "interval": ("unknown_units", "confidence interval by the standard error"),
    "profile_interval": ("unknown_units", "confidence interval by the profile likelihood"),
    "estimate_correlation": ("1", "correlation of two estimates"),
    "estimate_covariance": ("1", "covariance of logarithms, or of values over their scale"),
    "estimate_information": ("1", "information on the same, the inverse of their covariance"),
    "singular_value": ("1", "how much measurements see a direction, relative"),
    "seen_direction": ("1", "share of an unknown in the direction of a singular value"),
    "computed_value": ("1", "value that the fit gives in the place of the measured one"),
    "measured_residual": ("1", "computed less measured value, in standard deviations"),
    "noise_level": ("1", "estimated standard deviation of all measurements in SI units"),
    "curve_chi_square": ("1", "sum of squares of the residuals of a curve"),
    "curve_size": ("1", "number of fitted measurements of a curve"),
    "curve_correlation": ("1", "correlation of neighbouring residuals along the frequency"),
    "curve_predicted": ("1", "mean square of the residuals of a curve that the fit leaves out"),
    "start_estimate": ("unknown_units", "estimate that a start led to"),
    "start_sum": ("1", "sum of squares that a start led to"),
    "status": ("1", "how the fit ended"),
    "certificate": ("1", "what was found and checked of the fit, and what was not"),
}


def report(
    problem: HarmonicBalance,
    rows: Rows,
    certainty: Certainty,
    profiles: FloatArray,
    descents: Sequence[Descent],
    sentences: Sequence[str],
    predicted: FloatArray | None,
) -> xr.Dataset:
    """The responses of the problem with its estimates under all settings, and all of the fit."""
    point, unknowns = certainty.point, certainty.point.objective.unknowns
    best = problem.with_parameters(**unknowns.parameters(point.x))
    result = responses(best, point.objective.curves)
    left = remains(point, certainty.noise)
    ended = [one.point for one in descents if one.point is not None]
    errors = certainty.errors
    table: dict[str, Any] = {
        "unknown": ("unknown", np.array(unknowns.labels, dtype=object)),
        "unknown_units": ("unknown", np.array([u.units for u in unknowns.each], dtype=object)),
        "estimate": ("unknown", unknowns.values(point.x)),
        "estimate_lower": ("unknown", np.array([u.lower for u in unknowns.each])),
        "estimate_upper": ("unknown", np.array([u.upper for u in unknowns.each])),
        "standard_error": ("unknown", errors(certainty.covariance)),
        "exact_standard_error": ("unknown", errors(certainty.exact_covariance)),
        "interval": (("unknown", "end"), certainty.intervals()),
        "profile_interval": (("unknown", "end"), profiles),
        "estimate_correlation": (("unknown", "other_unknown"), certainty.correlation),
        "estimate_covariance": (("unknown", "other_unknown"), certainty.covariance),
        "estimate_information": (("unknown", "other_unknown"), certainty.information),
        "singular_value": ("direction", certainty.singular_values),
        "seen_direction": (("direction", "unknown"), certainty.directions),
        "computed_value": ("measurement", point.readings),
        "measured_residual": ("measurement", point.all_residuals / (certainty.noise or 1.0)),
        "curve_chi_square": ("curve", np.array([one.square for one in left])),
        "curve_size": ("curve", np.array([one.size for one in left], dtype=np.int32)),
        "curve_correlation": ("curve", np.array([one.correlation for one in left])),
        "start_estimate": (
            ("fit_start", "unknown"),
            np.array([unknowns.values(one.x) for one in ended]),
        ),
        "start_sum": ("fit_start", np.array([2 * one.value for one in ended])),
        "status": ((), sentences[0]),
        "certificate": ((), "\n".join(sentences)),
    }
    if not rows.has_noise:
        table["noise_level"] = ((), certainty.noise * float(rows.scales[0]))
    if predicted is not None:
        table["curve_predicted"] = ("curve", predicted)
    variables = {name: (*of, _about(name)) for name, of in table.items()}
    measured = {name: ("measurement", values) for name, values in rows.table.items()}
    return with_curve_status(result).assign(variables | measured)


def _about(name: str) -> dict[str, str]:
    units, meaning = _MEANINGS[name]
    return {"units": units, "long_name": meaning}


def responses(problem: HarmonicBalance, curves: Sequence[Curve]) -> xr.Dataset:
    """Responses of a problem over the frequencies of all measurements, under all settings."""
    bands = [curve.band for curve in curves if curve.band is not None]
    if not bands:
        return nonlinear_modes(problem, **curves[0].alone, progress=False)
    low, high = float(np.min(bands)), float(np.max(bands))
    if low == high:
        low, high = (1 - _BESIDE) * low, (1 + _BESIDE) * high
    settings = [curve.setting for curve in curves if curve.band is not None]
    different = [one for i, one in enumerate(settings) if one not in settings[:i]]
    names = list(different[0])
    over: dict[str, Any] = {}
    if len(names) == 1:
        over = {names[0]: sorted(one[names[0]] for one in different)}
    elif names:
        over = {
            name: xr.DataArray([one[name] for one in different], dims="setting") for name in names
        }
    down = all(curve.sweep == "down" for curve in curves)
    band = (high, low) if down else (low, high)
    return frf(problem, band, over=over or None, progress=False)


def sentences_of(
    certainty: Certainty, best: Descent, descents: Sequence[Descent], notes: Sequence[str]
) -> tuple[bool, list[str]]:
    """Whether all is well, the status, and what else is to be said of a fit."""
    point, rows = certainty.point, certainty.point.objective.rows
    told = certainty.words()
    unseen = [text for text in told if text.startswith("Not seen")]
    same = [d for d in descents if d.value <= best.value * 1.01 + 1e-12 * point.size**2]
    status, good = FOUND, best.converged
    if not best.converged and point.on_corners():
        status = (
            "the search ended on a corner, where a contact begins to slip at a measured frequency"
        )
    elif not best.converged:
        status = (
            f"the search ended {best.distance:.1e} standard errors from an optimum; begin it there "
            "(start=), or with narrower bounds"
        )
    if not point.is_found_again:
        good = False
        status += (
            ", but other solutions are found from scratch, with a sum of squares "
            f"{2 * point.afresh:.6g}: begin it at other values (start=), or with narrower bands "
            "of peaks"
        )
    square, degrees = 2 * point.value, certainty.degrees
    text = [f"{len(point.residuals)} residuals, {len(point.x)} unknowns, the sum of squares "]
    text[0] += f"is {square:.6g}; {len(same)} of {len(descents)} starts led there."
    if rows.has_noise:
        chance = probability_of(square, degrees)
        if chance < _UNLIKELY:
            good = False
            status += (
                f", but the residuals are {np.sqrt(square / degrees):.2g} times the noise that was "
                f"given (chance {chance:.1e}): the model, or the noise, is another"
            )
        elif degrees > 0:
            text.append(f"Noise alone leaves as much with a probability of {chance:.2g}.")
    elif degrees > 0:
        level = certainty.noise * float(rows.scales[0])
        text.append(f"The noise was estimated: {level:.4g} in SI units.")
    else:
        text.append("There are no more residuals than unknowns: nothing tells the noise.")
    if unseen:
        good = False
        status += f", but measurements do not see all of it. {' '.join(unseen)}"
    text += _alike(remains(point, certainty.noise), point.objective.curves)
    if certainty.loss != "linear":
        text.append(f"With the loss {certainty.loss!r} errors are those of the Jacobian alone.")
    text += [one for one in told if one not in unseen]
    text += notes
    text.append("Not proved: that no other values fit better.")
    return good, [status, *text]


def _alike(left: Sequence[Remains], curves: Sequence[Any]) -> list[str]:
    """Which curves have neighbouring residuals that are more alike than chance makes them."""
    worst = min(zip(left, curves, strict=True), key=lambda pair: pair[0].probability)
    one, curve = worst
    if one.size < 8 or one.probability * len(left) > _UNLIKELY:
        return []
    setting = ", ".join(f"{name}={value:g}" for name, value in curve.setting.items())
    ends = f"{curve.omegas.min() / RADIANS:.4g} to {curve.omegas.max() / RADIANS:.4g} Hz"
    return [
        f"Neighbouring residuals from {ends}{f' at {setting}' if setting else ''} are alike "
        f"(correlation {one.correlation:.2f}): the model leaves something unexplained."
    ]
