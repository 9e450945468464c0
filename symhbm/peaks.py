"""Peaks of the response over a path, solved for: smooth ones, corners and unbounded ones.

A peak is a local maximum over the path of the largest response of all degrees of freedom. It is
*smooth* where the slope vanishes, a *corner* where slopes of opposite sign meet at an onset or end
of slip. A maximum at an end of the path is an edge, never a peak.
"""

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np
from scipy import optimize

from symhbm.continuation import PathPoint
from symhbm.corrector import Corrected, Corrector, hyperplane, natural_scale
from symhbm.curve import Curve
from symhbm.extremes import largest_displacement
from symhbm.fourier import FloatArray
from symhbm.residual import HarmonicBalance

TIE = 1e-9
"""Responses this close, relatively, lead together; the first of them gives its name."""
_FLAT = 1e-6
"""Slopes that jump by more than this share of those around them make a corner."""


class PeakKind(StrEnum):
    """What makes a peak."""

    SMOOTH = "smooth"
    CORNER = "corner"
    UNBOUNDED = "unbounded"


class PeakError(ArithmeticError):
    """A maximum between two points of a path could not be solved for."""


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
class _Side:
    """A point seen from one side: amplitude and slope by arc length of every DOF (n_dof,)."""

    amplitude: FloatArray
    slope: FloatArray


def find_peaks(curve: Curve, points: list[PathPoint], corrector: Corrector) -> list[Peak]:
    """Locate every peak of the largest response between the first and the last of ``points``.

    Raises PeakError if the points around a maximum do not let it be solved for.
    """
    problem = curve.problem
    peaks: list[Peak] = []
    sides = [_sides(problem, point) for point in points]
    for here, (left, right) in zip(points[1:-1], sides[1:-1], strict=True):
        peaks += _corner(here, left, right)
    for i, (here, there) in enumerate(pairwise(points)):
        peaks += _within(curve, corrector, here, there, sides[i][1], sides[i + 1][0])
    return sorted(peaks, key=lambda peak: peak.value)


def unbounded_peak(problem: HarmonicBalance, point: PathPoint) -> Peak:
    """The pole that a path climbs at its last point, where the response is ``1/(pole - value)``."""
    side = _side(problem, point.unknowns, point.before)
    dof = leading(side.amplitude)
    value = point.value + float(side.amplitude[dof] / side.slope[dof] * point.before[-1])
    nothing = np.full_like(point.unknowns, np.nan)
    return Peak(value, np.inf, dof, PeakKind.UNBOUNDED, nothing, np.nan)


def leading(amplitude: FloatArray) -> int:
    """The DOF with the largest response, the first among those that tie."""
    return int(np.argmax(amplitude >= (1 - TIE) * amplitude.max()))


def _sides(problem: HarmonicBalance, point: PathPoint) -> tuple[_Side, _Side]:
    before = _side(problem, point.unknowns, point.before)
    return before, before if not point.events else _side(problem, point.unknowns, point.after)


def _side(problem: HarmonicBalance, unknowns: FloatArray, direction: FloatArray) -> _Side:
    coefficients = problem.coefficients(unknowns)
    amplitude, angle = largest_displacement(problem.basis, coefficients)
    values = problem.basis.values(angle)
    # The angle of a maximum moves, but the derivative by it vanishes there.
    sign = np.sign(np.einsum("dm,dm->d", values, coefficients))
    along = problem.coefficients(direction[:-1])
    return _Side(amplitude, sign * np.einsum("dm,dm->d", values, along))


def _corner(point: PathPoint, left: _Side, right: _Side) -> list[Peak]:
    dof = leading(left.amplitude)
    level = max(abs(left.slope[dof]), abs(right.slope[dof]))
    if not point.events or min(left.slope[dof], -right.slope[dof]) <= _FLAT * level:
        return []
    amplitude = float(left.amplitude[dof])
    return [Peak(point.value, amplitude, dof, PeakKind.CORNER, point.unknowns, point.residual_norm)]


def _within(
    curve: Curve,
    corrector: Corrector,
    here: PathPoint,
    there: PathPoint,
    right: _Side,
    left: _Side,
) -> list[Peak]:
    """Peaks strictly between two points of a path, contact states constant in between."""
    scale = natural_scale(here.state)
    normal = here.after / scale
    length = float(np.dot(normal, (there.state - here.state) / scale))
    turning = (right.slope > 0) & (left.slope <= 0)
    floor = min(right.amplitude.max(), left.amplitude.max())
    height = _hermite_top(right, left, length)
    peaks: list[Peak] = []
    done = ~turning | (height < (1 - 0.05) * floor)
    for dof in np.argsort(-height):
        if done[dof]:
            continue
        slopes = float(right.slope[dof]), float(left.slope[dof])
        found, kind = _turn(curve, corrector, here, there, int(dof), length, slopes)
        amplitude = _side(curve.problem, found.point[:-1], found.direction).amplitude
        top = amplitude[dof]
        done |= np.abs(amplitude - top) <= TIE * top
        if top >= (1 - TIE) * amplitude.max():
            peaks.append(
                Peak(
                    float(found.point[-1]),
                    float(top),
                    leading(amplitude),
                    kind,
                    found.point[:-1],
                    found.evaluation.norm,
                )
            )
    return peaks


def _hermite_top(right: _Side, left: _Side, length: float) -> FloatArray:
    """Upper estimate of each amplitude between two points, from values and slopes."""
    return np.maximum(
        right.amplitude + np.maximum(right.slope, 0) * length,
        left.amplitude + np.maximum(-left.slope, 0) * length,
    )


def _turn(
    curve: Curve,
    corrector: Corrector,
    here: PathPoint,
    there: PathPoint,
    dof: int,
    length: float,
    slopes: tuple[float, float],
) -> tuple[Corrected, PeakKind]:
    """Solve for the point between two others where the slope of one amplitude changes sign."""
    scale = natural_scale(here.state)
    normal = here.after / scale
    start, end = here.state, there.state
    stretch = length / max(np.dot(normal, there.before / scale), 1e-3)
    visited: dict[float, tuple[float, Corrected]] = {}

    def point_at(share: float) -> Corrected:
        h = share
        guess = (
            (1 + 2 * h) * (1 - h) ** 2 * start
            + h * (1 - h) ** 2 * length * here.after
            + h**2 * (3 - 2 * h) * end
            + h**2 * (h - 1) * stretch * there.before
        )
        anchor = start + share * length * here.after
        found = corrector.correct(
            guess, scale, hyperplane(anchor, scale, normal), here.slip, precision=1e-10
        )
        if found is None:
            raise PeakError
        return found

    def slope(share: float) -> float:
        found = point_at(share)
        ahead = found.direction * scale
        value = float(_side(curve.problem, found.point[:-1], ahead).slope[dof])
        visited[share] = value, found
        return value

    # A slope close to zero is no better than the tangent of its point: solve for it anew.
    level = max(slopes[0], -slopes[1])
    low, high = (s if abs(s) > 1e-2 * level else slope(h) for h, s in enumerate(slopes))
    if low <= 0 or high >= 0:
        share = 0.0 if low <= 0 else 1.0
    else:
        known = {0.0: low, 1.0: high}
        share = float(
            optimize.brentq(lambda h: known.get(h) or slope(h), 0.0, 1.0, xtol=1e-13)  # type: ignore
        )
    if share not in visited:
        slope(share)
    value, found = visited[share]
    jump = abs(value) > _FLAT * level and 0.0 < share < 1.0
    return found, PeakKind.CORNER if jump else PeakKind.SMOOTH
