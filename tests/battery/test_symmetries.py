"""Responses under half a period, other units of force, and without contacts."""

import numpy as np
import pytest

import symhbm as sh
from tests.problems import HARMONICS, STRUCTURES, cases, cell, cells, force_of, problem, solved

QUICK = [
    "planar blade point 13", "varying rotor static 0123", "stop sector order 0123",
    "coulomb air order 13", "pressed reduced static 0123", "own turning order 1",
    "driven ring order 13",
]  # fmt: skip
UNIQUE = [name for name in cells() if cell(name).law not in ("cubic", "coupled")]


@pytest.mark.parametrize("name", cases(QUICK, UNIQUE))
def test_half_a_period_later(name):
    """Odd harmonics of the force change their sign, and those of the motion with them."""
    given = problem(name)
    basis, omega = given.basis, 2 * np.pi * 24.0
    later = np.where(basis.order % 2, -1.0, 1.0)
    rng = np.random.default_rng(3)
    motion = 3e-4 * rng.normal(size=(given.n_dof, basis.n_components))
    without = given.with_parameters(force_amplitude=0.0)
    forces = [
        without.evaluate((motion * sign).ravel(), omega).residual.reshape(motion.shape)
        for sign in (np.ones(len(later)), later)
    ]
    np.testing.assert_allclose(
        forces[1], forces[0] * later, atol=1e-11 * np.abs(forces[0]).max(), rtol=1e-9
    )


SCALED = {
    "none": {}, "coulomb": {"normal_load": 1}, "planar": {"normal_load": 1},
    "varying": {"normal_load": 1}, "pressed": {"normal_load": 1}, "stop": {"gap": 1},
    "own": {"hardening": -2}, "cubic": {"cubic_stiffness": -2}, "coupled": {"hardening": -2},
    "driven": {"normal_load": 1, "damper_mass": 1},
}  # fmt: skip


@pytest.mark.parametrize("name", cases(QUICK, UNIQUE))
def test_twice_the_forces_and_lengths(name):
    """Loads and gaps twice as large, springs of third power a quarter: motions twice as large."""
    given = problem(name)
    if cell(name).force == "static":
        pytest.skip("no parameter scales a static load")
    values = given.parameters
    twice = {key: values[key] * 2.0**power for key, power in SCALED[cell(name).law].items()}
    larger = given.with_parameters(force_amplitude=2 * given.parameters["force_amplitude"], **twice)
    expected = 2 * solved(given)
    np.testing.assert_allclose(solved(larger), expected, atol=1e-9 * np.abs(expected).max())


RELEASED = {
    "coulomb": {"normal_load": 1e-9}, "planar": {"normal_load": 1e-9}, "stop": {"gap": 1.0},
    "cubic": {"cubic_stiffness": 1e-9}, "coupled": {"hardening": 1e-9},
    "driven": {"normal_load": 1e-9, "damper_mass": 0.0}, "own": {"hardening": 1e-9, "loss": 0.0},
}  # fmt: skip


@pytest.mark.parametrize(
    "name",
    cases(
        ["planar blade base 1", "stop mistuned order 0123", "own turning order 1"],
        cells(laws=RELEASED, harmonics=("1", "0123")),
    ),
)
def test_released_contact_is_linear(name):
    """As the structure without it, by its matrices or its dynamic stiffness alone."""
    law, structure, force, level = cell(name)
    if structure.startswith(("condensed", "reduced")):
        pytest.skip("the coordinates of the structure depend on its contacts")
    released = problem(name).with_parameters(**RELEASED[law])
    model = STRUCTURES[structure]("none")
    cyclic = cell(name).structure not in ("blade", "rotor", "chain")
    alone = sh.HarmonicBalance(
        model, force_of(force, model, cyclic, HARMONICS[level]), HARMONICS[level]
    )
    expected = solved(alone)
    np.testing.assert_allclose(solved(released), expected, atol=1e-8 * np.abs(expected).max())
