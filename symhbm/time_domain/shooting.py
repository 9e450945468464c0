"""The periodic motion with cubic springs, by shooting: an integrator, its variation and Newton.

The integrator (DOP853) keeps a tolerance, where motions with friction alone are known to round-off.
Its steps are polynomials too, so friction beside the springs is marched by
`symhbm.time_domain.event_march`.
Motions need not be unique: a response nearby chooses among them.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.numerics import FloatArray, check
from symhbm.time_domain.event_march import March, march
from symhbm.time_domain.exact_motion import ExactMotion, describe_motion
from symhbm.time_domain.linear_motion import DEGREE, LinearFlow, LinearMotion, extremes
from symhbm.time_domain.periodic_orbit import energy_scale, state_of

INTEGRATION_TOLERANCE = 1e-12
"""Of a step of the integrator, relative to the motion at its end and to the size of all of it."""
PERIODIC = 1e-9
"""Largest distance of states a period apart over the motion, in the norm of energy."""
_EVEN = 1e-9
"""Share of a response below which its even harmonics are none."""
_FARTHEST = 100.0
"""Trials beyond so many times the start are steps that are too long."""
_FIRST = 0.3
"""Share of a cell of the linear motion that is tried as the first step."""
_SHORTEST = 1e-7
"""Steps below this [rad] follow a motion that grows without bound."""
_ITERATIONS = 40
_SMALLEST = 1e-12
"""Singular values below this share of the largest one are those of motions that are free."""
_SAMPLES = 4096
"""Angles at which the extremes of a force are looked for: its derivative there is zero."""

# Accelerations along a step, at the nodes of Gauss, become the higher powers of its polynomial:
# integrated twice they are more accurate than the integrator's own interpolation.
_NODES = (np.polynomial.legendre.leggauss(7)[0] + 1) / 2
_ORDER = np.arange(len(_NODES))
_TO_POWERS = np.linalg.inv(_NODES[:, None] ** _ORDER)
_TO_POWERS /= ((_ORDER + 1) * (_ORDER + 2))[:, None]
_RATES = np.arange(DEGREE + 1.0)


@dataclass(frozen=True)
class _Step(LinearFlow):
    """A step of the integrator; all but the contacts (n_active,) that ``stick`` is made later."""

    stick: np.ndarray


class IntegratedMotion(LinearMotion):
    """The motions of a problem with cubic springs at an angular ``frequency`` [rad/s], by steps.

    ``size`` [m] is that of the motion, for the tolerance. Raises ValueError for a mass matrix that
    is not positive definite.
    """

    def __init__(self, problem: HarmonicBalance, frequency: float, size: float):
        super().__init__(problem.with_parameters(cubic_stiffness=0.0), frequency)
        stiffness = problem.model.cubic_stiffness
        springs = np.flatnonzero(stiffness)
        self._springs = self.all_directions[springs]
        inertia = frequency**2 * self.mass
        self._spring_push = np.linalg.solve(inertia, self._springs.T * stiffness[springs])
        # One column is the motion, the others its derivatives as `LinearFlow.series` orders them.
        n_columns = 1 + 3 * self.n_dof
        self._cube = np.append(1.0, np.full(n_columns - 1, 3.0))
        self._tolerance = np.full((2 * self.n_dof, n_columns), INTEGRATION_TOLERANCE)
        self._tolerance[:, 0] *= size
        linear = super().piece(np.ones(len(self.active), dtype=bool))
        self._width = _FIRST * linear.width

    def piece(self, stick: np.ndarray) -> LinearFlow:
        """The next step with the contacts ``stick`` (n_active,) sticking; `expand` makes it."""
        return _Step(np.nan, np.array([]), np.array([]), stick)

    def expand(
        self, piece: LinearFlow, tau: float, x: FloatArray, slope: FloatArray, friction: FloatArray
    ) -> FloatArray:
        """Make the step; arguments and result as those of `LinearMotion.expand`."""
        assert isinstance(piece, _Step)
        n = self.n_dof
        start = np.column_stack([np.append(x, slope), np.eye(2 * n, 3 * n)])
        acceleration = self._acceleration(piece.stick, x, friction)

        def rates(tau: float, state: FloatArray) -> FloatArray:
            values, slopes = state.reshape(2, n, -1)
            return np.concatenate([slopes, acceleration(tau, values, slopes)], axis=None)

        with np.errstate(over="ignore", invalid="ignore"):
            solver = scipy.integrate.DOP853(
                rates,
                tau,
                start.ravel(),
                t_bound=np.inf,
                rtol=INTEGRATION_TOLERANCE,
                atol=self._tolerance.ravel(),  # type: ignore[arg-type]
                first_step=self._width,
            )
            solver.step()
            width = solver.step_size or 0.0
            if width < _SHORTEST:
                raise ArithmeticError("the motion grows without bound")
            along, angles = solver.dense_output(), tau + width * _NODES
            bent = [acceleration(t, *along(t).reshape(2, n, -1)) for t in angles]
        self._width = solver.h_abs
        powers = np.zeros((DEGREE + 1, n, start.shape[1]))
        powers[0], powers[1] = start[:n], width * start[n:]
        powers[_ORDER + 2] = width**2 * np.tensordot(_TO_POWERS, np.array(bent), 1)
        series = powers[:, :, 1:]
        full = np.concatenate([series.sum(axis=0), np.tensordot(_RATES, series, 1) / width])
        piece.__dict__.update(width=width, series=series, full=full)
        return powers[:, :, 0]

    def _acceleration(
        self, stick: np.ndarray, x: FloatArray, friction: FloatArray
    ) -> Callable[[float, FloatArray, FloatArray], FloatArray]:
        """Function of angle, values and slopes (n_dof, n_columns) from the start of a step on."""
        n = self.n_dof
        held = self.push[:, stick] * self.contact_stiffness[stick] @ self.directions[stick]
        elastic = self._elastic + held
        constant = self._static[:, 0] - self.push @ friction + held @ x
        constant = np.column_stack([constant, held, np.zeros((n, n)), np.eye(n)])

        def acceleration(tau: float, values: FloatArray, slopes: FloatArray) -> FloatArray:
            phase = self.orders * tau
            stretch = self._springs @ values
            cubes = stretch[:, :1] ** 2 * stretch * self._cube
            result = constant - elastic @ values - self._viscous @ slopes
            result -= self._spring_push @ cubes
            result[:, 0] += self._cosine @ np.cos(phase) + self._sine @ np.sin(phase)
            return result

        return acceleration


def shoot(balance: HarmonicBalance, unknowns: FloatArray, frequency: float) -> ExactMotion:
    """Find the periodic motion near a response (n_unknowns,) [m] to harmonic balance.

    ``frequency`` is angular [rad/s]. The motion repeats itself with the opposite sign after half a
    period where force and response do. A contact that never slips is centred between its limits.

    Raises ValueError for a mass matrix that is not positive definite.
    """
    frequency = check.scalar("frequency", frequency, "positive")
    coefficients = np.abs(balance.coefficients(unknowns))
    size = float(coefficients.sum(axis=1).max()) or 1.0
    pieces = IntegratedMotion(balance, frequency, size)
    even = coefficients[:, balance.basis.order % 2 == 0]
    pieces.antiperiodic &= bool(even.max(initial=0.0) <= _EVEN * coefficients.max())
    start = pieces.of_active(state_of(balance, unknowns))
    try:
        state, iterations, status = _periodic_state(pieces, start)
        motion = describe_motion(pieces, state, iterations, status)
    except ArithmeticError:
        bounded = LinearMotion(balance.with_parameters(cubic_stiffness=0.0), frequency)
        motion = describe_motion(bounded, np.zeros_like(start), 0, Status.GROWS)
        return replace(motion, periodicity=np.inf)
    if status == Status.SUCCESS and motion.status == Status.NO_MOTION:
        # What is asked of motions known to round-off is more than the integrator keeps.
        status = Status.SUCCESS if motion.periodicity <= PERIODIC else Status.NO_MOTION
        motion = replace(motion, status=status)
    return motion


@dataclass(frozen=True)
class _Trial:
    state: FloatArray
    residual: FloatArray
    matrix: FloatArray
    norm: float


def _periodic_state(pieces: IntegratedMotion, start: FloatArray) -> tuple[FloatArray, int, Status]:
    """State at ``tau = 0`` of the periodic motion, steps of Newton's method, and how it ended."""
    scale = energy_scale(pieces)
    farthest = _FARTHEST * np.linalg.norm(scale * start) or np.inf

    def attempt(state: FloatArray) -> _Trial:
        if np.linalg.norm(scale * state) > farthest:
            raise ArithmeticError("the motion is far from the start")
        return _shot(pieces, state, scale)

    now = attempt(start)
    for iteration in range(_ITERATIONS):
        near = now.norm <= PERIODIC * np.linalg.norm(scale * now.state)
        if now.norm == 0:
            return now.state, iteration, Status.SUCCESS
        matrix = now.matrix * (scale[:, None] / scale)
        step = np.linalg.lstsq(matrix, -scale * now.residual, rcond=_SMALLEST)[0] / scale
        for share in 0.5 ** np.arange(1 if near else 8):
            with contextlib.suppress(ArithmeticError):
                trial = attempt(now.state + share * step)
                if trial.norm <= (1 - (0.5 if near else 1e-4) * share) * now.norm:
                    now = trial
                    break
        else:
            return now.state, iteration, Status.SUCCESS if near else Status.NO_MOTION
    return now.state, _ITERATIONS, Status.NO_MOTION


def _shot(pieces: IntegratedMotion, state: FloatArray, scale: FloatArray) -> _Trial:
    """How far a period, or half of it, leads from the state, and the derivative of that."""
    length, sign = (np.pi, -1.0) if pieces.antiperiodic else (2 * np.pi, 1.0)
    n, state = 2 * pieces.n_dof, state.copy()
    state[n:] = np.clip(state[n:], -pieces.limit, pieces.limit)
    run = march(pieces, state, length)
    assert run.jacobian is not None
    residual, matrix = sign * run.end - state, sign * run.jacobian - np.eye(len(state))
    if not pieces.antiperiodic:
        for contact in np.flatnonzero(~run.slipped):
            middle = _middle(pieces, run, state, int(contact))
            residual[n + contact], matrix[n + contact] = middle
    if not np.all(np.isfinite(matrix)):
        raise ArithmeticError("the derivative of the motion is not finite")
    return _Trial(state, residual, matrix, float(np.linalg.norm(scale * residual)))


def _middle(
    pieces: IntegratedMotion, run: March, state: FloatArray, contact: int
) -> tuple[float, FloatArray]:
    """Mean of the largest and the smallest force of a contact that sticks, and its derivative.

    No condition of periodicity determines it: the static force of such a contact is free.
    """
    spring = pieces.contact_stiffness[contact] * pieces.directions[contact]
    force = run.cells.displacement @ spring
    force[:, 0] = run.cells.friction[:, contact]
    high, low = extremes(force[:, :, None])
    tau = 2 * np.pi * np.arange(1, _SAMPLES + 1) / _SAMPLES
    samples = run.cells.evaluate(pieces, tau)[2][:, contact]
    gradient = np.zeros(len(state))
    for place in (np.argmax(samples), np.argmin(samples)):
        part = march(pieces, state, tau[place]).jacobian
        assert part is not None
        gradient += part[2 * pieces.n_dof + contact] / 2
    return float((high + low)[0] / 2), gradient
