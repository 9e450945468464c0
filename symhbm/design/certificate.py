"""Certificate of a design: proved and unproved statements, with figures."""

from collections.abc import Sequence

import numpy as np

from symhbm.continuation import Status
from symhbm.design import tolerances
from symhbm.design.descent import are_flat, is_flat
from symhbm.design.program import Program, Statistic
from symhbm.design.search import SearchResult
from symhbm.numerics import RADIANS
from symhbm.peaks import MaximumKind

_KINDS = {
    MaximumKind.SMOOTH: "a smooth peak",
    MaximumKind.CORNER: "a corner",
    MaximumKind.EDGE: "the end of the band",
}


def status_of(program: Program, search_result: SearchResult) -> Status:
    """Status of a search."""
    design, active = search_result.design, search_result.active
    if not np.isfinite(design.value):
        unbounded = any("unbounded" in state.reason for state in design.states)
        return Status.DESIGN_UNBOUNDED if unbounded else Status.DESIGN_NOT_SURVEYED
    if not any(state.n_peaks for state in design.states):
        return Status.DESIGN_WITHOUT_PEAK
    if active is None and not is_flat(design):
        return Status.DESIGN_STALLED
    if active is None or are_flat(active.maxima):
        flat = all(is_flat(start) for start in search_result.starts)
        return Status.DESIGN_WITHOUT_EFFECT if flat else Status.DESIGN_ON_PLATEAU
    if active.stationarity > tolerances.STATIONARY or active.curvature < -tolerances.LEVEL:
        return Status.DESIGN_STALLED
    if any(followed.maximum.kind == MaximumKind.EDGE for followed in active.maxima):
        return Status.DESIGN_AT_EDGE
    if not active.free.all():
        return Status.DESIGN_AT_BOUND
    return Status.DESIGN_OPTIMAL


def certificate(
    program: Program,
    search_result: SearchResult,
    bands: Sequence[tuple[float, float]],
    n_cases: int,
    unique: bool = True,
) -> str:
    """Sentences on the largest response, the active maxima and bounds, and the search.

    ``unique`` tells that there is one response at every frequency: the branch has all of them.
    """
    design, active, variables = search_result.design, search_result.active, program.variables
    sentences = []
    where = " and ".join(f"{low:g} to {high:g} Hz" for low, high in bands)
    quantity = {
        Statistic.WORST: "the largest response",
        Statistic.MEAN: f"the mean of the largest responses of {n_cases} cases",
        Statistic.TAIL: (
            f"the mean of the largest responses of the worst {100 * program.tail:g} % of "
            f"{n_cases} cases"
        ),
    }[program.statistic]
    if n_cases > 1 and program.statistic == Statistic.WORST:
        quantity += f" of {n_cases} cases"
    if not np.isfinite(design.value):
        reasons = "; ".join(dict.fromkeys(state.reason for state in design.states if state.reason))
        return f"Nothing is proved: {quantity} is not bounded at any design tried ({reasons})."
    path = "" if unique else ", on the path that was followed,"
    sentences.append(
        f"Proved: at this design {quantity} over {where}{path} is {np.exp(design.value):.10g} m; "
        "the whole band was followed, with every peak and both ends."
    )
    if not unique:
        sentences.append(
            "Not proved: that contacts or negative damping make no larger response that this path "
            "does not visit."
        )
    if active is not None and not are_flat(active.maxima):
        sentences += _active_maxima(search_result, n_cases)
    elif active is None and not is_flat(design):
        sentences.append("Not proved: that it is a minimum, as no exact condition holds there.")
    else:
        sentences.append(
            "The response does not change with the design here: contacts never slip, or a maximum "
            "that they do not touch is the largest."
        )
    if not any(state.n_peaks for state in design.states):
        sentences.append(
            "The band holds no peak at this design: the largest response lies at an end of it, and "
            "a resonance outside may be higher."
        )
    values = [start.value for start in search_result.starts if np.isfinite(start.value)]
    n_same = sum(
        descent.converged and descent.design.value <= design.value + tolerances.AGREE
        for descent in search_result.descents
    )
    sentences.append(
        "Not proved: that no other design within the bounds is better. "
        f"{len(search_result.starts)} designs were surveyed first, the lowest with "
        f"{np.exp(min(values)):.4g} m; {n_same} of {len(search_result.descents)} descents ended "
        "here."
    )
    others = [d.design.value for d in search_result.descents if d.converged]
    above = [value for value in others if value > design.value + tolerances.AGREE]
    higher = sorted({f"{np.exp(value):.6g} m" for value in above})
    if higher:
        sentences.append(f"Other minima that were found are higher: {', '.join(higher)}.")
    held = np.zeros(variables.n_variables, bool) if active is None else ~active.free
    at_lower = held & (design.x - variables.lower <= tolerances.AT_BOUND)
    at_upper = held & (variables.upper - design.x <= tolerances.AT_BOUND) & ~at_lower
    bound = [
        f"{group.label} at its {'lower' if low else 'upper'} bound"
        for group, low, high in zip(variables.groups, at_lower, at_upper, strict=True)
        if low or high
    ]
    if active is not None and len(active.rows):
        sentences.append("Held by the constraint: without it the response would be lower.")
    if bound:
        sentences.append(f"Held by a bound: {', '.join(bound)}.")
    return " ".join(sentences)


def _active_maxima(search_result: SearchResult, n_cases: int) -> list[str]:
    active = search_result.active
    assert active is not None
    names = []
    for case, followed in zip(active.cases, active.maxima, strict=True):
        of_case = f" of case {case}" if n_cases > 1 else ""
        frequency = followed.maximum.frequency / RADIANS
        names.append(f"{_KINDS[followed.maximum.kind]}{of_case} at {frequency:.8g} Hz")
    shown = [*dict.fromkeys(names)]
    if len(shown) > 6:
        shown = [*shown[:6], f"{len(shown) - 6} more"]
    sentences = [
        f"It is held by {', '.join(shown)}; the slopes that nothing holds are below "
        f"{max(active.stationarity, 1e-16):.1e} of the response per logarithm of a value."
    ]
    curvature = active.curvature
    smallest = f"The smallest curvature there is {curvature:.4g}"
    if np.isinf(curvature):
        sentences.append("The response rises linearly in every direction: a strict local minimum.")
    elif abs(curvature) <= tolerances.LEVEL:
        sentences.append(
            "The curvature vanishes in some direction: designs along it may be as good, or better."
        )
    elif curvature > 0:
        sentences.append(f"{smallest}: a strict local minimum.")
    else:
        sentences.append(f"{smallest}: a lower response may lie close by.")
    if any(followed.maximum.kind == MaximumKind.EDGE for followed in active.maxima):
        sentences.append(
            "The largest response lies at an end of the band, not at a peak: a resonance may have "
            "left the band and be higher outside."
        )
    return sentences
