"""Loops say when they are compiled: once, and not where machine code is kept already."""

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
sh.frf(sh.HarmonicBalance(blade, sh.PointForce(amplitude=100.0)), (10, 12), progress={progress})
"""
LINE = "symhbm: compiling loops, once after installing"


def doubled():
    """A loop that no file holds, so that nothing is kept of it."""
    names: dict = {}
    exec("def outer(x): return inner(x) + inner(x)\ndef inner(x): return x", names)
    names["inner"] = Loop(names["inner"])
    return Loop(names["outer"])


def test_compiling_is_told_once():
    told = []
    loop = doubled()
    with told_of_compiling(lambda: told.append(True)):
        assert loop(2.0) == 4.0
        assert loop(3) == 6
    assert told == [True]
    with told_of_compiling(lambda: told.append(True)):
        assert loop(2.5) == 5.0
    assert told == [True]


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
