"""What files hold: matrices by name, and what they tell of degrees of freedom."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from symhbm.model.damping import Damping
from symhbm.model.places import Places
from symhbm.numerics import check

KINDS = ("mass", "damping", "stiffness")
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
    place of a matrix.
    """

    matrices: dict[str, Any]
    places: Places | None = None
    triangle: bool = False
    beside: tuple[str, ...] = ()
    damping: Damping | None = None


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
