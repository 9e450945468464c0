"""Amplitude maxima between path points: segments are divided until each holds at most one."""

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.between.located_maximum import (
    LocatedMaximum,
    PeakKind,
    estimated_maximum,
    locate_maximum,
)
from symhbm.continuation.between.segments import Segments
from symhbm.continuation.between.slope_estimate import SlopeEstimate, estimate_slopes
from symhbm.continuation.between.slopes import TIE, Slopes, amplitude_and_slope, leading
from symhbm.continuation.correctors import Corrector
from symhbm.continuation.segment import PathState, Segment
from symhbm.numerics import FloatArray

_MAX_DEPTH = 12
_BATCH_SIZE = 2**16
"""Slopes interpolated at once, which bounds the memory of large structures."""
_OFFSETS = np.array([-0.1, 0.0, 0.1])
"""Errors of the position of an interpolated maximum, as shares of the segment."""
_AMPLITUDE_MARGIN = 0.01
"""Least error of interpolated amplitudes, relative to the scaled length of the segment."""


class Maxima:
    """Maxima of the largest response, or ``per_dof``, by the index of the path point before them.

    ``lost`` counts those that could not be solved for. ``other_states`` holds a parameter value
    where a contact is in another state than at both ends, by the index of the point before; such
    a segment yields no maxima, unless ``ignore_states`` is set.
    """

    def __init__(self, corrector: Corrector, per_dof: bool, ignore_states: bool = False):
        self.lost = 0
        self.other_states: dict[int, float] = {}
        self._corrector = corrector
        self._problem = corrector.curve.problem
        self._per_dof = per_dof
        self._ignore_states = ignore_states
        self._maxima: dict[int, list[LocatedMaximum]] = {}

    def between(self, segments: Segments[Slopes]) -> dict[int, list[LocatedMaximum]]:
        """All maxima in the segments, in the order of the path."""
        size = max(_BATCH_SIZE // self._problem.n_dof, 1)
        for depth in range(_MAX_DEPTH + 1):
            last = depth == _MAX_DEPTH
            divided = [
                parts for batch in segments.batches(size) for parts in self._process(batch, last)
            ]
            if not divided:
                break
            segments = Segments.joined(divided)
        for maxima in self._maxima.values():
            maxima.sort(key=lambda maximum: maximum.share)
        return self._maxima

    def _process(self, segments: Segments[Slopes], last: bool) -> list[Segments[Slopes]]:
        """Parts of the segments that need further division; maxima of the others are stored."""
        estimate = estimate_slopes(self._problem, segments, self._per_dof)
        is_doubtful = np.any(estimate.is_doubtful, axis=1).tolist()
        candidates = np.any(estimate.is_doubtful | estimate.turns, axis=1)
        candidates &= estimate.measured.length[:, 0] > 0  # else its ends coincide
        middles: dict[int, PathState] = {}
        maxima: dict[int, list[LocatedMaximum]] = {}
        for k in np.flatnonzero(candidates).tolist():
            if int(segments.number[k]) in self.other_states:
                continue  # its events are to be located first
            segment = segments.segment(k, self._corrector, estimate.measured)
            found, lost = None, 0
            if last or not is_doubtful[k]:
                found, lost = self._locate(segment, segments, estimate, k)
            if found is None or (lost and not last):
                middle = self._dividing_point(segment, segments, k)
                if middle is not None:
                    middles[k] = middle
                    continue
                if int(segments.number[k]) in self.other_states:
                    continue
            if found is None:
                found, lost = self._locate(segment, segments, estimate, k)
            maxima[k] = found
            self.lost += lost
        for k in [] if last else self._with_hidden_maxima(segments, maxima):
            segment = segments.segment(k, self._corrector, estimate.measured)
            middle = self._dividing_point(segment, segments, k)
            if middle is not None:
                middles[k] = middle
                del maxima[k]
        for k, located in maxima.items():
            begin, width = float(segments.begin[k]), float(segments.width[k])
            resolved = [
                maximum._replace(share=begin + width * maximum.share) for maximum in located
            ]
            self._maxima.setdefault(int(segments.number[k]), []).extend(resolved)
        if not middles:
            return []
        parents = segments.take(list(middles))
        middle = Slopes.of(self._problem, PathState.stacked(list(middles.values())))
        return [self._divide(parents, _dividing_share(parents.switch_events), middle)]

    def _divide(
        self, segments: Segments[Slopes], share: FloatArray, at: Slopes
    ) -> Segments[Slopes]:
        scale = np.array([self._corrector.curve.scale(state) for state in at.state])
        return segments.divided(share, at, scale)

    def _dividing_point(
        self, segment: Segment, segments: Segments[Slopes], k: int
    ) -> PathState | None:
        """A solution that divides one segment, None where there is none."""
        solution = segment.solve_between(float(_dividing_share(segments.switch_events[k])))
        if solution is not None and segment.other_states and not self._ignore_states:
            self.other_states[int(segments.number[k])] = float(solution.state[-1])
            return None
        return solution

    def _with_hidden_maxima(
        self, segments: Segments[Slopes], maxima: dict[int, list[LocatedMaximum]]
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
        number, smooth_maxima = zip(*smooth, strict=True)
        share, dof = (
            np.array(column)
            for column in zip(
                *((maximum.share, maximum.dofs[0]) for maximum in smooth_maxima), strict=True
            )
        )
        at = Slopes.stacked([maximum.at for maximum in smooth_maxima])
        halves = self._divide(segments.take(list(number)), share, at)
        estimate = estimate_slopes(self._problem, halves, self._per_dof)
        rows = np.arange(len(smooth_maxima))
        single = estimate.rises_to(rows, dof)
        single &= estimate.falls_from(rows + len(smooth_maxima), dof)
        return sorted(
            {k for k, is_single in zip(number, single.tolist(), strict=True) if not is_single}
        )

    def _locate(
        self, segment: Segment, segments: Segments[Slopes], estimate: SlopeEstimate, k: int
    ) -> tuple[list[LocatedMaximum], int]:
        """The maxima in a segment, and the number of those not located."""
        left, right, switch_events = segments.left[k], segments.right[k], segments.switch_events[k]
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
        size = self._problem.peaking_scale * segment.scale[0]
        margin = max(margin, _AMPLITUDE_MARGIN * segment.length * size)
        return bool(np.any(amplitude[:, dof] + margin >= amplitude.max(axis=1)))


def _dividing_share(switch_events: NDArray[np.bool_]) -> FloatArray:
    """Shares (...,) at which segments are divided: closer to an onset or end of slip."""
    return 0.5 + 0.25 * (switch_events[..., 1].astype(float) - switch_events[..., 0])


def _tied(at: Slopes, dof: int) -> NDArray[np.bool_]:
    """Which responses are as large as that of one degree of freedom."""
    return np.abs(at.amplitude - at.amplitude[dof]) <= TIE * at.amplitude.max()
