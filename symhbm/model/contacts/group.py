"""Groups of contacts: one law, the relative displacements it acts on, and its parameters.

Directions are ``y = w^T x`` of pairs of places, or by weights. Numbers of degrees of freedom, or
names of their places, come in tuples, weights in mappings or in arrays of two dimensions. A flat
list of numbers could be either and is refused.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.motions import Parameter
from symhbm.model.places import NextSector, Place, check_place
from symhbm.model.records import Record
from symhbm.numerics import FloatArray, check

_AS_WRITTEN = (
    "expected (first, second), as in [(0, 1)] or [('tip:y', 'shroud:y')], or (dof,) for a contact "
    "to the ground, or weights, as in [{0: 1.0, 1: -0.5}]"
)


@dataclass(frozen=True, repr=False)
class Weights(Record):
    """A displacement ``y = sum_i weights[i] x[dofs[i]]``, ``dofs`` ascending, weights not 0."""

    dofs: tuple[int, ...]
    weights: tuple[float, ...]

    def __repr__(self) -> str:
        return repr(dict(zip(self.dofs, self.weights, strict=True)))


Ends = tuple[int, ...] | Weights
"""One degree of freedom less the ground, the first less the second of two, or weights of any."""
Named = tuple[Place, ...] | Mapping[Place, float]
"""The same with names among the degrees of freedom, which a structure makes numbers of."""


class Directions(NamedTuple):
    """One direction of several contacts, and the number of degrees of freedom if known."""

    ends: tuple[Any, ...]
    n_dof: int | None = None

    def among(self, name: str, n_dof: int, number_of: Callable[[Place], int]) -> tuple[Ends, ...]:
        """The directions among ``n_dof`` degrees of freedom, by numbers.

        Raises ValueError, which calls the argument ``name``, for what is none among them, and
        KeyError for unknown names.
        """
        if self.n_dof not in (None, n_dof):
            raise ValueError(
                f"{name}: expected an array of {n_dof} columns (one per degree of freedom), got "
                f"{self.n_dof}"
            )
        result = []
        for j, ends in enumerate(self.ends):
            of_one = f"{name}[{j}]"
            if not isinstance(ends, Weights):
                ends = _numbered(of_one, ends, number_of)
            for dof in weights_of(ends)[0]:
                check.integer(of_one, dof, 0, n_dof - 1)
            result.append(ends)
        return tuple(result)


def check_directions(name: str, given: Any, alone: bool = False) -> Directions:
    """The directions of several contacts, of one where it may stand ``alone``.

    TypeError or ValueError, which call the argument ``name``, for what is none.
    """
    if sp.issparse(given) or isinstance(given, np.ndarray):
        return _of_array(name, given)
    if alone and (
        isinstance(given, (Mapping, Weights))
        or (isinstance(given, tuple) and given and not isinstance(given[0], _SEVERAL))
    ):
        return Directions((_one(name, given),))
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        # A group is no sequence: without a name it would be taken for places.
        hint = '; a group has a name, as in {"damper": group}' if hasattr(given, "law") else ""
        raise TypeError(
            f"{name}={check.shown(given)}: expected a sequence of DOF pairs or weights{hint}"
        )
    return Directions(tuple(_one(f"{name}[{j}]", ends) for j, ends in enumerate(given)))


def weights_of(ends: Ends) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """Degrees of freedom of a displacement and their weights."""
    if isinstance(ends, Weights):
        return ends.dofs, ends.weights
    return ends, (1.0, -1.0)[: len(ends)]


def renumbered(ends: Any, number: Callable[[int], int]) -> Any:
    """Ends of a displacement, or of several in tuples, with other numbers of the same places."""
    if isinstance(ends, Weights):
        pairs = sorted(zip(map(number, ends.dofs), ends.weights, strict=True))
        return Weights(*zip(*pairs, strict=True))  # type: ignore[arg-type]
    if isinstance(ends, tuple):
        return tuple(renumbered(end, number) for end in ends)
    return number(ends)


_SEVERAL = (tuple, list, Mapping, Weights, np.ndarray)
"""What a direction may be, or be meant for."""


def _numbered(name: str, named: Named, number_of: Callable[[Place], int]) -> Ends:
    """Ends with numbers for names; KeyError, which calls them ``name``, for those of no place."""
    if all(isinstance(place, int) for place in named):
        return named  # type: ignore[return-value]
    try:
        dofs = [number_of(place) for place in named]
    except KeyError as error:
        raise KeyError(f"{name}: {error.args[0]}") from None
    if isinstance(named, tuple):
        return _one(name, tuple(dofs))
    if len(set(dofs)) < len(dofs):
        raise ValueError(f"{name}={check.shown(dict(named))}: expected each place once")
    return _one(name, dict(zip(dofs, named.values(), strict=True)))


def _one(name: str, given: Any) -> Any:
    if isinstance(given, Weights):
        return given
    if isinstance(given, Mapping):
        return _of_weights(name, given)
    if isinstance(given, tuple):
        return _of_pair(name, given)
    # A number may be meant for a contact to the ground, or for half of the only contact.
    raise TypeError(f"{name}={check.shown(given)}: {_AS_WRITTEN}")


def _of_pair(name: str, given: tuple) -> tuple[Place, ...]:
    if len(given) not in (1, 2):
        raise ValueError(f"{name}={check.shown(given)}: expected one or two DOFs, or a mapping")
    pair = tuple(_place(name, dof) for dof in given)
    if len(set(pair)) != len(pair):
        raise ValueError(f"{name}={check.shown(given)}: a contact joins two different DOFs")
    return pair


def _of_weights(name: str, given: Mapping) -> Any:
    dofs = [_place(f"{name}={check.shown(given)}, degree of freedom", dof) for dof in given]
    weights = [check.scalar(f"{name}[{dof}]", weight) for dof, weight in given.items()]
    if not all(weights) or not weights:
        raise ValueError(
            f"{name}={check.shown(given)}: expected weights that are not 0, one or more"
        )
    if not all(isinstance(dof, int) for dof in dofs):
        return dict(zip(dofs, weights, strict=True))
    return _simplest(dofs, weights)


def _of_array(name: str, given: Any) -> Directions:
    """The rows of an array (n, n_dof)."""
    if given.ndim != 2:
        raise TypeError(f"{name}={check.shown(given)}: {_AS_WRITTEN}, or an array (n, n_dof)")
    if given.dtype.kind in "iu" and given.shape[1] <= 2:
        raise TypeError(
            f"{name}={check.shown(given)}: expected list(map(tuple, array)) for numbers of degrees "
            "of freedom, or array.astype(float) for weights, which integers could both be"
        )
    entries = given.data if sp.issparse(given) else given
    check.array(name, entries)
    rows = sp.csr_array(given, dtype=float, copy=True)
    rows.sum_duplicates()
    rows.eliminate_zeros()
    ends = []
    for j, (first, last) in enumerate(zip(rows.indptr[:-1], rows.indptr[1:], strict=True)):
        if first == last:
            raise ValueError(f"{name}[{j}]: expected weights that are not all 0")
        ends.append(_simplest(rows.indices[first:last].tolist(), rows.data[first:last].tolist()))
    return Directions(tuple(ends), given.shape[1])


def _simplest(dofs: list[int], weights: list[float]) -> Ends:
    """Weights of 1 and -1 are those of a pair, so that both are the same contact."""
    if weights == [1.0] or sorted(weights) == [-1.0, 1.0]:
        return tuple(dof for _, dof in sorted(zip(weights, dofs, strict=True), reverse=True))
    pairs = sorted(zip(dofs, weights, strict=True))
    return Weights(*zip(*pairs, strict=True))  # type: ignore[arg-type]


def _place(name: str, given: Any) -> Any:
    """A degree of freedom, of this sector or of the next."""
    return given if isinstance(given, NextSector) else check_place(name, given)


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
        check.instance("law", law, ContactLaw, "a contact law, as symhbm.laws.Coulomb()")
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
    structure; ``values``, those of the parameters by the names of the law, (n,) each.
    """

    name: str
    law: ContactLaw
    contacts: NDArray[np.intp]
    rows: NDArray[np.intp]
    parameters: dict[str, str]
    values: dict[str, FloatArray]

    @property
    def n(self) -> int:
        """Number of contacts."""
        return len(self.contacts)

    @property
    def acts(self) -> bool:
        """Whether any of the contacts does something."""
        return bool(self.law.acts(self.values).any())

    def with_values(self, values: Mapping[str, Any]) -> Group:
        """The group with other values, one or one per contact, raises ValueError for bad ones."""
        checked = {
            own: check.one_or_each(
                self.parameters[own], value, self.n, "contact", self.law.parameters[own].bound
            )
            for own, value in values.items()
        }
        return self._replace(values=self.values | checked)


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
