"""Maxima of the response over one parameter: branches of solved points, and the highest of them."""

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
import scipy

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.numerics import FloatArray
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.tracking.step import advanced
from symhbm.peaks.tracking.track import TrackStatus, track

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline

SAME = 1e-8
"""Relative difference of height and frequency below which two maxima are one."""
_BLANK = -np.inf


class Parameter:
    """One parameter that moves, of all blades or contacts alike or of that at ``index``.

    ``logarithmic`` tells how lengths along it are measured.
    """

    def __init__(
        self, problem: HarmonicBalance, name: str, index: int | None, band: tuple[float, float]
    ):
        self.problem, self.name, self.index = problem, name, index
        self.low, self.high = sorted(band)
        self.logarithmic = self.low > 0
        self.second_order = SecondOrder(problem, [name])
        nominal = np.asarray(problem.parameters[name], dtype=float)
        chosen = np.ones(nominal.shape)
        if index is not None:
            chosen[:] = np.arange(len(chosen)) == index
        self._nominal, self._chosen = nominal, chosen
        self._direction = np.atleast_1d(problem.own(name, chosen))
        self.at = lru_cache(maxsize=64)(self._at)

    def _at(self, value: float) -> HarmonicBalance:
        values = np.where(self._chosen > 0, value, self._nominal)
        return self.problem.with_parameters(**{self.name: values})

    def way(self, first: float, last: float) -> Callable[[float], HarmonicBalance]:
        """The problems from one value (0) to another (1)."""
        return lambda share: self.at(self.value(first, last, share))

    def value(self, first: float, last: float, share: float) -> float:
        """The value at a share of the way between two."""
        if share in (0.0, 1.0):
            return last if share else first
        if first > 0 and last > 0:
            return float(first * np.exp(share * np.log(last / first)))
        return float(first + share * (last - first))

    def measure(self, value: FloatArray | float) -> FloatArray:
        """What lengths are measured in."""
        return np.log(value) if self.logarithmic else np.asarray(value, dtype=float)

    def slope(self, conditions: Conditions) -> float:
        """Derivative of the height of a maximum by the parameter, round-off being zero."""
        slope = float(conditions.gradient @ self._direction)
        size = conditions.summit.amplitude / max(self.high, 1e-300)
        return slope if abs(slope) > 1e-13 * size else 0.0

    def rates(self, value: float, conditions: Conditions) -> tuple[float, float]:
        """First and second derivative of the logarithm of a height in the measure of lengths."""
        height, factor = conditions.summit.amplitude, value if self.logarithmic else 1.0
        rate = factor * self.slope(conditions) / height
        bend = self._direction @ conditions.hessian @ self._direction
        bend = factor**2 * float(bend) / height - rate**2
        return rate, bend + (rate if self.logarithmic else 0.0)


@dataclass
class Branch:
    """One maximum over ascending ``values`` of the parameter, solved at each: ``found``.

    ``joints``: numbers of points after which its kind or a contact changes, and where exactly;
    ``ends``: why it ends below and above.
    """

    parameter: Parameter
    values: list[float]
    found: list[Conditions]
    joints: dict[int, float] = field(default_factory=dict)
    ends: tuple[TrackStatus, TrackStatus] = (TrackStatus.REACHED_END, TrackStatus.REACHED_END)

    def covers(self, value: float) -> bool:
        """Whether it exists there."""
        return self.values[0] <= value <= self.values[-1]

    @cached_property
    def _spline(self) -> "CubicHermiteSpline | None":
        if len(self.values) < 2:
            return None
        parameter, values = self.parameter, np.array(self.values)
        slope = np.array([parameter.slope(found) for found in self.found])
        inner = values if parameter.logarithmic else np.ones(len(values))
        height = np.array([found.summit.amplitude for found in self.found])
        length = parameter.measure(values)
        # Two points at an event may be one to the last digit.
        kept = np.diff(length, prepend=-np.inf) > 0
        return scipy.interpolate.CubicHermiteSpline(
            length[kept], height[kept], (slope * inner)[kept]
        )

    def heights(self, values: FloatArray) -> FloatArray:
        """Interpolated heights at values (n,), minus infinity where it does not exist."""
        inside = (values >= self.values[0]) & (values <= self.values[-1])
        result = np.full(len(values), _BLANK)
        if self._spline is None:
            result[inside] = self.found[0].summit.amplitude
        else:
            result[inside] = self._spline(self.parameter.measure(values[inside]))
        return result

    def slopes(self, values: FloatArray) -> FloatArray:
        """Interpolated derivatives of the height in the measure of the parameter."""
        assert self._spline is not None
        return self._spline.derivative()(self.parameter.measure(values))

    def at(self, value: float) -> Conditions | None:
        """The maximum solved for at a value; None outside and where it is not found."""
        if not self.covers(value):
            return None
        after = bisect_left(self.values, value)
        if self.values[after] == value:
            return self.found[after]
        joint = self.joints.get(after - 1)
        sides = sorted((after - 1, after), key=lambda i: abs(self.values[i] - value))
        if joint is not None:
            sides = [after - 1, after] if value <= joint else [after, after - 1]
        problem = self.parameter.at(value)
        for side in sides:
            found = advanced(self.found[side], problem)
            if found is not None:
                return found[0]
        for side in sides:
            way = self.parameter.way(self.values[side], value)
            followed = track(self.parameter.second_order, self.found[side], way)
            if followed.status == TrackStatus.REACHED_END:
                return followed.steps[-1][1]
        return None

    def insert(self, value: float, found: Conditions) -> None:
        """Add a point that was solved for."""
        after = bisect_left(self.values, value)
        if self.values[after] == value:
            return
        self.joints = {
            i + (i >= after or (i == after - 1 and value <= at)): at
            for i, at in self.joints.items()
        }
        self.values.insert(after, value)
        self.found.insert(after, found)
        self.__dict__.pop("_spline", None)


class Pool:
    """All branches that were followed.

    ``infinite`` are the ranges where a peak is unbounded, ``poles`` where they begin, with the last
    maximum before each.
    """

    def __init__(self, parameter: Parameter, bands: Sequence[tuple[float, float]]):
        self.parameter, self.bands = parameter, bands
        self.branches: list[Branch] = []
        self.infinite: list[tuple[float, float]] = []
        self.poles: list[tuple[float, Conditions]] = []

    def follow(self, start: Conditions, first: float, last: float) -> None:
        """Follow a maximum from one value to another, and join it to what is known."""
        parameter = self.parameter
        way = parameter.way(first, last)
        followed = track(parameter.second_order, start, way, bands=self.bands)
        steps = followed.steps
        values = [parameter.value(first, last, s) for s, _ in steps]
        found = [conditions for _, conditions in steps]
        joints = {i: values[i] for i in followed.events}
        ends = TrackStatus.REACHED_END, followed.status
        if last < first:
            n = len(values)
            values, found, ends = values[::-1], found[::-1], (ends[1], ends[0])
            joints = {n - 2 - i: at for i, at in joints.items()}
        if followed.status == TrackStatus.UNBOUNDED:
            self.infinite.append((last, values[0]) if last < first else (values[-1], last))
            self.poles.append((parameter.value(first, last, followed.pole), steps[-1][1]))
        distinct = [0, *(i for i in range(1, len(values)) if values[i] > values[i - 1])]
        if len(distinct) < len(values):
            joints = {int(np.searchsorted(distinct, i)): at for i, at in joints.items()}
            values, found = [values[i] for i in distinct], [found[i] for i in distinct]
        self._join(Branch(parameter, values, found, joints, ends))

    def _join(self, branch: Branch) -> None:
        for other in self.branches:
            if branch.values[0] == other.values[-1] and same(branch.found[0], other.found[-1]):
                self.branches.remove(other)
                branch = _joined(other, branch)
                break
        for other in self.branches:
            if branch.values[-1] == other.values[0] and same(branch.found[-1], other.found[0]):
                self.branches.remove(other)
                branch = _joined(branch, other)
                break
        self.branches.append(branch)

    def holds(self, start: Conditions, value: float) -> list[Branch]:
        """The branches that a maximum at a value is on."""
        found: list[Branch] = []
        for branch in self.branches:
            alike = branch.covers(value) and branch.found[0].summit.dof == start.summit.dof
            known = branch.at(value) if alike else None
            if known is not None and same(known, start):
                branch.insert(value, known)
                found.append(branch)
        return found

    def knows(self, start: Conditions, value: float, up: bool) -> bool:
        """Whether a maximum at a value was followed already, upwards or downwards."""
        return any(
            value != branch.values[-1 if up else 0] or branch.ends[up] != TrackStatus.REACHED_END
            for branch in self.holds(start, value)
        )

    def highest(self, value: float) -> tuple[Branch, Conditions] | None:
        """The highest branch at a value, solved for; None where there is none, or none for sure."""
        there = np.array([value])
        guess = [(float(b.heights(there)[0]), i) for i, b in enumerate(self.branches)]
        best: tuple[Branch, Conditions] | None = None
        for height, i in sorted(guess, reverse=True):
            level = best[1].summit.amplitude if best else 0.0
            # An interpolated height is good to a few per cent, and much better as a rule.
            if height < 0.95 * level or height == _BLANK:
                break
            found = self.branches[i].at(value)
            if found is None:
                return None  # it might be the highest
            if best is None or found.summit.amplitude > best[1].summit.amplitude:
                best = self.branches[i], found
        return best


def same(one: Conditions, other: Conditions) -> bool:
    """Whether two maxima at one value are one."""
    a, b = one.summit, other.summit
    return (
        a.dof == b.dof
        and abs(a.frequency - b.frequency) <= SAME * b.frequency
        and abs(a.amplitude - b.amplitude) <= SAME * b.amplitude
    )


def _joined(low: Branch, high: Branch) -> Branch:
    """Two branches that meet as one."""
    shift = len(low.values) - 1
    joints = low.joints | {i + shift: at for i, at in high.joints.items()}
    values, found = low.values + high.values[1:], low.found + high.found[1:]
    return Branch(low.parameter, values, found, joints, (low.ends[0], high.ends[1]))
