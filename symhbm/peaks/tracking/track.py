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

from symhbm.balance import HarmonicBalance, SecondOrder
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
"""Relative distance of prediction and solution that the step control aims at."""
_FIRST_STEP, _LARGEST_STEP = 0.05, 0.25
_MIN_STEP = 1e-4
"""Step below which a maximum counts as merged with a minimum."""
_EVENT_PRECISION = 1e-11
"""Distance from an event at which it counts as located."""
_RESTARTS = (1e-9, 1e-7, 1e-5, 1e-3, 1e-2)
"""Distances beyond an event at which the maximum is continued."""
_SAME_KIND_DISTANCE = 1e-4
"""Distance below which a maximum beyond an event must differ in kind from that before."""
_SEARCH_DISTANCE, _MAX_SLOPE, _MAX_JUMP = 1e-3, 10.0, 3e-3
"""Distance at which the maximum is searched for; relative difference from the expected amplitude
beyond which it is another one, over the distance and at most."""
_LIMIT_TOLERANCE = 1e-6
"""Slip margin, or relative distance from the end of the band, that counts as on the limit."""
_MAX_ON_LIMIT = 3
"""Largest number of contacts on their limits whose states are tried in all combinations."""
_MAX_STEPS = 500
_POLE_DISTANCE = 1e-2
"""Distance from a pole within which a growing maximum counts as unbounded."""
_UNBOUNDED_AMPLIFICATION = 1e8
"""Ratio of inertia to exciting force above which a maximum counts as unbounded."""


class TrackStatus(StrEnum):
    """Ends of a track."""

    REACHED_END = "the end was reached"
    DIED = "the maximum merged with a minimum"
    LEFT_BAND = "the maximum left the band of frequencies"
    UNBOUNDED = "the maximum grows without bound"


@dataclass
class Track:
    """A maximum over shares of the distance in parameters: solved ``steps`` and final ``status``.

    ``events`` are indices of steps at an event, in the state before it; the next step is in the
    state after it.
    """

    steps: list[tuple[float, Conditions]] = field(default_factory=list)
    events: list[int] = field(default_factory=list)
    status: TrackStatus = TrackStatus.REACHED_END

    @property
    def end(self) -> float:
        """The last share that was solved."""
        return self.steps[-1][0] if self.steps else 0.0

    @property
    def pole(self) -> float:
        """Where the amplitude becomes infinite, extrapolated; infinite if it falls."""
        if len(self.steps) < 2:
            return np.inf
        (start, previous), (end, last) = self.steps[-2:]
        previous, last = 1 / previous.maximum.amplitude, 1 / last.maximum.amplitude
        return end + last * (end - start) / (previous - last) if previous > last else np.inf

    @property
    def grows(self) -> bool:
        """Whether it grows towards a close pole: at least twofold over the last two thirds."""
        remaining = self.pole - self.end
        if remaining >= _POLE_DISTANCE:
            return False
        before = [c.maximum.amplitude for s, c in self.steps if self.pole - s >= 3 * remaining]
        return bool(before) and self.steps[-1][1].maximum.amplitude > 2 * before[-1]


def track(
    second_order: SecondOrder,
    start: Maximum | Conditions,
    at: Callable[[float], HarmonicBalance],
    *,
    bands: Sequence[tuple[float, float]] = (),
) -> Track:
    """Continue a maximum from ``at(0)`` to ``at(1)``.

    ``at`` gives copies of the problem of ``second_order`` with other values of its parameters.
    ``bands`` [rad/s] limit its frequency; by default nothing does.
    """
    return _Tracker(second_order, at, bands).run(start)


def retrack(
    second_order: SecondOrder, conditions: Conditions, problem: HarmonicBalance
) -> Conditions | None:
    """The maximum after a change of parameters: in one step, in several, or by a search.

    The result is a verified maximum of the same degree of freedom, or None if it is gone.
    """
    step = advanced(conditions, problem)
    if step is not None:
        return step[0]
    at = problems_between(conditions.maximum.problem, problem, second_order.names)
    tracked = track(second_order, conditions, at)
    if tracked.status == TrackStatus.REACHED_END and tracked.steps:
        return tracked.steps[-1][1]
    return search(second_order, expected_maximum(conditions, problem), problem)


def _margins(conditions: Conditions, bands: Sequence[tuple[float, float]]) -> FloatArray:
    """Distances of a maximum from the events that end its kind, positive before them."""
    maximum = conditions.maximum
    slip_margin = conditions.evaluation.friction.slip_margin
    margins = np.where(maximum.slip, slip_margin, -slip_margin)
    margins[maximum.on_limit] = np.inf
    margins[~np.isfinite(margins)] = 1.0
    if maximum.kind == MaximumKind.EDGE:
        return margins
    low, high = band_of(maximum.frequency, bands)
    margins = np.append(margins, [maximum.frequency / low - 1, 1 - maximum.frequency / high])
    if maximum.kind == MaximumKind.CORNER:
        margins = np.append(margins, -np.array(conditions.side_slopes))
    return margins


class _Tracker:
    """Step control and events of one track."""

    def __init__(
        self,
        second_order: SecondOrder,
        at: Callable[[float], HarmonicBalance],
        bands: Sequence[tuple[float, float]],
    ):
        self.second_order, self.at, self.bands = second_order, at, bands
        self.track = Track()

    def run(self, start: Maximum | Conditions) -> Track:
        """Step until the end is reached, the maximum is lost or leaves its band."""
        track = self.track
        current = start if isinstance(start, Conditions) else verified(self.second_order, start)
        if current is None:
            track.status = TrackStatus.DIED
            return track
        if self.bands:
            self.bands = [band_of(current.maximum.frequency, self.bands)]
        track.steps.append((0.0, current))
        step, s, failed, current_margins = _FIRST_STEP, 0.0, -1.0, _margins(current, self.bands)
        to_event = np.inf
        for _ in range(_MAX_STEPS):
            if s >= 1:
                track.status = TrackStatus.REACHED_END
                return track
            target = 1.0 if s + step > 1 - _EVENT_PRECISION else s + step
            corrected = advanced(current, self.at(target))
            margins = None if corrected is None else _margins(corrected[0], self.bands)
            at_event = False
            if corrected is None or margins is None or margins.min() < -_EVENT_PRECISION:
                failed, step = target, (target - s) / 2
            else:
                decreasing = np.flatnonzero(margins < current_margins)
                at_event = bool(np.any(margins[decreasing] <= _EVENT_PRECISION))
                rates = (current_margins[decreasing] - margins[decreasing]) / (target - s)
                to_event = float(np.min(margins[decreasing] / rates, initial=np.inf))
                (current, distance), s, current_margins = corrected, target, margins
                track.steps.append((s, current))
                maximum = current.maximum
                amplification = maximum.problem.amplification(maximum.unknowns, maximum.frequency)
                if amplification > _UNBOUNDED_AMPLIFICATION:
                    track.status = TrackStatus.UNBOUNDED
                    return track
                step *= float(np.clip(np.sqrt(_DESIRED_DISTANCE / max(distance, 1e-12)), 0.3, 2.0))
                step = min(step, _LARGEST_STEP)
                if s < failed and not at_event:
                    step = min(step, max(to_event, _EVENT_PRECISION))
            near_event = min(to_event, current_margins.min()) < 100 * _MIN_STEP
            stalled = s < failed and step < (_EVENT_PRECISION if near_event else _MIN_STEP)
            if at_event or stalled:
                grows = track.grows
                continued = (
                    None
                    if s >= 1 or (grows and not at_event)
                    else self._continue_beyond(s, current)
                )
                if continued is None and s < 1:
                    left_band = current.maximum.kind != MaximumKind.EDGE and self._at_end_of_band(
                        current
                    )
                    status = TrackStatus.LEFT_BAND if left_band else TrackStatus.DIED
                    track.status = TrackStatus.UNBOUNDED if grows else status
                    return track
                if continued is not None:
                    track.events.append(len(track.steps) - 1)
                    track.steps += self._steps_from_event(s, continued)
                    (s, current), step, failed, to_event = continued, _FIRST_STEP, -1.0, np.inf
                    current_margins = _margins(current, self.bands)
        track.status = TrackStatus.DIED
        return track

    def _at_end_of_band(self, conditions: Conditions) -> bool:
        low, high = band_of(conditions.maximum.frequency, self.bands)
        frequency = conditions.maximum.frequency
        return min(frequency / low - 1, 1 - frequency / high) < _LIMIT_TOLERANCE

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
            if nearer is None or _margins(nearer[0], self.bands).min() < -_EVENT_PRECISION:
                break
            steps.insert(0, (s + distance, nearer[0]))
        return steps

    def _continue_beyond(self, s: float, conditions: Conditions) -> tuple[float, Conditions] | None:
        """The maximum right beyond an event, of whatever kind."""
        if conditions.maximum.kind != MaximumKind.EDGE and self._at_end_of_band(conditions):
            return None
        for distance in _RESTARTS:
            target = min(1.0, s + distance)
            expected, max_difference = (
                expected_maximum(conditions, self.at(target)),
                min(_MAX_JUMP, _MAX_SLOPE * distance),
            )
            candidates = [
                candidate
                for maximum in _successors(conditions, expected)
                if (
                    distance > _SAME_KIND_DISTANCE or not _is_same_kind(maximum, conditions.maximum)
                )
                and (candidate := verified(self.second_order, maximum)) is not None
                and abs(relative_height(candidate.maximum, expected)) <= max_difference
                and self._in_band(candidate.maximum)
            ]
            if candidates:
                return target, min(
                    candidates, key=lambda candidate: distance_between(candidate.maximum, expected)
                )
            if distance == _SEARCH_DISTANCE:
                candidate = search(
                    self.second_order, expected, expected.problem, self.bands, max_difference
                )
                if (
                    candidate is not None
                    and abs(relative_height(candidate.maximum, expected)) <= max_difference
                ):
                    return target, candidate
        return None

    def _in_band(self, maximum: Maximum) -> bool:
        low, high = band_of(maximum.frequency, self.bands)
        return low * (1 - _EVENT_PRECISION) <= maximum.frequency <= high * (1 + _EVENT_PRECISION)


def _is_same_kind(maximum: Maximum, other: Maximum) -> bool:
    """Whether two maxima satisfy the same constraints."""
    same = maximum.kind == other.kind and maximum.contact == other.contact
    same &= (maximum.loop is None) == (other.loop is None)
    return same and np.array_equal(maximum.slip, other.slip)


def _successors(conditions: Conditions, expected: Maximum) -> list[Maximum]:
    """The maxima that one may become when contacts on their limits change state."""
    slip_margin = conditions.evaluation.friction.slip_margin
    near_limit = {int(j) for j in np.flatnonzero(np.abs(slip_margin) < _LIMIT_TOLERANCE)}
    on_limit = sorted(near_limit | {*conditions.maximum.on_limit})
    if len(on_limit) > _MAX_ON_LIMIT:
        states = [(False,) * len(on_limit), (True,) * len(on_limit)]
    else:
        states = list(product((False, True), repeat=len(on_limit)))
    successors: list[Maximum] = []
    expected = replace(expected, loop=None)
    for state in states:
        slip = conditions.maximum.slip.copy()
        slip[on_limit] = state
        kind = expected.kind if expected.kind == MaximumKind.EDGE else MaximumKind.SMOOTH
        successors.append(replace(expected, kind=kind, slip=slip, contact=-1, further_contacts=()))
        if kind == MaximumKind.EDGE:
            continue
        stuck = [j for j, slips in zip(on_limit, state, strict=True) if not slips]
        all_at_once = len(on_limit) > _MAX_ON_LIMIT
        for contact in stuck[:1] if all_at_once else stuck:
            further_contacts = tuple(j for j in stuck if j != contact) if all_at_once else ()
            corner = replace(expected, kind=MaximumKind.CORNER, slip=slip, contact=contact)
            successors.append(replace(corner, further_contacts=further_contacts))
    return successors
