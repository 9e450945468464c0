"""Newton's method of a `LocatedCorrector` in one call, without Python in between.

A loop runs those that locate the events of contacts, the located system and LAPACK, each by its
address: it is compiled once for all laws and structures. Its steps are those of
`StepwiseCorrector`, which corrects until compiling pays.
"""

from functools import lru_cache
from math import isfinite, isnan, sqrt
from typing import Any, ClassVar, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance import Equations, HarmonicBalance
from symhbm.continuation.correctors.newton_graph import DONE, FAILED, MAX_CORRECTIONS, STAGNATION
from symhbm.continuation.newton import NEAR, TOLERANCE, deflated, is_apart, size_of
from symhbm.model.contacts import FREE, ContactLaw, EventLoop
from symhbm.numerics import Assembly, Compiled, FloatArray
from symhbm.numerics.loops import Loop, by_address

UNDEFINED = FAILED + 1
"""Status of a correction that met a force which is no number."""
_EVALUATE, _SYSTEM, _FACTORISE, _SOLVE = range(4)
"""Addresses: what evaluates, the located system, and two functions of LAPACK."""
_LOOP, _CONTACTS, _COMPONENTS, _MOTION, _VALUES, _EVENTS, _SWITCHES, _GRADIENTS, _DETAILS = range(9)
"""Of a group the address of its loop, the contacts, the components of a displacement, and how many
numbers there are of each contact."""


class Plan(NamedTuple):
    """What the loop reads and writes.

    ``addresses`` (4,) and ``groups`` (n, 9) have the columns above; ``firsts`` tell where the
    numbers of a group begin. ``orders``, ``sines`` and ``norms`` are the bases, and ``values``,
    ``held``, ``motions`` and ``details`` what goes into loops and comes out. Motions are sums over
    ``columns`` of unknowns times ``weights``, from ``starts`` on. Inputs and outputs of the system
    follow, then the ``places`` of its entries in a full ``matrix``, the pivots and the solution of
    that, and what LAPACK takes: its size, 1, what came out, and the letter N.
    """

    addresses: NDArray[np.int64]
    groups: NDArray[np.int64]
    firsts: NDArray[np.int64]
    orders: NDArray[np.int64]
    sines: NDArray[np.bool_]
    norms: FloatArray
    starts: NDArray[np.int64]
    columns: NDArray[np.int64]
    weights: FloatArray
    values: FloatArray
    held: FloatArray
    motions: FloatArray
    details: FloatArray
    at: FloatArray
    imposed: FloatArray
    events: FloatArray
    margins: FloatArray
    gradients: FloatArray
    entries: FloatArray
    right: FloatArray
    results: FloatArray
    places: NDArray[np.int64]
    matrix: FloatArray
    pivots: NDArray[np.int32]
    solution: FloatArray
    integers: NDArray[np.int32]


@Loop
def _rows(array, first: int, n: int, size: int) -> Any:
    """A part of an array as rows."""
    return array[first : first + n * size].reshape((n, size))


@Loop
def evaluate(plan, point, held: bool) -> int:
    """Evaluate the system at a point, states of switches ``held`` or free; 0, or what failed."""
    for i in range(len(point)):
        plan.at[i] = point[i]
    for i in range(len(plan.motions)):
        plan.motions[i] = 0.0
        for k in range(plan.starts[i], plan.starts[i + 1]):
            plan.motions[i] += plan.weights[k] * point[plan.columns[k]]
    for g in range(len(plan.groups)):
        group, first = plan.groups[g], plan.firsts[g]
        n, q, motion = group[_CONTACTS], group[_SWITCHES], group[_MOTION]
        imposed = plan.held[first[_CONTACTS] : first[_CONTACTS] + n]
        for j in range(n):
            imposed[j] = plan.imposed[first[_SWITCHES] + j * q] if held and q else FREE
        begin, end = first[_COMPONENTS], first[_COMPONENTS] + group[_COMPONENTS]
        gradients = _rows(plan.gradients, first[_GRADIENTS], n, group[_GRADIENTS])
        arguments = (
            (plan.orders[begin:end], plan.sines[begin:end], plan.norms[begin:end]),
            _rows(plan.motions, first[_MOTION], n, motion),
            _rows(plan.values, first[_VALUES], n, group[_VALUES]),
            imposed,
            _rows(plan.events, first[_EVENTS], n, group[_EVENTS]),
            _rows(plan.margins, first[_SWITCHES], n, q),
            gradients.reshape((n, q, motion)),
            _rows(plan.details, first[_DETAILS], n, group[_DETAILS]),
        )
        failed = by_address.call_loop(group[_LOOP], arguments)
        if failed:
            return failed
    by_address.call_library(plan.addresses[_EVALUATE], (plan.addresses[_SYSTEM],))
    return 0


@Loop
def solve(plan, columns: int) -> int:
    """Solve the system for one or two columns: the sign of its determinant, 0 where it fails."""
    size = len(plan.pivots)
    for i in range(columns * size):
        if not isfinite(plan.right[i]):
            return 0
        plan.solution[i] = plan.right[i]
    plan.matrix[:] = 0.0
    for i in range(len(plan.places)):
        plan.matrix[plan.places[i]] = plan.entries[i]
    matrix, pivots, order = (
        plan.matrix.ctypes.data,
        plan.pivots.ctypes.data,
        plan.integers.ctypes.data,
    )
    one, failed, letter = order + 4, order + 8, order + 12
    by_address.call_library(
        plan.addresses[_FACTORISE], (order, order, matrix, order, pivots, failed)
    )
    if plan.integers[2]:
        return 0
    for k in range(columns):
        right = plan.solution.ctypes.data + 8 * k * size
        by_address.call_library(
            plan.addresses[_SOLVE],
            (letter, order, one, matrix, order, pivots, right, order, failed),
        )
    sign = 1
    for i in range(size):
        pivot = plan.matrix[i * size + i]
        if not isfinite(pivot):
            return 0
        sign = -sign if (pivot < 0) != (plan.pivots[i] != i + 1) else sign
    for i in range(columns * size):
        if not isfinite(plan.solution[i]):
            return 0
    return sign


@Loop
def tangent(plan, point) -> tuple[int, int]:
    """Solve the system at a point in held states: number of solves and sign of its determinant."""
    return (0, 0) if evaluate(plan, point, True) else (1, solve(plan, 2))


@Loop
def approach(plan, known, left: int, point) -> tuple[int, int]:
    """Move a ``point`` as `Approach`: solves, and steps left or -1."""
    last, solves, size = len(point) - 1, 0, size_of(known)
    while left and is_apart(point[:last], known, size):
        if evaluate(plan, point, False):
            return solves, -1
        left, solves = left - 1, solves + 1
        if solve(plan, 1) == 0:
            return solves, -1
        if plan.results[0] < NEAR:
            return solves, left
        length = deflated(point[:last], known, size, plan.solution[:last])
        for i in range(last):
            point[i] += length * plan.solution[i]
    return solves, -1


@Loop
def correct(plan, scale, precision: float, radius: float, point, direction) -> tuple[int, int, int]:
    """Move a ``point`` onto the curve, and write the ``direction`` there.

    As `StepwiseCorrector.correct`, from status to status; results are that, the number of solves,
    and the sign of the determinant.
    """
    size, sign, solves = len(point), 0, 0
    length = previous = np.inf
    while True:
        if evaluate(plan, point, True):
            return FAILED, solves, sign
        norm, value = plan.results[0], plan.results[1]
        if isnan(norm):
            return UNDEFINED, solves, sign
        on_curve = norm <= TOLERANCE and abs(value) <= TOLERANCE
        if on_curve and sign and length <= precision:
            return DONE, solves, sign
        if solves == MAX_CORRECTIONS or not isfinite(value):
            stagnates = sign and on_curve and length <= STAGNATION
            return DONE if stagnates else FAILED, solves, sign
        solves += 1
        sign = solve(plan, 2)
        if sign == 0:
            return FAILED, solves, sign
        previous, length = length, sqrt(np.dot(plan.solution[:size], plan.solution[:size]))
        along = sqrt(np.dot(plan.solution[size:], plan.solution[size:]))
        for i in range(size):
            direction[i] = plan.solution[size + i] / along
        if solves > 3 and length > previous:
            return DONE if on_curve else FAILED, solves, sign
        if length > radius:
            return FAILED, solves, sign
        for i in range(size):
            point[i] += plan.solution[i] * scale[i]


class OneCall:
    """The steps of a corrector, its plan bound to the memory of its system."""

    _works: ClassVar[bool | None] = None

    def __init__(self, plan: Plan, system: Compiled):
        # Nothing else keeps the memory behind addresses.
        self._plan, self._system, self._size = plan, system, len(plan.at)

    @property
    def works(self) -> bool:
        """Whether the loop can be compiled here, which one plan tells of all."""
        if OneCall._works is None:
            point = np.empty(self._size)
            OneCall._works = correct.compiles(self._plan, point, 1.0, 1.0, point, point)
        return OneCall._works

    def correct(
        self, guess: FloatArray, scale: FloatArray, precision: float, radius: float
    ) -> tuple[FloatArray, FloatArray, int, int, int]:
        """Point, direction, status, solves, and sign of the determinant, from a guess."""
        point, direction = guess.copy(), np.empty(self._size)
        told = correct.compiled(self._plan, scale, precision, radius, point, direction)
        return point, direction, *told

    def tangent(self, point: FloatArray) -> tuple[FloatArray | None, int, int]:
        """Direction at a point, None where there is none, solves, and sign of the determinant."""
        solves, sign = tangent.compiled(self._plan, point)
        direction = self._plan.solution[self._size :]
        return direction / sqrt(direction.dot(direction)) if sign else None, solves, sign

    def approach(
        self, point: FloatArray, known: FloatArray, left: int
    ) -> tuple[tuple[FloatArray, FloatArray, int] | None, int]:
        """As `Approach`, and the number of solves."""
        point = point.copy()
        solves, left = approach.compiled(self._plan, known, left, point)
        if left < 0:
            return None, solves
        return (point[:-1], self._plan.solution[: self._size - 1].copy(), left), solves


def one_call(problem: HarmonicBalance, system: Compiled, assemble: Assembly) -> OneCall | None:
    """The steps of a located ``system``; None where there are none, or they do not pay yet."""
    equations = problem.equations
    if not assemble.as_full or not (is_ready(equations) and correct.pays):
        return None
    groups, values = _groups(equations), []
    if groups is None:
        return None
    inputs, outputs, size = system.inputs, system.outputs, len(system.inputs[1])
    groups = groups.copy()
    for group, each in zip(equations.located, _loops(equations) or (), strict=True):
        values.append(each.values(1.0, problem.contacts.values_of(group)))
    groups[:, _VALUES] = [each.shape[1] for each in values]
    counts, spread = groups.copy(), _spread(equations)
    counts[:, _MOTION:] *= groups[:, [_CONTACTS]]
    n = counts.sum(axis=0)
    bases = [each.basis.arrays for each in _loops(equations) or ()]
    evaluates, *of_lapack = by_address.functions() or (0,)
    addresses = np.array([evaluates, by_address.pointer(system.capsule), *of_lapack])
    orders, sines, norms = map(np.concatenate, zip(*bases, strict=True))
    made = OneCall(
        Plan(
            addresses=addresses,
            groups=groups,
            firsts=np.cumsum(counts, axis=0) - counts,
            orders=orders,
            sines=sines,
            norms=norms,
            starts=spread.indptr.astype(np.int64),
            columns=spread.indices.astype(np.int64),
            weights=spread.data,
            values=np.concatenate([each.ravel() for each in values]),
            held=np.empty(n[_CONTACTS]),
            motions=np.empty(n[_MOTION]),
            details=np.empty(n[_DETAILS]),
            at=inputs[1],
            imposed=inputs[6],
            events=inputs[8],
            margins=inputs[9],
            gradients=inputs[10],
            entries=outputs[0],
            right=outputs[1],
            results=outputs[2],
            places=assemble.places.astype(np.int64),
            matrix=np.empty(size * size),
            pivots=np.empty(size, dtype=np.int32),
            solution=np.empty(2 * size),
            integers=np.array([size, 1, 0, ord("N")], dtype=np.int32),
        ),
        system,
    )
    return made if made.works else None


def is_ready(equations: Equations) -> bool:
    """Whether machine code does all that one call needs, but for its own loop."""
    loops = _loops(equations)
    compiled = bool(loops) and all(each.loop.is_compiled for each in loops)
    return compiled and by_address.functions() is not None


def count_seconds(seconds: float) -> None:
    """Count what corrections took without it, to know when it pays."""
    correct.took(seconds)


@lru_cache(maxsize=32)
def _loops(equations: Equations) -> tuple[EventLoop, ...] | None:
    """Those that locate the events of the groups, None where one has none."""
    loops, located = [], {group.name for group in equations.located}
    for group in equations.groups:
        if group.name not in located and not group.n_switches:
            continue
        law, found = group.law, group.law.event_loop(equations.basis)
        fixed = group.name in located and not law.margins_move
        if found is None or not fixed or _locates_otherwise(law):
            return None
        loops.append(found)
    return tuple(loops)


def _locates_otherwise(law: ContactLaw) -> bool:
    """Whether a law has the loop of another one, but locates events in its own way."""
    kinds = type(law).__mro__

    def place(name: str) -> int:
        return next((i for i, kind in enumerate(kinds) if name in vars(kind)), len(kinds))

    return min(map(place, ("locate", "find"))) < place("event_loop")


@lru_cache(maxsize=32)
def _groups(equations: Equations) -> NDArray[np.int64] | None:
    """`Plan.groups` without numbers of values, None where loops have no addresses."""
    flat, two, three = np.empty(0), np.empty((0, 0)), np.empty((0, 0, 0))
    rows = []
    for group, each in zip(equations.located, _loops(equations) or (), strict=True):
        size, law = equations.basis.n_components, group.law
        arguments = each.basis.arrays, two, two, flat, two, two, three, two
        if not each.loop.compiles(*arguments):
            return None
        address = each.loop.address(*arguments)
        motion, q = group.rows.shape[1] * size, len(law.switches)
        counts = motion, 0, law.n_events(equations.basis), q, q * motion, each.n_details
        rows.append((address, group.n, size, *counts))
    return np.array(rows, dtype=np.int64)


@lru_cache(maxsize=32)
def _spread(equations: Equations) -> Any:
    """The motions of all contacts by the unknowns, sparse by rows."""
    return sp.csr_array(sp.vstack([equations.spreads(g)[0] for g in equations.located]))
