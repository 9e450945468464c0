"""The two sides of an interface: their nodes, and what is told of those without a partner."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.model.matrices import Model
from symhbm.model.places import Places
from symhbm.numerics import FloatArray, check

ALONE = -1
"""Partner of a node that has none."""
_ROUND_OFF = 1e-9
"""Share of an area that is none."""


def places_of(model: Model) -> Places:
    """Places with coordinates; TypeError or ValueError for a structure without."""
    check.instance("model", model, Model, "a Model with places")
    if model.places is None or model.places.coordinates is None:
        raise ValueError("model: expected places with coordinates")
    return model.places


def side_of(places: Places, name: str, nodes: Any) -> NDArray[np.int64]:
    """The nodes of one side, by a name or numbers; raises KeyError and ValueError."""
    try:
        found = places.nodes_of(nodes)
    except KeyError as error:
        raise KeyError(f"{name}: {error.args[0]}") from None
    if np.unique(found).size < found.size:
        raise ValueError(f"{name}: expected each node once")
    return found


def held_of(places: Places, nodes: Any) -> NDArray[np.int64]:
    """Nodes of a set that have no degrees of freedom: supports."""
    known = {} if places.mesh is None else places.mesh.names
    every = known.get(nodes, ()) if isinstance(nodes, str) else ()
    return np.setdiff1d(every, places.nodes).astype(np.int64)


def coordinates_of(places: Places, nodes: NDArray[np.int64]) -> FloatArray:
    """Where nodes are, (n, 3) [m]."""
    return np.array([places.coordinates[places.dofs_of(node)[0]] for node in nodes.tolist()])


def spacing(points: FloatArray) -> float:
    """Median distance of neighbours, 0 for a single point."""
    from scipy.spatial import KDTree  # slow to import

    if len(points) == 1:
        return 0.0
    return float(np.median(KDTree(points).query(points, 2)[0][:, 1]))


def tell_unmatched(
    order: tuple[str, str],
    sides: list[NDArray[np.int64]],
    others: list[tuple[str, NDArray[np.int64]]],
    partners: NDArray[np.int64],
    most: float,
    nearest: float,
    lost: float,
) -> None:
    """Warn of nodes without a partner, and of their share of the area; ValueError if all are.

    ``others``: more nodes to warn of, and what they are.
    """
    if np.all(partners == ALONE):
        raise ValueError(
            f"tolerance={most:.3g}: expected pairs within it [m], the nearest two nodes are "
            f"{nearest:.3g} m apart"
        )
    lonely = sides[0][partners == ALONE], np.setdiff1d(sides[1], partners)
    told = [
        f"{len(nodes)} of {len(side)} nodes of {name} (the first: {nodes[0]})"
        for name, nodes, side in zip(order, lonely, sides, strict=True)
        if len(nodes)
    ]
    words = [f"no partner within {most:.3g} m for {' and '.join(told)}"] if told else []
    words += [f"{len(n)} nodes {what} (the first: {n[0]})" for what, n in others if len(n)]
    if lost > _ROUND_OFF:
        words.append(f"{lost:.2%} of the area is theirs, and of no pair")
    if words:
        check.warn(f"contact_pairs: {'; '.join(words)}")
