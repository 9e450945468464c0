"""Fields over nodes and directions, as forces over named degrees of freedom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symhbm.numerics import check


def nodal_field(
    node: ArrayLike, values: ArrayLike, directions: Sequence[str] = ("x", "y", "z")
) -> dict[str, complex]:
    """Forces at nodes as `FieldForce` and the ``pattern`` of `EngineOrder` take them.

    Parameters
    ----------
    node : (n,)
        Numbers of nodes, as the places of the structure have them.
    values : (n, n_directions)
        Complex force of each node along each direction [N].
    directions
        What the columns are, as the places call them.

    Raises
    ------
    TypeError, ValueError
        For arrays that do not fit, numbers that are not finite, and a node that comes twice.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.forces.nodal_field([7, 9], [[1.0, 0.0], [0.5j, 2.0]], directions=("x", "y"))["9:x"]
    0.5j
    """
    numbers = np.atleast_1d(check.array("node", node))
    try:
        array = np.asarray(values, dtype=complex)
    except (TypeError, ValueError):
        raise TypeError(f"values={check.shown(values)}: expected complex numbers") from None
    if isinstance(directions, str) or not all(isinstance(name, str) for name in directions):
        raise TypeError(f"directions={check.shown(directions)}: expected a sequence of texts")
    if numbers.ndim != 1 or np.any(numbers != np.round(numbers)):
        raise ValueError(f"node={check.shown(node)}: expected one integer per node")
    if array.shape != (numbers.size, len(directions)):
        raise ValueError(
            f"values: expected shape {(numbers.size, len(directions))}, a row per node and a "
            f"column per direction, got {array.shape}"
        )
    if not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise ValueError(
            f"values[{row}, {column}]={array[row, column]}: expected finite numbers (node "
            f"{int(numbers[row])}, direction {directions[column]!r})"
        )
    if len({*numbers.tolist()}) < numbers.size:
        raise ValueError(f"node={check.shown(node)}: expected each node once")
    return {
        f"{int(number)}:{direction}": complex(value)
        for number, row in zip(numbers, array, strict=True)
        for direction, value in zip(directions, row, strict=True)
    }


def is_labelled(given: Any) -> bool:
    """Whether something is an array with labels, as of xarray."""
    return hasattr(given, "dims") and hasattr(given, "coords")


def labelled_field(name: str, given: Any) -> Mapping[str, complex]:
    """Forces by place of an array with the dimensions node and direction; ValueError for others."""
    dims = given.dims
    if {*dims} != {"node", "direction"}:
        raise ValueError(
            f"{name}: expected the dimensions node and direction of a labelled field, got "
            f"{tuple(dims)}"
        )
    for dim in dims:
        if dim not in given.coords:
            raise ValueError(f"{name}: expected coordinates along {dim!r} of a labelled field")
    rows = given.transpose("node", "direction")
    directions = [str(text) for text in given.coords["direction"].values]
    return nodal_field(given.coords["node"].values, rows.values, directions)
