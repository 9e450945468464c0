"""Motion beside planar friction, step by step: Gauss collocation of structure and slip together.

A contact with two tangential directions that slips has the force ``T = r (cos a, sin a)`` of the
limit ``r = mu N``, and ``r a' = k_t u' . (-sin a, cos a)``: the motion is not linear. On a step the
acceleration of the structure and ``a'`` are polynomials that fulfil their equations at the Gauss
nodes. With ``r`` on the left these are regular where a contact opens or closes. A contact with one
tangential direction has no motion across it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from symhbm.balance import HarmonicBalance
from symhbm.numerics import FloatArray
from symhbm.time_domain.active_contacts import APART, STICK
from symhbm.time_domain.cells import Cells
from symhbm.time_domain.integrated_motion import INTEGRATION_TOLERANCE, IntegratedMotion
from symhbm.time_domain.linear_motion import DEGREE, LinearMotion

_STAGES = 8
_NODES = (np.polynomial.legendre.leggauss(_STAGES)[0] + 1) / 2
_ORDER = np.arange(_STAGES)
TO_POWERS = np.linalg.inv(_NODES[:, None] ** _ORDER)
"""Values at the nodes to powers of the share of a step."""
ONCE, TWICE = ((TO_POWERS.T / part).T for part in (_ORDER + 1, (_ORDER + 1) * (_ORDER + 2)))
"""As `TO_POWERS` after one integration, and after two: the powers begin with 1, and with 2."""
_BEFORE = _NODES[:, None] ** (_ORDER + 1) @ ONCE
_BEFORE_TWICE = _NODES[:, None] ** (_ORDER + 2) @ TWICE
_LAST = np.linalg.inv(np.polynomial.legendre.legvander(2 * _NODES - 1, _STAGES - 1))[-4:]
"""Last coefficients of the Legendre series of values at the nodes."""
_LONGEST = 2.0
"""Longest step [rad] times the highest harmonic of the force."""
_SHORTEST = 1e-9
"""Step [rad] that is taken whatever its error: where slip comes from an opening contact."""
_ITERATIONS = 12
_QUADRATIC = 1e-7
"""Last step of Newton's method, relative to the motion, after which one more is exact."""


@dataclass
class Instant:
    """A motion at an angle, and its derivatives by the start of a march (..., n_start).

    ``x``, ``slope`` (n_dof,); ``force`` (m, 2), friction of the active contacts, ``state`` (m,) and
    ``direction`` (m,), that of the friction of contacts that slip [rad].
    """

    tau: float
    x: FloatArray
    slope: FloatArray
    force: FloatArray
    state: FloatArray
    direction: FloatArray
    by_start: Any


@dataclass(frozen=True)
class Step:
    """A step [rad]: accelerations (s, n_dof) and turns (s, m_slipping) at its nodes.

    ``factors`` are those of the derivative of its equations, whose ``slopes`` are by ``x``, and by
    slopes and directions.
    """

    width: float
    acceleration: FloatArray
    turn: FloatArray
    factors: Any
    slopes: tuple[FloatArray, FloatArray]
    error: float


class PlanarMotion(IntegratedMotion):
    """The motions of a problem with planar friction at an angular ``frequency`` [rad/s].

    States are (2 n_dof + 2 n_active,): after the friction forces come those across. ``size`` [m] is
    that of the motion, for the tolerance. Raises as `IntegratedMotion`.
    """

    n_tangential = 2

    def __init__(self, problem: HarmonicBalance, frequency: float, size: float):
        super().__init__(problem, frequency, size)
        self.size = size
        self.pairs = np.stack([self.directions, self.across], axis=1)
        self._pushes = np.stack([self.push, self.accelerations(self.across.T)], axis=2)
        reach = np.abs(self.loads) + np.linalg.norm(self.pressing, axis=1) * size
        spring = np.where(self.rubs, self.contact_stiffness, 1.0)
        self._force_scale = np.minimum(spring * size, self.friction * reach)
        self._force_scale[self._force_scale == 0] = 1.0

    def step(self, at: Instant, longest: float) -> Step:
        """The longest step [rad] up to one given that keeps the tolerance."""
        width = min(longest, self._width, _LONGEST / max(1.0, self.orders.max(initial=1)))
        while True:
            found = self._solved(at, width)
            if found is not None and (found.error <= 1 or width <= _SHORTEST):
                break
            width *= 0.3 if found is None else max(0.3, 0.8 * found.error ** (-1 / _STAGES))
            if width < 1e-3 * _SHORTEST:
                raise ArithmeticError("the motion grows without bound")
        growth = 0.8 * max(found.error, 1e-30) ** (-1 / _STAGES)
        if width < longest or growth < 1:
            self._width = width * min(max(growth, 0.7), 3.0)
        return found

    def _solved(self, at: Instant, width: float) -> Step | None:
        """A step by Newton's method, None where that fails."""
        slips = np.flatnonzero(np.abs(at.state) == 1)
        acceleration, turn = np.zeros((_STAGES, self.n_dof)), np.zeros((_STAGES, len(slips)))
        scale = self._force_scale[slips]
        settled = False
        for _ in range(_ITERATIONS):
            residual, matrix, slopes, radius = self._equations(at, width, acceleration, turn, slips)
            if not np.all(np.isfinite(residual)):
                return None
            factors = scipy.linalg.lu_factor(matrix, check_finite=False)
            change = scipy.linalg.lu_solve(factors, -residual.ravel(), check_finite=False)
            change = change.reshape(residual.shape)
            acceleration = acceleration + change[:, : self.n_dof]
            turn = turn + change[:, self.n_dof :]
            moved = width**2 * np.abs(change[:, : self.n_dof]).max() / self.size
            turned = (width * np.abs(change[:, self.n_dof :]) * radius / scale).max(initial=0.0)
            if settled:
                break
            settled = max(moved, turned) < _QUADRATIC
        else:
            return None
        # What the first terms left out do after one integration more, or two.
        left = width**2 * _left_out(acceleration) / (8 * _STAGES * self.size)
        turned = width * _left_out(turn * radius.max(axis=0) / scale) / (4 * _STAGES)
        error = max(left, turned) / INTEGRATION_TOLERANCE
        return Step(width, acceleration, turn, factors, slopes, error)

    def _equations(
        self,
        at: Instant,
        width: float,
        acceleration: FloatArray,
        turn: FloatArray,
        slips: np.ndarray,
    ) -> tuple[FloatArray, FloatArray, tuple[FloatArray, FloatArray], FloatArray]:
        """Residual (s, n_dof + m_slipping) of a step, its derivative, slopes, and ``r``."""
        n, m = self.n_dof, len(slips)
        tau = at.tau + width * _NODES
        slope = at.slope + width * _BEFORE @ acceleration
        x = at.x + width * np.outer(_NODES, at.slope) + width**2 * _BEFORE_TWICE @ acceleration
        direction = at.direction[slips] + width * _BEFORE @ turn
        cosine, sine = np.cos(direction), np.sin(direction)
        along, beside = np.stack([cosine, sine], 2), np.stack([-sine, cosine], 2)
        stick, closed = at.state == STICK, at.state != APART
        pressure = self.pressure(x)
        radius = self.friction[slips] * pressure[:, slips]
        limit_slope = self.friction[slips, None] * self.pressing[slips]
        spring = self.contact_stiffness * stick
        force = np.zeros((_STAGES, len(stick), 2))
        force[:, stick] = at.force[stick]
        force += spring[:, None] * np.einsum("mdn,sn->smd", self.pairs, x - at.x)
        force[:, slips] = radius[:, :, None] * along
        normal = self.normal_force(x, at.state) - self.offset
        phase = tau[:, None] * self.orders
        found = self._static[:, 0] + np.cos(phase) @ self._cosine.T + np.sin(phase) @ self._sine.T
        found -= x @ self._elastic.T + slope @ self._viscous.T + normal @ self.push_normal.T
        found -= np.einsum("nmd,smd->sn", self._pushes, force)

        by_x, by_rate = np.zeros((_STAGES, n + m, n)), np.zeros((_STAGES, n + m, n + m))
        held = np.einsum("nmd,m,mde->ne", self._pushes, spring, self.pairs)
        held += self._elastic + (self.push_normal * closed) @ self.pressing
        pushes = np.einsum("nmd,smd->snm", self._pushes[:, slips], along)
        by_x[:, :n] = held + pushes @ limit_slope
        by_rate[:, :n, :n] = self._viscous
        turned = np.einsum("nmd,smd->snm", self._pushes[:, slips], beside)
        by_rate[:, :n, n:] = turned * radius[:, None]
        rate, scale = np.einsum("mdn,sn->smd", self.pairs[slips], slope), self._force_scale[slips]
        stiffness = self.contact_stiffness[slips] / scale
        by_x[:, n:] = turn[:, :, None] * limit_slope / scale[:, None]
        across = np.einsum("smd,mdn->smn", beside, self.pairs[slips])
        by_rate[:, n:, :n] = -stiffness[:, None] * across
        ahead = stiffness * (rate * along).sum(axis=2)
        by_rate[:, np.arange(n, n + m), np.arange(n, n + m)] = ahead
        taken, by_displacement, by_slope = self._smooth.at(x, slope)
        found -= taken
        by_x[:, :n] += by_displacement
        by_rate[:, :n, :n] += by_slope

        residual = np.empty((_STAGES, n + m))
        residual[:, :n] = acceleration - found
        residual[:, n:] = radius * turn / scale - stiffness * (rate * beside).sum(axis=2)
        matrix = np.einsum("ij,iab->iajb", width * _BEFORE, by_rate)
        matrix[..., :n] += np.einsum("ij,iab->iajb", width**2 * _BEFORE_TWICE, by_x)
        node, unknown, turns = np.arange(_STAGES)[:, None], np.arange(n), np.arange(n, n + m)
        matrix[node, unknown, node, unknown] += 1.0
        matrix[node, turns, node, turns] += radius / scale
        return residual, matrix.reshape(residual.size, -1), (by_x, by_rate), radius

    def polynomials(self, at: Instant, step: Step) -> tuple[FloatArray, FloatArray]:
        """Displacement (DEGREE + 1, n_dof) and directions (DEGREE + 1, m) along a step."""
        powers = np.zeros((DEGREE + 1, self.n_dof))
        directions = np.zeros((DEGREE + 1, len(at.state)))
        powers[0], powers[1] = at.x, step.width * at.slope
        powers[2 : _STAGES + 2] = step.width**2 * TWICE @ step.acceleration
        slips = np.abs(at.state) == 1
        directions[0] = at.direction
        directions[1 : _STAGES + 1, slips] = step.width * ONCE @ step.turn
        return powers, directions

    def speeds(self, at: Instant, step: Step) -> FloatArray:
        """Powers (DEGREE + 1, m_slipping) of the speeds of sliders that slip, times ``k_t``."""
        slips = np.flatnonzero(np.abs(at.state) == 1)
        slope = at.slope + step.width * _BEFORE @ step.acceleration
        direction = at.direction[slips] + step.width * _BEFORE @ step.turn
        rate = np.einsum("mdn,sn->smd", self.pairs[slips], slope)
        ahead = np.cos(direction) * rate[:, :, 0] + np.sin(direction) * rate[:, :, 1]
        wall = self.friction[slips] * (slope @ self.pressing[slips].T)
        powers = np.zeros((DEGREE + 1, len(slips)))
        powers[:_STAGES] = TO_POWERS @ (self.contact_stiffness[slips] * ahead - wall)
        return powers

    def follow(self, at: Instant, step: Step, share: float, closes: np.ndarray) -> Instant:
        """The motion after a share of a step; ``closes`` (m,) tells what closed at its start."""
        n, slips = self.n_dof, np.flatnonzero(np.abs(at.state) == 1)
        by_x, by_slope, by_force, by_direction = at.by_start
        by_direction = by_direction.copy()
        for k, j in enumerate(slips.tolist()):
            if closes[j]:
                # Of all directions at r = 0 this one alone belongs to a bounded turn.
                c, s, spring = np.cos(at.direction[j]), np.sin(at.direction[j]), self.pairs[j]
                ahead = self.contact_stiffness[j] * (c * spring[0] + s * spring[1]) @ at.slope
                turn = TO_POWERS[0] @ step.turn[:, k]
                across = self.contact_stiffness[j] * (c * spring[1] - s * spring[0]) @ by_slope
                wall = self.friction[j] * turn * self.pressing[j] @ by_x
                by_direction[j] = (across - wall) / ahead
        moved = by_x + step.width * _NODES[:, None, None] * by_slope
        slopes = np.concatenate([by_slope, by_direction[slips]])
        right = step.slopes[0] @ moved + step.slopes[1] @ slopes
        stick = at.state == STICK
        spring = (self.contact_stiffness * stick)[:, None, None]
        anchored = np.where(stick[:, None, None], by_force, 0.0) - spring * (self.pairs @ by_x)
        right[:, :n] += np.einsum("nmd,mdk->nk", self._pushes, anchored)
        right = right.reshape(-1, right.shape[2])
        change = scipy.linalg.lu_solve(step.factors, -right).reshape(_STAGES, -1, right.shape[1])
        once = share ** (_ORDER + 1) @ ONCE * step.width
        twice = share ** (_ORDER + 2) @ TWICE * step.width**2
        width = share * step.width
        x = at.x + width * at.slope + twice @ step.acceleration
        after = Instant(
            at.tau + width,
            x,
            at.slope + once @ step.acceleration,
            at.force.copy(),
            at.state.copy(),
            at.direction.copy(),
            (
                by_x + width * by_slope + np.tensordot(twice, change[:, :n], 1),
                by_slope + np.tensordot(once, change[:, :n], 1),
                by_force.copy(),
                by_direction,
            ),
        )
        after.direction[slips] += once @ step.turn
        by_direction[slips] += np.tensordot(once, change[:, n:], 1)
        after.force += spring[:, :, 0] * (self.pairs @ (x - at.x))
        after.by_start[2][:] += spring * (self.pairs @ (after.by_start[0] - by_x))
        self.on_walls(after, slips)
        return after

    def on_walls(self, at: Instant, contacts: np.ndarray) -> None:
        """Put the friction of contacts that slip on its limit, with its derivatives."""
        by_x, _, by_force, by_direction = at.by_start
        radius = self.limits(at.x)[contacts, None]
        direction = at.direction[contacts]
        along = np.stack([np.cos(direction), np.sin(direction)], 1)
        beside = np.stack([-along[:, 1], along[:, 0]], 1)
        at.force[contacts] = radius * along
        by_radius = self.friction[contacts, None] * (self.pressing[contacts] @ by_x)
        by_force[contacts] = along[:, :, None] * by_radius[:, None]
        by_force[contacts] += (radius * beside)[:, :, None] * by_direction[contacts, None]


def _left_out(values: FloatArray) -> float:
    """Size of the terms that follow those of series by values (s, n) at nodes, at their decay."""
    before, last = np.abs(_LAST @ values).reshape(2, -1).max(axis=1, initial=0.0)
    return float(last * min(1.0, last / before)) if before > 0 else float(last)


@dataclass(frozen=True)
class PlanarCells(Cells):
    """Cells whose friction has a direction, (n_cells, DEGREE + 1, n_active) [rad].

    ``friction`` (n_cells, n_active, 2) is that at the start of a cell [N].
    """

    direction: FloatArray

    def inside(
        self, linear: LinearMotion, cell: np.ndarray, share: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As `Cells.inside`; friction (n, 2 n_active), that across last."""
        assert isinstance(linear, PlanarMotion)
        travel, slope = self.travel(cell, share)
        x, state = self.displacement[cell, 0] + travel, self.state[cell]
        angle = np.einsum(
            "nk,nkm->nm", share[:, None] ** np.arange(DEGREE + 1), self.direction[cell]
        )
        wall = np.stack([np.cos(angle), np.sin(angle)], 2) * linear.limits(x)[:, :, None]
        moved = np.einsum("mde,ne->nmd", linear.pairs, travel)
        spring = self.friction[cell] + linear.contact_stiffness[:, None] * moved
        stick, apart = (state == which for which in (STICK, APART))
        force = np.where(stick[:, :, None], spring, np.where(apart[:, :, None], 0.0, wall))
        return x, slope, force.transpose(0, 2, 1).reshape(len(cell), -1)

    def friction_loss(self, linear: LinearMotion) -> FloatArray:
        """What contacts dissipate (n_active,) [J]: the work of their friction over the period."""
        assert isinstance(linear, PlanarMotion)
        _, weight, (_, slope, force) = self.quadrature(linear, 0)
        rate = np.einsum("mde,ne->ndm", linear.pairs, slope).reshape(len(weight), -1)
        return (weight @ (force * rate)).reshape(2, -1).sum(axis=0)
