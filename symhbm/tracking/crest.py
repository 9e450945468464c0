"""The curve of the largest response over one parameter: which maximum leads where, and its minima.

Where the lead changes hands, where a contact changes its state at the leading maximum and where the
curve is lowest is solved for.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy import optimize

from symhbm.fourier import FloatArray
from symhbm.peaks import TIE
from symhbm.tracking.branches import Branch, Pool, same
from symhbm.tracking.path import TrackStatus
from symhbm.tracking.places import Low, Place, Turn, turn
from symhbm.tracking.step import polished

_FINER = 4
"""Parts of every distance between two points over which heights are compared."""
_DEEPEST = 6
_TOUCHING = 1e-5
"""Distance, relative, from where a peak crosses the end of the band within which both are equal."""
_BESIDE = 1e-3
_THIN = 1e-7
"""Distance from an event, relative, within which a curve needs no other point."""


class Crest:
    """The highest of some branches: its ``points``, ``minima`` and ``events``, ascending.

    Within ``unbounded`` ranges there is none. ``unclear`` are places where the lead changes and
    what it passes to could not be solved for.
    """

    def __init__(self, pool: Pool, unbounded: Sequence[tuple[float, float]] = ()):
        self._unbounded = unbounded
        self._pool, self._parameter = pool, pool.parameter
        self.points: list[Place] = []
        self.minima: list[Place] = []
        self.events: list[Place] = []
        self.unclear: list[float] = []
        self._spans: list[tuple[Branch, float, float]] = []
        if pool.branches:
            self._find_spans()
            for span in self._spans:
                self._along(*span)
            self._at_ends()
            self.events += [Place(at, found, Turn.POLE) for at, found in pool.poles]
        for places in (self.points, self.minima, self.events):
            places.sort(key=lambda place: place.value)
        self._thin()

    @property
    def doubtful(self) -> list[float]:
        """Where a maximum that was overlooked would show first: minima, exchanges, and in between.

        Two maxima of equal height have a dip between them that a third may fill.
        """
        parameter = self._parameter
        sharp = (Low.SMOOTH, Low.EXCHANGE, Turn.EXCHANGE)
        values: set[float] = set()
        for place in (*self.minima, *self.events):
            # Where a peak changes its kind, no survey can tell it from those beside it.
            shares = (1.0,) if place.what in sharp else (1 - _BESIDE, 1 + _BESIDE)
            beside = [share * place.value for share in shares]
            values |= {value for value in beside if parameter.low < value < parameter.high}
        values |= {parameter.value(start, end, 0.5) for _, start, end in self._spans}
        return sorted(values)

    def _heights(self, values: FloatArray) -> FloatArray:
        heights = np.array([branch.heights(values) for branch in self._pool.branches])
        for low, high in self._unbounded:
            heights[:, (values > low) & (values < high)] = -np.inf
        return heights

    def _find_spans(self) -> None:
        """Who leads from where to where."""
        measure = self._parameter.measure
        knots = np.unique([v for b in self._pool.branches for v in b.values])
        inner = np.linspace(0, 1, _FINER, endpoint=False)
        lengths = measure(knots)
        fine = (lengths[:-1, None] + inner * np.diff(lengths)[:, None]).ravel()
        grid = np.exp(fine) if self._parameter.logarithmic else fine
        grid = np.unique(np.append(np.clip(grid, knots[0], knots[-1]), knots))
        heights = self._heights(grid)
        leader = -1
        start = grid[0]
        for k, column in enumerate(heights.T):
            top = int(np.argmax(column >= (1 - TIE) * column.max()))
            if leader >= 0 and column[leader] >= (1 - TIE) * column[top]:
                continue
            if not np.isfinite(column[top]):
                if leader >= 0:
                    self._add_span(leader, start, grid[k - 1])
                leader = -1
                continue
            if leader < 0:
                start = grid[k]
            else:
                for low, high, one, other in self._changes(grid[k - 1], grid[k], leader, top):
                    change = self._change(low, high, one, other)
                    self._add_span(one, start, change)
                    start = change
            leader = top
        if leader >= 0:
            self._add_span(leader, start, grid[-1])

    def _add_span(self, number: int, start: float, end: float) -> None:
        branch = self._pool.branches[number]
        start, end = max(start, branch.values[0]), min(end, branch.values[-1])
        if end >= start:
            self._spans.append((branch, start, end))

    def _changes(
        self, low: float, high: float, one: int, other: int, depth: int = 0
    ) -> list[tuple[float, float, int, int]]:
        """The changes of the lead from one branch to another, by way of a third perhaps."""
        at = self._crossing(low, high, one, other)
        if at is None or depth > _DEEPEST:
            return [(low, high, one, other)]
        column = self._heights(np.array([at]))[:, 0]
        top = int(np.argmax(column))
        if top in (one, other) or column[top] <= (1 + TIE) * max(column[[one, other]]):
            return [(low, high, one, other)]
        first = self._changes(low, at, one, top, depth + 1)
        return first + self._changes(at, high, top, other, depth + 1)

    def _crossing(self, low: float, high: float, one: int, other: int) -> float | None:
        """Where two branches are of equal height, both solved for, None where they are not."""
        a, b = self._pool.branches[one], self._pool.branches[other]
        first, last = max(a.values[0], b.values[0]), min(a.values[-1], b.values[-1])
        if first >= last:
            return None
        low, high = (min(max(value, first), last) for value in (low, high))

        def difference(value: float) -> float:
            found = a.at(value), b.at(value)
            if found[0] is None or found[1] is None:
                raise ArithmeticError
            height = [conditions.summit.amplitude for conditions in found if conditions]
            return height[0] / height[1] - 1

        try:
            # Interpolated heights tell only about where it is.
            reach = 1e-6 * high
            while difference(low) <= 0 and low > first:
                low, reach = max(low - reach, first), 4 * reach
            while difference(high) >= 0 and high < last:
                high, reach = min(high + reach, last), 4 * reach
            if difference(low) <= 0:
                return low
            if difference(high) >= 0:
                return high
            return float(optimize.brentq(difference, low, high, xtol=1e-300, rtol=1e-15))  # type: ignore
        except (ArithmeticError, ValueError):
            return None

    def _change(self, low: float, high: float, one: int, other: int) -> float:
        """Where the lead goes over, noted as an event unless both are one maximum."""
        a, b = self._pool.branches[one], self._pool.branches[other]
        at = self._crossing(low, high, one, other)
        if at is None:
            at = a.values[-1] if low <= a.values[-1] <= high else b.values[0]
            at = float(np.clip(at, low, high))
        before, after = a.at(at), b.at(at)
        if before is None or after is None:
            self.unclear.append(at)
            return at
        # There a maximum and the end of the band are equal to second order.
        gone = a.values[-1] <= at * (1 + _TOUCHING) and a.ends[1] == TrackStatus.LEFT_BAND
        come = b.values[0] >= at * (1 - _TOUCHING) and b.ends[0] == TrackStatus.LEFT_BAND
        if gone or come:
            at = a.values[-1] if gone else b.values[0]
            self.events.append(Place(at, before, Turn.BAND))
        elif not same(before, after):
            self.events.append(Place(at, before, Turn.EXCHANGE))
            self.points.append(Place(at, before))
            slope = self._parameter.slope
            if slope(before) < 0 < slope(after):
                self.minima.append(Place(at, before, Low.EXCHANGE))
        return at

    def _along(self, branch: Branch, start: float, end: float) -> None:
        """Points, minima and events of one branch where it leads."""
        for value in (start, end):
            found = branch.at(value)
            if found is not None:
                branch.insert(value, found)
        first, last = bisect_left(branch.values, start), bisect_right(branch.values, end) - 1
        places = [Place(branch.values[i], branch.found[i]) for i in range(first, last + 1)]
        self.points += places
        joints = {i - first: at for i, at in branch.joints.items() if first <= i < last}
        slope = self._parameter.slope
        for i, (here, there) in enumerate(pairwise(places)):
            if i not in joints:
                self._lows(branch, here, there)
                continue
            at = here if here.value == joints[i] else there
            self.events.append(Place(at.value, at.found, turn(here.found, there.found)))
            left, right = slope(here.found), slope(there.found)
            if left < 0 <= right or left <= 0 < right:
                self.minima.append(Place(at.value, at.found, Low.KINK))

    def _lows(self, branch: Branch, here: Place, there: Place, depth: int = 0) -> None:
        """Minima between two points of a branch with no event in between."""
        slope = self._parameter.slope
        ends = slope(here.found), slope(there.found)
        if ends[0] < 0 < ends[1]:
            self._low(branch, here, there)
            return
        if ends[0] < 0 == ends[1]:
            self.minima.append(Place(there.value, there.found, Low.SMOOTH))
        lengths = self._parameter.measure(np.array([here.value, there.value]))
        inside = lengths[0] + np.linspace(0, 1, 6)[1:-1] * (lengths[1] - lengths[0])
        values = np.exp(inside) if self._parameter.logarithmic else inside
        if depth > _DEEPEST or lengths[1] - lengths[0] < _THIN or ends[0] == ends[1] == 0:
            return
        between = np.sign(branch.slopes(values))
        changes = np.flatnonzero(np.diff(np.concatenate([[ends[0]], between, [ends[1]]]) > 0))
        if len(changes) < 1 + (ends[0] * ends[1] < 0):
            return
        value = float(values[min(changes[0], len(values) - 1)])
        found = branch.at(value)
        if found is not None:
            middle = Place(value, found)
            self._lows(branch, here, middle, depth + 1)
            self._lows(branch, middle, there, depth + 1)

    def _low(self, branch: Branch, here: Place, there: Place) -> None:
        known = {place.value: place.found for place in (here, there)}

        def slope(value: float) -> float:
            if value not in known:
                found = branch.at(value)
                if found is None:
                    raise ArithmeticError
                # A slope needs digits that a height does not.
                known[value] = polished(found)
            return self._parameter.slope(known[value])

        try:
            value = float(optimize.brentq(slope, here.value, there.value, xtol=1e-300, rtol=1e-15))  # type: ignore
            slope(value)
        except ArithmeticError:
            self.unclear.append(here.value)
            return
        self.minima.append(Place(value, known[value], Low.SMOOTH))
        self.points.append(Place(value, known[value]))

    def _at_ends(self) -> None:
        """Minima where the curve falls towards an end of the band."""
        slope, points = self._parameter.slope, sorted(self.points, key=lambda place: place.value)
        first, last = points[0], points[-1]
        if first.value == self._parameter.low and slope(first.found) > 0:
            self.minima.append(Place(first.value, first.found, Low.END))
        if last.value == self._parameter.high and slope(last.found) < 0:
            self.minima.append(Place(last.value, last.found, Low.END))

    def _thin(self) -> None:
        """Leave out points that others make needless."""
        special = np.array([place.value for place in (*self.events, *self.minima)])
        kept: list[Place] = []
        for place in self.points:
            if kept and place.value == kept[-1].value:
                continue
            if place.value not in special and special.size:
                near = np.abs(special - place.value) < _THIN * max(abs(place.value), 1e-300)
                if near.any() and place.value not in (self._parameter.low, self._parameter.high):
                    continue
            kept.append(place)
        self.points = kept
