"""The cubic spring ``f = gamma y^3``."""

from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.coulomb import leading
from symhbm.model.contacts.law import Values
from symhbm.model.contacts.parameter import Parameter
from symhbm.model.contacts.polynomial import PolynomialLaw
from symhbm.numerics import FloatArray, FourierBasis


class CubicSpring(PolynomialLaw):
    """A spring of force ``gamma y^3``, ``gamma`` of any sign.

    Examples
    --------
    >>> import symhbm as sh
    >>> spring = sh.Contacts(sh.CubicSpring(), [(0,)], cubic_stiffness=1e8)
    >>> oscillator = sh.Model([[1.0]], [[0.5]], [[1e4]], contacts={"spring": spring})
    >>> problem = sh.HarmonicBalance(oscillator, sh.PointForce(amplitude=0.1), harmonics=(1, 3))
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

    def springs(
        self, basis: FourierBasis, motion: Any, frequency: Any, values: Values, events: Any
    ) -> tuple[list[Any], list[Any]]:
        """In the mean over the motion where a harmonic leads it, else for a small one beside it."""
        total, stiffness = ca.sumsqr(motion), values["cubic_stiffness"]
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
