"""Points and branches with the switching angles as unknowns, by a solver chosen by name.

The equations have false solutions. So a result of the solver is a point only if each contact moves
as Eqs. (4)-(11) assume and if located friction along the motion leaves no residual. Contact states
are held over a step, as on every path; slip begins or ends where ``rho = 1``.

The form applies in parts of a band. Where a branch ends because a contact begins to reverse while
it slips, it may apply again beyond. A solution there starts the next branch, which is followed back
to its first point and from there to its last.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import Evaluation
from symhbm.continuation.angles.solvers import two_angles
from symhbm.continuation.angles.system import AngleSystem, angle_system
from symhbm.continuation.branch import Branch
from symhbm.continuation.correctors import (
    Constraint,
    Hyperplane,
    StepwiseCorrector,
    crossed,
    unit_parameter,
)
from symhbm.continuation.following import chained, follow_with
from symhbm.continuation.newton import ACCEPTED, TOLERANCE, NewtonResult
from symhbm.continuation.path import Path
from symhbm.continuation.problem import ContinuationProblem, Corrected, ParameterProblem
from symhbm.continuation.start import linear_response, solve_point
from symhbm.continuation.status import Status
from symhbm.numerics import Factorisation, FloatArray

_WEAK, _STRONG = 0.5, 1e3
"""Forces to start from: a share of that at which slip begins, and a multiple of that at which all
contacts slip."""
_FREE_RADIUS = 10.0
"""Largest distance of a solution at a fixed value from its guess, relative to the response."""


class AngleCorrector(StepwiseCorrector):
    """Corrects guesses onto a curve in the coefficients and the switching angles."""

    def __init__(self, curve: ContinuationProblem, solver: str):
        super().__init__(curve)
        moving = curve.name if isinstance(curve, ParameterProblem) else "frequency"
        self.solver = solver
        self._system: AngleSystem = angle_system(curve.problem, moving)

    def correct(
        self,
        guess: FloatArray,
        constraint: Constraint,
        switches: NDArray[np.bool_],
        precision: float = 1e-6,
        radius: float = 0.5,
    ) -> Corrected | None:
        """Solve from ``guess`` and the angles of its motion; arguments as of `Corrector`."""
        scale = constraint.scale
        try:
            with np.errstate(all="ignore"):
                system = self._system.bordered(self.curve, guess, constraint, switches)
                solution, solves = self._system.solve(self.solver, system, precision)
        except ArithmeticError:
            return None
        self.solves += solves
        scaled = np.append(solution[: len(guess) - 1], solution[-1])
        if not np.linalg.norm(scaled - guess / scale) <= radius:
            return None
        point = scaled * scale
        try:
            evaluation = self.curve.evaluate(point[:-1], point[-1], switches)
        except ArithmeticError:
            return None
        _, theta_0, rho = self._system.angles.split((solution * system.column)[:-1])
        if not self._is_valid(point, theta_0, rho, switches, evaluation):
            return None
        _, row = constraint(point, evaluation)
        return self._with_tangent(evaluation, Hyperplane(point, scale, row), guess, switches)

    def tangent_along(
        self, point: FloatArray, plane: Hyperplane, switches: NDArray[np.bool_]
    ) -> Corrected | None:
        """As `Corrector.tangent_along`."""
        evaluation = self.curve.evaluate(point[:-1], point[-1], switches)
        return self._with_tangent(evaluation, plane, point, switches)

    def free(self, unknowns: FloatArray, value: float) -> NewtonResult:
        """Solution at a value near ``unknowns``, in the contact states of its own motion."""
        solves_before = self.solves
        point = np.append(unknowns, value)
        problem, frequency = self.curve.at(value)
        switches = problem.locate(unknowns, frequency).switches
        status = Status.NO_CONVERGENCE
        for _ in range(2 + len(switches)):
            plane = Hyperplane(point, self.curve.scale(point), unit_parameter(len(point)))
            solution = self.correct(point, plane, switches, radius=_FREE_RADIUS)
            if solution is None:
                break
            point = np.append(solution.point[:-1], value)
            switches = switches ^ crossed(solution.margins, switches)
            if not solution.crosses and solution.residual_norm <= TOLERANCE:
                status = Status.SUCCESS
                break
        evaluation = self.curve.evaluate(point[:-1], value)
        return NewtonResult(point[:-1], evaluation, self.solves - solves_before, status)

    def solve_from_scratch(self, value: float) -> NewtonResult:
        """Solution at a value without a neighbouring solution, followed from a linear response.

        The force grows from an amplitude at which no contact slips, or falls from one at which
        friction hardly acts. Where located friction shows that the form does not apply, there is
        none.
        """
        solves_before = self.solves
        problem, frequency = self.curve.at(value)
        amplitude, stuck = problem.excitation.amplitude, linear_response(problem, frequency)
        applies = self.applies(value) is not False
        if stuck is None or not applies:
            at_rest = np.zeros(problem.n_unknowns)
            status = Status.SYSTEM_SINGULAR if applies else Status.NO_CONVERGENCE
            return NewtonResult(at_rest, problem.evaluate(at_rest, frequency), 1, status)
        margins = problem.locate(stuck, frequency).margins
        margins = margins[np.isfinite(margins)]
        result = self.free(stuck, value)
        if result.converged or not margins.size or margins.max() <= 0:
            return result
        curve = ParameterProblem(problem, "force_amplitude", frequency)
        frictionless = linear_response(problem.released(), frequency)
        starts = [(stuck, _WEAK * np.exp(-margins.max()))]
        if frictionless is not None:
            starts.append((frictionless, _STRONG * np.exp(-margins.min())))
        for linear, share in starts:
            corrector = AngleCorrector(curve, self.solver)
            first = corrector.free(share * linear, share * amplitude)
            if first.converged:
                start = share * amplitude
                end = Path(curve, first.unknowns, start, amplitude, corrector).end()
                result = result if end is None else self.free(end.unknowns, value)
            self.solves += corrector.solves
            if result.converged:
                break
        return replace(result, iterations=self.solves - solves_before)

    def applies(self, value: float) -> bool | None:
        """Whether the form applies to the response with located angles, None without one."""
        problem, frequency = self.curve.at(value)
        located = solve_point(problem, frequency)
        if not located.converged:
            return None
        angles = self._system.angles
        unknowns, switches = angles.start(problem, located.unknowns)
        thetas = two_angles(angles, unknowns, switches)
        return bool(angles.applies(problem, located.unknowns, *thetas).all())

    def _is_valid(
        self,
        point: FloatArray,
        theta_0: FloatArray,
        rho: FloatArray,
        switches: NDArray[np.bool_],
        evaluation: Evaluation,
    ) -> bool:
        """Whether a result of the solver is a motion of Eqs. (4)-(11), and no false solution."""
        if not evaluation.norm <= ACCEPTED:
            return False
        problem, _ = self.curve.at(float(point[-1]))
        past_limit = crossed(evaluation.states.margins, switches)
        _, _, stiffness, limit = problem.contacts.sliders()
        slides = switches & (limit > 0) & (stiffness > 0)
        at_limit = slides & (rho >= 1 - ACCEPTED)
        angles = self._system.angles
        unknowns = np.concatenate([point[:-1], theta_0, rho])
        thetas = two_angles(angles, unknowns, slides & ~at_limit)
        applies = angles.applies(problem, point[:-1], *thetas)
        return bool(np.all(applies | past_limit | at_limit | ~slides))

    def _with_tangent(
        self,
        evaluation: Evaluation,
        plane: Hyperplane,
        guess: FloatArray,
        switches: NDArray[np.bool_],
    ) -> Corrected | None:
        """The point in a plane with the tangent of the equations in all their unknowns."""
        point = plane.anchor
        with np.errstate(all="ignore"):
            system = self._system.bordered(self.curve, point, plane, switches)
            _, jacobian = self._system.evaluate(system.start, system.values)
        self.solves += 1
        direction = Factorisation(jacobian).solve(unit_parameter(len(system.start)))
        if direction is None:
            return None
        direction = np.append(direction[: len(point) - 1], direction[-1])
        direction /= np.linalg.norm(direction)
        sign = 1 if direction[-1] >= 0 else -1
        at = evaluation, 0.0, plane.normal
        return self._corrected(point, at, plane.scale, direction, sign, guess, switches)


_BEYOND = 1e-5
"""Distance beyond the end of a branch, relative, at which located friction tells why it ended."""
ANGLES_ENDED = (Status.ANGLES_DO_NOT_APPLY, Status.ANGLES_NOT_CONVERGED)


def angle_branches(
    curve: ContinuationProblem, band: tuple[float, float], max_points: int, per_dof: bool
) -> list[Branch]:
    """The branches over the parts of a band in which the form applies, in the order of the band.

    The first begins where the band does; it has no points where the form does not apply there.
    """

    def follow(part: tuple[float, float], guess: FloatArray | None) -> Branch:
        return _angle_branch(curve, part, max_points, per_dof, guess)

    def applies(branch: Branch, value: float) -> bool | None:
        assert isinstance(branch.corrector, AngleCorrector)
        return branch.corrector.applies(value)

    return chained(follow, band, ANGLES_ENDED, applies)


def _angle_branch(
    curve: ContinuationProblem,
    band: tuple[float, float],
    max_points: int,
    per_dof: bool,
    guess: FloatArray | None = None,
) -> Branch:
    """One branch; arguments as of `follow_branch`."""
    assert curve.angles is not None
    corrector = AngleCorrector(curve, curve.angles)
    branch = follow_with(corrector, corrector.solve_from_scratch, band, max_points, per_dof, guess)
    if branch.status not in (Status.NO_START, Status.MINIMUM_STEP):
        return branch
    # Located friction tells whether the form applies where the branch ends.
    start, end = band
    value = start
    if branch.points:
        last = branch.points[-1].state
        distance = min(_BEYOND * curve.scale(last)[-1], abs(end - last[-1]))
        value = last[-1] + (distance if end > start else -distance)
    applies = corrector.applies(float(value))
    if applies is None:
        return branch
    ended = Status.ANGLES_NOT_CONVERGED if applies else Status.ANGLES_DO_NOT_APPLY
    return replace(branch, status=ended)


def covered(branches: Sequence[Branch], unit: float, band: tuple[float, float]) -> float:
    """Share of a band, in a ``unit`` of its values, that branches cover with points."""
    if all(branch.status == Status.REACHED_END for branch in branches):
        return 1.0
    ends = [
        (branch.points[0].value, branch.points[-1].value) for branch in branches if branch.points
    ]
    lengths = [abs(last - first) for first, last in ends]
    return sum(lengths) / (unit * abs(band[1] - band[0]))
