"""Contacts that change their state for a moment between two points of a path, unseen by its step.

The motion of each contact over its limit is a cubic between its values and rates at two points.
Where that comes as close to the limit as it may be wrong, the path is solved for in between.
"""

import numpy as np

from symhbm.constraints import BEYOND
from symhbm.corrector import Corrector
from symhbm.doubt import Known, value_errors
from symhbm.events import PathPoint
from symhbm.fourier import FloatArray
from symhbm.hermite import cubic
from symhbm.stations import Between, Station, ahead, measure

_SHARES = np.arange(1, 16) / 16
_SPREAD = (4 * _SHARES * (1 - _SHARES)) ** 2
"""Error of a cubic over the largest between two points."""
_SHRUNK = 1 / 4
"""Error of a cubic over a part of a stretch, over that found at the point that divides it."""
_MAX_LOOKS = 8


def overlooked(points: list[PathPoint], corrector: Corrector) -> dict[int, float]:
    """Values between two points at which a contact is in another state than after the first.

    By the number of the first point.
    """
    if len(points) < 2 or not len(points[0].slip):
        return {}
    slip, scale = (np.array([getattr(p, name) for p in points]) for name in ("slip", "scale"))
    outward, smooth = np.where(slip, -1.0, 1.0), ~np.array([bool(p.events) for p in points])
    after, before = _known(points, "after", "rate"), _known(points, "before", "rate_before")
    stretch = slice(None, -1)
    left, right = _part(after, outward, slice(None, -1)), _part(before, outward, slice(1, None))
    # A neighbour in another state tells nothing.
    previous = _shifted(after, outward, smooth, -1)
    following = _shifted(before, outward, smooth, 1)
    ends = left.station, right.station
    measured = measure(corrector.curve.single_valued, *ends, scale[stretch])
    rates = [k.rate / ahead(k.station, measured.normal, scale[stretch]) for k in (left, right)]
    with np.errstate(invalid="ignore"):
        error = value_errors(measured, scale[stretch], previous, left, right, following)
        slopes = tuple((measured.length * rate)[:, None] for rate in rates)
        inside = cubic(left.value[:, None], right.value[:, None], slopes, _SHARES[:, None])
        highest = (inside + _SPREAD[:, None] * error[:, None]).max(axis=1)
        near = np.isfinite(highest) & (highest > -BEYOND)
    found = {}
    for i in np.flatnonzero(near.any(axis=1)).tolist():
        here = Between(corrector, ends[0][i], ends[1][i], slip[i], scale[i], measured.take(i))
        for contact in np.flatnonzero(near[i]).tolist():
            known = [
                (float(k.value[i, contact]), float(rate[i, contact] * here.length))
                for k, rate in zip((left, right), rates, strict=True)
            ]
            value = _beyond(here, contact, *known, float(error[i, contact]))
            if value is not None:
                found[i] = value
                break
    return found


def _known(points: list[PathPoint], side: str, rate: str) -> Known:
    names = "state", side, "excess", rate
    state, direction, excess, along = (np.array([getattr(p, n) for p in points]) for n in names)
    return Known(Station(state, direction), excess, along)


def _part(known: Known, outward: FloatArray, part: slice) -> Known:
    """At one end of all stretches, positive beyond the limit of the state in between."""
    sign = outward[:-1]
    return Known(known.station[part], sign * known.value[part], sign * known.rate[part])


def _shifted(known: Known, outward: FloatArray, smooth: np.ndarray, by: int) -> Known:
    """Next to all stretches, NaN beyond an event and both ends of the path."""
    count = len(outward) - 1
    at = np.arange(count) + (by if by < 0 else 1 + by)
    valid = (at >= 0) & (at <= count) & (smooth[:-1] if by < 0 else smooth[1:])
    at = np.clip(at, 0, count)
    nothing = np.where(valid, 1.0, np.nan)[:, None]
    station = Station(known.station.state[at] * nothing, known.station.direction[at] * nothing)
    sign = outward[:-1] * nothing
    return Known(station, sign * known.value[at], sign * known.rate[at])


def _beyond(
    path: Between,
    contact: int,
    left: tuple[float, float],
    right: tuple[float, float],
    error: float,
) -> float | None:
    """A value at which a contact is in another state, None if there is none to be found.

    ``left`` and ``right`` have its excess and the derivative by the share of the way.
    """
    low, high = 0.0, 1.0
    for _ in range(_MAX_LOOKS):
        width = high - low
        slopes = width * left[1], width * right[1]
        inside = cubic(left[0], right[0], slopes, _SHARES)
        doubtful = inside + _SPREAD * error
        top = int(np.argmax(doubtful))
        if doubtful[top] <= -BEYOND:
            return None
        share = low + width * float(_SHARES[top])
        found = path.excess(share, contact)
        if found is None:
            station = path.solve_between(share)
            return float(station.state[-1]) if station is not None and path.other_states else None
        error = _SHRUNK * abs(found[0] - float(inside[top]))
        if found[1] > 0:
            low, left = share, found
        else:
            high, right = share, found
    return None
