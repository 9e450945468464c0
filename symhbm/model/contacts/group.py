"""Groups of contacts: one law, the degrees of freedom it acts between, and its parameters."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.law import ContactLaw
from symhbm.numerics import check

Ends = tuple[int, ...]
"""One or two degrees of freedom: the first less the second, or less the ground."""


class Contacts:
    """Contacts of one law, given to a model under a name.

    Parameters
    ----------
    law
        The contact law, for example ``symhbm.Coulomb()``.
    pairs : sequence of (dof, dof) or (dof,), one sequence for each direction of the law
        The degrees of freedom of each contact: ``y = x[first] - x[second]``; one alone is
        connected to the ground.
    values : one value or one per contact
        The parameters of the law, all of them.

    Raises
    ------
    TypeError, ValueError, KeyError
        For a law that is none, a parameter that is missing or that the law does not have, or
        directions of different lengths. A model checks degrees of freedom and bounds.

    Examples
    --------
    >>> import symhbm as sh
    >>> shroud = sh.Contacts(
    ...     sh.Coulomb(), [(0, 1)],
    ...     contact_stiffness=1e4, friction_coefficient=0.3, normal_load=20,
    ... )
    >>> root = sh.Contacts(
    ...     sh.Coulomb(), [(0,), (1,)],
    ...     contact_stiffness=1e6, friction_coefficient=0.3, normal_load=500,
    ... )
    >>> model = sh.Model(
    ...     [[1, 0], [0, 1]], [[0.5, 0], [0, 0.5]], [[2e4, 0], [0, 2e4]],
    ...     contacts={"shroud": shroud, "root": root},
    ... )
    >>> model.with_parameters(**{"root.normal_load": 400}).parameters["root.normal_load"]
    array([400., 400.])
    """

    def __init__(self, law: ContactLaw, *pairs: Iterable[Any], **values: Any):
        if not isinstance(law, ContactLaw):
            raise TypeError(f"law={check.shown(law)}: expected a contact law, as symhbm.Coulomb()")
        for name in law.parameters:
            if not is_name(name):
                raise ValueError(
                    f"law={law!r}: {name!r} is no name of a parameter; letters, digits and single _"
                )
        law.check()
        if len(pairs) != len(law.directions):
            raise ValueError(
                f"pairs: expected one sequence of pairs for each direction of {law!r}, "
                f"{', '.join(law.directions)}, got {len(pairs)}"
            )
        for name in values:
            check.known(name, dict.fromkeys(law.parameters), f"parameter of {law!r}")
        missing = [name for name in law.parameters if values.get(name) is None]
        if missing:
            raise ValueError(f"{', '.join(missing)}: expected a value, {law!r} needs it")
        self.law, self.values = law, values
        self.pairs = tuple(map(check_pairs, pairs))
        lengths = {len(of_direction) for of_direction in self.pairs}
        if len(lengths) > 1:
            raise ValueError(f"pairs: expected as many in each direction, got {lengths}")

    def __len__(self) -> int:
        return len(self.pairs[0])

    def __repr__(self) -> str:
        values = "".join(f", {name}={value}" for name, value in self.values.items())
        return f"Contacts({self.law!r}, {len(self)} contacts{values})"


class Group(NamedTuple):
    """A group of contacts in a structure.

    Its ``name``; ``contacts`` (n,), their numbers among all contacts; ``rows`` (n, m), their
    displacements among those of all; ``parameters``, what each of the law is called in the
    structure.
    """

    name: str
    law: ContactLaw
    contacts: NDArray[np.intp]
    rows: NDArray[np.intp]
    parameters: dict[str, str]

    @property
    def n(self) -> int:
        """Number of contacts."""
        return len(self.contacts)


def check_pairs(contacts: Any, n_dof: int | None = None) -> tuple[Ends, ...]:
    """Pairs among ``n_dof`` degrees of freedom; TypeError or ValueError for what is none."""
    highest = None if n_dof is None else n_dof - 1
    if isinstance(contacts, (str, bytes)) or not isinstance(contacts, Iterable):
        raise TypeError(f"contacts={check.shown(contacts)}: expected a sequence of DOF pairs")
    result = []
    for j, dofs in enumerate(contacts):
        # A number may be meant for a contact to the ground, or for half of the only contact.
        if not isinstance(dofs, Iterable):
            raise TypeError(
                f"contacts[{j}]={check.shown(dofs)}: expected (first, second), as in [(0, 1)], or "
                "(dof,) for a contact to the ground"
            )
        pair = tuple(dofs)
        if len(pair) not in (1, 2):
            raise ValueError(f"contacts[{j}]={check.shown(dofs)}: expected one or two DOFs")
        pair = tuple(check.integer(f"contacts[{j}]", dof, 0, highest) for dof in pair)
        if len(set(pair)) != len(pair):
            raise ValueError(
                f"contacts[{j}]={check.shown(dofs)}: a contact joins two different DOFs"
            )
        result.append(pair)
    return tuple(result)


def is_name(name: object) -> bool:
    """Whether a group or a parameter may be called so: inputs and files have them in their own."""
    text = str(name)
    return text.isidentifier() and "__" not in text and not text.startswith("_")


def named(groups: Mapping[str, Iterable[str]]) -> dict[str, dict[str, str]]:
    """What the parameters of each group are called: by their name alone where one group has it."""
    owners = Counter(name for parameters in groups.values() for name in parameters)
    return {
        group: {name: name if owners[name] == 1 else f"{group}.{name}" for name in parameters}
        for group, parameters in groups.items()
    }
