"""The protocol of goals: what is asked of a solution, as an expression of it.

Some are sums over contacts: of a group, of all, or of one of a group.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import casadi as ca

from symhbm.model import Structure
from symhbm.model.contacts import ContactLaw, Motions
from symhbm.model.records import Record
from symhbm.numerics import FourierBasis, check


class ContactSymbols(NamedTuple):
    """One contact of a solution as CasADi symbols.

    Attributes
    ----------
    law
        Its law.
    at
        Its motion (m K) [m] with the frequency [rad/s] and the values of its parameters.
    force : (m K)
        Coefficients of its force [N].

    Examples
    --------
    The mean square of all forces of a group over a period, where none has a mean:

    >>> import casadi as ca
    >>> import symhbm as sh
    >>> class Push(sh.goals.Goal):
    ...     units, meaning = "N2", "mean square of the forces of dampers"
    ...     def value(self, at):
    ...         return sum(ca.sumsqr(one.force) / 2 for one in at.contacts["friction"])
    """

    law: ContactLaw
    at: Motions
    force: Any


class Solution(NamedTuple):
    """A solution as CasADi expressions, which goals are expressions of.

    Attributes
    ----------
    model
        The structure.
    basis
        The harmonic set, of ``K`` components.
    coefficients : (K, n_dof)
        Coefficients of displacements [m], a degree of freedom a column.
    frequency
        Angular frequency [rad/s].
    parameters
        Parameters of contacts and force by name, a column each.
    contacts
        The contacts of each group, by its name.

    Examples
    --------
    The mean square of the velocity of the first degree of freedom, over a period:

    >>> import casadi as ca
    >>> import symhbm as sh
    >>> class Velocity(sh.goals.Goal):
    ...     units, meaning = "m2 s-2", "mean square of a velocity"
    ...     def value(self, at):
    ...         rate = ca.mtimes(ca.DM(at.basis.derivative_matrix), at.coefficients[:, 0])
    ...         return at.frequency**2 * ca.sumsqr(rate) / 2
    """

    model: Structure
    basis: FourierBasis
    coefficients: Any
    frequency: Any
    parameters: Mapping[str, Any]
    contacts: Mapping[str, list[ContactSymbols]]


class Goal(Record, ABC):
    """What a design makes small, or a peak is of; one of your own derives from this class.

    It is no less than 0, and a smooth expression where the force of contacts is. Archives hold the
    attributes of one of your own; whoever reads them defines its class.

    Examples
    --------
    The mean square of all displacements, over a period:

    >>> import casadi as ca
    >>> import symhbm as sh
    >>> class MeanSquare(sh.goals.Goal):
    ...     units, meaning = "m2", "mean square of all displacements"
    ...     def value(self, at):
    ...         return ca.sumsqr(at.coefficients) / 2
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> best = sh.minimise_peak(
    ...     problem, "normal_load", bounds=(0.1, 100), frequency_band=(5, 40),
    ...     peaks={"square": {"goal": MeanSquare()}},
    ...     objective=lambda peaks, parameters: peaks["square"], progress=False,
    ... )
    >>> best.design_value.values.round(6)  # the load that makes the amplitude smallest, too
    array([3.088579])
    """

    units: ClassVar[str]
    """Unit of the value."""
    meaning: ClassVar[str]
    """What it is, in a few words."""
    additive: bool = False
    """Whether it is a sum over the sectors of a disk, of what each sector has."""

    @abstractmethod
    def value(self, at: Solution) -> Any:
        """The goal of a solution, as one CasADi expression."""

    def check(self, model: Structure, harmonics: tuple[int, ...]) -> None:
        """Raise KeyError, TypeError or ValueError where a structure has no such goal."""
        return

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in vars(self).items())})"


@dataclass(frozen=True, repr=False)
class OfContacts(Goal):
    """A sum over the contacts of a ``group``, over all of them, or one ``contact`` of a group."""

    group: str | None = None
    contact: int | None = None
    law: ClassVar[type] = ContactLaw
    """Laws whose contacts are counted, others add nothing."""

    @property
    def additive(self) -> bool:  # type: ignore[override]
        """That of all contacts is a sum over sectors."""
        return self.contact is None

    def check(self, model: Structure, harmonics: tuple[int, ...]) -> None:
        """Raise KeyError, TypeError or ValueError for contacts that there are not."""
        sizes = {group.name: group.n for group in model.groups}
        if self.group is not None:
            check.known(self.group, sizes, "group of contacts")
        elif self.contact is not None:
            raise ValueError(f"{self!r}: expected the group that the contact is one of")
        if self.group is not None and self.contact is not None:
            check.integer("contact", self.contact, 0, sizes[self.group] - 1)

    def value(self, at: Solution) -> Any:
        """The sum of what each contact adds."""
        chosen = [self.group] if self.group is not None else [*at.contacts]
        contacts = [
            one for name in chosen for one in at.contacts[name] if isinstance(one.law, self.law)
        ]
        if self.contact is not None and contacts:
            contacts = [contacts[self.contact]]
        return sum((self.of(one) for one in contacts), ca.SX(0))

    @abstractmethod
    def of(self, contact: ContactSymbols) -> Any:
        """What one contact adds."""
