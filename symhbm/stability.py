"""Stability of responses with smooth laws by Hill's method.

A small motion beside a response is ``exp(lambda t)`` times one of its period. Balanced in the
harmonics of the response it gives ``(J + lambda D + lambda^2 M) p = 0``, whose matrix at
``lambda = 0`` is the Jacobian of Eq. (9): stability changes at folds, exactly.
"""

import numpy as np
import scipy.sparse as sp

from symhbm.residual import Evaluation, HarmonicBalance

LARGEST_SIZE = 400
"""Number of unknowns above which exponents cost more than the path."""
NEUTRAL = 1e-9
"""Growth over the frequency that is none: at a fold, or without damping."""


def growth_rate(problem: HarmonicBalance, frequency: float, evaluation: Evaluation) -> float:
    """Largest real part of the Floquet exponents [1/s] at a solution; ``frequency`` in rad/s.

    NaN where a contact slips, whose memory Hill's method does not know, and for structures too
    large.
    """
    model, basis = problem.model, problem.basis
    if problem.n_unknowns > LARGEST_SIZE or _slides(problem, evaluation):
        return np.nan
    jacobian = evaluation.jacobian
    matrix = jacobian.toarray() if sp.issparse(jacobian) else np.asarray(jacobian)
    each = np.eye(basis.n_components)
    mass, damping = model.mass_matrix.toarray(), model.damping_matrix.toarray()
    inertia = np.kron(mass, each)
    first = 2 * frequency * np.kron(mass, basis.derivative_matrix) + np.kron(damping, each)
    size = problem.n_unknowns
    # In units of the frequency, so that both halves of the companion matrix are of one size.
    left = np.zeros((2 * size, 2 * size))
    left[:size, size:] = np.eye(size)
    right = np.hstack([matrix / frequency**2, first / frequency])
    left[size:] = -np.linalg.solve(inertia, right)
    exponents = np.linalg.eigvals(left)
    # Copies of an exponent differ by harmonics; those cut off by the truncation are the far ones.
    near = np.argsort(np.abs(exponents.imag), kind="stable")[: 2 * model.n_dof]
    return float(frequency * exponents.real[near].max())


def verdict(rate: float, frequency: float) -> int:
    """1 for stable, 0 for unstable, -1 where it is not known."""
    if np.isnan(rate) or abs(rate) <= NEUTRAL * frequency:
        return -1
    return int(rate < 0)


def _slides(problem: HarmonicBalance, evaluation: Evaluation) -> bool:
    friction, model = evaluation.friction, problem.model
    limit = model.friction_coefficient * model.normal_load
    return bool(np.any(friction.slip & (model.contact_stiffness > 0) & (limit > 0)))
