"""The compiled loop that this library is compared with finds the same responses."""

import numpy as np
import pytest

import symhbm as sh
from tests.benchmarks import problems

SAMPLES = 2080


@pytest.mark.slow  # numba compiles for some 20 s
@pytest.mark.parametrize(
    ("problem", "band"),
    [
        (problems.blade(3), problems.BLADE_BAND),
        (problems.ring((1, 3), 100), problems.RING_BAND),
    ],
    ids=["blade", "ring"],
)
def test_compiled_loop_agrees(problem, band):
    pytest.importorskip("numba", reason="numba, which compiles the loop, is not installed")
    from tests.benchmarks import aft, arclength

    found = arclength.response(aft.system_of(problem, SAMPLES), band)
    assert found.complete
    at = sh.frf(problem, band, at=found.frequency, progress=False)
    # Sampling moves each switching angle by up to a step; the force, quadratic there, by its square
    # over the period: the tolerance is ten times that.
    tolerance = 10 * (2 * np.pi / SAMPLES) ** 2
    error = np.abs(at.amplitude.transpose("frequency", "dof").values - found.amplitude)
    assert error.max() < tolerance * float(at.amplitude.max())
    peak = sh.frf(problem, band, progress=False)
    assert found.peak_amplitude == pytest.approx(float(peak.peak_amplitude.max()), rel=tolerance)
