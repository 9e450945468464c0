"""Contacts that are springs and sliders, and what they do to the motion in each of their states."""

from dataclasses import dataclass

import numpy as np

from symhbm.model import Structure
from symhbm.numerics import FloatArray

STICK = 0.0
"""State of a contact that sticks; slip is 1.0 or -1.0, its direction."""
APART = 2.0
"""State of a contact that is open."""


@dataclass(frozen=True)
class NormalSprings:
    """The contacts whose normal force acts or moves, arrays over the ``n`` of them.

    Attributes
    ----------
    contact : (n,)
        Their numbers among the active contacts.
    row : (n,)
        The rows of ``v`` among all directions of contacts.
    directions : (n, n_dof)
        Those of ``v``.
    stiffness, load, offset, friction : (n,)
        ``k_n`` [N/m], ``N0`` [N], the normal force [N] that is balanced, and ``mu``.
    ratio : (n,)
        ``mu k_n / k_t``: the walls of the slider move as ``u`` less and plus this times ``v``.
    push : (n_dof, n)
        Acceleration, by ``tau`` twice, that a unit of normal force takes away.
    """

    contact: np.ndarray
    row: np.ndarray
    directions: FloatArray
    stiffness: FloatArray
    load: FloatArray
    offset: FloatArray
    friction: FloatArray
    ratio: FloatArray
    push: FloatArray

    def __len__(self) -> int:
        return len(self.contact)

    def pressure(self, x: FloatArray) -> FloatArray:
        """``p = N0 + k_n v`` (..., n) [N] of displacements (..., n_dof) [m]."""
        return self.load + self.stiffness * (x @ self.directions.T)

    def closed(self, state: FloatArray) -> np.ndarray:
        """Which of the contacts (..., n) are closed in states (..., n_active)."""
        return state[..., self.contact] != APART

    def force(self, x: FloatArray, state: FloatArray) -> FloatArray:
        """``N`` (..., n) [N] of displacements and states (..., n_active)."""
        return np.where(self.closed(state), self.pressure(x), 0.0)

    def by_displacement(self, state: FloatArray) -> FloatArray:
        """Derivative of ``N`` by displacement, (n, n_dof) [N/m]."""
        return np.where(self.closed(state), self.stiffness, 0.0)[:, None] * self.directions

    def along_wall(self, state: FloatArray) -> FloatArray:
        """``T / N`` of the contacts that slip, 0 of the others, (..., n)."""
        return slip(state)[..., self.contact] * self.friction


def slip(state: FloatArray) -> FloatArray:
    """Direction of slip of states, 0 without slip."""
    return np.where(state == APART, 0.0, state)


class ActiveContacts:
    """The contacts of a structure that can carry a force, as springs and sliders.

    Contacts without spring or limit at an angular ``frequency`` [rad/s] are left out: ``active``
    are the others.

    Attributes
    ----------
    active : (n_active,)
        Contacts that can carry a force.
    rubs : (n_active,)
        Which of them have friction.
    tangential : (n_active,)
        Their rows among all directions of contacts.
    directions, across : (n_active, n_dof)
        Their directions ``w_j``, 0 without friction, and those at a right angle of planar friction.
    contact_stiffness, limit : (n_active,)
        Their ``k_d`` [N/m] and ``mu F_n`` [N] at rest, 0 without friction.
    normal
        Those of them whose normal force acts or moves.
    sprung, load : (n_contacts,)
        Whether contacts have a tangential spring, and their ``N0`` [N], NaN without a normal
        direction.
    all_directions : (n_contacts, n_dof)
        The first direction of each contact, active or not.
    """

    def __init__(self, model: Structure, frequency: float):
        contact, tangential, across, normal, sliders = model.spring_sliders(frequency)
        stiffness, normal_stiffness, friction, load, offset = sliders
        rows = model.directions.toarray()
        rubs = (stiffness > 0) & (friction > 0) & ((normal_stiffness > 0) | (load > 0))
        presses = (normal >= 0) & ((normal_stiffness > 0) | (np.maximum(load, 0.0) != offset))
        carries = rubs | presses
        self.all_directions = rows[[of_contact[0] for of_contact in model.contact_rows]]
        self.n_dof, self.n_contacts = model.n_dof, model.n_contacts
        self.sprung = np.zeros(self.n_contacts, dtype=bool)
        self.load = np.full(self.n_contacts, np.nan)
        self.sprung[contact] = stiffness > 0
        self.load[contact] = np.where((normal >= 0) | (across >= 0), load, np.nan)
        self.active, self.rubs = contact[carries], rubs[carries]
        self.tangential = tangential[carries]
        self.directions = np.where(self.rubs[:, None], rows[self.tangential], 0.0)
        in_plane = self.rubs & (across[carries] >= 0)
        self.across = np.where(in_plane[:, None], rows[across[carries]], 0.0)
        self.contact_stiffness = np.where(rubs, stiffness, 0.0)[carries]
        self.limit = np.where(rubs, friction * np.maximum(load, 0.0), 0.0)[carries]
        friction = np.where(rubs, friction, 0.0)
        spring = np.where(rubs, stiffness, 1.0)
        self.normal = NormalSprings(
            np.flatnonzero(presses[carries]),
            normal[presses],
            rows[normal[presses]],
            normal_stiffness[presses],
            load[presses],
            offset[presses],
            friction[presses],
            (friction * normal_stiffness / spring)[presses],
            np.zeros((self.n_dof, 0)),
        )

    def limits(self, x: FloatArray) -> FloatArray:
        """Largest friction forces (n_active,) [N] at a displacement."""
        if not len(self.normal):
            return self.limit
        limit, normal = self.limit.copy(), self.normal
        limit[normal.contact] = normal.friction * np.maximum(normal.pressure(x), 0.0)
        return limit

    def springs(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Springs of the contacts in a ``state`` (n_active,).

        Directions (n, n_dof) of their forces, and their stiffness times the directions of what
        moves them, (n, n_dof).
        """
        stick, normal = state == STICK, self.normal
        directions = self.directions[stick]
        springs = directions * self.contact_stiffness[stick, None]
        # The friction of a contact that slips acts with its normal force.
        share, closed = normal.along_wall(state), normal.closed(state)
        pressed = normal.directions + share[:, None] * self.directions[normal.contact]
        return (
            np.concatenate([directions, pressed[closed]]),
            np.concatenate([springs, normal.by_displacement(state)[closed]]),
        )

    def friction_slopes(self, state: FloatArray) -> FloatArray:
        """Derivative of the friction forces by displacement in a ``state``, (n_active, n_dof)."""
        stick, normal = state == STICK, self.normal
        slopes = np.where(stick[:, None], self.contact_stiffness[:, None] * self.directions, 0.0)
        slopes[normal.contact] += normal.along_wall(state)[:, None] * normal.by_displacement(state)
        return slopes

    def friction_since_closing(self, slope: FloatArray, contact: int) -> FloatArray:
        """Derivative by displacement (n_dof,) of the friction of a contact that closed and sticks.

        ``slope`` (n_dof,) is that of the motion. Closing earlier by ``k_n dv / p'`` adds
        ``k_t u'`` times that: a spring beside the normal one.
        """
        direction = self.normal.directions[np.searchsorted(self.normal.contact, contact)]
        outward, closes = self.directions[contact] @ slope, direction @ slope
        return direction * (
            self.contact_stiffness[contact] * outward / closes if closes > 0 else 0.0
        )
