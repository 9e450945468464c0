"""Amplitude maxima between path points: segments are divided until each holds at most one.

A maximum is the zero of the slope along the path between two solutions.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.between.segments import Batch, Doubt, Segments
from symhbm.continuation.between.slopes import (
    N_SLOPES,
    TIE,
    PeakKind,
    SlopeEstimate,
    Slopes,
    amplitude_and_slope,
    estimate_slopes,
    leading,
)
from symhbm.continuation.correctors import Corrector
from symhbm.continuation.problem import Corrected
from symhbm.continuation.segment import PathState, Segment, measure
from symhbm.numerics import FloatArray, bracketed_root

CORNER_JUMP = 1e-6
"""Jump of a slope, relative to the slopes around, from which a maximum is a corner."""
_ROUND_OFF_SLOPE = 1e-12
"""Slope at an end, over the larger one, that is zero: by symmetry, branches are level where they
cross others."""
_SMALL_SLOPE = 1e-2
"""Slope at an end, relative to the larger one, below which its tangent is too inaccurate."""
_MAX_RATIO = 1e4
"""Largest distance of two solutions over that of their planes along a continuous path."""
_ROUND_OFF = 1e-10
"""Distance of two solutions, relative to the response, that round-off explains."""


class LocatedMaximum(NamedTuple):
    """A maximum of the responses ``dofs``: its ``share`` of the segment and the solution ``at`` it.

    ``solution`` is the same with its direction relative to ``scale``; ``solves`` counts the linear
    solves spent on it.
    """

    share: float
    at: Slopes
    solution: Corrected
    scale: FloatArray
    kind: PeakKind
    dofs: tuple[int, ...]
    solves: int


def locate_maximum(
    segment: Segment, left: Slopes, right: Slopes, dof: int, start: float
) -> LocatedMaximum | None:
    """The maximum of one amplitude between two solutions, where its slope changes sign.

    ``start`` is its estimated share of the segment. None if the iteration does not converge.
    """
    visited: dict[float, tuple[Corrected, Slopes]] = {}
    solves_before = segment.corrector.solves

    def slope(share: float) -> float:
        if share not in visited:
            nearest = min(visited, key=lambda known: abs(known - share), default=None)
            neighbour = None if nearest is None else (nearest, visited[nearest][1])
            if not 0 <= share <= 1:
                raise ArithmeticError
            solution = segment.corrected(share, neighbour, patient=True)
            if solution is None:
                raise ArithmeticError
            at = PathState(solution.point, solution.direction * segment.scale)
            visited[share] = solution, Slopes.of(segment.curve.problem, at)
        return float(visited[share][1].slope[dof])

    # A small slope is as inaccurate as the tangent of its point: solve for both anew.
    ends = float(left.slope[dof]), float(right.slope[dof])
    scale = max(ends[0], -ends[1])
    try:
        left_slope, right_slope = (
            s if abs(s) > _SMALL_SLOPE * scale else slope(float(h)) for h, s in enumerate(ends)
        )
        flat = _ROUND_OFF_SLOPE * scale
        known = {0.0: left_slope, 1.0: right_slope}
        if left_slope <= flat or right_slope >= -flat:
            share = 0.0 if left_slope <= flat else 1.0
        else:
            share = bracketed_root(lambda at: known[at] if at in known else slope(at), start=start)
        slope(share)
    except ArithmeticError:
        return None
    (solution, at), solves = visited[share], segment.corrector.solves - solves_before
    jumps = abs(at.slope[dof]) > CORNER_JUMP * scale and 0.0 < share < 1.0
    states = {known: of_share.state for known, (_, of_share) in visited.items()}
    if jumps and not _is_continuous(segment, states, share):
        return None
    kind = PeakKind.CORNER if jumps else PeakKind.SMOOTH
    return LocatedMaximum(share, at, solution, segment.scale, kind, (dof,), solves)


def _is_continuous(segment: Segment, states: dict[float, FloatArray], share: float) -> bool:
    """Whether a solution is close to its neighbours: at a corner slopes jump, solutions do not."""
    for side in (-1, 1):
        neighbour = min(
            (h for h in states if h * side > share * side), key=lambda h: h * side, default=share
        )
        distance = np.linalg.norm((states[neighbour] - states[share]) / segment.scale)
        if distance > _MAX_RATIO * segment.length * abs(neighbour - share) + _ROUND_OFF:
            return False
    return True


def estimated_maximum(slopes: FloatArray, switch_events: NDArray[np.bool_]) -> float:
    """Share of the segment where the ``slopes`` (n,) of a `SlopeEstimate` first turn negative."""
    fall = int(np.argmax((slopes[:-1] > 0) & (slopes[1:] <= 0)))
    inside = slopes[fall] / (slopes[fall] - slopes[fall + 1])
    share = float(fall + inside) / (len(slopes) - 1)
    if switch_events[0] == switch_events[1]:
        return share
    # Samples are evenly spaced in the square root of the distance from the slip event.
    return share**2 if switch_events[0] else 1 - (1 - share) ** 2


_OFFSETS = np.array([-0.1, 0.0, 0.1])
"""Errors of the position of an interpolated maximum, as shares of the segment."""
_AMPLITUDE_MARGIN = 0.01
"""Least error of interpolated amplitudes, relative to the scaled length of the segment."""


class Maxima(Doubt):
    """Maxima of the largest response, or ``per_dof``, by the index of the path point before them.

    ``lost`` counts those that could not be solved for. Segments in which a contact is in another
    state yield no maxima.
    """

    def __init__(self, corrector: Corrector, per_dof: bool, ignore_states: bool = False):
        super().__init__(corrector, ignore_states)
        self.lost = 0
        self._problem = corrector.curve.problem
        self.numbers = N_SLOPES * self._problem.n_dof
        self._per_dof = per_dof
        self._maxima: dict[int, list[LocatedMaximum]] = {}

    def between(self, segments: Segments) -> dict[int, list[LocatedMaximum]]:
        """All maxima in the segments, in the order of the path."""
        self.settle(segments)
        for maxima in self._maxima.values():
            maxima.sort(key=lambda maximum: maximum.share)
        return self._maxima

    def look_at(self, batch: Batch) -> None:
        """Divide segments until each holds at most one maximum, which is located."""
        segments = batch.segments
        estimate = estimate_slopes(self._problem, segments, batch.measured, self._per_dof)
        is_doubtful = np.any(estimate.is_doubtful, axis=1).tolist()
        candidates = np.any(estimate.is_doubtful | estimate.turns, axis=1)
        candidates &= batch.measured.length[:, 0] > 0  # else its ends coincide
        # Divided closer to an onset or end of slip.
        heading = np.diff(segments.switch_events.astype(float), axis=-1)[..., 0]
        dividing = (0.5 + 0.25 * heading).tolist()
        maxima: dict[int, list[LocatedMaximum]] = {}
        for k in np.flatnonzero(candidates).tolist():
            if int(segments.number[k]) in self.other_states:
                continue  # its events are to be located first
            found, lost = None, 0
            if batch.is_last or not is_doubtful[k]:
                found, lost = self._locate(batch, estimate, k)
            if (found is None or lost) and batch.divide(k, dividing[k]):
                continue
            if int(segments.number[k]) in self.other_states:
                continue
            if found is None:
                found, lost = self._locate(batch, estimate, k)
            maxima[k] = found
            self.lost += lost
        for k in [] if batch.is_last else self._with_hidden_maxima(batch, maxima):
            if batch.divide(k, dividing[k]):
                del maxima[k]
        for k, located in maxima.items():
            begin, width = float(segments.begin[k]), float(segments.width[k])
            resolved = [
                maximum._replace(share=begin + width * maximum.share) for maximum in located
            ]
            self._maxima.setdefault(int(segments.number[k]), []).extend(resolved)

    def _with_hidden_maxima(
        self, batch: Batch, maxima: dict[int, list[LocatedMaximum]]
    ) -> list[int]:
        """Indices of segments where the slope may change its sign again beside a smooth maximum."""
        smooth = [
            (k, maximum)
            for k, located in maxima.items()
            for maximum in located
            if maximum.kind == PeakKind.SMOOTH and 0 < maximum.share < 1
        ]
        if not smooth:
            return []
        number = np.array([k for k, _ in smooth])
        share = np.array([maximum.share for _, maximum in smooth])
        dof = np.array([maximum.dofs[0] for _, maximum in smooth])
        at = PathState.stacked([maximum.at for _, maximum in smooth])
        curve, rows = self.corrector.curve, np.arange(len(smooth))
        halves = batch.segments.take(number).divided(curve, share, at)
        measured = measure(curve.single_valued, halves.left, halves.right, halves.scale)
        estimate = estimate_slopes(self._problem, halves, measured, self._per_dof)
        single = estimate.goes(1, rows, dof) & estimate.goes(-1, rows + len(smooth), dof)
        return np.unique(number[~single]).tolist()

    def _locate(
        self, batch: Batch, estimate: SlopeEstimate, k: int
    ) -> tuple[list[LocatedMaximum], int]:
        """The maxima in a segment, and the number of those not located."""
        segment, switch_events = batch.segment(k), batch.segments.switch_events[k]
        left, right = estimate.left[k], estimate.right[k]
        height = np.maximum(left.amplitude, right.amplitude)
        turning_dofs = np.flatnonzero(estimate.turns[k])
        maxima: list[LocatedMaximum] = []
        lost = 0
        done = np.zeros(len(height), dtype=bool)
        for dof in turning_dofs[np.argsort(-height[turning_dofs])].tolist():
            if done[dof]:
                continue
            start = estimated_maximum(estimate.slopes[k, :, dof], switch_events)
            margin = float(estimate.error[k, dof]) * segment.length
            always = self._per_dof or switch_events.any()
            if not (always or self._may_lead(segment, start, dof, margin)):
                continue
            maximum = locate_maximum(segment, left, right, dof, start)
            if maximum is None:
                lost += 1
                continue
            amplitude = maximum.at.amplitude
            same = np.abs(amplitude - amplitude[dof]) <= TIE * amplitude[dof]
            if self._per_dof:
                # DOFs with equal amplitudes at both ends and here peak together.
                same &= np.all([_tied(end, dof) for end in (left, right)], axis=0)
                maxima.append(maximum._replace(dofs=tuple(np.flatnonzero(same).tolist())))
            elif amplitude[dof] >= (1 - TIE) * amplitude.max():
                maxima.append(maximum._replace(dofs=(leading(amplitude),)))
            done |= same
        return maxima, lost

    def _may_lead(self, segment: Segment, share: float, dof: int, margin: float) -> bool:
        """Whether a response may be the largest at its estimated maximum."""
        value, slope = segment.interpolate(np.clip(share + _OFFSETS, 0.0, 1.0))
        n = self._problem.n_unknowns
        amplitude = amplitude_and_slope(self._problem, *(part[:, :n] for part in (value, slope)))[0]
        size = self._problem.peaking.scale * segment.scale[0]
        margin = max(margin, _AMPLITUDE_MARGIN * segment.length * size)
        return bool(np.any(amplitude[:, dof] + margin >= amplitude.max(axis=1)))


def _tied(at: Slopes, dof: int) -> NDArray[np.bool_]:
    """Which responses are as large as that of one degree of freedom."""
    return np.abs(at.amplitude - at.amplitude[dof]) <= TIE * at.amplitude.max()
