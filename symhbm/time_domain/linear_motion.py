"""Linear motion between two events of the contacts.

While no contact changes its state the motion is linear: ``M x'' + C x' + K x`` with the springs of
the sticking contacts and of the closed ones, under harmonic and constant forces. The friction of a
contact that slips grows with its normal force: the stiffness need not be symmetric. The exponential
series is summed to round-off on short cells, which requires neither distinct eigenvalues nor a
regular dynamic stiffness: critical damping, bodies without springs and resonances are no
exceptions.
"""

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.numerics import FloatArray, by_harmonic
from symhbm.numerics.loops import Loop, polynomials
from symhbm.time_domain.active_contacts import ActiveContacts

DEGREE = 24
"""Degree of the polynomials of a cell."""
_REACH = 2.0
"""Norm of the generator times the length of a cell: the first term left out is 2^25/25! = 2e-18."""
_MOST = 2_000
"""Degrees of freedom whose series in one state of the contacts takes 2 GB."""
_KEPT_NUMBERS = 3e7
"""Most numbers in the series that are kept for the next march."""


@dataclass(frozen=True)
class LinearFlow:
    """Series of the motion in one state of the contacts.

    ``width`` is the length of a cell [rad]; ``series`` (DEGREE + 1, n_dof, 3 n_dof + n_waves) maps
    displacement, its derivative by ``tau``, constant acceleration and the waves of the force at
    the start of a cell to the powers of the share of the cell.
    """

    width: float
    series: FloatArray

    @cached_property
    def _full(self) -> FloatArray:
        return self._transition(1.0)

    def transition(self, share: float) -> FloatArray:
        """Map of displacement, its derivative and acceleration, (2 n_dof, 3 n_dof).

        From the start of the cell to displacement and derivative at a ``share`` of it.
        """
        return self._full if share == 1.0 else self._transition(share)

    def _transition(self, share: float) -> FloatArray:
        n = self.series.shape[1]
        k = np.arange(DEGREE + 1)
        powers = share**k
        rates = np.concatenate([[0.0], k[1:] * powers[:-1]]) / self.width
        flat = self.series[:, :, : 3 * n].reshape(DEGREE + 1, -1)
        return (np.array([powers, rates]) @ flat).reshape(2 * n, 3 * n)


class LinearMotion(ActiveContacts):
    """The linear motions of a problem at an angular ``frequency`` [rad/s], by contact state.

    Attributes beside those of `ActiveContacts`
    -------------------------------------------
    mass, damping, stiffness : (n_dof, n_dof)
        Dense matrices [kg, N s/m, N/m]; ``damping`` is less what sustains the motion.
    orders : (n_orders,), cosine, sine : (n_dof, n_orders)
        Harmonics of the force and their coefficients [N]; ``static`` (n_dof,) is its mean.

    Raises ValueError for other contacts and for a mass matrix that is not positive definite.
    """

    n_tangential = 1
    """Friction forces of a contact in a state."""

    def __init__(self, problem: HarmonicBalance, frequency: float):
        model = problem.model
        self._check_contacts(problem)
        if model.n_dof > _MOST:
            raise ValueError(
                f"problem: expected at most {_MOST:,} degrees of freedom for motions in time, "
                f"whose series take gigabytes, got {model.n_dof:,}; reduce the structure by "
                "symhbm.craig_bampton"
            )
        super().__init__(model, frequency)
        self.frequency, inertia = frequency, self.inertia
        self.mass, self.stiffness = inertia.mass, inertia.stiffness
        self._set_force(problem)
        self._elastic = inertia.by_stiffness / frequency**2
        forces = self.directions.T, self.normal.T, self.static[:, None], self.cosine, self.sine
        parts = map(self.accelerations, forces)
        self.push, self.push_normal, self._static, self._cosine, self._sine = parts
        self._set_damping(inertia.damping, inertia.viscous_rate)

    def accelerations(self, forces: FloatArray) -> FloatArray:
        """Accelerations, by ``tau`` twice, of forces (n_dof, n)."""
        return self.inertia.accelerations(forces) / self.frequency**2

    def sustained(self, damping_ratio: float) -> "LinearMotion":
        """The motions with the force ``2 D omega M x'``, which feeds them."""
        other = copy(self)
        damping = self.damping - 2 * damping_ratio * self.frequency * self.mass
        other._set_damping(damping, self.inertia.norm(damping))
        return other

    def _set_damping(self, damping: FloatArray, rate: float) -> None:
        self.damping = damping
        self._viscous = self.frequency * self.accelerations(damping)
        self._viscous_rate = rate
        self._flows: dict[bytes, LinearFlow] = {}

    def _check_contacts(self, problem: HarmonicBalance) -> None:
        """Raise ValueError for contacts whose motion between events is not linear."""
        laws = {repr(group.law) for group in problem.curved_groups + problem.planar_groups}
        if laws:
            raise ValueError(
                f"problem: expected contacts that are springs or sliders, got {', '.join(laws)}; "
                "the motion is linear between events with these alone"
            )

    def _set_force(self, problem: HarmonicBalance) -> None:
        basis, given = problem.basis, (problem.excitation, problem.basis, self.frequency)
        coefficients = problem.model.felt_coefficients(*given)
        force = by_harmonic(basis, coefficients)
        order = np.array(basis.harmonics)
        acts = force.any(axis=(0, 2)) & (order > 0)
        self.orders = order[acts]
        self.cosine, self.sine = np.moveaxis(force[:, acts], -1, 0).copy()
        self.static = force[:, order == 0, 0].sum(axis=1)
        self.largest_force = float(np.abs(force).max())
        odd = not (self.static.any() or self.moves)
        self.antiperiodic = bool(np.all(self.orders % 2 == 1)) and odd

    def _constant(self, x: FloatArray, friction: FloatArray, state: FloatArray) -> FloatArray:
        """Acceleration (n_dof,) by static and contact forces at a displacement."""
        normal = self.normal_force(x, state) - self.offset
        return self._static[:, 0] - self.push @ friction - self.push_normal @ normal

    def of_active(self, state: FloatArray) -> FloatArray:
        """A state (2 n_dof + n_tangential n_contacts,) with forces of active contacts alone."""
        forces = state[2 * self.n_dof :].reshape(self.n_tangential, self.n_contacts)
        return np.concatenate([state[: 2 * self.n_dof], forces[:, self.active].ravel()])

    def within_limits(self, state: FloatArray) -> FloatArray:
        """A state (2 n_dof + n_tangential n_active,), its friction forces within their limits."""
        n = self.n_dof
        forces, limit = state[2 * n :].reshape(self.n_tangential, -1), self.limits(state[:n])
        length = np.linalg.norm(forces, axis=0)
        outside = length > limit
        share = np.where(outside, limit / np.where(outside, length, 1.0), 1.0)
        return np.append(state[: 2 * n], forces * share)

    def flow(self, state: FloatArray) -> LinearFlow:
        """Series in a ``state`` (n_active,) of the contacts."""
        # With a constant load both directions of slip have the same stiffness.
        key = (state if self.moves else np.abs(state)).tobytes()
        if key not in self._flows:
            flow = self._build(state)
            if len(self._flows) * flow.series.size > _KEPT_NUMBERS:
                self._flows.clear()
            self._flows[key] = flow
        return self._flows[key]

    def _build(self, state: FloatArray) -> LinearFlow:
        n, n_orders = self.n_dof, len(self.orders)
        springs, rate = self.inertia.with_springs(self, state)
        rate = (rate + self._viscous_rate) / self.frequency
        width = _REACH / max(rate, float(self.orders.max(initial=1)))
        elastic = (self._elastic + springs / self.frequency**2) * width**2
        series = np.zeros((DEGREE + 1, n, 3 * n + 2 * n_orders))
        series[0, :, :n] = np.eye(n)
        series[1, :, n : 2 * n] = width * np.eye(n)
        # cos(n (t + s)) and sin(n (t + s)) as powers of s times the waves cos(n t), sin(n t).
        wave = np.concatenate([self._cosine, self._sine], axis=1) * width**2
        turned = np.concatenate([self._sine, -self._cosine], axis=1) * width**2
        slope = np.concatenate([self.orders, self.orders]) * width
        # The force of a sticking contact at the start is given; its spring acts on the travel.
        parts = elastic, self._elastic * width**2, self._viscous * width, wave, turned
        _write_series(*map(np.ascontiguousarray, parts), slope, width, series)
        return LinearFlow(width, series)

    def cell(
        self, tau: float, x: FloatArray, slope: FloatArray, friction: FloatArray, state: FloatArray
    ) -> tuple[LinearFlow, FloatArray]:
        """The motion from ``tau`` on, and powers of its share of the cell, (DEGREE + 1, n_dof) [m].

        ``x`` and ``slope`` (n_dof,) are displacement and its derivative by ``tau`` [m] there,
        ``friction`` [N] and ``state`` (n_active,) those of the contacts.
        """
        waves = np.cos(self.orders * tau), np.sin(self.orders * tau)
        constant, flow = self._constant(x, friction, state), self.flow(state)
        return flow, flow.series @ np.concatenate([x, slope, constant, *waves])


@Loop
def _write_series(elastic, at_start, viscous, wave, turned, slope, width: float, series) -> None:
    """Write the powers of `LinearFlow` from the first two on.

    ``elastic`` and ``viscous`` (n, n) are the accelerations by displacement and velocity,
    ``at_start`` those by the displacement at the start of the cell, ``wave`` and ``turned``
    (n, n_waves) those by the waves of the force and by their derivatives, whose orders times the
    width of the cell are ``slope`` (n_waves,).
    """
    n, columns = series.shape[1:]
    constant, n_waves = 2 * n, len(slope)
    factor = np.ones(n_waves)
    for k in range(len(series) - 2):
        by_velocity = viscous @ series[k + 1]
        by_displacement = (elastic if k else at_start) @ series[k]
        for i in range(n):
            for j in range(columns):
                right = -(k + 1) * by_velocity[i, j] - by_displacement[i, j]
                series[k + 2, i, j] = right / ((k + 1) * (k + 2))
            if k == 0:
                series[2, i, constant + i] += width * width / 2
            for j in range(n_waves):
                force = turned[i, j] if k % 2 else wave[i, j]
                force *= factor[j] / ((k + 1) * (k + 2))
                series[k + 2, i, 3 * n + j] += force if k % 4 < 2 else -force
        for j in range(n_waves):
            factor[j] *= slope[j] / (k + 1)


def alternates(powers: FloatArray) -> np.ndarray:
    """Whether polynomials (..., DEGREE + 1) may change their sign on [0, 1]."""
    values = powers @ polynomials.bernstein(DEGREE).T
    return (values.min(axis=-1) < 0) & (values.max(axis=-1) > 0)


def extremes(powers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Highest and lowest values of consecutive polynomials (n_cells, DEGREE + 1, n_functions)."""
    high = np.maximum(powers[:, 0].max(axis=0), powers[-1].sum(axis=0))
    low = np.minimum(powers[:, 0].min(axis=0), powers[-1].sum(axis=0))
    slopes = np.zeros_like(powers)
    slopes[:, :-1] = np.arange(1, DEGREE + 1)[:, None] * powers[:, 1:]
    for cell, function in zip(*np.nonzero(alternates(np.moveaxis(slopes, 1, 2))), strict=True):
        for share, _ in polynomials.crossings(slopes[cell, :, function]):
            value = np.polynomial.polynomial.polyval(share, powers[cell, :, function])
            high[function] = max(high[function], value)
            low[function] = min(low[function], value)
    return high, low
