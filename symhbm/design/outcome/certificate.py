"""Certificate of a design: what was computed and checked, and what was not, with figures."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from symhbm.continuation import Status
from symhbm.design import tolerances
from symhbm.design.cases import Cases, NamedPeak, amplitudes
from symhbm.design.program import ActiveSet, Program, Statistic
from symhbm.design.search import Design, SearchResult, is_flat
from symhbm.numerics import RADIANS, FloatArray
from symhbm.peaks import COMPLETE, MaximumKind
from symhbm.results import Sweep

_KINDS = {
    MaximumKind.SMOOTH: "a smooth peak",
    MaximumKind.CORNER: "a corner",
    MaximumKind.EDGE: "the end of the band",
    MaximumKind.POINT: "the response",
}
_SAME = 1e-9
"""Largest relative difference of two surveys of one peak."""


def status_of(
    program: Program, search_result: SearchResult, failed: Sequence[tuple[FloatArray, str]] = ()
) -> Status:
    """Status of a search; ``failed`` are designs that could not be followed, and why."""
    design, active = search_result.design, search_result.active
    if not np.isfinite(design.value):
        unbounded = any("unbounded" in state.reason for state in design.states)
        return Status.DESIGN_UNBOUNDED if unbounded else Status.DESIGN_NOT_SURVEYED
    if any(state.failed for state in design.states):
        return Status.DESIGN_NOT_SURVEYED  # Its aim does not depend on the response.
    if active is None and not is_flat(program, design):
        return Status.DESIGN_STALLED
    if not _holds_peak(design):
        return Status.DESIGN_WITHOUT_PEAK
    if active is None or program.is_flat(active.maxima):
        flat = all(is_flat(program, start) for start in search_result.starts)
        return Status.DESIGN_WITHOUT_EFFECT if flat else Status.DESIGN_ON_PLATEAU
    if active.stationarity > tolerances.STATIONARY or active.curvature < -tolerances.LEVEL:
        return Status.DESIGN_STALLED
    if not program.limits.holds(design.x):
        return Status.DESIGN_STALLED
    if any(followed.maximum.kind == MaximumKind.EDGE for followed in active.maxima):
        return Status.DESIGN_AT_EDGE
    if any(_distance(design.x, x) <= tolerances.NEARBY for x, _ in failed):
        return Status.DESIGN_BESIDE_FAILURES
    if not active.free.all():
        return Status.DESIGN_AT_BOUND
    return Status.DESIGN_OPTIMAL


def _holds_peak(design: Design) -> bool:
    return any(state.n_peaks for state in design.states)


def _distance(x: FloatArray, other: FloatArray) -> float:
    return float(np.abs(x - other).max())


def certificate(
    program: Program,
    search_result: SearchResult,
    bands: Sequence[tuple[float, float]],
    cases: Cases,
    check: str = "",
) -> str:
    """Lines on the largest response, the active maxima and bounds, and the search.

    ``check`` is what was found when the response was followed once more.
    """
    design, active = search_result.design, search_result.active
    where = _where(bands)
    quantity = _quantity(program, cases.size // len(program.peaks))
    if not np.isfinite(design.value):
        reasons = "; ".join(dict.fromkeys(state.reason for state in design.states if state.reason))
        return f"Nothing is known: {quantity} is not bounded at any design tried ({reasons})."
    unique = cases.unique
    path = "" if unique else ", on the path that was followed,"
    peaks = cases.work.peaks
    unit = " m" if program.aims[0].is_peak else _peaks(program, peaks, design.states)
    followed = "the whole band was followed, and located peaks and both ends were compared"
    wide = any(low < high for low, high in bands)
    if not wide:
        followed = "the response there was solved for"
    sentences = [
        f"At this design {quantity} {where}{path} is {amplitudes(design.value):.10g}{unit}: "
        f"{followed}."
    ]
    if check:
        sentences.append(check)
    if not unique:
        sentences.append(
            "Not proved: that contacts or negative damping make no larger response that this path "
            "does not visit."
        )
    if active is not None and not program.is_flat(active.maxima):
        sentences += _held_by(program, active, cases)
        # Without a peak the response only falls away from a resonance outside.
        if _holds_peak(design):
            sentences += _curvature(program, active)
    elif active is None and not is_flat(program, design):
        sentences.append("Not found: a minimum, as no exact condition holds there.")
    else:
        sentences.append(
            "The response does not change with the design here: contacts never slip, or a maximum "
            "that they do not touch is the largest."
        )
    if not _holds_peak(design):
        sentences.append(
            "The band holds no peak at this design: the largest response lies at an end of it, and "
            "a resonance outside may be higher."
        )
    path = "that the path, whose steps are some percent of its length, passes over no narrower peak"
    path = f"{path}; and " if wide else ""
    sentences.append(f"Not proved: {path}that no other design within the bounds is better.")
    sentences += _search(search_result, "" if not unit.startswith(" m") else " m")
    if cases.failed:
        nearest = min(cases.failed, key=lambda entry: _distance(design.x, entry[0]))
        factor = np.exp(_distance(design.x, nearest[0]))
        sentences.append(
            f"Responses at {len(cases.failed)} designs could not be followed, the nearest at "
            f"values up to a factor of {factor:.3g} away ({nearest[1]}): what they are is not "
            "known, and better designs there were not found."
        )
    return "\n".join([*sentences, *_held(program, search_result)])


def _where(bands: Sequence[tuple[float, float]]) -> str:
    """Over which bands, and at which frequencies."""
    wide = " and ".join(f"{low:g} to {high:g} Hz" for low, high in bands if low < high)
    alone = " and ".join(f"{low:g} Hz" for low, high in bands if low == high)
    return " and ".join([f"over {wide}"] * bool(wide) + [f"at {alone}"] * bool(alone))


def _quantity(program: Program, n_cases: int) -> str:
    """What is minimised, in words."""
    if not program.aims[0].is_peak:
        name = program.aims[0].name
        return "the objective" if name == "objective" else f"the aim {name}"
    statistic = program.statistic
    of_cases = f"of {n_cases} cases"
    if statistic.kind == Statistic.MEAN:
        return f"the mean of the largest responses {of_cases}"
    if statistic.kind == Statistic.TAIL:
        share = f"the worst {100 * statistic.tail:g} %"
        return f"the mean of the largest responses of {share} {of_cases}"
    return "the largest response" + (f" {of_cases}" if n_cases > 1 else "")


def _peaks(program: Program, peaks: Sequence[NamedPeak], states: Sequence) -> str:
    values = amplitudes(program.levels(np.array([state.height for state in states])))
    told = [
        f"{peak.name} {value:.10g} {peak.units}" for peak, value in zip(peaks, values, strict=True)
    ]
    return f" (peaks: {', '.join(told)})"


def _search(search_result: SearchResult, unit: str) -> list[str]:
    """What was tried, and what else was found."""
    design, descents = search_result.design, search_result.descents
    values = [start.value for start in search_result.starts if np.isfinite(start.value)]
    n_same = sum(
        d.converged and d.design.value <= design.value + tolerances.AGREE for d in descents
    )
    sentences = [
        f"{len(search_result.starts)} designs were surveyed first, the lowest with "
        f"{amplitudes(min(values)):.4g}{unit}; {n_same} of {len(descents)} descents ended here."
    ]
    others = [descent.design.value for descent in descents if descent.converged]
    above = [value for value in others if value > design.value + tolerances.AGREE]
    higher = sorted({f"{np.exp(value):.6g}{unit}" for value in above})
    if higher:
        sentences.append(f"Other minima that were found are higher: {', '.join(higher)}.")
    return sentences


def _held(program: Program, search_result: SearchResult) -> list[str]:
    """The constraints and bounds that hold the design."""
    design, active, variables = search_result.design, search_result.active, program.variables
    if active is None:
        return []
    sentences = []
    if active.held:
        names = [name for name in active.held if name != "constraint"]
        of_name = f" {', '.join(names)}" if names else ""
        what = "response" if program.aims[0].is_peak else "aim"
        sentences.append(f"Held by the constraint{of_name}: without it the {what} would be lower.")
    at_lower = ~active.free & (design.x - variables.lower <= tolerances.AT_BOUND)
    at_upper = ~active.free & (variables.upper - design.x <= tolerances.AT_BOUND) & ~at_lower
    bound = [
        f"{group.label} at its {'lower' if low else 'upper'} bound"
        for group, low, high in zip(variables.groups, at_lower, at_upper, strict=True)
        if low or high
    ]
    return [*sentences, f"Held by a bound: {', '.join(bound)}."] if bound else sentences


def _held_by(program: Program, active: ActiveSet, cases: Cases) -> list[str]:
    """What holds the design, and how well."""
    names = []
    n_cases = cases.size // len(program.peaks)
    what = "response" if program.aims[0].is_peak else "aim"
    for number, followed in zip(active.cases, active.maxima, strict=True):
        peak, case = divmod(number, n_cases)
        of_case = f" of {program.peaks[peak]}" if len(program.peaks) > 1 else ""
        of_case += f" of case {case}" if n_cases > 1 else ""
        frequency = followed.maximum.frequency / RADIANS
        names.append(f"{_KINDS[followed.maximum.kind]}{of_case} at {frequency:.8g} Hz")
    shown = [*dict.fromkeys(names)]
    if len(shown) > 6:
        shown = [*shown[:6], f"{len(shown) - 6} more"]
    held = f"It is held by {', '.join(shown)}; the" if shown else "The"
    return [
        f"{held} slopes that nothing holds are below "
        f"{max(active.stationarity, 1e-16):.1e} of the {what} per logarithm of a value."
    ]


def _curvature(program: Program, active: ActiveSet) -> list[str]:
    """How the aim rises around the design."""
    what = "response" if program.aims[0].is_peak else "aim"
    sentences = []
    curvature = active.curvature
    smallest = f"The smallest curvature there is {curvature:.4g}"
    if np.isinf(curvature):
        sentences.append(
            f"By these slopes the {what} rises linearly in every direction: a strict local minimum."
        )
    elif abs(curvature) <= tolerances.LEVEL:
        sentences.append(
            "The curvature vanishes in some direction: designs along it may be as good, or better."
        )
    elif curvature > 0:
        sentences.append(f"{smallest}: a strict local minimum.")
    else:
        sentences.append(f"{smallest}: a lower {what} may lie close by.")
    if any(followed.maximum.kind == MaximumKind.EDGE for followed in active.maxima):
        sentences.append(
            "The largest response lies at an end of the band, not at a peak: a resonance may have "
            "left the band and be higher outside."
        )
    return sentences


class Comparison(NamedTuple):
    """Stored points and peaks within the bands, and the highest of them over what was said.

    ``complete`` tells that all curves reached the ends of their bands.
    """

    n_points: int
    n_peaks: int
    highest: float
    complete: bool

    @property
    def agrees(self) -> bool:
        """Whether no point and no peak is higher."""
        return self.complete and self.highest <= 1 + _SAME

    @property
    def text(self) -> str:
        """The sentence of a certificate."""
        what = f"of its {self.n_points} stored points and {self.n_peaks} peaks in the band"
        if not self.complete:
            return "The response, followed once more, did not reach the end of the band."
        if self.agrees:
            return f"Checked: the response was followed once more, and none {what} is higher."
        return (
            f"The check failed: the response was followed once more, and one {what} is higher by "
            f"{self.highest - 1:.1e}."
        )


def compared(result: xr.Dataset, sweep: Sweep, peak: NamedPeak, heights: FloatArray) -> Comparison:
    """Stored amplitudes of a response beside the logarithms of the largest (n_cases,) of a peak."""
    counts, highest = [0, 0], 0.0
    for number in range(sweep.size):
        index = np.unravel_index(number, sweep.shape) if sweep.shape else ()
        one = result.isel(dict(zip(sweep.dims, index, strict=True)))
        amplitude = one["amplitude"]
        amplitude = amplitude.max("dof") if peak.dof is None else amplitude.isel(dof=peak.dof)
        if peak.problem.goal is not None:
            amplitude = xr.full_like(amplitude, np.nan)  # of goals peaks alone are stored
        found = [(one["frequency"].values, amplitude.values)]
        if peak.dof is None:  # peaks that are stored are those of the largest response
            found.append((one["peak_frequency"].values, one["peak_amplitude"].values))
        for kind, (frequency, amplitude) in enumerate(found):
            bands = [(frequency >= low) & (frequency <= high) for low, high in peak.bands[number]]
            inside = np.any(bands, axis=0) & ~np.isnan(amplitude)
            counts[kind] += int(inside.sum())
            largest = amplitude[inside].max(initial=0.0)
            highest = max(highest, float(largest / np.exp(heights[number])))
    return Comparison(counts[0], counts[1], highest, is_complete(result))


def is_complete(result: xr.Dataset) -> bool:
    """Whether all curves of responses reached the ends of their bands."""
    return bool(result["status"].isin([*map(str, COMPLETE)]).all())
