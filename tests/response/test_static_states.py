"""States of rest under static loads."""

import numpy as np
import pytest

import symhbm as sh


def rest(model, load, **options):
    problem = sh.HarmonicBalance(model, sh.forces.PointForce() + sh.forces.StaticLoad(load))
    return sh.static_states(problem, **options)


def test_a_blade_pressed_against_a_stop():
    stop = sh.Gap(normal=(0,), normal_stiffness=2e4, gap=1e-3)
    blade = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"stop": stop})
    found = rest(blade, [40.0])
    # 1e4 x + 2e4 (x - 1e-3) = 40
    np.testing.assert_allclose(found.static_displacement, [[0.002]], rtol=1e-12)
    np.testing.assert_allclose(found.mean_normal_force, [[20.0]], rtol=1e-12)
    assert found.contact_state.values.tolist() == [[0]]
    assert found.stability.values.tolist() == [1]
    away = rest(blade, [-40.0])
    np.testing.assert_allclose(away.static_displacement, [[-0.004]], rtol=1e-12)
    assert away.contact_state.values.tolist() == [[3]]


def test_a_spring_that_buckles_has_three_states():
    snap = sh.laws.SmoothLaw(
        lambda y, v, p: p["k"] * (y**3 - y), parameters={"k": (1.0, "N/m^3")}, directions=[(0,)]
    )
    model = sh.Model([[1.0]], [[0.1]], [[0.5]], contacts={"snap": snap})
    found = sh.static_states(sh.HarmonicBalance(model, sh.forces.PointForce(), (0, 1)))
    # 0.5 x + x^3 - x = 0
    expected = [-np.sqrt(0.5), 0, np.sqrt(0.5)]
    np.testing.assert_allclose(
        np.sort(found.static_displacement.values.ravel()), expected, atol=1e-9
    )
    assert found.stability.values.tolist() == [1, 1, 0]


def test_a_body_that_nothing_holds_is_told():
    stop = sh.Gap(normal=(0,), normal_stiffness=2e4, gap=1e-3)
    model = sh.Model(np.eye(2), np.eye(2), np.zeros((2, 2)), contacts={"stop": stop})
    found = rest(model, [1.0, 0.0])
    assert found.status.item() == sh.Status.NOT_HELD
    assert found.sizes["solution"] == 0
    with pytest.raises(sh.SolveError, match="moves freely"):
        rest(model, [1.0, 0.0], throw=True)


def test_the_mean_of_a_small_vibration_is_a_state_of_rest():
    stop = sh.Gap(normal=(0,), normal_stiffness=2e4, gap=1e-3)
    blade = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"stop": stop})
    force = sh.forces.PointForce(amplitude=1e-3) + sh.forces.StaticLoad([40.0])
    problem = sh.HarmonicBalance(blade, force)
    mean = sh.solve(problem, 10.0).coefficient.sel(harmonic=0, component="cos")
    expected = sh.static_states(problem).static_displacement.values[0]
    np.testing.assert_allclose(mean.values, expected, rtol=1e-9)
