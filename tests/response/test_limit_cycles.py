"""Limit cycles: closed forms, waves and rings, exact motions and their stability, bad input."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import symhbm as sh
from tests.problems import one_blade, ring_of_blades
from tests.published import van_der_pol
from tests.reference import STATED

LIMIT, STIFFNESS = 1.5, 1e4
"""Of the contact of that blade [N, N/m]."""


def blade(damping, **values):
    return one_blade(damping=damping, **values)


def cycles(structure, *given, harmonics=(1,), **options):
    problem = sh.HarmonicBalance(structure, harmonics=harmonics)
    return sh.limit_cycles(problem, *given, **dict(progress=False) | options)


def closed_form(amplitude, limit=LIMIT):
    """Damping [N s/m] and angular frequency of the cycle of an amplitude, under one harmonic."""
    angle = np.arccos(1 - 2 * limit / (STIFFNESS * amplitude))
    omega = np.sqrt(1e4 + STIFFNESS * (angle - np.sin(2 * angle) / 2) / np.pi)
    return -4 * limit * (amplitude - limit / STIFFNESS) / (np.pi * omega * amplitude**2), omega


# One blade


@pytest.mark.parametrize(
    ("damping", "highest", "amplitudes", "frequencies"),
    [tuple(row.values()) for row in STATED["limit_cycles_of_one_blade"]],
)
def test_values_of_one_blade(damping, highest, amplitudes, frequencies):
    found = cycles(blade(damping), harmonics=range(1, highest + 1, 2))
    assert found.status == "the end of the band was reached"
    np.testing.assert_allclose(found.amplitude, amplitudes, rtol=4e-10)
    if frequencies is not None:
        np.testing.assert_allclose(2 * np.pi * found.frequency, frequencies, rtol=6e-10)
    assert found.stability.values.tolist() == [1, 0]
    assert (found.residual_norm < 1e-11).all()
    assert (found.contact_state == 1).all()


@pytest.mark.parametrize(("load", "damping"), [(0.3, -25.0), (3.0, -0.2), (30.0, -5.0)])
def test_closed_form_of_one_blade(load, damping):
    found = cycles(blade(damping, normal_load=load), amplitudes=(1e-6, 10.0))
    assert found.sizes["point"] == 2
    at = [closed_form(a, 0.5 * load) for a in found.amplitude.values]
    np.testing.assert_allclose([c for c, _ in at], damping, rtol=1e-10)
    np.testing.assert_allclose(2 * np.pi * found.frequency, [w for _, w in at], rtol=1e-11)


@pytest.mark.slow
def test_cycles_over_the_damping_meet_at_the_fold():
    found = cycles(blade(-0.5), "damping", (-30, 0), stability=True)
    assert found.status == "the end of the band was reached"
    most = minimize_scalar(lambda a: closed_form(a)[0], (2e-4, 3e-4, 5e-4), tol=1e-12)
    assert found.fold_damping.item() == pytest.approx(most.fun, rel=1e-12)
    assert found.fold_damping.item() == pytest.approx(-26.295299586, abs=5e-10)
    assert found.event_kind.values.tolist() == ["fold"]
    assert found.event_damping.item() == found.fold_damping.item()
    assert found.event_amplitude.item() == pytest.approx(most.x, rel=1e-6)
    assert found.fold_damping.units == "N s m-1"
    assert "beyond which none was found" in found.fold_damping.long_name
    assert found.amplitude[0].item() == pytest.approx(1.5e-4, rel=1e-12)
    assert found.amplitude[-1].item() == pytest.approx(1.0, rel=1e-6)
    slips = found.amplitude.values > 1.5e-4 * (1 + 1e-9)
    expected = np.array([closed_form(a)[0] for a in found.amplitude.values[slips]])
    np.testing.assert_allclose(found.damping[slips], expected, rtol=1e-10, atol=1e-12)
    # Those below the fold are stable, those above it are not.
    at = found.amplitude.values - found.event_amplitude.item()
    assert (found.stability.values[slips & (at < -1e-9)] == 1).all()
    # One harmonic does not tell which side of the exact fold a cycle next to it is on.
    assert (found.stability.values[at > 1e-9] < 1).all()
    assert (found.stability.values[at > 1e-4] == 0).all()


def test_grid_over_the_damping():
    grid = [-28.0, -26.0, -5.0, -1.0]
    found = cycles(blade(0.5), "damping", (-30, 0), grid)
    assert found.n_solutions.values.tolist() == [0, 2, 2, 2]
    for value in grid[1:]:
        low, high = found.amplitude.sel(damping=value).values
        exact = [
            brentq(lambda a, value=value: closed_form(a)[0] - value, *ends, xtol=1e-16, rtol=1e-13)
            for ends in ((1.5001e-4, 3.36808e-4), (3.36808e-4, 0.1))
        ]
        np.testing.assert_allclose([low, high], exact, rtol=1e-8)
    assert np.isnan(found.amplitude.sel(damping=-28.0)).all()
    assert "stability" not in found.variables


def test_motions_without_damping_are_no_cycles():
    assert cycles(blade(0.0)).sizes["point"] == 0


def test_cycles_of_other_amplitudes_are_not_looked_for():
    found = cycles(blade(-0.5), amplitudes=(1e-6, 1e-2))
    np.testing.assert_allclose(found.amplitude, [1.508422732e-4], rtol=1e-9)
    assert "modes 0, for amplitudes of 1e-06 to 0.01 m" in found.searched
    assert "not looked for" in found.searched


def test_a_force_takes_no_part():
    problem = sh.HarmonicBalance(blade(-0.5), sh.forces.PointForce())
    found = sh.limit_cycles(problem, progress=False)
    np.testing.assert_array_equal(found.amplitude, cycles(blade(-0.5)).amplitude)
    assert "oscillates" in found.force_left_out


def test_cycles_of_an_oscillator_of_van_der_pol():
    model = van_der_pol()
    over = cycles(model, "c", (-1, 1), amplitudes=(1e-2, 5), stability=True)
    np.testing.assert_allclose(over.amplitude, 2 * np.sqrt(-over.c.values), rtol=1e-9)
    assert (over.stability == 1).all()
    assert over.amplitude[0].item() == pytest.approx(1e-2, rel=1e-6)
    found = cycles(model, harmonics=range(1, 26, 2), amplitudes=(1.0, 3.0))
    told = STATED["van_der_pol"]
    assert 1 / found.frequency.item() == pytest.approx(told["period"], rel=1e-9)
    assert found.largest_displacement.item() == pytest.approx(told["amplitude"], rel=1e-8)
    assert found.growth_rate.item() == pytest.approx(-1.059376995, rel=1e-4)


# Disks


def ring_on_ground(damping, n=13):
    """Blades that rub on each other and on the ground."""
    ring = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3)
    ground = ring | dict(contact_stiffness=5e3)
    shrouds = sh.Contacts(sh.laws.Coulomb(), [(j, (j + 1) % n) for j in range(n)], **ring)
    roots = sh.Contacts(sh.laws.Coulomb(), [(j,) for j in range(n)], **ground)
    eye = np.eye(n)
    return sh.Model(eye, damping * eye, 1e4 * eye, contacts={"shrouds": shrouds, "roots": roots})


def test_waves_are_disturbed_by_all_waves():
    # All blades of a ring without contacts to the ground move together without friction.
    ring = ring_of_blades(13, damping=-2.0)
    found = cycles(ring, harmonics=(1, 3), nodal_diameter=6)
    assert found.stability.values.tolist() == [0, 0]
    np.testing.assert_allclose(found.growth_rate[0], 1.0, rtol=1e-9)
    held = cycles(ring_on_ground(-2.0), harmonics=(1, 3), nodal_diameter=0)
    assert held.stability.values[-1] == 0


# What is asked for


@pytest.mark.slow
def test_several_modes():
    matrices = np.eye(2), -2.0 * np.eye(2), np.array([[2e4, -1e4], [-1e4, 3e4]])
    values = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3)
    model = sh.Model(*matrices, contacts=[(0,), (1,)], **values)
    both = cycles(model, mode=(0, 1), place=0)
    alone = [cycles(model, mode=mode, place=0) for mode in (0, 1)]
    assert [one.sizes["point"] for one in alone] == [2, 2]
    amplitudes = np.sort(np.concatenate([one.amplitude for one in alone]))
    np.testing.assert_allclose(both.amplitude, amplitudes, rtol=1e-10)
    assert "modes 0, 1" in both.searched


def test_responses_under_negative_damping_may_be_several():
    problem = sh.HarmonicBalance(blade(-0.5), sh.forces.PointForce())
    assert not problem.single_valued
    found = sh.frf(problem, (15, 30), at=[16.0, 20.0], progress=False)
    assert "solution" in found.dims
    assert "stability" in found.variables
    positive = sh.HarmonicBalance(blade(0.5), sh.forces.PointForce())
    assert positive.single_valued
    over = sh.follow(positive, "damping", (1.0, -1.0), [0.5], frequency=20.0, progress=False)
    assert "solution" in over.dims
    coupled = sh.Model(np.eye(2), [[1.0, 2.0], [2.0, 1.0]], 1e4 * np.eye(2))
    assert not sh.HarmonicBalance(coupled, sh.forces.PointForce()).single_valued
    turns = sh.Model(np.eye(2), [[0.0, 2.0], [-2.0, 0.0]], 1e4 * np.eye(2))
    assert sh.HarmonicBalance(turns, sh.forces.PointForce()).single_valued


def test_what_takes_no_negative_damping_says_so():
    chain = sh.Model(np.eye(3), -0.1 * np.eye(3), 1e4 * np.diag([2.0, 2.0, 1.0]))
    with pytest.raises(ValueError, match="gives energy to no motion"):
        sh.condense(
            chain, sh.forces.PointForce(), frequency_band=(10, 30), places=[0], progress=False
        )
    problem = sh.HarmonicBalance(blade(0.5), sh.forces.PointForce())
    with pytest.raises(ValueError, match="values must stay >= 0"):
        sh.mistuning.uniform(problem, 5, seed=1, damping=1.5)
