"""One thread of linear algebra: matrices of some hundred unknowns are slower with several.

Threads of BLAS wait for each other longer than such a matrix takes, and on a busy machine many
times as long. Structures are condensed with all threads.
"""

import threading
from collections.abc import Callable
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

Given = ParamSpec("Given")
Result = TypeVar("Result")
_lock = threading.Lock()


class _State:
    """Calls that are under way in all threads of this process, and what ends the limit."""

    calls = 0
    limit: Any = None


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def on_one_thread(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """The function with linear algebra on one thread, until the last call of such functions ends.

    Calls in several threads at once share it, and the last one ends it. OpenBLAS may not heed a
    limit that another thread than the main one sets.
    """

    @wraps(function)
    def limited(*args: Given.args, **kwargs: Given.kwargs) -> Result:
        with _lock:
            if not _State.calls:
                _State.limit = _controller().limit(limits=1, user_api="blas")
            _State.calls += 1
        try:
            return function(*args, **kwargs)
        finally:
            with _lock:
                _State.calls -= 1
                if not _State.calls:
                    _State.limit.restore_original_limits()

    return limited
