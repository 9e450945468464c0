"""The contacts of a structure, from their directions or from groups by name."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from symhbm.model.contacts import (
    Contacts,
    Coulomb,
    CubicSpring,
    Ends,
    Group,
    check_directions,
    is_name,
    named,
)
from symhbm.model.parameters import CONTACT_PARAMETERS, FRICTION_PARAMETERS
from symhbm.model.places import Place
from symhbm.numerics import check

SHORT = {"friction": Coulomb(), "cubic": CubicSpring()}
"""The groups of contacts that have no names of their own."""


class GroupedContacts(NamedTuple):
    """Contacts of a structure.

    ``contacts`` are the ends of each, ``row_ends`` those of each displacement; ``values`` the
    unchecked values of their parameters by name.
    """

    contacts: tuple[Any, ...]
    row_ends: tuple[Ends, ...]
    groups: tuple[Group, ...]
    values: dict[str, Any]


def grouped(
    n_dof: int,
    contacts: Any,
    parameters: Mapping[str, Any],
    number_of: Callable[[Place], int],
) -> GroupedContacts:
    """The contacts of a structure of ``n_dof`` degrees of freedom; raises as `symhbm.Model`.

    ``number_of`` gives the numbers of its places.
    """
    if isinstance(contacts, Mapping):
        return _by_name(n_dof, contacts, parameters, number_of)
    ends = check_directions("contacts", contacts).among("contacts", n_dof, number_of)
    given = {name: parameters.get(name) for name in CONTACT_PARAMETERS}
    if ends:
        _check_complete(given)
    names = named({name: law.parameters for name, law in SHORT.items()})
    every = np.arange(len(ends))
    groups = [Group(name, law, every, every[:, None], names[name]) for name, law in SHORT.items()]
    values = {name: 0.0 if value is None else value for name, value in given.items()}
    return GroupedContacts(ends, ends, tuple(groups), values)


def _by_name(
    n_dof: int,
    contacts: Mapping,
    parameters: Mapping[str, Any],
    number_of: Callable[[Place], int],
) -> GroupedContacts:
    """Groups by name, whose values are their own."""
    given = [name for name, value in parameters.items() if value is not None]
    if given:
        raise ValueError(
            f"{', '.join(given)}: expected the values of named groups with each group, as in "
            "symhbm.Contacts(law, directions, ...)"
        )
    for name, group in contacts.items():
        if not isinstance(group, Contacts):
            raise TypeError(
                f"contacts[{name!r}]={check.shown(group)}: expected symhbm.Contacts(law, "
                "directions, ...)"
            )
        if not is_name(name):
            raise ValueError(f"contacts: {name!r} is no name; letters, digits and single _")
    names = named({name: group.law.parameters for name, group in contacts.items()})
    every, rows, groups, values = [], [], [], {}
    for name, group in contacts.items():
        ends_of = [
            given.among(f"contacts[{name!r}], {direction}", n_dof, number_of)
            for direction, given in group.directions.items()
        ]
        together = list(zip(*ends_of, strict=True))
        m = len(group.directions)
        of_rows = len(rows) + np.arange(len(together) * m).reshape(-1, m)
        of_contacts = len(every) + np.arange(len(together))
        groups.append(Group(name, group.law, of_contacts, of_rows, names[name]))
        every += [ends[0] if m == 1 else ends for ends in together]
        rows += [end for ends in together for end in ends]
        values |= {names[name][own]: value for own, value in group.values.items()}
    return GroupedContacts(tuple(every), tuple(rows), tuple(groups), values)


def _check_complete(values: dict[str, Any]) -> None:
    """Raise ValueError for contacts that do nothing since a parameter was forgotten."""
    given = [name for name in FRICTION_PARAMETERS if values[name] is not None]
    missing = [name for name in FRICTION_PARAMETERS if name not in given]
    if not missing or (not given and values["cubic_stiffness"] is not None):
        return
    spring = given == ["contact_stiffness"]
    raise ValueError(
        f"{', '.join(f'{name}=None' for name in missing)}: expected contact_stiffness, "
        "friction_coefficient and normal_load for friction (an explicit 0 for contacts that "
        "slide freely), or cubic_stiffness alone for cubic springs; without them contacts do "
        "nothing" + ("; a linear spring is a part of stiffness_matrix" if spring else "")
    )
