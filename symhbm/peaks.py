"""Peaks of the response over a path, solved for: smooth ones, corners and unbounded ones.

A peak is a local maximum over the path of the largest response of all degrees of freedom, or of
the response of each. It is *smooth* where the slope vanishes, a *corner* where slopes of opposite
sign meet at an onset or end of slip. A maximum at an end of the path is an edge, never a peak.

Between two points the path is known to third order; where that interpolant turns, or nearly does,
points are added until every maximum stands between slopes of opposite sign.
"""

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from symhbm.continuation import UNBOUNDED_AMPLIFICATION
from symhbm.corrector import Corrector
from symhbm.events import EventKind, PathPoint
from symhbm.extremes import largest_displacement
from symhbm.fourier import FloatArray
from symhbm.newton import ACCEPTED
from symhbm.residual import HarmonicBalance
from symhbm.stations import Between, Station

TIE = 1e-9
"""Responses this close, relatively, lead together; the first of them gives its name."""
_FLAT = 1e-6
"""Slopes that jump by more than this share of those around them make a corner."""
_STILL = 1e-9
"""Slope relative to the response below which it is constant, to round-off."""
_CONTENDER = 0.8
"""Share of the largest response at either end that a DOF needs to be watched in between."""
_SHARES = np.arange(1, 16) / 16
_NEARLY = 0.1
"""Slope, relative to the largest around, that may be an interpolated zero."""
_DIP = 0.99
"""Slope, relative to the smaller end's, below which it has a dip in between."""
_MAX_DEPTH = 5


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


@dataclass(frozen=True)
class _Summit(Station):
    """A solution with the amplitude of every DOF and its slope along the path, (n_dof,) each."""

    amplitude: FloatArray
    slope: FloatArray


def find_peaks(
    points: list[PathPoint], corrector: Corrector, each: bool = False
) -> tuple[list[Peak], int]:
    """Peaks between the first and the last of ``points``, of the largest or of ``each`` response.

    The second result is the number of maxima that could not be solved for.
    """
    curve = corrector.curve
    finder = _Finder(corrector, each)
    before = [finder.station(p.state, p.before) for p in points]
    after = [
        finder.station(p.state, p.after) if p.events else same
        for p, same in zip(points, before, strict=True)
    ]
    for here, left, right in zip(points[1:-1], before[1:-1], after[1:-1], strict=True):
        if here.events:
            finder.at_event(left, right)
    drowned = [curve.amplification(p.unknowns, p.value) > UNBOUNDED_AMPLIFICATION for p in points]
    for i, (here, there) in enumerate(pairwise(points)):
        if not (drowned[i] or drowned[i + 1]):
            roots = _has(here, EventKind.ONSET), _has(there, EventKind.END)
            finder.between(after[i], before[i + 1], here.slip, roots)
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


def leading(amplitude: FloatArray) -> int:
    """The DOF with the largest response, the first among those that tie."""
    return int(np.argmax(amplitude >= (1 - TIE) * amplitude.max()))


def amplitude_and_slope(
    problem: HarmonicBalance, unknowns: FloatArray, derivative: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Largest displacements of motions ``(..., n_unknowns)`` and their slopes, ``(..., n_dof)``."""
    size = problem.basis.n_components
    shape = (*unknowns.shape[:-1], problem.n_dof)
    coefficients = unknowns.reshape(-1, size)
    amplitude, angle = largest_displacement(problem.basis, coefficients)
    values = problem.basis.values(angle)
    # The angle of a maximum moves, but the derivative by it vanishes there.
    sign = np.sign(np.einsum("dm,dm->d", values, coefficients))
    slope = sign * np.einsum("dm,dm->d", values, derivative.reshape(-1, size))
    return amplitude.reshape(shape), slope.reshape(shape)


def _has(point: PathPoint, kind: EventKind) -> bool:
    return any(event.kind == kind for event in point.events)


def _tied(at: _Summit, dof: int) -> NDArray[np.bool_]:
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

    def station(self, state: FloatArray, direction: FloatArray) -> _Summit:
        found = amplitude_and_slope(self.problem, state[:-1], direction[:-1])
        return _Summit(state, direction, *found)

    def at_event(self, left: _Summit, right: _Summit) -> None:
        level = np.maximum(np.abs(left.slope), np.abs(right.slope))
        corner = np.minimum(left.slope, -right.slope) > _FLAT * level
        corner &= level > _STILL * left.amplitude
        if not self.each:
            corner &= np.arange(len(corner)) == leading(left.amplitude)
        for dof in np.flatnonzero(corner):
            self._add(left, int(dof), PeakKind.CORNER)

    def between(
        self,
        left: _Summit,
        right: _Summit,
        slip: NDArray[np.bool_],
        roots: tuple[bool, bool] = (False, False),
        depth: int = 0,
    ) -> None:
        """Add the peaks strictly between two stations, contact states constant in between.

        ``roots`` tells at which end slip begins or ends: slopes there go with the square root of
        the distance.
        """
        path = Between(self.corrector, left, right, slip)
        if path.length <= 0:
            return  # one point to the last digit
        height = np.maximum(left.amplitude, right.amplitude)
        floor = 0 if self.each else min(left.amplitude.max(), right.amplitude.max())
        watched = np.flatnonzero(height >= _CONTENDER * floor)
        tied = np.all([_tied(s, watched[0])[watched] for s in (left, right)], axis=0)
        watched = np.concatenate([watched[:1], watched[~tied]])
        inside = self._interpolated_slopes(path, left, right, roots)[:, watched]
        slopes = np.vstack([left.slope[watched], inside, right.slope[watched]])
        falls = np.count_nonzero((slopes[:-1] > 0) & (slopes[1:] <= 0), axis=0)
        level = np.abs(slopes).max(axis=0)
        still = _STILL * height[watched]
        moving = level > still
        turns = (slopes[0] > still) & (slopes[-1] <= still) & moving
        same = slopes[0] * slopes[-1] > 0
        climb = slopes * np.sign(slopes[0])
        lowest = climb[1:-1].min(axis=0)
        dips = lowest < _DIP * np.minimum(climb[0], climb[-1])
        # Next to a root of slip the slope may turn and turn back closer than any interpolant tells.
        at_root = np.min(climb[[0, -1]][np.array(roots)], axis=0, initial=np.inf)
        nearly = (dips & (lowest < _NEARLY * level)) | (at_root < _NEARLY * level)
        unclear = np.where(turns, falls > 1, (falls > 0) | (same & nearly))
        if depth < _MAX_DEPTH * (1 + any(roots)) and np.any(unclear & moving):
            share = 0.5 + 0.25 * (roots[1] - roots[0])
            middle = self._summit(path, share)
            if middle is not None:
                self.between(left, middle, slip, (roots[0], False), depth + 1)
                self.between(middle, right, slip, (False, roots[1]), depth + 1)
                return
        candidates = watched[turns]
        done = np.zeros(len(height), dtype=bool)
        for dof in candidates[np.argsort(-height[candidates])]:
            if done[dof]:
                continue
            found = self._turn(path, left, right, int(dof))
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

    def _add(self, at: _Summit, dof: int, kind: PeakKind) -> None:
        # The contacts were held on the way here: the solution must stand with all of them free.
        unknowns, value = at.state[:-1], float(at.state[-1])
        norm = self.curve.evaluate(unknowns, value).norm
        if norm > ACCEPTED:
            self.lost += 1
        else:
            self.peaks.append(Peak(value, float(at.amplitude[dof]), dof, kind, unknowns, norm))

    def _turn(
        self, path: Between, left: _Summit, right: _Summit, dof: int
    ) -> tuple[_Summit, PeakKind] | None:
        """Solve for the point between two others where the slope of one amplitude changes sign."""
        visited: dict[float, _Summit] = {}

        def slope(share: float) -> float:
            found = self._summit(path, share)
            if found is None:
                raise ArithmeticError
            visited[share] = found
            return float(found.slope[dof])

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
                known = {0.0: low, 1.0: high}
                share = float(
                    scipy.optimize.brentq(lambda h: known.get(h) or slope(h), 0, 1, xtol=1e-13)  # type: ignore
                )
            top = visited[share] if share in visited else self._summit(path, share)
        except ArithmeticError:
            return None
        if top is None:
            return None
        jump = abs(top.slope[dof]) > _FLAT * level and 0.0 < share < 1.0
        return top, PeakKind.CORNER if jump else PeakKind.SMOOTH

    def _summit(self, path: Between, share: float) -> _Summit | None:
        found = path.solve(share)
        return None if found is None else self.station(found.state, found.direction)

    def _interpolated_slopes(
        self, path: Between, left: _Summit, right: _Summit, roots: tuple[bool, bool]
    ) -> FloatArray:
        """Slopes of all amplitudes in between, (n, n_dof), in the measure of the left end."""
        one_root = roots[0] != roots[1]
        shares = np.array([0.0, 1.0]) if one_root else _SHARES
        value, slope = path.interpolate(shares)
        slopes = amplitude_and_slope(self.problem, value[:, :-1], slope[:, :-1] / path.length)[1]
        if not one_root:
            return slopes
        # slope = a + c t + d t^2, t the root of the distance: both ends and the mean are known.
        at_root, other = slopes if roots[0] else slopes[::-1]
        mean = (right.amplitude - left.amplitude) / path.length
        c = 6 * (mean - at_root) - 3 * (other - at_root)
        t = (_SHARES if roots[0] else _SHARES[::-1])[:, None]
        return at_root + c * t + (other - at_root - c) * t**2
