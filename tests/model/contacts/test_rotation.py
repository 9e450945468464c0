"""Loads of contacts that grow with the square of the speed of rotation."""

from functools import partial

import numpy as np
import pytest

import symhbm as sh
from tests.problems import rub
from tests.refusals import refused

ORDER = 3
MATRICES = np.eye(2), np.diag([2.0, 3.0]), np.diag([1e4, 2.25e4])


def group(kind: str, load: float = 1.0, **more: float) -> sh.Contacts:
    """A contact whose load motion moves or leaves, with or without one by rotation."""
    if kind == "stop":
        return sh.Gap(normal=(1,), normal_stiffness=1e4, normal_load=load, **more)
    where = {
        "varying": dict(tangential=(0,), normal=(1,), normal_stiffness=1e4),
        "line": dict(tangential=(0, 1)),
        "plane": dict(tangential=(0,), across=(1,)),
    }
    return sh.Friction(**where[kind], **rub(1e4, 0.5, load), **more)


slider = partial(group, "line")
EACH = ["varying", "line", "plane", "stop"]
FORCE = sh.forces.HarmonicForce(cosine={1: [10, 0]}, sine={1: [0, 10]})


def problem_of(own: sh.Contacts, harmonics=(0, 1, 2, 3)) -> sh.HarmonicBalance:
    return sh.HarmonicBalance(sh.Model(*MATRICES, contacts={"own": own}), FORCE, harmonics)


@pytest.mark.parametrize("kind", EACH)
def test_slopes_by_the_frequency_and_the_load_are_differences(kind):
    given, omega = problem_of(group(kind, centrifugal_load=4e-3, engine_order=ORDER)), 110.0
    at = 1e-3 * np.random.default_rng(4).normal(size=given.n_unknowns)

    def residual(omega, load=4e-3):
        return given.with_parameters(centrifugal_load=load).evaluate(at, omega).residual

    found = given.evaluate(at, omega)
    by_speed = (residual(omega + 1e-3) - residual(omega - 1e-3)) / 2e-3
    np.testing.assert_allclose(found.by_parameter, by_speed, rtol=1e-5, atol=1e-7)
    slope = given.derivative("centrifugal_load")(**given.arguments(at, omega))["jacobian"]
    by_load = (residual(omega, 4e-3 + 1e-7) - residual(omega, 4e-3 - 1e-7)) / 2e-7
    np.testing.assert_allclose(slope.full()[:, 0], by_load, rtol=1e-5, atol=1e-5)
    assert np.abs(by_load).max() > 1


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
    turning = problem_of(slider(centrifugal_load=4e-3, engine_order=ORDER), (1,))
    response = sh.frf(turning, (12, 24), over={"friction_coefficient": [0.2, 0.5]}, progress=False)
    sh.save(response, tmp_path / "turning.nc")
    for dataset in (response, sh.load(tmp_path / "turning.nc"), sh.solve(turning, 15.0)):
        np.testing.assert_allclose(dataset.speed, 60 * dataset.frequency / ORDER)
        assert dataset.speed.attrs["units"] == "min-1"
        assert "speed" in dataset.coords
    np.testing.assert_allclose(response.peak_speed, 60 * response.peak_frequency / ORDER)
    still = sh.frf(problem_of(slider(), (1,)), (12, 24), progress=False)
    assert "speed" not in still.coords
