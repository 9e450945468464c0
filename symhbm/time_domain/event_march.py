"""Event-driven integration of the motion with friction, with exact derivatives.

A sticking contact begins to slip when its force reaches ``+-g``, a slipping one sticks when its
relative velocity vanishes. Acceleration is a continuous function of displacement, velocity and
friction forces: a shift of an event in time changes none of their derivatives but one, that of the
force of a contact that begins to slip, which becomes constant.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyval

from symhbm.numerics import FloatArray
from symhbm.time_domain.linear_motion import BERNSTEIN, DEGREE, LinearMotion, alternates, crossings

_POWER = np.arange(DEGREE + 1)
_INSTANT = 1e-13
"""Distance of events [rad] below which they share one state."""
_SHORTEST = 1e-15
"""Shortest interval between events [rad]: the round-off of an angle."""
_OUTSIDE = 1e-9
"""Share of a cell over which a contact may exceed its limit by round-off alone."""
_REST = 1e-12
"""Share of the largest velocity below which the sign of a relative velocity is round-off."""
_EVENTS_PER_CONTACT = 2000
"""Events per contact above which contacts change their states without end."""


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
    slip : (n_cells, n_active)
        Direction of slip, 0 while the contact sticks.
    """

    start: FloatArray
    width: FloatArray
    displacement: FloatArray
    friction: FloatArray
    slip: np.ndarray

    def evaluate(
        self, linear: LinearMotion, tau: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Displacement, its derivative by ``tau`` and friction, (n, n_dof or n_active)."""
        cell = np.clip(np.searchsorted(self.start, tau, side="right") - 1, 0, None)
        return self.inside(linear, cell, (tau - self.start[cell]) / self.width[cell])

    def inside(
        self, linear: LinearMotion, cell: np.ndarray, share: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As `evaluate`, at shares (n,) of given cells (n,)."""
        powers = share[:, None] ** _POWER
        rates = np.zeros_like(powers)
        rates[:, 1:] = _POWER[1:] * powers[:, :-1] / self.width[cell, None]
        values = self.displacement[cell]
        slope = np.einsum("nk,nkd->nd", rates, values)
        travel = np.einsum("nk,nkd->nd", powers[:, 1:], values[:, 1:])
        spring = np.where(self.slip[cell] == 0, linear.contact_stiffness, 0.0)
        friction = self.friction[cell] + spring * (travel @ linear.directions.T)
        return values[:, 0] + travel, slope, friction

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
                zeros = [zero for zero, _ in crossings(powers)] if bent else []
                zeros = np.array([0.0, *zeros, 1.0])
                # Half-way between its zeros a velocity has a sign, unless it is round-off.
                samples.append(polyval((zeros[1:] + zeros[:-1]) / 2, powers))
            samples = np.concatenate(samples)
            positive = samples[np.abs(samples) > noise] > 0
            result[j] = np.count_nonzero(positive != np.roll(positive, 1))
        return result


@dataclass(frozen=True)
class March:
    """A motion over an interval: its cells, its events and its end.

    Attributes
    ----------
    cells
        The motion; ``slipped`` (n_active,) tells which contacts slipped in it.
    event_angle, event_contact, event_slip : (n_events,)
        Where [rad], which active contact, and its direction of slip (0: it sticks).
    end : (2 n_dof + n_active,)
        Displacement, derivative by ``tau`` and friction force at the end.
    jacobian : (2 n_dof + n_active, 2 n_dof + n_active)
        Exact derivative of the end by the start.
    """

    cells: Cells
    slipped: np.ndarray
    event_angle: FloatArray
    event_contact: np.ndarray
    event_slip: np.ndarray
    end: FloatArray
    jacobian: FloatArray

    def multipliers(self, linear: LinearMotion) -> np.ndarray:
        """Eigenvalues of the derivative, largest first, at given static forces.

        Static forces of contacts that never slip do not change: each has one more eigenvalue, 1.
        """
        n = linear.n_dof
        stuck = 2 * n + np.flatnonzero(~self.slipped)
        kept = np.concatenate([np.arange(2 * n), 2 * n + np.flatnonzero(self.slipped)])
        matrix = self.jacobian[np.ix_(kept, kept)]
        # The forces of stuck contacts follow the displacement through their springs alone.
        spring = (linear.contact_stiffness[:, None] * linear.directions)[~self.slipped]
        matrix[:, :n] += self.jacobian[np.ix_(kept, stuck)] @ spring
        values = np.linalg.eigvals(matrix)
        return values[np.argsort(-np.abs(values))]


def march(linear: LinearMotion, state: FloatArray, length: float) -> March:
    """March from ``tau = 0`` to ``length`` [rad].

    ``state`` (2 n_dof + n_active,) is displacement, its derivative by ``tau`` [m] and the friction
    forces [N], which are put between their limits. Raises ArithmeticError for a motion that is not
    finite, or where events follow each other without end.
    """
    n, limit, stiffness = linear.n_dof, linear.limit, linear.contact_stiffness
    x, slope = state[:n].copy(), state[n : 2 * n].copy()
    friction = np.clip(state[2 * n :], -limit, limit)
    outward = linear.directions @ slope
    slip = np.where((np.abs(friction) >= limit) & (friction * outward > 0), np.sign(outward), 0.0)
    variation = np.eye(len(state))
    variation[2 * n :][slip != 0] = 0.0
    ended_slip = np.zeros(len(limit))
    slipped = slip != 0
    tau, cells, events = 0.0, [], []
    while tau < length:
        stick = slip == 0
        flow = linear.flow(stick)
        powers = linear.expand(flow, tau, x, slope, friction)
        if not np.all(np.isfinite(powers)):
            raise ArithmeticError("the motion is not finite")
        share = min(1.0, (length - tau) / flow.width)
        powers *= share ** _POWER[:, None]
        at, changing = _first_event(linear, powers, friction, slip, ended_slip)
        width = share * at * flow.width
        if width > _SHORTEST:
            powers = powers * at ** _POWER[:, None]
            cells.append((tau, width, powers, friction.copy(), slip.copy()))
            variation = _carry(linear, flow.transition(share * at), stick, variation)
            x = powers.sum(axis=0)
            slope = _POWER @ powers / width
            travel = linear.directions @ powers[1:].sum(axis=0)
            friction = friction + np.where(stick, stiffness * travel, 0.0)
            tau = length if at == 1.0 and share < 1.0 else tau + width
            if width > _INSTANT:
                ended_slip = np.zeros(len(limit))
        if len(changing):
            begins = changing[stick[changing]]
            ended_slip[changing] = slip[changing]
            slip[changing] = 0.0
            slip[begins] = np.where(friction[begins] > 0, 1.0, -1.0)
            friction[begins] = slip[begins] * limit[begins]
            slipped[begins] = True
            variation[2 * n + begins] = 0.0
            events += [(tau, j, slip[j]) for j in changing]
            if len(events) > _EVENTS_PER_CONTACT * len(limit):
                raise ArithmeticError("the contacts change their states without end")
    angle, contact, direction = zip(*events, strict=True) if events else ([], [], [])
    return March(
        Cells(*map(np.array, zip(*cells, strict=True))),
        slipped,
        np.array(angle, dtype=float),
        np.array(contact, dtype=int),
        np.array(direction, dtype=int),
        np.concatenate([x, slope, friction]),
        variation,
    )


def _carry(
    linear: LinearMotion, transition: FloatArray, stick: np.ndarray, variation: FloatArray
) -> FloatArray:
    """Derivative by the initial state after one more cell."""
    n = linear.n_dof
    friction = variation[2 * n :].copy()
    moved = transition @ np.concatenate([variation[: 2 * n], -linear.push @ friction])
    travel = linear.directions[stick] @ (moved[:n] - variation[:n])
    friction[stick] += linear.contact_stiffness[stick, None] * travel
    return np.concatenate([moved, friction])


def _first_event(
    linear: LinearMotion,
    powers: FloatArray,
    friction: FloatArray,
    slip: FloatArray,
    ended_slip: FloatArray,
) -> tuple[float, np.ndarray]:
    """Share of the cell at the first event, 1 without one, and the contacts that have it."""
    count = len(slip)
    motion = powers @ linear.directions.T
    # Distances to the upper and the lower limit, or the velocity along the slip: all positive.
    margin = np.zeros((DEGREE + 1, 2, count))
    force = linear.contact_stiffness * motion
    force[0] = friction
    margin[:, 0], margin[:, 1] = -force, force
    margin[0] += linear.limit
    slides = slip != 0
    margin[:-1, 0, slides] = (_POWER[1:, None] * motion[1:])[:, slides] * slip[slides]
    margin[-1, 0, slides] = 0.0
    margin[:, 1, slides] = 0.0
    # A contact that sticks since this instant is on its limit, at zero velocity: a double zero.
    for j in np.flatnonzero((ended_slip != 0) & ~slides):
        side = 0 if ended_slip[j] > 0 else 1
        margin[:-2, side, j] = margin[2:, side, j]
        margin[-2:, side, j] = 0.0
    lowest = np.einsum("ik,kc->ic", BERNSTEIN, margin.reshape(DEGREE + 1, -1)).min(axis=0)
    lowest = lowest.reshape(2, count)
    lowest[1, slides] = 1.0
    first = np.full(count, np.inf)
    for side, j in zip(*np.nonzero(lowest <= 0), strict=True):
        first[j] = min(first[j], _first_exit(margin[:, side, j]))
    at = first.min(initial=np.inf)
    if at > 1:
        return 1.0, np.array([], dtype=int)
    return at, np.flatnonzero(first <= at + np.finfo(float).eps)


def _first_exit(margin: FloatArray) -> float:
    """First change of sign of a polynomial that is positive up to round-off, infinity if none."""
    values = BERNSTEIN @ margin
    values = values[values != 0]
    if not len(values):
        return np.inf
    if values[0] < 0 and next(crossings(margin), (1.0, False))[0] > _OUTSIDE:
        return 0.0
    return next((share for share, falls in crossings(margin) if falls), np.inf)
