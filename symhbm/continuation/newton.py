"""Newton's method with a line search on the residual, for one solution or, deflated, for another.

Deflated equations are multiplied by ``1 + 1/|x - known|^2`` for each known solution, lengths
relative to the first, so that these no longer solve them. A Newton step of the deflated equations
has the direction of a step of the original equations and another length.

Reference: P. E. Farrell, A. Birkisson, S. W. Funke, Deflation techniques for finding distinct
solutions of nonlinear partial differential equations, SIAM J. Sci. Comput. 37, 2015.
"""

import contextlib
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from symhbm.balance import Evaluation
from symhbm.continuation.status import Status
from symhbm.numerics import Factorisation, FloatArray
from symhbm.numerics.loops import Loop

TOLERANCE = 1e-12
"""Largest residual over the largest sum of absolute force terms: some thousand round-offs."""
ACCEPTED = 10 * TOLERANCE
"""Largest residual norm with free contacts of a point solved with its contact states held."""
PRECISION = 1e-6
"""Largest last step relative to the response: convergence is quadratic, the error its square."""
MAX_ITERATIONS = 60
SMALLEST_STEP = 2.0**-12
"""Share of a Newton step below which the line search gives up."""
_MOST_FULL = 15
"""Iterations without a line search: those that get there need fewer, even across corners."""


@dataclass(frozen=True)
class NewtonResult:
    """Last point of an iteration: ``unknowns`` (n_unknowns,) [m] and how they were reached.

    ``iterations`` counts linear solves; ``evaluation`` belongs to ``unknowns``.
    """

    unknowns: FloatArray
    evaluation: Evaluation
    iterations: int
    status: Status

    @property
    def converged(self) -> bool:
        """Whether the residual is below the tolerance."""
        return self.status == Status.SUCCESS


def newton(
    evaluate: Callable[[FloatArray], Evaluation], start: FloatArray, damped: bool = True
) -> NewtonResult:
    """Solve the equations ``evaluate`` gives, from the unknowns ``start`` (n_unknowns,) [m].

    Steps that are not ``damped`` are full ones: they do not stall at corners, where the Jacobian
    jumps, and end at any one solution.
    """
    unknowns = np.array(start, dtype=float)
    evaluation = evaluate(unknowns)
    last_step = np.inf
    if np.isnan(evaluation.norm):
        return NewtonResult(unknowns, evaluation, 0, Status.UNDEFINED_FORCE)
    most = MAX_ITERATIONS if damped else _MOST_FULL
    for iteration in range(most):
        if evaluation.norm <= TOLERANCE and last_step <= PRECISION:
            return NewtonResult(unknowns, evaluation, iteration, Status.SUCCESS)
        step = Factorisation(evaluation.jacobian).solve(-evaluation.residual)
        if step is None:
            return NewtonResult(unknowns, evaluation, iteration + 1, Status.SYSTEM_SINGULAR)
        merit = np.linalg.norm(evaluation.residual)
        length, defined = 1.0, True
        while length >= SMALLEST_STEP:
            # A step that overflows is too long.
            with contextlib.suppress(ArithmeticError):
                trial = evaluate(unknowns + length * step)
                decrease = (1 - 1e-4 * length) * merit if damped else np.inf
                defined &= not np.isnan(trial.norm)
                if trial.norm <= TOLERANCE or np.linalg.norm(trial.residual) <= decrease:
                    break
            length /= 2
        else:
            status = Status.NO_CONVERGENCE if defined else Status.UNDEFINED_FORCE
            return NewtonResult(unknowns, evaluation, iteration + 1, status)
        unknowns, evaluation = unknowns + length * step, trial
        last_step = np.linalg.norm(step) / (np.linalg.norm(unknowns) or 1.0)
    status = Status.SUCCESS if evaluation.norm <= TOLERANCE else Status.NO_CONVERGENCE
    return NewtonResult(unknowns, evaluation, most, status)


def step_of(evaluation: Evaluation) -> tuple[float, FloatArray | None]:
    """Norm of equations and Newton's step, None where their Jacobian is singular."""
    return evaluation.norm, Factorisation(evaluation.jacobian).solve(-evaluation.residual)


def slope_of(evaluation: Evaluation) -> FloatArray:
    """Derivative (n_unknowns,) of a solution by the parameter, NaN where there is none."""
    slope = Factorisation(evaluation.jacobian).solve(-evaluation.by_parameter)
    return np.full(len(evaluation.residual), np.nan) if slope is None else slope


DISTINCT = 1e-6
"""Distance of two different solutions, relative to one of them."""
NEAR = 1e-6
"""Residual norm below which Newton's method without deflation takes over."""
_MAX_ITERATIONS = 40
_FARTHEST = 1e6
"""Distance from the known solution, relative to it, beyond which an iteration has diverged."""


Approach = Callable[[FloatArray, FloatArray, int], tuple[FloatArray, FloatArray, int] | None]
"""Goes from unknowns by deflated steps to where a solution other than those known may be close, in
so many steps: the unknowns there, Newton's step from there and the number of steps that are left;
None where it comes to none."""


def other_solution(
    approach: Approach,
    solve: Callable[[FloatArray], NewtonResult],
    known: FloatArray,
    starts: Iterable[FloatArray],
    *others: FloatArray,
) -> FloatArray | None:
    """A solution (n_unknowns,) other than the ``known`` one, None if no start leads to one.

    ``solve`` iterates with Newton's steps alone, from close to a solution; ``others`` are known,
    too.
    """
    all_known = np.array([known, *others])
    size = size_of(all_known)
    for start in starts:
        near = approach(np.array(start, dtype=float), all_known, _MAX_ITERATIONS)
        while near is not None:
            unknowns, step, left = near
            result = solve(unknowns)
            distances = np.linalg.norm(result.unknowns - all_known, axis=1)
            if result.converged and np.all(distances > DISTINCT * size):
                return result.unknowns
            unknowns = unknowns + deflated(unknowns, all_known, size, step) * step
            near = approach(unknowns, all_known, left)
    return None


def deflated_steps(
    step_at: Callable[[FloatArray], tuple[float, FloatArray | None]],
    unknowns: FloatArray,
    known: FloatArray,
    left: int,
) -> tuple[FloatArray, FloatArray, int] | None:
    """An `Approach` where ``step_at`` gives the norm of the equations and Newton's step."""
    size = size_of(known)
    while left and is_apart(unknowns, known, size):
        try:
            norm, step = step_at(unknowns)
        except ArithmeticError:
            return None
        left -= 1
        if step is None:
            return None
        if norm < NEAR:
            return unknowns, step, left
        unknowns = unknowns + deflated(unknowns, known, size, step) * step
    return None


@Loop
def size_of(known) -> float:
    """What distances are relative to: the size of the first of those ``known`` (k, n)."""
    return math.sqrt(np.dot(known[0], known[0])) or 1.0


@Loop
def is_apart(unknowns, known, size: float) -> bool:
    """Whether unknowns are none of those ``known`` (k, n), and not far from the first."""
    for k in range(len(known)):
        square = 0.0
        for i in range(len(unknowns)):
            offset = (unknowns[i] - known[k, i]) / size
            square += offset * offset
        if not square > DISTINCT * DISTINCT or (k == 0 and not square < _FARTHEST * _FARTHEST):
            return False
    return True


@Loop
def deflated(unknowns, known, size: float, step) -> float:
    """Length of a deflated step over that of the Newton ``step``."""
    rate = 0.0
    for k in range(len(known)):
        square, along = 0.0, 0.0
        for i in range(len(unknowns)):
            offset = (unknowns[i] - known[k, i]) / size
            square += offset * offset
            along += offset * step[i]
        rate -= 2 * along / (square * (1 + square) * size)
    return 1.0 / (1.0 - rate) if rate != 1.0 else 1.0
