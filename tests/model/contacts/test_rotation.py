"""Loads of contacts that grow with the square of the speed of rotation."""

import numpy as np
import pytest

import symhbm as sh
from tests.problems import rub
from tests.refusals import refused

ORDER = 3
MATRICES = np.eye(2), np.diag([2.0, 3.0]), np.diag([1e4, 2.25e4])


def slider(load: float = 1.0, **more: float) -> sh.Contacts:
    """A contact of two masses, with or without a load by rotation."""
    return sh.Friction(tangential=(0, 1), **rub(1e4, 0.5, load), **more)


FORCE = sh.forces.HarmonicForce(cosine={1: [10, 0]}, sine={1: [0, 10]})


def problem_of(own: sh.Contacts) -> sh.HarmonicBalance:
    return sh.HarmonicBalance(sh.Model(*MATRICES, contacts={"own": own}), FORCE, (1,))


test_one_without_the_other_is_refused = refused([
    (lambda: slider(centrifugal_load=0.1), ValueError, r"centrifugal_load=0\.1, engine_order=None"),
    (lambda: slider(centrifugal_load=0.1, engine_order=0), ValueError, "engine_order=0"),
])  # fmt: skip


@pytest.mark.parametrize("force", [sh.forces.EngineOrder(2), sh.forces.EngineOrder(3, harmonic=2)])
def test_the_force_has_the_same_order(force):
    model = sh.Model(*MATRICES, contacts={"own": slider(centrifugal_load=0.1, engine_order=ORDER)})
    with pytest.raises(ValueError, match="engine_order"):
        sh.HarmonicBalance(model, force, (1, 2))
    sh.HarmonicBalance(model, sh.forces.EngineOrder(ORDER), (1,))
    sh.HarmonicBalance(model, sh.forces.EngineOrder(2 * ORDER, harmonic=2), (1, 2))


def test_results_tell_the_speed(tmp_path):
    turning = problem_of(slider(centrifugal_load=4e-3, engine_order=ORDER))
    response = sh.frf(turning, (12, 24), over={"friction_coefficient": [0.2, 0.5]}, progress=False)
    sh.save(response, tmp_path / "turning.nc")
    for dataset in (response, sh.load(tmp_path / "turning.nc"), sh.solve(turning, 15.0)):
        np.testing.assert_allclose(dataset.speed, 60 * dataset.frequency / ORDER)
        assert dataset.speed.attrs["units"] == "min-1"
        assert "speed" in dataset.coords
    np.testing.assert_allclose(response.peak_speed, 60 * response.peak_frequency / ORDER)
    still = sh.frf(problem_of(slider()), (12, 24), progress=False)
    assert "speed" not in still.coords
