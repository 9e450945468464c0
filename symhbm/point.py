"""All results at one point, as plain arrays by the names of the dataset."""

from typing import Any

import numpy as np

from symhbm.extremes import largest_displacement
from symhbm.fourier import FloatArray, FourierBasis
from symhbm.linear import Factorisation
from symhbm.newton import ACCEPTED
from symhbm.residual import HarmonicBalance
from symhbm.stability import growth_rate, verdict

RADIANS = 2 * np.pi

Table = dict[str, Any]


def describe(
    problem: HarmonicBalance,
    unknowns: FloatArray,
    frequency: float,
    iterations: int = 0,
    stability: bool = False,
) -> Table:
    """All results at one point; ``frequency`` in Hz. A point that is no solution becomes NaN.

    ``stability`` adds the growth of small motions beside the response.
    """
    evaluation = problem.evaluate(unknowns, RADIANS * frequency)
    friction, stiffness = evaluation.friction, problem.contact_stiffness
    coefficients = problem.everywhere(unknowns)
    relative = problem.relative(unknowns)
    force = stiffness[:, None] * np.einsum("cij,cj->ci", friction.matrix, relative)
    force += problem.slip_limit[:, None] * friction.vector
    # Work of the friction force over a period: the integral of f dy.
    velocity = relative @ problem.basis.derivative_matrix.T
    converged = bool(evaluation.norm <= ACCEPTED)
    sampled = {} if problem.samples is None else _sampling(problem, unknowns, frequency)
    result: Table = dict(
        coefficient=by_harmonic(problem.basis, coefficients),
        amplitude=largest_displacement(problem.basis, coefficients)[0],
        theta_0=friction.theta_0,
        theta_star=friction.theta_star,
        stick_fraction=friction.stick_fraction,
        dissipation=np.einsum("ci,ci->c", force, velocity / problem.basis.norm),
        residual_norm=np.float64(evaluation.norm),
        **sampled,
    )
    if not converged:
        result = {
            name: value if name == "residual_norm" else np.full_like(value, np.nan)
            for name, value in result.items()
        }
    if stability:
        omega = RADIANS * frequency
        rate = growth_rate(problem, omega, evaluation, unknowns) if converged else np.nan
        result["growth_rate"] = np.float64(rate)
        result["stability"] = np.int8(verdict(rate, omega))
    rubs = converged & (stiffness > 0)
    states = dict(
        contact_state=np.where(rubs, friction.slip, -1).astype(np.int8),
        reversals=np.where(converged, friction.reversals, -1).astype(np.int32),
    )
    return _of_all_contacts(problem, result | states) | dict(
        converged=np.bool_(converged),
        contact_model_valid=np.bool_(converged),
        iterations=np.int32(iterations),
    )


def _of_all_contacts(problem: HarmonicBalance, table: Table) -> Table:
    """Results of the contacts of one sector as those of all: each lags, and does the same."""
    symmetry = problem.symmetry
    if symmetry is None:
        return table
    lags = symmetry.contact_lags()
    spread = {
        name: symmetry.spread_contacts(table[name])
        for name in ("stick_fraction", "dissipation", "contact_state", "reversals")
    }
    for name in ("theta_0", "theta_star"):
        spread[name] = (symmetry.spread_contacts(table[name]) + lags) % (2 * np.pi)
    return table | spread


def _sampling(problem: HarmonicBalance, unknowns: FloatArray, frequency: float) -> Table:
    """Error of a response with sampled friction: one Newton step with located angles."""
    exact = problem.located().evaluate(unknowns, RADIANS * frequency)
    step = Factorisation(exact.jacobian).solve(exact.residual)
    error = np.nan if step is None else np.linalg.norm(step) / (np.linalg.norm(unknowns) or 1.0)
    return {"sampling_error": np.float64(error)}


def nothing(
    problem: HarmonicBalance, frequency: float, iterations: int = 0, stability: bool = False
) -> Table:
    """The entry of a point without a solution."""
    table = describe(problem, np.zeros(problem.n_unknowns), frequency, iterations, stability)
    for name, value in table.items():
        if value.dtype.kind == "f":
            table[name] = np.full_like(value, np.nan)
    states = ("contact_state", "reversals", *(("stability",) if stability else ()))
    flags = ("converged", "contact_model_valid")
    return (
        table
        | {name: np.full_like(table[name], -1) for name in states}
        | {name: np.bool_(False) for name in flags}
    )


def by_harmonic(basis: FourierBasis, coefficients: FloatArray) -> FloatArray:
    """Coefficients (n, n_components) as (n, n_harmonics, 2); the sine of harmonic 0 is 0."""
    result = np.zeros((len(coefficients), len(basis.harmonics), 2))
    at = np.searchsorted(basis.harmonics, basis.order)
    result[:, at, basis.is_sine.astype(int)] = coefficients
    return result
