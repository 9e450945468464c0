"""Sectors condensed wave by wave: exact against all equations, and as the whole ring moves."""

import pickle

import numpy as np
import pytest
from sectors import random_disk, wave, with_friction

import symhbm as sh
from tests.refusals import refused

HARMONICS = (0, 1, 2, 3)


def test_matrices_of_one_wave_are_not_those_of_all():
    """Harmonic 2 of engine order 3 moves six sectors alike, with real matrices."""
    disk = with_friction(random_disk(6, True, n_inner=4))
    force = wave(3, disk)
    small = sh.condense(disk, force, (20, 32), HARMONICS)
    assert sorted(small.waves) == [0, 3]
    assert small.modal is None
    assert sh.HarmonicBalance(small, force, HARMONICS).in_modes is None


DISK, PATTERN = with_friction(random_disk(12, True, n_inner=4)), {5: 4 + 2j, 10: 1.0}
FORCES = [sh.forces.EngineOrder(order, 3.0, pattern=PATTERN) for order in (2, 10, 5)]


def condensed(forces=FORCES, places=(5,)):
    return sh.condense(DISK, forces, (20, 32), (0, 1), places=places)


def balance(force, of=FORCES):
    return sh.HarmonicBalance(condensed(of), force, (0, 1))


def test_several_engine_orders_and_copies():
    assert sorted(condensed().waves) == [0, 2, 5]
    problems = [balance(force) for force in FORCES]
    points = [sh.solve(problem, 27.0).coefficient for problem in problems]
    again = sh.solve(pickle.loads(pickle.dumps(problems[1])), 27.0)
    np.testing.assert_array_equal(again.coefficient, points[1])
    alone, size = sh.solve(balance(FORCES[1], FORCES[1]), 27.0), np.abs(points[1]).max()
    np.testing.assert_allclose(alone.coefficient, points[1], rtol=0, atol=1e-9 * size)
    assert abs(points[0] - points[1]).max() > 1e-3 * size


test_other_forces_and_places_are_refused = refused([
    (lambda: balance(sh.forces.EngineOrder(3, pattern=PATTERN)),
     ValueError, "does not know engine order 3"),
    (lambda: balance(sh.forces.EngineOrder(2, pattern={9: 1.0})),
     ValueError, "does not know this force"),
    (lambda: condensed(places=[int(DISK.interfaces.right[0])]), ValueError, "not right"),
    (lambda: condensed(sh.forces.PointForce()), ValueError, "expected an EngineOrder"),
])  # fmt: skip


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
