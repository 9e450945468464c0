"""The contacts of a structure, group by group, and what all of them tell together.

Contacts come from their directions or from groups by name.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.contacts.group import (
    Contacts,
    Ends,
    Group,
    check_directions,
    is_name,
    named,
    renumbered,
    weights_of,
)
from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.motions import Parameter, SpringSliders, Values
from symhbm.model.places import Place, Places
from symhbm.numerics import FloatArray, check

TRANSLATIONS = ("x", "y", "z", "radial", "tangential", "axial")
_ANGLE = 1e-3
"""Cosine of two directions that is none but for the digits they are given with."""


class SliderContacts(NamedTuple):
    """Contacts that are a spring in series with a slider, (n,) each.

    Their numbers ``contact`` among all contacts and ``row`` among all displacements, their
    ``stiffness`` [N/m] and ``limit`` [N].
    """

    contact: NDArray[np.intp]
    row: NDArray[np.intp]
    stiffness: FloatArray
    limit: FloatArray

    @classmethod
    def of(cls, valued: Iterable[tuple[Any, Values]], frequency: float) -> SliderContacts:
        """Those of groups with their values, at a frequency [rad/s]."""
        parts = [(*np.zeros((2, 0), dtype=int), *np.zeros((2, 0)))]
        for group, values in valued:
            sliders = group.law.sliders(frequency, values)
            if sliders is not None:
                parts.append((group.contacts, group.rows[:, 0], *sliders))
        return cls(*map(np.concatenate, zip(*parts, strict=True)))


class SpringSliderContacts(NamedTuple):
    """Contacts that are springs and sliders, (n,) each.

    Their numbers ``contact`` among all contacts, those of their ``tangential`` displacements, of
    those ``across`` and ``normal`` to them among all, -1 without one, and what they are, as
    `SpringSliders`.
    """

    contact: NDArray[np.intp]
    tangential: NDArray[np.intp]
    across: NDArray[np.intp]
    normal: NDArray[np.intp]
    sliders: SpringSliders


class ContactGroups(tuple[Group, ...]):
    """Groups of contacts of a structure, with the values of their parameters.

    ``ends`` are those of each contact, ``row_ends`` those of each displacement.
    """

    ends: tuple[Any, ...]
    row_ends: tuple[Ends, ...]

    def __new__(cls, ends: Any, row_ends: Any, groups: Iterable[Group]) -> ContactGroups:
        """As any tuple, of the groups."""
        made = super().__new__(cls, groups)
        made.ends, made.row_ends = ends, row_ends
        return made

    def __getnewargs__(self) -> tuple[Any, Any, tuple[Group, ...]]:
        return self.ends, self.row_ends, tuple(self)

    @classmethod
    def of(
        cls,
        n_dof: int,
        contacts: Any,
        parameters: Mapping[str, Any],
        short: Mapping[str, ContactLaw],
        number_of: Callable[[Place], int],
        places: Places | None = None,
    ) -> ContactGroups:
        """The contacts of a structure of ``n_dof`` degrees of freedom; raises as `symhbm.Model`.

        Those without names are all of the laws ``short``; ``number_of`` gives the numbers of its
        ``places``.
        """
        if isinstance(contacts, Mapping):
            return _by_name(n_dof, contacts, parameters, number_of, places)
        ends = check_directions("contacts", contacts).among("contacts", n_dof, number_of)
        given = {name: parameters.get(name) for law in short.values() for name in law.parameters}
        if ends:
            _check_complete(given, short["friction"].parameters)
        names = named({name: law.parameters for name, law in short.items()})
        every = np.arange(len(ends))
        groups = []
        for name, law in short.items():
            values = {own: 0.0 if given[own] is None else given[own] for own in law.parameters}
            group = Group(name, law, every, every[:, None], names[name], {})
            groups.append(group.with_values(values))
        return cls(ends, ends, groups)

    @cached_property
    def owners(self) -> dict[str, tuple[int, str]]:
        """By the name of each parameter the number of its group, and its name in the law."""
        return {
            name: (number, own)
            for number, group in enumerate(self)
            for own, name in group.parameters.items()
        }

    def owner(self, name: str) -> Group:
        """The group that a parameter belongs to."""
        return self[self.owners[name][0]]

    @property
    def values(self) -> dict[str, FloatArray]:
        """The values of all parameters by name."""
        return {name: self[number].values[own] for name, (number, own) in self.owners.items()}

    @property
    def attributes(self) -> dict[str, Any]:
        """What a structure stores of them."""
        return {"groups": self, "contacts": self.ends} | self.values

    def with_value(self, name: str, value: Any) -> ContactGroups:
        """The same with another value of a parameter, or one for each contact; ValueError for bad.

        What follows from the contacts alone is shared.
        """
        number, own = self.owners[name]
        groups = [*self]
        groups[number] = groups[number].with_values({own: value})
        return self._with(groups)

    def at(self, speed: float) -> ContactGroups:
        """The same at a speed of rotation [1/min], which presses some."""
        return self._with(group._replace(law=group.law.at(speed)) for group in self)

    def _with(self, groups: Iterable[Group]) -> ContactGroups:
        other = ContactGroups(self.ends, self.row_ends, groups)
        vars(other).update(vars(self))
        return other

    def renumbered(self, number: Callable[[int], int]) -> ContactGroups:
        """The same with another number of each degree of freedom."""
        ends, row_ends = (renumbered(each, number) for each in (self.ends, self.row_ends))
        return ContactGroups(ends, row_ends, self)

    @cached_property
    def dims(self) -> dict[str, tuple[str, ...]]:
        """Dimensions of the values of each parameter in a dataset."""
        return {
            name: ("contact",) if group.n == len(self.ends) else (f"{group.name}_contact",)
            for group in self
            for name in group.parameters.values()
        }

    @property
    def records(self) -> dict[str, Parameter]:
        """What the parameters are."""
        result = {}
        for group in self:
            for own, name in group.parameters.items():
                record = group.law.parameters[own]
                of_group = record._replace(meaning=f"{record.meaning}, {group.name}")
                result[name] = record if own == name else of_group
        return result

    def are(self, laws: Mapping[str, ContactLaw]) -> bool:
        """Whether all contacts are in each of the groups of these laws by name."""
        own = {group.name: group.law for group in self}
        return own == laws and all(group.n == len(self.ends) for group in self)

    @cached_property
    def rows(self) -> list[NDArray[np.intp]]:
        """Numbers of the displacements of each contact."""
        rows = {j: row for g in self for j, row in zip(g.contacts.tolist(), g.rows, strict=True)}
        return [rows[j] for j in range(len(self.ends))]

    def rows_of(self, contacts: NDArray[np.intp]) -> NDArray[np.intp]:
        """Numbers of the displacements of some contacts, one contact after the other."""
        rows = [self.rows[j] for j in contacts.tolist()]
        return np.concatenate([np.zeros(0, dtype=int), *rows])

    def directions(self, n_dof: int) -> sp.csr_array:
        """Directions ``w`` of all displacements as rows, (n_rows, n_dof)."""
        each = [weights_of(ends) for ends in self.row_ends]
        rows = [j for j, (dofs, _) in enumerate(each) for _ in dofs]
        columns = [dof for dofs, _ in each for dof in dofs]
        values = [weight for _, weights in each for weight in weights]
        return sp.csr_array((values, (rows, columns)), shape=(len(each), n_dof))

    def sliders(self, frequency: float) -> SliderContacts:
        """All contacts that are a spring in series with a slider, at a frequency [rad/s]."""
        return SliderContacts.of(((group, group.values) for group in self), frequency)

    def spring_sliders(self, frequency: float) -> SpringSliderContacts:
        """All contacts that are springs and sliders, at a frequency [rad/s]."""
        parts, values = [np.zeros((4, 0), dtype=int)], [np.zeros((len(SpringSliders._fields), 0))]
        for group in self:
            sliders = group.law.spring_sliders(frequency, group.values)
            if sliders is None:
                continue
            names = group.law.directions
            if len(names) == 1 and names != ("normal",):
                names = ("tangential",)
            rows = [
                group.rows[:, names.index(name)] if name in names else np.full(group.n, -1)
                for name in ("tangential", "across", "normal")
            ]
            parts.append(np.array([group.contacts, *rows]))
            values.append(np.array(sliders))
        joined = SpringSliders(*np.concatenate(values, axis=1))
        contact, tangential, across, normal = np.concatenate(parts, axis=1)
        return SpringSliderContacts(contact, tangential, across, normal, joined)

    def many_valued(self, moving: Collection[str] = ()) -> bool:
        """Whether there may be several responses, if damping dissipates.

        Whatever the values of parameters are that are ``moving``.
        """
        for group in self:
            if group.n and not group.law.monotone(group.values):
                moves = not {*moving}.isdisjoint(group.parameters.values())
                if moves or group.acts:
                    return True
        return False

    @property
    def odd(self) -> bool:
        """Whether they answer the opposite motion with the opposite force."""
        return all(group.law.odd for group in self if group.n)

    @property
    def bounded(self) -> bool:
        """Whether their stiffness has a bound, that of all of them stuck."""
        return all(np.isfinite(group.law.stiffest(group.values)).all() for group in self)

    @property
    def stiffest_springs(self) -> FloatArray:
        """Largest stiffness that contacts may have, where that has a bound, (n_rows,) [N/m]."""
        return self._along_rows([g.law.stiffest(g.values)[:, None] for g in self])

    @property
    def stuck_springs(self) -> FloatArray:
        """Stiffness along displacements with contacts stuck and closed, (n_rows,) [N/m]."""
        return self._along_rows([group.law.stuck_stiffness(group.values) for group in self])

    def _along_rows(self, of_groups: Sequence[FloatArray]) -> FloatArray:
        result = np.zeros(len(self.row_ends))
        for group, stiffness in zip(self, of_groups, strict=True):
            finite = np.where(np.isfinite(stiffness), stiffness, 0.0)
            np.add.at(result, group.rows, np.broadcast_to(finite, group.rows.shape))
        return result

    @property
    def holding_rows(self) -> NDArray[np.intp]:
        """Displacements in which they hold a structure in the mean, whatever slips."""
        # Laws tell it of contacts, or one by one.
        rows = [group.rows[group.law.holds(group.values)].ravel() for group in self]
        return np.unique(np.concatenate([np.zeros(0, dtype=int), *rows]))


def _by_name(
    n_dof: int,
    contacts: Mapping,
    parameters: Mapping[str, Any],
    number_of: Callable[[Place], int],
    places: Places | None,
) -> ContactGroups:
    """Groups by name, whose values are their own."""
    given = [name for name, value in parameters.items() if value is not None]
    if given:
        raise ValueError(
            f"{', '.join(given)}: expected the values of named groups with each group, as in "
            "symhbm.Contacts(law, directions, ...)"
        )
    for name, group in contacts.items():
        words = "symhbm.Contacts(law, directions, ...)"
        check.instance(f"contacts[{name!r}]", group, Contacts, words)
        if not is_name(name):
            raise ValueError(f"contacts: {name!r} is no name; letters, digits and single _")
    names = named({name: group.law.parameters for name, group in contacts.items()})
    every, rows, groups = [], [], []
    for name, group in contacts.items():
        ends_of = [
            given.among(f"contacts[{name!r}], {direction}", n_dof, number_of)
            for direction, given in group.directions.items()
        ]
        together = list(zip(*ends_of, strict=True))
        if {"tangential", "across"} <= {*group.directions}:
            both = dict(zip(group.directions, ends_of, strict=True))
            for j, pair in enumerate(zip(both["tangential"], both["across"], strict=True)):
                _check_plane(f"contacts[{name!r}], across[{j}]", *pair, places)
        m = len(group.directions)
        of_rows = len(rows) + np.arange(len(together) * m).reshape(-1, m)
        of_contacts = len(every) + np.arange(len(together))
        made = Group(name, group.law, of_contacts, of_rows, names[name], {})
        groups.append(made.with_values(group.values))
        every += [ends[0] if m == 1 else ends for ends in together]
        rows += [end for ends in together for end in ends]
    return ContactGroups(tuple(every), tuple(rows), groups)


def _check_plane(name: str, tangential: Ends, across: Ends, places: Places | None) -> None:
    """Raise ValueError for a direction that is along another one, or not at a right angle to it.

    The angle is known at nodes with displacements along three axes: others may be held along one,
    and what has no places may be the coordinate of a mode.
    """
    one, other = (dict(zip(*weights_of(ends), strict=True)) for ends in (tangential, across))
    groups = [[*one.keys() | other.keys()]]
    if places is not None:
        # The two directions of one node, of this sector or of the next.
        of_node: dict[tuple[int, int], list[int]] = {}
        for dof in groups[0]:
            beyond, own = divmod(dof, places.n_dof)
            if places.direction[own] in TRANSLATIONS:
                of_node.setdefault((beyond, int(places.node[own])), []).append(dof)
        groups += [
            dofs
            for (_, node), dofs in of_node.items()
            if sum(way in TRANSLATIONS for way in places.direction[places.dofs_of(node)]) == 3
        ]
    for j, dofs in enumerate(groups):
        along = np.array([one.get(dof, 0.0) for dof in dofs])
        beside = np.array([other.get(dof, 0.0) for dof in dofs])
        size = float(np.linalg.norm(along) * np.linalg.norm(beside))
        cosine = abs(float(along @ beside)) / size if size else 0.0
        if cosine > (_ANGLE if j else 1 - _ANGLE):
            raise ValueError(
                f"{name}: expected a direction at a right angle to tangential, got one at "
                f"{np.degrees(np.arccos(min(cosine, 1.0))):.3g} degrees"
            )


def _check_complete(values: dict[str, Any], of_friction: Iterable[str]) -> None:
    """Raise ValueError for contacts that do nothing since a parameter was forgotten."""
    given = [name for name in of_friction if values[name] is not None]
    missing = [name for name in of_friction if name not in given]
    if not missing or (not given and values["cubic_stiffness"] is not None):
        return
    spring = given == ["contact_stiffness"]
    raise ValueError(
        f"{', '.join(f'{name}=None' for name in missing)}: expected contact_stiffness, "
        "friction_coefficient and normal_load for friction (an explicit 0 for contacts that "
        "slide freely), or cubic_stiffness alone for cubic springs; without them contacts do "
        "nothing" + ("; a linear spring is a part of stiffness_matrix" if spring else "")
    )
