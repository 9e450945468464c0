"""Located corrector: loops locate the events of contacts, one compiled function is the rest."""

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.balance import Equations
from symhbm.continuation.correctors.bordered_system import SCALARS, located_system
from symhbm.continuation.correctors.corrector import AtLimit, Constraint, Corrected, Hyperplane
from symhbm.continuation.correctors.resonance_count import counted
from symhbm.continuation.correctors.stepwise import StepwiseCorrector
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem
from symhbm.numerics import Assembly, Compiled, Factorisation, FloatArray


class LocatedCorrector(StepwiseCorrector):
    """A `StepwiseCorrector` of a frequency curve whose system is one function, events its inputs.

    The residual with its derivatives, the constraint, its border, the scaled system and all that
    tells of a point come from one call.
    """

    def __init__(self, curve: FrequencyProblem):
        super().__init__(curve)
        problem = curve.problem
        equations, arguments = problem.compiled
        system, self._assemble, self._limits = _system(equations)
        self._located, self._contacts = equations.located, problem.contacts
        self._system = Compiled(system)
        self._system.inputs[0][:] = np.concatenate([np.ravel(array) for array in arguments])

    def _linearised(
        self,
        point: FloatArray,
        guess: FloatArray,
        scale: FloatArray,
        constraint: Constraint,
        switches: NDArray[np.bool_],
    ) -> tuple[float, float, Any]:
        frequency, inputs = float(point[-1]), self._system.inputs
        states = self._contacts.locate(point[:-1], frequency, switches)
        _, at, start, normal, anchor, limit, imposed, sizes, *of_contacts = inputs
        at[:], start[:], imposed[:] = point, guess, switches
        sizes[0], sizes[1] = scale[0], scale[-1]
        limit[:] = 0.0
        if isinstance(constraint, Hyperplane):
            normal[:], anchor[:] = constraint.normal, constraint.anchor
        else:
            assert isinstance(constraint, AtLimit)
            normal[:], limit[constraint.contact] = 0.0, 1.0
        events, margins, gradients, by_frequency = of_contacts
        _fill(events, [states.groups[group.name].events for group in self._located])
        _fill(gradients, [located.margins_by_motion for located in states.groups.values()])
        margins[:] = states.margins
        if self._contacts.margins_move:
            by_frequency[:], _ = self._contacts.margin_slopes(states, frequency)
        self._system.run()
        norm, value = self._system.outputs[2][:2].tolist()
        return norm, value, states

    def _step(self, at: Any, scale: FloatArray) -> tuple[FloatArray | None, int]:
        """As of any equations; the system is that of the last call."""
        entries, right, _, _ = self._system.outputs
        self.solves += 1
        factors = Factorisation(self._assemble(entries))
        return factors.solve(right.reshape(2, -1).T), factors.sign

    def _corrected(self, point, at, scale, direction, sign, guess, switches) -> Corrected:
        _, _, values, limits = self._system.outputs
        norm, _, amplification, error, _, crosses = values[:SCALARS].tolist()
        rate = self._limits(limits) @ direction
        margins = values[SCALARS:].copy()
        solution = point, direction, sign, norm, amplification, error, margins, rate
        return Corrected(*solution, crosses > 0, *counted(self.curve, point, at))


def is_located(curve: ContinuationProblem) -> bool:
    """Whether a curve has a `LocatedCorrector`: one over the frequency, with full matrices."""
    if not isinstance(curve, FrequencyProblem) or curve.problem.structure is not None:
        return False
    return curve.problem.compiled[0].assemble.as_full


def _fill(target: FloatArray, parts: list[FloatArray]) -> None:
    """Write arrays into one, one after the other."""
    first = 0
    for part in parts:
        target[first : first + part.size] = part.ravel()
        first += part.size


@lru_cache(maxsize=32)
def _system(equations: Equations) -> tuple[ca.Function, Assembly, Assembly]:
    """The function, and what makes matrices of its entries: the system, and rates of margins."""
    system = located_system(equations)
    matrix, limits = (system.sparsity_out(name) for name in ("matrix", "limits"))
    return system, Assembly(matrix, equations.assemble.as_full), Assembly(limits, limits.is_dense())
