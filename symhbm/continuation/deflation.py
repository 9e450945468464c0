"""Another solution at the same value of the parameter, by deflated Newton iterations.

The equations are multiplied by ``1 + 1/|x - known|^2`` for each known solution, lengths relative to
the first, so that these no longer solve them. A Newton step of the deflated equations has the
direction of a step of the original equations and another length.

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
    evaluate: Callable[[FloatArray], Evaluation],
    known: FloatArray,
    starts: Iterable[FloatArray],
    *others: FloatArray,
) -> FloatArray | None:
    """A solution (n_unknowns,) other than the ``known`` one, None if no start leads to one.

    ``others`` are known, too.
    """
    size = np.linalg.norm(known) or 1.0
    all_known = np.array([known, *others])
    for start in starts:
        unknowns = np.array(start, dtype=float)
        for _ in range(_MAX_ITERATIONS):
            offsets = (unknowns - all_known) / size
            squares = np.einsum("kn,kn->k", offsets, offsets)
            if not (np.all(squares > DISTINCT**2) and squares[0] < _FARTHEST**2):
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
                distances = np.linalg.norm(result.unknowns - all_known, axis=1)
                if result.converged and np.all(distances > DISTINCT * size):
                    return result.unknowns
            rate = -2 * float(np.sum(offsets @ step / (squares * (1 + squares)))) / size
            unknowns = unknowns + step / ((1 - rate) or 1.0)
    return None
