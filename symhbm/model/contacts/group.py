"""Groups of contacts: one law, the degrees of freedom it acts between, and its parameters."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.directions import Directions, check_directions
from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.parameter import Parameter
from symhbm.numerics import check


class Contacts:
    """Contacts of one law, given to a model under a name.

    Parameters
    ----------
    law
        The contact law, for example ``symhbm.laws.Coulomb()``.
    directions : one for each direction of the law, in their order or by their names
        Where contacts act, ``y = w^T x``. ``(first, second)`` is ``x[first] - x[second]``,
        ``(dof,)`` connects to the ground, ``{dof: weight}`` has any weights: one of them, or a
        sequence with one for each contact. For many contacts, an array (n, n_dof) of weights, dense
        or `scipy.sparse`.
    values : one value or one per contact
        The parameters of the law, all of them.

    Raises
    ------
    TypeError, ValueError, KeyError
        For a law that is none, a parameter that is missing or that the law does not have, for
        directions of different lengths, and for what is no direction: a list of numbers might be
        degrees of freedom or weights. A model checks degrees of freedom and bounds.

    Examples
    --------
    >>> import symhbm as sh
    >>> shroud = sh.Contacts(
    ...     sh.laws.Coulomb(), [(0, 1)],
    ...     contact_stiffness=1e4, friction_coefficient=0.3, normal_load=20,
    ... )
    >>> root = sh.Contacts(
    ...     sh.laws.Coulomb(), [(0,), (1,)],
    ...     contact_stiffness=1e6, friction_coefficient=0.3, normal_load=500,
    ... )
    >>> model = sh.Model(
    ...     [[1, 0], [0, 1]], [[0.5, 0], [0, 0.5]], [[2e4, 0], [0, 2e4]],
    ...     contacts={"shroud": shroud, "root": root},
    ... )
    >>> model.with_parameters(**{"root.normal_load": 400}).parameters["root.normal_load"]
    array([400., 400.])

    A contact along a line that is inclined by 30 degrees to the first of two degrees of freedom:

    >>> import numpy as np
    >>> inclined = sh.Contacts(
    ...     sh.laws.Coulomb(), {0: np.cos(np.pi / 6), 1: np.sin(np.pi / 6)},
    ...     contact_stiffness=1e4, friction_coefficient=0.3, normal_load=20,
    ... )
    """

    def __init__(self, law: ContactLaw, /, *directions: Any, **values: Any):
        if not isinstance(law, ContactLaw):
            raise TypeError(
                f"law={check.shown(law)}: expected a contact law, as symhbm.laws.Coulomb()"
            )
        for name, about in law.parameters.items():
            if not is_name(name):
                raise ValueError(
                    f"law={law!r}: {name!r} is no name of a parameter; letters, digits and single _"
                )
            if not isinstance(about, Parameter):
                raise TypeError(
                    f"parameters[{name!r}]={check.shown(about)} of {law!r}: expected a "
                    'symhbm.laws.Parameter, as Parameter("N m-1", "what it is")'
                )
        law.check()
        given = _by_name(law, directions, values)
        for name in values:
            check.known(name, dict.fromkeys(law.parameters), f"parameter of {law!r}")
        missing = [name for name in law.parameters if values.get(name) is None]
        if missing:
            raise ValueError(f"{', '.join(missing)}: expected a value, {law!r} needs it")
        self.law, self.values = law, values
        self.directions: dict[str, Directions] = {
            name: check_directions(name, of_direction, alone=True)
            for name, of_direction in given.items()
        }
        lengths = {name: len(each.ends) for name, each in self.directions.items()}
        if len({*lengths.values()}) > 1:
            raise ValueError(f"directions: expected as many in each direction, got {lengths}")

    def __len__(self) -> int:
        return len(next(iter(self.directions.values())).ends)

    def __repr__(self) -> str:
        values = "".join(f", {name}={check.brief(value)}" for name, value in self.values.items())
        return f"Contacts({self.law!r}, {len(self)} contact{'s' * (len(self) != 1)}{values})"


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


def _by_name(law: ContactLaw, given: tuple, values: dict[str, Any]) -> dict[str, Any]:
    """Directions by name: those given in order, and those among the values, which are taken out."""
    for name in law.directions:
        if name in law.parameters:
            raise ValueError(f"law={law!r}: {name!r} names a direction and a parameter")
        if law.directions.count(name) > 1:
            raise ValueError(f"law={law!r}: {name!r} names two directions")
    together = dict(zip(law.directions, given, strict=False))
    named = {name: values.pop(name) for name in law.directions if name in values}
    for name in together.keys() & named.keys():
        raise TypeError(f"{name}: expected once, in the order of the directions or by name")
    together |= named
    if len(given) + len(named) != len(law.directions):
        raise ValueError(
            f"directions: expected one sequence of pairs or weights for each direction of {law!r}, "
            f"{', '.join(law.directions)}, got {len(given) + len(named)}"
        )
    return {name: together[name] for name in law.directions}


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
