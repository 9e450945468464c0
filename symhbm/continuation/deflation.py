"""Another solution at the same value of the parameter, by deflated Newton iterations.

The equations are multiplied by ``1 + 1/|x - known|^2``, lengths relative to the known solution, so
that this one no longer solves them. A Newton step of the deflated equations has the direction of a
step of the original equations and another length.

Reference: P. E. Farrell, A. Birkisson, S. W. Funke, Deflation techniques for finding distinct
solutions of nonlinear partial differential equations, SIAM J. Sci. Comput. 37, 2015.
"""

from collections.abc import Callable, Iterable

import numpy as np

from symhbm.balance import Evaluation
from symhbm.continuation.newton import newton
from symhbm.numerics import Factorisation, FloatArray

DISTINCT = 1e-6
"""Distance of two different solutions, relative to one of them."""
_NEAR = 1e-6
"""Residual norm below which Newton's method without deflation takes over."""
_MAX_ITERATIONS = 40
_FARTHEST = 1e6
"""Distance from the known solution, relative to it, beyond which an iteration has diverged."""


def other_solution(
    evaluate: Callable[[FloatArray], Evaluation], known: FloatArray, starts: Iterable[FloatArray]
) -> FloatArray | None:
    """A solution (n_unknowns,) other than the ``known`` one, None if no start leads to one."""
    size = np.linalg.norm(known) or 1.0
    for start in starts:
        unknowns = np.array(start, dtype=float)
        for _ in range(_MAX_ITERATIONS):
            offset = (unknowns - known) / size
            square = float(offset @ offset)
            if not DISTINCT**2 < square < _FARTHEST**2:
                break
            try:
                evaluation = evaluate(unknowns)
            except ArithmeticError:
                break
            step = Factorisation(evaluation.jacobian).solve(-evaluation.residual)
            if step is None:
                break
            if evaluation.norm < _NEAR:
                result = newton(evaluate, unknowns)
                distance = np.linalg.norm(result.unknowns - known)
                if result.converged and distance > DISTINCT * size:
                    return result.unknowns
            rate = -2 * float(offset @ step) / (square * (1 + square) * size)
            unknowns = unknowns + step / ((1 - rate) or 1.0)
    return None
