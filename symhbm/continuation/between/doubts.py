"""Doubts about a path between its points: whether lines show it, and whether it has more events.

Continuation steps may be too long for drawing response curves that are interpolated. The amplitude
interpolated from amplitudes and slopes is compared with that of the interpolated states; where they
differ, the path is solved for in between. Next to an onset or end of slip the states follow a root,
and their interpolation is the less accurate one of both: the tolerances are aims, and no bounds.

A contact may begin and end to slip, or to open, between two points of a path. Its relative motion
is interpolated there; where it comes as close to a limit as the interpolation error, the path is
solved for in between.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import BalancedContacts, HarmonicBalance
from symhbm.continuation.between.segments import OF_VALUE, Batch, Doubt, Segments, errors_within
from symhbm.continuation.between.slopes import FLAT_SLOPE, TIE, Slopes
from symhbm.continuation.correctors import (
    BEYOND,
    ON_LIMIT,
    Corrector,
    Hyperplane,
    crossed,
    unit_parameter,
)
from symhbm.continuation.newton import slope_of
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.segment import Measure, PathState, Segment, has_other_states, is_beyond
from symhbm.numerics import FloatArray, largest_displacement
from symhbm.numerics.loops import Loop, interpolation

TOLERANCE = 0.005
"""Relative error of the largest response between two points that is aimed at: 0.04 dB."""
_TOLERANCE_PER_DOF = 0.01
"""That of the response of each degree of freedom."""
_SMALL_SHARE = 1e-3
"""Share of the largest response that is the least reference of errors per degree of freedom."""
_SHARES = np.array([0.25, 0.5, 0.75])
"""Shares of a segment at which the error of interpolation is estimated."""
_INNER = np.arange(1, 16) / 16
_ERROR_PROFILE = (4 * _INNER * (1 - _INNER)) ** 2
"""Error of a cubic along a segment over its maximum."""
_SAMPLES = 16
"""Angles per period of the highest harmonic at which relative motions are evaluated."""


def solved_between(
    points: Sequence[PathPoint], corrector: Corrector, per_dof: bool = False
) -> tuple[dict[int, list[tuple[PathState, int]]], dict[int, float]]:
    """The solutions that interpolation between path points needs, by the index of the point before.

    They are in the order of the path, each with the linear solves it took. Also by that index a
    value at which one shows a maximum, or a contact in another state, that the path passed over.
    """
    if len(points) < 2:
        return {}, {}
    segments, lines = Segments.of(points), _Lines(corrector, per_dof)
    lines.settle(segments.take(segments.left.state[:, -1] != segments.right.state[:, -1]))
    for number, several in lines.solutions.items():
        heading = np.sign(points[number + 1].value - points[number].value)
        several.sort(key=lambda pair, heading=heading: heading * pair[0].state[-1])
    return lines.solutions, lines.other_states


class _Lines(Doubt):
    """Lines between the points of a path that may be off: ``solutions`` by the point before."""

    def __init__(self, corrector: Corrector, per_dof: bool):
        super().__init__(corrector)
        self.numbers = 16 * corrector.curve.problem.n_dof
        self._per_dof = per_dof
        self.solutions: dict[int, list[tuple[PathState, int]]] = {}

    def look_at(self, batch: Batch) -> None:
        """Divide segments in which the interpolated response is off."""
        segments = batch.segments
        shares, hides = _needed_shares(batch, self.corrector, self._per_dof)
        for k in np.flatnonzero((shares > 0) | hides).tolist():
            number, solves_before = int(segments.number[k]), self.corrector.solves
            if hides[k] and segments.width[k] < 1:
                # The end that is no point of the path.
                end = segments.right if segments.begin[k] == 0 else segments.left
                self.other_states[number] = float(end.state[k, -1])
            if shares[k] and batch.divide(k, float(shares[k])):
                solution = batch.middles[k][1], self.corrector.solves - solves_before
                self.solutions.setdefault(number, []).append(solution)

    def solution(self, segment: Segment, share: float) -> PathState | None:
        """A solution at a value of the parameter between those of both ends.

        At a share of the parameter interval where that makes one: lines are drawn over it.
        """
        if segment.curve.single_valued:
            solution, leaves = _solution_at_value(segment, share)
            segment.other_states |= leaves
            return solution
        solution = segment.solve_between(share)
        low, high = sorted(end.state[-1] for end in (segment.left, segment.right))
        return solution if solution is not None and low < solution.state[-1] < high else None


def _needed_shares(
    batch: Batch, corrector: Corrector, per_dof: bool
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The share (n,) of each segment at which a solution is needed, 0 where none is.

    Where the response is single-valued, it is one of the parameter interval. Also whether slopes at
    both ends tell of a maximum in between (n,).
    """
    problem, single_valued = corrector.curve.problem, corrector.curve.single_valued
    segments, measured = batch.segments, batch.measured
    left, right = (Slopes.of(problem, side) for side in (segments.left, segments.right))
    tangents = [(measured.left, measured.right)]
    if single_valued:
        # A cubic over the parameter differs from one over the arc length: the worse one counts.
        width = (right.state - left.state)[:, -1:]
        first, last = (width * at.direction / at.direction[:, -1:] for at in (left, right))
        tangents.append((first, last))
    n = len(segments.number)
    states = np.empty((n, len(_SHARES), left.state.shape[1]))
    worst = np.zeros((2, n))
    for pair in tangents:
        interpolation.interpolate(left.state, right.state, *pair, _SHARES, states)
        expected = _amplitude(problem, states[..., : problem.n_unknowns])
        sides = ((at.state, at.direction, at.amplitude, at.slope) for at in (left, right))
        _largest_error(*sides, segments.folds, states, expected, per_dof, *worst)
    hides = np.any(_rises(left, 1, per_dof) & _rises(right, -1, per_dof), axis=1)
    return worst[1], hides


@Loop
def _largest_error(left, right, folds, states, expected, per_dof: bool, largest, shares) -> None:
    """Raise the ``largest`` errors of segments, and write the shares of those above 1.

    Of what is drawn from states, directions, amplitudes and slopes ``left`` and ``right`` at their
    ends, against amplitudes ``expected`` (n, s, n_dof) at ``states`` (n, s, n_unknowns + 1); errors
    are relative to the tolerance. ``folds`` (n, 2) tells which ends are smooth ones.
    """
    n, n_shares, n_dof = expected.shape
    drawn = np.empty(n_dof)
    for i in range(n):
        begin = left[0][i, -1]
        width = right[0][i, -1] - begin
        to_first = math.inf if folds[i, 0] else width / left[1][i, -1]
        to_last = math.inf if folds[i, 1] else width / right[1][i, -1]
        for h in range(n_shares):
            share = min(max((states[i, h, -1] - begin) / width, 0.0), 1.0)
            for j in range(n_dof):
                first = math.inf if folds[i, 0] else to_first * left[3][i, j]
                last = math.inf if folds[i, 1] else to_last * right[3][i, j]
                drawn[j] = interpolation.amplitude_at(
                    left[2][i, j], right[2][i, j], first, last, share
                )
            error = _relative_error(drawn, expected[i, h], per_dof)
            if error > largest[i]:
                largest[i] = error
                if error > 1:
                    shares[i] = _SHARES[h]


def _rises(at: Slopes, heading: int, per_dof: bool) -> NDArray[np.bool_]:
    """Whether each response rises, or (n, 1) whether one does that leads."""
    rises = heading * at.slope > FLAT_SLOPE * at.amplitude
    if per_dof:
        return rises
    leads = at.amplitude >= (1 - TIE) * at.amplitude.max(axis=1, keepdims=True)
    return (rises & leads).any(axis=1, keepdims=True)


def _amplitude(problem: HarmonicBalance, unknowns: FloatArray) -> FloatArray:
    """Largest values (..., n_peaking) of what has peaks at motions (..., n_unknowns)."""
    motions = problem.peaking.of(unknowns).reshape(-1, problem.basis.n_components)
    return largest_displacement(problem.basis, motions)[0].reshape(*unknowns.shape[:-1], -1)


@Loop
def _relative_error(drawn, expected, per_dof: bool) -> float:
    """Largest difference of the amplitudes (n_dof,), relative to the tolerance."""
    largest = expected.max()
    scale = largest if largest > 0 else 1.0
    error = abs(drawn.max() - largest) / (TOLERANCE * scale)
    if per_dof:
        for j in range(len(drawn)):
            reference = max(expected[j], _SMALL_SHARE * scale)
            error = max(error, abs(drawn[j] - expected[j]) / (_TOLERANCE_PER_DOF * reference))
    return error


def _solution_at_value(segment: Segment, share: float) -> tuple[PathState | None, bool]:
    """The solution at a share of the parameter interval, contacts free where one changes.

    It may be one of the arc length where the path bends too sharply for that.
    """
    corrector, switches = segment.corrector, segment.switches
    curve, left, right = corrector.curve, segment.left, segment.right
    width = right.state[-1] - left.state[-1]
    value = float(left.state[-1] + share * width)
    along, guess = segment.at_value(value)
    scale = curve.scale(guess)
    plane = Hyperplane(guess, scale, np.sign(width) * unit_parameter(len(scale)))
    corrected = corrector.correct(guess, plane, switches)
    if corrected is None:
        # Where the path bends sharply over the parameter, the solution across it is close.
        near = segment.solve(along)
        if near is not None:
            start = near.state + (value - near.state[-1]) / near.direction[-1] * near.direction
            corrected = corrector.correct(start, plane, switches)
            if corrected is None and 0 < (near.state[-1] - left.state[-1]) / width < 1:
                return near, False
    if corrected is not None and corrected.crosses:
        flipped = switches ^ crossed(corrected.margins, switches)
        corrected = corrector.correct(corrected.point, plane, flipped)
    if corrected is not None and not corrected.crosses:
        leaves = is_beyond(corrected.margins, switches, ON_LIMIT)
        return PathState(corrected.point, corrected.direction * scale), leaves
    result = corrector.free(guess[:-1], value)
    if not result.converged:
        return None, False
    direction = np.sign(width) * np.append(slope_of(result.evaluation), 1.0)
    leaves = has_other_states(result, switches, ON_LIMIT)
    return PathState(np.append(result.unknowns, value), direction), leaves


class MissedEvents(Doubt):
    """Contact events between the points of a path that its steps passed over.

    A margin that stays at its limit is in doubt in all parts of a segment, however short.
    """

    depth = 6

    def __init__(self, points: list[PathPoint], corrector: Corrector):
        super().__init__(corrector)
        basis, n_switches = corrector.curve.problem.basis, len(points[0].margins)
        samples = _SAMPLES * (basis.highest if basis.n_components > 2 else 1)
        self.numbers = max(len(_INNER) * n_switches * samples, 1)
        self._estimates = _Estimates.of(corrector.curve, points) if n_switches else None

    def look_at(self, batch: Batch) -> None:
        """Divide segments at which a contact may pass its limit."""
        if self._estimates is None:
            return
        given = batch.segments, batch.measured, self._estimates
        shares = _doubtful_shares(self.corrector.curve.problem, *given)
        for k in np.flatnonzero(shares).tolist():
            if int(batch.segments.number[k]) not in self.other_states:
                batch.divide(k, float(shares[k]))


class _Estimates(NamedTuple):
    """Estimates of margins after each path point but the last, at the values of that point.

    ``frequency`` (n,) and ``contacts`` (n,) are those of the points; ``first`` and ``last``
    (n, n_switches), what estimates are off at the point and at the next one.
    """

    frequency: FloatArray
    contacts: list[BalancedContacts]
    first: FloatArray
    last: FloatArray

    @classmethod
    def of(cls, curve: ContinuationProblem, points: list[PathPoint]) -> "_Estimates":
        """Those of the points of a path."""
        at = [curve.at_point(point.state) for point in points[:-1]]
        frequency = np.array([frequency for _, frequency in at])
        contacts = [problem.contacts for problem, _ in at]
        unknowns = np.array([point.unknowns[: curve.problem.n_unknowns] for point in points])
        ends = np.stack([unknowns[:-1], unknowns[1:]], axis=1)
        known = np.array([point.margins for point in points])
        known = np.stack([known[:-1], known[1:]], axis=1)
        exact = np.zeros(known.shape)
        within = curve.problem.contacts.margins_within(ends, frequency, exact, contacts)
        with np.errstate(invalid="ignore"):
            first, last = np.moveaxis(within - known, 1, 0)
        return cls(frequency, contacts, first, last)


def _doubtful_shares(
    problem: HarmonicBalance, segments: Segments, measured: Measure, estimates: _Estimates
) -> FloatArray:
    """Shares (n,) of the segments at which a contact may pass its limit, 0 where none may."""
    ends = segments.left.state, segments.right.state, measured.left, measured.right
    shape = len(segments.number), len(_INNER)
    motions = np.empty((*shape, problem.n_unknowns))
    interpolation.interpolate(*ends, _INNER, motions)
    layout, n = problem.layout, problem.n_unknowns
    by_component = errors_within(segments, measured, lambda at: layout.relative(at[:, :n]))
    by_row = np.linalg.norm(by_component.reshape(shape[0], layout.n_rows, -1), axis=-1)
    by_row *= OF_VALUE * np.abs(measured.length)
    sizes = problem.contacts.sizes_at_switches(by_row)
    error = np.where(segments.switches, -sizes, sizes)[:, None] * _ERROR_PROFILE[:, None]
    of_point = segments.number
    frequency, contacts = estimates.frequency[of_point], estimates.contacts
    off = estimates.first[of_point], estimates.last[of_point]
    at = frequency, [contacts[k] for k in of_point.tolist()]
    known = _steady(problem, segments, motions, by_row, off, at)
    within = problem.contacts.margins_within(motions, at[0], error, at[1], known)
    shares = np.zeros(len(of_point))
    _most_beyond(within, *off, segments.begin, segments.width, segments.switches, shares)
    return shares


def _steady(
    problem: HarmonicBalance,
    segments: Segments,
    motions: FloatArray,
    by_row: FloatArray,
    off: tuple[FloatArray, FloatArray],
    at: tuple[FloatArray, list[BalancedContacts]],
) -> FloatArray | None:
    """Margins (n, n_switches) in the middle of segments that surely stay within their limits.

    NaN for others; None for one harmonic, where asking for all takes less time.
    """
    layout, contacts, (frequency, values) = problem.layout, problem.contacts, at
    if problem.basis.n_components == 2:
        return None
    middle = motions[:, motions.shape[1] // 2]
    exact = np.zeros((len(middle), 1, segments.switches.shape[-1]))
    margins = contacts.margins_within(middle[:, None], frequency, exact, values)[:, 0]
    moved = layout.relative((motions - middle[:, None]).reshape(-1, layout.n_unknowns))
    moved = np.abs(moved).reshape(*motions.shape[:2], layout.n_rows, -1).max(axis=1)
    change = moved + by_row[:, :, None]
    bounds = contacts.margin_changes(middle, frequency, change, margins, values)
    with np.errstate(invalid="ignore"):
        inside = np.where(segments.switches, margins - off[0], off[0] - margins)
        inside -= np.abs(off[1] - off[0])
    return np.where(bounds < inside, margins, np.nan)


@Loop
def _most_beyond(within, first, last, begin, width, switches, shares) -> None:
    """Write the share of each segment at which a margin is the farthest beyond its limit.

    Margins ``within`` (n, s, n_switches) are corrected by what they are off at the ends of a step,
    ``first`` and ``last``. Segments in which all are within their limits are left out.
    """
    for i in range(len(within)):
        farthest = BEYOND
        for h in range(within.shape[1]):
            at = begin[i] + width[i] * _INNER[h]
            for k in range(within.shape[2]):
                if not (math.isfinite(first[i, k]) and math.isfinite(last[i, k])):
                    continue
                off = first[i, k] + at * (last[i, k] - first[i, k])
                outward = off - within[i, h, k] if switches[i, k] else within[i, h, k] - off
                if outward > farthest:
                    farthest, shares[i] = outward, _INNER[h]
