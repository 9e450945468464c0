"""Response curves between their points, with what contacts do there."""

from collections.abc import Callable

import numpy as np
import xarray as xr

import symhbm as sh
from symhbm.numerics import FloatArray

DASHES = (0, (6, 1.5, 1.2, 1.5))


def along(curve: xr.Dataset, place: int = 0) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Values (n,), amplitudes (n,) [m] as drawn, and the stretch (n - 1,) of each line.

    A stretch has the number of the point of the dataset at which it begins.
    """
    value, amplitude = sh.plot.curve(curve, place=place)
    points = curve.frequency.values[np.isfinite(curve.frequency.values)]
    stretch, last = np.zeros(len(value), dtype=int), -1
    for i, at in enumerate(value):
        if last + 1 < len(points) and at == points[last + 1]:
            last += 1
            # A curve that runs one way has each value once.
            again = i + 1 < len(value) and value[i + 1] == at
            while not again and last + 1 < len(points) and points[last + 1] == at:
                last += 1
        stretch[i] = last
    return value, amplitude, stretch[:-1]


def with_states(
    curve: xr.Dataset, place: int, between: Callable[..., np.ndarray]
) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Values (n,), amplitudes (n,) [m] as drawn, and states (n, n_contacts) of contacts.

    Between two points the state is ``between`` both of theirs, for example `numpy.maximum`.
    """
    value, amplitude, stretch = along(curve, place)
    points = curve.frequency.values[np.isfinite(curve.frequency.values)]
    state = curve.contact_state.values[: len(points)]
    begin = np.append(stretch, len(points) - 1)
    found = between(state[begin], state[np.minimum(begin + 1, len(points) - 1)])
    own = value == points[begin]
    found[own] = state[begin[own]]
    return value, amplitude, found
