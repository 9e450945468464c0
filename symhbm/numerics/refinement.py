"""Items in an order, and those that are needed between them."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeVar

_MAX_DEPTH = 8
"""Most times that what lies between two items is divided."""
Item = TypeVar("Item")


def refined(
    items: Sequence[Item], middle: Callable[[Item, Item], Item | None], depth: int = _MAX_DEPTH
) -> list[Item]:
    """The items with others between them, each divided up to ``depth`` times.

    ``middle`` of two neighbours is another one between them, None where none is needed.
    """
    result = [*items[:1]]
    for left, right in pairwise(items):
        inner = middle(left, right) if depth else None
        result += [right] if inner is None else refined([left, inner, right], middle, depth - 1)[1:]
    return result
