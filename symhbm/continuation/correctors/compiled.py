"""Compiled corrector: Newton's method on the balance and one constraint as one function.

With one harmonic the events of contacts are closed forms, so that the whole iteration (events,
residual, Jacobian, factorisation, step, tangent) needs no Python, and a correction is one call. For
all other equations `StepwiseCorrector` does the same step by step.
"""

import threading
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.balance import DynamicStiffness, Equations
from symhbm.continuation.correctors.bordered_system import SCALARS, point_system
from symhbm.continuation.correctors.corrector import (
    AtLimit,
    Constraint,
    Corrected,
    Corrector,
    Hyperplane,
    unit_parameter,
)
from symhbm.continuation.correctors.located import LocatedCorrector, is_located
from symhbm.continuation.correctors.newton_graph import DONE, correction, is_generated, tangent
from symhbm.continuation.correctors.resonance_count import resonances_below
from symhbm.continuation.correctors.stepwise import StepwiseCorrector
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem
from symhbm.numerics import DENSE_LIMIT, Compiled, FloatArray, to_machine_code

_OFTEN = 50
"""Number of curves of one structure from which machine code saves more time than it takes."""
_Functions = tuple[ca.Function, ca.Function]
"""A correction and the tangent."""


class CompiledCorrector(Corrector):
    """A `Corrector` of a curve whose events are closed forms: a correction is one call."""

    def __init__(self, curve: FrequencyProblem):
        super().__init__(curve)
        equations, arguments = curve.problem.compiled
        programs = _programs(equations, curve.problem.structure)
        self._correct, self._tangent = map(Compiled, programs.functions(curve.machine_code))
        for function in (self._correct, self._tangent):
            function.inputs[0][:] = np.concatenate([np.ravel(array) for array in arguments])
        self._n_switches = len(self._tangent.inputs[3])
        self._n_harmonics = sum(n > 0 for n in curve.problem.harmonics)

    def correct(
        self,
        guess: FloatArray,
        scale: FloatArray,
        constraint: Constraint,
        switches: NDArray[np.bool_],
        precision: float = 1e-6,
        radius: float = 0.5,
    ) -> Corrected | None:
        """As `Corrector.correct`."""
        _, start, normal, anchor, limit, imposed, settings = self._correct.inputs
        start[:], imposed[:] = guess, switches
        settings[0], settings[1], settings[2], settings[3] = scale[0], scale[-1], precision, radius
        limit[:] = 0.0
        if isinstance(constraint, Hyperplane):
            normal[:], anchor[:] = constraint.normal, constraint.anchor
        else:
            assert isinstance(constraint, AtLimit)
            normal[:], limit[constraint.contact] = 0.0, 1.0
        try:
            self._correct.run()
        except RuntimeError:
            self.solves += 1
            return None
        point, direction, progress, values = self._correct.outputs
        status, solves = progress.tolist()
        self.solves += int(solves)
        if status != DONE:
            return None
        return self._corrected(point.copy(), direction.copy(), values)

    def tangent(
        self, point: FloatArray, scale: FloatArray, row: FloatArray, switches: NDArray[np.bool_]
    ) -> Corrected | None:
        """As `Corrector.tangent`."""
        self.solves += 1
        borders = row, unit_parameter(len(row))
        tangents = (self._tangent_along(point, scale, border, switches) for border in borders)
        return next((tangent for tangent in tangents if tangent is not None), None)

    def _tangent_along(
        self, point: FloatArray, scale: FloatArray, row: FloatArray, switches: NDArray[np.bool_]
    ) -> Corrected | None:
        """Tangent along a row; None where the system is singular."""
        _, at_point, normal, imposed, settings = self._tangent.inputs
        at_point[:], normal[:], imposed[:] = point, row, switches
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
        of_contacts, n = values[SCALARS:].copy(), self._n_switches
        end = len(of_contacts) - n
        # Closed forms of several harmonics (no contacts) count the resonances of all at once.
        springs = of_contacts[n:end].reshape(2, 1, -1).repeat(self._n_harmonics, axis=1)
        at = self.curve.at(float(point[-1]))
        counted = below >= 0 and self._n_harmonics == 1
        return Corrected(
            point,
            direction,
            1 if direction[-1] >= 0 else -1,
            norm,
            amplification,
            error,
            of_contacts[:n],
            of_contacts[end:],
            crosses > 0,
            (int(below) // 2,) if counted else resonances_below(*at, springs[0]),
            springs,
        )


def is_compiled(curve: ContinuationProblem) -> bool:
    """Whether a curve has a `CompiledCorrector`.

    CasADi does not reorder the unknowns: large matrices that fill are factorised faster in Python.
    """
    if not isinstance(curve, FrequencyProblem) or not curve.single_valued:
        return False
    problem, part = curve.problem, curve.problem.structure
    if not problem.in_closed_form:
        return False
    if part is not None:
        return part.band_functions is not None
    return problem.n_unknowns <= DENSE_LIMIT or _stays_sparse(problem.compiled[0])


def corrector_of(curve: ContinuationProblem) -> Corrector:
    """The corrector of a curve: compiled where its equations allow that."""
    if is_compiled(curve):
        assert isinstance(curve, FrequencyProblem)
        return CompiledCorrector(curve)
    if is_located(curve):
        assert isinstance(curve, FrequencyProblem)
        return LocatedCorrector(curve)
    return StepwiseCorrector(curve)


def prepare(
    curve: ContinuationProblem, count: int, announce: Callable[[], None] = lambda: None
) -> bool:
    """Whether machine code is to evaluate ``count`` curves like one: it is made where it pays.

    ``announce`` is called before what takes seconds.
    """
    if not is_compiled(curve):
        return False
    programs = _programs(curve.problem.compiled[0], curve.problem.structure)
    return programs.prepare(count, announce)


def by_machine_code(curve: ContinuationProblem) -> bool:
    """Whether machine code evaluates a curve in this process, as far as that is compiled."""
    if not is_compiled(curve):
        return False
    programs = _programs(curve.problem.compiled[0], curve.problem.structure)
    return programs.functions(curve.machine_code) is not programs.interpreted


@lru_cache(maxsize=32)
def _stays_sparse(equations: Equations) -> bool:
    """Whether elimination in the order of the unknowns fills no more entries than there are.

    It fills none outside the envelope: from the first entry of a row, or of a column, to the
    diagonal.
    """
    jacobian = equations.closed_form.sparsity_out(2)
    rows, columns = jacobian.get_triplet()
    first = np.arange(jacobian.size1())
    np.minimum.at(first, rows, columns)
    np.minimum.at(first, columns, rows)
    return bool(np.sum(np.arange(len(first)) - first) <= jacobian.nnz())


@lru_cache(maxsize=32)
def _programs(equations: Equations, structure: DynamicStiffness | None) -> "_Programs":
    return _Programs(point_system(equations, structure))


class _Programs:
    """The functions of one structure, by CasADi's virtual machine and as machine code."""

    def __init__(self, system: ca.Function):
        self._system = system
        self.interpreted = correction(system), tangent(system)
        self._machine_code: _Functions | None = None
        self._looked: set[bool] = set()
        self._uses = 0
        self._lock = threading.Lock()

    def functions(self, as_machine_code: bool | None) -> _Functions:
        """The correction and the tangent; None for machine code where this process has it."""
        with self._lock:
            if as_machine_code:
                self._look(True)
            if as_machine_code is False:
                return self.interpreted
            return self._machine_code or self.interpreted

    def prepare(self, count: int, announce: Callable[[], None]) -> bool:
        """Whether there is machine code: from another process, or because many curves use it."""
        with self._lock:
            self._uses += count
            self._look(self._uses >= _OFTEN, announce)
            return self._machine_code is not None

    def _look(self, make: bool, announce: Callable[[], None] = lambda: None) -> None:
        """Look for machine code once, and ``make`` it once where there is none."""
        if self._machine_code is None and make not in self._looked:
            self._looked.add(make)
            self._machine_code = self._made(make, announce)

    def _made(self, make: bool, announce: Callable[[], None]) -> _Functions | None:
        if is_generated(self._system):
            return to_machine_code(self.interpreted, make, announce)  # type: ignore[return-value]
        made = to_machine_code([self._system], make, announce)
        return None if made is None else (correction(made[0]), tangent(made[0]))
