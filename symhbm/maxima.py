"""Maxima of responses between points of a path: stretches halved until each has one at most."""

from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from symhbm.corrector import Corrector
from symhbm.crests import Crest, crest, falls_at
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


class Stretches(NamedTuple):
    """Stretches of a path without an event in between, arrays along the first axis.

    ``number`` (n,) of the point of the path before each, and its ``begin`` and ``width`` (n,) as
    shares of the way from that point to the next; the solutions at both ends, and those next to
    them, NaN where there are none or an event stands between; the ``scale`` (n, n_unknowns + 1);
    ``roots`` (n, 2), at which end slip begins or ends; the contact states ``slip`` (n, n_contacts).
    """

    number: NDArray[np.intp]
    begin: FloatArray
    width: FloatArray
    left: Slopes
    right: Slopes
    before: Station
    after: Station
    scale: FloatArray
    roots: NDArray[np.bool_]
    slip: NDArray[np.bool_]

    def take(self, index: Any) -> Self:
        """Some of them."""
        return type(self)(*(values[index] for values in self))


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

    def between(self, stretches: Stretches) -> dict[int, list[Crest]]:
        """All in some stretches, in the order of the path."""
        depth = 0
        while len(stretches.number):
            most = max(_AT_ONCE // stretches.left.slope.shape[1], 1)
            parts = [
                stretches.take(slice(i, i + most)) for i in range(0, len(stretches.number), most)
            ]
            halves = [half for part in parts for half in self._halves(part, depth)]
            if not halves:
                break
            stretches = _joined(halves)
            depth += 1
        for crests in self._found.values():
            crests.sort(key=lambda crest: crest.share)
        return self._found

    def _halves(self, stretches: Stretches, depth: int) -> list[Stretches]:
        """Halves of those stretches that have to be looked at more closely."""
        known = turning(self._problem, *stretches[3:-1])
        candidates = (known.turns | known.unclear) & (known.contends | self._each)
        divided, middles = [], []
        for k in np.flatnonzero(candidates.any(axis=-1)).tolist():
            if stretches.number[k] in self.other_states:
                continue
            middle = self._look(stretches.take(k), known.take(k), depth)
            if middle is not None:
                divided.append(k)
                middles.append(middle)
        if not divided:
            return []
        curve, whole = self._corrector.curve, stretches.take(divided)
        state, direction = (
            np.array([getattr(m, name) for m in middles]) for name in ("state", "direction")
        )
        middle = Slopes.of(self._problem, Station(state, direction))
        width = whole.width / 2
        inner = np.zeros(len(divided), dtype=bool)
        first = whole._replace(
            width=width,
            right=middle,
            after=whole.right.bare(),
            roots=np.stack([whole.roots[:, 0], inner], -1),
        )
        second = whole._replace(
            begin=whole.begin + width,
            width=width,
            left=middle,
            before=whole.left.bare(),
            scale=np.array([curve.scale(state) for state in middle.state]),
            roots=np.stack([inner, whole.roots[:, 1]], -1),
        )
        return [first, second]

    def _look(self, stretch: Stretches, known: Turning, depth: int) -> Station | None:
        """A solution by which to halve one stretch; None if its maxima are known."""
        left, right, roots = stretch.left, stretch.right, stretch.roots
        path = Between(self._corrector, left, right, stretch.slip, stretch.scale, known.measured)
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
            middle = path.solve_between(0.5 + 0.25 * (float(roots[1]) - float(roots[0])))
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
        self, path: Between, stretch: Stretches, known: Turning, turning: NDArray[np.intp]
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


def _tied(at: Slopes, dof: int) -> NDArray[np.bool_]:
    """Which responses are as large as that of one degree of freedom."""
    return np.abs(at.amplitude - at.amplitude[dof]) <= TIE * at.amplitude.max()


def _joined(several: list[Stretches]) -> Stretches:
    columns = zip(*several, strict=True)
    return Stretches(
        *(
            column[0].joined(column) if isinstance(column[0], Station) else np.concatenate(column)
            for column in columns
        )
    )
