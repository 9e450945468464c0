"""One maximum of the response followed as parameters move: exact at every point, with its events.

Derivatives of the conditions of a maximum predict the next one, Newton's method corrects it. Where
a contact changes its state at the maximum, or a slope beside a corner its sign, the event is solved
for and the maximum is taken up beyond, of the kind it then has; where none of the kinds possible
there is a maximum, it is looked for along the frequency response around.
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
    aimed,
    apart,
    band_of,
    between,
    height,
    search,
    verified,
)

_AIM = 0.08
"""Distance of prediction and solution that steps aim at, relative."""
_FIRST, _LARGEST = 0.05, 0.25
_SMALLEST = 1e-4
"""Step below which a maximum that cannot be followed has died."""
_AT_EVENT = 1e-11
"""Distance from an event, along the way, at which it is solved for."""
_BEYOND = (1e-9, 1e-7, 1e-5, 1e-3, 1e-2)
"""Distances beyond an event at which the maximum is looked for."""
_SAME = 1e-4
"""Distance below which a maximum beyond an event is of another kind than before it."""
_SEARCHED, _STEEPEST, _JUMP = 1e-3, 10.0, 3e-3
"""Distance at which it is searched for, and by which relative difference from the height expected
another maximum is told: over the distance, and at most."""
_NEAR_LIMIT = 1e-6
_MOST_TOGETHER = 3
"""Contacts at their limits at once, all of whose states are tried."""
_MAX_STEPS = 500
_NEAR_POLE = 1e-2
"""Distance from a pole within which a maximum that ends grows without bound."""
_AMPLIFIED = 1e8
"""Inertia over exciting force from which nothing limits a maximum."""


class TrackStatus(StrEnum):
    """How following a maximum ended."""

    REACHED_END = "the end was reached"
    DIED = "the maximum merged with a minimum"
    LEFT_BAND = "the maximum left the band of frequencies"
    UNBOUNDED = "the maximum grows without bound"


@dataclass
class Track:
    """A maximum along the way: ``steps`` are solved, ``end`` is where it ended and ``status`` why.

    ``events`` are numbers of the steps that stand at an event, in the state before it; the step
    after each is in that beyond.
    """

    steps: list[tuple[float, Conditions]] = field(default_factory=list)
    events: list[int] = field(default_factory=list)
    status: TrackStatus = TrackStatus.REACHED_END

    @property
    def end(self) -> float:
        """The last place that was solved."""
        return self.steps[-1][0] if self.steps else 0.0

    @property
    def pole(self) -> float:
        """Where the height grows without bound if it goes on as it does, infinite if it falls."""
        if len(self.steps) < 2:
            return np.inf
        (s, one), (end, other) = self.steps[-2:]
        one, other = 1 / one.summit.amplitude, 1 / other.summit.amplitude
        return end + other * (end - s) / (one - other) if one > other else np.inf

    @property
    def grows(self) -> bool:
        """Whether it grows towards a pole close by: twofold at least on two thirds of the way."""
        left = self.pole - self.end
        if left >= _NEAR_POLE:
            return False
        before = [c.summit.amplitude for s, c in self.steps if self.pole - s >= 3 * left]
        return bool(before) and self.steps[-1][1].summit.amplitude > 2 * before[-1]


def track(
    second_order: SecondOrder,
    start: Maximum | Conditions,
    at: Callable[[float], HarmonicBalance],
    *,
    bands: Sequence[tuple[float, float]] = (),
) -> Track:
    """Follow a maximum from ``at(0)`` to ``at(1)``.

    ``at`` gives copies of the problem of ``second_order`` with other values of its parameters.
    ``bands`` [rad/s]: where its frequency may be, by default anywhere.
    """
    return _Tracker(second_order, at, bands).run(start)


def retrack(
    second_order: SecondOrder, conditions: Conditions, problem: HarmonicBalance
) -> Conditions | None:
    """The maximum after parameters changed: at once, in steps, or looked for; None if it is gone.

    What is returned is a verified maximum of the same degree of freedom.
    """
    found = advanced(conditions, problem)
    if found is not None:
        return found[0]
    at = between(conditions.summit.problem, problem, second_order.names)
    followed = track(second_order, conditions, at)
    if followed.status == TrackStatus.REACHED_END and followed.steps:
        return followed.steps[-1][1]
    return search(second_order, aimed(conditions, problem), problem)


def _margins(conditions: Conditions, bands: Sequence[tuple[float, float]]) -> FloatArray:
    """How far a maximum is from what ends its kind, positive as long as it is of it."""
    summit = conditions.summit
    slip_margin = conditions.evaluation.friction.slip_margin
    margins = np.where(summit.slip, slip_margin, -slip_margin)
    margins[summit.held] = np.inf
    margins[~np.isfinite(margins)] = 1.0
    if summit.kind == MaximumKind.EDGE:
        return margins
    low, high = band_of(summit.frequency, bands)
    margins = np.append(margins, [summit.frequency / low - 1, 1 - summit.frequency / high])
    if summit.kind == MaximumKind.CORNER:
        margins = np.append(margins, -np.array(conditions.flanks))
    return margins


class _Tracker:
    def __init__(
        self,
        second_order: SecondOrder,
        at: Callable[[float], HarmonicBalance],
        bands: Sequence[tuple[float, float]],
    ):
        self.second_order, self.at, self.bands = second_order, at, bands
        self.track = Track()

    def run(self, start: Maximum | Conditions) -> Track:
        """Step until the end, the death of the maximum, or the end of its band."""
        track = self.track
        here = start if isinstance(start, Conditions) else verified(self.second_order, start)
        if here is None:
            track.status = TrackStatus.DIED
            return track
        if self.bands:
            self.bands = [band_of(here.summit.frequency, self.bands)]
        track.steps.append((0.0, here))
        step, s, fail, known = _FIRST, 0.0, -1.0, _margins(here, self.bands)
        ahead = np.inf
        for _ in range(_MAX_STEPS):
            if s >= 1:
                track.status = TrackStatus.REACHED_END
                return track
            target = 1.0 if s + step > 1 - _AT_EVENT else s + step
            found = advanced(here, self.at(target))
            margins = None if found is None else _margins(found[0], self.bands)
            arrived = False
            if found is None or margins is None or margins.min() < -_AT_EVENT:
                fail, step = target, (target - s) / 2
            else:
                falling = np.flatnonzero(margins < known)
                arrived = bool(np.any(margins[falling] <= _AT_EVENT))
                rate = (known[falling] - margins[falling]) / (target - s)
                ahead = float(np.min(margins[falling] / rate, initial=np.inf))
                (here, distance), s, known = found, target, margins
                track.steps.append((s, here))
                summit = here.summit
                grown = summit.problem.amplification(summit.unknowns, summit.frequency)
                if grown > _AMPLIFIED:
                    track.status = TrackStatus.UNBOUNDED
                    return track
                step *= float(np.clip(np.sqrt(_AIM / max(distance, 1e-12)), 0.3, 2.0))
                step = min(step, _LARGEST)
                if s < fail and not arrived:
                    step = min(step, max(ahead, _AT_EVENT))
            hunting = min(ahead, known.min()) < 100 * _SMALLEST
            stuck = s < fail and step < (_AT_EVENT if hunting else _SMALLEST)
            if arrived or stuck:
                grows = track.grows
                beyond = None if s >= 1 or (grows and not arrived) else self._beyond(s, here)
                if beyond is None and s < 1:
                    left = here.summit.kind != MaximumKind.EDGE and self._at_end_of_band(here)
                    ended = TrackStatus.LEFT_BAND if left else TrackStatus.DIED
                    track.status = TrackStatus.UNBOUNDED if grows else ended
                    return track
                if beyond is not None:
                    track.events.append(len(track.steps) - 1)
                    track.steps += self._closer(s, beyond)
                    (s, here), step, fail, ahead = beyond, _FIRST, -1.0, np.inf
                    known = _margins(here, self.bands)
        track.status = TrackStatus.DIED
        return track

    def _at_end_of_band(self, here: Conditions) -> bool:
        low, high = band_of(here.summit.frequency, self.bands)
        frequency = here.summit.frequency
        return min(frequency / low - 1, 1 - frequency / high) < _NEAR_LIMIT

    def _closer(self, s: float, found: tuple[float, Conditions]) -> list[tuple[float, Conditions]]:
        """A maximum beyond an event, and steps from there back to the event.

        Where slip begins derivatives are not bounded: away from there is harder than towards it.
        """
        steps, distance = [found], found[0] - s
        while (distance := distance / 4) > _BEYOND[0]:
            nearer = advanced(steps[0][1], self.at(s + distance))
            if nearer is None or _margins(nearer[0], self.bands).min() < -_AT_EVENT:
                break
            steps.insert(0, (s + distance, nearer[0]))
        return steps

    def _beyond(self, s: float, here: Conditions) -> tuple[float, Conditions] | None:
        """The maximum right beyond an event, of whatever kind it is there."""
        if here.summit.kind != MaximumKind.EDGE and self._at_end_of_band(here):
            return None
        for distance in _BEYOND:
            target = min(1.0, s + distance)
            aim, jump = aimed(here, self.at(target)), min(_JUMP, _STEEPEST * distance)
            found = [
                other
                for summit in _successors(here, aim)
                if (distance > _SAME or not _alike(summit, here.summit))
                and (other := verified(self.second_order, summit)) is not None
                and abs(height(other.summit, aim)) <= jump
                and self._inside(other.summit)
            ]
            if found:
                return target, min(found, key=lambda other: apart(other.summit, aim))
            if distance == _SEARCHED:
                other = search(self.second_order, aim, aim.problem, self.bands, jump)
                if other is not None and abs(height(other.summit, aim)) <= jump:
                    return target, other
        return None

    def _inside(self, summit: Maximum) -> bool:
        low, high = band_of(summit.frequency, self.bands)
        return low * (1 - _AT_EVENT) <= summit.frequency <= high * (1 + _AT_EVENT)


def _alike(one: Maximum, other: Maximum) -> bool:
    """Whether two summits are held by the same."""
    same = one.kind == other.kind and one.contact == other.contact
    same &= (one.loop is None) == (other.loop is None)
    return same and np.array_equal(one.slip, other.slip)


def _successors(here: Conditions, aim: Maximum) -> list[Maximum]:
    """The maxima that one may turn into whose contacts are at their limits."""
    slip_margin = here.evaluation.friction.slip_margin
    close = {int(j) for j in np.flatnonzero(np.abs(slip_margin) < _NEAR_LIMIT)}
    limits = sorted(close | {*here.summit.held})
    if len(limits) > _MOST_TOGETHER:
        states = [(False,) * len(limits), (True,) * len(limits)]
    else:
        states = list(product((False, True), repeat=len(limits)))
    found: list[Maximum] = []
    aim = replace(aim, loop=None)
    for state in states:
        slip = here.summit.slip.copy()
        slip[limits] = state
        kind = aim.kind if aim.kind == MaximumKind.EDGE else MaximumKind.SMOOTH
        found.append(replace(aim, kind=kind, slip=slip, contact=-1, together=()))
        if kind == MaximumKind.EDGE:
            continue
        stuck = [j for j, slips in zip(limits, state, strict=True) if not slips]
        together = len(limits) > _MOST_TOGETHER
        for contact in stuck[:1] if together else stuck:
            others = tuple(j for j in stuck if j != contact) if together else ()
            corner = replace(aim, kind=MaximumKind.CORNER, slip=slip, contact=contact)
            found.append(replace(corner, together=others))
    return found
