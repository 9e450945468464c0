"""Contact laws without memory: the force at an instant is one of displacement and velocity there.

Motions in time need no more than that of a law: shooting, Floquet multipliers, Hill's method.
"""

from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.motions import History, Motions, Values
from symhbm.numerics import FloatArray


class Instants(NamedTuple):
    """Forces at instants and their slopes.

    ``force`` (n, m) [N], ``by_displacement`` (n, m, m) [N/m], ``by_velocity`` (n, m, m) [N s/m].
    """

    force: FloatArray
    by_displacement: FloatArray
    by_velocity: FloatArray


class MemorylessLaw(ContactLaw):
    """A force of displacements and velocities at one instant."""

    @property
    def has_kinks(self) -> bool:
        """Whether slopes of the force may jump."""
        return False

    @property
    def gives_back(self) -> bool:
        """Whether the work of the force over any period is zero."""
        return False

    @abstractmethod
    def at_instants(
        self, displacement: FloatArray, velocity: FloatArray, frequency: float, values: Values
    ) -> Instants:
        """Forces and slopes at displacements [m] and velocities [m/s], (n, m) each.

        ``frequency`` in rad/s; ``values`` (n,) each.
        """

    @abstractmethod
    def damping(self, at: Motions) -> FloatArray:
        """Damping (n, m K, m K) [N s/m] of small motions beside motions ``at``.

        Coefficients of the force by those of a velocity beside the motion, at a given displacement.
        """

    def history(self, at: Motions, n_angles: int) -> list[History]:
        """From the force at instants; such contacts have no events and no limit."""
        basis, motion, frequency, values = at
        angle = 2 * np.pi * np.arange(n_angles + 1) / n_angles
        none, result = np.zeros(len(angle)), []
        for j, omega in enumerate(np.broadcast_to(frequency, len(motion)).tolist()):
            parts = motion[j].reshape(-1, basis.n_components)
            moved, slope = (parts @ basis.values(angle, d).T for d in (0, 1))
            along = {name: np.full(len(angle), value[j]) for name, value in values.items()}
            force = self.at_instants(moved.T, omega * slope.T, omega, along).force
            result.append(History(angle, moved, force.T, none, none.astype(int)))
        return result

    def breaks(self, at: Motions) -> list[FloatArray]:
        """Angles [rad] at which slopes of the forces of motions jump, one array each."""
        return [at.basis.order[:0]] * len(at.motion)
