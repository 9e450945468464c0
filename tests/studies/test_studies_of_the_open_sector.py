"""Studies of a disk by finite elements, against other waves, all equations and whole rings."""

import numpy as np
import pytest
from rings import assembled
from skfem import BilinearForm, asm
from skfem.helpers import dot

import symhbm as sh
from studies import open_sector_contacts as contacts
from studies import open_sector_mistuned as mistuned
from studies import open_sector_modes as modes
from studies import pareto_damper_mass as front
from studies.landmark import unmet
from studies.open_sector import DENSITY, open_sector

SMALL = (1, 3, 1, 2)


@pytest.fixture(scope="module")
def twisted():
    return open_sector(SMALL, twist=modes.TWIST)


@pytest.mark.slow
def test_stresses_that_stiffen_are_in_equilibrium_with_centrifugal_forces(twisted):
    static = twisted.static()
    by_stress, work = twisted.virials(static)
    assert np.allclose(by_stress, work, rtol=0, atol=1e-12 * work.max())
    # Mass by mass, with that of the bore, and by waves of no nodal diameters.
    mass = asm(BilinearForm(lambda u, v, _: DENSITY * dot(u, v)), twisted.basis)
    position = twisted.basis.zeros()
    for way in (0, 1):
        for dofs in (twisted.basis.nodal_dofs, twisted.basis.edge_dofs, twisted.basis.facet_dofs):
            position[dofs[way::3]] = twisted.basis.doflocs[way][dofs[way::3]]
        inner = twisted.basis.interior_dofs[way::3]
        position[inner] = twisted.basis.doflocs[way][inner]
    load = twisted.disk.interfaces.folded((mass @ position)[twisted.free], 0)
    kept = static[twisted.free][twisted.disk.kept]
    felt = twisted.disk.matrices(0).stiffness_matrix @ kept
    assert np.allclose(felt, load, rtol=0, atol=1e-9 * abs(load).max())


@pytest.mark.slow
def test_rotation_stiffens_bending_along_the_axis_and_spin_softens(twisted):
    """A matrix fitted at two speeds is that of each, and the square of frequencies is linear."""
    speeds = 3000.0, 9000.0
    squares = [
        sh.natural_modes(twisted.at(s).disk, 6, count=1).frequency.item() ** 2 for s in (0, *speeds)
    ]
    slopes = np.diff(squares) / np.diff([s**2 for s in (0, *speeds)])
    assert slopes[0] > 0
    assert slopes[1] == pytest.approx(slopes[0], rel=1e-3)
    added = twisted.stiffening(twisted.static())
    unloaded = twisted.stiffening(0 * twisted.static())
    along = np.zeros(twisted.n_all)
    along[twisted.free] = twisted.structure.places.direction == "z"
    assert abs(unloaded @ along).max() == 0  # spin does not soften what is parallel to the axis
    assert abs(added @ along).max() > 0
    across = np.where(twisted.structure.places.direction == "x", 1.0, 0.0)
    softened = across @ unloaded[twisted.free][:, twisted.free] @ across
    assert softened == pytest.approx(-across @ twisted.structure.mass_matrix @ across)


def test_crossings_are_natural_frequencies_at_their_speeds(twisted):
    lines = sh.campbell(twisted.rotating.disk, [4000, 9000], orders=[17, 18], count=2)
    assert lines.sizes["crossing"] > 0
    for one in range(lines.sizes["crossing"]):
        speed = float(lines.crossing_speed[one])
        frequency = int(lines.crossing_order[one]) * speed / 60
        wave = int(lines.crossing_nodal_diameter[one])
        assert wave in (6, 7)
        found = sh.natural_modes(twisted.at(speed).disk, wave, count=3).frequency.values
        assert abs(found / frequency - 1).min() < 1e-8


@pytest.mark.slow
def test_a_damped_disk_is_that_of_all_equations(monkeypatch):
    """At a frequency where dampers slip, condensed and not; both have the mass of the damper."""
    monkeypatch.setattr(contacts, "DAMPER_BAND", (2000.0, 5000.0))
    found = contacts.damper(SMALL)
    problem = contacts.with_mass(found.problem, 0.002)
    band = sh.natural_modes(found.disk, contacts.WAVE, count=1).frequency.item()
    point = sh.solve(problem, band, throw=True)
    assert (point.contact_state.values == 1).any()
    whole = sh.datasets.recover(problem, point).coefficient.values[found.disk.kept]
    disk = sh.HarmonicBalance(found.disk, problem.excitation, contacts.DAMPER_HARMONICS)
    exact = sh.solve(contacts.with_mass(disk, 0.002), band, throw=True).coefficient.values
    assert np.abs(whole - exact).max() < 1e-9 * np.abs(exact).max()
    lighter = sh.solve(contacts.with_mass(disk, 0.0019), band, throw=True).coefficient.values
    assert np.abs(whole - lighter).max() > 1e-3 * np.abs(exact).max()


@pytest.mark.slow
def test_landmarks_of_contacts_can_be_missed(monkeypatch):
    monkeypatch.setattr(contacts, "MASSES", contacts.MASSES[[0, 4, 8]])
    monkeypatch.setattr(contacts, "PRELOADS", (45.0, 1000.0))
    dataset = contacts.compute(progress=False)
    assert unmet(contacts.landmarks(dataset)) == []
    other = dataset.assign(damper_peak_frequency=dataset.damper_peak_frequency * (1 + 2e-4))
    assert len(unmet(contacts.landmarks(other))) == 1
    # Between those that slide and those that stick.
    peaks = dataset.damper_peak_amplitude
    assert peaks[-1] < 0.3 * peaks[:-1].isel(mass=[0, -1]).min()


@pytest.mark.slow
@pytest.mark.parametrize("kind", mistuned.KINDS)
def test_a_small_tuned_ring_is_its_sector(kind, monkeypatch):
    monkeypatch.setattr(mistuned, "BAND", (1500.0, 3000.0))
    disk = mistuned.disk(kind, SMALL, n_sectors=6)
    sector, ring = (sh.solve(each, 2000.0, throw=True) for each in (disk.sector, disk.ring))
    tips = ring.amplitude.values[disk.tips]
    assert len(tips) == 6
    assert np.allclose(tips, tips[0], rtol=1e-8)
    assert np.isclose(sector.amplitude.values, tips[0], rtol=1e-8).any()


def test_the_ring_of_sectors_at_speed_has_their_waves():
    """Assembled without waves: every frequency of one is that of a wave."""
    sector = open_sector((1, 3, 1, 1), n_sectors=6, twist=modes.TWIST).at(6000)
    whole = sh.natural_modes(assembled(sector.disk).model, count=6).frequency.values
    waves = sh.natural_modes(sector.disk, count=6).frequency.values
    repeated = np.sort(np.repeat(waves, [1, 2, 2, 1], axis=0).ravel())[:6]
    assert np.allclose(whole, repeated, rtol=1e-9)


@pytest.mark.slow
def test_front_of_peak_and_damper_mass():
    """The end is lower than at masses beside it, and no point between is dominated."""
    dataset = front.compute(n_points=2, n_sector=3)
    assert unmet(front.landmarks(dataset)) == []
    points = front.fronts(dataset)["sector"]
    assert points.shape == (3, 2)
    assert np.all(np.diff(points[:, 0]) > 0)
    assert np.all(np.diff(points[:, 1]) < 0)
