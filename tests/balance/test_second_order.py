"""Second derivatives of the balance, against differences of its exact first ones."""

from functools import cache
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import symhbm as sh
from symhbm.balance.second_order import Expansion, SecondOrder
from symhbm.numerics import turning_hessian, turning_points
from tests import designs
from tests.quick import quick_first

NAMES = ("mass", "damping", "stiffness", "contact_stiffness", "friction_coefficient")
NAMES += ("normal_load", "force_amplitude")
SPRINGS = (*NAMES, "cubic_stiffness")
SETS = [(1,), (1, 3), (1, 3, 5), (0, 1), (0, 1, 2, 3)]
OMEGA = 90.0
ROUND_OFF = 1e-8
"""Of gradients, some 1e-15 of the largest, over steps of 1e-5, and once more by extrapolation."""


def ring(harmonics, springs=False):
    values = dict(
        mass=[1.0, 1.1, 0.9], stiffness=[1e4, 1.1e4, 0.9e4], damping=[0.5, 0.6, 0.4],
        friction_coefficient=[0.5, 0.4, 0.6], normal_load=3.0,
        cubic_stiffness=[1e8, 2e8, -1e8] if springs else 0.0,
    )  # fmt: skip
    problem = designs.ring(3, [1e4, 2e4, 3e4], 1, harmonics, **values)
    return problem.with_parameters(force_amplitude=3.0)


def with_limits(problem, unknowns, shares):
    """The problem with limits of slip at these shares of what its contacts need to stick."""
    points = turning_points(problem.basis, problem.layout.relative(unknowns))
    spread = points.value.max(axis=1) - points.value.min(axis=1)
    limit = problem.contacts.sliders().stiffness * spread / 2 * shares
    return problem.with_parameters(normal_load=limit / problem.model.friction_coefficient)


def gradient(found: Expansion, multipliers):
    """First derivatives of the weighted balance by all variables."""
    evaluation = found.evaluation
    by_unknowns = evaluation.jacobian.T @ multipliers
    by_frequency = evaluation.by_parameter @ multipliers
    return np.concatenate([by_unknowns, [by_frequency], found.by_parameters.T @ multipliers])


def differences(second_order, problem, unknowns, multipliers, along, step):
    """Central difference of the gradient in one direction of all variables."""
    n, sides = problem.n_unknowns, []
    for h in (-step, step):
        moved = {
            name: np.atleast_1d(problem.parameters[name]) + h * along[place]
            for name, place in second_order.places.items()
        }
        amplitude = float(moved.pop("force_amplitude")[0])
        other = problem.with_parameters(**moved, force_amplitude=amplitude)
        at = unknowns + h * along[:n], OMEGA + h * along[n]
        sides.append(gradient(second_order(other, *at, multipliers), multipliers))
    return (sides[1] - sides[0]) / (2 * step)


def compare(problem, second_order, unknowns, rng):
    """Error of the Hessian against differences, their own doubt, and the Hessian.

    All variables relative to their sizes, errors to the largest second derivative.
    """
    multipliers = rng.normal(size=problem.n_unknowns)
    values = [np.atleast_1d(problem.parameters[name]) for name in second_order.names]
    sizes = np.concatenate([np.full(len(unknowns), np.abs(unknowns).max()), [OMEGA], *values])
    hessian = second_order(problem, unknowns, OMEGA, multipliers).hessian
    level = np.abs(hessian * np.outer(sizes, sizes)).max()
    # What is 0 does not move, but has a derivative.
    scale = np.where(sizes == 0, 1.0, np.abs(sizes))
    error = doubt = 0.0
    for _ in range(2):
        along = rng.normal(size=len(sizes)) * sizes
        coarse, fine = (
            scale * differences(second_order, problem, unknowns, multipliers, along, step)
            for step in (2e-5, 1e-5)
        )
        # Their error goes with the square of the step.
        best = fine + (fine - coarse) / 3
        doubt = max(doubt, np.abs(fine - coarse).max() / level)
        error = max(error, np.abs(best - scale * (hessian @ along)).max() / level)
    return error, doubt, hessian


def check(problem, second_order, unknowns, rng):
    """Assert that the Hessian is what differences give."""
    error, doubt, hessian = compare(problem, second_order, unknowns, rng)
    assert doubt < 1e-5
    assert error < ROUND_OFF + doubt
    return hessian


@cache
def compiled(harmonics, springs=False):
    """A problem and its second derivatives, with cubic springs or not."""
    problem = ring(harmonics, springs)
    return problem, SecondOrder(problem, SPRINGS if springs else NAMES)


CASES = [*product(SETS, [False]), ((0, 1), True), *product(SETS, [True])]


@pytest.mark.parametrize(("harmonics", "springs"), quick_first(CASES, 6))
@settings(max_examples=5)
@given(seed=st.integers(0, 10**6), share=st.floats(0.02, 0.95))
def test_hessian_is_the_derivative_of_the_gradient(harmonics, springs, seed, share):
    problem, second_order = compiled(harmonics, springs)
    rng = np.random.default_rng(seed)
    unknowns = 1e-3 * rng.normal(size=problem.n_unknowns)
    # One contact sticks, two slip, with small loops wherever harmonics above 1 lead.
    problem = with_limits(problem, unknowns, [1.5, share, 0.3])
    assert problem.locate(unknowns, 1.0).switches.tolist() == [False, True, True]
    error, doubt, _ = compare(problem, second_order, unknowns, rng)
    # Close to an onset second derivatives grow like the inverse root of the distance: where a step
    # comes across one, differences tell nothing.
    assume(doubt < 1e-5)
    assert error < ROUND_OFF + doubt


@pytest.mark.parametrize("harmonics", [(1,), (0, 1, 2, 3)])
@pytest.mark.parametrize(
    "shares", [[2.0, 3.0, 4.0], [0.1, 0.5, 0.9], [0.0, 0.4, 1.5]], ids=["stick", "slip", "no limit"]
)
def test_contacts_in_one_state_and_without_a_limit(harmonics, shares):
    """Without one the force turns its sign at reversals that move, and there is no stick."""
    problem, second_order = compiled(harmonics)
    rng = np.random.default_rng(7)
    unknowns = 1e-3 * rng.normal(size=problem.n_unknowns)
    problem = with_limits(problem, unknowns, shares)
    hessian = check(problem, second_order, unknowns, rng)
    by_load = hessian[: problem.n_unknowns, second_order.places["normal_load"].start]
    assert shares[0] or np.abs(by_load).max() > 1.0


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), lowest=st.booleans())
def test_extremes_of_motions(seed, lowest):
    problem = ring((0, 1, 2, 3))
    basis, rng = problem.basis, np.random.default_rng(seed)
    motion, along = rng.normal(size=(2, 1, basis.n_components))

    def slope(coefficients):
        points = turning_points(basis, coefficients)
        at = points.lowest[0] if lowest else 0
        return basis.values(points.angle[:, at])[0]

    coarse, fine = (
        (slope(motion + h * along) - slope(motion - h * along)) / (2 * h) for h in (2e-5, 1e-5)
    )
    doubt = np.abs(fine - coarse).max()
    # Two extremes that change places, or a flat one: no derivative to compare.
    assume(doubt < 1e-4)
    points = turning_points(basis, motion)
    angle = points.angle[:, points.lowest[0] if lowest else 0]
    exact = turning_hessian(basis, motion, angle)[0] @ along[0]
    assert (
        np.abs(fine + (fine - coarse) / 3 - exact).max() < 1e-8 * (1 + np.abs(exact).max()) + doubt
    )


def test_places_and_copies():
    problem = ring((1,))
    second_order = SecondOrder(problem, ("normal_load", "force_amplitude"))
    n = problem.n_unknowns
    assert second_order.places == {
        "normal_load": slice(n + 1, n + 4),
        "force_amplitude": slice(n + 4, n + 5),
    }
    at = np.full(n, 1e-3), OMEGA, np.ones(n)
    second_order(problem.with_parameters(normal_load=[1, 2, 3]), *at)
    with pytest.raises(ValueError, match="a copy of it by with_parameters"):
        second_order(ring((1,)), *at)


def test_sampled_friction_is_refused():
    problem = ring((1,))
    sampled = sh.HarmonicBalance(problem.model, problem.excitation, (1,), samples=64)
    with pytest.raises(ValueError, match="samples=64: expected a problem with located"):
        SecondOrder(sampled)
