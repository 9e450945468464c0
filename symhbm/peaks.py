"""Peaks of the response over a path, solved for: smooth ones, corners and unbounded ones.

A peak is a local maximum over the path of the largest response of all degrees of freedom, or of
the response of each. It is *smooth* where the slope vanishes, a *corner* where slopes of opposite
sign meet at an onset or end of slip. A maximum at an end of the path is an edge, never a peak.

Between two points the path is known to third order; where that interpolant turns, or nearly does,
points are added until every maximum stands between slopes of opposite sign.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import scipy
from numpy.typing import NDArray

from symhbm.continuation import UNBOUNDED_AMPLIFICATION
from symhbm.corrector import Corrector
from symhbm.events import EventKind, PathPoint
from symhbm.fourier import FloatArray
from symhbm.newton import ACCEPTED
from symhbm.residual import HarmonicBalance
from symhbm.slopes import STILL, TIE, Slopes, Turning, amplitude_and_slope, leading, turning
from symhbm.stations import Between, Station

_FLAT = 1e-6
"""Slopes that jump by more than this share of those around them make a corner."""
_MAX_DEPTH = 5
_AT_ONCE = 2**16
"""Slopes that are interpolated at once, which bounds the memory of large structures."""
_ASIDE = 1e-6
"""Distance from a peak, as a share of the way, at which slopes tell that it is a maximum."""
_AROUND = np.array([-0.1, 0.0, 0.1])
"""Distances, as shares of the way, by which the place of an interpolated maximum may be wrong."""
_ROUGHLY = 0.01
"""Part of the change over a stretch by which what is interpolated may be wrong."""
_MAX_SECANTS = 12
_PRECISION = 1e-11
"""Last step of the search for a peak, as a share of the way between two points."""


class PeakKind(StrEnum):
    """What makes a peak; an unbounded one grows beyond what double precision can balance."""

    SMOOTH = "smooth"
    CORNER = "corner"
    UNBOUNDED = "unbounded"


@dataclass(frozen=True)
class Peak:
    """A peak: parameter ``value``, ``amplitude`` [m] of ``dof`` and the solution there."""

    value: float
    amplitude: float
    dof: int
    kind: PeakKind
    unknowns: FloatArray
    residual_norm: float


def find_peaks(
    points: list[PathPoint], corrector: Corrector, each: bool = False
) -> tuple[list[Peak], int]:
    """Peaks between the first and the last of ``points``, of the largest or of ``each`` response.

    The second result is the number of maxima that could not be solved for.
    """
    if len(points) < 2:
        return [], 0
    finder = _Finder(corrector, each)
    problem = corrector.curve.problem
    state, scale = (np.array([getattr(p, name) for p in points]) for name in ("state", "scale"))
    before, after = (
        Slopes.of(problem, Station(state, np.array([getattr(p, name) for p in points])))
        for name in ("before", "after")
    )
    for i, here in enumerate(points[1:-1], 1):
        if here.events:
            finder.at_event(before[i], after[i])
    drowned = np.array([p.amplification > UNBOUNDED_AMPLIFICATION for p in points])
    onset, end = (np.array([_has(p, k) for p in points]) for k in (EventKind.ONSET, EventKind.END))
    roots = np.stack([onset[:-1], end[1:]], axis=-1)
    stretches = np.flatnonzero(~(drowned[:-1] | drowned[1:]))
    most = max(_AT_ONCE // before.slope.shape[1], 1)
    for part in np.array_split(stretches, -(-len(stretches) // most) or 1):
        left, right = after[part], before[part + 1]
        found = turning(problem, left, right, scale[part], roots[part], each)
        candidates = (found.turns | found.unclear) & (found.contends | each)
        for k in np.flatnonzero(candidates.any(axis=-1)):
            i = part[k]
            known = Turning(*(array[k] for array in found))
            finder.between(after[i], before[i + 1], points[i].slip, roots[i], known)
    return sorted(finder.peaks, key=lambda peak: (each * peak.dof, peak.value)), finder.lost


def unbounded_peak(problem: HarmonicBalance, point: PathPoint, direction: FloatArray) -> Peak:
    """The pole that a path climbs, from its last point and the tangent there.

    The response is ``1/(pole - value)``.
    """
    amplitude, slope = amplitude_and_slope(problem, point.unknowns, direction[:-1])
    dof = leading(amplitude)
    value = point.value + float(amplitude[dof] / slope[dof] * direction[-1])
    nothing = np.full_like(point.unknowns, np.nan)
    return Peak(value, np.inf, dof, PeakKind.UNBOUNDED, nothing, np.nan)


def _has(point: PathPoint, kind: EventKind) -> bool:
    return any(event.kind == kind for event in point.events)


def _tied(at: Slopes, dof: int) -> NDArray[np.bool_]:
    """Which responses are as large as that of one degree of freedom."""
    return np.abs(at.amplitude - at.amplitude[dof]) <= TIE * at.amplitude.max()


class _Finder:
    def __init__(self, corrector: Corrector, each: bool):
        self.curve = corrector.curve
        self.problem = self.curve.problem
        self.corrector = corrector
        self.each = each
        self.peaks: list[Peak] = []
        self.lost = 0

    def at_event(self, left: Slopes, right: Slopes) -> None:
        level = np.maximum(np.abs(left.slope), np.abs(right.slope))
        corner = np.minimum(left.slope, -right.slope) > _FLAT * level
        corner &= level > STILL * left.amplitude
        if not self.each:
            corner &= np.arange(len(corner)) == leading(left.amplitude)
        for dof in np.flatnonzero(corner):
            self._add(left, int(dof), PeakKind.CORNER)

    def between(
        self,
        left: Slopes,
        right: Slopes,
        slip: NDArray[np.bool_],
        roots: NDArray[np.bool_],
        known: Turning | None = None,
        depth: int = 0,
    ) -> None:
        """Add the peaks strictly between two stations, contact states constant in between.

        ``roots`` (2,) tells at which end slip begins or ends; ``known`` is what `turning` tells.
        """
        path = Between(self.corrector, left, right, slip)
        if path.length <= 0:
            return  # one point to the last digit
        height = np.maximum(left.amplitude, right.amplitude)
        known = known or turning(self.problem, left, right, path.scale, roots, self.each, depth)
        watched = np.flatnonzero(known.contends | self.each)
        tied = np.all([_tied(s, watched[0])[watched] for s in (left, right)], axis=0)
        watched = np.concatenate([watched[:1], watched[~tied]])
        turns, unclear, slopes = known.turns[watched], known.unclear[watched], known.slopes
        if depth < _MAX_DEPTH * (1 + roots.any()) and np.any(unclear):
            share = 0.5 + 0.25 * (float(roots[1]) - float(roots[0]))
            middle = self._slopes_at(path, share)
            if middle is not None:
                self.between(left, middle, slip, np.array([roots[0], False]), depth=depth + 1)
                self.between(middle, right, slip, np.array([False, roots[1]]), depth=depth + 1)
                return
        candidates = watched[turns]
        done = np.zeros(len(height), dtype=bool)
        for dof in candidates[np.argsort(-height[candidates])]:
            if done[dof]:
                continue
            share = _falls_at(slopes[:, dof], roots)
            if not (self.each or roots.any() or self._may_lead(path, share, int(dof))):
                continue
            found = self._turn(path, left, right, int(dof), share)
            if found is None:
                self.lost += 1
                continue
            top, kind = found
            same = np.abs(top.amplitude - top.amplitude[dof]) <= TIE * top.amplitude[dof]
            if self.each:
                # Degrees of freedom that move alike all along peak together.
                alike = np.all([_tied(s, dof) for s in (left, right)], axis=0) & same
                for other in np.flatnonzero(alike):
                    self._add(top, int(other), kind)
                done |= alike
                continue
            done |= same
            if top.amplitude[dof] >= (1 - TIE) * top.amplitude.max():
                self._add(top, leading(top.amplitude), kind)

    def _add(self, at: Slopes, dof: int, kind: PeakKind) -> None:
        # The contacts were held on the way here: the solution must stand with all of them free.
        unknowns, value = at.state[:-1], float(at.state[-1])
        norm = self.curve.evaluate(unknowns, value).norm
        if norm > ACCEPTED:
            self.lost += 1
        else:
            self.peaks.append(Peak(value, float(at.amplitude[dof]), dof, kind, unknowns, norm))

    def _turn(
        self, path: Between, left: Slopes, right: Slopes, dof: int, start: float
    ) -> tuple[Slopes, PeakKind] | None:
        """Solve for the point between two others where the slope of one amplitude changes sign.

        ``start`` is about where, as a share of the way.
        """
        visited: dict[float, Slopes] = {}

        def slope(share: float) -> float:
            if share not in visited:
                near = min(visited.items(), key=lambda s: abs(s[0] - share), default=None)
                found = self._slopes_at(path, share, near) if 0 <= share <= 1 else None
                if found is None:
                    raise ArithmeticError
                visited[share] = found
            return float(visited[share].slope[dof])

        # A slope close to zero is no better than the tangent of its point: solve for it anew.
        ends = float(left.slope[dof]), float(right.slope[dof])
        level = max(ends[0], -ends[1])
        try:
            low, high = (
                s if abs(s) > 1e-2 * level else slope(float(h)) for h, s in enumerate(ends)
            )
            if low <= 0 or high >= 0:
                share = 0.0 if low <= 0 else 1.0
            else:
                share = _zero(slope, low, high, start)
            slope(share)
        except ArithmeticError:
            return None
        top = visited[share]
        jump = abs(top.slope[dof]) > _FLAT * level and 0.0 < share < 1.0
        return top, PeakKind.CORNER if jump else PeakKind.SMOOTH

    def _may_lead(self, path: Between, share: float, dof: int) -> bool:
        """Whether a response may be the largest where it turns, about at a ``share`` of the way."""
        value, slope = path.interpolate(np.clip(share + _AROUND, 0.0, 1.0))
        amplitude = amplitude_and_slope(self.problem, value[:, :-1], slope[:, :-1])[0]
        margin = _ROUGHLY * path.length * path.scale[0]
        return bool(np.any(amplitude[:, dof] + margin >= amplitude.max(axis=1)))

    def _slopes_at(
        self, path: Between, share: float, near: tuple[float, Slopes] | None = None
    ) -> Slopes | None:
        found = path.solve(share, near)
        return None if found is None else Slopes.of(self.problem, found)


def _falls_at(slopes: FloatArray, roots: NDArray[np.bool_]) -> float:
    """Share of the way where the slopes (n,) of a `Turning` first change from rise to fall."""
    fall = int(np.argmax((slopes[:-1] > 0) & (slopes[1:] <= 0)))
    inside = slopes[fall] / (slopes[fall] - slopes[fall + 1])
    place = float(fall + inside) / (len(slopes) - 1)
    if roots[0] == roots[1]:
        return place
    return place**2 if roots[0] else 1 - (1 - place) ** 2  # evenly spaced by the root of distance


def _zero(slope: Callable[[float], float], low: float, high: float, start: float) -> float:
    """Share of the way where a slope falls through zero, by secants from the ``start``.

    ``low`` and ``high`` are its values at both ends; Brent's method where secants fail.
    """
    known = {0.0: low, 1.0: high}

    def remembered(share: float) -> float:
        if share not in known:
            known[share] = slope(share)
        return known[share]

    first = remembered(start)
    other = 1.0 if first > 0 else 0.0  # where the slope has the other sign
    share, before = start, other
    for _ in range(_MAX_SECANTS):
        rise = remembered(share) - remembered(before)
        step = -remembered(share) * (share - before) / rise if rise else np.inf
        if not 0 <= share + step <= 1:
            break
        share, before = share + step, share
        if abs(step) <= _PRECISION:
            left = max((h for h in known if h < share - _ASIDE), default=0.0)
            right = min((h for h in known if h > share + _ASIDE), default=1.0)
            if known[left] >= 0 >= known[right]:
                return share
            break
    return float(scipy.optimize.brentq(remembered, 0, 1, xtol=1e-13))  # type: ignore
