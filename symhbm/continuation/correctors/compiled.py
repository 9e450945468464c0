"""Correctors of compiled functions, whole or around loops, and which corrector a curve has."""

from time import thread_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors.bordered_system import SCALARS
from symhbm.continuation.correctors.corrector import (
    Constraint,
    Corrector,
    Hyperplane,
    unit_parameter,
)
from symhbm.continuation.correctors.newton_graph import DONE
from symhbm.continuation.correctors.one_call import UNDEFINED, count_seconds, is_ready, one_call
from symhbm.continuation.correctors.programs import is_compiled, is_located, programs_of
from symhbm.continuation.correctors.resonance_count import resonances_below
from symhbm.continuation.correctors.stepwise import StepwiseCorrector
from symhbm.continuation.problem import ContinuationProblem, Corrected, FrequencyProblem
from symhbm.numerics import Compiled, Factorisation, FloatArray


class LocatedCorrector(StepwiseCorrector):
    """A `StepwiseCorrector` of a frequency curve whose system is one function, events its inputs.

    The residual with its derivatives, the constraint, its border, the scaled system and all that
    tells of a point come from one call.
    """

    def __init__(self, curve: FrequencyProblem):
        super().__init__(curve)
        problem = curve.problem
        equations, arguments = problem.compiled
        programs = programs_of(curve)
        self._assemble, self._limits = programs.assemblies
        self._located = [group.name for group in equations.located]
        self._contacts, self._margins_move = problem.contacts, problem.contacts.margins_move
        self._n_harmonics = sum(n > 0 for n in problem.harmonics)
        size = problem.n_unknowns + 1
        self._of_parameter = np.ones(size), unit_parameter(size)
        self._system = Compiled(*programs.functions(curve.machine_code))
        self._system.inputs[0][:] = np.concatenate([np.ravel(array) for array in arguments])
        self._one_call = one_call(problem, self._system, self._assemble)
        self._waits = self._one_call is None and self._assemble.as_full and is_ready(equations)

    def correct(
        self,
        guess: FloatArray,
        constraint: Constraint,
        switches: NDArray[np.bool_],
        precision: float = 1e-6,
        radius: float = 0.5,
    ) -> Corrected | None:
        """As `Corrector.correct`."""
        if self._one_call is None:
            start = thread_time()
            found = super().correct(guess, constraint, switches, precision, radius)
            if self._waits:
                count_seconds(thread_time() - start)
            return found
        self._write(guess, constraint, switches)
        point, direction, status, solves, sign = self._one_call.correct(
            guess, constraint.scale, precision, radius
        )
        self.solves += solves
        self.defined &= status != UNDEFINED
        if status != DONE:
            return None
        return self._corrected(point, None, constraint.scale, direction, sign, guess, switches)

    def tangent_along(
        self, point: FloatArray, plane: Hyperplane, switches: NDArray[np.bool_]
    ) -> Corrected | None:
        """As `Corrector.tangent_along`."""
        if self._one_call is None:
            return super().tangent_along(point, plane, switches)
        self._write(point, plane, switches)
        direction, solves, sign = self._one_call.tangent(point)
        self.solves += solves
        if direction is None:
            return None
        return self._corrected(point, None, plane.scale, direction, sign, point, switches)

    def step(self, unknowns: FloatArray, value: float) -> tuple[float, FloatArray | None]:
        """As `Corrector.step`, from the same system."""
        point = np.append(unknowns, value)
        norm, _, _ = self._linearised(point, point, Hyperplane(point, *self._of_parameter), None)
        columns, _ = self._step(None, self._of_parameter[0], 1)
        return norm, None if columns is None else columns[:-1, 0]

    def approach(
        self, unknowns: FloatArray, value: float, known: FloatArray, left: int
    ) -> tuple[FloatArray, FloatArray, int] | None:
        """As `Corrector.approach`."""
        if self._one_call is None:
            return super().approach(unknowns, value, known, left)
        point = np.append(unknowns, value)
        self._write(point, Hyperplane(point, *self._of_parameter), None)
        found, solves = self._one_call.approach(point, known, left)
        self.solves += solves
        return found

    def _write(
        self, guess: FloatArray, constraint: Constraint, switches: NDArray[np.bool_] | None
    ) -> None:
        """Write into the inputs of the system what a correction starts from."""
        _, _, start, normal, anchor, limit, imposed, sizes, *_ = self._system.inputs
        start[:] = guess
        if switches is not None:
            imposed[:] = switches
        sizes[0], sizes[1] = constraint.scale[0], constraint.scale[-1]
        constraint.write(normal, anchor, limit)

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
        inputs[1][:] = point
        self._write(guess, constraint, switches)
        events, margins, gradients, by_frequency = inputs[8:]
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


def _fill(target: FloatArray, parts: list[FloatArray]) -> None:
    """Write arrays into one, one after the other."""
    first = 0
    for part in parts:
        target[first : first + part.size] = part.ravel()
        first += part.size


class CompiledCorrector(Corrector):
    """A `Corrector` of a curve whose events are closed forms: a correction is one call."""

    def __init__(self, curve: FrequencyProblem):
        super().__init__(curve)
        _, arguments = curve.problem.compiled
        functions = programs_of(curve).functions(curve.machine_code)
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


def corrector_of(curve: ContinuationProblem) -> Corrector:
    """The corrector of a curve: compiled where its equations allow that."""
    if is_compiled(curve):
        assert isinstance(curve, FrequencyProblem)
        return CompiledCorrector(curve)
    if is_located(curve):
        assert isinstance(curve, FrequencyProblem)
        return LocatedCorrector(curve)
    return StepwiseCorrector(curve)
