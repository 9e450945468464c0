"""CasADi graph of Newton's method on a frequency curve, for `CompiledCorrector`.

Passes after convergence are skipped, so that a correction costs no more solves than it needs.
"""

from contextlib import suppress
from ctypes import CDLL
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca

from symhbm.continuation.newton import TOLERANCE

MAX_CORRECTIONS = 10
STAGNATION = 1e-3
"""Last step up to which an iteration that stagnates on the curve does so by round-off."""
RUNNING, DONE, FAILED = 0, 1, 2
_MOST_UNKNOWNS = 80
"""Number of unknowns up to which LAPACK on the full matrix is faster than sparse elimination."""
_MOST_ENTRIES = 1200
"""Entries of the matrix up to which code of the whole correction is faster than LAPACK."""


def correction(system: ca.Function) -> ca.Function:
    """CasADi function that solves from a guess: an iteration of a `point_system`.

    Inputs: ``parameters``, ``point`` (the guess), ``normal``, ``anchor``, ``limit`` and ``imposed``
    as of the system, and ``settings``: scale of unknowns and frequency, precision and radius.
    Outputs: point, direction, (status, number of solves), and ``values`` of the system, followed by
    the rates of the slip margins.
    """
    parameters, point, normal, anchor, limit, imposed = (
        ca.MX.sym(name, system.size1_in(name))
        for name in ("parameters", "point", "normal", "anchor", "limit", "imposed")
    )
    settings = ca.MX.sym("settings", 4)
    data = [parameters, point, normal, anchor, limit, imposed, settings]
    iteration = _iteration(system, data)
    n_values = system.size1_out("values") + limit.shape[0]
    state = [point, normal, ca.MX(ca.DM([RUNNING, 0])), ca.MX(ca.inf), ca.MX(n_values, 1)]
    for _ in range(MAX_CORRECTIONS + 1):
        state = list(iteration(state[2][0] == RUNNING, *state, *data))
    outputs = [ca.densify(part) for part in (*state[:3], state[4])]
    return ca.Function("correction", data, outputs)


def tangent(system: ca.Function) -> ca.Function:
    """CasADi function of the tangent at a solution.

    Inputs: ``parameters``, ``point``, ``normal`` that gives the sense, ``imposed``,
    ``settings``. Outputs: direction and values, as of `correction`.
    """
    parameters, point, normal, imposed = (
        ca.MX.sym(name, system.size1_in(name))
        for name in ("parameters", "point", "normal", "imposed")
    )
    settings = ca.MX.sym("settings", 4)
    nothing = ca.MX(system.size1_in("limit"), 1)
    matrix, right, values, limits = system(
        parameters, point, point, normal, point, nothing, imposed, settings[:2]
    )
    along = ca.solve(matrix, right[:, 1], *_solver(system))
    direction = along / ca.norm_2(along)
    values = ca.densify(ca.vertcat(values, ca.mtimes(limits, direction)))
    inputs = [parameters, point, normal, imposed, settings]
    return ca.Function("tangent", inputs, [direction, values])


def _iteration(system: ca.Function, data: list[ca.MX]) -> ca.Function:
    """One pass of the iteration if it runs, from its state and the constant ``data``.

    The state is the point, the direction, (status, number of solves), the length of the last step
    and the values at the point.
    """
    parameters, guess, normal, anchor, limit, imposed, settings = data
    scale, precision = settings[:2], settings[2]
    iterate, direction = (ca.MX.sym(name, guess.shape[0]) for name in ("iterate", "direction"))
    progress, last_step = ca.MX.sym("progress", 2), ca.MX.sym("last_step")
    matrix, right, values, limits = system(
        parameters, iterate, guess, normal, anchor, limit, imposed, scale
    )
    values = ca.densify(ca.vertcat(values, ca.mtimes(limits, direction)))
    previous_values = ca.MX.sym("previous_values", values.shape[0])
    state = [iterate, direction, progress, last_step, previous_values]
    idle = ca.Function("idle", [*state, *data], state)

    norm, value, solves = values[0], ca.fabs(values[1]), progress[1]
    on_curve = ca.logic_and(norm <= TOLERANCE, value <= TOLERANCE)
    on_curve = ca.logic_and(on_curve, solves > 0)
    arrived = ca.logic_and(on_curve, last_step <= precision)
    finite = ca.logic_and(norm < ca.inf, value < ca.inf)
    stops = ca.logic_or(arrived, ca.logic_or(solves >= MAX_CORRECTIONS, ca.logic_not(finite)))
    outcome = ca.if_else(ca.logic_and(on_curve, last_step <= STAGNATION), DONE, FAILED)
    next_state = _step(system)(
        ca.logic_not(stops),
        matrix,
        right,
        iterate,
        direction,
        progress,
        last_step,
        on_curve,
        outcome,
        settings,
    )
    running = ca.Function("running", [*state, *data], [*next_state, values])
    return ca.Function.if_else("iteration", running, idle)


def _step(system: ca.Function) -> ca.Function:
    """One Newton step if one is due, else its end with the ``outcome``."""
    n = system.size1_in("point")
    matrix, right = ca.MX.sym("matrix", system.sparsity_out("matrix")), ca.MX.sym("right", n, 2)
    iterate, direction = ca.MX.sym("iterate", n), ca.MX.sym("direction", n)
    progress, last, settings = ca.MX.sym("progress", 2), ca.MX.sym("last"), ca.MX.sym("settings", 4)
    on_curve, outcome = ca.MX.sym("on_curve"), ca.MX.sym("outcome")
    inputs = [matrix, right, iterate, direction, progress, last, on_curve, outcome, settings]
    solves = progress[1]
    stop = ca.Function("stop", inputs, [iterate, direction, ca.vertcat(outcome, solves), last])

    solution = ca.solve(matrix, right, *_solver(system))
    step, along = solution[:, 0], solution[:, 1]
    length, size = ca.norm_2(step), ca.norm_2(along)
    finite = ca.logic_and(length < ca.inf, size < ca.inf)
    stays = ca.logic_and(solves > 2, length > last)
    leaves = ca.logic_or(ca.logic_not(finite), length > settings[3])
    status = ca.if_else(
        stays, ca.if_else(on_curve, DONE, FAILED), ca.if_else(leaves, FAILED, RUNNING)
    )
    scale = ca.vertcat(ca.repmat(settings[0], n - 1), settings[1])
    iterate = ca.if_else(status == RUNNING, iterate + step * scale, iterate)
    direction = ca.if_else(stays, direction, along / size)
    move = ca.Function("move", inputs, [iterate, direction, ca.vertcat(status, solves + 1), length])
    return ca.Function.if_else("step", move, stop)


def is_generated(system: ca.Function) -> bool:
    """Whether CasADi writes the code of a whole correction: its factorisation by Householder.

    For few unknowns, or rows with few entries; others are for LAPACK or a sparse elimination.
    """
    matrix = system.sparsity_out("matrix")
    return matrix.size1() <= _MOST_UNKNOWNS and matrix.nnz() <= _MOST_ENTRIES


def _solver(system: ca.Function) -> tuple[Any, ...]:
    """Name and options of the linear solver."""
    if is_generated(system):
        return "qr", {"eps": 0.0}  # entries have no size from which on they are zero
    return (_lapack() if system.size1_in("point") <= _MOST_UNKNOWNS else "csparse",)


@cache
def _lapack() -> str:
    """CasADi's solver for full matrices, set to one thread where CasADi ships the library.

    It shares even two right-hand sides of eight equations among threads: that changes the last
    digits, and waiting takes up to a hundred times longer than the work.
    """
    for library in Path(ca.__file__).parent.glob("*casadi-tp-openblas*"):
        with suppress(OSError, AttributeError):  # another file whose name matches
            CDLL(str(library)).openblas_set_num_threads(1)
    return "lapacklu"
