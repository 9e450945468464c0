"""The best value of a parameter as variables of a dataset, with what was checked of it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.continuation import EventKind, SolveError, Status
from symhbm.design.flutter.limits import ModeSurface, SurfacePoint
from symhbm.design.flutter.optimum import LEVEL, Optimum, OptimumKind
from symhbm.design.outcome import labelled, with_certificate
from symhbm.numerics import FloatArray
from symhbm.results import Request

GOOD = (Status.DAMPING_LARGEST, Status.DAMPING_AT_BOUND, Status.DAMPING_ON_RANGE)
"""Statuses of an answer."""
_SCANNED = 9
"""Values over the bounds at which the mode is computed again, beside the best one."""
_DECADES = 2
"""Decades of the amplitude over which a mode is followed to where it is computed again."""
_KINDS = {
    OptimumKind.MAXIMUM: "a maximum, where the exact slope is 0",
    OptimumKind.CORNER: "a corner, where the slope changes its sign",
    OptimumKind.BOUND: "a bound of the parameter",
    OptimumKind.RANGE: "a range of values that are as good as each other",
}


def scanned_values(bounds: tuple[float, float], best: float) -> FloatArray:
    """Values over the bounds, and the best one, ascending."""
    low, high = sorted(bounds)
    spread = np.linspace(low, high, _SCANNED)
    if low > 0:
        spread = np.clip(np.geomspace(low, high, _SCANNED), low, high)
    return np.unique(np.append(spread, best))


def scan(surface: ModeSurface, values: FloatArray, amplitudes: FloatArray) -> FloatArray:
    """Largest damping ratio at some amplitudes and each of some values, NaN where there is none.

    The mode is followed over the amplitude there, from the linear one, not over the parameter.
    """
    place, ratios = surface.curve.damping_place, np.full(len(values), np.nan)
    low = amplitudes[0] / 10.0**_DECADES if len(amplitudes) == 1 else amplitudes[0]
    for i, value in enumerate(values.tolist()):
        try:
            branch = surface.over_amplitude(value, (low, amplitudes[-1]))
        except (ArithmeticError, ValueError):
            continue
        folds = any(e.kind == EventKind.FOLD for point in branch.points for e in point.events)
        if branch.status != Status.REACHED_END and not folds:
            continue
        found = [
            float(state.state[place])
            for amplitude in amplitudes
            for state, _ in branch.at(float(np.log10(amplitude)))
            if state is not None
        ]
        ratios[i] = max(found, default=np.nan)
    return ratios


def is_surpassed(optimum: Optimum, scanned: FloatArray) -> bool:
    """Whether a scan found more than the best value has."""
    told = scanned[np.isfinite(scanned)]
    largest = float(np.abs(told).max(initial=0.0))
    return bool(np.any(told > optimum.best.damping_ratio + LEVEL * largest))


def report(
    problem: HarmonicBalance,
    request: Request,
    optimum: Optimum | None,
    point: SurfacePoint | None,
    scanned: tuple[FloatArray, FloatArray],
) -> xr.Dataset:
    """All variables of a design; ``point`` is the mode at the best value."""
    label = request.name if request.index is None else f"{request.name}[{request.index}]"
    units = problem.records[request.name].units
    low, high = sorted(request.band)
    unknown = np.full(1, np.nan)
    value = first = last = unknown
    candidates, ratio, slope = (), np.nan, np.nan
    if optimum is not None:
        candidates, ratio = optimum.candidates, optimum.best.damping_ratio
        first, last = np.array([optimum.first]), np.array([optimum.last])
        value = unknown if optimum.best.kind == OptimumKind.RANGE else first
    if point is not None:
        slope = point.by_value * point.value
    table: dict[str, Any] = {
        "variable": ("variable", np.array([label], dtype=object)),
        "variable_units": ("variable", np.array([units], dtype=object)),
        "design_value": ("variable", value),
        "design_from": ("variable", first),
        "design_to": ("variable", last),
        "design_lower": ("variable", np.array([low])),
        "design_upper": ("variable", np.array([high])),
        "design_damping_ratio": ((), ratio),
        "design_slope": ((), slope),
        "candidate_value": ("candidate", _column([c.value for c in candidates])),
        "candidate_damping_ratio": ("candidate", _column([c.damping_ratio for c in candidates])),
        "candidate_kind": ("candidate", np.array([str(c.kind) for c in candidates], dtype=object)),
        "scan_value": ("scan", scanned[0]),
        "scan_damping_ratio": ("scan", scanned[1]),
    }
    return labelled(table)


def _column(values: Sequence[float]) -> FloatArray:
    return np.array(values, dtype=float)


def certificate(
    what: str,
    followed: str,
    optimum: Optimum | None,
    point: SurfacePoint | None,
    scanned: tuple[FloatArray, FloatArray],
    complete: bool,
) -> str:
    """Sentences on what was found and checked of the best value, and what was not."""
    if optimum is None:
        return f"Nothing was found: {what} is not known anywhere within the bounds."
    best, sentences = optimum.best, []
    at = f"{best.value:.10g}"
    if best.kind == OptimumKind.RANGE:
        at = f"every value from {optimum.first:.10g} to {optimum.last:.10g} that was computed"
    sentences.append(
        f"Found: at {at} {what} is {best.damping_ratio:.10g}, {_KINDS[best.kind]}; {followed}."
    )
    if best.damping_ratio <= 0:
        sentences.append("It is not positive: the structure feeds this vibration by itself.")
    if point is not None:
        sentences.append(
            f"Checked: computed again there, the equations hold to {point.residual_norm:.1e} and "
            f"the slope by the logarithm of the parameter is {point.by_value * point.value:.1e}."
        )
    others = [c for c in optimum.candidates if c.value != best.value]
    if others:
        second = max(others, key=lambda candidate: candidate.damping_ratio)
        sentences.append(
            f"The next best is {second.damping_ratio:.6g} at {second.value:.6g}, {second.kind}."
        )
    if not complete:
        sentences.append("Not proved: that no value which was not followed is better.")
    told = scanned[1][np.isfinite(scanned[1])]
    if told.size:
        verdict = "none is larger"
        if is_surpassed(optimum, told):
            verdict = f"the largest of them, {told.max():.6g}, is larger"
        sentences.append(
            f"At {told.size} values over the bounds the mode was followed over its amplitude "
            f"instead, from the linear one: {verdict}."
        )
    if complete:
        sentences.append("Not proved: that the mode has no other motions of these amplitudes.")
    return "\n".join(sentences)


def finished(result: xr.Dataset, status: Status, text: str, throw: bool) -> xr.Dataset:
    """The dataset with its status and certificate; SolveError without an answer if asked for."""
    result = with_certificate(result, status, text)
    if throw and status not in GOOD:
        raise SolveError(str(status), result)
    return result
