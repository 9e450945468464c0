"""Blocks of an array that are consecutive in memory."""

from collections.abc import Iterator, Sequence
from itertools import product


def block_shape(shape: Sequence[int], most: int) -> tuple[int, ...]:
    """Sizes of blocks of at most ``most`` entries that are consecutive in memory.

    Powers of two, so that larger blocks are made of whole smaller ones.
    """
    sizes: list[int] = []
    for size in reversed(shape):
        step = size if size <= most else 2 ** (most.bit_length() - 1)
        sizes.insert(0, max(step, 1))
        most = most // step if step == size > 0 else 1
    return tuple(sizes)


def consecutive_blocks(shape: Sequence[int], most: int) -> Iterator[tuple[slice, ...]]:
    """The blocks of at most ``most`` entries, one after the other."""
    block = block_shape(shape, most)
    for corner in product(*map(range, [0] * len(shape), shape, block)):
        ends = zip(corner, block, shape, strict=True)
        yield tuple(slice(start, min(start + step, size)) for start, step, size in ends)
