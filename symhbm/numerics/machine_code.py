"""Machine code that is kept: of loops by numba, of CasADi functions by a compiler of C.

Code in files is run where they are of this user alone. Who may write a folder may put something
else in the place of what it holds, so that all folders on the way count, and those that symbolic
links lead through. The administrator may write anywhere, and so may the group that many systems
make for each user alone.

A plain loop is compiled at its first call; without numba the same lines run as Python. numba is
imported with the first call of a loop, so that importing symhbm stays light; it does nothing where
``NUMBA_DISABLE_JIT`` is set. The code of loops is kept beside the sources, where who may write it
may write these, or in a folder of the user alone: a loop may call others, so that each is kept for
the sources of all.

The library of some functions of CasADi is a file of the user's cache, called by a checksum of what
it is made of and one of its own bytes: a file that is damaged, that somebody else may write or
replace, or that is a symbolic link, is never loaded. Files come to be under another name and are
then renamed, so that processes may write the same one at once. Those that nobody used for long are
removed.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import stat
import subprocess
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache, cached_property, lru_cache, update_wrapper
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

import casadi as ca


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


COMPILER = "SYMHBM_C_COMPILER"
"""Environment variable that names the compiler of C; empty for none."""
CACHE = "SYMHBM_CACHE"
"""Environment variable that names the folder of compiled functions."""
_COMPILERS = ("cc", "gcc", "clang")
_FLAGS = ("-O1", "-ffp-contract=off", "-fPIC", "-shared")
"""Every operation rounded by itself, as in CasADi's virtual machine: the same bits."""
_MOST_INSTRUCTIONS = 50_000
"""Length of a function that is compiled within seconds."""
_UNUSED = 30 * 86400.0
"""Seconds after which a file that nobody used is removed."""
_LARGEST_CACHE = 500_000_000
"""Bytes of all files, above which those used longest ago are removed."""


def compiler() -> str | None:
    """Path of the compiler of C, None where there is none."""
    chosen = os.environ.get(COMPILER)
    names = _COMPILERS if chosen is None else (chosen,)
    return next(filter(None, map(shutil.which, filter(None, names))), None)


def to_machine_code(
    functions: Sequence[ca.Function],
    make: bool = True,
    announce: Callable[[], None] = lambda: None,
) -> tuple[ca.Function, ...] | None:
    """The same functions as machine code; None without a compiler, or for what is too long.

    Without ``make``, only what was compiled before, by this process or another. ``announce`` is
    called before the compiler is.
    """
    path = compiler()
    if path is None or any(map(_is_long, functions)):
        return None
    try:
        key = _key(functions, path)
        library = _found(key)
        if library is None and make:
            announce()
            library = _made(key, functions, path)
        if library is None:
            return None
        return tuple(ca.external(function.name(), str(library)) for function in functions)
    except (OSError, RuntimeError, subprocess.SubprocessError):
        return None  # a compiler that fails, or a folder nothing may be run from


def folder() -> Path:
    """The folder of compiled functions, of this user alone."""
    given = os.environ.get(CACHE)
    root = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME")
    return Path(given) if given else Path(root or Path.home() / ".cache") / "symhbm"


def _is_long(function: ca.Function) -> bool:
    return function.is_a("SXFunction") and function.n_instructions() > _MOST_INSTRUCTIONS


def _key(functions: Sequence[ca.Function], path: str) -> str:
    """Checksum of functions, compiler and machine."""
    parts = [ca.CasadiMeta.version(), platform.machine(), platform.system(), *_FLAGS]
    parts += [_version(path), *(function.serialize() for function in functions)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]


@lru_cache
def _version(path: str) -> str:
    told = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=10)
    return f"{path} {told.stdout}"


def _found(key: str) -> Path | None:
    """The library of a key; one that is damaged is removed."""
    target = folder()
    if not is_own(target):
        return None
    for library in target.glob(f"{key}-*.so"):
        if not is_own_file(library):
            continue
        if library.stem == f"{key}-{_checksum(library)}":
            with suppress(OSError):
                os.utime(library)
            return library
        library.unlink(missing_ok=True)
    return None


def _made(key: str, functions: Sequence[ca.Function], path: str) -> Path | None:
    """The library of functions, compiled; None where the cache is not this user's alone."""
    target = folder()
    if not own_folder(target):
        warnings.warn(
            f"nothing is compiled: others may write the folder {target} or one above it; take "
            f"that right from them, or name a folder of your own in {CACHE}",
            RuntimeWarning,
            stacklevel=2,
        )
        return None
    _clean(target)
    generator = ca.CodeGenerator("functions.c")
    for function in functions:
        generator.add(function)
    with TemporaryDirectory(dir=target) as scratch:
        source, compiled = Path(scratch) / "functions.c", Path(scratch) / "functions.so"
        source.write_text(generator.dump())
        command = [path, *_FLAGS, str(source), "-o", str(compiled), "-lm"]
        subprocess.run(command, capture_output=True, check=True)
        library = target / f"{key}-{_checksum(compiled)}.so"
        compiled.chmod(0o700)
        return compiled.replace(library)


def _checksum(library: Path) -> str:
    return hashlib.sha256(library.read_bytes()).hexdigest()[:32]


def _clean(target: Path) -> None:
    """Remove files that nobody used for long, and those used longest ago where there are many."""
    kept = 0
    libraries = [(each.lstat(), each) for each in target.glob("*-*.so")]
    for status, library in sorted(libraries, key=lambda pair: pair[0].st_mtime, reverse=True):
        kept += status.st_size
        if time.time() - status.st_mtime > _UNUSED or kept > _LARGEST_CACHE:
            library.unlink(missing_ok=True)
    for left in target.glob("tmp*"):  # of a process that was killed
        with suppress(OSError):
            if time.time() - left.lstat().st_mtime > _UNUSED:
                shutil.rmtree(left)
