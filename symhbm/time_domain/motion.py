"""The periodic motion in time: event-driven for springs and sliders, by shooting with others.

Of motions that no force drives the period is unknown as well, and of a nonlinear mode the damping
ratio of the force along the momentum that sustains it, while its amplitude is given.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import newton, solve_point
from symhbm.numerics import FloatArray, by_harmonic, larger_set, unknowns_of
from symhbm.time_domain.event_march import March, march
from symhbm.time_domain.exact_motion import ExactMotion, exact_motion
from symhbm.time_domain.linear_motion import LinearMotion, curved, extremes, in_plane
from symhbm.time_domain.periodic_orbit import PERIODIC_TOLERANCE, energy_scale, state_of
from symhbm.time_domain.planar_march import planar_march, planar_shot
from symhbm.time_domain.planar_motion import PlanarMotion
from symhbm.time_domain.shooting import shoot

Balanced = tuple[HarmonicBalance, FloatArray]
"""A problem and its unknowns (n_unknowns,) [m]."""
_ITERATIONS = 30
_SHARES = (1.0, 0.5, 0.25, 0.125)
"""Shares of a Newton step that are tried."""
_STEP = 1e-6
"""Relative change of the period, and change of the damping ratio, of central differences."""
_UNDETERMINED = 1e-11
"""Share of the largest singular value below which a direction is: forces of stuck contacts."""
_FAR = 0.5
"""Change of the period, relative, or of the damping ratio beyond which it is another motion."""


def exact_motion_of(
    problem: HarmonicBalance, frequency: float, near: Balanced | None = None
) -> ExactMotion:
    """Find the periodic motion at an angular ``frequency`` [rad/s], exact for springs and sliders.

    There may be several, but with friction of a constant load alone: it is the one close to the
    response ``near``, by default to one that is solved for. Raises as `exact_motion` and `shoot`.
    """
    if not (curved(problem) or in_plane(problem)):
        return exact_motion(
            problem, frequency, None if near is None else state_of(*near, frequency)
        )
    if near is None:
        balance = problem.located()
        if not all(group.law.odd for group in curved(problem) + in_plane(problem)):
            balance = balance.with_harmonics((*range(max(*problem.harmonics, 2) + 1),))
        near = balance, solve_point(balance, frequency).unknowns
    how: Any = (PlanarMotion, planar_shot, planar_march) if in_plane(problem) else ()
    motion = shoot(*near, frequency, *how)
    if motion.converged:
        return motion
    return shoot(*_with_more_harmonics(*near, frequency), frequency, *how)


def _with_more_harmonics(
    balance: HarmonicBalance, unknowns: FloatArray, frequency: float
) -> Balanced:
    """The solution of the balance with more harmonics."""
    larger = HarmonicBalance(balance.model, balance.excitation, larger_set(balance.harmonics))
    coefficient = by_harmonic(balance.basis, balance.layout.coefficients(unknowns))
    start = unknowns_of(larger.basis, balance.harmonics, coefficient)
    return larger, newton(partial(larger.evaluate, frequency=frequency), start).unknowns


class FreeMotion(NamedTuple):
    """An exact free motion.

    ``frequency`` [rad/s]; ``damping_ratio``, 0 of a limit cycle; ``amplitude`` (n_dof,), largest
    ``|x|`` over the period [m].
    """

    frequency: float
    damping_ratio: float
    amplitude: FloatArray


def free_motion(
    problem: HarmonicBalance,
    frequency: float,
    unknowns: FloatArray,
    dof: int,
    damping_ratio: float | None = None,
) -> FreeMotion | None:
    """The exact motion near a balanced one without a force, None where none is found.

    ``unknowns`` (n_unknowns,) [m] and ``frequency`` [rad/s] are a solution of the ``problem``, of a
    limit cycle or, with a ``damping_ratio``, of a nonlinear mode. The exact one has the velocity of
    its degree of freedom ``dof`` at ``tau = 0``, and if it is a mode also its displacement.

    Raises ArithmeticError and ValueError as `march` and `LinearMotion`.
    """
    search = _Search(problem, frequency, dof, damping_ratio is not None)
    start = search.linear.of_active(state_of(problem, unknowns, frequency))
    found = search.solve(np.concatenate([start, [1.0, damping_ratio or 0.0]]))
    if found is None:
        return None
    place, run = found
    stretch, ratio = place[-2:].tolist()
    high, low = extremes(run.cells.displacement)
    # The product of ratio and frequency is that of the force, whatever the unit of time.
    return FreeMotion(frequency / stretch, ratio * stretch, np.maximum(high, -low))


class _Search:
    """Newton's method on state, period over that of ``frequency``, and damping ratio."""

    def __init__(self, problem: HarmonicBalance, frequency: float, dof: int, is_mode: bool):
        self.linear = LinearMotion(problem, frequency)
        self._dof, self._is_mode = dof, is_mode
        self._fixed = [self.linear.n_dof + dof, *([dof] if is_mode else [])]
        self._ratio = 0.0

    def sustained(self, ratio: float) -> LinearMotion:
        """The motions with the force of a damping ratio."""
        return self.linear.sustained(ratio) if self._is_mode else self.linear

    def _run(self, place: FloatArray) -> March:
        stretch, ratio = place[-2:].tolist()
        if not max(abs(stretch - 1), abs(ratio - self._ratio)) < _FAR:
            raise ArithmeticError("the motion is far from the one looked for")
        return march(self.sustained(ratio), place[:-2], 2 * np.pi * stretch)

    def solve(self, place: FloatArray) -> tuple[FloatArray, March] | None:
        """Unknowns of the periodic motion and its march, None without one."""
        n, self._ratio = len(place) - 2, float(place[-1])
        scale, fixed = energy_scale(self.linear), place[self._fixed].copy()
        size = np.linalg.norm(scale * place[:n])
        unit = np.append(1 / np.where(scale > 0, scale, 1.0), [1 / size, 1 / size])

        def residual(at: FloatArray, run: March) -> FloatArray:
            left = scale * (run.end - at[:n])
            return np.append(left, scale[self._fixed] * (at[self._fixed] - fixed))

        run = self._run(place)
        wrong = residual(place, run)
        for _ in range(_ITERATIONS):
            was = np.linalg.norm(wrong)
            if was <= PERIODIC_TOLERANCE * size:
                break
            matrix = np.zeros((len(wrong), n + 2))
            matrix[:n, :n] = scale[:, None] * (run.jacobian - np.eye(n))
            for k in (n, n + 1)[: 1 + self._is_mode]:
                step = _STEP * np.eye(n + 2)[k]
                ends = [self._run(place + sign * step).end for sign in (1, -1)]
                matrix[:n, k] = scale * (ends[0] - ends[1]) / (2 * _STEP)
            matrix[n + np.arange(len(fixed)), self._fixed] = scale[self._fixed]
            moved = np.linalg.lstsq(matrix * unit, -wrong, rcond=_UNDETERMINED)[0] * unit
            for share in _SHARES:
                try:
                    trial = place + share * moved
                    trial_run = self._run(trial)
                except ArithmeticError:
                    continue
                trial_wrong = residual(trial, trial_run)
                if np.linalg.norm(trial_wrong) < was:
                    place, run, wrong = trial, trial_run, trial_wrong
                    break
            else:
                break
        return (place, run) if np.linalg.norm(wrong) <= PERIODIC_TOLERANCE * size else None
