"""Sectors condensed wave by wave: exact against all equations, and as the whole ring moves."""

import pickle

import numpy as np
import pytest
from sectors import random_disk, wave, with_friction

import symhbm as sh
from tests.quick import quick_first

open_sector = pytest.importorskip("studies.open_sector", reason="scikit-fem")

HARMONICS = (0, 1, 2, 3)


def damped_disk(grid, n_sectors=24, opens=False):
    """A shroud at the tip to the next blade, and a damper between platform and rim."""
    sector = open_sector.open_sector(grid, n_sectors).damped(2e-6)
    _, rim, tip = open_sector.RADII
    half = open_sector.THICKNESS / 2
    one, other = (sector.near(tip, side * 0.3, half) for side in (1, -1))
    edge = sector.near(rim, np.pi / n_sectors, 0.0)  # on the interface that is eliminated
    inside = sector.near(0.8 * rim, 0.2 * np.pi / n_sectors, 0.0)  # no contact is there
    foot = sector.near((rim + tip) / 2, 0.0, half)
    shroud = dict(tangential=(f"{one}:y", sh.next_sector(f"{other}:y")), friction_coefficient=0.3)
    if opens:
        shroud |= dict(normal=(f"{one}:x", sh.next_sector(f"{other}:x")), normal_stiffness=2e7)
    disk = sector.disk.with_contacts(
        shroud=sh.Friction(**shroud, contact_stiffness=3e7, normal_load=40.0),
        damper=sh.Friction(
            tangential=[(f"{foot}:z", f"{edge}:z"), (f"{foot}:y", f"{edge}:y")],
            contact_stiffness=1e7, friction_coefficient=0.3, normal_load=20.0,
        ),
    )  # fmt: skip
    pattern = {f"{one}:z": 900.0, f"{foot}:y": 400j, f"{edge}:x": 90.0}
    pattern |= {f"{inside}:z": 300 - 200j, f"{inside}:x": 150.0}
    return disk, f"{one}:z", pattern


def test_peaks_are_those_of_the_sector():
    """The largest response of what is kept is largest by all equations, and lower beside."""
    disk = with_friction(random_disk(12, True, n_inner=4))
    force = wave(5, disk)
    small = sh.condense(disk, force, (20, 32), HARMONICS)
    curve = sh.frf(sh.HarmonicBalance(small, force, HARMONICS), (20, 32), progress=False)
    problem = sh.HarmonicBalance(disk, force, HARMONICS)
    kept = np.searchsorted(disk.kept, small.dofs)
    assert curve.n_peaks > 0
    peaks = zip(curve.peak_frequency.values, curve.peak_amplitude.values, strict=True)
    for hertz, amplitude in peaks:
        levels = [
            sh.solve(problem, hertz * share).amplitude.values[kept].max()
            for share in (1 - 1e-4, 1, 1 + 1e-4)
        ]
        assert levels[1] == pytest.approx(amplitude, rel=1e-9)
        assert levels[1] > max(levels[0], levels[2])


def test_matrices_of_one_wave_are_not_those_of_all():
    """Harmonic 2 of engine order 3 moves six sectors alike, with real matrices."""
    disk = with_friction(random_disk(6, True, n_inner=4))
    force = wave(3, disk)
    small = sh.condense(disk, force, (20, 32), HARMONICS)
    assert sorted(small.waves) == [0, 3]
    assert small.modal is None
    assert sh.HarmonicBalance(small, force, HARMONICS).in_modes is None


def test_several_engine_orders_and_copies():
    disk, tip, pattern = damped_disk((1, 3, 1, 1), n_sectors=12)
    forces = [sh.forces.EngineOrder(order, pattern=pattern) for order in (2, 10, 5)]
    small = sh.condense(disk, forces, (2000, 6000), (0, 1), places=[tip])
    assert sorted(small.waves) == [0, 2, 5]
    problems = [sh.HarmonicBalance(small, force, (0, 1)) for force in forces]
    points = [sh.solve(problem, 3000.0) for problem in problems]
    again = sh.solve(pickle.loads(pickle.dumps(problems[1])), 3000.0)
    assert np.array_equal(again.coefficient, points[1].coefficient)
    alone = sh.condense(disk, forces[1], (2000, 6000), (0, 1), places=[tip])
    single = sh.solve(sh.HarmonicBalance(alone, forces[1], (0, 1)), 3000.0)
    assert np.allclose(
        single.coefficient, points[1].coefficient, rtol=0, atol=1e-9 * single.amplitude.max().item()
    )
    assert (
        abs(points[0].coefficient - points[1].coefficient).max() > 1e-3 * points[0].amplitude.max()
    )
    with pytest.raises(ValueError, match="does not know engine order 3"):
        sh.HarmonicBalance(small, sh.forces.EngineOrder(3, pattern=pattern), (0, 1))
    with pytest.raises(ValueError, match="does not know this force"):
        sh.HarmonicBalance(small, sh.forces.EngineOrder(2, pattern={50: 1.0}), (0, 1))
    with pytest.raises(ValueError, match="not right"):
        sh.condense(disk, forces, (2000, 6000), places=[int(disk.interfaces.right[0])])
    with pytest.raises(ValueError, match="expected an EngineOrder"):
        sh.condense(disk, sh.forces.PointForce(), (2000, 6000))


@pytest.mark.parametrize("numbers", [[0, 1, 2, 3], [2, 0, 1, 3]])
def test_outputs_do_not_depend_on_how_degrees_of_freedom_are_numbered(numbers):
    """Those on the right of a sector last, and first."""
    blade, left, right, tip = np.argsort(numbers).tolist()
    stiffness = np.array([[30, -20, 0, -10], [-20, 40, -10, 0], [0, -10, 10, 0], [-10, 0, 0, 15]])
    mass = np.diag([1, 0.5, 0, 0.3])
    stiffness, mass = (m[np.ix_(numbers, numbers)] for m in (1e3 * stiffness, mass))
    model = sh.Model(mass, sh.RayleighDamping(0.5, 1e-5), stiffness)
    disk = sh.Sector(model, [left], [right], 6).with_outputs({"strain": {tip: 2, blade: -1}}, "1")
    rub = sh.Contacts(
        sh.laws.Coulomb(), (blade, sh.next_sector(blade)),
        contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    )  # fmt: skip
    disk, force = disk.with_contacts(rub=rub), sh.forces.EngineOrder(2, pattern={blade: 1.0})
    exact = sh.solve(sh.HarmonicBalance(disk, force), 20.0)
    for of in (disk, disk.with_outputs({"other": {tip: 1}}, "1")):
        small = sh.condense(of, force, (5, 40), places=[tip], progress=False)
        small = (
            small.with_outputs({"strain": {tip: 2, blade: -1}}, "1") if of is not disk else small
        )
        found = sh.solve(sh.HarmonicBalance(small, force), 20.0)
        assert found.strain_amplitude.item() == pytest.approx(exact.strain_amplitude.item(), 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("order", quick_first([3, 21, 0], 1))
@pytest.mark.parametrize("opens", [False, True])
def test_displacements_of_contacts_are_enough(order, opens):
    """Contacts to the next sector and across the cut: responses of both sides, everywhere."""
    disk, tip, pattern = damped_disk((1, 3, 1, 1), opens=opens)
    force = sh.forces.EngineOrder(order, pattern={1: pattern, 2: {tip: 60 - 60j}})
    everywhere = []
    for keep, size in (("touched", 9 + opens), ("displacements", 4 + opens)):
        small = sh.condense(disk, force, (2000, 6000), (0, 1, 2), places=[tip], keep=keep)
        assert small.n_dof == size
        assert small.certificate.error < 1e-10
        problem = sh.HarmonicBalance(small, force, (0, 1, 2))
        point = sh.solve(problem, 4100.0)
        everywhere.append(sh.datasets.recover(problem, point))
        assert everywhere[-1].residual_norm < 1e-10
    assert point.label.values[-1] == "displacement of contact 2"
    again = sh.solve(pickle.loads(pickle.dumps(problem)), 4100.0)
    assert np.array_equal(again.coefficient, point.coefficient)
    touched, displaced = (each.coefficient.values for each in everywhere)
    assert abs(touched - displaced).max() < 1e-10 * abs(touched).max()
