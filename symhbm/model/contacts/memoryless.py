"""Contact laws without memory: the force at an instant is one of displacement and velocity there.

Motions in time need no more than that of a law: shooting, Floquet multipliers, Hill's method.
"""

from abc import abstractmethod
from typing import Any, NamedTuple

from symhbm.model.contacts.law import ContactLaw, Values
from symhbm.numerics import FloatArray, FourierBasis


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
    def damping(
        self, basis: FourierBasis, motion: FloatArray, frequency: float, values: Values
    ) -> FloatArray:
        """Damping (n, m K, m K) [N s/m] of small motions beside those given (n, m K) [m].

        Coefficients of the force by those of a velocity beside the motion, at a given displacement.
        """

    def breaks(
        self, basis: FourierBasis, motion: Any, frequency: float, values: Values
    ) -> list[FloatArray]:
        """Angles [rad] at which slopes of the forces of motions (n, m K) jump, one array each."""
        return [basis.order[:0]] * len(motion)
