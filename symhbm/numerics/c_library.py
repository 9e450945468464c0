"""Machine code of CasADi functions, by a compiler of C.

The library of some functions is a file of the user's cache, called by a checksum of what it is made
of and one of its own bytes: a file that is damaged, that somebody else may write or replace, or
that is a symbolic link, is never loaded. Files come to be under another name and are then renamed,
so that processes may write the same one at once. Those that nobody used for long are removed.
"""

import hashlib
import os
import platform
import shutil
import subprocess
import time
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import casadi as ca

from symhbm.numerics.machine_code import CACHE, folder, is_own, is_own_file, own_folder

COMPILER = "SYMHBM_C_COMPILER"
"""Environment variable that names the compiler of C; empty for none."""
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
    functions: Sequence[ca.Function], make: bool = True, announce: Callable[[], None] = lambda: None
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
