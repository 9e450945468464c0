"""Compiled corrector: Newton's method on the balance and one constraint as one function.

With one harmonic the events of contacts are closed forms, so that the whole iteration (events,
residual, Jacobian, factorisation, step, tangent) needs no Python, and a correction is one call. For
all other equations `symhbm.continuation.correctors.stepwise.Corrector` does the same step by step.
"""

import threading
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.balance import DynamicStiffness, Equations
from symhbm.continuation.correctors.bordered_system import SCALARS, point_system
from symhbm.continuation.correctors.constraints import AtLimit, Constraint, Corrected, Hyperplane
from symhbm.continuation.correctors.newton_graph import DONE, correction, tangent
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem
from symhbm.continuation.resonance_count import ResonanceCount
from symhbm.numerics import DENSE_LIMIT, Compiled, FloatArray, native

_OFTEN = 50
"""Number of curves of one structure from which machine code saves more time than it takes."""


class CompiledCorrector:
    """Corrects guesses onto the frequency curve of one problem; see `Corrector`."""

    def __init__(self, curve: FrequencyProblem):
        equations, arguments = curve.problem.compiled
        self._correct, self._tangent = map(
            Compiled, _programs(equations, curve.problem.structure).functions()
        )
        for function in (self._correct, self._tangent):
            function.inputs[0][:] = np.concatenate([np.ravel(array) for array in arguments])
        self._n_switches = len(self._tangent.inputs[3])
        self._count = ResonanceCount(curve)

    def correct(
        self,
        guess: FloatArray,
        scale: FloatArray,
        constraint: Constraint,
        slip: NDArray[np.bool_],
        precision: float,
        radius: float,
    ) -> tuple[Corrected | None, int]:
        """Solution from ``guess``, number of linear solves; arguments as of `Corrector.correct`."""
        _, start, normal, anchor, limit, imposed, settings = self._correct.inputs
        start[:], imposed[:] = guess, slip
        settings[:] = scale[0], scale[-1], precision, radius
        limit[:] = 0.0
        if isinstance(constraint, Hyperplane):
            normal[:], anchor[:] = constraint.normal, constraint.anchor
        else:
            assert isinstance(constraint, AtLimit)
            normal[:], limit[constraint.contact] = 0.0, 1.0
        try:
            self._correct.run()
        except RuntimeError:
            return None, 1  # LAPACK refuses a matrix that is exactly singular
        point, direction, (status, solves), values = self._correct.outputs
        if status != DONE:
            return None, int(solves)
        return self._corrected(point.copy(), direction.copy(), values), int(solves)

    def tangent(
        self, point: FloatArray, scale: FloatArray, row: FloatArray, slip: NDArray[np.bool_]
    ) -> Corrected | None:
        """Tangent at a solution, along ``row``; None where the system is singular."""
        _, at_point, normal, imposed, settings = self._tangent.inputs
        at_point[:], normal[:], imposed[:] = point, row, slip
        settings[:2] = scale[0], scale[-1]
        try:
            self._tangent.run()
        except RuntimeError:
            return None
        direction, values = self._tangent.outputs
        if not np.isfinite(direction).all():
            return None
        return self._corrected(point, direction.copy(), values)

    def _corrected(self, point: FloatArray, direction: FloatArray, values: Any) -> Corrected:
        norm, _, amplification, error, below, crosses = values[:SCALARS].tolist()
        n = self._n_switches
        slip_margin, springs, rate = np.split(
            values[SCALARS:].copy(), [n, len(values) - SCALARS - n]
        )
        sign = 1 if direction[-1] >= 0 else -1
        at_contacts = slip_margin, rate, crosses > 0
        resonances_below = (
            (int(below) // 2,) if below >= 0 else self._count.below_with(springs, point[-1])
        )
        return Corrected(
            point, direction, sign, norm, amplification, error, *at_contacts, resonances_below
        )


def compiled_corrector(curve: ContinuationProblem) -> CompiledCorrector | None:
    """The compiled corrector of a curve, None for one that needs Python.

    Large sparse matrices are factorised faster in Python, as CasADi does not reorder the unknowns.
    """
    if not isinstance(curve, FrequencyProblem) or not curve.single_valued:
        return None
    part = curve.problem.structure
    if part is None and curve.problem.n_unknowns > DENSE_LIMIT:
        return None
    if part is not None and part.band_functions is None:
        return None
    return CompiledCorrector(curve) if curve.problem.in_closed_form else None


@lru_cache(maxsize=32)
def _programs(equations: Equations, structure: DynamicStiffness | None) -> "_Programs":
    return _Programs(point_system(equations, structure))


class _Programs:
    """The functions of one structure, as machine code once many curves use them."""

    def __init__(self, system: ca.Function):
        self._system = system
        self._functions = correction(system), tangent(system)
        self._uses = 0
        self._lock = threading.Lock()

    def functions(self) -> tuple[ca.Function, ca.Function]:
        """The correction and the tangent."""
        with self._lock:
            self._uses += 1
            if self._uses == _OFTEN and (system := native(self._system)) is not None:
                self._functions = (correction(system), tangent(system))
            return self._functions
