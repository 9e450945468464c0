"""Structures and sectors reduced by Craig and Bampton."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

import symhbm as sh
from tests.refusals import refused
from tests.sectors_to_reduce import chain_sector, plane_sector, plate_sector

N = 120
MASS = sp.eye_array(N)
STIFFNESS = 1e4 * (2 * MASS - sp.eye_array(N, k=1) - sp.eye_array(N, k=-1))
BAND = (0.2, 2.0)
RUB = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=[0.5, 0.2])


@pytest.fixture(scope="module")
def chain():
    return sh.Model(
        MASS, 0.5 * MASS + 1e-5 * STIFFNESS, STIFFNESS, contacts=[(N - 1,), (40, 42)], **RUB,
    )  # fmt: skip


@pytest.fixture(scope="module")
def reduced(chain):
    return sh.craig_bampton(chain, 30, BAND, places=[60])


def test_the_certificate_falls_with_modes_and_holds_elsewhere(chain):
    made = [sh.craig_bampton(chain, modes, BAND, places=[60]) for modes in (10, 30, 60)]
    errors = [small.certificate.error for small in made]
    assert errors[0] > 3 * errors[1] > 9 * errors[2]
    for small in made:
        for frequency in np.linspace(0.3, 1.9, 7):
            s = 2 * np.pi * frequency
            places = [40, 42, 60, N - 1]
            whole = np.linalg.inv(chain.dynamic_stiffness(1, s)[0])[np.ix_(places, places)]
            own = np.linalg.inv(small.dynamic_stiffness(1, s)[0])[:4, :4]
            assert small.dofs[:4].tolist() == places
            difference = np.linalg.norm(own - whole, axis=0) / np.linalg.norm(whole, axis=0)
            assert difference.max() < 1.2 * small.certificate.error


def test_coordinates_are_displacements_of_places(reduced):
    assert_allclose(reduced.basis[reduced.dofs], np.eye(reduced.n_dof), atol=1e-12)
    motion = np.random.default_rng(0).normal(size=reduced.n_dof)
    whole = reduced.expanded(motion)
    assert_allclose(whole[reduced.dofs], motion, atol=1e-12)


@pytest.mark.parametrize("interface_modes", [None, 3])
def test_a_sector_converges_to_its_waves(interface_modes):
    disk = plate_sector(8)
    coarse, fine = (
        sh.craig_bampton(disk, modes, (1, 40), places=[76], interface_modes=interface_modes)
        for modes in (8, 30)
    )
    errors = [part.structure.certificate.error for part in (coarse, fine)]
    assert errors[1] < 0.3 * errors[0]
    assert errors[1] < 0.05
    for wave in (0, 2, 4):
        exact, found = (sh.natural_modes(m, wave, count=4).frequency for m in (disk, fine))
        assert_allclose(found, exact, rtol=1e-3)


def test_interfaces_turn_with_the_axes():
    disk = plane_sector(6)
    small = sh.craig_bampton(disk, 4, (1, 400), places=["4:x", "4:y"])
    assert small.structure.certificate.error < 1e-8
    force = sh.forces.EngineOrder(1, pattern={"4:x": 1.0, "4:y": 0.5j}, amplitude=10.0)
    exact, found = (sh.solve(sh.HarmonicBalance(m, force, (1, 3)), 60.0) for m in (disk, small))
    order = np.searchsorted(exact.structure_dof, found.structure_dof)
    scale = np.abs(exact.coefficient).max()
    assert_allclose(found.coefficient, exact.coefficient.values[order], atol=1e-8 * scale)


def reduced_by(**changes):
    model = sh.Model(MASS, 0.5 * MASS, STIFFNESS, contacts=[(N - 1,), (40, 42)], **RUB)
    given = dict(structure=model, modes=5, frequency_band=BAND, places=[60])
    return sh.craig_bampton(**given | changes)


def still(**changes):
    return sh.craig_bampton(chain_sector(6).with_contacts(), 2, (1, 40), **changes)


FREE = sh.Model(np.eye(3), np.zeros((3, 3)), np.diag([1.0, 1.0, 0.0]))
test_bad_input_is_refused = refused([
    (lambda: reduced_by(modes=-1), ValueError, "modes"),
    (lambda: reduced_by(modes=N), ValueError, f"at most {N - 4}"),
    (lambda: reduced_by(frequency_band=(1.0, 1.0)), ValueError, "two different values"),
    (lambda: reduced_by(interface_modes=3), ValueError, "only a sector has any"),
    (lambda: reduced_by(blade=[3]), ValueError, "only a sector has one"),
    (lambda: reduced_by(places="tip"), TypeError, "places"),
    (lambda: reduced_by(places=[N]), ValueError, "places"),
    (lambda: reduced_by(structure=3), TypeError, "a Model or a Sector"),
    (still, ValueError, r"places=\(\): expected at least one .* without contacts"),
    (lambda: still(places=[0], interface_modes=1),
     ValueError, r"interface_modes=1: .* places= keep all of the"),
    (lambda: sh.craig_bampton(FREE, 1, (1, 2), places=[0]), ValueError, "moves freely"),
])  # fmt: skip


def test_a_sector_without_contacts_is_reduced():
    assert still(places=[0]).structure.certificate.error < 1


@pytest.mark.parametrize("reduce", [sh.craig_bampton, sh.condense])
def test_what_is_reduced_is_not_reduced_again(chain, reduce):
    """A number would be one of the whole structure, or one of its modes."""
    small = sh.craig_bampton(chain, 4, (0.5, 3), places=[9])
    sector = sh.craig_bampton(plate_sector(4, sh.RayleighDamping(2.0, 1e-5)), 4, (5, 40))
    for given, force in (
        (small, sh.forces.PointForce(place=9)),
        (sector, sh.forces.EngineOrder(1)),
    ):
        arguments = (4, (1, 2)) if reduce is sh.craig_bampton else (force, (1, 2))
        with pytest.raises(ValueError, match="expected a whole structure, this one is reduced"):
            reduce(given, *arguments, places=[9])


def test_all_waves_with_modes_in_the_band_are_compared():
    """Those of 7 and 8 nodal diameters alone are in it, and the error is theirs."""
    whole, band = chain_sector(24), (41.0, 43.5)
    small = sh.craig_bampton(whole, 2, band)
    certificate = small.structure.certificate
    assert {7, 8} < {*certificate.nodal_diameters}
    modes = [sh.natural_modes(disk, count=2).frequency.values for disk in (whole, small)]
    inside = (modes[0] > band[0]) & (modes[0] < band[1])
    assert inside.any(axis=1).nonzero()[0].tolist() == [7, 8]
    difference = np.abs(modes[1] / modes[0] - 1)[inside].max()
    assert certificate.frequency_error >= 0.999 * difference > 0


def test_natural_frequencies_that_a_reduction_moves_out_of_the_band_count():
    whole = chain_sector(24)
    natural = sh.natural_modes(whole, 7, count=2).frequency.values[1]
    band = (0.9999 * natural, 1.00001 * natural)
    small = sh.craig_bampton(whole, 1, band)
    shifted = sh.natural_modes(small, 7, count=2).frequency.values[1]
    assert shifted > band[1]
    assert small.structure.certificate.frequency_error >= 0.999 * (shifted / natural - 1)


def test_a_band_without_modes_has_no_error_of_frequencies():
    certificate = sh.craig_bampton(chain_sector(24), 2, (64.0, 70.0)).structure.certificate
    assert np.isnan(certificate.frequency_error)
    assert "without natural frequencies from 64 to 70 Hz" in repr(certificate)
