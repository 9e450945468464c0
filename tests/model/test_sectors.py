"""One sector of a structure that repeats itself tells what the whole structure does."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import symhbm as sh
from symhbm.model.sectors import find_symmetry
from symhbm.results.variables import SLOPES
from tests import designs

# The solver's tolerance, as asked for; most numbers agree to 1e-12.
AGREE = 1e-9
# Numbers of the path itself: scales of a residual, and effort.
OF_THE_PATH = {
    "residual_norm",
    "peak_residual_norm",
    "iterations",
    "linear_solves",
    "rejected_steps",
    "n_points",
    "n_sectors",
}


def ring(n_blades=13, **changes):
    return designs.ring(n_blades, **{"normal_load": 100.0} | changes).model


def assert_alike(sector, whole):
    """All results but those of the path's own effort agree."""
    assert sector.sizes == whole.sizes
    for name, value in sector.variables.items():
        other = whole[name]
        if value.dtype.kind not in "fib" or name in OF_THE_PATH:
            assert name in OF_THE_PATH or np.array_equal(value.values, other.values), name
            continue
        one, two = value.values.astype(float), other.values.astype(float)
        np.testing.assert_array_equal(np.isnan(one), np.isnan(two), err_msg=name)
        distance = np.abs(one - two)
        if name in ("theta_0", "theta_star"):
            distance = np.minimum(distance, 2 * np.pi - distance)
        scale = np.nanmax(np.abs(two), initial=0.0)
        if name == "dissipation":
            # That of contacts that never slip is round-off of the elastic energy.
            energy = sector.contact_stiffness.values.max() * float(sector.amplitude.max()) ** 2
            scale = max(scale, energy)
        # Slopes are those of a point within 1e-6 of the solution.
        most = 1e-5 if name in SLOPES else AGREE
        assert np.nanmax(distance, initial=0.0) <= most * (scale or 1.0), name


PATTERN = dict(mass=[1, 1.1] * 6, normal_load=[20, 30, 40] * 4)


@pytest.mark.parametrize(
    ("model", "order", "harmonics", "n_sectors"),
    [
        (ring(normal_load=40.0), 0, (1, 3), 13),
        (ring(normal_load=40.0), 3, (0, 1, 2, 3), 13),
        (ring(12, **PATTERN), 2, (1,), 2),
    ],
    ids=["standing", "travelling", "of a pattern that repeats"],
)
def test_the_sector_agrees_with_the_ring(model, order, harmonics, n_sectors):
    """Peaks, events, coefficients of every blade, states of every contact."""
    problem = sh.HarmonicBalance(model, sh.forces.EngineOrder(order), harmonics)
    stuck = np.sqrt(1e4 + 4e6 * np.sin(np.pi * order / model.n_dof) ** 2) / (2 * np.pi)
    band = 0.8 * stuck, 1.05 * stuck
    grid = np.linspace(*band, 6)
    sector, whole = (sh.frf(problem.with_by_sector(flag), band, at=grid) for flag in (True, False))
    assert (sector.n_sectors, whole.n_sectors) == (n_sectors, 1)
    assert bool(sector.converged.all())
    assert order == 0 or int(sector.n_events) > 0
    if order == 0:
        # Contacts do not move; on the ring they do, by round-off, and that has reversals.
        sector, whole = (
            each.drop_vars(["theta_0", "theta_star", "reversals"]) for each in (sector, whole)
        )
    assert_alike(sector, whole)


@pytest.mark.slow
def test_each_set_of_a_sweep_is_judged_by_itself():
    """A mistuned set needs the ring, and engine orders beside each other their own waves."""
    problem = sh.HarmonicBalance(ring(), sh.forces.EngineOrder(3))
    loads = np.full((3, 13), 100.0)
    loads[1, 4] = 101.0
    over = {"normal_load": xr.DataArray(loads, dims=("sample", "contact"))}
    swept = sh.frf(problem, (205, 215), over=over)
    assert swept.n_sectors.values.tolist() == [13, 1, 13]
    orders = sh.frf(problem, (50, 350), over={"engine_order": [1, 6]})
    for order in (1, 6):
        alone = sh.frf(
            sh.HarmonicBalance(ring(), sh.forces.EngineOrder(order)).with_by_sector(False),
            (50, 350),
        )
        peak = orders.sel(engine_order=order).peak_amplitude.values[0]
        assert peak == pytest.approx(alone.peak_amplitude.values[0], rel=AGREE)


def test_what_has_no_sectors_is_solved_whole():
    tuned = ring()
    whole = [
        sh.HarmonicBalance(tuned, sh.forces.PointForce(0)),
        sh.HarmonicBalance(ring(mass=np.linspace(1, 1.1, 13)), sh.forces.EngineOrder(3)),
        sh.HarmonicBalance(tuned, sh.forces.EngineOrder(1, places=[0, 1, 3, 2, *range(4, 13)])),
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
