"""Smooth contact laws without memory: the force is a polynomial of the displacement.

A polynomial of degree ``p`` of a motion of highest harmonic ``h`` holds harmonics up to ``p h``.
Sums over more than ``(p + 1) h`` samples separate those from the harmonics of the basis, so that
they are the exact Fourier integrals.
"""

from abc import abstractmethod
from functools import lru_cache
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from symhbm.model.contacts.law import ContactLaw, Located, Values
from symhbm.numerics import Compiled, FloatArray, FourierBasis


class SmoothLaw(ContactLaw):
    """A force that is a polynomial of the displacements, of `degree` together.

    See `ContactLaw` for an example.
    """

    degree: ClassVar[int]
    """Highest power of the displacements in the force."""

    @abstractmethod
    def force_at(self, displacement: Any, frequency: Any, values: Values) -> Any:
        """Force (m) [N] at one instant as a CasADi expression, ``displacement`` (m) in m."""

    def force(
        self, basis: FourierBasis, motion: Any, frequency: Any, values: Values, events: Any
    ) -> Any:
        """Exact Fourier integrals of the force."""
        n_samples = (self.degree + 1) * basis.highest + 1
        synthesis = basis.values(2 * np.pi * np.arange(n_samples) / n_samples)
        analysis = ca.DM(2 * np.pi / n_samples * (synthesis * basis.norm).T)
        instants = ca.mtimes(ca.DM(synthesis), ca.reshape(motion, basis.n_components, -1))
        forces = [self.force_at(instants[i, :].T, frequency, values).T for i in range(n_samples)]
        return ca.vec(ca.mtimes(analysis, ca.vertcat(*forces)))

    def at_instants(
        self, displacement: FloatArray, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
        """Forces (n, m) [N] of contacts at displacements (n, m) [m], and slopes (n, m, m) [N/m].

        ``values`` (n,) each.
        """
        n, m = displacement.shape
        given = np.array([values[name] for name in self.parameters]).T
        data = displacement.ravel(), np.full(n, frequency), given.ravel()
        force, slope = _instants(self, n)(*data)
        # CasADi stores columns one after the other.
        return force.reshape(n, m), slope.reshape(n, m, m).transpose(0, 2, 1)

    def results(
        self,
        basis: FourierBasis,
        located: Located,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
    ) -> dict[str, FloatArray]:
        """The energy that displacements together dissipate; one alone gives back what it takes."""
        if len(self.directions) == 1:
            return {}
        return super().results(basis, located, motion, frequency, values)


@lru_cache(maxsize=64)
def _instants(law: SmoothLaw, n_instants: int) -> Compiled:
    displacement = ca.SX.sym("displacement", len(law.directions))
    frequency, values = ca.SX.sym("frequency"), ca.SX.sym("values", len(law.parameters))
    by_name = dict(zip(law.parameters, ca.vertsplit(values), strict=True))
    force = law.force_at(displacement, frequency, by_name)
    slope = ca.densify(ca.jacobian(force, displacement))
    inputs = [displacement, frequency, values]
    each = ca.Function("instants", inputs, [ca.densify(force), ca.vec(slope)])
    return Compiled(each.map(n_instants))
