"""Motions with smooth contact laws, by steps of an integrator.

The integrator (DOP853) keeps a tolerance, while motions with friction alone are exact to round-off.
Its steps are polynomials too: `symhbm.time_domain.event_march` locates the events of friction
contacts on them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from symhbm.balance import HarmonicBalance
from symhbm.model.contacts import MemorylessLaw
from symhbm.numerics import FloatArray
from symhbm.time_domain.active_contacts import STICK
from symhbm.time_domain.linear_motion import DEGREE, LinearFlow, LinearMotion, curved

INTEGRATION_TOLERANCE = 1e-12
"""Tolerance of a step of the integrator, relative to the motion at its end and to its size."""
_FIRST = 0.3
"""First step of the integrator over a cell of the linear motion."""
_SHORTEST = 1e-7
"""Step of the integrator [rad] below which the motion grows without bound."""
_HIGHEST = 32
"""Harmonic up to which the power of smooth contacts is integrated exactly, beside the cells'."""

# Accelerations along a step, at the nodes of Gauss, become the higher powers of its polynomial:
# integrated twice they are more accurate than the integrator's own interpolation.
_NODES = (np.polynomial.legendre.leggauss(7)[0] + 1) / 2
_ORDER = np.arange(len(_NODES))
_TO_POWERS = np.linalg.inv(_NODES[:, None] ** _ORDER)
_TO_POWERS /= ((_ORDER + 1) * (_ORDER + 2))[:, None]


@dataclass(frozen=True)
class _Step(LinearFlow):
    """A step of the integrator: `IntegratedMotion.expand` fills all but ``state`` (n_active,)."""

    state: FloatArray


class IntegratedMotion(LinearMotion):
    """The motions of a problem with smooth laws at an angular ``frequency`` [rad/s], by steps.

    ``size`` [m] is that of the motion, for the tolerance. Raises ValueError for a mass matrix that
    is not positive definite.
    """

    def __init__(self, problem: HarmonicBalance, frequency: float, size: float):
        super().__init__(problem, frequency)
        model, self._smooth = problem.model, []
        directions = model.directions.toarray()
        inertia = frequency**2 * self.mass
        self._groups = curved(problem)
        for group in self._groups:
            values = model.values_of(group)
            rows = directions[group.rows.ravel()]
            self._smooth.append((group.law, values, rows, np.linalg.solve(inertia, rows.T)))
        # One column is the motion, the others its derivatives as `LinearFlow.series` orders them.
        n_columns = 1 + 3 * self.n_dof
        self._tolerance = np.full((2 * self.n_dof, n_columns), INTEGRATION_TOLERANCE)
        self._tolerance[:, 0] *= size
        if any(law.has_kinks for law, *_ in self._smooth):
            # Where slopes jump, derivatives need not be that exact, and the motion is.
            self._tolerance[:, 1:] = np.inf
        self.antiperiodic &= all(law.odd for law, *_ in self._smooth)
        flow = super().flow(np.full(len(self.active), STICK))
        self._width = _FIRST * flow.width

    def _check_contacts(self, problem: HarmonicBalance) -> None:
        """Raise ValueError for contacts that are neither smooth nor sliders."""
        laws = {repr(g.law) for g in curved(problem) if not isinstance(g.law, MemorylessLaw)}
        if laws:
            raise ValueError(
                f"problem: the motion in time is known of smooth laws and of sliders, not of "
                f"{', '.join(laws)}"
            )

    def loss(self, motion: Any) -> FloatArray:
        """Energy that smooth contacts dissipate along an `ExactMotion`, (n_contacts,) [J]."""
        result = np.zeros(self.n_contacts)
        tau, weight, (x, slope, _) = motion.quadrature(_HIGHEST)
        for group, (law, values, rows, _) in zip(self._groups, self._smooth, strict=True):
            if law.gives_back:
                continue
            moved, rate = (part @ rows.T for part in (x, slope))
            shape = len(tau) * group.n, len(law.directions)
            along = {name: np.tile(value, len(tau)) for name, value in values.items()}
            velocity = self.frequency * rate.reshape(shape)
            force = law.at_instants(moved.reshape(shape), velocity, self.frequency, along).force
            power = (force * rate.reshape(shape)).sum(axis=1).reshape(len(tau), group.n)
            result[group.contacts] = weight @ power
        return result

    def flow(self, state: FloatArray) -> LinearFlow:
        """The next step in a ``state`` (n_active,) of the contacts; `expand` makes it."""
        return _Step(np.nan, np.array([]), state.copy())

    def expand(
        self, flow: LinearFlow, tau: float, x: FloatArray, slope: FloatArray, constant: FloatArray
    ) -> FloatArray:
        """Make the step; arguments and result as those of `LinearMotion.expand`."""
        assert isinstance(flow, _Step)
        n = self.n_dof
        start = np.column_stack([np.append(x, slope), np.eye(2 * n, 3 * n)])
        acceleration = self._acceleration(flow.state, x, constant)

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
        flow.__dict__.update(width=width, series=powers[:, :, 1:])
        return powers[:, :, 0]

    def _acceleration(
        self, state: FloatArray, x: FloatArray, constant: FloatArray
    ) -> Callable[[float, FloatArray, FloatArray], FloatArray]:
        """Function of angle, values and slopes (n_dof, n_columns) from the start of a step on."""
        n = self.n_dof
        directions, springs = self.springs(state)
        springs = self.accelerations(directions) @ springs
        elastic = self._elastic + springs
        constant = np.column_stack([constant + springs @ x, springs, np.zeros((n, n)), np.eye(n)])

        def acceleration(tau: float, values: FloatArray, slopes: FloatArray) -> FloatArray:
            phase = self.orders * tau
            result = constant - elastic @ values - self._viscous @ slopes
            for law, of_contacts, rows, push in self._smooth:
                n, m = len(next(iter(of_contacts.values()))), len(law.directions)
                moved, velocity = (
                    (factor * rows @ part).reshape(n, m, -1)
                    for factor, part in ((1.0, values), (self.frequency, slopes))
                )
                at = moved[:, :, 0], velocity[:, :, 0], self.frequency, of_contacts
                found = law.at_instants(*at)
                moved = found.by_displacement @ moved + found.by_velocity @ velocity
                moved[:, :, 0] = found.force
                result -= push @ moved.reshape(n * m, -1)
            result[:, 0] += self._cosine @ np.cos(phase) + self._sine @ np.sin(phase)
            return result

        return acceleration
