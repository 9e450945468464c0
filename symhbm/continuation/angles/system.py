"""Bordered system of Eqs. (4)-(11): one parameter is unknown too, and one constraint added.

The unknowns are the coefficients, both angles of every contact and the parameter that moves. The
constraint is a plane, or ``rho = 1`` for one contact: there slip begins or ends, as the spring
force just reaches the limit. At one frequency a solver of a name solves them.

They have false solutions, and no solution where a contact reverses while it slips. So a solver
starts from the solution with located angles, and its result must be that solution.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symhbm.balance import Evaluation, HarmonicBalance, SwitchingAngles
from symhbm.continuation.angles.solvers import casadi_solver, check_angles, row_scales, two_angles
from symhbm.continuation.correctors import (
    MAX_CORRECTIONS,
    STAGNATION,
    Constraint,
    Hyperplane,
    unit_parameter,
)
from symhbm.continuation.newton import ACCEPTED, TOLERANCE, newton
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem, ParameterProblem
from symhbm.continuation.start import solve_point
from symhbm.numerics import DENSE_LIMIT, Assembly, Compiled, Factorisation, FloatArray, check

_LARGEST_REDUCTION = 0.9
"""Largest reduction of ``rho`` in one step, over its value: it stays positive."""
AGREEMENT = 1e-9
"""Largest distance from the located solution, relative to it."""


class Bordered(NamedTuple):
    """The scaled system of one correction.

    ``start`` (n + 2 n_contacts + 1,), the scaled unknowns to start from; ``values``, all other
    inputs; ``column`` (n + 2 n_contacts + 1,), the scales of the unknowns.
    """

    start: FloatArray
    values: FloatArray
    column: FloatArray


class AngleSystem:
    """The bordered equations along one parameter, compiled once for all parameter sets.

    ``moving`` is the name of the parameter, or ``"frequency"``. `solve` takes the `Bordered` system
    of one correction, `evaluate` its values.
    """

    def __init__(self, angles: SwitchingAngles, moving: str):
        self.angles = angles
        self._moving = moving
        self._solvers: dict[str, ca.Function] = {}
        function = angles.residual
        n, n_contacts = angles.n_coefficients, angles.n_contacts
        size = angles.n_unknowns + 1
        point = ca.SX.sym("x", size)
        data = {
            name: ca.SX.sym(name, function.sparsity_in(name)) for name in function.name_in()[1:]
        }
        chosen = ca.SX.sym("chosen", data[moving].shape[0])
        column, row = ca.SX.sym("column", size), ca.SX.sym("row", size - 1)
        normal, anchor = ca.SX.sym("normal", n + 1), ca.SX.sym("anchor", n + 1)
        limit = ca.SX.sym("limit", n_contacts)
        state = point * column
        inputs_here = data | {moving: chosen * state[-1] + (1 - chosen) * data[moving]}
        residual = function.call([state[:-1], *inputs_here.values()])[0] / row
        curve_point = ca.vertcat(point[:n], point[-1])
        plane = ca.dot(normal, curve_point - anchor)
        rho = state[n + n_contacts : -1]
        constraint = plane + ca.dot(limit, rho - 1)
        inputs = ca.veccat(*data.values(), chosen, column, row, normal, anchor, limit)
        self._program = {"x": point, "p": inputs, "g": ca.vertcat(residual, constraint)}
        jacobian = ca.jacobian(self._program["g"], point)
        outputs = [ca.densify(self._program["g"]), jacobian]
        scaled = ca.Function("bordered", [point, inputs], outputs)
        self._assemble = Assembly(scaled.sparsity_out(1), size <= DENSE_LIMIT)
        self._scaled = Compiled(scaled)

    def bordered(
        self,
        curve: ContinuationProblem,
        guess: FloatArray,
        constraint: Constraint,
        slip: NDArray[np.bool_],
    ) -> Bordered:
        """The system of a correction, which starts from ``guess`` and the angles of its motion."""
        (problem, frequency), scale = curve.at(float(guess[-1])), constraint.scale
        limit, (normal, anchor) = np.zeros(len(slip)), np.zeros((2, len(guess)))
        constraint.write(normal, anchor, limit)
        first, slips = self.angles.start(problem, guess[:-1], slip | (limit > 0))
        coefficients, theta_0, rho = self.angles.split(first)
        rho = np.where(limit > 0, 1.0, rho)
        evaluation = curve.evaluate(guess[:-1], float(guess[-1]), slip)
        column = np.concatenate([scale[:-1], np.ones(len(rho)), rho, scale[-1:]])
        row = row_scales(problem, coefficients, rho, slips, evaluation.magnitude or 1.0)
        named = self.angles.arguments(problem, first, frequency, slips, evaluation.states)
        data = [np.ravel(array, order="F") for array in [*named.values()][1:]]
        chosen = np.ones(1)
        if isinstance(curve, ParameterProblem):
            chosen = np.atleast_1d(curve.chosen(problem))
        values = np.concatenate([*data, chosen, column, row, normal, anchor / scale, limit])
        start = np.concatenate([coefficients, theta_0, rho, guess[-1:]])
        return Bordered(start / column, values, column)

    def evaluate(self, point: FloatArray, values: FloatArray) -> tuple[FloatArray, Any]:
        """Scaled equations, the constraint last, and their Jacobian."""
        residual, entries = self._scaled(point, values)
        return residual, self._assemble(entries)

    def solve(self, solver: str, system: Bordered, precision: float) -> tuple[FloatArray, int]:
        """Scaled result of a solver, NaN where it fails, and the number of linear solves."""
        if solver == "newton":
            return self._newton(system, precision)
        point, iterations = self.by_casadi(solver, system)
        return point, max(iterations, 1)

    def by_casadi(
        self, solver: str, system: Bordered, highest: FloatArray | float = np.inf
    ) -> tuple[FloatArray, int]:
        """Scaled result of a solver of CasADi, NaN where it fails, and its iterations.

        ``highest`` is the largest scaled ``rho`` (n_contacts,).
        """
        if solver not in self._solvers:
            self._solvers[solver] = casadi_solver(solver, self._program)
        n, count, start = self.angles.n_coefficients, self.angles.n_contacts, system.start
        theta_0, rho = slice(n, n + count), slice(n + count, n + 2 * count)
        low, bounds = np.full(len(start), -np.inf), {}
        if solver == "ipopt":
            high = -low
            around = (start[theta_0] + turn for turn in (-np.pi / 2, np.pi / 2))
            low[theta_0], high[theta_0] = around
            low[rho], high[rho] = 0.0, highest
            bounds = dict(lbx=low, ubx=high, lbg=0.0, ubg=0.0)
        function = self._solvers[solver]
        try:
            point = np.asarray(function(x0=start, p=system.values, **bounds)["x"].full())
        except RuntimeError:
            return np.full(len(start), np.nan), 1
        return point[:, 0], int(function.stats()["iter_count"])

    def _newton(self, system: Bordered, precision: float) -> tuple[FloatArray, int]:
        """Newton's method on all unknowns at once."""
        n, count = self.angles.n_coefficients, self.angles.n_contacts
        rho = slice(n + count, n + 2 * count)
        point, last_step, solves = system.start, np.inf, 0
        while True:
            residual, jacobian = self.evaluate(point, system.values)
            on_curve = np.abs(residual).max() <= TOLERANCE
            if on_curve and last_step <= precision:
                return point, solves
            step = Factorisation(jacobian).solve(-residual)
            if step is None or solves == MAX_CORRECTIONS:
                break
            solves += 1
            previous, last_step = last_step, float(np.linalg.norm(step))
            if solves > 3 and last_step > previous and on_curve:
                return point, solves
            falls = step[rho] < 0
            shares_to_zero = -point[rho][falls] / step[rho][falls]
            point = point + min(1.0, _LARGEST_REDUCTION * shares_to_zero.min(initial=np.inf)) * step
        # Round-off alone may leave more than the tolerance.
        return (point if last_step <= STAGNATION else np.full(len(point), np.nan)), solves


def angle_system(problem: HarmonicBalance, moving: str) -> AngleSystem:
    """The system of a problem along a parameter, shared by all its copies by with_parameters."""
    key = "angles", moving
    return problem.equations.once(key, lambda: AngleSystem(SwitchingAngles(problem), moving))


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
