"""Events located between the solutions of a curve: changes of stability and phase resonances."""

import math
from itertools import groupby

import numpy as np

from symhbm.continuation import Event, PathState, corrector_of
from symhbm.numerics import Table
from symhbm.response.accuracy import Refinement, Solution
from symhbm.response.events.phase_resonances import phase_resonances
from symhbm.results import Request
from symhbm.time_domain import Change, Known, stability_changes


def events_between(
    request: Request, refinement: Refinement, solutions: list[Solution], points: Table
) -> tuple[list[Solution], list[tuple[int, Solution]], int]:
    """Solutions with events at them, new ones with the places they go before, how many lack.

    ``points`` are the results of the solutions; places are numbers of solutions, ascending.
    """
    solutions, tells = list(solutions), request.tells_stability
    nothing = np.zeros(len(solutions))
    rates, doublings = (
        points[name].tolist() if tells else nothing.tolist() for name in ("growth_rate", "doubling")
    )
    growths = zip(solutions, rates, doublings, strict=True)
    told = [_known(request, refinement, *of) for of in growths]
    inserted: list[tuple[int, Solution]] = []
    lost = first = 0
    for level, run in groupby(solutions, lambda solution: solution.level):
        last = first + len(list(run))
        corrector = corrector_of(refinement.equations(level))
        changes: list[Change] = []
        if tells:
            changes, more = stability_changes(corrector, told[first:last])
            beside = points["stability"][first - 1 : first + 1].tolist() if first else []
            lost += more + ({*beside} == {0, 1})
        if request.phase_resonances:
            resonances, more = phase_resonances(corrector, told[first:last])
            changes, lost = changes + resonances, lost + more
        for number, kind, state in changes:
            at, event = first + number, (Event(kind),)
            if state is None:
                solutions[at] = solutions[at]._replace(events=solutions[at].events + event)
                continue
            solution = Solution.at(float(state.state[-1]), level, state, 0)
            inserted.append((at + 1, solution._replace(events=event)))
        refinement.solves += corrector.solves
        first = last

    def along(new: tuple[int, Solution]) -> tuple[int, float]:
        place, solution = new
        return place, abs(solution.value - solutions[place - 1].value)

    return solutions, sorted(inserted, key=along), lost


def _known(
    request: Request, refinement: Refinement, solution: Solution, rate: float, doubling: float
) -> Known | None:
    """A solution as the search between two of them needs it, None where there is none."""
    if solution.unknowns is None or math.isnan(rate):
        return None
    state, (start, end) = np.append(solution.unknowns, solution.value), request.band
    # Tangents of solutions with more harmonics point along the parameter.
    turns = refinement.equations(solution.level).single_valued and end < start
    before, after = (
        PathState(state, -tangent if turns and tangent[-1] > 0 else tangent)
        for tangent in solution.tangents
    )
    return Known(before, after, rate, doubling, frozenset(e.kind for e in solution.events))
