"""Events located between the solutions of a curve: changes of stability and phase resonances.

At a phase resonance the response lags the force by a quarter of its period. There the force does
work alone, and stores nothing in the mean: over all force levels these points are the backbone of a
resonance.

Reference: S. Peter, R.I. Leine, Excitation power quantities in phase resonance testing of nonlinear
systems with phase-locked-loop excitation, Mechanical Systems and Signal Processing 96 (2017),
139-158.
"""

import math
from collections.abc import Sequence
from functools import partial
from itertools import groupby, pairwise

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import (
    ContinuationProblem,
    Corrector,
    Event,
    EventKind,
    PathState,
    corrector_of,
    slope_of,
)
from symhbm.numerics import FloatArray, Table
from symhbm.response.accuracy import Refinement, Solution
from symhbm.results import Request
from symhbm.time_domain import Change, Known, held_between, stability_changes

_SHARES = np.arange(1, 8) / 8
"""Shares of a step at which the lag is estimated."""
_ALL = [0.0, *_SHARES.tolist(), 1.0]
_ROUND_OFF = 1e-9
"""Work of a force that is round-off, over that of as large a response in phase with it."""


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


def phase_resonances(
    corrector: Corrector, points: Sequence[Known | None]
) -> tuple[list[Change], int]:
    """The phase resonances between the points of one path, and how many were not located.

    A point that is None interrupts it.
    """
    curve, changes, lost = corrector.curve, list[Change](), 0
    for number, (left, right) in enumerate(pairwise(points)):
        if left is None or right is None:
            continue
        try:
            found = _quarters(corrector, left.after, right.before)
        except ArithmeticError:
            lost += 1
            continue
        resonances = (state for state in found if _is_resonance(curve, state))
        changes += [Change(number, EventKind.PHASE, state) for state in resonances]
    return changes, lost


def _quarters(corrector: Corrector, left: PathState, right: PathState) -> list[PathState]:
    """The solutions between two points that lag by a quarter of the period, or are a quarter ahead.

    A resonance and an antiresonance within one step are separated by a cubic between the points.
    Raises ArithmeticError where the path cannot be solved for.
    """
    curve = corrector.curve
    segment = held_between(corrector, left, right)
    states, slopes = segment.interpolate(_SHARES)
    inner = map(PathState, states, slopes)
    signs = [_in_phase(curve, at) > 0 for at in (left, *inner, right)]
    if len({*signs}) == 1:
        return []

    turns = [i for i, (sign, other) in enumerate(pairwise(signs)) if sign != other]
    # Between two turns of the cubic the path itself tells.
    middles = [(_ALL[i + 1] + _ALL[j]) / 2 for i, j in pairwise(turns)]
    shares = [0.0, *middles, 1.0]
    values = [_in_phase(curve, segment.at(share)) for share in shares]
    return [
        segment.zero(partial(_in_phase, curve), *between)
        for between, (low, high) in zip(pairwise(shares), pairwise(values), strict=True)
        if low * high < 0
    ]


def _in_phase(curve: ContinuationProblem, at: PathState) -> float:
    """Share of the response in phase with the force: the cosine of the lag of a single force."""
    problem, frequency = curve.at(float(at.state[-1]))
    work, size = _work(problem, frequency, at.state[:-1])
    return work.real / abs(work) if abs(work) > _ROUND_OFF * size else 0.0


def _is_resonance(curve: ContinuationProblem, at: PathState) -> bool:
    """Whether the lag grows with the frequency, and the point is no antiresonance."""
    problem, frequency = curve.at(float(at.state[-1]))
    slope = slope_of(problem.evaluate(at.state[:-1], frequency))
    return _work(problem, frequency, slope)[0].real < 0


def _work(problem: HarmonicBalance, frequency: float, motion: FloatArray) -> tuple[complex, float]:
    """``F^H X`` in the lowest harmonic above 0 that is excited [N m], and the sizes of both.

    Forces and motions are ``a - i b``; ``motion`` (n_unknowns,) [m].
    """
    parts = problem.force(frequency), problem.layout.coefficients(motion)
    forces, motions = (problem.basis.phasors(part).T for part in parts)
    for harmonic, exciting, moving in zip(problem.harmonics, forces, motions, strict=True):
        if harmonic and exciting.any():
            size = np.linalg.norm(exciting) * np.linalg.norm(moving)
            return complex(np.vdot(exciting, moving)), float(size)
    return 0j, 0.0
