"""A motion in time as polynomials on cells, within which no contact changes its state."""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyval

from symhbm.numerics import FloatArray
from symhbm.numerics.loops import polynomials
from symhbm.time_domain.active_contacts import APART, STICK, slip
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
        state = self.state[cell]
        spring = np.where(state == STICK, linear.contact_stiffness, 0.0)
        friction = self.friction[cell] + spring * (travel @ linear.directions.T)
        friction += slip(state) * linear.friction * (travel @ linear.pressing.T)
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
        moved = self.displacement @ linear.directions.T
        friction = (slip(self.state) * linear.friction)[:, None] * self.pressure(linear)
        # Work along the displacement of the contact, less what its spring stores.
        work = np.einsum("cin,ij,cjn->cn", friction, _PRODUCTS, moved, optimize=True)
        stored = (friction.sum(axis=1) ** 2 - friction[:, 0] ** 2) / 2
        spring = np.where(linear.rubs, linear.contact_stiffness, 1.0)
        return (work - stored / spring).sum(axis=0)

    def pressure(self, linear: LinearMotion) -> FloatArray:
        """Normal forces as powers of the share of a cell, (n_cells, DEGREE + 1, n_active) [N].

        They are 1 of constant loads.
        """
        powers = self.displacement @ linear.pressing.T
        powers[:, 0] += linear.loads
        return np.where((self.state == APART)[:, None], 0.0, powers)

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
