"""Contact laws whose force is a polynomial of the displacements.

A polynomial of degree ``p`` of a motion of highest harmonic ``h`` holds harmonics up to ``p h``.
Sums over more than ``(p + 1) h`` samples separate those from the harmonics of the basis, so that
they are the exact Fourier integrals.
"""

from abc import abstractmethod
from functools import lru_cache
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from symhbm.model.contacts.law import Located, Values
from symhbm.model.contacts.memoryless import Instants, MemorylessLaw
from symhbm.numerics import Compiled, FloatArray, FourierBasis, check

_ROUND_OFF = 1e-9
"""Share of a force within which it is a polynomial, or the opposite of another one."""


class PolynomialLaw(MemorylessLaw):
    """A force that is a polynomial of the displacements, of `degree` together.

    See `ContactLaw` for an example.

    Examples
    --------
    A stop of the fourth power, which pushes to one side:

    >>> import symhbm as sh
    >>> class Fourth(sh.PolynomialLaw):
    ...     directions = ("normal",)
    ...     parameters = {"stop_stiffness": sh.Parameter("N m-4", "stiffness of the stop", "$k_4$")}
    ...     degree = 4
    ...     odd = False
    ...     def force_at(self, displacement, frequency, values):
    ...         return values["stop_stiffness"] * displacement**4
    >>> stop = sh.Contacts(Fourth(), [(0,)], stop_stiffness=1e10)
    >>> blade = sh.Model([[1.0]], [[5.0]], [[1e4]], contacts={"stop": stop})
    >>> problem = sh.HarmonicBalance(blade, sh.PointForce(), harmonics=(0, 1, 2))
    >>> bool(sh.solve(problem, 12.0).converged)
    True
    """

    degree: ClassVar[int]
    """Highest power of the displacements in the force."""

    def check(self) -> None:
        """That the force is a polynomial of the `degree`, and opposite where `odd` says so.

        Integrals of another force would be those of the samples alone, and harmonics without even
        ones would leave out what a force that is not odd does first.
        """
        degree = check.integer(f"degree of {self!r}", getattr(self, "degree", None), minimum=1)
        rng, m = np.random.default_rng(0), len(self.directions)
        count = 2 * degree + 7
        values = {name: np.full(count, rng.uniform(0.5, 1.5)) for name in self.parameters}
        along = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        middle, direction = rng.uniform(-0.3, 0.3, m), rng.uniform(0.5, 1.5, m)
        path = np.multiply.outer(along, direction)
        force = self._at(middle + path, 1.0, values)[0]
        fit = np.polynomial.chebyshev.chebfit(along, force, degree)
        rest = force - np.polynomial.chebyshev.chebval(along, fit).T
        if not np.abs(rest).max() <= _ROUND_OFF * np.abs(force).max():
            raise ValueError(
                f"degree={degree} of {self!r}: expected the highest power of the displacements in "
                "force_at, which is no polynomial of this degree"
            )
        forward, mirrored = (self._at(sign * path, 1.0, values)[0] for sign in (1, -1))
        if self.odd and np.abs(forward + mirrored).max() > _ROUND_OFF * np.abs(forward).max():
            raise ValueError(
                f"odd=True of {self!r}: expected odd = False in the class, as the force at the "
                "opposite displacement is not the opposite one"
            )

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

    @property
    def gives_back(self) -> bool:
        """One displacement alone gives back what it takes."""
        return len(self.directions) == 1

    def at_instants(
        self, displacement: FloatArray, velocity: FloatArray, frequency: float, values: Values
    ) -> Instants:
        """Those of `force_at`, whatever the velocity."""
        force, slope = self._at(displacement, frequency, values)
        return Instants(force, slope, np.zeros_like(slope))

    def damping(
        self, basis: FourierBasis, motion: FloatArray, frequency: float, values: Values
    ) -> FloatArray:
        """None."""
        return np.zeros((*motion.shape, motion.shape[1]))

    def _at(
        self, displacement: FloatArray, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
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
        if self.gives_back:
            return {}
        return super().results(basis, located, motion, frequency, values)


@lru_cache(maxsize=64)
def _instants(law: PolynomialLaw, n_instants: int) -> Compiled:
    displacement = ca.SX.sym("displacement", len(law.directions))
    frequency, values = ca.SX.sym("frequency"), ca.SX.sym("values", len(law.parameters))
    by_name = dict(zip(law.parameters, ca.vertsplit(values), strict=True))
    force = law.force_at(displacement, frequency, by_name)
    slope = ca.densify(ca.jacobian(force, displacement))
    inputs = [displacement, frequency, values]
    each = ca.Function("instants", inputs, [ca.densify(force), ca.vec(slope)])
    return Compiled(each.map(n_instants))
