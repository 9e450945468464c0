"""Finite-element blades and random structures: condensed against the whole, 1e-8 at any point."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh
from whole_structure import whole_response

import symhbm as sh
from tests.problems import rub
from tests.quick import quick_first

EXACT = 1e-8


def differences(problem, response, points):
    """Relative differences of condensed responses from the whole, and its residuals.

    Relative to the response of what is kept, and to that or a ten-thousandth of the largest one of
    the structure: far from the force, in a gap between resonances, next to nothing arrives.
    """
    model, harmonics = problem.model, problem.harmonics
    error, scaled, residual = [], [], []
    for i in points:
        here = response.isel(point=i)
        frequency = float(here.frequency)
        values = here.coefficient.transpose("dof", "harmonic", "component").values
        places = np.searchsorted(harmonics, problem.basis.order)
        start = values[:, places, problem.basis.is_sine.astype(int)]
        whole = whole_response(
            model.structure, problem.excitation, harmonics, frequency, model.dofs, start
        )
        assert whole.step < 1e-12
        expected = whole.coefficients[model.dofs]
        difference, size = (np.linalg.norm(x) for x in (start - expected, expected))
        error.append(difference / size)
        scaled.append(difference / max(size, 1e-4 * np.abs(whole.coefficients).max()))
        residual.append(whole.residual)
    return np.array(error), np.array(scaled), np.array(residual)


def connected(rng, kind):
    """Stiffness of a chain or a plate that hangs on the ground in a few places."""

    def chain(n):
        one = np.ones(n - 1)
        return sp.diags_array([one, -one], offsets=[0, 1], shape=(n - 1, n))

    if kind == "chain":
        n = int(rng.integers(30, 401))
        links = chain(n)
    else:
        rows, columns = (int(k) for k in rng.integers(5, 21, 2))
        rows = max(rows, -(-30 // columns))
        n = rows * columns
        along, across = chain(rows), chain(columns)
        one, other = sp.eye_array(rows), sp.eye_array(columns)
        links = sp.vstack([sp.kron(along, other), sp.kron(one, across)])
    links = links.tocsc()
    springs = sp.diags_array(1e6 * rng.uniform(0.5, 1.5, links.shape[0]))
    ground = np.zeros(n)
    ground[rng.choice(n, max(1, n // 20), replace=False)] = 1e6
    return (links.T @ springs @ links + sp.diags_array(ground)).tocsc()


def random_case(seed):
    """A structure, its force, band, harmonics and watched degrees of freedom."""
    rng = np.random.default_rng(seed)
    stiffness = connected(rng, ("chain", "plate")[seed % 2])
    n = stiffness.shape[0]
    mass = sp.diags_array(rng.uniform(0.5, 2.0, n)).tocsc()
    ratio = 10 ** rng.uniform(-3.5, -2)
    squares = eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)
    damping = 2 * ratio * np.sqrt(squares[0]) * mass
    if seed % 3 == 1:
        damping = damping + 2 * ratio / np.sqrt(squares[-1]) * stiffness
    if seed % 3 == 2:
        local = np.where(rng.uniform(size=n) < 0.1, 2 * np.sqrt(squares[0]), 0.0)
        damping = damping + sp.diags_array(local)
    ends = rng.choice(n, int(rng.integers(1, 9)), replace=False)
    contacts = [(int(dof),) for dof in ends[: len(ends) // 2 + 1]]
    contacts += [(int(a), int(b)) for a, b in zip(ends[1::2], ends[2::2], strict=False)]
    watched, forced = (int(dof) for dof in rng.integers(n, size=2))
    kept = sorted({dof for contact in contacts for dof in contact} | {watched})
    others = np.setdiff1d(np.arange(n), kept)
    held = np.sqrt(
        eigh(
            stiffness.toarray()[np.ix_(others, others)],
            mass.toarray()[np.ix_(others, others)],
            eigvals_only=True,
        )
    ) / (2 * np.pi)
    # Beside none of its modes, beside one, or beside many.
    place = seed // 2 % 3
    whole = np.sqrt(squares) / (2 * np.pi)
    if place == 0 and whole[0] < 0.9 * held[0]:
        band = 0.6 * whole[0], min(1.3 * whole[0], 0.97 * held[0])
    elif place < 2:
        band = 0.9 * held[0], 1.1 * held[0]
    else:
        band = 0.9 * held[0], held[min(12, len(held) // 2)]
    harmonics = ((1,), (1, 3), (0, 1, 2, 3))[seed // 6 % 3]
    force = sh.forces.PointForce(forced, amplitude=100.0)
    model = sh.Model(
        mass, damping, stiffness, contacts=contacts, **rub(1e6 * 10 ** rng.uniform(-3, 0), 0.5, 1.0)
    )
    stuck = sh.HarmonicBalance(model.with_parameters(normal_load=1e12), force)
    response = sh.solve(stuck, sum(band) / 2)
    directions = model.directions
    motion = directions @ response.coefficient.sel(harmonic=1).values
    travel = np.hypot(*motion.T) * model.contact_stiffness
    load = np.maximum(travel, 1e-3 * travel.max()) * 10 ** rng.uniform(-1, 1)
    return model.with_parameters(normal_load=load), force, band, harmonics, watched


# In the first two the path passes resonances that what is kept hardly feels.
@pytest.mark.parametrize("seed", quick_first([32, 28, 0, *sorted({*range(1, 46)} - {28, 32})], 1))
def test_random_structures(seed):
    model, force, band, harmonics, watched = random_case(seed)
    condensed = sh.condense(model, force, band, harmonics, places=[watched])
    problem = sh.HarmonicBalance(condensed, force, harmonics)
    response = sh.frf(problem, band, progress=False)
    assert response.status == "the end of the band was reached"
    assert bool(response.converged.all())
    n_points = int(response.n_points)
    points = np.unique(np.linspace(0, n_points - 1, 4).astype(int))
    points = np.append(points, int(response.amplitude.max("dof").values.argmax()))
    error, scaled, residual = differences(problem, response, points)
    assert residual.max() < 1e-12
    assert scaled.max() < EXACT
    certificate = condensed.certificate
    assert error.max() < 10 * max(certificate.error, certificate.friction_bound) + 1e-11
    # The response of all, where it is converged further than to a residual.
    here = sh.datasets.recover(problem, response.isel(point=points[-1]))
    np.testing.assert_allclose(here.condensation_error, error[-1], rtol=0.5, atol=1e-11)
