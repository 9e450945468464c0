"""Machine code of CasADi functions, kept between processes."""

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import casadi as ca
import pytest

from symhbm.numerics import c_library
from symhbm.numerics.c_library import to_machine_code

needs_compiler = pytest.mark.skipif(c_library.compiler() is None, reason="no compiler of C")


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty folder of compiled functions."""
    monkeypatch.setenv(c_library.CACHE, str(tmp_path / "cache"))
    return tmp_path / "cache"


def power(exponent):
    x = ca.SX.sym("x")
    return ca.Function(f"power_{exponent}", [x], [x**exponent])


@needs_compiler
def test_a_damaged_or_foreign_library_is_not_loaded(cache):
    function = power(2)
    assert to_machine_code([function], make=False) is None
    assert to_machine_code([function]) is not None
    [library] = cache.glob("*.so")
    intact = library.read_bytes()

    library.write_bytes(intact[: len(intact) // 2])
    assert to_machine_code([function], make=False) is None
    assert not library.exists()  # removed, and made anew
    assert to_machine_code([function]) is not None

    [library] = cache.glob("*.so")
    library.chmod(0o777)  # somebody else may have written it
    assert to_machine_code([function], make=False) is None
    library.chmod(0o700)
    assert to_machine_code([function], make=False) is not None
    for folder in (cache, cache.parent):
        folder.chmod(0o777)
        assert to_machine_code([function], make=False) is None
        with pytest.warns(RuntimeWarning, match="others may write the folder"):
            assert to_machine_code([function]) is None
        folder.chmod(0o700)
    assert to_machine_code([function], make=False) is not None


@needs_compiler
def test_a_symbolic_link_is_not_loaded_but_replaced(cache, tmp_path):
    function = power(2)
    to_machine_code([function])
    [library] = cache.glob("*.so")
    elsewhere = library.replace(tmp_path / "elsewhere.so")
    library.symlink_to(elsewhere)
    (cache / f"{'0' * 32}-{'0' * 32}.so").symlink_to(tmp_path / "nothing")
    assert to_machine_code([function], make=False) is None
    assert to_machine_code([function]) is not None
    assert not library.is_symlink()
    assert elsewhere.exists()


@needs_compiler
def test_files_unused_for_long_are_removed(cache, monkeypatch):
    functions = [power(n) for n in range(2, 5)]
    for function in functions[:2]:
        to_machine_code([function])
    first, second = sorted(cache.glob("*.so"))
    os.utime(first, (0, 0))
    to_machine_code(functions[2:])
    assert not first.exists()
    assert second.exists()
    monkeypatch.setattr(c_library, "_LARGEST_CACHE", 0)
    to_machine_code([power(5)])
    assert len([*cache.glob("*.so")]) == 1
    assert not [*cache.glob("tmp*")]


@pytest.mark.slow
@needs_compiler
def test_processes_compile_the_same_at_once(cache):
    """One file comes of it, and each of them has the function."""
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        values = [*pool.map(_compiled_square, range(2))]
    assert values == [0.0, 1.0]
    assert len([*cache.glob("*.so")]) == 1


def _compiled_square(value):
    [function] = to_machine_code([power(2)])
    return float(function(value))


def test_a_compiler_that_fails_is_none(cache, monkeypatch):
    monkeypatch.setenv(c_library.COMPILER, "false")
    assert to_machine_code([power(2)]) is None
    monkeypatch.setenv(c_library.COMPILER, "")
    assert to_machine_code([power(2)]) is None
