"""Degrees of freedom of a structure by the numbers and names that calls give."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.model.places.names import Place
from symhbm.numerics import check


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
