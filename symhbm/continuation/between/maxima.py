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
from symhbm.continuation.between.slopes import (
    TIE,
    SlopeEstimate,
    Slopes,
    amplitude_and_slope,
    estimate_slopes,
    leading,
)
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
        estimates = estimate_slopes(self._problem, *segments[3:-1])
        candidates = (estimates.has_maximum | estimates.ambiguous) & (
            estimates.may_lead | self._per_dof
        )
        middles: dict[int, PathState] = {}
        maxima: dict[int, list[LocatedMaximum]] = {}
        for k in np.flatnonzero(candidates.any(axis=-1)).tolist():
            segment, estimate = segments.take(k), estimates.take(k)
            resolved = self._resolve(segment, estimate, last)
            middle = self._dividing_point(segment, estimate) if resolved is None else None
            if middle is not None:
                middles[k] = middle
            elif int(segment.number) not in self.other_states:
                resolved = self._resolve(segment, estimate, True) if resolved is None else resolved
                maxima[k] = resolved or []
        for k in [] if last else self._with_hidden_maxima(segments, maxima):
            middle = self._dividing_point(segments.take(k), estimates.take(k))
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

    def _resolve(
        self, segments: Segments[Slopes], estimate: SlopeEstimate, last: bool
    ) -> list[LocatedMaximum] | None:
        """The maxima in one segment; None where it needs division, before the ``last`` depth."""
        segment = segments.segment(self._corrector, estimate.measured)
        if segment.length <= 0 or int(segments.number) in self.other_states:
            return []  # coincident ends, or a segment whose events are to be located first
        left, right = segments.left, segments.right
        dofs = np.flatnonzero(estimate.may_lead | self._per_dof)
        tied = np.all([_tied(end, dofs[0])[dofs] for end in (left, right)], axis=0)
        dofs = np.concatenate([dofs[:1], dofs[~tied]])
        if not last and np.any(estimate.ambiguous[dofs]):
            return None
        maxima, lost = self._locate(segment, segments, estimate, dofs[estimate.has_maximum[dofs]])
        if lost and not last:
            return None
        self.lost += lost
        return maxima

    def _dividing_point(
        self, segments: Segments[Slopes], estimate: SlopeEstimate
    ) -> PathState | None:
        """A solution that divides one segment, None where there is none."""
        segment = segments.segment(self._corrector, estimate.measured)
        solution = segment.solve_between(float(_dividing_share(segments.switch_events)))
        if solution is not None and segment.other_states and not self._ignore_states:
            self.other_states[int(segments.number)] = float(solution.state[-1])
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
        estimates = estimate_slopes(
            self._problem, *self._divide(segments.take(list(number)), share, at)[3:-1]
        )
        rows = np.arange(len(smooth_maxima))
        single = (
            estimates.rises_to()[rows, dof] & estimates.falls_from()[rows + len(smooth_maxima), dof]
        )
        return sorted(
            {k for k, is_single in zip(number, single.tolist(), strict=True) if not is_single}
        )

    def _locate(
        self,
        segment: Segment,
        segments: Segments[Slopes],
        estimate: SlopeEstimate,
        turning_dofs: NDArray[np.intp],
    ) -> tuple[list[LocatedMaximum], int]:
        """The maxima of ``turning_dofs`` in a segment, and the number of those not located."""
        left, right = segments.left, segments.right
        height = np.maximum(left.amplitude, right.amplitude)
        maxima: list[LocatedMaximum] = []
        lost = 0
        done = np.zeros(len(height), dtype=bool)
        for dof in turning_dofs[np.argsort(-height[turning_dofs])].tolist():
            if done[dof]:
                continue
            start = estimated_maximum(estimate.slopes[:, dof], segments.switch_events)
            margin = float(estimate.error[dof]) * segment.length
            always = self._per_dof or segments.switch_events.any()
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
        amplitude = amplitude_and_slope(self._problem, value[:, :-1], slope[:, :-1])[0]
        margin = max(margin, _AMPLITUDE_MARGIN * segment.length * segment.scale[0])
        return bool(np.any(amplitude[:, dof] + margin >= amplitude.max(axis=1)))


def _dividing_share(switch_events: NDArray[np.bool_]) -> FloatArray:
    """Shares (...,) at which segments are divided: closer to an onset or end of slip."""
    return 0.5 + 0.25 * (switch_events[..., 1].astype(float) - switch_events[..., 0])


def _tied(at: Slopes, dof: int) -> NDArray[np.bool_]:
    """Which responses are as large as that of one degree of freedom."""
    return np.abs(at.amplitude - at.amplitude[dof]) <= TIE * at.amplitude.max()
