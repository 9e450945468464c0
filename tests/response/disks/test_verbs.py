"""What is asked of sectors, of what turns, and of rings: as their whole disk, or refused."""

import numpy as np
import pytest

import symhbm as sh

BAND = (40.0, 60.0)
FORCE = sh.forces.EngineOrder(2, pattern={0: 1.0}, amplitude=20.0)
STIFFNESS = np.array([[3e4, -2e4], [-2e4, 2e4]])


def disk_of(turning=False):
    blade = sh.Model([[1.0, 0], [0, 0]], [[2.0, 0], [0, 0]], STIFFNESS)
    if turning:
        blade = sh.RotatingModel(blade, {0: STIFFNESS, 300: STIFFNESS + np.diag([1e3, 0])})
    shroud = sh.Friction(
        tangential=(0, sh.next_sector(0)),
        contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    )  # fmt: skip
    return sh.Sector(blade, left=[0], right=[1], n_sectors=5).with_contacts(shroud=shroud)


def test_the_best_load_along_an_engine_order_has_the_peak_of_its_response():
    problem = sh.HarmonicBalance(disk_of(turning=True), FORCE)
    best = sh.minimise_peak(problem, "normal_load", (1.0, 40.0), BAND, n_starts=2, progress=False)
    load = best.normal_load.values.max()
    for factor in (0.8, 1.0, 1.25):
        response = sh.frf(problem.with_parameters(normal_load=factor * load), BAND, progress=False)
        height = response.peak_amplitude.values.max()
        assert height >= best.peak_amplitude.values.max() * (1 - 1e-8)
        assert (height < best.peak_amplitude.values.max() * (1 + 1e-8)) == (factor == 1)


@pytest.mark.parametrize("turning", [False, True])
def test_what_needs_matrices_names_the_structure_that_has_them(turning):
    problem = sh.HarmonicBalance(disk_of(turning), FORCE)
    for call in (
        lambda: sh.periodic_motion(problem, 40.0),
        lambda: sh.static_states(problem),
        lambda: sh.frf(problem, BAND, stability=True, progress=False),
    ):
        with pytest.raises((TypeError, ValueError), match=r"symhbm.mistuned_ring makes the ring"):
            call()


def test_reduced_structures_with_matrices_know_stability():
    ring = sh.HarmonicBalance(sh.mistuned_ring(disk_of()), FORCE)
    response = sh.frf(ring, BAND, stability=True, progress=False)
    assert np.all(response.stability == 1)
    rows = np.eye(4, k=1) + np.eye(4, k=-1)
    chain = sh.Model(np.eye(4), np.eye(4), 1e4 * (2 * np.eye(4) - rows), contacts={
        "rub": sh.Friction(
            tangential=(3,), contact_stiffness=1e4, friction_coefficient=0.5, normal_load=0.5
        )
    })  # fmt: skip
    small = sh.craig_bampton(chain, 2, (1, 20), places=[0])
    problem = sh.HarmonicBalance(small, sh.forces.PointForce(0))
    assert np.all(sh.frf(problem, (5, 15), stability=True, progress=False).stability == 1)
    turning = sh.RotatingModel(chain, {0: 1e4 * np.eye(4), 100: 2e4 * np.eye(4)})
    problem = sh.HarmonicBalance(turning, sh.forces.EngineOrder(2))
    with pytest.raises(ValueError, match=r"stability=True: .*RotatingModel.at\(speed\)"):
        sh.frf(problem, (5, 15), stability=True, progress=False)
