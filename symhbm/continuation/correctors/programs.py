"""The functions of one structure that correctors evaluate: by CasADi, or as machine code.

With one harmonic the events of contacts are closed forms, so that the whole iteration (events,
residual, Jacobian, factorisation, step, tangent) needs no Python, and a correction is one function.
With several, loops locate the events, and one function is the rest.
"""

import threading
from collections.abc import Callable
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from symhbm.balance import DynamicStiffness, Equations
from symhbm.continuation.correctors.bordered_system import located_system, point_system
from symhbm.continuation.correctors.newton_graph import correction, is_generated, tangent
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem
from symhbm.numerics import DENSE_LIMIT, SMALL, Assembly, to_machine_code

_OFTEN, _OFTEN_LOCATED = 50, 1000
"""Numbers of curves of one structure from which machine code saves more time than it takes: where
it is whole corrections, and where it is one step of them."""
_Functions = tuple[ca.Function, ...]
"""A correction and the tangent, or a located system."""


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


def is_located(curve: ContinuationProblem) -> bool:
    """Whether a curve has a `LocatedCorrector`: one over the frequency of compiled equations."""
    return isinstance(curve, FrequencyProblem) and curve.problem.structure is None


def prepare(
    curve: ContinuationProblem, count: int, announce: Callable[[], None] = lambda: None
) -> bool:
    """Whether machine code is to evaluate ``count`` curves like one: it is made where it pays.

    ``announce`` is called before what takes seconds.
    """
    programs = programs_of(curve) if is_compiled(curve) or is_located(curve) else None
    return programs is not None and programs.prepare(count, announce)


def by_machine_code(curve: ContinuationProblem) -> bool:
    """Whether machine code evaluates a curve in this process, as far as that is compiled."""
    if not is_compiled(curve) and not is_located(curve):
        return False
    programs = programs_of(curve)
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


def programs_of(curve: ContinuationProblem) -> "Programs":
    """Those of a curve that has a `CompiledCorrector` or a `LocatedCorrector`."""
    problem = curve.problem
    return _programs(problem.equations, problem.structure, not is_compiled(curve))


@lru_cache(maxsize=32)
def _programs(
    equations: Equations, structure: DynamicStiffness | None, located: bool
) -> "Programs":
    system = located_system(equations) if located else point_system(equations, structure)
    return Programs(system, located, equations.assemble.as_full)


class Programs:
    """The functions of one structure, by CasADi's virtual machine and as machine code."""

    def __init__(self, system: ca.Function, located: bool, as_full: bool):
        self.system, self._located, self._as_full = system, located, as_full
        self.interpreted = self._built(system)
        self._machine_code: _Functions | None = None
        self._looked: set[bool] = set()
        self._uses = 0
        self._lock = threading.Lock()

    @cached_property
    def assemblies(self) -> tuple[Assembly, Assembly]:
        """What makes matrices of stored entries: of the system, and of rates of margins."""
        matrix, limits = (self.system.sparsity_out(name) for name in ("matrix", "limits"))
        return Assembly(matrix, self._as_full), Assembly(limits, limits.numel() <= SMALL)

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
