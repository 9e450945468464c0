"""Certificate of a design: proved and unproved statements, with figures."""

from collections.abc import Sequence

import numpy as np

from symhbm.continuation import Status
from symhbm.design.descent import AGREE, are_flat, is_flat
from symhbm.design.optimum import LEVEL
from symhbm.design.program import AT_BOUND, Program, Statistic
from symhbm.design.search import SearchResult
from symhbm.numerics import RADIANS
from symhbm.peaks import MaximumKind

STATIONARY = 1e-8
"""Largest slope of the statistic's logarithm over those of the variables at an optimum."""


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
    if active.stationarity > STATIONARY or active.curvature < -LEVEL:
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
            "Not proved: that cubic springs make no larger response that this path does not visit."
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
        descent.converged and descent.design.value <= design.value + AGREE
        for descent in search_result.descents
    )
    sentences.append(
        "Not proved: that no other design within the bounds is better. "
        f"{len(search_result.starts)} designs were surveyed first, the lowest with "
        f"{np.exp(min(values)):.4g} m; {n_same} of {len(search_result.descents)} descents ended "
        "here."
    )
    higher = sorted(
        {
            f"{np.exp(d.design.value):.6g} m"
            for d in search_result.descents
            if d.converged and d.design.value > design.value + AGREE
        }
    )
    if higher:
        sentences.append(f"Other minima that were found are higher: {', '.join(higher)}.")
    bound = [
        f"{group.label} at its {'lower' if low else 'upper'} bound"
        for group, low, high, free in zip(
            variables.groups,
            design.x - variables.lower <= AT_BOUND,
            variables.upper - design.x <= AT_BOUND,
            active.free if active is not None else np.ones(variables.n_variables, bool),
            strict=True,
        )
        if not free and (low or high)
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
        maximum = followed.maximum
        kind = {
            MaximumKind.SMOOTH: "a smooth peak",
            MaximumKind.CORNER: "a corner",
            MaximumKind.EDGE: "the end of the band",
        }[maximum.kind]
        of_case = f" of case {case}" if n_cases > 1 else ""
        names.append(f"{kind}{of_case} at {maximum.frequency / RADIANS:.8g} Hz")
    shown = [*dict.fromkeys(names)]
    if len(shown) > 6:
        shown = [*shown[:6], f"{len(shown) - 6} more"]
    sentences = [
        f"It is held by {', '.join(shown)}; the slopes that nothing holds are below "
        f"{max(active.stationarity, 1e-16):.1e} of the response per logarithm of a value."
    ]
    curvature = active.curvature
    if np.isinf(curvature):
        sentences.append("The response rises linearly in every direction: a strict local minimum.")
    elif abs(curvature) <= LEVEL:
        sentences.append(
            "The curvature vanishes in some direction: designs along it may be as good, or better."
        )
    elif curvature > 0:
        sentences.append(
            f"The smallest curvature there is {curvature:.4g}: a strict local minimum."
        )
    else:
        sentences.append(
            f"The smallest curvature there is {curvature:.4g}: a lower response may lie close by."
        )
    if any(followed.maximum.kind == MaximumKind.EDGE for followed in active.maxima):
        sentences.append(
            "The largest response lies at an end of the band, not at a peak: a resonance may have "
            "left the band and be higher outside."
        )
    return sentences
