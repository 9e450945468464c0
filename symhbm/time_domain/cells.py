"""A motion in time as polynomials on cells, within which no contact changes its state."""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyval

from symhbm.numerics import FloatArray
from symhbm.numerics.loops import polynomials
from symhbm.time_domain.active_contacts import STICK
from symhbm.time_domain.linear_motion import DEGREE, LinearMotion, alternates

_POWER = np.arange(DEGREE + 1)
_PRODUCTS = _POWER / np.maximum(_POWER[:, None] + _POWER, 1)
"""Integrals over a cell of a power times the derivative of another."""
_REST = 1e-12
"""Share of the largest velocity below which the sign of a relative velocity is round-off."""


@dataclass(frozen=True)
class Cells:
    """A motion as polynomials on consecutive cells; no contact changes its state within one.

    Attributes
    ----------
    start, width : (n_cells,)
        In rad.
    displacement : (n_cells, DEGREE + 1, n_dof)
        Powers of the share of the cell [m].
    friction : (n_cells, n_active)
        Forces at the start of the cell [N].
    state : (n_cells, n_active)
        Direction of slip, `STICK` or `APART`.
    """

    start: FloatArray
    width: FloatArray
    displacement: FloatArray
    friction: FloatArray
    state: FloatArray

    def evaluate(
        self, linear: LinearMotion, tau: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Displacement, its derivative by ``tau`` and friction, (n, n_dof or n_active)."""
        cell = self.cell(tau)
        return self.inside(linear, cell, (tau - self.start[cell]) / self.width[cell])

    def cell(self, tau: FloatArray) -> np.ndarray:
        """The cells of angles (n,)."""
        return np.clip(np.searchsorted(self.start, tau, side="right") - 1, 0, None)

    def inside(
        self, linear: LinearMotion, cell: np.ndarray, share: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As `evaluate`, at shares (n,) of given cells (n,)."""
        travel, slope = self.travel(cell, share)
        state, normal = self.state[cell], linear.normal
        spring = np.where(state == STICK, linear.contact_stiffness, 0.0)
        friction = self.friction[cell] + spring * (travel @ linear.directions.T)
        if len(normal):
            moved = normal.stiffness * (travel @ normal.directions.T)
            friction[:, normal.contact] += normal.along_wall(state) * moved
        return self.displacement[cell, 0] + travel, slope, friction

    def travel(self, cell: np.ndarray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement since the start of cells and its derivative by ``tau``, (n, n_dof)."""
        powers = share[:, None] ** _POWER
        rates = np.zeros_like(powers)
        rates[:, 1:] = _POWER[1:] * powers[:, :-1] / self.width[cell, None]
        values = self.displacement[cell]
        slope = np.einsum("nk,nkd->nd", rates, values)
        return np.einsum("nk,nkd->nd", powers[:, 1:], values[:, 1:]), slope

    def friction_loss(self, linear: LinearMotion) -> FloatArray:
        """What contacts dissipate by friction, (n_active,) [J]."""
        travel = self.displacement[:, 1:].sum(axis=1) @ linear.directions.T
        result = np.where(np.abs(self.state) == 1, self.friction * travel, 0.0).sum(axis=0)
        result[linear.normal.contact] += self._pressed_loss(linear)
        return result

    def _pressed_loss(self, linear: LinearMotion) -> FloatArray:
        """What (n_normal,) [J] contacts dissipate beyond the friction at the start of each slip."""
        normal, state = linear.normal, self.state
        contact, share = normal.contact, normal.along_wall(state)
        moved = self.displacement @ linear.directions[contact].T
        friction = share[:, None] * self.pressure(linear)
        # Work along the displacement of the contact, less what its spring stores.
        work = np.einsum("cin,ij,cjn->cn", friction[:, 1:], _PRODUCTS[1:], moved)
        ends = friction[:, 0], friction.sum(axis=1)
        spring = np.where(linear.rubs, linear.contact_stiffness, 1.0)[contact]
        return (work - (ends[1] ** 2 - ends[0] ** 2) / (2 * spring)).sum(axis=0)

    def pressure(self, linear: LinearMotion) -> FloatArray:
        """Normal forces as powers of the share of a cell, (n_cells, DEGREE + 1, n_normal) [N]."""
        normal = linear.normal
        powers = normal.stiffness * (self.displacement @ normal.directions.T)
        powers[:, 0] += normal.load
        return np.where(normal.closed(self.state)[:, None], powers, 0.0)

    def quadrature(self, linear: LinearMotion, highest: int):
        """Gauss quadrature over all cells, exact to round-off up to the harmonic ``highest``.

        Angles (n,), weights (n,), and the motion there as `evaluate` gives it.
        """
        # Products of two motions have twice the degree; a wave over a cell has its phase more.
        count = DEGREE + 2 + int(np.ceil(highest * self.width.max()))
        nodes, weights = np.polynomial.legendre.leggauss(count)
        cell = np.repeat(np.arange(len(self.width)), count)
        share = np.tile((nodes + 1) / 2, len(self.width))
        tau = self.start[cell] + share * self.width[cell]
        weight = np.outer(self.width, weights / 2).ravel()
        return tau, weight, self.inside(linear, cell, share)

    def work(self, linear: LinearMotion) -> tuple[float, float]:
        """Done by the force and dissipated by the damping matrix [J]."""
        highest = int(linear.orders.max(initial=0))
        tau, weight, (_, slope, _) = self.quadrature(linear, highest)
        phase = tau[:, None] * linear.orders
        force = np.cos(phase) @ linear.cosine.T + np.sin(phase) @ linear.sine.T + linear.static
        viscous = linear.frequency * slope @ linear.damping.T
        done, lost = (weight @ (part * slope).sum(axis=1) for part in (force, viscous))
        return float(done), float(lost)

    def reversals(self, linear: LinearMotion) -> np.ndarray:
        """Changes of sign of all relative velocities over the period, (n_contacts,)."""
        rates = np.zeros_like(self.displacement)
        rates[:, :-1] = _POWER[1:, None] * self.displacement[:, 1:] / self.width[:, None, None]
        noise = _REST * np.abs(rates[:, 0]).max()
        rates = rates @ linear.all_directions.T
        result = np.zeros(linear.n_contacts, dtype=int)
        for j in range(linear.n_contacts):
            samples = []
            bends = alternates(rates[:, :, j])
            for powers, bent in zip(rates[:, :, j], bends, strict=True):
                zeros = [zero for zero, _ in polynomials.crossings(powers)] if bent else []
                zeros = np.array([0.0, *zeros, 1.0])
                # Half-way between its zeros a velocity has a sign, unless it is round-off.
                samples.append(polyval((zeros[1:] + zeros[:-1]) / 2, powers))
            samples = np.concatenate(samples)
            positive = samples[np.abs(samples) > noise] > 0
            result[j] = np.count_nonzero(positive != np.roll(positive, 1))
        return result
