"""The states of all contacts of a balance at one point, group by group and switch by switch."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts import Located
from symhbm.numerics import FloatArray


@dataclass(frozen=True)
class ContactStates:
    """Events of all contacts by group.

    Switches are numbered group by group and contact by contact.
    """

    groups: dict[str, Located]

    @cached_property
    def switches(self) -> NDArray[np.bool_]:
        """Whether each switch is on, (n_switches,)."""
        return _joined([located.states for located in self.groups.values()], bool)

    @cached_property
    def margins(self) -> FloatArray:
        """Margins of the switches, (n_switches,)."""
        return _joined([located.margins for located in self.groups.values()], float)

    def split(self, count: int) -> list["ContactStates"]:
        """The events of ``count`` points of as many contacts each."""
        parts = {name: _split(located, count) for name, located in self.groups.items()}
        return [
            ContactStates({name: of_group[i] for name, of_group in parts.items()})
            for i in range(count)
        ]


def _joined(parts: Sequence[np.ndarray], kind: type) -> np.ndarray:
    if len(parts) == 1:
        return parts[0].ravel()
    return np.concatenate([np.zeros(0, kind), *(part.ravel() for part in parts)])


def _split(located: Located, count: int) -> list[Located]:
    """The same contacts at ``count`` points."""
    arrays = [getattr(located, field.name) for field in fields(located) if field.name != "details"]
    details = [None] * count if located.details is None else located.details.split(count)
    parts = zip(*(np.split(array, count) for array in arrays), details, strict=True)
    return [Located(*part) for part in parts]
