"""Newton's method on the equations and one constraint as one compiled function.

Under one harmonic the events of contacts are closed forms, so that the whole iteration (events,
residual, Jacobian, factorisation, step, tangent) needs no Python: a correction is one call. It does
what `symhbm.corrector.Corrector` does step by step for all other equations.
"""

import threading
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.compiled import Compiled
from symhbm.constraints import AtLimit, Constraint, Corrected, Hyperplane
from symhbm.curve import Curve, FrequencyCurve
from symhbm.equations import Equations
from symhbm.fourier import FloatArray
from symhbm.native import native
from symhbm.newton import TOLERANCE
from symhbm.point_system import SCALARS, point_system

MAX_CORRECTIONS = 10
STAGNATION = 1e-3
"""Last step of an iteration that stays on the curve, at which what stays is round-off."""
_DENSE_LIMIT = 80
"""Number of unknowns up to which LAPACK on the full matrix is faster than sparse elimination."""
_OFTEN = 50
"""Curves of one structure after which machine code saves more time than it takes to make."""
_RUNNING, _DONE, _FAILED = 0, 1, 2


class CompiledCorrector:
    """Corrects guesses onto the frequency curve of one problem; see `Corrector`."""

    def __init__(self, curve: FrequencyCurve):
        equations, arguments = curve.problem.compiled
        self._correct, self._tangent = map(Compiled, _programs(equations).functions())
        for function in (self._correct, self._tangent):
            function.inputs[0][:] = np.concatenate([np.ravel(array) for array in arguments])
        self._size = curve.problem.n_unknowns + 1
        self._n_contacts = curve.problem.n_contacts

    def correct(
        self,
        guess: FloatArray,
        scale: FloatArray,
        constraint: Constraint,
        slip: NDArray[np.bool_],
        precision: float,
        radius: float,
    ) -> tuple[Corrected | None, int]:
        """Solve from ``guess`` and tell the linear solves; arguments as of `Corrector.correct`."""
        _, first, normal, anchor, limit, imposed, settings = self._correct.inputs
        first[:], imposed[:] = guess, slip
        settings[:] = scale[0], scale[-1], precision, radius
        limit[:] = 0.0
        if isinstance(constraint, Hyperplane):
            normal[:], anchor[:] = constraint.normal, constraint.anchor
        else:
            assert isinstance(constraint, AtLimit)
            normal[:], limit[constraint.contact] = 0.0, 1.0
        self._correct.run()
        point, direction, (status, solves), values = self._correct.outputs
        if status != _DONE:
            return None, int(solves)
        return self._corrected(point.copy(), direction.copy(), values), int(solves)

    def tangent(
        self, point: FloatArray, scale: FloatArray, row: FloatArray, slip: NDArray[np.bool_]
    ) -> Corrected | None:
        """Tangent at a solution, along ``row``; None where there is none."""
        _, at, normal, imposed, settings = self._tangent.inputs
        at[:], normal[:], imposed[:] = point, row, slip
        settings[:2] = scale[0], scale[-1]
        self._tangent.run()
        direction, values = self._tangent.outputs
        if not np.isfinite(direction).all():
            return None
        return self._corrected(point, direction.copy(), values)

    def _corrected(self, point: FloatArray, direction: FloatArray, values: Any) -> Corrected:
        norm, _, amplification, error, below, crosses = values[:SCALARS].tolist()
        excess, rate = values[SCALARS:].reshape(2, self._n_contacts).copy()
        sign = 1 if direction[-1] >= 0 else -1
        below = None if below < 0 else int(below)
        contacts = excess, rate, crosses > 0
        return Corrected(point, direction, sign, norm, amplification, error, *contacts, below)


def compiled_corrector(curve: Curve) -> CompiledCorrector | None:
    """The compiled corrector of a curve, None for one that needs Python."""
    if not isinstance(curve, FrequencyCurve) or not curve.single_valued:
        return None
    return CompiledCorrector(curve) if curve.problem.in_closed_form else None


@lru_cache(maxsize=32)
def _programs(equations: Equations) -> "_Programs":
    return _Programs(point_system(equations))


class _Programs:
    """The functions of one structure; those of many curves become machine code where they can."""

    def __init__(self, system: ca.Function):
        self._system = system
        self._functions = _functions(system)
        self._uses = 0
        self._lock = threading.Lock()

    def functions(self) -> tuple[ca.Function, ca.Function]:
        """The correction and the tangent."""
        with self._lock:
            self._uses += 1
            if self._uses == _OFTEN and (system := native(self._system)) is not None:
                self._functions = _functions(system)
            return self._functions


def _functions(system: ca.Function) -> tuple[ca.Function, ca.Function]:
    """The correction and the tangent, functions of the parameters as one vector."""
    parameters, point, normal, anchor, limit, imposed = (
        ca.MX.sym(name, system.size1_in(name))
        for name in ("parameters", "point", "normal", "anchor", "limit", "imposed")
    )
    settings = ca.MX.sym("settings", 4)
    data = [parameters, point, normal, anchor, limit, imposed, settings]
    iteration = _iteration(system, data)
    n_values = system.size1_out("values") + limit.shape[0]
    at = [point, normal, ca.MX(ca.DM([_RUNNING, 0])), ca.MX(ca.inf), ca.MX(n_values, 1)]
    for _ in range(MAX_CORRECTIONS + 1):
        at = list(iteration(at[2][0] == _RUNNING, *at, *data))
    outputs = [ca.densify(part) for part in (*at[:3], at[4])]
    correct = ca.Function("correct", data, outputs)

    scale = settings[:2]
    matrix, right, values, limits = system(
        parameters, point, point, normal, point, ca.MX(*limit.shape), imposed, scale
    )
    along = ca.solve(matrix, right[:, 1], _solver(system))
    direction = along / ca.norm_2(along)
    values = ca.densify(ca.vertcat(values, ca.mtimes(limits, direction[:-1])))
    inputs = [parameters, point, normal, imposed, settings]
    return correct, ca.Function("tangent", inputs, [direction, values])


def _iteration(system: ca.Function, data: list[ca.MX]) -> ca.Function:
    """One pass of the iteration, by whether it runs, of a state and constant ``data``.

    The state is the point, the direction, (status, number of solves), the length of the last step
    and the values at the point.
    """
    parameters, guess, normal, anchor, limit, imposed, settings = data
    scale, precision = settings[:2], settings[2]
    here, direction = (ca.MX.sym(name, guess.shape[0]) for name in ("here", "direction"))
    progress, last = ca.MX.sym("progress", 2), ca.MX.sym("last")
    matrix, right, values, limits = system(
        parameters, here, guess, normal, anchor, limit, imposed, scale
    )
    values = ca.densify(ca.vertcat(values, ca.mtimes(limits, direction[:-1])))
    before = ca.MX.sym("before", values.shape[0])
    state = [here, direction, progress, last, before]
    idle = ca.Function("idle", [*state, *data], state)

    norm, value, solves = values[0], ca.fabs(values[1]), progress[1]
    on_curve = ca.logic_and(norm <= TOLERANCE, value <= TOLERANCE)
    on_curve = ca.logic_and(on_curve, solves > 0)
    arrived = ca.logic_and(on_curve, last <= precision)
    finite = ca.logic_and(norm < ca.inf, value < ca.inf)
    stops = ca.logic_or(arrived, ca.logic_or(solves >= MAX_CORRECTIONS, ca.logic_not(finite)))
    verdict = ca.if_else(ca.logic_and(on_curve, last <= STAGNATION), _DONE, _FAILED)
    moved = _step(system)(
        ca.logic_not(stops),
        matrix,
        right,
        here,
        direction,
        progress,
        last,
        on_curve,
        verdict,
        settings,
    )
    running = ca.Function("running", [*state, *data], [*moved, values])
    return ca.Function.if_else("iteration", running, idle)


def _step(system: ca.Function) -> ca.Function:
    """One Newton step, by whether one is due, else the ``verdict``."""
    n = system.size1_in("point")
    matrix, right = ca.MX.sym("matrix", system.sparsity_out("matrix")), ca.MX.sym("right", n, 2)
    here, direction = ca.MX.sym("here", n), ca.MX.sym("direction", n)
    progress, last, settings = ca.MX.sym("progress", 2), ca.MX.sym("last"), ca.MX.sym("settings", 4)
    on_curve, verdict = ca.MX.sym("on_curve"), ca.MX.sym("verdict")
    inputs = [matrix, right, here, direction, progress, last, on_curve, verdict, settings]
    solves = progress[1]
    rest = ca.Function("rest", inputs, [here, direction, ca.vertcat(verdict, solves), last])

    solution = ca.solve(matrix, right, _solver(system))
    step, along = solution[:, 0], solution[:, 1]
    length, size = ca.norm_2(step), ca.norm_2(along)
    finite = ca.logic_and(length < ca.inf, size < ca.inf)
    stays = ca.logic_and(solves > 2, length > last)
    leaves = ca.logic_or(ca.logic_not(finite), length > settings[3])
    status = ca.if_else(
        stays, ca.if_else(on_curve, _DONE, _FAILED), ca.if_else(leaves, _FAILED, _RUNNING)
    )
    scale = ca.vertcat(ca.repmat(settings[0], n - 1), settings[1])
    here = ca.if_else(status == _RUNNING, here + step * scale, here)
    direction = ca.if_else(stays, direction, along / size)
    move = ca.Function("move", inputs, [here, direction, ca.vertcat(status, solves + 1), length])
    return ca.Function.if_else("step", move, rest)


def _solver(system: ca.Function) -> str:
    return "lapacklu" if system.size1_in("point") <= _DENSE_LIMIT else "csparse"
