"""Systems of units of finite-element programs, and what makes SI of them."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from symhbm.model.files.contents import Contents
from symhbm.model.places import Places
from symhbm.numerics import check

_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
_MASSES = {"kg": 1.0, "g": 1e-3, "t": 1e3, "lbm": 0.45359237, "slug": 14.593902937206}
_TIMES = {"s": 1.0, "ms": 1e-3}
_POUND = 4.4482216152605
"""Force of a pound [N], by which ``in-lbf-s`` has masses of lbf s^2/in."""
_POWERS = {"mass": 0, "damping": 1, "stiffness": 2}
"""Powers of time below which a matrix has a mass."""
ROTATIONS = ("rx", "ry", "rz")


class Units(NamedTuple):
    """A length [m], a mass [kg] and a time [s]."""

    length: float
    mass: float
    time: float


def units_of(name: str) -> Units:
    """Units by length, mass and time, as ``"mm-t-s"``; ValueError for unknown ones."""
    parts = name.split("-") if isinstance(name, str) else []
    expected = [*_LENGTHS], [*_MASSES, "lbf"], [*_TIMES]
    if len(parts) != 3 or any(p not in known for p, known in zip(parts, expected, strict=True)):
        allowed = ", ".join("|".join(each) for each in expected)
        raise ValueError(
            f"units={check.shown(name)}: expected length-mass-time, as 'mm-t-s' or 'mm-kg-ms', "
            f"of {allowed}"
        )
    length, time = _LENGTHS[parts[0]], _TIMES[parts[2]]
    mass = _POUND * time**2 / length if parts[1] == "lbf" else _MASSES[parts[1]]
    return Units(length, mass, time)


def in_si(contents: Contents, units: Units) -> Contents:
    """The same matrices in kg, N s/m and N/m, those of rotations in kg m^2 and so on."""
    places = contents.places
    turns = None if places is None else np.isin(places.direction, ROTATIONS)
    matrices = {}
    for kind, matrix in contents.matrices.items():
        factor = units.mass / units.time ** _POWERS[kind]
        if turns is not None and turns.any():
            scale = sp.diags_array(np.where(turns, units.length, 1.0))
            matrices[kind] = sp.csc_array(factor * (scale @ matrix @ scale))
        else:
            matrices[kind] = matrix * factor
    if places is not None and places.coordinates is not None:
        coordinates = units.length * places.coordinates
        places = Places(places.node, places.direction, coordinates, places.label)
    return contents._replace(matrices=matrices, places=places)
