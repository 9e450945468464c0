"""Peaks of the response over a path, solved for: smooth ones, corners and unbounded ones.

A peak is a local maximum over the path of the largest response of all degrees of freedom. It is
*smooth* where the slope vanishes, a *corner* where slopes of opposite sign meet at an onset or end
of slip. A maximum at an end of the path is an edge, never a peak.

Between two points the path is known to third order; where that interpolant turns, or nearly does,
points are added until every maximum stands between slopes of opposite sign.
"""

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from symhbm.continuation import UNBOUNDED_AMPLIFICATION
from symhbm.corrector import Corrected, Corrector, hyperplane, natural_scale, unit_parameter
from symhbm.curve import Curve
from symhbm.events import PathPoint, crossed
from symhbm.extremes import largest_displacement
from symhbm.fourier import FloatArray
from symhbm.hermite import cubic, cubic_slope
from symhbm.newton import ACCEPTED, newton
from symhbm.residual import HarmonicBalance

TIE = 1e-9
"""Responses this close, relatively, lead together; the first of them gives its name."""
_FLAT = 1e-6
"""Slopes that jump by more than this share of those around them make a corner."""
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
class _Station:
    """A solution, its tangent (n_unknowns + 1,), and amplitude and slope of every DOF (n_dof,)."""

    state: FloatArray
    direction: FloatArray
    amplitude: FloatArray
    slope: FloatArray


def find_peaks(
    curve: Curve, points: list[PathPoint], corrector: Corrector
) -> tuple[list[Peak], int]:
    """Peaks of the largest response between the first and the last of ``points``.

    The second result is the number of maxima that could not be solved for.
    """
    finder = _Finder(curve, corrector)
    before = [finder.station(p.state, p.before) for p in points]
    after = [
        finder.station(p.state, p.after) if p.events else same
        for p, same in zip(points, before, strict=True)
    ]
    for here, left, right in zip(points[1:-1], before[1:-1], after[1:-1], strict=True):
        if here.events:
            finder.at_event(left, right)
    drowned = [curve.amplification(p.unknowns, p.value) > UNBOUNDED_AMPLIFICATION for p in points]
    for i, (here, _) in enumerate(pairwise(points)):
        if not (drowned[i] or drowned[i + 1]):
            finder.between(after[i], before[i + 1], here.slip)
    return sorted(finder.peaks, key=lambda peak: peak.value), finder.lost


def unbounded_peak(problem: HarmonicBalance, point: PathPoint) -> Peak:
    """The pole that a path climbs at its last point, where the response is ``1/(pole - value)``."""
    amplitude, slope = _amplitude_and_slope(problem, point.unknowns, point.before[:-1])
    dof = leading(amplitude)
    value = point.value + float(amplitude[dof] / slope[dof] * point.before[-1])
    nothing = np.full_like(point.unknowns, np.nan)
    return Peak(value, np.inf, dof, PeakKind.UNBOUNDED, nothing, np.nan)


def leading(amplitude: FloatArray) -> int:
    """The DOF with the largest response, the first among those that tie."""
    return int(np.argmax(amplitude >= (1 - TIE) * amplitude.max()))


def _amplitude_and_slope(
    problem: HarmonicBalance, unknowns: FloatArray, derivative: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Largest displacements of motions ``(..., n_unknowns)`` and their slopes, ``(..., n_dof)``."""
    size = problem.basis.n_components
    shape = (*unknowns.shape[:-1], problem.model.n_dof)
    coefficients = unknowns.reshape(-1, size)
    amplitude, angle = largest_displacement(problem.basis, coefficients)
    values = problem.basis.values(angle)
    # The angle of a maximum moves, but the derivative by it vanishes there.
    sign = np.sign(np.einsum("dm,dm->d", values, coefficients))
    slope = sign * np.einsum("dm,dm->d", values, derivative.reshape(-1, size))
    return amplitude.reshape(shape), slope.reshape(shape)


class _Finder:
    def __init__(self, curve: Curve, corrector: Corrector):
        self.curve = curve
        self.problem = curve.problem
        self.corrector = corrector
        self.peaks: list[Peak] = []
        self.lost = 0

    def station(self, state: FloatArray, direction: FloatArray) -> _Station:
        found = _amplitude_and_slope(self.problem, state[:-1], direction[:-1])
        return _Station(state, direction, *found)

    def at_event(self, left: _Station, right: _Station) -> None:
        dof = leading(left.amplitude)
        level = max(abs(left.slope[dof]), abs(right.slope[dof]))
        if min(left.slope[dof], -right.slope[dof]) > _FLAT * level:
            self._add(left, dof, PeakKind.CORNER)

    def between(
        self, left: _Station, right: _Station, slip: NDArray[np.bool_], depth: int = 0
    ) -> None:
        """Add the peaks strictly between two stations, contact states constant in between."""
        floor = _CONTENDER * min(left.amplitude.max(), right.amplitude.max())
        watched = np.flatnonzero(np.maximum(left.amplitude, right.amplitude) >= floor)
        tied = np.all(
            [
                np.abs(s.amplitude[watched] - s.amplitude[watched[0]]) <= TIE * s.amplitude.max()
                for s in (left, right)
            ],
            axis=0,
        )
        watched = np.concatenate([watched[:1], watched[~tied]])
        inside = self._interpolated_slopes(left, right)[:, watched]
        slopes = np.vstack([left.slope[watched], inside, right.slope[watched]])
        falls = np.count_nonzero((slopes[:-1] > 0) & (slopes[1:] <= 0), axis=0)
        turns = (slopes[0] > 0) & (slopes[-1] <= 0)
        level = np.abs(slopes).max(axis=0)
        same = slopes[0] * slopes[-1] > 0
        climb = slopes * np.sign(slopes[0])
        lowest = climb[1:-1].min(axis=0)
        dips = lowest < _DIP * np.minimum(climb[0], climb[-1])
        nearly = dips & (lowest < _NEARLY * level)
        unclear = np.where(turns, falls > 1, (falls > 0) | (same & nearly))
        if depth < _MAX_DEPTH and np.any(unclear & (level > 0)):
            middle = self._solve(left, right, 0.5, slip)
            if middle is not None:
                self.between(left, middle, slip, depth + 1)
                self.between(middle, right, slip, depth + 1)
                return
        candidates = watched[turns]
        height = np.maximum(left.amplitude, right.amplitude)
        done = np.zeros(len(height), dtype=bool)
        for dof in candidates[np.argsort(-height[candidates])]:
            if done[dof]:
                continue
            found = self._turn(left, right, int(dof), slip)
            if found is None:
                self.lost += 1
                continue
            top, kind = found
            done |= np.abs(top.amplitude - top.amplitude[dof]) <= TIE * top.amplitude[dof]
            if top.amplitude[dof] >= (1 - TIE) * top.amplitude.max():
                self._add(top, leading(top.amplitude), kind)

    def _add(self, at: _Station, dof: int, kind: PeakKind) -> None:
        # The contacts were held on the way here: the solution must stand with all of them free.
        unknowns, value = at.state[:-1], float(at.state[-1])
        norm = self.curve.evaluate(unknowns, value).norm
        if norm > ACCEPTED:
            self.lost += 1
        else:
            self.peaks.append(Peak(value, float(at.amplitude[dof]), dof, kind, unknowns, norm))

    def _turn(
        self, left: _Station, right: _Station, dof: int, slip: NDArray[np.bool_]
    ) -> tuple[_Station, PeakKind] | None:
        """Solve for the point between two others where the slope of one amplitude changes sign."""
        visited: dict[float, _Station] = {}

        def slope(share: float) -> float:
            found = self._solve(left, right, share, slip)
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
                    optimize.brentq(lambda h: known.get(h) or slope(h), 0, 1, xtol=1e-13)  # type: ignore
                )
            top = visited[share] if share in visited else self._solve(left, right, share, slip)
        except ArithmeticError:
            return None
        if top is None:
            return None
        jump = abs(top.slope[dof]) > _FLAT * level and 0.0 < share < 1.0
        return top, PeakKind.CORNER if jump else PeakKind.SMOOTH

    def _solve(
        self, left: _Station, right: _Station, share: float, slip: NDArray[np.bool_]
    ) -> _Station | None:
        """The station at a share of the way, on the path."""
        scale = natural_scale(left.state)
        normal, length = self._chord(left, right)
        guess = self._hermite(left, right, np.array([share]))[0][0]
        anchor = left.state + share * length * normal * scale
        plane = hyperplane(anchor, scale, normal)
        if self.curve.single_valued:
            guess[-1] = np.clip(guess[-1], *sorted((left.state[-1], right.state[-1])))
        found = self.corrector.correct(guess, scale, plane, slip, precision=1e-10)
        if found is not None and self._holds(left, right, found, slip):
            return self.station(found.point, found.direction * scale)
        if not self.curve.single_valued:
            return None
        result = newton(lambda unknowns: self.curve.evaluate(unknowns, guess[-1]), guess[:-1])
        self.corrector.solves += result.iterations
        if not result.converged:
            return None
        state = np.append(result.unknowns, guess[-1])
        row = np.sign(left.direction[-1]) * unit_parameter(len(scale))
        tangent = self.corrector.tangent(state, scale, row, result.evaluation.friction.slip)
        if tangent is None:
            return None
        return self.station(state, tangent.direction * scale)

    def _holds(
        self, left: _Station, right: _Station, found: Corrected, slip: NDArray[np.bool_]
    ) -> bool:
        """Whether a solution lies between two others, no contact beyond its limit."""
        if not self.curve.single_valued:
            return True
        low, high = sorted((left.state[-1], right.state[-1]))
        return low <= found.point[-1] <= high and not crossed(found.evaluation, slip).any()

    def _chord(self, left: _Station, right: _Station) -> tuple[FloatArray, float]:
        scale = natural_scale(left.state)
        normal = left.direction / scale
        normal /= np.linalg.norm(normal)
        chord = (right.state - left.state) / scale
        if self.curve.single_valued and np.dot(normal, chord) < np.linalg.norm(chord) / 2:
            # The path turns sharply in between: only the parameter tells where one is.
            normal = np.sign(left.direction[-1]) * unit_parameter(len(scale))
        return normal, float(np.dot(normal, chord))

    def _hermite(
        self, left: _Station, right: _Station, share: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Cubic interpolant of the path and its derivative, ``(n, n_unknowns + 1)``."""
        scale = natural_scale(left.state)
        normal, length = self._chord(left, right)
        slopes = (
            length * left.direction / np.dot(normal, left.direction / scale),
            length * right.direction / max(np.dot(normal, right.direction / scale), 1e-3),
        )
        ends = left.state, right.state, slopes, share[:, None]
        return cubic(*ends), cubic_slope(*ends)

    def _interpolated_slopes(self, left: _Station, right: _Station) -> FloatArray:
        """Slopes of all amplitudes at shares in between, in the measure of the left station."""
        value, slope = self._hermite(left, right, _SHARES)
        _, length = self._chord(left, right)
        return _amplitude_and_slope(self.problem, value[:, :-1], slope[:, :-1] / length)[1]
