"""The force that presses contacts, in the mean over a cycle."""

from dataclasses import dataclass
from typing import Any, ClassVar

from symhbm.balance.goals.goal import ContactSymbols, OfContacts
from symhbm.model import Structure
from symhbm.model.contacts import NormalLaw


@dataclass(frozen=True, repr=False)
class MeanNormalForce(OfContacts):
    """Normal force in the mean over a cycle [N], of contacts with a normal direction.

    Attributes
    ----------
    group
        The name of a group of contacts, all of them by default, whose forces are summed. Of a
        `symhbm.Sector` they are those of one sector, as in its results.
    contact
        The number of one contact within the group.

    Examples
    --------
    A stop that a blade strikes, at the frequency at which it strikes hardest:

    >>> import symhbm as sh
    >>> stop = sh.Gap(normal=[(0,)], normal_stiffness=1e4, gap=2e-4)
    >>> blade = sh.Model([[1]], [[2]], [[1e4]], contacts={"stop": stop})
    >>> problem = sh.HarmonicBalance(
    ...     blade, sh.forces.PointForce(), harmonics=(0, 1, 2, 3),
    ...     peaks_of=sh.goals.MeanNormalForce("stop"),
    ... )
    >>> response = sh.frf(problem, (10, 20), progress=False)
    >>> response.peak_frequency.values.round(4), response.peak_amplitude.values.round(4)
    (array([18.5054]), array([8.7654]))
    """

    units: ClassVar[str] = "N"
    meaning: ClassVar[str] = "normal force of contacts in the mean"
    law: ClassVar[type] = NormalLaw

    def check(self, model: Structure, harmonics: tuple[int, ...]) -> None:
        """As of all goals of contacts, and TypeError for contacts that nothing presses."""
        super().check(model, harmonics)
        chosen = [group for group in model.groups if self.group in (None, group.name)]
        if not any(isinstance(group.law, NormalLaw) for group in chosen):
            laws = ", ".join(f"{group.name!r} with {group.law!r}" for group in chosen) or "none"
            raise TypeError(
                f"{self!r}: expected contacts with a normal direction, the structure has {laws}"
            )

    def of(self, contact: ContactSymbols) -> Any:
        """The mean of its force, and what the equilibrium holds of its load."""
        law, at = contact.law, contact.at
        assert isinstance(law, NormalLaw)
        first = law.directions.index("normal") * at.basis.n_components
        mean = contact.force[first + at.basis.component(0)]
        return mean + law.balanced_load(at.frequency, at.values)
