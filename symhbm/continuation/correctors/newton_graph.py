"""Newton's method on a frequency curve as a graph of CasADi: what `CompiledCorrector` runs.

Passes that are not needed are skipped, so that a correction costs the solves it takes.
"""

from contextlib import suppress
from ctypes import CDLL
from functools import cache
from pathlib import Path

import casadi as ca

from symhbm.continuation.newton import TOLERANCE

MAX_CORRECTIONS = 10
STAGNATION = 1e-3
"""Last step of an iteration that stays on the curve, at which what stays is round-off."""
RUNNING, DONE, FAILED = 0, 1, 2
_DENSE_LIMIT = 80
"""Number of unknowns up to which LAPACK on the full matrix is faster than sparse elimination."""


def correction(system: ca.Function) -> ca.Function:
    """CasADi function that solves from a guess: an iteration of a `point_system`.

    Inputs: ``parameters``, ``point`` (the guess), ``normal``, ``anchor``, ``limit`` and ``imposed``
    as of the system, and ``settings``: scale of unknowns and frequency, precision and radius.
    Outputs: point, direction, (status, number of solves), and ``values`` of the system with the
    rates of the slip_margin.
    """
    parameters, point, normal, anchor, limit, imposed = (
        ca.MX.sym(name, system.size1_in(name))
        for name in ("parameters", "point", "normal", "anchor", "limit", "imposed")
    )
    settings = ca.MX.sym("settings", 4)
    data = [parameters, point, normal, anchor, limit, imposed, settings]
    iteration = _iteration(system, data)
    n_values = system.size1_out("values") + limit.shape[0]
    at = [point, normal, ca.MX(ca.DM([RUNNING, 0])), ca.MX(ca.inf), ca.MX(n_values, 1)]
    for _ in range(MAX_CORRECTIONS + 1):
        at = list(iteration(at[2][0] == RUNNING, *at, *data))
    outputs = [ca.densify(part) for part in (*at[:3], at[4])]
    return ca.Function("correction", data, outputs)


def tangent(system: ca.Function) -> ca.Function:
    """CasADi function of the tangent at a solution.

    Inputs: ``parameters``, ``point``, ``normal`` to go along, ``imposed`` and ``settings``.
    Outputs: direction and values, as of `correction`.
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
    along = ca.solve(matrix, right[:, 1], _solver(system))
    direction = along / ca.norm_2(along)
    values = ca.densify(ca.vertcat(values, ca.mtimes(limits, direction[:-1])))
    inputs = [parameters, point, normal, imposed, settings]
    return ca.Function("tangent", inputs, [direction, values])


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
    verdict = ca.if_else(ca.logic_and(on_curve, last <= STAGNATION), DONE, FAILED)
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
        stays, ca.if_else(on_curve, DONE, FAILED), ca.if_else(leaves, FAILED, RUNNING)
    )
    scale = ca.vertcat(ca.repmat(settings[0], n - 1), settings[1])
    here = ca.if_else(status == RUNNING, here + step * scale, here)
    direction = ca.if_else(stays, direction, along / size)
    move = ca.Function("move", inputs, [here, direction, ca.vertcat(status, solves + 1), length])
    return ca.Function.if_else("step", move, rest)


def _solver(system: ca.Function) -> str:
    return _lapack() if system.size1_in("point") <= _DENSE_LIMIT else "csparse"


@cache
def _lapack() -> str:
    """The solver on full matrices, on one thread where CasADi brings the library for it.

    Threads share two right-hand sides of even eight equations: that changes the last digits, and
    to wait for them takes up to a hundred times longer than the work.
    """
    for library in Path(ca.__file__).parent.glob("*casadi-tp-openblas*"):
        with suppress(OSError, AttributeError):  # a file beside the library itself
            CDLL(str(library)).openblas_set_num_threads(1)
    return "lapacklu"
