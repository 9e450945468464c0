"""What a good engineer would write for speed: a response over samples, compiled as one loop.

Pseudo-arclength continuation with Newton's method goes from one end of the band to the other and
then solves for the highest peak, all in one function that numba compiles.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from tests.benchmarks.aft import System, amplitudes, evaluate

CLOSE, FARTHEST, LONGEST, SHORTEST = 0.05, 0.15, 0.3, 1e-7
"""Distance between predicted and corrected point that steps aim at and at most have, step sizes."""
PRECISION = 1e-7
"""Length of the last step of Newton's method, relative to the response."""


@dataclass(frozen=True)
class Response:
    """``frequency`` (n_points,) [Hz], ``amplitude`` (n_points, n_dof) [m] and the highest peak."""

    frequency: np.ndarray
    amplitude: np.ndarray
    peak_frequency: float
    peak_amplitude: float
    complete: bool


def response(system: System, band: tuple[float, float], maximum: int = 20000) -> Response:
    """Follow the response over a band [Hz] upwards and find its highest peak."""
    start, end = (2 * np.pi * edge for edge in band)
    points, amplitude, peak = _follow(system, start, end, maximum)
    frequency = points[:, -1] / (2 * np.pi)
    complete = bool(points[-1, -1] == end)
    return Response(frequency, amplitude, peak[0] / (2 * np.pi), peak[1], complete)


@njit
def _correct(system, guess, scale, normal, radius):
    """Newton's method on the plane through ``guess``: whether it converged, point and tangent."""
    n = len(guess)
    point, tangent = guess.copy(), normal
    matrix, right = np.zeros((n, n)), np.zeros((n, 2))
    matrix[-1], right[-1, 1] = normal, 1.0
    largest = np.abs(system.force).max()
    for _ in range(12):
        right[:-1, 0] = -evaluate(system, point, matrix) / largest
        if not np.all(np.isfinite(right)):
            break
        matrix[:-1] *= scale / largest
        solution = np.linalg.solve(matrix, right)
        point += solution[:, 0] * scale
        tangent = solution[:, 1] * scale
        if np.linalg.norm((point - guess) / scale) > radius:
            break
        if np.linalg.norm(solution[:, 0]) < PRECISION:
            return True, point, tangent
    return False, point, tangent


@njit
def _scale(point):
    scale = np.full(len(point), np.linalg.norm(point[:-1]))
    scale[-1] = point[-1]
    return scale


@njit
def _at(system, guess, omega):
    """The point at a frequency, from a guess: whether it was found, and the tangent there."""
    normal = np.zeros(len(guess))
    normal[-1] = 1.0
    start = guess.copy()
    start[-1] = omega
    return _correct(system, start, _scale(start), normal, np.inf)


@njit
def _stuck(system, omega):
    """The linear response with all contacts stuck."""
    point = np.zeros(len(system.force) + 1)
    point[-1] = omega
    matrix = np.zeros((len(point), len(point)))
    residual = evaluate(system, point, matrix)
    point[:-1] = np.linalg.solve(matrix[:-1, :-1].copy(), -residual)
    return point


@njit
def _follow(system, start, end, maximum):
    found, point, tangent = _at(system, _stuck(system, start), start)
    points = np.empty((maximum, len(point)))
    points[0], count, step = point, 1, 0.1
    while found and point[-1] != end and count < maximum and step > 1e-12:
        scale = _scale(point)
        if step > SHORTEST:
            direction = tangent / scale
            normal = direction / np.linalg.norm(direction)
        else:  # a corner where the curve turns by more than a right angle: a step in frequency
            normal = np.zeros(len(point))
            normal[-1] = 1.0
        guess = point + step * normal * scale
        ok, new, direction = _correct(system, guess, scale, normal, FARTHEST)
        if ok and new[-1] > end:
            ok, new, direction = _at(system, guess, end)
        if not ok or new[-1] <= point[-1]:
            step /= 2
            continue
        distance = np.linalg.norm((new - guess) / scale)
        step *= min(2.0, max(0.5, np.sqrt(CLOSE / max(distance, 1e-9))))
        step = min(LONGEST, max(step, 10 * SHORTEST))
        point, tangent = new, direction
        points[count] = point
        count += 1
    points = points[:count]
    amplitude = np.empty((count, len(amplitudes(system, point))))
    for i in range(count):
        amplitude[i] = amplitudes(system, points[i])
    return points, amplitude, _peak(system, points, amplitude)


@njit
def _peak(system, points, amplitude):
    """Frequency and height of the highest peak, by parabolas through three solved points."""
    top, height = 1, 0.0
    for i in range(1, len(points) - 1):
        if amplitude[i].max() > height:
            top, height = i, amplitude[i].max()
    x = points[top - 1 : top + 2, -1].copy()
    y = np.array([amplitude[i].max() for i in range(top - 1, top + 2)])
    guess = points[top]
    for _ in range(20):
        left, right = x[1] - x[0], x[2] - x[1]
        slope_left, slope_right = (y[1] - y[0]) / left, (y[2] - y[1]) / right
        curvature = (slope_right - slope_left) / (left + right)
        new = 0.5 * (x[0] + x[1]) - slope_left / (2 * curvature)
        # A step of no length, or one that falls on a point, would not shrink the bracket.
        if not x[0] < new < x[2] or abs(new - x[1]) < 1e-8 * new:
            break
        found, guess, _ = _at(system, guess, new)
        if not found:
            break
        value = amplitudes(system, guess).max()
        place = 1 if new < x[1] else 2
        keep = 0 if (new < x[1]) == (value > y[1]) else 1
        x = np.append(np.append(x[:place], new), x[place:])[keep : keep + 3]
        y = np.append(np.append(y[:place], value), y[place:])[keep : keep + 3]
    return x[1], y[1]
