"""Fewer points of a curve, so that straight lines between them stay close to it."""

import numpy as np
from numpy.typing import NDArray

from symhbm.numerics import FloatArray

_FIRST = 1e-3
"""The distance that a point may have from the line of its neighbours to be left out first [dB]."""


def thinned(
    value: FloatArray,
    level: FloatArray,
    kept: NDArray[np.bool_],
    most: int,
    tolerance: float = 0.0,
) -> NDArray[np.intp]:
    """Numbers of the points that stay, in order: the ends, those ``kept``, and what bends the most.

    ``value`` (n,) along the curve, ``level`` (n, m) [dB] over it. Points that lie the closest to
    the straight line of their neighbours go first, until no more than ``most`` stay; beyond that,
    as many go as leave the line within about the ``tolerance`` of the curve. Those kept stay,
    however many they are, and so do the neighbours of gaps.
    """
    points = np.arange(len(value))
    stay = kept.copy()
    stay[:1] = stay[-1:] = True
    distance, left_over = min(_FIRST, tolerance or _FIRST) / 2, tolerance
    odd = 1
    idle = 0
    while idle < 2 and (len(points) > most or distance <= left_over):
        inner = points[1:-1]
        before, after = points[:-2], points[2:]
        width = value[after] - value[before]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(width != 0, (value[inner] - value[before]) / width, 0.5)
            straight = level[before] + share[:, None] * (level[after] - level[before])
            away = np.abs(level[inner] - straight).max(axis=1, initial=0.0)
        # Of two neighbours one stays, so that distances do not add up within a pass.
        gone = (away <= distance) & ~stay[inner] & (np.arange(len(inner)) % 2 == odd)
        odd = 1 - odd
        removable = (~stay[inner] & np.isfinite(away)).any()
        idle = 0 if removable else idle + 1
        points = points[np.concatenate([[True], ~gone, [True]])] if len(points) > 2 else points
        if not odd:
            left_over -= distance
            distance *= 1.5
    return points
