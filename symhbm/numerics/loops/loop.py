"""Plain loops, compiled by numba at their first call; without numba the same lines run as Python.

numba is imported with the first call of a loop, so that importing symhbm stays light; it does
nothing where ``NUMBA_DISABLE_JIT`` is set. Machine code is kept beside the sources, where who may
write it may write these, or in a folder of the user alone: a loop may call others, so that each is
kept for the sources of all.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from typing import Any, ClassVar

from symhbm.numerics.own_files import is_own


class Loop:
    """A function that is compiled when it is called first, on its own or by another one."""

    _sources: ClassVar[set[str]] = set()
    _functions: ClassVar[set[Callable[..., Any]]] = set()

    def __init__(self, function: Callable[..., Any]):
        self._function = function
        self._sources.add(function.__code__.co_filename)
        self._functions.add(function)
        update_wrapper(self, function)

    @cached_property
    def _compiled(self) -> Any:
        try:
            import numba
        except ImportError:
            return self._function
        if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
            return self._function
        # A division by zero gives what numpy gives, and no exception.
        options: Any = dict(error_model="numpy", no_cfunc_wrapper=True)
        compiled: Any = numba.njit(self._function, **options)
        # Else numba compiles a loop again for each number that is written where it is called.
        template = compiled.get_call_template
        compiled.get_call_template = lambda arguments, names: template(
            tuple(map(numba.types.unliteral, arguments)), names
        )
        with suppress(RuntimeError):  # nowhere to write
            compiled.enable_caching()
            kept: Any = compiled
            with suppress(AttributeError):
                kept._cache._cache_file._source_stamp = _fingerprint(frozenset(self._sources))
            folder = Path(kept._cache.cache_path)
            beside = Path(self._function.__code__.co_filename).absolute().parent
            if folder.parent != beside and not is_own(folder):
                kept._cache.disable()
        return compiled

    @property
    def _numba_type_(self) -> Any:
        """What it is for a loop that calls it."""
        return self._compiled._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        """The result of the function."""
        return self._compiled(*arguments)


@contextmanager
def told_of_compiling(tell: Callable[[], None]) -> Iterator[None]:
    """A context that calls ``tell`` once in front of the first loop that it has to compile."""
    try:
        from numba.core import event
    except ImportError:
        yield
        return
    first = cache(tell)

    class Listener(event.Listener):
        def on_start(self, event: Any) -> None:
            if event.data["dispatcher"].py_func in Loop._functions:
                first()

        def on_end(self, event: Any) -> None:
            """Nothing is to be said."""

    with event.install_listener("numba:compile", Listener()):
        yield


@cache
def _fingerprint(sources: frozenset[str]) -> str:
    texts = [Path(source).read_bytes() for source in sorted(sources)]
    return hashlib.sha256(b"\0".join(texts)).hexdigest()
