"""Loops run as Python until machine code pays; they say once when they are compiled."""

import ast
import inspect
import os
import subprocess
import sys
import textwrap
import types
from functools import partial

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.numerics import machine_code
from symhbm.numerics.loops import Loop, told_of_compiling
from tests.problems import problem
from tests.quick import quick_first

CURVE = """
import symhbm as sh
from symhbm.numerics import machine_code
machine_code._UNTIL_READ = machine_code._UNTIL_COMPILED = 0.0  # compiled at the second call
blade = sh.single_blade(
    mass=1, stiffness=1e4, damping=0.5, contact_stiffness=1e4, friction_coefficient=0.5,
    normal_load=3,
)
force = sh.forces.PointForce(amplitude=100.0)
sh.frf(sh.HarmonicBalance(blade, force), (10, 12), progress={progress})
"""
LINE = "symhbm: compiling loops, once after installing"


SOURCE = """
def outer(x): return inner(x) + inner(x)
def inner(x): return FACTOR * x
def quotients(x, target):
    for i in range(2):
        target[i] += 1.0 / (x + i)
"""


def loops_of(folder, factor=1):
    """Loops of a file of their own, so that nothing is kept of them."""
    path = folder / f"loops_of_a_test_{np.sum(factor)}.py"
    path.write_text(SOURCE)
    names: dict = {"FACTOR": factor, "__name__": path.stem}
    exec(compile(SOURCE, str(path), "exec"), names)
    for name in ("inner", "outer", "quotients"):
        names[name] = Loop(names[name])
    return names


@pytest.fixture
def impatient(monkeypatch):
    """Loops are compiled at their second call."""
    monkeypatch.setattr(machine_code, "_UNTIL_READ", 0.0)
    monkeypatch.setattr(machine_code, "_UNTIL_COMPILED", 0.0)


@pytest.mark.usefixtures("impatient")
def test_compiling_is_told_once(tmp_path):
    told = []
    loop = loops_of(tmp_path)["outer"]
    assert loop(1.0) == 2.0
    with told_of_compiling(lambda: told.append(True)):
        assert loop(2.0) == 4.0
        assert loop(3) == 6
    assert told == [True]
    with told_of_compiling(lambda: told.append(True)):
        assert loop(2.5) == 5.0
    assert told == [True]


@pytest.mark.skipif(os.name == "nt", reason="modes of files are of other systems")
@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("mode", [0o700, 0o777])
def test_machine_code_is_kept_where_nobody_else_may_write(tmp_path, monkeypatch, mode):
    numba = pytest.importorskip("numba")
    kept = tmp_path / "kept"
    kept.mkdir()
    kept.chmod(mode)
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(kept))
    loop = loops_of(tmp_path)["outer"]
    assert loop(2.5) == loop(2.5) == 5.0
    assert bool([*kept.rglob("*.nbc")]) == (mode == 0o700)


def compiled(loop) -> bool:
    return loop._run is loop.__dict__.get("_compiled")


def test_a_loop_is_compiled_when_that_pays_in_all_processes_together(tmp_path, monkeypatch):
    monkeypatch.setenv(machine_code.CACHE, str(tmp_path))
    monkeypatch.setattr(machine_code, "_UNTIL_READ", 0.0)
    monkeypatch.setattr(machine_code, "_UNTIL_COMPILED", 1.0)  # a minute
    machine_code._earlier.cache_clear()
    first = loops_of(tmp_path)
    first["outer"](1.0)
    first["outer"](1.0)
    assert not compiled(first["outer"])
    assert len(first["outer"]._called) == 2
    first["outer"]._seconds = 0.9 * first["outer"]._patience
    machine_code._tell_later()

    machine_code._earlier.cache_clear()  # the next process
    [again, other] = [loops_of(tmp_path, factor)["outer"] for factor in (1, 2)]
    assert again._stamp == first["outer"]._stamp != other._stamp
    for loop in (again, other):
        loop._seconds = 0.2 * loop._patience
        loop(1.0)
    assert compiled(again)
    assert not compiled(other)

    (tmp_path / "loops.json").write_text('{"a": [')
    assert machine_code._times() == {}
    machine_code._earlier.cache_clear()


def test_machine_code_is_kept_by_the_constants_that_are_written_into_it(tmp_path):
    def stamp(value):
        return loops_of(tmp_path, value)["outer"]._stamp

    for one, other in ((1.0, 2.0), (np.eye(2), np.diag([1.0, 1 + 1e-15])), ((1, 2), (1, 3))):
        assert stamp(one) == stamp(one) != stamp(other)
    module = types.ModuleType("of_constants")
    names = {"of_constants": module}
    exec("def scaled(x): return of_constants.TABLE * x", names)
    stamps = set()
    for value in (3.0, 4.0, np.ones(2)):
        module.TABLE = value  # type: ignore[attr-defined]
        stamps.add(Loop(names["scaled"])._stamp)
    assert len(stamps) == 3


def test_python_gives_what_machine_code_gives_where_python_would_raise(tmp_path):
    loop = loops_of(tmp_path)["quotients"]
    target = np.array([1.0, 2.0])
    loop(-1.0, target)
    assert target.tolist() == [0.0, np.inf]
    target = np.array([1.0, 2.0])
    loop(-1.0, target)
    assert target.tolist() == [0.0, np.inf]


CELLS = quick_first(
    [
        "coulomb chain point 13",
        "varying blade static 0123",
        "planar blade point 13",
        "stop chain static 0123",
        "pressed blade static 0123",
        "planar mistuned order 13",
        "varying condensed static 0123",
        "coulomb reduced order 0123",
    ],
    2,
)


@pytest.mark.parametrize("cell", CELLS)
def test_python_and_machine_code_give_the_same_bits(cell, monkeypatch):
    pytest.importorskip("numba")
    given = problem(cell)

    def curve(run):
        for loop in Loop._all:
            monkeypatch.setattr(loop, "_run", partial(run, loop))
        with np.errstate(all="ignore"):
            return sh.frf(given, (20.0, 20.5), progress=False)

    python = curve(lambda loop, *arguments: loop._function(*arguments))
    machine = curve(lambda loop, *arguments: loop._compiled(*arguments))
    xr.testing.assert_identical(
        python.drop_attrs(), machine.drop_attrs().assign_attrs(python.drop_attrs().attrs)
    )


def test_loops_have_nothing_that_python_rounds_in_another_way():
    of_library = [one for one in Loop._all if str(one._function.__module__).startswith("symhbm.")]
    assert len(of_library) > 100
    for loop in of_library:
        source = textwrap.dedent(inspect.getsource(loop._function))
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
                assert not isinstance(node.right, ast.Constant), ast.unparse(node)
            assert ast.unparse(node) not in ("math.hypot", "math.fsum"), loop._function


def test_functions_of_others_are_not_told():
    import numba

    with told_of_compiling(lambda: 1 / 0):
        assert numba.njit(lambda x: x + 1)(1) == 2


def test_a_first_curve_imports_nothing_that_it_does_not_need():
    """Neither numba, where no loop is compiled, nor dask, which xarray looks for."""
    code = CURVE.format(progress=False).replace("= 0.0", "= float('inf')")
    code += "import sys; print({'numba', 'dask'} & {*sys.modules})"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "set()"


@pytest.mark.slow
def test_the_first_curve_after_installing_says_so(tmp_path):
    def said(progress: bool) -> str:
        code = CURVE.format(progress=progress)
        command = [sys.executable, "-c", code]
        environment = {"NUMBA_CACHE_DIR": str(tmp_path), "PATH": "", "HOME": str(tmp_path)}
        environment |= {"PYTHONPATH": ":".join(filter(None, sys.path))}
        run = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
        return run.stderr

    assert said(progress=True).count(LINE) == 1
    assert LINE not in said(progress=True)
