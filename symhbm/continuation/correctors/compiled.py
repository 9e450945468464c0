"""Compiled correctors: Newton's method on the balance and one constraint, in one function or few.

With one harmonic the events of contacts are closed forms, so that the whole iteration (events,
residual, Jacobian, factorisation, step, tangent) needs no Python, and a correction is one call.
With several, loops locate the events, and one compiled function is the rest. For all other
equations `StepwiseCorrector` does the same step by step.
"""

import threading
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.balance import DynamicStiffness, Equations
from symhbm.continuation.correctors.bordered_system import SCALARS, located_system, point_system
from symhbm.continuation.correctors.corrector import (
    Constraint,
    Corrector,
    Hyperplane,
    unit_parameter,
)
from symhbm.continuation.correctors.newton_graph import DONE, correction, is_generated, tangent
from symhbm.continuation.correctors.resonance_count import resonances_below
from symhbm.continuation.correctors.stepwise import StepwiseCorrector
from symhbm.continuation.problem import ContinuationProblem, Corrected, FrequencyProblem
from symhbm.numerics import (
    DENSE_LIMIT,
    SMALL,
    Assembly,
    Compiled,
    Factorisation,
    FloatArray,
    to_machine_code,
)


class LocatedCorrector(StepwiseCorrector):
    """A `StepwiseCorrector` of a frequency curve whose system is one function, events its inputs.

    The residual with its derivatives, the constraint, its border, the scaled system and all that
    tells of a point come from one call.
    """

    def __init__(self, curve: FrequencyProblem):
        super().__init__(curve)
        problem = curve.problem
        equations, arguments = problem.compiled
        self._assemble, self._limits = _assemblies(equations)
        self._located = [group.name for group in equations.located]
        self._contacts, self._margins_move = problem.contacts, problem.contacts.margins_move
        self._n_harmonics = sum(n > 0 for n in problem.harmonics)
        size = problem.n_unknowns + 1
        self._of_parameter = np.ones(size), unit_parameter(size)
        self._system = Compiled(*_programs_of(curve).functions(curve.machine_code))
        self._system.inputs[0][:] = np.concatenate([np.ravel(array) for array in arguments])

    def step(self, unknowns: FloatArray, value: float) -> tuple[float, FloatArray | None]:
        """As `Corrector.step`, from the same system."""
        point = np.append(unknowns, value)
        norm, _, _ = self._linearised(point, point, Hyperplane(point, *self._of_parameter), None)
        columns, _ = self._step(None, self._of_parameter[0], 1)
        return norm, None if columns is None else columns[:-1, 0]

    def _linearised(
        self,
        point: FloatArray,
        guess: FloatArray,
        constraint: Constraint,
        switches: NDArray[np.bool_] | None,
    ) -> tuple[float, float, Any]:
        frequency, inputs = float(point[-1]), self._system.inputs
        states = self._contacts.locate(point[:-1], frequency, switches)
        switches = states.switches if switches is None else switches
        _, at, start, normal, anchor, limit, imposed, sizes, *of_contacts = inputs
        at[:], start[:], imposed[:] = point, guess, switches
        sizes[0], sizes[1] = constraint.scale[0], constraint.scale[-1]
        constraint.write(normal, anchor, limit)
        events, margins, gradients, by_frequency = of_contacts
        _fill(events, [states.groups[name].events for name in self._located])
        _fill(gradients, [located.margins_by_motion for located in states.groups.values()])
        _fill(margins, [located.margins for located in states.groups.values()])
        if self._margins_move:
            by_frequency[:], _ = self._contacts.margin_slopes(states, frequency)
        self._system.run()
        norm, value = self._system.outputs[2][:2].tolist()
        return norm, value, states

    def _step(
        self, at: Any, scale: FloatArray, columns: int = 2
    ) -> tuple[FloatArray | None, Factorisation]:
        """As of any equations, both columns or one; the system is that of the last call."""
        entries, right, _, _ = self._system.outputs
        self.solves += 1
        factors = Factorisation(self._assemble(entries))
        return factors.solve(right.reshape(2, -1)[:columns].T), factors

    def _corrected(self, point, at, scale, direction, sign, guess, switches) -> Corrected:
        _, _, values, limits = self._system.outputs
        norm, _, amplification, error, _, crosses = values[:SCALARS].tolist()
        rate, of_contacts = self._limits(limits) @ direction, values[SCALARS:].copy()
        margins = of_contacts[: len(rate)]
        springs = of_contacts[len(rate) :].reshape(2, self._n_harmonics, -1)
        below = resonances_below(*self.curve.at(float(point[-1])), springs[0])
        solution = point, direction, sign, norm, amplification, error, margins, rate
        return Corrected(*solution, crosses > 0, below, springs)


def is_located(curve: ContinuationProblem) -> bool:
    """Whether a curve has a `LocatedCorrector`: one over the frequency of compiled equations."""
    return isinstance(curve, FrequencyProblem) and curve.problem.structure is None


def _fill(target: FloatArray, parts: list[FloatArray]) -> None:
    """Write arrays into one, one after the other."""
    first = 0
    for part in parts:
        target[first : first + part.size] = part.ravel()
        first += part.size


@lru_cache(maxsize=32)
def _assemblies(equations: Equations) -> tuple[Assembly, Assembly]:
    """What makes matrices of the entries of a located system: the system, and rates of margins."""
    system = _programs(equations, None, True).system
    matrix, limits = (system.sparsity_out(name) for name in ("matrix", "limits"))
    rates = Assembly(limits, limits.numel() <= SMALL)
    return Assembly(matrix, equations.assemble.as_full), rates


_OFTEN, _OFTEN_LOCATED = 50, 1000
"""Numbers of curves of one structure from which machine code saves more time than it takes: where
it is whole corrections, and where it is one step of them."""
_Functions = tuple[ca.Function, ...]
"""A correction and the tangent, or a located system."""


class CompiledCorrector(Corrector):
    """A `Corrector` of a curve whose events are closed forms: a correction is one call."""

    def __init__(self, curve: FrequencyProblem):
        super().__init__(curve)
        _, arguments = curve.problem.compiled
        functions = _programs_of(curve).functions(curve.machine_code)
        self._correct, self._tangent = map(Compiled, functions)
        for function in (self._correct, self._tangent):
            function.inputs[0][:] = np.concatenate([np.ravel(array) for array in arguments])
        self._n_switches = len(self._tangent.inputs[3])
        self._n_harmonics = sum(n > 0 for n in curve.problem.harmonics)

    def correct(
        self,
        guess: FloatArray,
        constraint: Constraint,
        switches: NDArray[np.bool_],
        precision: float = 1e-6,
        radius: float = 0.5,
    ) -> Corrected | None:
        """As `Corrector.correct`."""
        _, start, normal, anchor, limit, imposed, settings = self._correct.inputs
        start[:], imposed[:], scale = guess, switches, constraint.scale
        settings[0], settings[1], settings[2], settings[3] = scale[0], scale[-1], precision, radius
        constraint.write(normal, anchor, limit)
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

    def tangent_along(
        self, point: FloatArray, plane: Hyperplane, switches: NDArray[np.bool_]
    ) -> Corrected | None:
        """As `Corrector.tangent_along`."""
        self.solves += 1
        _, at_point, normal, imposed, settings = self._tangent.inputs
        at_point[:], normal[:], imposed[:] = point, plane.normal, switches
        settings[:2] = plane.scale[0], plane.scale[-1]
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
        springs = of_contacts[n:end].reshape(2, self._n_harmonics, -1)
        counts: tuple[int, ...] | None = (int(below) // 2,)
        # Closed forms of several harmonics (no contacts) count the resonances of all at once.
        if below < 0 or self._n_harmonics > 1:
            counts = resonances_below(*self.curve.at(float(point[-1])), springs[0])
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
            counts,
            springs,
        )


def is_compiled(curve: ContinuationProblem) -> bool:
    """Whether a curve has a `CompiledCorrector`.

    CasADi does not reorder the unknowns: large matrices that fill are factorised faster in Python.
    """
    if not isinstance(curve, FrequencyProblem) or not curve.single_valued:
        return False
    problem, part = curve.problem, curve.problem.structure
    if not problem.equations.closed:
        return False
    if part is not None:
        return part.band_functions is not None
    return problem.n_unknowns <= DENSE_LIMIT or _stays_sparse(problem.equations)


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
    programs = _programs_of(curve) if is_compiled(curve) or is_located(curve) else None
    return programs is not None and programs.prepare(count, announce)


def by_machine_code(curve: ContinuationProblem) -> bool:
    """Whether machine code evaluates a curve in this process, as far as that is compiled."""
    if not is_compiled(curve) and not is_located(curve):
        return False
    programs = _programs_of(curve)
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


def _programs_of(curve: ContinuationProblem) -> "_Programs":
    """Those of a curve that has a `CompiledCorrector` or a `LocatedCorrector`."""
    problem = curve.problem
    return _programs(problem.equations, problem.structure, not is_compiled(curve))


@lru_cache(maxsize=32)
def _programs(
    equations: Equations, structure: DynamicStiffness | None, located: bool
) -> "_Programs":
    system = located_system(equations) if located else point_system(equations, structure)
    return _Programs(system, located)


class _Programs:
    """The functions of one structure, by CasADi's virtual machine and as machine code."""

    def __init__(self, system: ca.Function, located: bool):
        self.system, self._located = system, located
        self.interpreted = self._built(system)
        self._machine_code: _Functions | None = None
        self._looked: set[bool] = set()
        self._uses = 0
        self._lock = threading.Lock()

    def functions(self, as_machine_code: bool | None) -> _Functions:
        """What is evaluated; None for machine code where this process has it."""
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
            often = _OFTEN_LOCATED if self._located else _OFTEN
            self._look(self._uses >= often, announce)
            return self._machine_code is not None

    def _look(self, make: bool, announce: Callable[[], None] = lambda: None) -> None:
        """Look for machine code once, and ``make`` it once where there is none."""
        if self._machine_code is None and make not in self._looked:
            self._looked.add(make)
            self._machine_code = self._made(make, announce)

    def _built(self, system: ca.Function) -> _Functions:
        return (system,) if self._located else (correction(system), tangent(system))

    def _made(self, make: bool, announce: Callable[[], None]) -> _Functions | None:
        if not self._located and is_generated(self.system):
            return to_machine_code(self.interpreted, make, announce)
        made = to_machine_code([self.system], make, announce)
        return None if made is None else self._built(made[0])
