"""Named parameters of structures, one table of records, and the groups of contacts that hold some.

The records are read for bounds, labels, sweeps and draws. A new parameter of a contact law is a
record in the file of the law, another one a record here. Contacts come from their directions or
from groups by name.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, NoReturn

import numpy as np

from symhbm.model.contacts import (
    Contacts,
    Coulomb,
    CubicSpring,
    Ends,
    Group,
    Parameter,
    check_directions,
    is_name,
    named,
    weights_of,
)
from symhbm.model.places import Place, Places
from symhbm.numerics import check


def _deviation(of: str, symbol: str) -> Parameter:
    """Record of what tells how far blades deviate from the nominal one."""
    words = f"deviation of the {of}"
    return Parameter("1", words, symbol, "", "blade", "any", "any", deviation=True)


PARAMETERS = {
    "mass": Parameter(
        "kg", "mass of the blade", "$m$", "kg", "dof", "positive", "positive", designed=True
    ),
    "damping": Parameter(
        "N s m-1", "viscous damping of the blade", "$c$", "N s/m", "dof", "any", "any", True
    ),
    "stiffness": Parameter("N m-1", "stiffness of the blade", "$k$", "N/m", "dof", designed=True),
    **Coulomb.parameters,
    **CubicSpring.parameters,
    # A band of forces keeps one sign: with the other, the response is its mirror image.
    "force_amplitude": Parameter(
        "N", "amplitude of the exciting force", "$f_0$", "N", None, bound="any"
    ),
    "stiffness_deviation": _deviation("stiffness of the blade", r"$\Delta k$"),
    "frequency_deviation": _deviation("frequency of the blade alone", r"$\Delta f$"),
    "mass_deviation": _deviation("mass of the blade", r"$\Delta m$"),
    "engine_order": Parameter("1", "engine order", "EO", "", None),
}
BLADE_PARAMETERS = tuple(name for name, about in PARAMETERS.items() if about.per == "dof")
"""Those with one value per degree of freedom, of lumped models."""
FRICTION_PARAMETERS = tuple(Coulomb.parameters)
"""Those of dry friction."""
CONTACT_PARAMETERS = (*FRICTION_PARAMETERS, *CubicSpring.parameters)
"""Those of contacts without a group of their own."""


class ReadOnly(dict[str, Any]):
    """Values of parameters by name. Setting one would change nothing, so that it raises."""

    def __setitem__(self, name: str, value: Any) -> NoReturn:
        raise TypeError(
            f"parameters[{name!r}]: expected with_parameters({name}=...), which gives another "
            "structure or problem with the value; this one stays as it is"
        )

    def __reduce__(self) -> tuple[type, tuple[dict[str, Any]]]:
        return ReadOnly, (dict(self),)  # by default entries would be set one by one


def records_by_name(
    groups: Mapping[str, Mapping[str, Parameter]],
) -> dict[str, Parameter]:
    """Records of the parameters of groups of contacts, by what they are called in a structure."""
    result = {}
    for group, names in named(groups).items():
        for own, name in names.items():
            record = groups[group][own]
            of_group = record._replace(meaning=f"{record.meaning}, {group}")
            result[name] = record if own == name else of_group
    return result


def records_of_blade_modes(count: int) -> dict[str, Parameter]:
    """Records of the deviations of the frequencies of so many modes of the blade alone."""
    return {
        f"frequency_deviation_{mode}": _deviation(
            f"frequency of mode {mode} of the blade alone", rf"$\Delta f_{{{mode}}}$"
        )
        for mode in range(count)
    }


def amplitude_of(units: str, meaning: str) -> dict[str, Parameter]:
    """The record of an amplitude that is no force, by its name."""
    record = PARAMETERS["force_amplitude"]
    return {"force_amplitude": record._replace(units=units, meaning=meaning, unit=units)}


def is_pattern(dim: object) -> bool:
    """Whether a dimension of a dataset runs over degrees of freedom, contacts or blades."""
    return dim in ("dof", "contact", "blade") or str(dim).endswith("_contact")


SHORT = {"friction": Coulomb(), "cubic": CubicSpring()}
"""The groups of contacts that have no names of their own."""
TRANSLATIONS = ("x", "y", "z", "radial", "tangential", "axial")
_ANGLE = 1e-3
"""Cosine of two directions that is none but for the digits they are given with."""


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
    places: Places | None = None,
) -> GroupedContacts:
    """The contacts of a structure of ``n_dof`` degrees of freedom; raises as `symhbm.Model`.

    ``number_of`` gives the numbers of its ``places``.
    """
    if isinstance(contacts, Mapping):
        return _by_name(n_dof, contacts, parameters, number_of, places)
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
    places: Places | None,
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
        if {"tangential", "across"} <= {*group.directions}:
            both = dict(zip(group.directions, ends_of, strict=True))
            for j, pair in enumerate(zip(both["tangential"], both["across"], strict=True)):
                _check_plane(f"contacts[{name!r}], across[{j}]", *pair, places)
        m = len(group.directions)
        of_rows = len(rows) + np.arange(len(together) * m).reshape(-1, m)
        of_contacts = len(every) + np.arange(len(together))
        groups.append(Group(name, group.law, of_contacts, of_rows, names[name]))
        every += [ends[0] if m == 1 else ends for ends in together]
        rows += [end for ends in together for end in ends]
        values |= {names[name][own]: value for own, value in group.values.items()}
    return GroupedContacts(tuple(every), tuple(rows), tuple(groups), values)


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
