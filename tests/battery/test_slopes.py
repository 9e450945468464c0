"""Slopes of problems of all kinds are differences: by unknowns, frequency and parameters."""

import numpy as np
import pytest

from tests.problems import cases, cells, problem

QUICK = [
    "planar blade base 1", "own blade point 13", "coulomb mistuned order 13",
    "pressed reduced-turning static 0123", "varying rotor base 0123", "stop air order 0123",
    "cubic condensed static 0123", "planar condensed-sector order 13",
    "coupled turning order 13", "driven ring order 1",
]  # fmt: skip


@pytest.mark.parametrize("name", cases(QUICK, cells()))
def test_jacobian_is_the_slope_of_the_residual(name):
    given, omega = problem(name), 2 * np.pi * 24.0
    rng = np.random.default_rng(7)
    at = 3e-4 * rng.normal(size=given.n_unknowns)
    direction = rng.normal(size=given.n_unknowns)
    here = given.evaluate(at, omega)
    by_frequency = here.by_parameter

    def difference(along, step, turn=0.0):
        ends = (given.evaluate(at + s * along, omega + s * turn) for s in (step, -step))
        up, down = (each.residual for each in ends)
        return (up - down) / (2 * step)

    slope = here.jacobian @ direction
    np.testing.assert_allclose(
        difference(direction, 1e-9), slope, rtol=1e-4, atol=2e-5 * np.abs(slope).max()
    )
    turned = difference(np.zeros(len(at)), 1e-3, 1.0)
    np.testing.assert_allclose(
        turned, by_frequency, rtol=1e-4, atol=2e-5 * np.abs(by_frequency).max()
    )


@pytest.mark.parametrize("name", cases(QUICK, cells()))
def test_slopes_by_parameters(name):
    given, omega = problem(name), 2 * np.pi * 24.0
    rng = np.random.default_rng(8)
    at = 3e-4 * rng.normal(size=given.n_unknowns)
    inputs, level = given.arguments(at, omega), given.evaluate(at, omega).magnitude
    for parameter in given.differentiable:
        value = np.array(given.parameters[parameter], dtype=float)
        direction = rng.uniform(0.5, 1.0, value.shape)
        step = 1e-6 * (np.abs(value).max() or 1.0)
        up, down = (
            given.with_parameters(**{parameter: value + way * step * direction}) for way in (1, -1)
        )
        change = up.evaluate(at, omega).residual - down.evaluate(at, omega).residual
        slope = given.derivative(parameter)(**inputs)["jacobian"].full() @ direction.ravel()
        np.testing.assert_allclose(
            change, 2 * step * slope, rtol=1e-4, atol=1e-14 * level, err_msg=parameter
        )
