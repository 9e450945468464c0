"""Long computations tell how far they are; who watches listens, and by default nobody does."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import count


class Watcher:
    """Is told how far a computation is, and does nothing with it."""

    def reached(self, value: float, n_maxima: Callable[[], int]) -> None:
        """A path is at a value of its parameter; ``n_maxima`` counts those that it passed."""

    def done(self, number: int, total: int | None, what: str) -> None:
        """So many pieces of one kind of work are done, of a total that may not be known."""

    def counting(self, what: str, total: int | None = None) -> Callable[[], None]:
        """What is called once for each piece of work that is done."""
        numbers = count(1)
        return lambda: self.done(next(numbers), total, what)


_WATCHER: ContextVar[Watcher | None] = ContextVar("watcher", default=None)


@contextmanager
def watched(by: Watcher) -> Iterator[None]:
    """A context in which all that is computed tells a watcher how far it is."""
    token = _WATCHER.set(by)
    try:
        yield
    finally:
        _WATCHER.reset(token)


def watching() -> Watcher:
    """Who watches."""
    return _WATCHER.get() or Watcher()
