"""Branches of maxima over one parameter: solved points with interpolated heights."""

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.continuation import ParameterProblem
from symhbm.numerics import FloatArray
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.tracking.step import advanced
from symhbm.peaks.tracking.track import TrackStatus, track

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline

SAME_MAXIMUM = 1e-8
"""Difference of amplitude and frequency below which two maxima are one: solved from both sides
they agree to 1e-9 at least."""

_ABSENT = -np.inf


@dataclass(frozen=True, eq=False)
class Parameter:
    """One parameter between two values, of all blades or contacts alike or that at ``index``."""

    problem: HarmonicBalance
    name: str
    index: int | None
    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """Whether its coordinate is the logarithm."""
        return self.low > 0

    @cached_property
    def second_order(self) -> SecondOrder:
        """Second derivatives of the balance by unknowns, frequency and the parameter."""
        return SecondOrder(self.problem, [self.name])

    @cached_property
    def _moving(self) -> ParameterProblem:
        # Maxima have frequencies of their own.
        return ParameterProblem(self.problem, self.name, np.nan, self.index)

    @cached_property
    def _direction(self) -> FloatArray:
        return np.atleast_1d(self._moving.chosen(self.problem))

    @cached_property
    def at(self) -> Callable[[float], HarmonicBalance]:
        """The problem at a value."""
        return lru_cache(maxsize=64)(self._moving.with_value)

    def problem_path(self, first: float, last: float) -> Callable[[float], HarmonicBalance]:
        """The problems from one value (0) to another (1)."""
        return lambda share: self.at(self.value(first, last, share))

    def value(self, first: float, last: float, share: float) -> float:
        """The value at a share of the distance between two values."""
        if share in (0.0, 1.0):
            return last if share else first
        if first > 0 and last > 0:
            return float(first * np.exp(share * np.log(last / first)))
        return float(first + share * (last - first))

    def coordinate(self, value: FloatArray | float) -> FloatArray:
        """The coordinate in which lengths are measured: the value or its logarithm."""
        return np.log(value) if self.logarithmic else np.asarray(value, dtype=float)

    def at_coordinate(self, coordinate: FloatArray) -> FloatArray:
        """The values at coordinates."""
        return np.exp(coordinate) if self.logarithmic else coordinate

    def slope(self, conditions: Conditions) -> float:
        """Derivative of the amplitude of a maximum by the parameter, zero if within round-off."""
        slope = float(conditions.gradient @ self._direction)
        scale = conditions.maximum.amplitude / max(self.high, 1e-300)
        return slope if abs(slope) > 1e-13 * scale else 0.0

    def rates(self, value: float, conditions: Conditions) -> tuple[float, float]:
        """First and second derivative of the logarithm of the amplitude by the coordinate."""
        height, factor = conditions.maximum.amplitude, value if self.logarithmic else 1.0
        slope = factor * self.slope(conditions) / height
        curvature = self._direction @ conditions.hessian @ self._direction
        curvature = factor**2 * float(curvature) / height - slope**2
        return slope, curvature + (slope if self.logarithmic else 0.0)


@dataclass(eq=False)
class MaximumBranch:
    """One maximum over ascending ``values`` of the parameter, its ``conditions`` solved at each.

    ``events``: values at which its kind or a contact state changes, with 1 where that is right
    above and -1 where it is right below; ``end_status``: how it ended at its lower and upper end.
    """

    parameter: Parameter
    values: list[float]
    conditions: list[Conditions]
    events: dict[float, int] = field(default_factory=dict)
    end_status: tuple[TrackStatus, TrackStatus] = (TrackStatus.REACHED_END, TrackStatus.REACHED_END)

    def covers(self, value: float) -> bool:
        """Whether the branch exists at a value."""
        return self.values[0] <= value <= self.values[-1]

    def event_after(self, number: int) -> float | None:
        """The value of the event between one point and the next, None for none."""
        low, high = self.values[number : number + 2]
        if self.events.get(low) == 1:
            return low
        return high if self.events.get(high) == -1 else None

    @cached_property
    def _spline(self) -> "CubicHermiteSpline | None":
        if len(self.values) < 2:
            return None
        parameter, values = self.parameter, np.array(self.values)
        slope = np.array([parameter.slope(conditions) for conditions in self.conditions])
        factor = values if parameter.logarithmic else np.ones(len(values))
        height = np.array([conditions.maximum.amplitude for conditions in self.conditions])
        coordinate = parameter.coordinate(values)
        # Two points at an event may have the same coordinate to the last digit.
        kept = np.diff(coordinate, prepend=-np.inf) > 0
        return scipy.interpolate.CubicHermiteSpline(
            coordinate[kept], height[kept], (slope * factor)[kept]
        )

    def heights(self, values: FloatArray) -> FloatArray:
        """Interpolated amplitudes at values (n,), minus infinity outside the branch."""
        inside = (values >= self.values[0]) & (values <= self.values[-1])
        result = np.full(len(values), _ABSENT)
        if self._spline is None:
            result[inside] = self.conditions[0].maximum.amplitude
        else:
            result[inside] = self._spline(self.parameter.coordinate(values[inside]))
        return result

    def slopes(self, values: FloatArray) -> FloatArray:
        """Interpolated derivatives of the amplitude by the coordinate of the parameter."""
        assert self._spline is not None
        return self._spline.derivative()(self.parameter.coordinate(values))

    def at(self, value: float) -> Conditions | None:
        """The maximum solved for at a value; None outside the branch or without convergence."""
        if not self.covers(value):
            return None
        after = bisect_left(self.values, value)
        if self.values[after] == value:
            return self.conditions[after]
        event = self.event_after(after - 1)
        sides = sorted((after - 1, after), key=lambda i: abs(self.values[i] - value))
        if event is not None:
            sides = [after - 1, after] if value <= event else [after, after - 1]
        problem = self.parameter.at(value)
        for side in sides:
            result = advanced(self.conditions[side], problem)
            if result is not None:
                return result[0]
        for side in sides:
            problem_path = self.parameter.problem_path(self.values[side], value)
            tracked = track(self.conditions[side], problem_path)
            if tracked.status == TrackStatus.REACHED_END:
                return tracked.steps[-1][1]
        return None

    def insert(self, value: float, conditions: Conditions) -> None:
        """Add a solved point."""
        after = bisect_left(self.values, value)
        if self.values[after] != value:
            self.values.insert(after, value)
            self.conditions.insert(after, conditions)
            self.__dict__.pop("_spline", None)


@dataclass(frozen=True)
class FollowedBranches:
    """All branches of maxima that were followed.

    ``bands`` [rad/s] are those of the frequency; ``unbounded`` are the ranges where a peak is
    unbounded, ``poles`` the values where they begin, with the last maximum before each.
    """

    parameter: Parameter
    bands: Sequence[tuple[float, float]]
    branches: list[MaximumBranch] = field(default_factory=list)
    unbounded: list[tuple[float, float]] = field(default_factory=list)
    poles: list[tuple[float, Conditions]] = field(default_factory=list)

    def follow(self, start: Conditions, first: float, last: float) -> None:
        """Follow a maximum from one value to another, and join it to the branches it meets."""
        parameter, down = self.parameter, last < first
        tracked = track(start, parameter.problem_path(first, last), self.bands)
        steps = [(parameter.value(first, last, s), maximum) for s, maximum in tracked.steps]
        events = {steps[i][0]: -1 if down else 1 for i in tracked.events}
        end_status = TrackStatus.REACHED_END, tracked.status
        if tracked.status == TrackStatus.UNBOUNDED:
            end, highest = steps[-1]
            self.unbounded.append((last, end) if down else (end, last))
            self.poles.append((parameter.value(first, last, tracked.pole), highest))
        # The step before an event stays where that behind it has the same value to the last digit.
        kept = steps[:1]
        kept += [step for before, step in pairwise(steps) if step[0] != before[0]]
        if down:
            kept, end_status = kept[::-1], (tracked.status, TrackStatus.REACHED_END)
        values, conditions = [value for value, _ in kept], [maximum for _, maximum in kept]
        self._join(MaximumBranch(parameter, values, conditions, events, end_status))

    def _join(self, branch: MaximumBranch) -> None:
        below = next((other for other in self.branches if _meet(other, branch)), None)
        if below is not None:
            self.branches.remove(below)
            branch = _joined(below, branch)
        above = next((other for other in self.branches if _meet(branch, other)), None)
        if above is not None:
            self.branches.remove(above)
            branch = _joined(branch, above)
        self.branches.append(branch)

    def branches_through(self, start: Conditions, value: float) -> list[MaximumBranch]:
        """The branches that contain a maximum at a value."""
        through: list[MaximumBranch] = []
        for branch in self.branches:
            same_dof = branch.conditions[0].maximum.dof == start.maximum.dof
            solved = branch.at(value) if same_dof and branch.covers(value) else None
            if solved is not None and is_same_maximum(solved, start):
                branch.insert(value, solved)
                through.append(branch)
        return through

    def is_followed(self, start: Conditions, value: float, up: bool) -> bool:
        """Whether a maximum at a value was followed already, upwards or downwards."""
        return any(
            value != branch.values[-1 if up else 0]
            or branch.end_status[up] != TrackStatus.REACHED_END
            for branch in self.branches_through(start, value)
        )

    def highest(self, value: float) -> tuple[MaximumBranch, Conditions] | None:
        """The highest branch at a value, solved for; None if there is none or a solve failed."""
        at_value = np.array([value])
        estimates = [(float(b.heights(at_value)[0]), i) for i, b in enumerate(self.branches)]
        best: tuple[MaximumBranch, Conditions] | None = None
        best_height = 0.0
        for height, i in sorted(estimates, reverse=True):
            # Interpolated heights are accurate to a few per cent, mostly far better.
            if height < 0.95 * best_height or height == _ABSENT:
                break
            solved = self.branches[i].at(value)
            if solved is None:
                return None  # the branch not solved for may be the highest
            if best is None or solved.maximum.amplitude > best_height:
                best, best_height = (self.branches[i], solved), solved.maximum.amplitude
        return best


def is_same_maximum(first: Conditions, second: Conditions) -> bool:
    """Whether two maxima at one value are the same."""
    a, b = first.maximum, second.maximum
    return (
        a.dof == b.dof
        and abs(a.frequency - b.frequency) <= SAME_MAXIMUM * b.frequency
        and abs(a.amplitude - b.amplitude) <= SAME_MAXIMUM * b.amplitude
    )


def _meet(low: MaximumBranch, high: MaximumBranch) -> bool:
    """Whether one branch ends in the maximum in which the other begins."""
    same_value = low.values[-1] == high.values[0]
    return same_value and is_same_maximum(low.conditions[-1], high.conditions[0])


def _joined(low: MaximumBranch, high: MaximumBranch) -> MaximumBranch:
    """Two branches that meet, as one."""
    values, conditions = low.values + high.values[1:], low.conditions + high.conditions[1:]
    end_status = low.end_status[0], high.end_status[1]
    return MaximumBranch(low.parameter, values, conditions, low.events | high.events, end_status)
