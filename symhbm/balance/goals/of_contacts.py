"""Goals that are sums over contacts: of a group, of all, or of one of a group."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from symhbm.balance.goals.goal import ContactSymbols, Goal, Solution
from symhbm.model import Structure
from symhbm.model.contacts import ContactLaw
from symhbm.numerics import check


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
