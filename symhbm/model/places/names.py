"""Names and numbers of places, and of those of the next sector, as users give them.

A place is one degree of freedom: a number, or a text of a label or a node and a direction, as in
``"tip:y"`` or ``"1207:y"``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.numerics import check

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz", "radial", "tangential", "axial")
"""Directions of degrees of freedom: along and about the axes, or those of a cylinder."""
RELATIVE = "relative"
"""Direction of what is no degree of freedom but a displacement of a contact."""
Place = int | str
"""One degree of freedom, by its number or its name."""


def node_numbers(name: str, given: Any) -> NDArray[np.int64]:
    """Numbers of nodes, at least one dimension; ValueError for what is no integer."""
    numbers = np.atleast_1d(check.array(name, given))
    if np.any(numbers != np.round(numbers)):
        raise ValueError(f"{name}={check.shown(given)}: expected integers, the numbers of nodes")
    return numbers.astype(np.int64)


def texts(name: str, value: Any, n: int) -> NDArray:
    """A column of so many texts, one text for all; TypeError or ValueError for others."""
    column = np.full(n, value) if isinstance(value, str) else np.asarray(value)
    of_texts = column.dtype.kind == "U" or (
        column.dtype.kind == "O" and all(isinstance(text, str) for text in column.flat)
    )
    if not of_texts:
        raise TypeError(f"{name}={check.shown(value)}: expected text")
    if column.shape != (n,):
        raise ValueError(f"{name}: expected {n} texts (one per DOF), got shape {column.shape}")
    return column.astype(str)


def check_name(name: str, place: str) -> str:
    """The name of a place; TypeError, which calls the argument ``name``, for what is none."""
    if place.count(":") != 1 or not all(map(str.strip, place.split(":"))):
        raise TypeError(
            f"{name}={place!r}: expected a number, or a label or a node and a direction, as 'tip:y'"
        )
    return place


def check_place(name: str, place: object) -> Any:
    """A number of a degree of freedom, or its name, which a structure may know."""
    return check_name(name, place) if isinstance(place, str) else check.integer(name, place, 0)


@dataclass(frozen=True, repr=False)
class NextSector:
    """A degree of freedom of the next sector of a disk, see `next_sector`."""

    place: Any

    def __repr__(self) -> str:
        return f"next_sector({self.place!r})"


def next_sector(place: Any) -> NextSector:
    """A place of the next sector of a disk, for the contacts of a `symhbm.Sector`.

    ``place`` is the name of the degree of freedom in this sector. Its motion has the axes of this
    sector: where directions are cartesian, those of the first one.

    Examples
    --------
    A contact between a place of each sector and another one of the next:

    >>> import symhbm as sh
    >>> shroud = sh.Friction(
    ...     tangential=(3, sh.next_sector(5)),
    ...     contact_stiffness=1e4, friction_coefficient=0.3, normal_load=10,
    ... )
    """
    if isinstance(place, NextSector):
        raise TypeError(f"place={place!r}: expected a place of this sector")
    return NextSector(check_place("place", place))


def number_of(places: Any, place: Place, n_dof: int) -> int:
    """The number of a place among ``n_dof``; raises as `Structure.number_of`."""
    if not isinstance(place, str):
        return check.integer("degree of freedom", place, 0, n_dof - 1)
    if places is None:
        raise KeyError(f"{place!r} is no place, the structure has none; give it places=")
    return places.number(place)


def own_numbers(name: str, structure: Any, dofs: Any) -> NDArray[np.intp]:
    """Degrees of freedom of a structure by number or by name, ascending.

    Of a disk of mistuned sectors the numbers are its own; names are those of the whole disk.
    """
    if isinstance(dofs, (str, bytes)) or not isinstance(dofs, Iterable):
        raise TypeError(f"{name}={check.shown(dofs)}: expected a sequence of degrees of freedom")
    n_sectors = getattr(structure, "n_sectors", None)
    count = structure.n_whole if n_sectors is not None else structure.n_dof

    def number(place: Any) -> int:
        if not isinstance(place, str):
            return check.integer(name, place, 0, count - 1)
        number = structure.number_of(place)
        if n_sectors is not None or structure.kept is None:
            return number
        own = np.flatnonzero(structure.kept == number)
        if not own.size:
            raise ValueError(
                f"{name}: expected degrees of freedom that are kept, {place!r} is not; those at "
                "the right interface of a sector have twins at the left one"
            )
        return int(own[0])

    return np.array(sorted({number(place) for place in dofs}), dtype=np.intp)


def check_whole(name: str, structure: Any) -> None:
    """Raise ValueError for a structure that is reduced already: its modes are no places."""
    if structure.reduced_from is not None:
        raise ValueError(
            f"{name}: expected a whole structure, this one is reduced from "
            f"{structure.reduced_from} degrees of freedom; give that one, with all places= to keep"
        )
