"""The two sides of an interface: their nodes, and what these have of the faces of elements.

Those are areas and normals. What is told of nodes without a partner is here, too.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.model.matrices import Model
from symhbm.model.mesh import Mesh, Shares
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


def shares_of(
    places: Places, named: list[Any], sides: list[NDArray[np.int64]], partners: NDArray[np.int64]
) -> tuple[Shares, float] | None:
    """Shares of the nodes of the first side, and the area that is of all nodes together.

    Faces are those of a surface by its name, or those of the outside between the nodes. Of nodes on
    both flanks of a thin part these are also its edges, which touch nothing: where the
    ``partners`` (n,) of their nodes are of one face of the second side, faces count alone, unless
    some node is then in none. None where no mesh is known, or no face.
    """
    mesh = places.mesh
    if mesh is None:
        return None
    every = [
        mesh.names.get(name, side) if isinstance(name, str) else side
        for name, side in zip(named, sides, strict=True)
    ]
    faces = mesh.faces_of(named[0], every[0])
    if not faces:
        return None
    partner = np.full(len(mesh.node), -1)
    partner[mesh.at(sides[0])] = partners
    touching = _touching(mesh, faces, mesh.faces_of(named[1], every[1]), partner)
    if np.array_equal(_nodes(touching), _nodes(faces)):
        faces = touching
    whole, at = mesh.shares(faces), mesh.at(sides[0])
    area, normal = whole.area[at], whole.normal[at]
    if (bare := area == 0).any():
        normal[bare] = area @ normal / np.linalg.norm(area @ normal)
    return Shares(area, normal), float(whole.area.sum())


def _touching(
    mesh: Mesh, faces: dict[str, NDArray], beyond: dict[str, NDArray], partner: NDArray[np.int64]
) -> dict[str, NDArray]:
    """Faces the partners of whose nodes are of one face of the second side, as far as known."""
    around: dict[int, list[set[int]]] = {}
    for opposite in (set(face) for block in beyond.values() for face in block.tolist()):
        for node in opposite:
            around.setdefault(node, []).append(opposite)
    result = {}
    for kind, block in faces.items():
        chosen = []
        for partners in partner[mesh.at(block)].tolist():
            known = {node for node in partners if node >= 0}
            near = around.get(min(known, default=-1), ())
            chosen.append(not known or any(known <= opposite for opposite in near))
        result[kind] = block[np.array(chosen, dtype=bool)]
    return result


def _nodes(faces: dict[str, NDArray]) -> NDArray[np.int64]:
    return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *map(np.ravel, faces.values())]))
