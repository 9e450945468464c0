"""Contacts that are springs and sliders, and what they do to the motion in each of their states."""

import numpy as np
import scipy.linalg

from symhbm.model import Structure
from symhbm.model.linear import positive_definite
from symhbm.numerics import FloatArray

STICK = 0.0
"""State of a contact that sticks; slip is 1.0 or -1.0, its direction."""
APART = 2.0
"""State of a contact that is open."""
_KEPT_SPRINGS = 3e6
"""Most numbers of springs that are kept with the matrices, for all loads and frequencies."""


def slip(state: FloatArray) -> FloatArray:
    """Direction of slip of states, 0 without slip."""
    return np.where(state == APART, 0.0, state)


class Inertia:
    """What accelerates a structure, at any frequency.

    Attributes
    ----------
    mass, damping, stiffness : (n_dof, n_dof)
        Dense matrices [kg, N s/m, N/m].
    by_stiffness : (n_dof, n_dof)
        Accelerations by displacement without contacts [1/s^2].
    viscous_rate : float
        The highest rate of decay by the damping matrix [1/s].

    Raises ValueError for a mass matrix that is not positive definite.
    """

    def __init__(self, model: Structure):
        self.mass, self.damping, self.stiffness = (
            np.asarray(getattr(model, f"{name}_matrix").toarray(), dtype=float)
            for name in ("mass", "damping", "stiffness")
        )
        self._factor = factor = positive_definite(self.mass)
        size = len(self.mass)
        self._inverse_factor = scipy.linalg.solve_triangular(factor, np.eye(size), lower=True)
        self.by_stiffness = self.accelerations(self.stiffness)
        self.viscous_rate = self.norm(self.damping)
        self._scaled_stiffness = self._scaled(self.stiffness)
        self._springs: dict[bytes, tuple[FloatArray, float]] = {}

    def accelerations(self, forces: FloatArray) -> FloatArray:
        """Accelerations of forces (n_dof, n)."""
        return scipy.linalg.cho_solve((self._factor, True), forces)

    def _scaled(self, matrix: FloatArray) -> FloatArray:
        """A matrix in the coordinates of the factor, in which norms are those of frequencies."""
        return self._inverse_factor @ matrix @ self._inverse_factor.T

    def norm(self, matrix: FloatArray) -> float:
        """Norm of accelerations, of a damping matrix the highest rate of decay [1/s]."""
        return float(np.linalg.norm(self._scaled(matrix), 2))

    def with_springs(
        self, contacts: "ActiveContacts", state: FloatArray
    ) -> tuple[FloatArray, float]:
        """Accelerations by the displacement of contacts in a state [1/s^2], and the highest rate.

        That is the square root of the norm of the generator, with the structure's own [1/s].
        """
        springs = contacts.springs(state)
        key = springs.tobytes()
        found = self._springs.get(key)
        if found is None:
            if len(self._springs) * springs.size > _KEPT_SPRINGS:
                self._springs.clear()
            norm = np.linalg.norm(self._scaled_stiffness + self._scaled(springs), 2)
            found = self._springs[key] = self.accelerations(springs), float(np.sqrt(norm))
        return found


class ActiveContacts:
    """The contacts of a structure that can carry a force, as springs and sliders.

    Contacts without spring or limit at an angular ``frequency`` [rad/s] are left out: ``active``
    are the others.

    Attributes
    ----------
    active : (n_active,)
        Contacts that can carry a force.
    rubs, presses : (n_active,)
        Which of them have friction, and whose normal force acts or moves.
    tangential_rows, normal_rows : (n_active,)
        Rows of ``u`` and ``v`` among all directions of contacts, -1 without one.
    moves : bool
        Whether any normal force acts or moves.
    directions, across, normal : (n_active, n_dof)
        Their directions ``w_j``, 0 without friction, those at a right angle of planar friction, and
        those of ``v``, 0 of contacts that do not press.
    contact_stiffness, normal_stiffness : (n_active,)
        Their ``k_d``, 0 without friction, and ``k_n`` [N/m], 0 of contacts that do not press.
    friction : (n_active,)
        Their ``mu``, 0 without friction; ``mu F_n`` [N] of a constant load.
    loads, offset : (n_active,)
        Their ``N0`` [N], 1 of a constant load, and the normal force [N] that is balanced.
    pressing : (n_active, n_dof)
        Derivative of the normal force of closed contacts by displacement [N/m].
    sprung, load : (n_contacts,)
        Whether contacts have a tangential spring, and their ``N0`` [N], NaN without a normal
        direction.
    all_directions : (n_contacts, n_dof)
        The first direction of each contact, active or not.
    inertia
        What accelerates the structure.

    Raises ValueError for a mass matrix that is not positive definite.
    """

    def __init__(self, model: Structure, frequency: float):
        self.inertia: Inertia = model.of_matrices("inertia", lambda: Inertia(model))
        contact, tangential, across, normal, sliders = model.groups.spring_sliders(frequency)
        stiffness, normal_stiffness, friction, load, offset = sliders
        rows = model.directions.toarray()
        rubs = (stiffness > 0) & (friction > 0) & ((normal_stiffness > 0) | (load > 0))
        presses = (normal >= 0) & ((normal_stiffness > 0) | (np.maximum(load, 0.0) != offset))
        carries = rubs | presses
        self.all_directions = rows[[of_contact[0] for of_contact in model.groups.rows]]
        self.n_dof, self.n_contacts = model.n_dof, model.n_contacts
        self.sprung = np.zeros(self.n_contacts, dtype=bool)
        self.load = np.full(self.n_contacts, np.nan)
        self.sprung[contact] = stiffness > 0
        self.load[contact] = np.where((normal >= 0) | (across >= 0), load, np.nan)
        self.active, self.rubs, self.presses = contact[carries], rubs[carries], presses[carries]
        self.moves = bool(presses.any())
        self.tangential_rows, self.normal_rows = tangential[carries], normal[carries]
        self.directions = np.where(self.rubs[:, None], rows[self.tangential_rows], 0.0)
        in_plane = self.rubs & (across[carries] >= 0)
        self.across = np.where(in_plane[:, None], rows[across[carries]], 0.0)
        self.normal = np.where(self.presses[:, None], rows[self.normal_rows], 0.0)
        self.contact_stiffness = np.where(rubs, stiffness, 0.0)[carries]
        self._sticking = self.contact_stiffness[:, None] * self.directions
        self.normal_stiffness = np.where(presses, normal_stiffness, 0.0)[carries]
        self.pressing = self.normal_stiffness[:, None] * self.normal
        limit = friction * np.where(presses, 1.0, np.maximum(load, 0.0))
        self.friction = np.where(rubs, limit, 0.0)[carries]
        self.loads = np.where(presses, load, 1.0)[carries]
        self.offset = np.where(presses, offset, 0.0)[carries]

    def pressure(self, x: FloatArray) -> FloatArray:
        """Normal forces ``p = N0 + k_n v`` (..., n_active) [N] of closed contacts.

        Of displacements (..., n_dof); 1 of constant loads.
        """
        return self.loads + x @ self.pressing.T

    def limits(self, x: FloatArray) -> FloatArray:
        """Largest friction forces (..., n_active) [N] at displacements (..., n_dof)."""
        return self.friction * np.maximum(self.pressure(x), 0.0)

    def normal_force(self, x: FloatArray, state: FloatArray) -> FloatArray:
        """``N`` (..., n_active) [N] of displacements and states, 1 of constant loads."""
        return np.where(state == APART, 0.0, self.pressure(x))

    def friction_slopes(self, state: FloatArray) -> FloatArray:
        """Derivative of the friction forces by displacement in a ``state``, (n_active, n_dof).

        That of contacts that slip is one of their limits.
        """
        slopes = np.where((state == STICK)[:, None], self._sticking, 0.0)
        if self.moves:
            slopes += (slip(state) * self.friction)[:, None] * self.pressing
        return slopes

    def springs(self, state: FloatArray) -> FloatArray:
        """Stiffness (n_dof, n_dof) [N/m] of the contacts in a ``state`` (n_active,)."""
        pressed = self.normal.T @ ((state != APART)[:, None] * self.pressing)
        return self.directions.T @ self.friction_slopes(state) + pressed

    def friction_since_closing(self, slope: FloatArray, contact: int) -> FloatArray:
        """Derivative by displacement (n_dof,) of the friction of a contact that closed and sticks.

        ``slope`` (n_dof,) is that of the motion. Closing earlier by ``k_n dv / p'`` adds
        ``k_t u'`` times that: a spring beside the normal one.
        """
        outward = self.contact_stiffness[contact] * (self.directions[contact] @ slope)
        closes = self.pressing[contact] @ slope
        return self.pressing[contact] * (outward / closes if closes > 0 else 0.0)
