"""Linear algebra on several threads gives the same digits as on one."""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import hashlib
import numpy as np
import symhbm as sh
from symhbm.response.curve import compute_curve
from symhbm.results import Request
from symhbm.results.tables import encode

disk = sh.bladed_disk(
    13, mass=1, stiffness=1e4, damping=0.5, contact_stiffness=1e6, friction_coefficient=0.5,
    normal_load=np.linspace(8, 12, 13),
)
ring = sh.HarmonicBalance(disk, sh.forces.EngineOrder(3), (1,))
order = sh.forces.EngineOrder(3)
tuned = sh.HarmonicBalance(disk.with_parameters(normal_load=10.0), order, (1, 3, 5))
turn = np.random.default_rng(0).normal(size=(30, 30))
mass = np.eye(30) + turn @ turn.T / 100
model = sh.Model(
    mass, 0.02 * mass, 1e3 * np.diag(np.arange(1.0, 31)), contacts=[(5,), (20, 21)],
    contact_stiffness=1e4, friction_coefficient=0.5, normal_load=1.0,
)
full = sh.HarmonicBalance(model, sh.forces.PointForce(5, amplitude=3.0), (1,))
cases = [(ring, (180, 220)), (ring.with_harmonics((1, 3)), (205, 208)), (tuned, (150, 280))]
cases += [(full, (8, 12)), (full.with_harmonics((1, 3)), (10, 11))]
for problem, band in cases:
    table = encode(compute_curve(problem, Request("frequency", band)))
    print(hashlib.sha256(repr(table).encode()).hexdigest())
"""


@pytest.mark.slow
def test_digits_do_not_depend_on_the_number_of_threads():
    """Of rings and of a structure with full matrices, up to some hundred unknowns."""
    digits = []
    for threads in ("1", "2"):
        environment = os.environ | {"OPENBLAS_NUM_THREADS": threads}
        command = [sys.executable, "-c", PROGRAM]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        digits.append(done.stdout.split())
    assert len(digits[0]) == 5
    assert digits[0] == digits[1]
