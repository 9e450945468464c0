"""Eqs. (4)-(11) with the switching angles as unknowns at one frequency, by a solver of a name.

They have false solutions, and no solution where a contact reverses while it slips. So a solver
starts from the solution with located angles, and its result must be that solution.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symhbm.balance import Evaluation, HarmonicBalance
from symhbm.continuation.angles.solvers import check_angles, two_angles
from symhbm.continuation.angles.system import angle_system
from symhbm.continuation.correctors import Hyperplane, unit_parameter
from symhbm.continuation.newton import ACCEPTED, newton
from symhbm.continuation.problem import FrequencyProblem
from symhbm.continuation.start import solve_point
from symhbm.numerics import FloatArray, check

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
    start : (n_unknowns of `SwitchingAngles`,)
        Where the solver starts; by default at the located solution.

    Raises
    ------
    TypeError, ValueError
        For a solver of another name, a bad frequency, arrays of another shape, harmonics that are
        not odd, or sampled friction.
    """
    check_angles(problem, solver)
    frequency = check.scalar("frequency", frequency, "non-negative")
    system = angle_system(problem, "frequency")
    angles = system.angles
    if located_unknowns is None:
        located = solve_point(problem, frequency).unknowns
    else:
        located = _vector("located_unknowns", located_unknowns, problem.n_unknowns)
    reference, slip = angles.start(problem, located)
    first = reference if start is None else _vector("start", start, angles.n_unknowns)
    evaluation = problem.evaluate(located, frequency)
    if evaluation.norm > ACCEPTED:
        return _result(problem, AngleStatus.NOT_LOCATED, np.zeros(len(slip), bool))
    applies = angles.applies(problem, located, *two_angles(angles, reference, slip))
    if not applies.all():
        return _result(problem, AngleStatus.DOES_NOT_APPLY, applies)

    point, scale = np.append(located, frequency), np.full(len(located) + 1, frequency or 1.0)
    scale[:-1] = np.abs(located).max(initial=0.0) or 1.0
    plane = Hyperplane(point, scale, unit_parameter(len(point)))
    bordered = system.bordered(FrequencyProblem(problem), point, plane, slip)
    bordered = bordered._replace(start=np.append(first, frequency) / bordered.column)

    def evaluate(point: FloatArray) -> Evaluation:
        residual, jacobian = system.evaluate(point, bordered.values)
        return replace(evaluation, residual=residual, magnitude=1.0, jacobian=jacobian)

    if solver == "newton":
        result = newton(evaluate, bordered.start)
        found, iterations = result.unknowns, result.iterations
    else:
        found, iterations = system.by_casadi(solver, bordered, 1 / angles.split(reference)[2])
    # The negated comparison is also true of NaN.
    if not np.abs(system.evaluate(found, bordered.values)[0]).max() <= ACCEPTED:
        return _result(problem, AngleStatus.NO_CONVERGENCE, applies, iterations)

    unknowns = (found * bordered.column)[:-1]
    solution = (angles.split(unknowns)[0], *two_angles(angles, unknowns, slip))
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
