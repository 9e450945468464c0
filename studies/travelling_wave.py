"""Exact motion of a tuned ring under an engine order, from a fraction of its period.

Under an engine order the tuned ring moves as a travelling wave: after a turn over the number of
blades every blade moves as another one did before, and after half a turn with the other sign. The
response is unique, so the exact motion repeats itself, up to that shift and sign, after half a turn
over the number of blades, and only that much of it has to be marched.
"""

import contextlib
from dataclasses import dataclass

import numpy as np

import symhbm as sh
from symhbm.time_domain.event_march import March, march
from symhbm.time_domain.linear_motion import LinearMotion, extremes
from symhbm.time_domain.periodic_orbit import PERIODIC_TOLERANCE, energy_scale

ITERATIONS = 60


@dataclass(frozen=True)
class Wave:
    """Exact travelling wave: state at ``tau = 0``, largest displacement [m], whether any slips."""

    state: np.ndarray
    amplitude: float
    slips: bool
    periodicity: float


def travelling_wave(problem: sh.HarmonicBalance, frequency: float, *starts: np.ndarray) -> Wave:
    """Find the exact motion of the tuned ring at a ``frequency`` [Hz] by Newton's method.

    Each of ``starts`` (2 n_dof + n_contacts,) is displacement, its derivative by ``tau`` [m] and
    friction forces [N] at ``tau = 0``; the one nearest to a wave is taken. Raises ArithmeticError
    where nothing periodic is found.
    """
    pieces = LinearMotion(problem, 2 * np.pi * frequency)
    n = pieces.n_dof
    order = int(problem.parameters["engine_order"])
    # A turn over n moves the wave by as many blades as solve EO * shift = 1 modulo n; half of that
    # is half a turn back and (n + 1) / 2 of it on.
    shift = (n + 1) // 2 * pow(order, -1, n) % n
    blade = (np.arange(n) + shift) % n
    moved = np.concatenate([blade, n + blade, 2 * n + blade])
    scale = energy_scale(pieces)

    def attempt(state: np.ndarray) -> tuple[np.ndarray, March, np.ndarray, float]:
        state = state.copy()
        state[2 * n :] = np.clip(state[2 * n :], -pieces.friction, pieces.friction)
        stretch = march(pieces, state, np.pi / n)
        residual = -stretch.end[moved] - state
        size = np.linalg.norm(scale * state)
        return state, stretch, residual, float(np.linalg.norm(scale * residual) / size)

    now = min(map(attempt, starts), key=lambda trial: trial[3])
    for _ in range(ITERATIONS):
        state, stretch, residual, norm = now
        if norm <= PERIODIC_TOLERANCE:
            amplitude = float(np.abs(extremes(stretch.cells.displacement)).max())
            return Wave(state, amplitude, bool(stretch.slipped.any()), norm)
        matrix = (stretch.jacobian[moved] + np.eye(len(state))) * (scale[:, None] / scale)
        step = np.linalg.solve(matrix, scale * residual) / scale
        for share in 0.5 ** np.arange(8):
            # A step that is too long may lead to a motion that cannot be marched.
            with contextlib.suppress(ArithmeticError):
                trial = attempt(state + share * step)
                if trial[3] <= (1 - 1e-4 * share) * norm:
                    now = trial
                    break
        else:
            # Every period marched comes closer to the response.
            for _ in range(2 * n):
                now = attempt(-now[1].end[moved])
    raise ArithmeticError(f"no periodic motion at {frequency:g} Hz, {problem!r}")


def balanced_state(problem: sh.HarmonicBalance, unknowns: np.ndarray) -> np.ndarray:
    """State (2 n_dof + n_contacts,) at ``tau = 0`` of a motion of the balance."""
    law = problem.locate(unknowns, 0.0).groups["friction"].details
    model = problem.model
    force = model.contact_stiffness[:, None] * np.einsum(
        "cij,cj->ci", law.matrix, problem.layout.relative(unknowns)
    )
    force += (model.friction_coefficient * model.normal_load)[:, None] * law.vector
    coefficients = problem.layout.coefficients(unknowns)
    x, slope = (coefficients @ problem.basis.values(0.0, d) for d in (0, 1))
    return np.concatenate([x, slope, force @ problem.basis.values(0.0)])
