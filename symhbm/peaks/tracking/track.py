"""Continuation of one maximum over parameters, exact at every point, across its events.

Derivatives of the conditions of a maximum predict the next one, Newton's method corrects it. Where
a contact at the maximum changes its state, or a slope beside a corner its sign, the event is solved
for and the maximum is continued beyond it in the kind it then has. Where no possible kind is a
maximum there, it is searched for along the frequency response nearby.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import product

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.numerics import FloatArray
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import Maximum, MaximumKind
from symhbm.peaks.tracking.step import (
    advanced,
    band_of,
    distance_between,
    expected_maximum,
    problems_between,
    relative_height,
    search,
    verified,
)

_DESIRED_DISTANCE = 0.08
"""Distance of prediction and solution that is aimed at: a quarter of the largest that `advanced`
accepts, the error grows with the square of the step, so twice the step is still accepted."""
_FIRST_STEP, _LARGEST_STEP = 0.05, 0.25
"""The first step may double at once; the longest shows the margins of events at four points."""
_SMALLEST_STEP = 1e-4
"""Step below which a maximum counts as merged with a minimum: where they meet, derivatives grow
without bound, and no other step is refused that close."""
_MOST_STEPS = 500
"""Most steps of a track, where 129 were the most seen: it ends in any case."""
_EVENT_PRECISION = 1e-11
"""Distance from an event at which it counts as located: round-off of the margins, tenfold."""
_RESTARTS = (1e-9, 1e-7, 1e-5, 1e-3, 1e-2)
"""Distances beyond an event at which the maximum is continued: from right behind its precision to
where unbounded derivatives at an onset of slip have become moderate."""
_SAME_KIND_DISTANCE = 1e-4
"""Distance below which a maximum beyond an event must differ in kind from that before: closer, the
equations of the old kind still have a solution, which is no maximum further on."""
_SEARCH_DISTANCE = 1e-3
"""Distance at which the maximum is searched for: once, as a search follows the whole response."""
_MAX_SLOPE, _MAX_JUMP = 10.0, 3e-3
"""Difference from the expected amplitude beyond which it is another maximum, over the distance and
at most: amplitudes go with low powers of parameters, and no track spans more than some decades."""
_LIMIT_TOLERANCE = 1e-6
"""Slip margin, or distance from the end of the band, that counts as on the limit: far above the
margins that `_EVENT_PRECISION` leaves, far below those of a contact in a definite state."""
_MOST_ON_LIMIT = 3
"""Contacts on their limits whose states are tried in all combinations, eight; more of them are
those of sectors that move alike and change together."""
_POLE_DISTANCE = 1e-2
"""Distance from a pole within which a growing maximum counts as unbounded."""
_UNBOUNDED_AMPLIFICATION = 1e8
"""Ratio of inertia to exciting force above which a maximum counts as unbounded: no damping that a
structure has leaves so much."""

_BEYOND = -_EVENT_PRECISION
"""Margin below which a maximum lies beyond an event."""


class TrackStatus(StrEnum):
    """Ends of a track."""

    REACHED_END = "the end was reached"
    DIED = "the maximum merged with a minimum"
    LEFT_BAND = "the maximum left the band of frequencies"
    UNBOUNDED = "the maximum grows without bound"


@dataclass
class Track:
    """A maximum over shares of the distance in parameters: solved ``steps`` and final ``status``.

    ``at`` gives copies of its problem with other values of the parameters that it is derived by,
    from those of the start (0) to those of the end (1). ``bands`` [rad/s] limit its frequency; by
    default nothing does. ``events`` are indices of steps at an event, in the state before it; the
    next step is in the state after it.
    """

    at: Callable[[float], HarmonicBalance]
    bands: Sequence[tuple[float, float]] = ()
    steps: list[tuple[float, Conditions]] = field(default_factory=list)
    events: list[int] = field(default_factory=list)
    status: TrackStatus = TrackStatus.REACHED_END

    @property
    def pole(self) -> float:
        """Where the amplitude becomes infinite, extrapolated; infinite if it falls."""
        if len(self.steps) < 2:
            return np.inf
        (start, previous), (end, last) = self.steps[-2:]
        previous, last = previous.maximum.amplitude, last.maximum.amplitude
        if not last > previous > 0:
            return np.inf
        return end + previous * (end - start) / (last - previous)

    @property
    def grows(self) -> bool:
        """Whether it grows towards a close pole: at least twofold over the last two thirds."""
        end, last = self.steps[-1]
        remaining = self.pole - end
        if remaining >= _POLE_DISTANCE:
            return False
        before = [c.maximum.amplitude for s, c in self.steps if self.pole - s >= 3 * remaining]
        return bool(before) and last.maximum.amplitude > 2 * before[-1]

    def run(self, current: Conditions) -> None:
        """Step until the end is reached, the maximum is lost or leaves its band."""
        if self.bands:
            self.bands = [band_of(current.maximum.frequency, self.bands)]
        self.steps.append((0.0, current))
        step, s, failed, to_event = _FIRST_STEP, 0.0, -1.0, np.inf
        margins = self._margins(current)
        for _ in range(_MOST_STEPS):
            if s >= 1:
                return
            target = 1.0 if s + step > 1 - _EVENT_PRECISION else s + step
            corrected = advanced(current, self.at(target))
            at_event = False
            if (
                corrected is None
                or (after := self._margins(corrected[0])).min(initial=np.inf) < _BEYOND
            ):
                failed, step = target, (target - s) / 2
            else:
                falling = np.flatnonzero(after < margins)
                at_event = bool(np.any(after[falling] <= _EVENT_PRECISION))
                rates = (margins[falling] - after[falling]) / (target - s)
                to_event = float(np.min(after[falling] / rates, initial=np.inf))
                (current, distance), s, margins = corrected, target, after
                self.steps.append((s, current))
                if _is_unbounded(current.maximum):
                    self.status = TrackStatus.UNBOUNDED
                    return
                ratio = _DESIRED_DISTANCE / max(distance, 1e-12)
                step *= float(np.clip(np.sqrt(ratio), 0.3, 2.0))
                step = min(step, _LARGEST_STEP)
                if s < failed and not at_event:
                    step = min(step, max(to_event, _EVENT_PRECISION))
            near_event = min(to_event, margins.min(initial=np.inf)) < 100 * _SMALLEST_STEP
            least = _EVENT_PRECISION if near_event else _SMALLEST_STEP
            if s >= 1 or not (at_event or (s < failed and step < least)):
                continue
            lost = self.grows and not at_event
            continued = None if lost else self._continue_beyond(s, current)
            if continued is None:
                self.status = self._end_of(current)
                return
            self.events.append(len(self.steps) - 1)
            self.steps += self._steps_from_event(s, continued)
            (s, current), step, failed, to_event = continued, _FIRST_STEP, -1.0, np.inf
            margins = self._margins(current)
        self.status = TrackStatus.DIED

    def _end_of(self, conditions: Conditions) -> TrackStatus:
        """How a track ends at a maximum beyond which there is none."""
        if self.grows:
            return TrackStatus.UNBOUNDED
        return TrackStatus.LEFT_BAND if self._leaves_band(conditions) else TrackStatus.DIED

    def _margins(self, conditions: Conditions) -> FloatArray:
        """Distances of a maximum from the events that end its kind, positive before them."""
        maximum = conditions.maximum
        contact_margins = conditions.evaluation.states.margins
        margins = np.where(maximum.switches, contact_margins, -contact_margins)
        margins[maximum.on_limit] = np.inf
        margins[~np.isfinite(margins)] = 1.0
        if maximum.held:
            return margins
        margins = np.append(margins, self._in_band(maximum))
        if maximum.kind == MaximumKind.CORNER:
            margins = np.append(margins, -np.array(conditions.side_slopes))
        return margins

    def _in_band(self, maximum: Maximum) -> FloatArray:
        """Distances from both ends of the band, relative, positive inside."""
        low, high = band_of(maximum.frequency, self.bands)
        return np.array([maximum.frequency / low - 1, 1 - maximum.frequency / high])

    def _leaves_band(self, conditions: Conditions) -> bool:
        maximum = conditions.maximum
        at_end = self._in_band(maximum).min(initial=np.inf) < _LIMIT_TOLERANCE
        return not maximum.held and bool(at_end)

    def _steps_from_event(
        self, s: float, restart: tuple[float, Conditions]
    ) -> list[tuple[float, Conditions]]:
        """Steps from an event to a maximum beyond it, in this order.

        They are computed backwards: derivatives are unbounded where slip begins, and the correction
        converges better towards an onset than away from it.
        """
        steps, distance = [restart], restart[0] - s
        while (distance := distance / 4) > _RESTARTS[0]:
            nearer = advanced(steps[0][1], self.at(s + distance))
            if nearer is None or self._margins(nearer[0]).min(initial=np.inf) < _BEYOND:
                break
            steps.insert(0, (s + distance, nearer[0]))
        return steps

    def _continue_beyond(self, s: float, conditions: Conditions) -> tuple[float, Conditions] | None:
        """The maximum right beyond an event, of whatever kind."""
        if self._leaves_band(conditions):
            return None
        for distance in _RESTARTS:
            target = min(1.0, s + distance)
            expected = expected_maximum(conditions, self.at(target))
            most = min(_MAX_JUMP, _MAX_SLOPE * distance)
            candidates = []
            for successor in _successors(conditions, expected):
                close = distance <= _SAME_KIND_DISTANCE
                if close and _is_same_kind(successor, conditions.maximum):
                    continue
                found = verified(conditions.second_order, successor)
                if found is None or abs(relative_height(found.maximum, expected)) > most:
                    continue
                if self._in_band(found.maximum).min(initial=np.inf) >= _BEYOND:
                    candidates.append(found)
            if candidates:
                return target, min(candidates, key=lambda c: distance_between(c.maximum, expected))
            if distance == _SEARCH_DISTANCE:
                problem = expected.problem
                similar = search(conditions.second_order, expected, problem, self.bands, most)
                if similar and abs(relative_height(similar.maximum, expected)) <= most:
                    return target, similar
        return None


def track(
    start: Conditions,
    at: Callable[[float], HarmonicBalance],
    bands: Sequence[tuple[float, float]] = (),
) -> Track:
    """Continue a solved maximum from ``at(0)`` to ``at(1)``, arguments as of `Track`."""
    result = Track(at, bands)
    result.run(start)
    return result


def retrack(conditions: Conditions, problem: HarmonicBalance) -> Conditions | None:
    """The maximum after a change of parameters: in one step, in several, or by a search.

    The result is a verified maximum of the same degree of freedom, or None if it is gone.
    """
    step = advanced(conditions, problem)
    if step is not None:
        return step[0]
    second_order = conditions.second_order
    at = problems_between(conditions.maximum.problem, problem, second_order.names)
    tracked = track(conditions, at)
    if tracked.status == TrackStatus.REACHED_END:
        return tracked.steps[-1][1]
    return search(second_order, expected_maximum(conditions, problem), problem)


def _is_unbounded(maximum: Maximum) -> bool:
    amplification = maximum.problem.amplification(maximum.unknowns, maximum.frequency)
    return amplification > _UNBOUNDED_AMPLIFICATION


def _is_same_kind(maximum: Maximum, other: Maximum) -> bool:
    """Whether two maxima satisfy the same constraints."""
    same = maximum.kind == other.kind and maximum.contact == other.contact
    same &= (maximum.loop is None) == (other.loop is None)
    return same and np.array_equal(maximum.switches, other.switches)


def _successors(conditions: Conditions, expected: Maximum) -> list[Maximum]:
    """The maxima that one may become when contacts on their limits change state."""
    near_limit = np.abs(conditions.evaluation.states.margins) < _LIMIT_TOLERANCE
    on_limit = sorted({*np.flatnonzero(near_limit).tolist(), *conditions.maximum.on_limit})
    all_at_once = len(on_limit) > _MOST_ON_LIMIT
    states = [*product((False, True), repeat=1 if all_at_once else len(on_limit))]
    kind = expected.kind if expected.held else MaximumKind.SMOOTH
    successors: list[Maximum] = []
    for state in states:
        switches = conditions.maximum.switches.copy()
        switches[on_limit] = state
        smooth = replace(
            expected, kind=kind, switches=switches, contact=-1, further_contacts=(), loop=None
        )
        successors.append(smooth)
        stuck = [] if expected.held else [j for j in on_limit if not switches[j]]
        corners = [(j, ()) for j in stuck]
        if all_at_once:
            corners = [(j, tuple(stuck[1:])) for j in stuck[:1]]
        successors += [
            replace(smooth, kind=MaximumKind.CORNER, contact=contact, further_contacts=others)
            for contact, others in corners
        ]
    return successors
