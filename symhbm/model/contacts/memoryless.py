"""Contact laws without memory, polynomials among them.

The force at an instant is one of displacement and velocity there. Motions in time need no more than
that of a law: shooting, Floquet multipliers, Hill's method.

A polynomial of degree ``p`` of a motion of highest harmonic ``h`` holds harmonics up to ``p h``.
Sums over more than ``(p + 1) h`` samples separate those from the harmonics of the basis, so that
they are the exact Fourier integrals.
"""

from abc import abstractmethod
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple

import casadi as ca
import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.motions import (
    History,
    Located,
    Motions,
    Parameter,
    Values,
    leading,
    symbols_of,
)
from symhbm.numerics import Compiled, FloatArray, FourierBasis, check


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


_ROUND_OFF = 1e-9
"""Share of a force within which it is a polynomial, or the opposite of another one."""


class PolynomialLaw(MemorylessLaw):
    """A force that is a polynomial of the displacements, of `degree` together.

    See `ContactLaw` for an example.

    Examples
    --------
    A stop of the fourth power, which pushes to one side:

    >>> import symhbm as sh
    >>> class Fourth(sh.laws.PolynomialLaw):
    ...     directions = ("normal",)
    ...     parameters = {
    ...         "stop_stiffness": sh.laws.Parameter("N m-4", "stiffness of the stop", "$k_4$")
    ...     }
    ...     degree = 4
    ...     odd = False
    ...     def force_at(self, displacement, frequency, values):
    ...         return values["stop_stiffness"] * displacement**4
    >>> stop = sh.Contacts(Fourth(), [(0,)], stop_stiffness=1e10)
    >>> blade = sh.Model([[1.0]], [[5.0]], [[1e4]], contacts={"stop": stop})
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce(), harmonics=(0, 1, 2))
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

    def force(self, at: Motions, events: Any) -> Any:
        """Exact Fourier integrals of the force."""
        tau, displacement = self._sampled(at)
        forces = [self.force_at(each, at.frequency, at.values).T for each in displacement]
        analysis = 2 * np.pi / len(tau) * (at.basis.values(tau) * at.basis.norm).T
        return ca.vec(ca.mtimes(ca.DM(analysis), ca.vertcat(*forces)))

    def slope(self, at: Motions, force: Any) -> Any:
        """Exact, from the Fourier series of the slopes along the motion.

        A product of two waves is a sum of two others: with many harmonics these are far fewer terms
        than the integrals of all products.
        """
        basis, (tau, displacement) = at.basis, self._sampled(at)
        given = at.frequency, ca.vertcat(*(at.values[name] for name in self.parameters))
        slopes = ca.horzcat(*(_instant(self)(each, *given)[1] for each in displacement)).T
        waves = FourierBasis(tuple(range(2 * basis.highest + 1)))
        series = ca.mtimes(ca.DM(2 * np.pi / len(tau) * waves.values(tau).T), slopes)
        products = ca.mtimes(ca.DM(_products(basis, waves)), series)
        n, m = basis.n_components, len(self.directions)
        # Of the derivative of force p by displacement q, stored one column after the other.
        blocks = [[ca.reshape(products[:, p + m * q], n, n) for q in range(m)] for p in range(m)]
        return ca.blockcat(blocks)

    def _sampled(self, at: Motions) -> tuple[FloatArray, list[Any]]:
        """Angles [rad] enough for exact sums, and the displacements (m) at each."""
        n_samples = (self.degree + 1) * at.basis.highest + 1
        tau = 2 * np.pi * np.arange(n_samples) / n_samples
        synthesis = ca.DM(at.basis.values(tau))
        instants = ca.mtimes(synthesis, ca.reshape(at.motion, at.basis.n_components, -1))
        return tau, [instants[i, :].T for i in range(n_samples)]

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

    def damping(self, at: Motions) -> FloatArray:
        """None."""
        return np.zeros((*at.motion.shape, at.motion.shape[1]))

    def _at(
        self, displacement: FloatArray, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
        n, m = displacement.shape
        given = np.array([values[name] for name in self.parameters]).T
        data = displacement.ravel(), np.full(n, frequency), given.ravel()
        force, slope = _instants(self, n)(*data)
        # CasADi stores columns one after the other.
        return force.reshape(n, m), slope.reshape(n, m, m).transpose(0, 2, 1)

    def results(self, at: Motions, located: Located) -> dict[str, FloatArray]:
        """The energy that displacements together dissipate; one alone gives back what it takes."""
        return {} if self.gives_back else super().results(at, located)


class CubicSpring(PolynomialLaw):
    """A spring of force ``gamma y^3``, ``gamma`` of any sign.

    Examples
    --------
    >>> import symhbm as sh
    >>> spring = sh.Contacts(sh.laws.CubicSpring(), [(0,)], cubic_stiffness=1e8)
    >>> oscillator = sh.Model([[1.0]], [[0.5]], [[1e4]], contacts={"spring": spring})
    >>> force = sh.forces.PointForce(amplitude=0.1)
    >>> problem = sh.HarmonicBalance(oscillator, force, harmonics=(1, 3))
    >>> sh.frf(problem, (14, 18)).event_kind.values
    array(['fold', 'fold'], dtype=object)
    """

    parameters: ClassVar = {
        "cubic_stiffness": Parameter(
            "N m-3", "stiffness of the cubic spring", r"$\gamma$", "N/m³", "contact", "any", "any"
        )
    }
    degree = 3
    drawn_as = "cubic"

    def force_at(self, displacement: Any, frequency: Any, values: Values) -> Any:
        """``gamma y^3``."""
        return values["cubic_stiffness"] * displacement**3

    def holds(self, values: Values) -> NDArray[np.bool_]:
        """Those that have any stiffness."""
        return np.asarray(values["cubic_stiffness"]) != 0

    def acts(self, values: Values) -> NDArray[np.bool_]:
        """Those that have any stiffness."""
        return self.holds(values)

    def springs(self, at: Motions, events: Any) -> tuple[list[Any], list[Any]]:
        """In the mean over the motion where a harmonic leads it, else for a small one beside it."""
        basis, motion = at.basis, at.motion
        total, stiffness = ca.sumsqr(motion), at.values["cubic_stiffness"]
        springs = []
        for a in np.flatnonzero(~basis.is_sine & (basis.order > 0)).tolist():
            square = leading(motion, a)[1]
            # The mean stiffness of a cube to its own motion is half that to a motion beside it.
            springs.append(stiffness * (0.75 * square + 1.5 * (total - square)))
        return springs, [ca.SX(0)] * len(springs)

    def largest_force(self, values: Values, size: float, switched: bool) -> FloatArray:
        """``gamma`` times the cube of the size."""
        return np.asarray(values["cubic_stiffness"]) * size**3

    def stiffest(self, values: Values) -> FloatArray:
        """Without bound, where there is any."""
        return np.where(self.holds(values), np.inf, 0.0)


def _products(basis: FourierBasis, waves: FourierBasis) -> scipy.sparse.csc_matrix:
    """Products of two functions of a basis by `waves`, times the norm of the first.

    (K^2, n_waves), the second function of the product changing last.
    """
    tau = 2 * np.pi * np.arange(waves.n_components) / waves.n_components
    values = basis.values(tau)
    pairs = (values[:, None, :] * values[:, :, None]).reshape(len(tau), -1)
    # Of cosines and sines: halves and ones, which round-off shall not blur.
    found = np.round(2 * np.linalg.solve(waves.values(tau), pairs)) / 2
    # CasADi before 3.8.2 takes no sparse arrays.
    return scipy.sparse.csc_matrix(found.T * np.tile(basis.norm, basis.n_components)[:, None])


@lru_cache(maxsize=64)
def _instant(law: PolynomialLaw) -> ca.Function:
    """Force and slope (m^2) of displacements, frequency and values at one instant."""
    displacement = ca.SX.sym("displacement", len(law.directions))
    frequency, values, by_name = symbols_of(law)
    force = law.force_at(displacement, frequency, by_name)
    slope = ca.densify(ca.jacobian(force, displacement))
    inputs = [displacement, frequency, values]
    return ca.Function("instants", inputs, [ca.densify(force), ca.vec(slope)])


@lru_cache(maxsize=64)
def _instants(law: PolynomialLaw, n_instants: int) -> Compiled:
    return Compiled(_instant(law).map(n_instants))
