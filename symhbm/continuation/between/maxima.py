"""Maxima of responses between points of a path: stretches halved until each has one at most."""

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.between.crests import LocatedMaximum, PeakKind, falls_at, locate_maximum
from symhbm.continuation.between.divisions import Segments
from symhbm.continuation.between.slopes import (
    TIE,
    Slopes,
    Turning,
    amplitude_and_slope,
    leading,
    turning,
)
from symhbm.continuation.correctors import Corrector
from symhbm.continuation.segment import PathState, Segment
from symhbm.numerics import FloatArray

_MAX_DEPTH = 12
_AT_ONCE = 2**16
"""Slopes that are interpolated at once, which bounds the memory of large structures."""
_AROUND = np.array([-0.1, 0.0, 0.1])
"""Distances, as shares of the way, by which the place of an interpolated maximum may be wrong."""
_ROUGHLY = 0.01
"""Part of the change over a stretch by which what is interpolated may be wrong."""


class Maxima:
    """Maxima of the largest response or of ``each``, by the number of the point before them.

    ``lost`` counts those that could not be solved for; ``other_states`` has values at which a
    contact is in another state than at both ends, by the number of the point before: nothing is
    told of that stretch, unless ``regardless`` of such states.
    """

    def __init__(self, corrector: Corrector, each: bool, regardless: bool = False):
        self.lost = 0
        self.other_states: dict[int, float] = {}
        self._corrector = corrector
        self._problem = corrector.curve.problem
        self._each = each
        self._regardless = regardless
        self._found: dict[int, list[LocatedMaximum]] = {}

    def between(self, stretches: Segments[Slopes]) -> dict[int, list[LocatedMaximum]]:
        """All in some stretches, in the order of the path."""
        most = max(_AT_ONCE // self._problem.n_dof, 1)
        for depth in range(_MAX_DEPTH + 1):
            last = depth == _MAX_DEPTH
            divided = [h for part in stretches.parts(most) for h in self._divided(part, last)]
            if not divided:
                break
            stretches = Segments.joined(divided)
        for crests in self._found.values():
            crests.sort(key=lambda locate_maximum: locate_maximum.share)
        return self._found

    def _divided(self, stretches: Segments[Slopes], last: bool) -> list[Segments[Slopes]]:
        """Parts of those stretches that have to be looked at more closely; the others are done."""
        known = turning(self._problem, *stretches[3:-1])
        candidates = (known.turns | known.unclear) & (known.contends | self._each)
        middles: dict[int, PathState] = {}
        crests: dict[int, list[LocatedMaximum]] = {}
        for k in np.flatnonzero(candidates.any(axis=-1)).tolist():
            stretch, here = stretches.take(k), known.take(k)
            found = self._settled(stretch, here, last)
            middle = self._middle(stretch, here) if found is None else None
            if middle is not None:
                middles[k] = middle
            elif int(stretch.number) not in self.other_states:
                alone = self._settled(stretch, here, True) if found is None else found
                crests[k] = alone or []
        for k in [] if last else self._hiding(stretches, crests):
            middle = self._middle(stretches.take(k), known.take(k))
            if middle is not None:
                middles[k] = middle
                del crests[k]
        for k, several in crests.items():
            begin, width = float(stretches.begin[k]), float(stretches.width[k])
            found = [one._replace(share=begin + width * one.share) for one in several]
            self._found.setdefault(int(stretches.number[k]), []).extend(found)
        if not middles:
            return []
        whole = stretches.take(list(middles))
        middle = Slopes.of(self._problem, PathState.stacked(list(middles.values())))
        return [self._parts(whole, _middle(whole.roots), middle)]

    def _parts(
        self, stretches: Segments[Slopes], share: FloatArray, at: Slopes
    ) -> Segments[Slopes]:
        scale = np.array([self._corrector.curve.scale(state) for state in at.state])
        return stretches.divided(share, at, scale)

    def _settled(
        self, stretch: Segments[Slopes], known: Turning, last: bool
    ) -> list[LocatedMaximum] | None:
        """The maxima in one stretch, None where they cannot be told unless this is the ``last``."""
        path = stretch.path(self._corrector, known.measured)
        if path.length <= 0 or int(stretch.number) in self.other_states:
            return []  # one point to the last digit, or all to be looked at anew
        left, right = stretch.left, stretch.right
        watched = np.flatnonzero(known.contends | self._each)
        tied = np.all([_tied(s, watched[0])[watched] for s in (left, right)], axis=0)
        watched = np.concatenate([watched[:1], watched[~tied]])
        if not last and np.any(known.unclear[watched]):
            return None
        crests, lost = self._crests(path, stretch, known, watched[known.turns[watched]])
        if lost and not last:
            return None
        self.lost += lost
        return crests

    def _middle(self, stretch: Segments[Slopes], known: Turning) -> PathState | None:
        """A solution by which to divide one stretch, None where no other is to be found."""
        path = stretch.path(self._corrector, known.measured)
        found = path.solve_between(float(_middle(stretch.roots)))
        if found is not None and path.other_states and not self._regardless:
            self.other_states[int(stretch.number)] = float(found.state[-1])
            return None
        return found

    def _hiding(
        self, stretches: Segments[Slopes], crests: dict[int, list[LocatedMaximum]]
    ) -> list[int]:
        """The stretches in which a response may turn again beside a smooth maximum."""
        smooth = [
            (k, locate_maximum)
            for k, several in crests.items()
            for locate_maximum in several
            if locate_maximum.kind == PeakKind.SMOOTH and 0 < locate_maximum.share < 1
        ]
        if not smooth:
            return []
        number, found = zip(*smooth, strict=True)
        share, dof = (
            np.array(column) for column in zip(*((c.share, c.dofs[0]) for c in found), strict=True)
        )
        at = Slopes.stacked([locate_maximum.at for locate_maximum in found])
        known = turning(self._problem, *self._parts(stretches.take(list(number)), share, at)[3:-1])
        rows = np.arange(len(found))
        alone = known.rises_to()[rows, dof] & known.falls_from()[rows + len(found), dof]
        return sorted({k for k, one in zip(number, alone.tolist(), strict=True) if not one})

    def _crests(
        self, path: Segment, stretch: Segments[Slopes], known: Turning, turning: NDArray[np.intp]
    ) -> tuple[list[LocatedMaximum], int]:
        """The maxima of responses that turn in a stretch, and the number of those not found."""
        left, right = stretch.left, stretch.right
        height = np.maximum(left.amplitude, right.amplitude)
        crests: list[LocatedMaximum] = []
        lost = 0
        done = np.zeros(len(height), dtype=bool)
        for dof in turning[np.argsort(-height[turning])].tolist():
            if done[dof]:
                continue
            start = falls_at(known.slopes[:, dof], stretch.roots)
            margin = float(known.error[dof]) * path.length
            watched = self._each or stretch.roots.any()
            if not (watched or self._may_lead(path, start, dof, margin)):
                continue
            found = locate_maximum(path, left, right, dof, start)
            if found is None:
                lost += 1
                continue
            amplitude = found.at.amplitude
            same = np.abs(amplitude - amplitude[dof]) <= TIE * amplitude[dof]
            if self._each:
                # Degrees of freedom that move alike all along peak together.
                same &= np.all([_tied(s, dof) for s in (left, right)], axis=0)
                crests.append(found._replace(dofs=tuple(np.flatnonzero(same).tolist())))
            elif amplitude[dof] >= (1 - TIE) * amplitude.max():
                crests.append(found._replace(dofs=(leading(amplitude),)))
            done |= same
        return crests, lost

    def _may_lead(self, path: Segment, share: float, dof: int, margin: float) -> bool:
        """Whether a response may be the largest where it turns, about at a ``share`` of the way."""
        value, slope = path.interpolate(np.clip(share + _AROUND, 0.0, 1.0))
        amplitude = amplitude_and_slope(self._problem, value[:, :-1], slope[:, :-1])[0]
        margin = max(margin, _ROUGHLY * path.length * path.scale[0])
        return bool(np.any(amplitude[:, dof] + margin >= amplitude.max(axis=1)))


def _middle(roots: NDArray[np.bool_]) -> FloatArray:
    """Shares (...,) of the way at which to divide stretches: closer to a root of slip."""
    return 0.5 + 0.25 * (roots[..., 1].astype(float) - roots[..., 0])


def _tied(at: Slopes, dof: int) -> NDArray[np.bool_]:
    """Which responses are as large as that of one degree of freedom."""
    return np.abs(at.amplitude - at.amplitude[dof]) <= TIE * at.amplitude.max()
