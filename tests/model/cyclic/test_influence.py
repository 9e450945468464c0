"""Aerodynamic forces between blades: waves of a sector against the ring of all of them."""

import numpy as np
import pytest
from sectors_to_reduce import plate_sector

import symhbm as sh
from tests.refusals import refused

N, ORDER, FREQUENCY = 8, 3, 30.0
COEFFICIENTS = {-1: 60 + 300j, 0: -100 + 500j, 1: 30 - 250j, 2: 10 + 20j}
MASS, DAMPING = np.diag([1.0, 0.5, 0]), np.diag([3.0, 2.0, 0])
STIFFNESS = np.array([[9e4, -2e4, -3e4], [-2e4, 6e4, 0], [-3e4, 0, 3e4]])
SHAPE = {1: 1.0, 0: 0.3}
SLIDER = dict(contact_stiffness=2e4, friction_coefficient=0.5, normal_load=1.0)


def disk() -> sh.Sector:
    """Sectors of two masses, the second of which rubs on that of the next sector."""
    slider = sh.Friction(tangential=(1, sh.next_sector(1)), **SLIDER)
    sector = sh.Sector(sh.Model(MASS, DAMPING, STIFFNESS), [0], [2], N)
    return sector.with_contacts(shroud=slider)


def ring() -> sh.HarmonicBalance:
    """All sectors, with the same forces between them."""
    following = np.roll(np.arange(N), -1)
    join = np.zeros((N, 3, 2 * N))
    for j in range(N):
        join[j, 0, 2 * j] = join[j, 1, 2 * j + 1] = join[j, 2, 2 * following[j]] = 1
    mass, damping, stiffness = (
        sum(each.T @ matrix @ each for each in join) for matrix in (MASS, DAMPING, STIFFNESS)
    )
    along = np.zeros((N, 2 * N))
    for j in range(N):
        along[j, [2 * j, 2 * j + 1]] = SHAPE[0], SHAPE[1]
    for distance, value in COEFFICIENTS.items():
        ahead = along[(np.arange(N) + distance) % N]
        stiffness = stiffness + value.real * along.T @ ahead
        damping = damping + value.imag / (2 * np.pi * FREQUENCY) * along.T @ ahead
    sliders = sh.Friction(
        tangential=[(2 * j + 1, 2 * k + 1) for j, k in enumerate(following.tolist())], **SLIDER
    )
    model = sh.Model(mass, damping, stiffness, contacts={"shroud": sliders})
    pattern = np.kron(np.exp(-2j * np.pi * ORDER * np.arange(N) / N), [0.2, 1.0])
    wave = sh.forces.HarmonicForce(cosine={1: pattern.real}, sine={1: -pattern.imag})
    return sh.HarmonicBalance(model, wave, (1, 3))


@pytest.mark.filterwarnings("ignore:is this what was meant")
def test_waves_are_those_of_the_ring():
    """Of the one of all sectors by hand, and of the one that the sector makes."""
    moved = disk().with_influences(sh.Influence(SHAPE, COEFFICIENTS, FREQUENCY))
    force = sh.forces.EngineOrder(ORDER, pattern={0: 0.2, 1: 1.0})
    wave = sh.HarmonicBalance(moved, force, (1, 3))
    tuned = sh.HarmonicBalance(sh.mistuned_ring(moved), force, (1, 3))
    whole = ring()
    for frequency in (40.0, 52.0, 60.0):
        one, every, other = (sh.solve(each, frequency) for each in (wave, tuned, whole))
        np.testing.assert_allclose(every.coefficient, other.coefficient, rtol=1e-9, atol=1e-14)
        np.testing.assert_allclose(every.coefficient[:2], one.coefficient, rtol=1e-9, atol=1e-14)
    without = sh.solve(sh.HarmonicBalance(disk(), force, (1, 3)), frequency)
    assert abs(without.coefficient.values - one.coefficient.values).max() > 1e-6


def test_coefficients_of_waves_are_those_of_distances():
    waves = [
        sum(value * np.exp(-2j * np.pi * k * n / N) for k, value in COEFFICIENTS.items())
        for n in range(N)
    ]
    by_wave = sh.Influence.by_nodal_diameter(SHAPE, waves, FREQUENCY)
    by_distance = sh.Influence(SHAPE, COEFFICIENTS, FREQUENCY)
    for n in range(N):
        first, second = (
            disk().with_influences(each).matrices(n) for each in (by_wave, by_distance)
        )
        for one, other in zip(first, second, strict=True):
            np.testing.assert_allclose(one.toarray(), other.toarray(), rtol=1e-11, atol=1e-9)
        # At their frequency they are what was given.
        added = second.stiffness_matrix - disk().matrices(n).stiffness_matrix
        damped = second.damping_matrix - disk().matrices(n).damping_matrix
        whole = (added + 2j * np.pi * FREQUENCY * damped).toarray()
        assert whole[1, 1] == pytest.approx(waves[n])


def moved_by(*arguments):
    return disk().with_influences(sh.Influence(*arguments))


def by_waves(count):
    influence = sh.Influence.by_nodal_diameter(SHAPE, np.ones(count), FREQUENCY)
    return disk().with_influences(influence)


test_what_is_no_influence_is_refused = refused([
    (lambda: moved_by({}, {0: 1.0}, 30), ValueError, "shape={}"),
    (lambda: moved_by({0: 1.0}, {}, 30), TypeError, "coefficients={}"),
    (lambda: moved_by({0: 1.0}, {0: "much"}, 30), TypeError, "complex numbers"),
    (lambda: moved_by({0: 1.0}, {0: np.nan}, 30), ValueError, "finite"),
    (lambda: moved_by({0: 1.0}, {0.5: 1.0}, 30), ValueError, "distance"),
    (lambda: moved_by({0: 1.0}, {0: 1.0}, 0), ValueError, "frequency=0"),
    (lambda: moved_by(np.ones(4), {0: 1.0}, 30), ValueError, "shape"),
    # Short and long ones, of zeros as well, are of another sector.
    *((lambda shape=shape: moved_by(shape, {0: 1.0}, 30),
       ValueError, f"each of the 3 .* got {len(shape)}; {{place")
      for shape in ([1.0, 0.5], [1.0, 0.5, 0.0, 0.0], [1.0])),
    (lambda: disk().with_influences({0: 1.0}), TypeError, "influences"),
    *((lambda count=count: by_waves(count),
       ValueError, f"waves 0 to {N - 1} of {N} sectors, got {count}")
      for count in (N - 1, N + 1, 2 * N, 1)),
])  # fmt: skip


@pytest.mark.parametrize("place", [77, 16])
def test_influences_and_outputs_of_a_reduced_sector_number_places_of_the_whole(place):
    """Given before or after it was reduced."""
    whole, kept = plate_sector(6, sh.RayleighDamping(2.0, 1e-5)), [77, place]
    wind = sh.Influence({place: 1.0}, {-1: 4e3j, 0: 3e4 + 9e3j}, 20.0)
    rows = {"bending": {place: 3e9, 77: -1e9}}
    before = whole.with_influences(wind).with_outputs(rows, units="Pa")
    before = sh.craig_bampton(before, 12, (5, 40), places=kept)
    after = sh.craig_bampton(whole, 12, (5, 40), places=kept)
    after = after.with_influences(wind).with_outputs(rows, units="Pa")
    force = sh.forces.EngineOrder(2, pattern={77: 1.0}, amplitude=0.01)
    one, other = (sh.solve(sh.HarmonicBalance(each, force), 17.0) for each in (before, after))
    for name in ("coefficient", "bending_coefficient"):
        np.testing.assert_allclose(one[name], other[name], rtol=1e-12, atol=1e-20)
