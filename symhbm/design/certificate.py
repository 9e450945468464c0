"""What was proved of a design and what was not, in plain sentences with the figures."""

from collections.abc import Sequence

import numpy as np

from symhbm.continuation import Status
from symhbm.design.descent import AGREE, are_flat, is_flat
from symhbm.design.optimum import LEVEL
from symhbm.design.program import AT_BOUND, Program, Statistic
from symhbm.design.search import Found
from symhbm.numerics import RADIANS
from symhbm.peaks import MaximumKind

STATIONARY = 1e-8
"""Slope of the statistic's logarithm over those of the variables below which it is none."""


def status_of(program: Program, found: Found) -> Status:
    """How a search ended."""
    design, held = found.design, found.held
    if not np.isfinite(design.value):
        unbounded = any("unbounded" in state.reason for state in design.states)
        return Status.DESIGN_UNBOUNDED if unbounded else Status.DESIGN_NOT_SURVEYED
    if not any(state.n_peaks for state in design.states):
        return Status.DESIGN_WITHOUT_PEAK
    if held is None and not is_flat(design):
        return Status.DESIGN_STALLED
    if held is None or are_flat(held.pieces):
        flat = all(is_flat(each) for each in found.starts)
        return Status.DESIGN_WITHOUT_EFFECT if flat else Status.DESIGN_ON_PLATEAU
    if held.stationarity > STATIONARY or held.curvature < -LEVEL:
        return Status.DESIGN_STALLED
    if any(piece.summit.kind == MaximumKind.EDGE for piece in held.pieces):
        return Status.DESIGN_AT_EDGE
    if not held.free.all():
        return Status.DESIGN_AT_BOUND
    return Status.DESIGN_OPTIMAL


def certificate(
    program: Program,
    found: Found,
    bands: Sequence[tuple[float, float]],
    n_cases: int,
    unique: bool = True,
) -> str:
    """Sentences: what is largest where, what holds the design, and how it was searched for.

    ``unique`` tells that there is one response at every frequency, so that the path has them all.
    """
    design, held, space = found.design, found.held, program.space
    said = []
    where = " and ".join(f"{low:g} to {high:g} Hz" for low, high in bands)
    what = {
        Statistic.WORST: "the largest response",
        Statistic.MEAN: f"the mean of the largest responses of {n_cases} cases",
        Statistic.TAIL: (
            f"the mean of the largest responses of the worst {100 * program.tail:g} % of "
            f"{n_cases} cases"
        ),
    }[program.statistic]
    if n_cases > 1 and program.statistic == Statistic.WORST:
        what += f" of {n_cases} cases"
    if not np.isfinite(design.value):
        reasons = "; ".join(dict.fromkeys(state.reason for state in design.states if state.reason))
        return f"Nothing is proved: {what} is not bounded at any design tried ({reasons})."
    path = "" if unique else ", on the path that was followed,"
    said.append(
        f"Proved: at this design {what} over {where}{path} is {np.exp(design.value):.10g} m; the "
        "whole band was followed, with every peak and both ends."
    )
    if not unique:
        said.append(
            "Not proved: that cubic springs make no larger response that this path does not visit."
        )
    if held is not None and not are_flat(held.pieces):
        said += _held_by(found, n_cases)
    elif held is None and not is_flat(design):
        said.append("Not proved: that it is a minimum, as no exact condition holds there.")
    else:
        said.append(
            "The response does not change with the design here: contacts never slip, or a maximum "
            "that they do not touch is the largest."
        )
    if not any(state.n_peaks for state in design.states):
        said.append(
            "The band holds no peak at this design: the largest response lies at an end of it, and "
            "a resonance outside may be higher."
        )
    values = [each.value for each in found.starts if np.isfinite(each.value)]
    n_same = sum(
        each.converged and each.design.value <= design.value + AGREE for each in found.descents
    )
    said.append(
        "Not proved: that no other design within the bounds is better. "
        f"{len(found.starts)} designs were surveyed first, the lowest with "
        f"{np.exp(min(values)):.4g} m; {n_same} of {len(found.descents)} descents ended here."
    )
    higher = sorted(
        {
            f"{np.exp(d.design.value):.6g} m"
            for d in found.descents
            if d.converged and d.design.value > design.value + AGREE
        }
    )
    if higher:
        said.append(f"Other minima that were found are higher: {', '.join(higher)}.")
    bound = [
        f"{group.label} at its {'lower' if low else 'upper'} bound"
        for group, low, high, free in zip(
            space.groups,
            design.x - space.lower <= AT_BOUND,
            space.upper - design.x <= AT_BOUND,
            held.free if held is not None else np.ones(space.n_variables, bool),
            strict=True,
        )
        if not free and (low or high)
    ]
    if held is not None and len(held.rows):
        said.append("Held by the constraint: without it the response would be lower.")
    if bound:
        said.append(f"Held by a bound: {', '.join(bound)}.")
    return " ".join(said)


def _held_by(found: Found, n_cases: int) -> list[str]:
    held = found.held
    assert held is not None
    names = []
    for case, piece in zip(held.cases, held.pieces, strict=True):
        summit = piece.summit
        kind = {
            MaximumKind.SMOOTH: "a smooth peak",
            MaximumKind.CORNER: "a corner",
            MaximumKind.EDGE: "the end of the band",
        }[summit.kind]
        of_case = f" of case {case}" if n_cases > 1 else ""
        names.append(f"{kind}{of_case} at {summit.frequency / RADIANS:.8g} Hz")
    shown = [*dict.fromkeys(names)]
    if len(shown) > 6:
        shown = [*shown[:6], f"{len(shown) - 6} more"]
    said = [
        f"It is held by {', '.join(shown)}; the slopes that nothing holds are below "
        f"{max(held.stationarity, 1e-16):.1e} of the response per logarithm of a value."
    ]
    curvature = held.curvature
    if np.isinf(curvature):
        said.append("The response rises linearly in every direction: a strict local minimum.")
    elif abs(curvature) <= LEVEL:
        said.append(
            "The curvature vanishes in some direction: designs along it may be as good, or better."
        )
    elif curvature > 0:
        said.append(f"The smallest curvature there is {curvature:.4g}: a strict local minimum.")
    else:
        said.append(
            f"The smallest curvature there is {curvature:.4g}: a lower response may lie close by."
        )
    if any(piece.summit.kind == MaximumKind.EDGE for piece in held.pieces):
        said.append(
            "The largest response lies at an end of the band, not at a peak: a resonance may have "
            "left the band and be higher outside."
        )
    return said
