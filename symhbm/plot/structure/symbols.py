"""Symbols of structures: springs, dampers, contacts and the ground, as lines in the plane.

Each symbol is a list of lines (n_points, 2) from (0, 0) to (length, 0). The distance of two
neighbouring masses is about 1.
"""

from collections.abc import Callable, Sequence

import numpy as np

from symhbm.numerics import FloatArray

Lines = list[FloatArray]

WIDTH = 0.07
"""Half of the width of a symbol."""
BESIDE = 0.24
"""Distance of elements side by side."""
LEAD = 0.05
"""Length of the line from a mass to a bar that holds several elements."""


def spring(length: float) -> Lines:
    """A zigzag."""
    return [_zigzag(0.0, length, 0.4)]


def damper(length: float) -> Lines:
    """A piston in a cup."""
    low, high = (length - 0.24) / 2, (length + 0.24) / 2
    middle = low + 0.13
    cup = [(high, WIDTH), (low, WIDTH), (low, -WIDTH), (high, -WIDTH)]
    plate = [(middle, 0.7 * WIDTH), (middle, -0.7 * WIDTH)]
    return _lines([(0, 0), (low, 0)], cup, plate, [(middle, 0), (length, 0)])


def friction(length: float) -> Lines:
    """A spring in series with a slider: two plates that are pressed together."""
    body = min(0.52, 0.92 * length)
    low, high = (length - body) / 2, (length + body) / 2
    half = low + 0.5 * body
    upper = [(half, 0), (half, 0.02), (high - 0.06, 0.02)]
    lower = [(half + 0.06, -0.02), (high, -0.02), (high, 0), (length, 0)]
    middle = (half + high) / 2
    pressed: Lines = []
    for side in (1, -1):
        tip, tail, barb = side * 0.035, side * 0.15, side * 0.075
        pressed += _lines(
            [(middle, tail), (middle, tip)],
            [(middle - 0.03, barb), (middle, tip), (middle + 0.03, barb)],
        )
    return [_zigzag(0.0, half, 0.8 * (half - low), low), *_lines(upper, lower), *pressed]


def cubic(length: float) -> Lines:
    """A spring with an arrow through it: its stiffness changes."""
    low, high = length / 2 - 0.15, length / 2 + 0.15
    tip = (high, 1.9 * WIDTH)
    arrow = [(low, -1.9 * WIDTH), tip]
    barbs = [(high - 0.075, 1.75 * WIDTH), tip, (high - 0.02, 1.9 * WIDTH - 0.075)]
    return [*spring(length), *_lines(arrow, barbs)]


def opened(length: float) -> Lines:
    """A line that is broken: nothing is transmitted."""
    low, high = length / 2 - 0.1, length / 2 + 0.1
    return _lines([(0, 0), (low, 0)], [(low, 0), (high - 0.03, 0.1)], [(high, 0), (length, 0)])


def contact(length: float) -> Lines:
    """A box: a law of the user's own."""
    low, high, half = length / 2 - 0.12, length / 2 + 0.12, WIDTH
    box = [(low, -half), (high, -half), (high, half), (low, half), (low, -half)]
    return _lines([(0, 0), (low, 0)], box, [(high, 0), (length, 0)])


def line(length: float) -> Lines:
    """A line: coupling that is no spring."""
    return _lines([(0, 0), (length, 0)])


SYMBOLS: dict[str, Callable[[float], Lines]] = {
    "spring": spring,
    "damper": damper,
    "friction": friction,
    "cubic": cubic,
    "contact": contact,
    "opened": opened,
    "line": line,
}


def side_by_side(
    kinds: Sequence[str], start: FloatArray, end: FloatArray
) -> tuple[list[Lines], Lines, FloatArray]:
    """Elements between two points, the bars that hold them, and the middle of each.

    Returns the lines of each element, those of the bars, and the middles (n_elements, 2).
    """
    length = float(np.linalg.norm(end - start))
    several = len(kinds) > 1
    lead = LEAD if several else 0.0
    offsets = BESIDE * (np.arange(len(kinds)) - (len(kinds) - 1) / 2)
    drawn = []
    for kind, offset in zip(kinds, offsets, strict=True):
        local = SYMBOLS[kind](length - 2 * lead)
        moved = np.array([lead, offset])
        drawn.append([turned(part + moved, start, end) for part in local])
    bars: Lines = []
    if several:
        for near, far in ((0.0, lead), (length, length - lead)):
            bars += _lines([(near, 0), (far, 0)], [(far, offsets[0]), (far, offsets[-1])])
    middles = np.stack([np.full(len(kinds), length / 2), offsets], axis=-1)
    return drawn, [turned(bar, start, end) for bar in bars], turned(middles, start, end)


def ground(at: FloatArray, direction: FloatArray, half: float) -> Lines:
    """A line across ``direction`` (of length 1) with hatches behind it."""
    across = np.linspace(-half, half, 6 if half < 0.3 else 10)
    wall = np.array([(0.0, -half), (0.0, half)])
    hatches = [np.array([(0.0, y), (0.08, y - 0.07)]) for y in across]
    return [turned(part, at, at + direction) for part in (wall, *hatches)]


def turned(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Points (n, 2) along and across the line from ``start`` to ``end``, in the plane."""
    along = (end - start) / np.linalg.norm(end - start)
    across = np.array([-along[1], along[0]])
    return start + points[:, :1] * along + points[:, 1:] * across


def _zigzag(start: float, end: float, body: float, low: float | None = None) -> FloatArray:
    """A line with teeth over a length of ``body`` from ``low`` on, else in the middle."""
    body = min(body, 0.8 * (end - start))
    low = (start + end - body) / 2 if low is None else low
    at = low + body * (np.arange(9) - 0.5) / 8
    height = WIDTH * np.array([0, 1, -1, 1, -1, 1, -1, 1, 0], dtype=float)
    at[0], at[-1] = low, low + body
    inner = np.stack([at, height], axis=-1)
    return np.concatenate([[(start, 0.0)], inner, [(end, 0.0)]])


def _lines(*lines: Sequence[tuple[float, float]]) -> Lines:
    return [np.array(line, dtype=float) for line in lines]
