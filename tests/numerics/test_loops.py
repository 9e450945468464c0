"""Loops say when they are compiled: once, and not where machine code is kept already."""

import os
import subprocess
import sys

import pytest

from symhbm.numerics.loops import Loop, told_of_compiling

CURVE = """
import symhbm as sh
blade = sh.single_blade(
    mass=1, stiffness=1e4, damping=0.5, contact_stiffness=1e4, friction_coefficient=0.5,
    normal_load=3,
)
force = sh.forces.PointForce(amplitude=100.0)
sh.frf(sh.HarmonicBalance(blade, force), (10, 12), progress={progress})
"""
LINE = "symhbm: compiling loops, once after installing"


def doubled(folder):
    """A loop of a file of its own, so that nothing is kept of it."""
    source = "def outer(x): return inner(x) + inner(x)\ndef inner(x): return x"
    path = folder / "loops_of_a_test.py"
    path.write_text(source)
    names: dict = {}
    exec(compile(source, str(path), "exec"), names)
    names["inner"] = Loop(names["inner"])
    return Loop(names["outer"])


def test_compiling_is_told_once(tmp_path):
    told = []
    loop = doubled(tmp_path)
    with told_of_compiling(lambda: told.append(True)):
        assert loop(2.0) == 4.0
        assert loop(3) == 6
    assert told == [True]
    with told_of_compiling(lambda: told.append(True)):
        assert loop(2.5) == 5.0
    assert told == [True]


@pytest.mark.skipif(os.name == "nt", reason="modes of files are of other systems")
@pytest.mark.parametrize("mode", [0o700, 0o777])
def test_machine_code_is_kept_where_nobody_else_may_write(tmp_path, monkeypatch, mode):
    numba = pytest.importorskip("numba")
    kept = tmp_path / "kept"
    kept.mkdir()
    kept.chmod(mode)
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(kept))
    assert doubled(tmp_path)(2.5) == 5.0
    assert bool([*kept.rglob("*.nbc")]) == (mode == 0o700)


def test_functions_of_others_are_not_told():
    import numba

    with told_of_compiling(lambda: 1 / 0):
        assert numba.njit(lambda x: x + 1)(1) == 2


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
