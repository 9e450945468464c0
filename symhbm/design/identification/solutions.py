"""Solutions that measurements are of: what sensors see of them, and how that moves and bends.

Each has a state ``s``; a sensor sees ``rows @ s``. A response and a mode solve ``R(s, p) = 0``:
they move by ``-R_s^-1 R_p``. The second derivative of a sum of readings, ``pull @ s``, is that of
the Lagrangian: one solution with the transposed Jacobian gives the multipliers of all parameters. A
peak has its height and its frequency as a state, with derivatives of its own conditions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from symhbm.balance import Evaluation, HarmonicBalance, SecondOrder
from symhbm.continuation import newton
from symhbm.continuation.unforced import NonlinearModeProblem, linear_mode, mode_start
from symhbm.numerics import RADIANS, Factorisation, FloatArray
from symhbm.peaks import Conditions, survey
from symhbm.peaks.tracking import advanced, verified

_SMALL = 1e-6
"""Amplitude of a linear mode over where the structure rests, or in m where it rests at 0."""
_NEAR = 0.05
"""Change of a frequency from the predicted one, relative, of what may be another mode."""


@dataclass(frozen=True, eq=False)
class Response:
    """A response of a problem at ``omega`` [rad/s]; ``evaluation`` is the balance there.

    Its ``state`` (n_state,) are the unknowns.
    """

    order: SecondOrder
    problem: HarmonicBalance
    omega: float
    state: FloatArray
    evaluation: Evaluation

    @property
    def _motion(self) -> FloatArray:
        return self.state[: self.problem.n_unknowns]

    @property
    def size(self) -> float:
        """The largest displacement in it [m]."""
        return float(np.abs(self._motion).max())

    @property
    def margins(self) -> FloatArray:
        """Margins of the switches of its contacts, (n_switches,)."""
        return self.evaluation.states.margins

    @property
    def _by_parameters(self) -> FloatArray:
        at = self.problem, self._motion, self.omega, self.evaluation.states
        return self.order.by_parameters(*at)

    def move(self, own: FloatArray) -> FloatArray:
        """Derivatives (n_state, n) of the state, parameters moving by ``own`` (n_balanced, n)."""
        right = np.zeros((len(self.state), own.shape[1]))
        right[: self.problem.n_unknowns] = self._by_parameters @ own
        found = Factorisation(self.evaluation.jacobian).solve(-right)
        if found is None:
            raise ArithmeticError(f"the solution at {self.omega / RADIANS:g} Hz is singular")
        return found

    def bend(self, pull: FloatArray, own: FloatArray, bends: FloatArray) -> FloatArray:
        """Second derivatives (n, n) of ``pull @ state``, ``own`` bending by (n_balanced, n, n)."""
        found = Factorisation(self.evaluation.jacobian.T).solve(pull)
        assert found is not None
        weights, move = found[: self.problem.n_unknowns], self.move(own)
        at = self.problem, self._motion, self.omega, weights
        hessian = self.order(*at, evaluation=self.evaluation).hessian
        along = np.vstack([move[: len(weights)], self._of_frequency(move), own])
        result = -(along.T @ (hessian @ along)) - self._added(weights, move)
        return result - np.tensordot(self._by_parameters.T @ weights, bends, 1)

    def _of_frequency(self, move: FloatArray) -> FloatArray:
        """How the frequency moves: of a response it is given."""
        return np.zeros((1, move.shape[1]))

    def _added(self, weights: FloatArray, move: FloatArray) -> Any:
        """Second derivatives of weighted forces that are not in the balance."""
        return 0.0


@dataclass(frozen=True, eq=False)
class Mode(Response):
    """A nonlinear mode, whose state are coefficients, frequency [rad/s] and damping ratio."""

    curve: NonlinearModeProblem

    def _of_frequency(self, move: FloatArray) -> FloatArray:
        n = self.problem.n_unknowns
        return move[n : n + 1]

    def _added(self, weights: FloatArray, move: FloatArray) -> Any:
        ratio = self.curve.damping_ratio(self.state)
        return -self.curve.sustained.bend(weights, self._motion, self.omega, ratio, move)


@dataclass(frozen=True, eq=False)
class Peak:
    """The highest peak of a goal over the frequency; its state is its height and frequency."""

    conditions: Conditions

    @property
    def problem(self) -> HarmonicBalance:
        """The problem that it is of."""
        return self.conditions.maximum.problem

    @property
    def omega(self) -> float:
        """Its angular frequency [rad/s]."""
        return self.conditions.maximum.frequency

    @property
    def state(self) -> FloatArray:
        """Height and frequency [rad/s], (2,)."""
        return np.array([self.conditions.maximum.amplitude, self.omega])

    @property
    def size(self) -> float:
        """As of a response."""
        return float(np.abs(self.conditions.maximum.unknowns).max())

    @property
    def margins(self) -> FloatArray:
        """As of a response; a corner is where a contact is on its limit, and moves with it."""
        margins = self.conditions.evaluation.states.margins.copy()
        margins[self.conditions.maximum.on_limit] = np.inf
        return margins

    def move(self, own: FloatArray) -> FloatArray:
        """As of a response."""
        return np.array([self.conditions.gradient, self.conditions.frequency_gradient]) @ own

    def bend(self, pull: FloatArray, own: FloatArray, bends: FloatArray) -> FloatArray:
        """As of a response, or NaN: that of the frequency takes third derivatives."""
        if pull[1]:
            return np.full((own.shape[1],) * 2, np.nan)
        of = self.conditions
        return pull[0] * (own.T @ of.hessian @ own + np.tensordot(of.gradient, bends, 1))


Solved = Response | Peak


def peak_of(
    order: SecondOrder, problem: HarmonicBalance, band: tuple[float, float], near: Solved | None
) -> Peak:
    """The highest peak in a ``band`` [Hz], or the one that a peak ``near`` becomes.

    ArithmeticError where there is none.
    """
    if isinstance(near, Peak):
        step = advanced(near.conditions, problem)
        if step is not None and band[0] <= step[0].maximum.frequency / RADIANS <= band[1]:
            return Peak(step[0])
    surveyed = survey(problem, [band])
    if np.isfinite(surveyed.height):
        solved = verified(order, surveyed.maxima[0])
        if solved is not None:
            return Peak(solved)
    raise ArithmeticError(f"no peak was found from {band[0]:g} to {band[1]:g} Hz")


def mode_of(
    order: SecondOrder,
    problem: HarmonicBalance,
    which: tuple[int, int | None],
    amplitude: float,
    predicted: FloatArray | None,
) -> Mode:
    """The mode ``which``, number and degree of freedom of its amplitude [m]; NaN of small motions.

    From a state ``predicted`` where that leads to the same mode. ArithmeticError where there is
    none.
    """
    linear = linear_mode(problem, *which)
    curve = NonlinearModeProblem(problem, linear.dof)
    if np.isnan(amplitude):
        amplitude = _SMALL * (float(np.abs(linear.rest).max()) or 1.0)
    at, result = partial(curve.evaluate, value=float(np.log10(amplitude))), None
    if predicted is not None:
        result = newton(at, predicted)
        if abs(curve.frequency(result.unknowns) / curve.frequency(predicted) - 1) > _NEAR:
            result = None
    if result is None or not result.converged:
        result = mode_start(curve, linear, amplitude)
    if not result.converged:
        raise ArithmeticError(f"no mode was found at an amplitude of {amplitude:g} m")
    state = result.unknowns
    return Mode(order, problem, curve.frequency(state), state, result.evaluation, curve)
