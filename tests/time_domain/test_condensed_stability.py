"""Stability of condensed structures: the multipliers are those of the whole structure."""

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from symhbm.numerics import unknowns_of
from symhbm.time_domain.perturbations import multipliers
from tests.problems import rub

BAND = (1.2, 2.6)
FRICTION = sh.Contacts(sh.laws.Coulomb(), [(10,), (25, 30)], **rub(2e3, 0.5, 3.0))
OPENS = sh.Friction(
    tangential=[(10,)],
    normal=[(20,)],
    contact_stiffness=2e3,
    normal_stiffness=3e3,
    friction_coefficient=0.5,
    normal_load=5.0,
)
STOP = sh.Gap(normal=[(20,)], normal_stiffness=3e3, gap=1e-4)


CUBIC = sh.Contacts(sh.laws.CubicSpring(), [(20,)], cubic_stiffness=1e7)


def chain(contacts, n=40):
    ones = np.ones(n)
    mass = sp.eye_array(n)
    stiffness = 1e4 * sp.diags_array([-ones[1:], 2 * ones, -ones[1:]], offsets=[-1, 0, 1])
    return sh.Model(mass, 0.2 * mass + 2e-4 * stiffness, stiffness, contacts={"one": contacts})


def problems(contacts, harmonics, covered):
    model, force = chain(contacts), sh.forces.PointForce(39, amplitude=40.0)
    small = sh.condense(
        model, force, BAND, range(covered + 1), places=[39], stability=True, progress=False
    )
    return [sh.HarmonicBalance(m, force, harmonics) for m in (model, small)]


@pytest.mark.parametrize(
    ("contacts", "harmonics"), [(FRICTION, (1, 3)), (OPENS, (0, 1, 2)), (STOP, (0, 1, 2))]
)
def test_multipliers_are_those_of_the_whole_structure(contacts, harmonics):
    # As many harmonics as the chain has modes below them: perturbations have more than responses.
    whole, small = problems(contacts, harmonics, covered=11)
    omega = 2 * np.pi * 2.3
    point = sh.solve(small, 2.3, stability=True)
    assert bool((point.contact_state > 0).all())
    unknowns = unknowns_of(small.basis, harmonics, point.coefficient.values)
    everywhere = small.structure.with_modes(unknowns, omega, 40.0)
    assert small.in_modes.evaluate(everywhere, omega).norm < 1e-13
    recovered = sh.datasets.recover(small, point).coefficient.values
    expected = multipliers(whole, omega, unknowns_of(whole.basis, harmonics, recovered))
    found = multipliers(small.in_modes, omega, everywhere)
    # Each leading one is among those of the whole.
    for value in found[:10]:
        assert np.abs(expected - value).min() < 1e-6
    rate = np.log(np.abs(expected[0])) * omega / (2 * np.pi)
    np.testing.assert_allclose(point.growth_rate, rate, rtol=1e-5)
    assert point.stability.item() == int(rate < 0)


def test_growth_beside_a_smooth_law_is_that_of_the_whole_structure():
    whole, small = (
        sh.solve(problem, 1.8, stability=True) for problem in problems(CUBIC, (1, 3), covered=5)
    )
    np.testing.assert_allclose(small.growth_rate, whole.growth_rate, rtol=1e-6)


def test_modes_are_exact_between_the_harmonics():
    model, force = chain(FRICTION), sh.forces.PointForce(39, amplitude=40.0)
    errors = []
    for stability in (True, False):
        small = sh.condense(model, force, (1.9, 2.1), (1, 9), stability=stability, progress=False)
        inside, n = small.modal, small.n_dof
        others, worst = np.setdiff1d(np.arange(model.n_dof), small.dofs), 0.0
        for s in 2 * np.pi * np.array([0.3, 4.1, 9.3, 14.9]):
            whole = model.dynamic_stiffness(1, s)[0]
            reduced = inside.stiffness + 1j * s * inside.damping - s**2 * inside.mass
            exact, found = (
                part[np.ix_(a, a)]
                - part[np.ix_(a, b)] @ np.linalg.solve(part[np.ix_(b, b)], part[np.ix_(b, a)])
                for part, a, b in (
                    (whole, small.dofs, others),
                    (reduced, np.arange(n), np.arange(n, len(reduced))),
                )
            )
            worst = max(worst, np.abs(found - exact).max() / np.abs(exact).max())
        errors.append(worst)
    assert errors[0] < 1e-9
    assert errors[1] > 1e3 * errors[0]


def test_what_the_modes_do_not_tell_is_refused(monkeypatch):
    model, force = chain(FRICTION), sh.forces.PointForce(39, amplitude=40.0)
    small = sh.condense(model, force, BAND, progress=False)
    problem = sh.HarmonicBalance(small, force)
    with pytest.raises(ValueError, match="condense it with stability=True"):
        sh.frf(problem, BAND, stability=True)
    monkeypatch.setattr("symhbm.model.condensation.pole_residue.LARGEST_MODAL", 8)
    small = sh.condense(model, force, BAND, stability=True, progress=False)
    assert small.modal is None
    with pytest.raises(ValueError, match=r"symhbm\.craig_bampton"):
        sh.frf(sh.HarmonicBalance(small, force), BAND, stability=True)
