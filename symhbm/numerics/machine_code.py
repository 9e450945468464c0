"""Loops: Python until machine code pays, then compiled by numba; where machine code is kept.

A first curve takes 1 to 5 seconds as Python, compiling all that it calls 10 to 30. Where numba is
missing, or ``NUMBA_DISABLE_JIT`` is set, loops stay Python. numba is imported with the first
machine code, so that importing symhbm stays light.

Code in files is run where they are of this user alone. Who may write a folder may put something
else in the place of what it holds, so that all folders on the way count, and those that symbolic
links lead through. The administrator may write anywhere, and so may the group that many systems
make for each user alone. The code of loops is kept beside the sources, where who may write it may
write these, or in a folder of the user alone.
"""

from __future__ import annotations

import atexit
import hashlib
import json
import os
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from copy import deepcopy
from functools import cache, cached_property, update_wrapper
from inspect import ismodule
from pathlib import Path
from threading import local
from types import CodeType
from typing import Any, ClassVar, cast

import numpy as np

CACHE = "SYMHBM_CACHE"
"""Environment variable that names the folder of what is kept for this user."""
_TIMES = "loops.json"
"""File of that folder: seconds that each loop ran as Python."""
_MOST_TIMES = 2000
_UNTIL_READ = 0.1
"""Seconds that all loops of a process run as Python before kept machine code is looked for."""
_UNTIL_COMPILED = 1e-4
"""Seconds that a loop runs as Python, for each byte that is to be compiled: a quarter of what that
takes."""


def is_own(path: Path) -> bool:
    """Whether nobody else can write what is at a path, or put something else there."""
    if os.name == "nt":
        return True
    try:
        return not _is_open(path.stat()) and _is_held(path.absolute())
    except OSError:  # nothing is there, or links lead in a circle
        return False


def is_own_file(path: Path) -> bool:
    """Whether a path in a folder of this user is a file of the same, and no symbolic link."""
    status = path.lstat()
    if os.name == "nt":
        return stat.S_ISREG(status.st_mode)
    return stat.S_ISREG(status.st_mode) and _is_ours(status) and not _is_open(status)


def own_folder(path: Path) -> bool:
    """Whether a folder is of this user alone; it is made where there is none."""
    for folder in reversed((path := path.absolute(), *path.parents)):
        if not folder.exists():
            if os.name != "nt" and not _is_held(folder.parent):
                return False
            folder.mkdir(mode=0o700, exist_ok=True)
    return path.is_dir() and is_own(path)


def _is_held(path: Path) -> bool:
    """Whether nobody else can put something else at an absolute path."""
    status = path.lstat()
    if not _is_ours(status) or (path != path.parent and not _is_held(path.parent)):
        return False
    if stat.S_ISLNK(status.st_mode):
        return _is_held(path.parent / path.readlink())
    return not _is_open(status) or bool(status.st_mode & stat.S_ISVTX)


def _is_ours(status: os.stat_result) -> bool:
    return status.st_uid in (0, os.getuid())


def _is_open(status: os.stat_result) -> bool:
    """Whether others than its owner may write."""
    by_group = status.st_mode & stat.S_IWGRP and not _is_private(status.st_gid)
    return bool(by_group or status.st_mode & stat.S_IWOTH)


@cache
def _is_private(group: int) -> bool:
    """Whether a group is this user's, of the same name and without other members."""
    import grp
    import pwd

    try:
        user, told = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
    except KeyError:
        return False
    is_own_name = (user.pw_name, user.pw_gid) == (told.gr_name, group) and user.pw_uid != 0
    return is_own_name and set(told.gr_mem) <= {user.pw_name}


def folder() -> Path:
    """The folder of compiled functions, of this user alone."""
    given = os.environ.get(CACHE)
    root = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME")
    return Path(given) if given else Path(root or Path.home() / ".cache") / "symhbm"


class Loop:
    """A function that runs as Python until machine code pays, to the same bits.

    It is compiled once it took a quarter of the time that compiling takes, in this process and
    those before, or where another one that is compiled calls it. Python rounds ``x**2`` and
    ``math.hypot`` in another way: loops have products and ``np.hypot`` in their place.
    """

    _all: ClassVar[list[Loop]] = []
    _within = local()
    """Whether another loop of the thread runs as Python: that one takes the time of both."""

    def __init__(self, function: Callable[..., Any]):
        self._function = function
        self._run = self._as_python
        self._seconds = 0.0
        self._all.append(self)
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """The result of the function."""
        return self._run(*arguments)

    def _as_python(self, *arguments: Any) -> Any:
        if getattr(self._within, "loop", False):
            return self._function(*arguments)
        start = time.thread_time()
        before = deepcopy(arguments)
        self._within.loop = True
        try:
            with np.errstate(all="ignore"):
                return self._function(*arguments)
        except (ArithmeticError, ValueError):  # machine code gives infinity or NaN in its place
            _write_again(before, arguments)
            self._run = self._compiled
            return self._run(*arguments)
        finally:
            self._within.loop = False
            self._seconds += time.thread_time() - start
            if self._is_hot():
                self._run = self._compiled

    def _is_hot(self) -> bool:
        """Whether machine code is kept or pays."""
        if sum(loop._seconds for loop in self._all) < _UNTIL_READ:
            return False
        return self._is_kept or self._seconds + _earlier().get(self._stamp, 0.0) > self._patience

    @property
    def pays(self) -> bool:
        """Whether machine code is kept or pays, of a loop that Python has no code for."""
        return self._is_hot() and hasattr(self._compiled, "overloads")

    def took(self, seconds: float) -> None:
        """Count the seconds that other code took in its place."""
        self._seconds += seconds

    @property
    def is_compiled(self) -> bool:
        """Whether machine code runs in this process, on its own or for another one."""
        return bool(getattr(self.__dict__.get("_compiled"), "overloads", None))

    @property
    def compiled(self) -> Any:
        """The loop as machine code alone."""
        return self._compiled

    def address(self, *arguments: Any) -> int:
        """Where the machine code for such arguments is, for `symhbm.numerics.loops.by_address`."""
        from numba import typeof

        types = tuple(map(typeof, arguments))
        self._compiled.compile(types)
        made = self._compiled.overloads[types]
        return made.library.get_pointer_to_function(made.fndesc.llvm_func_name)

    def compiles(self, *arguments: Any) -> bool:
        """Whether there is machine code for such arguments, or numba can make it."""
        try:
            self.address(*arguments)
        except Exception:  # calls by address need what numba does not promise
            return False
        return True

    @property
    def _named(self) -> list[Any]:
        """What stands behind the global names in it, those of modules, too."""
        names, known = self._function.__code__.co_names, self._function.__globals__
        direct = [known.get(name) for name in names]
        modules = filter(ismodule, direct)
        return direct + [getattr(module, name, None) for module in modules for name in names]

    @cached_property
    def _called(self) -> list[Loop]:
        """It and all loops that it calls, in depth."""
        found: list[Loop] = [self]
        for loop in found:
            for named in loop._named:
                if isinstance(named, Loop) and named not in found:
                    found.append(named)
        return found

    @property
    def _patience(self) -> float:
        """Seconds that it runs as Python."""
        codes = [loop._function.__code__ for loop in self._called if not loop.is_compiled]
        return _UNTIL_COMPILED * sum(len(code.co_code) for code in codes)

    @cached_property
    def _stamp(self) -> str:
        """Checksum of what machine code is made of."""
        parts = []
        for loop in self._called:
            code = loop._function.__code__
            parts += [foreign.stamp for foreign in loop._named if isinstance(foreign, Foreign)]
            constants = [of for of in loop._named if isinstance(of, _CONSTANTS)]
            constants = [of.tolist() if isinstance(of, np.ndarray) else of for of in constants]
            parts += [code.co_code.hex(), repr((code.co_consts, code.co_names, constants))]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()

    @cached_property
    def _is_kept(self) -> bool:
        with suppress(AttributeError):
            return bool(self._compiled._cache._cache_file._load_index())
        return False

    @cached_property
    def _compiled(self) -> Any:
        try:
            import numba
        except ImportError:
            return self._function
        if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
            return self._function
        _listen()
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
                kept._cache._cache_file._source_stamp = self._stamp
            folder = Path(kept._cache.cache_path)
            beside = Path(self._function.__code__.co_filename).absolute().parent
            if folder.parent != beside and not is_own(folder):
                kept._cache.disable()
        return compiled

    @property
    def _numba_type_(self) -> Any:
        """What it is for a loop that calls it."""
        return self._compiled._numba_type_


class Foreign:
    """A function of compiled loops that is no loop: ``make`` gives what numba calls.

    It is made with the first loop that calls it.
    """

    def __init__(self, make: Any):
        self._make = make
        self.__doc__ = make.__doc__

    def __call__(self, *arguments: Any) -> Any:
        """Nothing: Python has no code for it."""
        raise TypeError("a function of compiled loops was called by Python")

    @property
    def stamp(self) -> str:
        """What tells its code from other code."""
        codes, parts = [self._make.__code__], []
        for code in codes:
            inner = [of for of in code.co_consts if isinstance(of, CodeType)]
            plain = [of for of in code.co_consts if of not in inner]
            parts.append(repr((code.co_code.hex(), code.co_names, plain)))
            codes += inner
        return "".join(parts)

    @cached_property
    def _numba_type_(self) -> Any:
        from numba.core.registry import cpu_target

        called, typing = self._make(), cast(Any, cpu_target).typing_context
        typing.refresh()
        return typing.resolve_value_type(called)


_CONSTANTS = (int, float, complex, tuple, np.ndarray)
"""Types of what machine code has written into it."""


def _write_again(before: Any, arguments: Any) -> None:
    """Write what arrays held into them, those in tuples, too."""
    for held, argument in zip(before, arguments, strict=True):
        if isinstance(argument, np.ndarray):
            argument[...] = held
        elif isinstance(argument, tuple):
            _write_again(held, argument)


@cache
def _earlier() -> dict[str, float]:
    """Seconds that loops took as Python in processes before, by their checksum."""
    atexit.register(_tell_later)
    return _times()


def _times() -> dict[str, float]:
    with suppress(OSError, ValueError, TypeError, AttributeError):
        if is_own(folder()) and is_own_file(folder() / _TIMES):
            times = json.loads((folder() / _TIMES).read_text())
            return {stamp: float(seconds) for stamp, seconds in times.items()}
    return {}


def _tell_later() -> None:
    """Add what loops took as Python to what is kept for processes that come later."""
    times = _times()
    for loop in Loop._all:
        if loop._seconds:
            times[loop._stamp] = times.pop(loop._stamp, 0.0) + loop._seconds
    newest = dict([*times.items()][-_MOST_TIMES:])
    with suppress(OSError):
        if own_folder(folder()):
            scratch = folder() / f"{_TIMES}.{os.getpid()}"
            scratch.write_text(json.dumps(newest))
            scratch.replace(folder() / _TIMES)


_TELLERS: list[Callable[[], None]] = []
"""What is called in front of a loop that is compiled."""


@contextmanager
def told_of_compiling(tell: Callable[[], None]) -> Iterator[None]:
    """A context that calls ``tell`` once in front of the first loop that it has to compile."""
    first = cache(tell)
    _TELLERS.append(first)
    try:
        yield
    finally:
        _TELLERS.remove(first)


@cache
def _listen() -> None:
    """Call tellers whenever a loop is compiled; not before, as numba takes long to import."""
    from numba.core import event

    class Listener(event.Listener):
        def on_start(self, event: Any) -> None:
            if event.data["dispatcher"].py_func in {loop._function for loop in Loop._all}:
                for tell in tuple(_TELLERS):
                    tell()

        def on_end(self, event: Any) -> None:
            """Nothing is to be said."""

    event.register("numba:compile", Listener())
