"""The periodic motion among all motions: Newton's method on the map over a period or half a one."""

import contextlib
from dataclasses import dataclass
from functools import partial

import numpy as np

from symhbm.event_march import March, march
from symhbm.fourier import FloatArray
from symhbm.linear import Factorisation
from symhbm.linear_pieces import LinearPieces, extremes
from symhbm.newton import newton
from symhbm.residual import HarmonicBalance
from symhbm.start import linear_response
from symhbm.status import Status

TOLERANCE = 1e-11
"""Largest residual of periodicity relative to the motion, in the norm of energy."""
_ITERATIONS = 60
_PERIODS = 10
"""Marched where no step of Newton's method leads on: every one comes closer to the response."""
_SMALLEST = 1e-12
"""Singular values below this share of the largest one are those of motions that are free."""


def balanced_start(problem: HarmonicBalance, pieces: LinearPieces) -> FloatArray:
    """State (2 n_dof + n_active,) at ``tau = 0`` by the balance of a few harmonics."""
    harmonics = (1, 3, 5, 7) if pieces.antiperiodic else range(6)
    harmonics = {*harmonics, *pieces.orders.tolist()}
    balance = HarmonicBalance(problem.model, problem.excitation, harmonics)
    unknowns = linear_response(balance, pieces.frequency)
    if unknowns is None:
        unknowns = np.zeros(balance.n_unknowns)
    with contextlib.suppress(ArithmeticError):
        unknowns = newton(partial(balance.evaluate, frequency=pieces.frequency), unknowns).unknowns
    law = balance.locate(unknowns)
    relative = balance.relative(unknowns)[pieces.active]
    stick = np.einsum("cij,cj->ci", law.matrix[pieces.active], relative)
    friction = pieces.contact_stiffness[:, None] * stick
    friction += pieces.limit[:, None] * law.vector[pieces.active]
    x, slope = (balance.coefficients(unknowns) @ balance.basis.values(0.0, d) for d in (0, 1))
    return np.concatenate([x, slope, friction @ balance.basis.values(0.0)])


def energy_scale(pieces: LinearPieces) -> FloatArray:
    """Roots of the energies of unit states (2 n_dof + n_active,)."""
    inertia = pieces.frequency**2 * np.diag(pieces.mass)
    elastic = np.diag(pieces.stiffness)
    return np.sqrt(np.concatenate([elastic + inertia, inertia, 1 / pieces.contact_stiffness]))


@dataclass(frozen=True)
class _Trial:
    state: FloatArray
    run: March
    residual: FloatArray
    norm: float


def periodic_state(pieces: LinearPieces, state: FloatArray) -> tuple[FloatArray, int, Status]:
    """State at ``tau = 0`` of the periodic motion, steps of Newton's method, and how it ended."""
    if not pieces.largest_force:
        return np.zeros_like(state), 0, Status.SUCCESS
    length, sign = (np.pi, -1.0) if pieces.antiperiodic else (2 * np.pi, 1.0)
    n, scale = 2 * pieces.n_dof, energy_scale(pieces)

    def attempt(state: FloatArray) -> _Trial:
        state = state.copy()
        state[n:] = np.clip(state[n:], -pieces.limit, pieces.limit)
        run = march(pieces, state, length)
        residual = sign * run.end - state
        if not pieces.antiperiodic:
            state = _centred(pieces, run, state)
        return _Trial(state, run, residual, float(np.linalg.norm(scale * residual)))

    try:
        now = attempt(state)
    except ArithmeticError:
        now = attempt(np.zeros_like(state))
    for iteration in range(_ITERATIONS):
        near = now.norm <= TOLERANCE * np.linalg.norm(scale * now.state)
        if now.norm == 0:
            return now.state, iteration, Status.SUCCESS
        step = _newton_step(pieces, now, sign, scale)
        if step is None:
            return now.state, iteration, Status.SYSTEM_SINGULAR
        for share in 0.5 ** np.arange(1 if near else 8):
            with contextlib.suppress(ArithmeticError):
                trial = attempt(now.state + share * step)
                if trial.norm <= (1 - (0.5 if near else 1e-4) * share) * now.norm:
                    now = trial
                    break
        else:
            if near:
                return now.state, iteration, Status.SUCCESS
            for _ in range(_PERIODS):
                now = attempt(sign * now.run.end)
    return now.state, _ITERATIONS, Status.NO_CONVERGENCE


def _newton_step(
    pieces: LinearPieces, now: _Trial, sign: float, scale: FloatArray
) -> FloatArray | None:
    assert now.run.jacobian is not None
    unit = np.eye(len(scale))
    matrix, right = sign * now.run.jacobian - unit, -now.residual
    floats = not pieces.antiperiodic and np.linalg.matrix_rank(pieces.stiffness) < pieces.n_dof
    if not pieces.antiperiodic and not floats:
        # The static force of a contact that never slips is free: no step changes it.
        free = 2 * pieces.n_dof + np.flatnonzero(~now.run.slipped)
        matrix[free], right[free] = unit[free], 0.0
    matrix, right = matrix * (scale[:, None] / scale), scale * right
    if floats:
        # The place of a body without springs is free instead: the nearest one.
        step = np.linalg.lstsq(matrix, right, rcond=_SMALLEST)[0]
    else:
        step = Factorisation(matrix).solve(right)
    return None if step is None else step / scale


def _centred(pieces: LinearPieces, run: March, state: FloatArray) -> FloatArray:
    """The same motion with the forces of contacts that never slip between their limits.

    Static forces of such contacts move the whole motion, and no other force sees that.
    """
    stuck = np.flatnonzero(~run.slipped)
    directions = pieces.directions[stuck]
    force = pieces.contact_stiffness[stuck] * (run.cells.displacement @ directions.T)
    force[:, 0] = run.cells.friction[:, stuck]
    high, low = extremes(force)
    push = -(high + low) / 2 @ directions
    move = np.linalg.lstsq(pieces.stiffness, -push, rcond=None)[0]
    if np.abs(pieces.stiffness @ move + push).max() > 1e-9 * np.abs(push).max():
        return state
    shift = np.zeros_like(state)
    shift[: pieces.n_dof] = move
    shift[2 * pieces.n_dof + stuck] = -(high + low) / 2
    return state + shift
