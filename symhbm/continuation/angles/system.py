"""Bordered system of Eqs. (4)-(11): one parameter is unknown too, and one constraint added.

The unknowns are the coefficients, both angles of every contact and the parameter that moves. The
constraint is a plane, or ``rho = 1`` for one contact: there slip begins or ends, as the spring
force just reaches the limit.
"""

from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.balance import Equations, HarmonicBalance, SwitchingAngles
from symhbm.continuation.angles.solvers import casadi_solver, row_scales
from symhbm.continuation.correctors import MAX_CORRECTIONS, STAGNATION, Constraint
from symhbm.continuation.newton import TOLERANCE
from symhbm.continuation.problem import ContinuationProblem, ParameterProblem
from symhbm.numerics import DENSE_LIMIT, Assembly, Compiled, Factorisation, FloatArray

_LARGEST_REDUCTION = 0.9
"""Largest reduction of ``rho`` in one step, over its value: it stays positive."""


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


_SYSTEMS: WeakKeyDictionary[Equations, dict[str, AngleSystem]] = WeakKeyDictionary()


def angle_system(problem: HarmonicBalance, moving: str) -> AngleSystem:
    """The system of a problem along a parameter, shared by all its copies by with_parameters."""
    systems = _SYSTEMS.setdefault(problem.equations, {})
    if moving not in systems:
        systems[moving] = AngleSystem(SwitchingAngles(problem), moving)
    return systems[moving]
