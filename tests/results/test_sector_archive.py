"""Archives of problems of all kinds: of sectors, of what turns, of forces: to the bit."""

import pickle

import numpy as np
import pytest
from sectors import random_disk, wave, with_friction, with_opening
from sectors_to_reduce import plate_sector

import symhbm as sh
from symhbm.results.problem import record_of
from tests.archives import interrupt
from tests.problems import OWN_LAWS, Coupled, ring_of_blades, rub
from tests.quick import quick_first

HARMONICS, BAND, ORDER = (0, 1, 2, 3), (20.0, 28.0), 2
WIND = {-1: 60 + 30j, 0: 100 + 50j, 1: 30 - 25j}
PER_MINUTE = 2 * np.pi / 60


def sector():
    disk = with_opening(random_disk(6, True))
    return sh.HarmonicBalance(disk, wave(ORDER, disk), HARMONICS)


def moved():
    disk = with_friction(random_disk(5, True))
    disk = disk.with_influences(sh.Influence({5: 1.0, 4: 0.5}, WIND, 25.0))
    return sh.HarmonicBalance(disk, wave(ORDER, disk), HARMONICS)


def of_two():
    disk = with_friction(random_disk(6, True))
    force = sh.forces.EngineOrder(ORDER, pattern={5: 1.0})
    force += sh.forces.EngineOrder(ORDER, pattern={2: {5: 0.5}, 3: {5: 0.0}})
    return sh.HarmonicBalance(disk, force, HARMONICS)


def condensed():
    disk = with_opening(random_disk(6, True, n_inner=4))
    force = wave(4, disk)  # its waves are of the other sense
    small = sh.condense(disk, force, (18, 30), HARMONICS, places=[5], progress=False)
    return sh.HarmonicBalance(small, force, HARMONICS)


def rotor(damping=None, n_dof=3):
    own = np.diag([9e3, 2e4, 4e3]) - 1e3 * (np.ones((3, 3)) - np.eye(3))
    coriolis = np.zeros((3, 3))
    coriolis[0, 1], coriolis[1, 0] = -0.4, 0.4
    model = sh.Model(np.diag([1.0, 0.8, 0.5]), damping or 2.0 * np.eye(3), own)
    speeds = {s: own + (PER_MINUTE * s) ** 2 * np.diag([3.0, 1, 0]) for s in (0, 100, 300)}
    return sh.RotatingModel(model, speeds, coriolis=coriolis)


def slider(place):
    return sh.Friction(
        tangential=place, contact_stiffness=3e3, friction_coefficient=0.5, normal_load=0.05
    )


def turning_sector():
    disk = sh.Sector(rotor(), [0], [2], 5).with_contacts(rub=slider((1, sh.next_sector(1))))
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(ORDER, pattern={0: 1.0}), (1, 3))


def turning():
    model = rotor(sh.RayleighDamping(2.0, 1e-5)).with_contacts(rub=slider((1,)))
    return sh.HarmonicBalance(model, sh.forces.EngineOrder(ORDER), (1, 3))


def reduced():
    small = sh.craig_bampton(plate_sector(6), 12, (5, 40), places=[77])
    return sh.HarmonicBalance(small, sh.forces.EngineOrder(2, pattern={60: 3.0}), (1, 3))


def lossy():
    model = sh.Model(np.eye(2), sh.StructuralDamping(0.02), np.diag([2e4, 3e4]))
    model = model.with_contacts(rub=slider((1,)))
    return sh.HarmonicBalance(model, sh.forces.PointForce(1), (1, 3))


def row(places=None, **contacts):
    """Four masses one behind the other, all held by the ground."""
    tied = 1e4 * (3 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    return sh.Model(np.eye(4), 0.5 * np.eye(4), tied, contacts=contacts, places=places)


def weighted():
    places = [{0: 0.1, 1: -1 / 3}, (2, 3)]
    loads = rub(8e3, 0.4, 2.0) | dict(centrifugal_load=1e-4, engine_order=3)
    rubs = sh.Friction(tangential=places, **loads)
    corner = sh.Contacts(Coupled(), {0: 2.5}, (3,), hardening=1e6)
    return sh.HarmonicBalance(row(rub=rubs, corner=corner), sh.forces.PointForce(1, 3.0), (1, 3))


def at_a_speed():
    loads = rub(3e3, 0.5, 1.0) | dict(centrifugal_load=2e-5, engine_order=2)
    rubs = sh.Friction(tangential=(1,), **loads)
    model = rotor(sh.StructuralDamping(0.03)).with_contacts(rub=rubs).at(150)
    return sh.HarmonicBalance(model, sh.forces.PointForce(1, 5.0), (1, 3))


def field():
    places = sh.Places(node=[7, 7, 9, 9], direction=["x", "y"] * 2, label=["tip", "tip", "", ""])
    force = sh.forces.FieldForce({2: {"tip:y": 1.5j}})
    force += sh.forces.HarmonicForce({1: {"9:x": 2.0}})
    return sh.HarmonicBalance(row(places, rub=slider((3,))), force, (0, 1, 2))


def moving_base():
    base = sh.forces.BaseMotion(velocity=1e-2j, motion="absolute")
    force = base + sh.forces.PointForce(amplitude=0.2, phase=1.0)
    return sh.HarmonicBalance(row(rub=slider((3,))), force, (1, 3))


def reduced_base():
    problem = moving_base()
    base = sh.forces.BaseMotion(velocity=1e-2j, motion="absolute").on(problem.model)
    return sh.HarmonicBalance(sh.craig_bampton(problem.model, 3, (4, 30)), base, (1, 3))


def lossy_ring():
    springs = [[5e4, -2e4, -2e4], [-2e4, 2e4, 0], [-2e4, 0, 2e4]]
    model = sh.Model(np.diag([1.0, 0.4, 0]), sh.StructuralDamping(0.02), springs)
    disk = sh.Sector(model, [0], [2], 5).with_contacts(rub=slider((1, sh.next_sector(1))))
    air = sh.Influence({1: 1.0}, {-1: 100 - 20j, 0: 300 + 60j}, 40.0)
    ring = sh.mistuned_ring(disk.with_influences(air), stiffness_deviation=0.02 * np.arange(5))
    return sh.HarmonicBalance(ring, sh.forces.EngineOrder(ORDER, pattern={1: 5.0}), (1, 3))


def summed():
    force = sh.forces.EngineOrder(2, 1.5) + sh.forces.PointForce(2, 0.1, harmonic=3)
    force += sh.forces.StaticLoad({0: 20.0, 4: -3.0})
    return sh.HarmonicBalance(ring_of_blades(6), force, (0, 1, 3))


PROBLEMS = [turning_sector, lossy, weighted, at_a_speed, field, lossy_ring, moving_base]
SLOW = [sector, moved, of_two, condensed, turning, reduced, reduced_base, summed]


@pytest.mark.parametrize("make", quick_first(PROBLEMS + SLOW, len(PROBLEMS)))
def test_a_rebuilt_problem_is_the_same_to_the_bit(make, tmp_path):
    problem = make()
    over = {"normal_load": [2.0, 3.0]} if len(problem.model.groups) == 1 else None
    response = sh.frf(problem, BAND, at=[21.0, 25.0], over=over, progress=False)
    sh.save(response, tmp_path / "response.nc")
    stored = sh.load(tmp_path / "response.nc")
    if over:
        stored, problem = stored.isel(normal_load=1), problem.with_parameters(normal_load=3.0)
    again = sh.datasets.rebuild(stored, laws=OWN_LAWS)
    unknowns = 1e-3 * np.random.default_rng(0).normal(size=problem.n_unknowns)
    for omega in 2 * np.pi * np.array([20.0, 23.3]):
        one, other = (each.evaluate(unknowns, omega) for each in (problem, again))
        np.testing.assert_array_equal(other.residual, one.residual)
        np.testing.assert_array_equal(other.jacobian, one.jacobian)
    verified = sh.verify(response, exact="none", laws=OWN_LAWS, progress=False)
    assert verified.residual_stored.max() < 1e-9
    rebuilt = sh.datasets.rebuild(sh.solve(again, 24.0), laws=OWN_LAWS)
    assert record_of(problem)[0] == record_of(again)[0] == record_of(rebuilt)[0]


@pytest.mark.parametrize("make", [moved, turning_sector])
def test_a_run_that_was_interrupted_is_resumed(make, tmp_path):
    path, problem, over = tmp_path / "resumed.nc", make(), {"normal_load": [2.0, 3.0]}
    interrupt(1, sh.frf, problem, BAND, over=over, archive=path)
    with sh.resume(path, progress=False) as resumed:
        assert resumed.identical(sh.frf(problem, BAND, over=over, progress=False))
    grid = dict(at=[21.0, 23.0], over=over, progress=False)
    with sh.frf(problem, BAND, archive=tmp_path / "grid.nc", **grid) as stored:
        assert stored.identical(sh.frf(problem, BAND, **grid))


def test_copies_of_what_was_rebuilt_and_names_of_places():
    problem = condensed()
    point = sh.solve(problem, 24.0)
    again = pickle.loads(pickle.dumps(sh.datasets.rebuild(point)))
    assert record_of(again)[0] == record_of(problem)[0]
    assert sh.solve(again, 24.0).equals(point)
    assert again.model.number_of("inner0:z") == 5
