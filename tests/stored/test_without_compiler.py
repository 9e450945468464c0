"""Where numba compiles nothing the loops run as Python, to the same results."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.stored.problems import KINDS, case
from tests.stored.results import Name, found, read

ROOT = Path(__file__).parent.parent.parent
NEAR = 1e-12
FEW: list[Name] = [("mistuned rings", 2), ("several harmonics", 3), ("contacts that open", 1)]
MANY: list[Name] = [(kind, number) for kind in KINDS for number in range(3)]
MANY += [("contacts that open", 3), ("contacts that open", 4)]
"""Friction under a varying load, stops and friction in a plane among them."""
AS_PYTHON = """
import sys
from pathlib import Path
from types import FunctionType
from symhbm.numerics.loops import series
from tests.stored.results import write
assert isinstance(series.at._compiled, FunctionType)
write(Path(sys.argv[1]), {names})
"""


@pytest.mark.slow
@pytest.mark.parametrize("names", [FEW, MANY], ids=len)
def test_results_are_those_of_compiled_loops(names, tmp_path):
    file = tmp_path / "found.npz"
    given = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-c", AS_PYTHON.format(names=names), file]
    subprocess.run(command, check=True, cwd=ROOT, env=given)
    for name, other in read(file).items():
        compiled, _ = found(case(*name))
        for field, expected in vars(compiled).items():
            values = getattr(other, field)
            if expected.dtype.kind == "f":
                np.testing.assert_allclose(values, expected, rtol=NEAR, err_msg=f"{name} {field}")
            else:
                assert values.tolist() == expected.tolist(), (name, field)
