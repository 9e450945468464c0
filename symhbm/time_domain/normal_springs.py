"""Springs in the normal direction of contacts, which press their sliders and may open."""

from dataclasses import dataclass

import numpy as np

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
