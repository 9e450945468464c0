"""One sector of a structure that repeats itself tells what the whole structure does."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import symhbm as sh
from symhbm.model.sectors import find_symmetry
from tests import designs


def ring(n_blades=13, **changes):
    return designs.ring(n_blades, **{"normal_load": 100.0} | changes).model


PATTERN = dict(mass=[1, 1.1] * 6, normal_load=[20, 30] * 6)


def test_each_set_of_a_sweep_is_judged_by_itself():
    """A mistuned set needs the ring, and a pattern that repeats several blades of it."""
    problem = sh.HarmonicBalance(ring(), sh.forces.EngineOrder(3))
    loads = np.full((3, 13), 100.0)
    loads[1, 4] = 101.0
    over = {"normal_load": xr.DataArray(loads, dims=("sample", "contact"))}
    swept = sh.frf(problem, (205, 215), over=over)
    assert swept.n_sectors.values.tolist() == [13, 1, 13]
    pattern = sh.HarmonicBalance(ring(12, **PATTERN), sh.forces.EngineOrder(2))
    band, at = (130, 165), [145.0, 155.0]
    one, whole = (sh.frf(pattern.with_by_sector(s), band, at=at) for s in (True, False))
    assert (one.n_sectors, whole.n_sectors) == (6, 1)
    np.testing.assert_allclose(one.peak_amplitude, whole.peak_amplitude, rtol=1e-9)
    assert (whole.contact_state == 1).any()
    np.testing.assert_allclose(one.theta_star, whole.theta_star, rtol=1e-8)


def test_what_has_no_sectors_is_solved_whole():
    tuned, load = ring(), sh.forces.StaticLoad({0: 1.0})
    whole = [
        sh.HarmonicBalance(tuned, sh.forces.PointForce(0)),
        sh.HarmonicBalance(ring(mass=np.linspace(1, 1.1, 13)), sh.forces.EngineOrder(3)),
        sh.HarmonicBalance(tuned, sh.forces.EngineOrder(1, places=[0, 1, 3, 2, *range(4, 13)])),
        sh.HarmonicBalance(tuned, sh.forces.EngineOrder(3) + load, (0, 1)),
        designs.blade(),
    ]
    for problem in whole:
        assert find_symmetry(problem.model, problem.excitation, problem.basis) is None
    problem = sh.HarmonicBalance(tuned, sh.forces.EngineOrder(3))
    assert sh.frf(problem, (200, 205), stability=True).n_sectors == 1
    one = sh.follow(problem, "normal_load[2]", (90, 100), frequency=211.0)
    assert one.n_sectors == 1
    sampled = sh.HarmonicBalance(tuned, sh.forces.EngineOrder(3), samples=64)
    assert sh.frf(sampled, (200, 201)).n_sectors == 1


@settings(max_examples=20)
@given(
    n_sectors=st.integers(3, 9),
    order=st.integers(-20, 20),
    harmonic=st.integers(1, 3),
    seed=st.integers(0, 2**32 - 1),
)
def test_equations_of_the_sector_are_those_of_the_ring(n_sectors, order, harmonic, seed):
    """The residual of the ring at a travelling wave is a travelling wave, that of the sector."""
    force = sh.forces.EngineOrder(order, harmonic=harmonic)
    problem = sh.HarmonicBalance(ring(n_sectors), force, (0, 1, 2, 3))
    found = find_symmetry(problem.model, force, problem.basis)
    if found is None:
        # No time shift makes this wave: it has a harmonic that shares a divisor with the ring.
        assert np.gcd(harmonic, n_sectors) > 1
        return
    sector = sh.HarmonicBalance(problem.model, force, problem.harmonics, symmetry=found)
    unknowns = 1e-4 * np.random.default_rng(seed).normal(size=sector.n_unknowns)
    everywhere = sector.layout.everywhere(unknowns).ravel()
    one = sector.evaluate(unknowns, 900.0)
    ring_of_it = problem.evaluate(everywhere, 900.0)
    # Round-off of forces of up to 1e6 N/m times 1e-4 m.
    np.testing.assert_allclose(
        sector.layout.everywhere(one.residual).ravel(), ring_of_it.residual, rtol=0, atol=1e-10
    )
    direction = np.random.default_rng(seed + 1).normal(size=sector.n_unknowns)
    # The same of stiffnesses.
    np.testing.assert_allclose(
        sector.layout.everywhere(one.jacobian @ direction).ravel(),
        ring_of_it.jacobian @ sector.layout.everywhere(direction).ravel(),
        rtol=0,
        atol=1e-7,
    )


def test_a_sector_refuses_parameters_that_differ():
    problem = sh.HarmonicBalance(ring(), sh.forces.EngineOrder(3))
    found = find_symmetry(problem.model, problem.excitation, problem.basis)
    sector = sh.HarmonicBalance(problem.model, problem.excitation, (1,), symmetry=found)
    for bad in (
        {"normal_load": np.arange(13.0)},
        {"mass": np.linspace(1, 2, 13)},
        {"engine_order": 4},
    ):
        with pytest.raises(ValueError, match=next(iter(bad))):
            sector.with_parameters(**bad)
    assert sector.with_parameters(normal_load=3.0).contacts.sliders().limit == pytest.approx([1.5])
