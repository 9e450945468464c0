"""Motions with smooth contact laws, by steps of an integrator.

The integrator (DOP853) keeps a tolerance, while motions with friction alone are exact to round-off.
Its steps are polynomials too: `symhbm.time_domain.event_march` locates the events of friction
contacts on them.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import scipy

from symhbm.balance import HarmonicBalance
from symhbm.model.contacts import MemorylessLaw
from symhbm.numerics import FloatArray
from symhbm.time_domain.active_contacts import STICK
from symhbm.time_domain.linear_motion import DEGREE, LinearFlow, LinearMotion

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


class SmoothForces:
    """The forces of laws without memory of a problem at an angular ``frequency`` [rad/s].

    ``accelerations`` makes accelerations by the angle of forces. Raises ArithmeticError for laws
    that are neither smooth nor sliders.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        frequency: float,
        accelerations: Callable[[FloatArray], FloatArray],
    ):
        self.groups, self._frequency, self._parts = problem.curved_groups, frequency, []
        directions = problem.model.directions.toarray()
        for group in self.groups:
            if not isinstance(group.law, MemorylessLaw):
                raise ArithmeticError(f"perturbations of {group.law!r} are not known in time")
            rows = directions[group.rows.ravel()]
            values = group.values
            self._parts.append((group, values, rows, accelerations(rows.T)))

    def at(self, x: FloatArray, slope: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Accelerations (n, n_dof) that they take away, and derivatives (n, n_dof, n_dof).

        At displacements and slopes by the angle (n, n_dof), by which the derivatives are.
        """
        n, size = x.shape
        result = np.zeros((n, size)), np.zeros((n, size, size)), np.zeros((n, size, size))
        for _, rows, push, _, found in self.instants(x, slope):
            result[0][:] += found.force.reshape(n, -1) @ push.T
            slopes = found.by_displacement, self._frequency * found.by_velocity
            for total, each in zip(result[1:], slopes, strict=True):
                m = each.shape[2]
                moved = each.reshape(n, -1, m, m) @ rows.reshape(-1, m, size)
                total += push @ moved.reshape(n, len(rows), size)
        return result

    def instants(
        self, x: FloatArray, slope: FloatArray
    ) -> Iterator[tuple[Any, FloatArray, FloatArray, FloatArray, Any]]:
        """Groups, their directions and pushes, slopes (n n_contacts, m) of contacts, and forces."""
        for group, values, rows, push in self._parts:
            shape = len(x) * group.n, -1
            moved, rate = ((part @ rows.T).reshape(shape) for part in (x, slope))
            each = {name: np.tile(value, len(x)) for name, value in values.items()}
            velocity = self._frequency * rate
            found = group.law.at_instants(moved, velocity, self._frequency, each)
            yield group, rows, push, rate, found


class IntegratedMotion(LinearMotion):
    """The motions of a problem with smooth laws at an angular ``frequency`` [rad/s], by steps.

    ``size`` [m] is that of the motion, for the tolerance. Raises ValueError for a mass matrix that
    is not positive definite.
    """

    def __init__(self, problem: HarmonicBalance, frequency: float, size: float):
        super().__init__(problem, frequency)
        self._smooth = SmoothForces(problem, frequency, self.accelerations)
        laws: list[Any] = [group.law for group in self._smooth.groups]
        # One column is the motion, the others its derivatives as `LinearFlow.series` orders them.
        n_columns = 1 + 3 * self.n_dof
        self._tolerance = np.full((2 * self.n_dof, n_columns), INTEGRATION_TOLERANCE)
        self._tolerance[:, 0] *= size
        if any(law.has_kinks for law in laws):
            # Where slopes jump, derivatives need not be that exact, and the motion is.
            self._tolerance[:, 1:] = np.inf
        self.antiperiodic &= all(law.odd for law in laws)
        flow = self.flow(np.full(len(self.active), STICK))
        self._width = _FIRST * flow.width

    def _check_contacts(self, problem: HarmonicBalance) -> None:
        """Raise ValueError for contacts that are neither smooth nor sliders."""
        laws = {repr(g.law) for g in problem.curved_groups if not isinstance(g.law, MemorylessLaw)}
        if laws:
            raise ValueError(
                f"problem: the motion in time is known of smooth laws and of sliders, not of "
                f"{', '.join(laws)}"
            )

    def loss(self, motion: Any) -> FloatArray:
        """Energy that smooth contacts dissipate along an `ExactMotion`, (n_contacts,) [J]."""
        result = np.zeros(self.n_contacts)
        _, weight, (x, slope, _) = motion.quadrature(_HIGHEST)
        for group, _, _, rate, found in self._smooth.instants(x, slope):
            if not group.law.gives_back:
                power = (found.force * rate).sum(axis=1).reshape(len(x), group.n)
                result[group.contacts] = weight @ power
        return result

    def cell(
        self, tau: float, x: FloatArray, slope: FloatArray, friction: FloatArray, state: FloatArray
    ) -> tuple[LinearFlow, FloatArray]:
        """A step of the integrator; arguments and results as those of `LinearMotion.cell`."""
        n = self.n_dof
        start = np.column_stack([np.append(x, slope), np.eye(2 * n, 3 * n)])
        acceleration = self._acceleration(state, x, self._constant(x, friction, state))

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
        return LinearFlow(width, powers[:, :, 1:]), np.ascontiguousarray(powers[:, :, 0])

    def _acceleration(
        self, state: FloatArray, x: FloatArray, constant: FloatArray
    ) -> Callable[[float, FloatArray, FloatArray], FloatArray]:
        """Function of angle, values and slopes (n_dof, n_columns) from the start of a step on."""
        n = self.n_dof
        springs = self.accelerations(self.springs(state))
        elastic = self._elastic + springs
        constant = np.column_stack([constant + springs @ x, springs, np.zeros((n, n)), np.eye(n)])

        def acceleration(tau: float, values: FloatArray, slopes: FloatArray) -> FloatArray:
            phase = self.orders * tau
            taken, by_value, by_slope = (
                part[0] for part in self._smooth.at(values[None, :, 0], slopes[None, :, 0])
            )
            result = constant - elastic @ values - self._viscous @ slopes
            result[:, 1:] -= by_value @ values[:, 1:] + by_slope @ slopes[:, 1:]
            result[:, 0] += self._cosine @ np.cos(phase) + self._sine @ np.sin(phase) - taken
            return result

        return acceleration
