"""March the contacts over a stretch of the motion, from event to event, with exact derivatives.

A sticking contact begins to slip when its force reaches ``+-g``, a slipping one sticks when its
relative velocity vanishes. Acceleration is a continuous function of displacement, velocity and
friction forces, so an event that moves in time changes none of their derivatives but one: the
force of a contact that begins to slip becomes a constant.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyval

from symhbm.numerics import FloatArray
from symhbm.time_domain.linear_motion import BERNSTEIN, DEGREE, LinearMotion, alternates, crossings

_POWER = np.arange(DEGREE + 1)
_INSTANT = 1e-13
"""Events closer than this [rad] see the state that one of them left."""
_SHORTEST = 1e-15
"""Stretches below this [rad] are no motion: angles themselves are not known better."""
_OUTSIDE = 1e-9
"""Share of a cell a contact may seem beyond its limit by round-off alone."""
_REST = 1e-12
"""Share of the largest velocity below which a relative one has no sign but that of round-off."""
_EVENTS_PER_CONTACT = 2000


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
        Forces at its start [N].
    slip : (n_cells, n_active)
        Direction of slip, 0 while the contact sticks.
    """

    start: FloatArray
    width: FloatArray
    displacement: FloatArray
    friction: FloatArray
    slip: np.ndarray

    def evaluate(
        self, pieces: LinearMotion, tau: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Displacement, its derivative by ``tau`` and friction, (n, n_dof or n_active)."""
        cell = np.clip(np.searchsorted(self.start, tau, side="right") - 1, 0, None)
        return self.inside(pieces, cell, (tau - self.start[cell]) / self.width[cell])

    def inside(
        self, pieces: LinearMotion, cell: np.ndarray, share: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As `evaluate`, at shares (n,) of given cells (n,)."""
        powers = share[:, None] ** _POWER
        rates = np.zeros_like(powers)
        rates[:, 1:] = _POWER[1:] * powers[:, :-1] / self.width[cell, None]
        values = self.displacement[cell]
        slope = np.einsum("nk,nkd->nd", rates, values)
        travel = np.einsum("nk,nkd->nd", powers[:, 1:], values[:, 1:])
        spring = np.where(self.slip[cell] == 0, pieces.contact_stiffness, 0.0)
        friction = self.friction[cell] + spring * (travel @ pieces.directions.T)
        return values[:, 0] + travel, slope, friction

    def quadrature(self, pieces: LinearMotion, highest: int):
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
        return tau, weight, self.inside(pieces, cell, share)

    def work(self, pieces: LinearMotion) -> tuple[float, float]:
        """Done by the force and dissipated by the damping matrix [J]."""
        highest = int(pieces.orders.max(initial=0))
        tau, weight, (_, slope, _) = self.quadrature(pieces, highest)
        phase = tau[:, None] * pieces.orders
        force = np.cos(phase) @ pieces.cosine.T + np.sin(phase) @ pieces.sine.T + pieces.static
        viscous = pieces.frequency * slope @ pieces.damping.T
        done, lost = (weight @ (part * slope).sum(axis=1) for part in (force, viscous))
        return float(done), float(lost)

    def reversals(self, pieces: LinearMotion) -> np.ndarray:
        """Changes of sign of all relative velocities over the period, (n_contacts,)."""
        rates = np.zeros_like(self.displacement)
        rates[:, :-1] = _POWER[1:, None] * self.displacement[:, 1:] / self.width[:, None, None]
        noise = _REST * np.abs(rates[:, 0]).max()
        rates = rates @ pieces.all_directions.T
        result = np.zeros(pieces.n_contacts, dtype=int)
        for j in range(pieces.n_contacts):
            samples = []
            bends = alternates(rates[:, :, j])
            for powers, bent in zip(rates[:, :, j], bends, strict=True):
                places = [place for place, _ in crossings(powers)] if bent else []
                places = np.array([0.0, *places, 1.0])
                # Between its zeros a velocity is far from them, unless it is nothing but noise.
                samples.append(polyval((places[1:] + places[:-1]) / 2, powers))
            samples = np.concatenate(samples)
            positive = samples[np.abs(samples) > noise] > 0
            result[j] = np.count_nonzero(positive != np.roll(positive, 1))
        return result


@dataclass(frozen=True)
class March:
    """A stretch of motion: its cells, its events and its end.

    Attributes
    ----------
    cells
        The motion; ``slipped`` (n_active,) tells which contacts slipped in it.
    event_angle, event_contact, event_slip : (n_events,)
        Where [rad], which active contact, and its direction of slip (0: it sticks).
    event_state : (n_events, 2 n_dof + n_active)
        Displacement, derivative by ``tau`` and friction force there.
    end : (2 n_dof + n_active,)
        The same at the end.
    jacobian : (2 n_dof + n_active, 2 n_dof + n_active) or None
        Exact derivative of the end by the start.
    """

    cells: Cells
    slipped: np.ndarray
    event_angle: FloatArray
    event_contact: np.ndarray
    event_slip: np.ndarray
    event_state: FloatArray
    end: FloatArray
    jacobian: FloatArray | None

    def multipliers(self, pieces: LinearMotion) -> np.ndarray:
        """Eigenvalues of the derivative, largest first, at given static forces.

        Those of the contacts that never slip stay what they are, which makes a one for each.
        """
        assert self.jacobian is not None
        n = pieces.n_dof
        stuck = 2 * n + np.flatnonzero(~self.slipped)
        kept = np.concatenate([np.arange(2 * n), 2 * n + np.flatnonzero(self.slipped)])
        matrix = self.jacobian[np.ix_(kept, kept)]
        # Their forces follow the displacement by their springs alone.
        spring = (pieces.contact_stiffness[:, None] * pieces.directions)[~self.slipped]
        matrix[:, :n] += self.jacobian[np.ix_(kept, stuck)] @ spring
        values = np.linalg.eigvals(matrix)
        return values[np.argsort(-np.abs(values))]


def march(pieces: LinearMotion, state: FloatArray, length: float, derivative: bool = True) -> March:
    """March from ``tau = 0`` to ``length`` [rad].

    ``state`` (2 n_dof + n_active,) is displacement, its derivative by ``tau`` [m] and the friction
    forces [N], which are put between their limits. Raises ArithmeticError for a motion that is not
    finite, or where events follow each other without end.
    """
    n, limit, stiffness = pieces.n_dof, pieces.limit, pieces.contact_stiffness
    x, slope = state[:n].copy(), state[n : 2 * n].copy()
    friction = np.clip(state[2 * n :], -limit, limit)
    outward = pieces.directions @ slope
    slip = np.where((np.abs(friction) >= limit) & (friction * outward > 0), np.sign(outward), 0.0)
    variation = np.eye(len(state)) if derivative else None
    if variation is not None:
        variation[2 * n :][slip != 0] = 0.0
    turned = np.zeros(len(limit))
    slipped = slip != 0
    tau, cells, events = 0.0, [], []
    while tau < length:
        stick = slip == 0
        piece = pieces.piece(stick)
        powers = pieces.expand(piece, tau, x, slope, friction)
        if not np.all(np.isfinite(powers)):
            raise ArithmeticError("the motion is not finite")
        share = min(1.0, (length - tau) / piece.width)
        powers *= share ** _POWER[:, None]
        at, now = _first_event(pieces, powers, friction, slip, turned)
        width = share * at * piece.width
        if width > _SHORTEST:
            powers = powers * at ** _POWER[:, None]
            cells.append((tau, width, powers, friction.copy(), slip.copy()))
            if variation is not None:
                variation = _carry(pieces, piece.transition(share * at), stick, variation)
            x = powers.sum(axis=0)
            slope = _POWER @ powers / width
            travel = pieces.directions @ powers[1:].sum(axis=0)
            friction = friction + np.where(stick, stiffness * travel, 0.0)
            tau = length if at == 1.0 and share < 1.0 else tau + width
            if width > _INSTANT:
                turned = np.zeros(len(limit))
        if len(now):
            begins = now[stick[now]]
            turned[now] = slip[now]
            slip[now] = 0.0
            slip[begins] = np.where(friction[begins] > 0, 1.0, -1.0)
            friction[begins] = slip[begins] * limit[begins]
            slipped[begins] = True
            if variation is not None:
                variation[2 * n + begins] = 0.0
            here = np.concatenate([x, slope, friction])
            events += [(tau, j, slip[j], here) for j in now]
            if len(events) > _EVENTS_PER_CONTACT * len(limit):
                raise ArithmeticError("the contacts change their states without end")
    starts, widths, motions, forces, states = zip(*cells, strict=True)
    columns = list(zip(*events, strict=True)) if events else [[], [], [], []]
    return March(
        Cells(*(np.array(part) for part in (starts, widths, motions, forces, states))),
        slipped,
        np.array(columns[0], dtype=float),
        np.array(columns[1], dtype=int),
        np.array(columns[2], dtype=int),
        np.array(columns[3], dtype=float).reshape(len(events), len(state)),
        np.concatenate([x, slope, friction]),
        variation,
    )


def _carry(
    pieces: LinearMotion, transition: FloatArray, stick: np.ndarray, variation: FloatArray
) -> FloatArray:
    """Derivative by the start carried over a cell."""
    n = pieces.n_dof
    friction = variation[2 * n :].copy()
    moved = transition @ np.concatenate([variation[: 2 * n], -pieces.push @ friction])
    travel = pieces.directions[stick] @ (moved[:n] - variation[:n])
    friction[stick] += pieces.contact_stiffness[stick, None] * travel
    return np.concatenate([moved, friction])


def _first_event(
    pieces: LinearMotion,
    powers: FloatArray,
    friction: FloatArray,
    slip: FloatArray,
    turned: FloatArray,
) -> tuple[float, np.ndarray]:
    """Share of the cell at the first event, 1 without one, and the contacts that have it."""
    count = len(slip)
    motion = powers @ pieces.directions.T
    # Distances to the upper and the lower limit, or the velocity along the slip: all positive.
    room = np.zeros((DEGREE + 1, 2, count))
    force = pieces.contact_stiffness * motion
    force[0] = friction
    room[:, 0], room[:, 1] = -force, force
    room[0] += pieces.limit
    slides = slip != 0
    room[:-1, 0, slides] = (_POWER[1:, None] * motion[1:])[:, slides] * slip[slides]
    room[-1, 0, slides] = 0.0
    room[:, 1, slides] = 0.0
    # A contact that sticks since this instant is on its limit, with no velocity: a double zero.
    for j in np.flatnonzero((turned != 0) & ~slides):
        side = 0 if turned[j] > 0 else 1
        room[:-2, side, j] = room[2:, side, j]
        room[-2:, side, j] = 0.0
    lowest = np.einsum("ik,kc->ic", BERNSTEIN, room.reshape(DEGREE + 1, -1)).min(axis=0)
    lowest = lowest.reshape(2, count)
    lowest[1, slides] = 1.0
    first = np.full(count, np.inf)
    for side, j in zip(*np.nonzero(lowest <= 0), strict=True):
        first[j] = min(first[j], _leaves(room[:, side, j]))
    at = first.min(initial=np.inf)
    if at > 1:
        return 1.0, np.array([], dtype=int)
    return at, np.flatnonzero(first <= at + np.finfo(float).eps)


def _leaves(room: FloatArray) -> float:
    """Where a polynomial that is positive but for round-off becomes negative, infinity if never."""
    values = BERNSTEIN @ room
    values = values[values != 0]
    if not len(values):
        return np.inf
    if values[0] < 0 and next(crossings(room), (1.0, False))[0] > _OUTSIDE:
        return 0.0
    return next((place for place, falls in crossings(room) if falls), np.inf)
