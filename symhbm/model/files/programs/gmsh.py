"""Meshes of gmsh, read by meshio: nodes, elements, and physical groups as sets and surfaces.

For structures that are assembled from such a mesh, by scikit-fem for example: their rows are x, y
and z of each node, in the order of the file. Nodes are numbered in this order from 1 on.
"""

from pathlib import Path
from typing import Any

import numpy as np

from symhbm.model.files.contents import optional, told
from symhbm.model.mesh import Mesh, element, kinds
from symhbm.model.places import DIRECTIONS, Places


def places_of(path: Path, n_dof: int) -> Places:
    """Places of as many degrees of freedom as a mesh has; ImportError without meshio."""
    mesh = read(path)
    if n_dof != 3 * len(mesh.node):
        raise ValueError(
            f"places={str(path)!r}: expected {3 * len(mesh.node)} rows, x, y and z of each of its "
            f"{len(mesh.node)} nodes, the matrices have {n_dof}; keep the rows of supports, with "
            "1e36 on the diagonal of the stiffness"
        )
    direction = np.tile(DIRECTIONS[:3], len(mesh.node))
    return Places(np.repeat(mesh.node, 3), direction, mesh=mesh)


def read(path: Path) -> Mesh:
    """The mesh of a file; ImportError without meshio."""
    meshio = optional("meshio", ".msh", "gmsh")
    with told(path, "mesh of gmsh"):
        held = meshio.read(path)
        node = np.arange(1, len(held.points) + 1)
        solids: dict[str, list[Any]] = {}
        sets: dict[str, list[Any]] = {}
        surfaces: dict[str, dict[str, list[Any]]] = {}
        for number, block in enumerate(held.cells):
            known = block.type in kinds()
            dimension = element(block.type).n_axes if known else block.dim
            if dimension == 3 and not known:
                raise ValueError(f"expected elements of {', '.join(kinds())}, got {block.type}")
            if dimension == 3:
                solids.setdefault(block.type, []).append(block.data + 1)
            for name, groups in held.cell_sets.items():
                if name.startswith("gmsh:") or not len(groups[number]):
                    continue
                chosen = block.data[groups[number]] + 1
                if dimension == 2 and known:
                    surfaces.setdefault(name, {}).setdefault(block.type, []).append(chosen)
                else:
                    sets.setdefault(name, []).append(chosen.ravel())
        whole = {kind: np.concatenate(blocks) for kind, blocks in solids.items()}
        faces = {
            name: {kind: np.concatenate(each) for kind, each in blocks.items()}
            for name, blocks in surfaces.items()
        }
        groups = {name: np.unique(np.concatenate(nodes)) for name, nodes in sets.items()}
        return Mesh(node, held.points, whole, groups, faces)
