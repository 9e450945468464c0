"""The energy that contacts dissipate per cycle."""

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from symhbm.balance.goals.goal import ContactSymbols, OfContacts


@dataclass(frozen=True, repr=False)
class Dissipation(OfContacts):
    """Energy that contacts dissipate per cycle [J]: of a group, of all, or of one of a group.

    Attributes
    ----------
    group
        The name of a group of contacts, all of them by default. Of a
        `symhbm.Sector` they are those of one sector, as in its results.
    contact
        The number of one contact within the group.

    Examples
    --------
    The largest energy that a damper dissipates per cycle, over its load:

    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> goal = sh.goals.Dissipation()
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce(), peaks_of=goal)
    >>> curve = sh.peak_curve(problem, "normal_load", (2, 10), at=[3, 9], progress=False)
    >>> curve.peak_amplitude.values.round(6)
    array([0.000951, 0.001636])
    """

    units: ClassVar[str] = "J"
    meaning: ClassVar[str] = "energy dissipated by contacts per cycle"

    def of(self, contact: ContactSymbols) -> Any:
        """What one contact adds: the work of its force, the integral of ``f dy`` over a period."""
        basis = contact.at.basis
        motion = ca.reshape(contact.at.motion, basis.n_components, -1)
        turned = basis.derivative_matrix / basis.norm[:, None]
        return ca.dot(contact.force, ca.vec(ca.mtimes(ca.DM(turned), motion)))
