"""Flutter limits over a parameter: the largest damping ratio of a mode up to an amplitude.

Air that feeds a vibration is negative damping, a force ``2 d omega M x'``. At an amplitude where
the mode has a damping ratio above ``d`` the vibration shrinks, so that one that begins below it
never grows beyond. A disturbance ``a`` is held below the amplitude ``b`` up to the damping ratio

    L = max over amplitudes A from a to b of D(A).

It is found at a maximum of the damping ratio, where two limit cycles meet, or at an end of the
amplitudes.
"""

from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Branch, EventKind, Status, newton
from symhbm.continuation.unforced import (
    ModeOverParameterProblem,
    NonlinearModeProblem,
    follow_mode,
    linear_mode,
)
from symhbm.numerics import RADIANS, Factorisation, FloatArray, refined
from symhbm.response.unforced import mode_problem
from symhbm.results import Request
from symhbm.workers import progress_bar

_COARSE = 9
"""Values over a band that are computed at first."""
_STRAIGHT = 2e-3
"""Error of lines between values, relative to the largest limit, from which on they are halved."""
_MAX_HALVINGS = 7
_ROUND_OFF = 1e-12
"""Difference of two damping ratios, relative, that is none."""
_LEVEL = 1e-3
"""Slope by the amplitude, over the one next to it, that is that of a maximum."""
_SECANT, _MAX_SECANTS, _FAR = 1e-5, 6, 1e-2
"""First step of the secant method, most of them, and one that leads away from a maximum."""


class SurfacePoint(NamedTuple):
    """A nonlinear mode at a ``value`` of the parameter and an ``amplitude`` [m].

    ``by_value`` is the derivative of its damping ratio by the parameter, ``by_amplitude`` that by
    the natural logarithm of the amplitude; ``frequency`` in Hz.
    """

    value: float
    amplitude: float
    damping_ratio: float
    frequency: float
    by_value: float
    by_amplitude: float
    residual_norm: float
    unknowns: FloatArray


class ModeSurface:
    """One nonlinear mode of a problem over its amplitude and over one parameter.

    ``request`` asks for that mode along the parameter at some amplitude. Raises as `mode_problem`.
    """

    def __init__(self, problem: HarmonicBalance, request: Request):
        curve, self._linear = mode_problem(problem, request)
        assert isinstance(curve, ModeOverParameterProblem)
        self.curve, self.request = curve, request

    def over_amplitude(self, value: float, amplitudes: tuple[float, float]) -> Branch:
        """The mode at a value of the parameter, followed over amplitudes [m] from the linear one.

        Raises ValueError or ArithmeticError where there is no such mode.
        """
        problem, mode = self.curve.problem_at(value), self.request.mode
        assert isinstance(mode, int)
        linear = linear_mode(problem, mode, self._linear.dof)
        low, high = np.log10(amplitudes).tolist()
        curve = NonlinearModeProblem(problem, linear.dof)
        return follow_mode(curve, linear, (low, high), self.request.max_points)

    def at(self, value: float, amplitude: float, near: FloatArray) -> SurfacePoint:
        """The mode there by Newton's method from the unknowns of one ``near``.

        ArithmeticError where it finds none, or no slopes.
        """
        curve = self.curve.with_level(amplitude)
        result = newton(partial(curve.evaluate, value=value), near)
        factors, place = Factorisation(result.evaluation.jacobian), curve.damping_place
        by_size = np.zeros(curve.n_unknowns)
        by_size[-1] = result.evaluation.magnitude  # the amplitude is in the last condition alone
        slopes = [factors.solve(part) for part in (-result.evaluation.by_parameter, by_size)]
        by_value, by_amplitude = (np.nan if s is None else float(s[place]) for s in slopes)
        if not result.converged or not np.isfinite([by_value, by_amplitude]).all():
            raise ArithmeticError(f"no mode was found at an amplitude of {amplitude:g} m")
        return SurfacePoint(
            value,
            amplitude,
            curve.damping_ratio(result.unknowns),
            curve.frequency(result.unknowns) / RADIANS,
            by_value,
            by_amplitude,
            result.evaluation.norm,
            result.unknowns,
        )


class LimitKind(StrEnum):
    """Where the damping ratio that limits the instability is."""

    FOLD = "fold"
    CORNER = "corner"
    DISTURBANCE = "disturbance"
    LARGEST = "largest amplitude"


@dataclass(frozen=True)
class Limit:
    """The flutter limit of one disturbance at one value: where it is, and its derivative.

    At a corner of the mode the derivative is not known, and NaN.
    """

    point: SurfacePoint
    kind: LimitKind
    slope: float

    @property
    def damping_ratio(self) -> float:
        """The largest negative damping ratio that is held."""
        return self.point.damping_ratio


@dataclass(frozen=True)
class Row:
    """Flutter limits of all disturbances at one ``value``, none where the mode tells none.

    ``status`` tells why; ``ends`` are the mode at the disturbances and at the largest amplitude.
    """

    value: float
    status: Status
    limits: tuple[Limit, ...] = ()
    ends: tuple[SurfacePoint, ...] = ()


@dataclass
class FlutterLimits:
    """Flutter limits of a mode over a parameter for ``disturbances`` up to the largest amplitude.

    ``amplitudes`` [m] are those that the mode is followed over.
    """

    surface: ModeSurface
    amplitudes: tuple[float, float]
    disturbances: tuple[float, ...]
    progress: bool | None = False
    rows: dict[float, Row] = field(default_factory=dict)

    @cached_property
    def _bar(self) -> Any:
        return progress_bar("value", self.progress)

    def row(self, value: float) -> Row:
        """The limits at a value of the parameter, from the mode followed over all amplitudes."""
        value = float(value)
        if value not in self.rows:
            self.rows[value] = self._row(value)
            self._bar.update(1)
        return self.rows[value]

    def _row(self, value: float) -> Row:
        try:
            branch = self.surface.over_amplitude(value, self.amplitudes)
        except (ArithmeticError, ValueError):
            return Row(value, Status.NO_MODE)
        kinds = [event.kind for point in branch.points for event in point.events]
        if branch.status != Status.REACHED_END:
            return Row(value, branch.status)
        if EventKind.FOLD in kinds:
            return Row(value, Status.MODE_TURNED_BACK)
        places = [*self.disturbances, self.amplitudes[1]]
        states = [branch.at(float(np.log10(place)))[0][0] for place in places]
        turns, ends = [], []
        try:
            for point in branch.points[1:-1]:
                if any(event.kind == EventKind.DAMPING_TURNS for event in point.events):
                    found = self.surface.at(value, 10.0**point.value, point.unknowns)
                    if len(point.events) == 1:
                        turns.append((self._polished(found), LimitKind.FOLD))
                    else:
                        turns.append((found, LimitKind.CORNER))
            for place, state in zip(places, states, strict=True):
                if state is None:
                    return Row(value, Status.POINTS_MISSING)
                ends.append(self.surface.at(value, place, state.state[:-1]))
        except ArithmeticError:
            return Row(value, Status.POINTS_MISSING)
        limits = tuple(self._limit(begin, ends[-1], turns) for begin in ends[:-1])
        return Row(value, Status.SUCCESS, limits, tuple(ends))

    def _polished(self, point: SurfacePoint) -> SurfacePoint:
        """A maximum or a minimum to the last digits, by the secant method on its slope."""
        best = point
        with suppress(ArithmeticError):
            before = self._moved(point, _SECANT)
            for _ in range(_MAX_SECANTS):
                if before.by_amplitude == point.by_amplitude:
                    break
                run = np.log(point.amplitude / before.amplitude)
                step = -run * point.by_amplitude / (point.by_amplitude - before.by_amplitude)
                before, point = point, self._moved(point, float(step))
                if abs(point.by_amplitude) < abs(best.by_amplitude):
                    best = point
                if not _ROUND_OFF < abs(step) < _FAR:
                    break
        return best

    def _moved(self, point: SurfacePoint, step: float) -> SurfacePoint:
        """The mode at an amplitude that is larger by a ``step`` of its logarithm."""
        amplitude = point.amplitude * float(np.exp(step))
        return self.surface.at(point.value, amplitude, point.unknowns)

    def _limit(
        self, begin: SurfacePoint, last: SurfacePoint, turns: list[tuple[SurfacePoint, LimitKind]]
    ) -> Limit:
        """The limit of the disturbance at ``begin``."""
        best, kind = begin, LimitKind.DISTURBANCE
        ahead = [(point, kind) for point, kind in turns if point.amplitude > begin.amplitude]
        for point, of_point in [*ahead, (last, LimitKind.LARGEST)]:
            round_off = _ROUND_OFF * abs(best.damping_ratio)
            if point.damping_ratio > best.damping_ratio + round_off:
                best, kind = point, of_point
        slope, heading = best.by_amplitude, {LimitKind.DISTURBANCE: 1, LimitKind.LARGEST: -1}
        if slope * heading.get(kind, 0) > 0:
            # A maximum so close to the end that the path takes it for the end.
            turn = self._polished(best)
            inside = begin.amplitude < turn.amplitude < last.amplitude
            if inside and abs(turn.by_amplitude) < _LEVEL * abs(slope):
                best, kind = turn, LimitKind.FOLD
        # The amplitude of a maximum moves, to first order without a change of the damping ratio.
        return Limit(best, kind, np.nan if kind == LimitKind.CORNER else best.by_value)

    def sample(self, band: tuple[float, float]) -> list[Row]:
        """Rows over a band, so many that lines between them tell the limits."""
        low, high = min(band), max(band)
        geometric = low > 0 and high > 4 * low
        spaced = np.geomspace if geometric else np.linspace
        values = spaced(low, high, _COARSE).tolist()
        values[0], values[-1] = low, high
        rows = [self.row(value) for value in values]
        sizes = [abs(limit.damping_ratio) for row in rows for limit in row.limits]
        allowed = _STRAIGHT * max(sizes, default=0.0)

        def middle(left: Row, right: Row) -> Row | None:
            needed = bool(left.limits) != bool(right.limits) or any(
                one.kind != other.kind or _bend(one, other) > allowed
                for one, other in zip(left.limits, right.limits, strict=False)
            )
            return self.row((left.value + right.value) / 2) if needed else None

        refined(rows, middle, _MAX_HALVINGS)
        return sorted(self.rows.values(), key=lambda row: row.value)


def _bend(left: Limit, right: Limit) -> float:
    """Distance of the limits between two values from lines, also those over the logarithm."""
    first, last = left.point.value, right.point.value
    bend = abs(right.slope - left.slope) * (last - first) / 8
    if first > 0:
        over_logarithm = abs(right.slope * last - left.slope * first) * np.log(last / first) / 8
        bend = max(bend, float(over_logarithm))
    return bend
