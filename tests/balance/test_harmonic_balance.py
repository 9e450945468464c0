"""The balance of Eq. (9): terms, sparse exact derivatives, parameters."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.numerics.arrays import DENSE_LIMIT, Factorisation, bordered
from tests.designs import uneven


def ring(n_blades=5, harmonics=(1, 3), **values):
    return uneven(n_blades, sh.forces.EngineOrder(2, amplitude=1.3), harmonics, seed=1, **values)


def unknowns_of(problem, size=1e-4, seed=2):
    return size * np.random.default_rng(seed).normal(size=problem.n_unknowns)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3), (0, 1, 2)])
def test_residual_in_the_time_domain(harmonics):
    """Without contacts the balance holds instant by instant."""
    problem = ring(harmonics=harmonics, normal_load=0.0)
    omega, tau = 123.0, np.linspace(0, 2 * np.pi, 40)
    unknowns, basis, model = unknowns_of(problem), problem.basis, problem.model
    wave = problem.layout.coefficients(unknowns)
    x, v, a = (omega**d * wave @ basis.values(tau, d).T for d in range(3))
    blades = np.arange(model.n_dof)[:, None]
    force = 1.3 * np.cos(tau - 2 * np.pi * 2 * blades / model.n_dof)
    left = model.mass_matrix @ a + model.damping_matrix @ v + model.stiffness_matrix @ x - force
    residual = problem.layout.coefficients(problem.evaluate(unknowns, omega).residual)
    np.testing.assert_allclose(residual @ basis.values(tau).T, left, rtol=0, atol=1e-12)


def test_derivatives_are_sparse():
    problem = ring(n_blades=12, harmonics=(1,))
    pattern = problem.derivative("unknowns").sparsity_out(0)
    # A blade's two equations see its own and its neighbours' two coefficients each.
    assert pattern.nnz() == 12 * 2 * 6
    assert problem.derivative("normal_load").sparsity_out(0).nnz() == 12 * 2 * 2
    assert problem.derivative("mass").sparsity_out(0).nnz() == 12 * 2


def test_repr_reads_well():
    text = repr(ring())
    assert "harmonics (1, 3)" in text
    assert "5 lumped blades" in text
    assert "EngineOrder(order=2" in text


def test_sparse_and_dense_factors_agree():
    """Solution and sign of the determinant, on the bordered matrix of a large ring."""
    rng = np.random.default_rng(4)
    size = DENSE_LIMIT // 2 + 10
    problem = ring(n_blades=size, harmonics=(1,))
    assert problem.n_unknowns > DENSE_LIMIT
    evaluation = problem.evaluate(unknowns_of(problem), 600.0)
    column, row = rng.normal(size=(2, problem.n_unknowns + 1))
    column = column[:-1]
    right = rng.normal(size=len(row))
    sparse = Factorisation(bordered(evaluation.jacobian / 1e6, column, row))
    dense = Factorisation(bordered(evaluation.jacobian.toarray() / 1e6, column, row))
    assert sparse.sign == dense.sign != 0
    # Round-off times the condition number, about 1e4.
    np.testing.assert_allclose(sparse.solve(right), dense.solve(right), rtol=1e-9)


def test_sign_of_the_determinant():
    rng = np.random.default_rng(5)
    for size in (2, 5, 9):
        matrix = rng.normal(size=(size, size))
        assert Factorisation(matrix).sign == np.sign(np.linalg.det(matrix))
    assert Factorisation(np.zeros((3, 3))).solve(np.ones(3)) is None


def test_copies_take_harmonics_as_the_constructor_does():
    problem = ring()
    assert problem.with_harmonics(range(5, 0, -2)).harmonics == (1, 3, 5)
    for harmonics, kind in ((("1",), TypeError), ((1, 1), ValueError), ((0,), ValueError)):
        with pytest.raises(kind, match="harmonics="):
            problem.with_harmonics(harmonics)  # type: ignore[arg-type]
