"""Eqs. (4)-(11) with the switching angles as unknowns at one frequency, by a solver of a name.

They have false solutions, and no solution where a contact reverses while it slips. So a solver
starts from the solution with located angles, and its result must be that solution.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symhbm.balance import Evaluation, HarmonicBalance, SwitchingAngles
from symhbm.continuation.angles.solvers import (
    by_casadi,
    casadi_solver,
    check_angles,
    row_scales,
    two_angles,
)
from symhbm.continuation.newton import ACCEPTED, newton
from symhbm.continuation.start import solve_point
from symhbm.numerics import DENSE_LIMIT, FloatArray, check

AGREEMENT = 1e-9
"""Largest distance from the located solution, relative to it."""


class AngleStatus(StrEnum):
    """Outcome of a solver; the value of each member is the sentence shown to the user."""

    SUCCESS = "success"
    NOT_LOCATED = (
        "there is no solution with located angles to start from and to check against; "
        "try another frequency"
    )
    DOES_NOT_APPLY = (
        "the form with switching angles as unknowns does not apply: a contact reverses while it "
        "slips (applies is false for it); use located angles"
    )
    NO_CONVERGENCE = "the solver did not converge; try another solver, or located angles"
    FALSE_SOLUTION = (
        "the solver went to a false solution: for a contact (applies is false for it) theta_0 is "
        "not where the relative displacement is largest, the motion reverses during slip, or the "
        "force exceeds the limit; try another solver, or located angles"
    )
    OTHER_SOLUTION = (
        "the solver went to another solution than that with located angles; try another solver, "
        "or located angles"
    )


@dataclass(frozen=True)
class AngleResult:
    """Result of a solver; coefficients and angles are NaN unless it is the solution.

    ``unknowns`` (problem.n_unknowns,), the coefficients [m]; ``theta_0``, ``theta_star``
    (n_contacts,) in rad from 0 to 2 pi, NaN where a contact does not slip; ``iterations`` of the
    solver; ``applies`` (n_contacts,), which contacts move as Eqs. (4)-(11) assume at the last
    point that was checked; ``difference`` from the located solution, relative to it, NaN
    where the equations are not solved.
    """

    unknowns: FloatArray
    theta_0: FloatArray
    theta_star: FloatArray
    iterations: int
    status: AngleStatus
    applies: NDArray[np.bool_]
    difference: float

    @property
    def converged(self) -> bool:
        """Whether the point solves the equations and is the located solution."""
        return self.status == AngleStatus.SUCCESS


def solve_angles(
    problem: HarmonicBalance,
    frequency: float,
    solver: str,
    located_unknowns: ArrayLike | None = None,
    *,
    start: ArrayLike | None = None,
    angles: SwitchingAngles | None = None,
) -> AngleResult:
    """Solve Eqs. (4)-(11) at one angular ``frequency`` [rad/s], the angles being unknowns.

    Parameters
    ----------
    problem, frequency
        The problem to solve, and the angular frequency [rad/s].
    solver
        ``"newton"`` (this package's), ``"rootfinder"`` (CasADi's) or ``"ipopt"``.
    located_unknowns : (problem.n_unknowns,)
        The located solution [m]; by default it is solved for.
    start : (angles.n_unknowns,)
        Where the solver starts; by default at the located solution.
    angles
        Equations and solvers to use again, for many points or parameter sets.

    Raises
    ------
    TypeError, ValueError
        For a solver of another name, a bad frequency, arrays of another shape, harmonics that are
        not odd, sampled friction, or ``angles`` of another problem.
    """
    check_angles(problem, solver)
    frequency = check.scalar("frequency", frequency, "non-negative")
    angles = SwitchingAngles(problem) if angles is None else angles
    if located_unknowns is None:
        located = solve_point(problem, frequency).unknowns
    else:
        located = _vector("located_unknowns", located_unknowns, problem.n_unknowns)
    reference, slip = angles.start(problem, located)
    first = reference if start is None else _vector("start", start, angles.n_unknowns)
    inputs = angles.arguments(problem, reference, frequency, slip)
    evaluation = problem.evaluate(located, frequency)
    if evaluation.norm > ACCEPTED:
        return _result(problem, AngleStatus.NOT_LOCATED, np.zeros(len(slip), bool))
    applies = angles.applies(problem, located, *two_angles(angles, reference, slip))
    if not applies.all():
        return _result(problem, AngleStatus.DOES_NOT_APPLY, applies)

    coefficients, _, rho = angles.split(reference)
    response = np.full(len(coefficients), np.abs(coefficients).max(initial=0.0) or 1.0)
    column = np.concatenate([response, np.ones(len(slip)), rho])
    row = row_scales(problem, coefficients, rho, slip, evaluation.magnitude or 1.0)
    data = [*inputs.values()][1:]
    values = np.concatenate([np.ravel(a, order="F") for a in (*data, column, row)])
    point, iterations = _solved(solver, angles, first / column, values, 1 / rho, evaluation)
    residual = np.asarray(_scaled(angles)(point, values)[0].full())
    # The negated comparison is also true of NaN.
    if not np.abs(residual).max() <= ACCEPTED:
        return _result(problem, AngleStatus.NO_CONVERGENCE, applies, iterations)

    solution = (angles.split(point * column)[0], *two_angles(angles, point * column, slip))
    applies = angles.applies(problem, *solution)
    difference = float(np.linalg.norm(solution[0] - located) / (np.linalg.norm(located) or 1.0))
    if not applies.all():
        return _result(problem, AngleStatus.FALSE_SOLUTION, applies, iterations, difference)
    if difference > AGREEMENT or problem.evaluate(solution[0], frequency).norm > ACCEPTED:
        return _result(problem, AngleStatus.OTHER_SOLUTION, applies, iterations, difference)
    return _result(problem, AngleStatus.SUCCESS, applies, iterations, difference, solution)


def _result(
    problem, status, applies, iterations=0, difference=np.nan, solution=None
) -> AngleResult:
    if solution is None:
        sizes = problem.n_unknowns, len(applies), len(applies)
        solution = [np.full(size, np.nan) for size in sizes]
    coefficients, theta_0, theta_star = solution
    two_angles = theta_0 % (2 * np.pi), theta_star % (2 * np.pi)
    return AngleResult(coefficients, *two_angles, iterations, status, applies, difference)


def _vector(name: str, value: ArrayLike, size: int) -> FloatArray:
    result = check.array(name, value)
    if result.shape != (size,):
        raise ValueError(f"{name}: expected shape {(size,)}, got {result.shape}")
    return result


def _problem(angles: SwitchingAngles) -> dict[str, ca.SX]:
    """Scaled unknowns, data and scaled equations, by CasADi's names for them."""
    function = angles.residual
    point, column, row = (ca.SX.sym(name, angles.n_unknowns) for name in ("x", "column", "row"))
    data = [ca.SX.sym(name, function.sparsity_in(name)) for name in function.name_in()[1:]]
    residual = function.call([point * column, *data])[0] / row
    return {"x": point, "p": ca.veccat(*data, column, row), "g": residual}


def _scaled(angles: SwitchingAngles) -> ca.Function:
    """CasADi function of the scaled equations and their Jacobian."""
    if "scaled" not in angles.compiled:
        named = _problem(angles)
        outputs = [named["g"], ca.jacobian(named["g"], named["x"])]
        angles.compiled["scaled"] = ca.Function("scaled", [named["x"], named["p"]], outputs)
    return angles.compiled["scaled"]


def _solved(
    solver: str,
    angles: SwitchingAngles,
    start: FloatArray,
    values: FloatArray,
    highest: FloatArray,
    located: Evaluation,
) -> tuple[FloatArray, int]:
    """Scaled result of a solver, and its iterations; ``highest`` is that of ``rho``."""
    if solver == "newton":
        return _newton(angles, start, values, located)
    if solver not in angles.compiled:
        angles.compiled[solver] = casadi_solver(solver, _problem(angles))
    return by_casadi(solver, angles.compiled[solver], angles, start, values, highest)


def _newton(angles, start, values, located: Evaluation) -> tuple[FloatArray, int]:
    def evaluate(point: FloatArray) -> Evaluation:
        residual, jacobian = _scaled(angles)(point, values)
        matrix = jacobian.full() if len(point) <= DENSE_LIMIT else jacobian.sparse()
        residual = np.asarray(residual.full())[:, 0]
        return replace(located, residual=residual, magnitude=1.0, jacobian=matrix)

    result = newton(evaluate, start)
    return result.unknowns, result.iterations
