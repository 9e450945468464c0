"""What files hold: matrices by name, in what units, and what they tell of degrees of freedom."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from symhbm.model.damping import Damping
from symhbm.model.places import Places
from symhbm.numerics import check

LOOK = "LOOK: "
"""Beginning of a line of an account that is a doubt."""
KINDS = ("mass", "damping", "stiffness")
SHARES = "mass_share", "stiffness_share", "loss"
"""What materials tell of damping."""
_USUAL = {
    "mass": ("mass", "mass_matrix", "m", "maa", "mgg", "mxx"),
    "damping": ("damping", "damping_matrix", "c", "d", "baa", "bgg", "bxx"),
    "stiffness": ("stiffness", "stiffness_matrix", "k", "kaa", "kgg", "kxx"),
}
"""What matrices are called in files of several, in small letters."""


class Contents(NamedTuple):
    """Matrices by kind, sparse, and the places of their rows.

    ``triangle``: the format keeps one triangle of symmetric matrices, as these are. ``beside``:
    names of what else is there and was not read; ``damping``: the rule that damping follows in the
    place of a matrix. Files of a program also tell the `Mesh`, what else the `Program` told, and
    have ``notes``, in words, of what the reader dropped or changed. ``rotation``: the stiffness by
    speed and the matrix of Coriolis forces of a structure that turns.
    """

    matrices: dict[str, Any]
    places: Places | None = None
    triangle: bool = False
    beside: tuple[str, ...] = ()
    damping: Damping | None = None
    mesh: Any = None
    program: Any = None
    notes: tuple[str, ...] = ()
    rotation: tuple[dict[float, Any], Any] | None = None


Reader = Callable[[dict[str, Path], Mapping[str, str]], Contents]
"""Reads files by kind, ``""`` for one with several matrices, whose names are given by kind."""


@contextmanager
def told(path: Path, what: str) -> Iterator[None]:
    """Turn what goes wrong with a file that is damaged or another one into one line."""
    try:
        yield
    except FileNotFoundError:
        raise FileNotFoundError(f"path={str(path)!r}: no such file") from None
    except Exception as error:
        first = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise ValueError(
            f"path={str(path)!r}: truncated, damaged, or no {what} ({first})"
        ) from error


def optional(module: str, what: str, extra: str) -> Any:
    """A module that reads some files; ImportError that tells the extra where it is missing."""
    try:
        return import_module(module)
    except ImportError:
        raise ImportError(f"reading {what} needs more: pip install symhbm[{extra}]") from None


def not_of_mesh(count: Mapping[str, int]) -> list[str]:
    """What is said of elements by type that a mesh leaves out, nothing of none."""
    types = ", ".join(f"{number} {kind}" for kind, number in count.items())
    return [f"no part of the mesh: {types}, which are no solids"] * bool(count)


def by_kind(path: Path, held: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    """The matrices of a file by kind: those named, and those with usual names.

    Raises KeyError for a name that the file does not hold, ValueError for two of one kind.
    """
    result = {}
    for kind in KINDS:
        if kind in names:
            check.known(names[kind], held, f"matrix of {path.name}")
            result[kind] = held[names[kind]]
            continue
        found = [name for name in held if name.lower() in _USUAL[kind]]
        if len(found) > 1:
            raise ValueError(
                f"path={str(path)!r}: expected one {kind} matrix, got {', '.join(found)}; "
                f"names={{{kind!r}: ...}} tells which"
            )
        if found:
            result[kind] = held[found[0]]
    if not result:
        raise ValueError(
            f"path={str(path)!r}: expected matrices called M, C and K, it holds "
            f"{', '.join(held) or 'none'}; names= tells which they are"
        )
    return result


def beside(held: Mapping[str, Any], taken: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the square matrices of a file that are as large as those taken, and not of them."""
    shapes = {np.shape(matrix) for matrix in taken.values()}
    own = {*map(id, taken.values())}
    return tuple(n for n, each in held.items() if np.shape(each) in shapes and id(each) not in own)


def contents_of(
    path: Path,
    held: Mapping[str, Any],
    names: Mapping[str, str],
    places: Places | None = None,
    damping: Damping | None = None,
) -> Contents:
    """The matrices among the arrays of a file, by their names; raises as `by_kind`."""
    taken = by_kind(path, held, names)
    matrices = {kind: sparse(kind, matrix) for kind, matrix in taken.items()}
    return Contents(matrices, places, beside=beside(held, taken), damping=damping)


def sparse(name: str, value: Any) -> Any:
    """A matrix of a file as sparse columns; raises for what is no square matrix of real numbers."""
    if not sp.issparse(value):
        value = check.array(name, value)
    if value.ndim != 2 or value.shape[0] != value.shape[1] or value.dtype.kind not in "iuf":
        raise ValueError(
            f"{name}: expected a square matrix of real numbers, got shape {value.shape}, "
            f"{value.dtype}"
        )
    matrix = sp.csc_array(value, dtype=float)
    if not np.isfinite(matrix.data).all():
        raise ValueError(f"{name}: expected finite numbers, some are too large or none")
    return matrix


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
        places = replace(
            places,
            coordinates=units.length * places.coordinates,
            mesh=places.mesh and places.mesh.scaled(units.length),
            program=places.program and places.program.in_si(*units),
        )
    return contents._replace(matrices=matrices, places=places)
