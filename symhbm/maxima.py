"""Maxima of responses between points of a path: stretches halved until each has one at most."""

import numpy as np
from numpy.typing import NDArray

from symhbm.corrector import Corrector
from symhbm.crests import Crest, crest, falls_at
from symhbm.divisions import Stretches
from symhbm.fourier import FloatArray
from symhbm.slopes import TIE, Slopes, Turning, amplitude_and_slope, leading, turning
from symhbm.stations import Between, Station

_MAX_DEPTH = 8
_AT_ONCE = 2**16
"""Slopes that are interpolated at once, which bounds the memory of large structures."""
_AROUND = np.array([-0.1, 0.0, 0.1])
"""Distances, as shares of the way, by which the place of an interpolated maximum may be wrong."""
_ROUGHLY = 0.01
"""Part of the change over a stretch by which what is interpolated may be wrong."""


class Maxima:
    """Maxima of the largest response or of ``each``, by the number of the point before them.

    ``lost`` counts those that could not be solved for; ``other_states`` has values at which a
    contact is in another state than at both ends, by the number of the point before.
    """

    def __init__(self, corrector: Corrector, each: bool):
        self.lost = 0
        self.other_states: dict[int, float] = {}
        self._corrector = corrector
        self._problem = corrector.curve.problem
        self._each = each
        self._found: dict[int, list[Crest]] = {}

    def between(self, stretches: Stretches[Slopes]) -> dict[int, list[Crest]]:
        """All in some stretches, in the order of the path."""
        most = max(_AT_ONCE // self._problem.n_dof, 1)
        for depth in range(2 * _MAX_DEPTH + 1):
            halves = [h for part in stretches.parts(most) for h in self._halves(part, depth)]
            if not halves:
                break
            stretches = Stretches.joined(halves)
        for crests in self._found.values():
            crests.sort(key=lambda crest: crest.share)
        return self._found

    def _halves(self, stretches: Stretches[Slopes], depth: int) -> list[Stretches[Slopes]]:
        """Halves of those stretches that have to be looked at more closely."""
        known = turning(self._problem, *stretches[3:-1])
        candidates = (known.turns | known.unclear) & (known.contends | self._each)
        divided, middles = [], []
        for k in np.flatnonzero(candidates.any(axis=-1)).tolist():
            if int(stretches.number[k]) in self.other_states:
                continue
            middle = self._look(stretches.take(k), known.take(k), depth)
            if middle is not None:
                divided.append(k)
                middles.append(middle)
        if not divided:
            return []
        whole = stretches.take(divided)
        state, direction = (
            np.array([getattr(m, name) for m in middles]) for name in ("state", "direction")
        )
        middle = Slopes.of(self._problem, Station(state, direction))
        scale = np.array([self._corrector.curve.scale(each) for each in state])
        return [whole.divided(_middle(whole.roots), middle, scale)]

    def _look(self, stretch: Stretches[Slopes], known: Turning, depth: int) -> Station | None:
        """A solution by which to halve one stretch; None if its maxima are known."""
        left, right, roots = stretch.left, stretch.right, stretch.roots
        path = stretch.path(self._corrector, known.measured)
        if path.length <= 0:
            return None  # one point to the last digit
        watched = np.flatnonzero(known.contends | self._each)
        tied = np.all([_tied(s, watched[0])[watched] for s in (left, right)], axis=0)
        watched = np.concatenate([watched[:1], watched[~tied]])
        divisible = depth < _MAX_DEPTH * (1 + roots.any())
        unclear = divisible and bool(np.any(known.unclear[watched]))
        turning = watched[known.turns[watched]]
        crests, lost = ([], 0) if unclear else self._crests(path, stretch, known, turning)
        if divisible and (unclear or lost):
            middle = path.solve_between(float(_middle(roots)))
            if middle is not None and path.other_states:
                self.other_states[int(stretch.number)] = float(middle.state[-1])
                return None
            if middle is not None:
                return middle
            if unclear:
                crests, lost = self._crests(path, stretch, known, turning)
        self.lost += lost
        begin, width = float(stretch.begin), float(stretch.width)
        found = [one._replace(share=begin + width * one.share) for one in crests]
        self._found.setdefault(int(stretch.number), []).extend(found)
        return None

    def _crests(
        self, path: Between, stretch: Stretches[Slopes], known: Turning, turning: NDArray[np.intp]
    ) -> tuple[list[Crest], int]:
        """The maxima of responses that turn in a stretch, and the number of those not found."""
        left, right = stretch.left, stretch.right
        height = np.maximum(left.amplitude, right.amplitude)
        crests: list[Crest] = []
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
            found = crest(path, left, right, dof, start)
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

    def _may_lead(self, path: Between, share: float, dof: int, margin: float) -> bool:
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
