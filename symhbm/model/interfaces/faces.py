"""What nodes of an interface have of the faces of elements: areas and normals."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.model.mesh import Mesh, Shares
from symhbm.model.places import Places


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
