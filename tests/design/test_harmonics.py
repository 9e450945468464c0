"""Designs of responses of several harmonics against grids of whole responses."""

import numpy as np
import pytest
from designs import any_status, blade, lowest_of_grid, ring
from quick import quick_first

import symhbm as sh

LOAD = {"normal_load": (0.5, 30.0)}
HIGHER = 0.01
"""dB that a design may be above a grid."""


def chain(harmonics):
    """Two masses, rubbing on each other."""
    matrix = np.array([[2.2e4, -1e4], [-1e4, 1e4]])
    model = sh.Model(np.eye(2), 2e-4 * matrix, matrix, [(0, 1)], 2e4, 0.5, 3.0)
    return sh.HarmonicBalance(model, sh.forces.PointForce(place=1), harmonics)


def pressed(normal_stiffness, harmonics=(0, 1, 2, 3)):
    """Friction along one direction under a load that varies with the motion along another."""
    matrix = np.array([[1e4, -3e3], [-3e3, 2.5e4]])
    friction = dict(contact_stiffness=1e4, friction_coefficient=0.4, normal_load=4.0)
    law = sh.laws.VariableLoadFriction()
    group = sh.Contacts(law, [(0,)], [(1,)], normal_stiffness=normal_stiffness, **friction)
    model = sh.Model(np.eye(2), 2 * np.eye(2), matrix, contacts={"damper": group})
    return sh.HarmonicBalance(model, sh.forces.PointForce(), harmonics)


CASES = {
    "a ring": (ring(5, 2e4, 1, (1, 3), damping=2.0), LOAD, [(10, 45)]),
    "a blade": (blade((1, 3), damping=2.0), LOAD, [(5, 40)]),
    "two variables": (
        chain((1, 3)),
        LOAD | {"friction_coefficient": (0.2, 0.8)},
        [(5, 20)],
    ),
    "two bands": (chain((1, 3, 5)), LOAD, [(5, 11.5), (13, 40)]),
    "a varying load": (pressed(2e4), {"normal_load": (2.0, 30.0)}, [(8, 40)]),
    "friction of a varying load": (pressed(1e4), {"friction_coefficient": (0.1, 1.0)}, [(8, 40)]),
}


@pytest.mark.parametrize("which", quick_first(CASES, 1))
def test_no_design_of_a_grid_is_better(which):
    problem, bounds, bands = CASES[which]
    with any_status():
        best = sh.minimise_peak(problem, [*bounds], bounds, bands, progress=False)
    assert best.design_status.item() in (sh.Status.DESIGN_OPTIMAL, sh.Status.DESIGN_AT_BOUND)
    lowest = lowest_of_grid(problem, bounds, bands, n=(21, 7))
    assert 20 * np.log10(best.design_amplitude.item() / lowest) < HIGHER
    # Nor is the grid, which is fine around its best design, far from it.
    assert lowest < 1.02 * best.design_amplitude.item()
