"""Modes, limit cycles and flutter limits of one sector, and of the ring of all of them."""

import numpy as np
import pytest
from rings import assembled

import symhbm as sh
from tests.problems import N_SECTORS, OPENS, reduced, sector


def pairs(law, nodal_diameter, damped):
    """One sector, and the ring assembled from all, both asked for the same wave."""
    disk = sector(law, damped=damped)
    harmonics = (0, 1, 2, 3) if law in OPENS else (1, 3)
    alone = sh.HarmonicBalance(disk, None, harmonics)
    ring = sh.HarmonicBalance(assembled(disk).model, None, harmonics)
    return alone, ring, dict(nodal_diameter=nodal_diameter, place=1, progress=False)


@pytest.mark.parametrize(
    ("law", "nodal_diameter"),
    [
        ("coulomb", 1),
        *(
            pytest.param(law, k, marks=pytest.mark.slow)
            for law in ("coulomb", "varying", "planar", "own")
            for k in (-1, 0, 2)
        ),
    ],
)
def test_cycles_of_a_sector_are_those_of_its_ring(law, nodal_diameter):
    alone, ring, options = pairs(law, nodal_diameter, -0.2)
    options |= dict(amplitudes=(1e-6, 1e-2))
    one, whole = sh.limit_cycles(alone, **options), sh.limit_cycles(ring, **options)
    assert one.sizes["point"] == whole.sizes["point"]
    for name in ("frequency", "amplitude"):
        np.testing.assert_allclose(one[name], whole[name], rtol=1e-8)
    if "stability" in one and "stability" in whole:
        np.testing.assert_array_equal(one.stability, whole.stability)


@pytest.mark.parametrize(
    "law",
    ["coulomb", *(pytest.param(law, marks=pytest.mark.slow) for law in ("planar", "stop", "own"))],
)
def test_modes_of_a_sector_are_those_of_its_ring(law):
    alone, ring, options = pairs(law, 1, 1.0)
    grid = np.geomspace(1e-5, 1e-3, 4)
    options |= dict(band=(1e-6, 1e-2), at=grid)
    one, whole = sh.nonlinear_modes(alone, **options), sh.nonlinear_modes(ring, **options)
    for name in ("frequency", "damping_ratio"):
        np.testing.assert_allclose(one[name], whole[name], rtol=1e-8)
    of_all = np.sqrt(N_SECTORS) * one.modal_amplitude
    np.testing.assert_allclose(of_all, whole.modal_amplitude, rtol=1e-8)


@pytest.mark.parametrize("make", [reduced, lambda law: sh.mistuned_ring(reduced(law))])
def test_static_loads_act_on_modes_of_reduced_structures_where_they_are_given(make):
    """Loads are of places of the whole sector, which its reduced ones number in another order."""
    load = sh.forces.EngineOrder(0, pattern={1: 1.0}) + sh.forces.StaticLoad({4: 2.0, 0: 1.0})
    whole, small = sector("stop"), make("stop")
    given = dict(band=(1e-8, 1e-4), at=[1e-7], place=1, progress=False)
    wave = {} if small.nodal_diameters is None else dict(nodal_diameter=0)
    exact = sh.nonlinear_modes(sh.HarmonicBalance(whole, load, (0, 1)), nodal_diameter=0, **given)
    found = sh.nonlinear_modes(sh.HarmonicBalance(small, load, (0, 1)), **wave, **given)
    mean = [one.coefficient.sel(harmonic=0, component="cos").squeeze() for one in (exact, found)]
    np.testing.assert_allclose(mean[1][[1, 2, 3]], mean[0][[1, 2, 3]], rtol=1e-9)
    np.testing.assert_allclose(found.frequency, exact.frequency, rtol=1e-9)


@pytest.mark.parametrize(
    "law",
    ["coulomb", *(pytest.param(law, marks=pytest.mark.slow) for law in ("planar", "varying"))],
)
def test_flutter_limits_of_a_sector_are_those_of_its_ring(law):
    alone, ring, options = pairs(law, 1, 0.3)
    options |= dict(at=[1.0, 2.0], amplitudes=(1e-6, 1e-3), disturbance=3e-4)
    one, whole = (sh.flutter_limit(p, "normal_load", (0.5, 3), **options) for p in (alone, ring))
    for name in ("flutter_limit", "flutter_limit_slope", "limit_frequency"):
        np.testing.assert_allclose(one[name], whole[name], rtol=1e-8)


def test_cycle_of_opposite_neighbours_is_one_of_all_blades_alone():
    """The only wave of its frequency: a mode of the whole ring, which no wave is asked of."""
    disk = sector("coulomb", damped=-0.2)
    wave, whole = (
        sh.limit_cycles(
            sh.HarmonicBalance(model, None, (1, 3)), amplitudes=(1e-6, 1e-2), place=1,
            progress=False, **which,
        )
        for model, which in ((disk, dict(nodal_diameter=2)), (assembled(disk).model, dict(mode=4)))
    )  # fmt: skip
    assert len(wave.frequency) == 1
    for name in ("frequency", "amplitude"):
        np.testing.assert_allclose(whole[name], wave[name], rtol=1e-8)


N_BLADES, SPRINGS, LIMIT = 5, np.repeat([1e4, 5e3], 5), 1.5


def driven_ring():
    """Blades of 1 kg and 1e4 N/m that rub on each other and on the ground, driven by -2 N s/m."""
    eye, blades = np.eye(N_BLADES), range(N_BLADES)
    values = dict(friction_coefficient=0.5, normal_load=2 * LIMIT)
    shrouds = [(j, (j + 1) % N_BLADES) for j in blades]
    contacts = dict(
        shrouds=sh.Friction(tangential=shrouds, contact_stiffness=1e4, **values),
        roots=sh.Friction(tangential=[(j,) for j in blades], contact_stiffness=5e3, **values),
    )
    return sh.Model(eye, -2.0 * eye, 1e4 * eye, contacts=contacts)


def marched(states, frequency, steps=4000):
    """States (m, 20), displacements, velocities and sliders of that ring, a period later."""
    x, v, sliders = np.split(states, [N_BLADES, 2 * N_BLADES], axis=1)
    step, reach = 1 / frequency / steps, LIMIT / SPRINGS
    for _ in range(steps):
        x = x + step / 2 * v
        moved = np.hstack([x - np.roll(x, -1, axis=1), x])
        sliders = np.clip(sliders, moved - reach, moved + reach)
        shrouds, roots = np.split(SPRINGS * (moved - sliders), 2, axis=1)
        pull = 1e4 * x + roots + shrouds - np.roll(shrouds, 1, axis=1)
        v = (v * (1 + step) - step * pull) / (1 - step)
        x = x + step / 2 * v
    return np.hstack([x, v, sliders])


@pytest.mark.parametrize("wave", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in (0, 2))])
def test_growth_of_a_cycle_of_a_ring_is_that_of_all_blades_in_time(wave):
    """The march knows nothing of harmonics, events and waves; differences tell its multipliers."""
    alone = sh.HarmonicBalance(driven_ring(), harmonics=range(1, 20, 2))
    found = sh.limit_cycles(alone, nodal_diameter=wave, progress=False)
    assert found.sizes["point"] == 2
    for point in (found.isel(point=i) for i in range(2)):
        frequency, order = point.frequency.item(), point.harmonic.values
        cosine, sine = np.moveaxis(point.coefficient.values, -1, 0)
        start = np.zeros((1, 4 * N_BLADES))
        start[0, :N_BLADES] = cosine.sum(axis=1)
        start[0, N_BLADES : 2 * N_BLADES] = 2 * np.pi * frequency * sine @ order
        # A period takes sliders to where they are; those that stick have no motion of their own.
        start[:, 2 * N_BLADES :] = marched(start, frequency)[:, 2 * N_BLADES :]
        moves = np.flatnonzero((np.arange(4 * N_BLADES) < 2 * N_BLADES) | (start[0] != 0))
        size = 1e-6 * np.abs(cosine).max() * np.ones(4 * N_BLADES)
        size[N_BLADES : 2 * N_BLADES] *= 2 * np.pi * frequency
        ends = marched(np.vstack([start, start + np.diag(size)[moves]]), frequency)
        assert np.abs(ends[0] - start)[0, :N_BLADES].max() < 5e-3 * np.abs(cosine).max()
        values = np.linalg.eigvals((ends[1:] - ends[0])[:, moves] / size[moves, None])
        across = np.delete(values, np.argmin(np.abs(values - 1)))  # without a shift in time
        rate = np.log(np.abs(across).max()) * frequency
        assert point.growth_rate.item() == pytest.approx(rate, abs=1e-3)
