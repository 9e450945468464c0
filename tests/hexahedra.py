"""Meshes of hexahedra with 8 or 20 nodes: cells of a grid, mapped to any shape."""

from itertools import product

import numpy as np

import symhbm as sh
from symhbm.model.mesh import Mesh, element


def cells(shape, order=1, keep=lambda *middle: True):
    """Points (n, 3) of a grid of unit cells, and nodes (n_cells, 8 or 20) from 1 on."""
    kind = "hexahedron" if order == 1 else "hexahedron20"
    corners = (element(kind).points + 1) / 2
    chosen = [c for c in product(*map(range, shape)) if keep(*(np.array(c) + 0.5))]
    at = np.array(chosen)[:, None, :] + corners
    points, which = np.unique(at.reshape(-1, 3), axis=0, return_inverse=True)
    return points, which.reshape(len(chosen), -1) + 1


def block(shape, order=1, keep=lambda *middle: True, mapped=lambda p: p, first=1):
    """A mesh of one block, its nodes numbered from ``first`` on."""
    points, nodes = cells(shape, order, keep)
    kind = "hexahedron" if order == 1 else "hexahedron20"
    number = first + np.arange(len(points))
    return Mesh(number, mapped(points), {kind: nodes - 1 + first}), points


def together(*meshes, sets=None, surfaces=None):
    """One mesh of several."""
    kinds = {kind for mesh in meshes for kind in mesh.elements}
    elements = {
        kind: np.concatenate([m.elements[kind] for m in meshes if kind in m.elements])
        for kind in kinds
    }
    node = np.concatenate([mesh.node for mesh in meshes])
    points = np.concatenate([mesh.coordinates for mesh in meshes])
    return Mesh(node, points, elements, sets or {}, surfaces or {})


def structure(mesh, held=()):
    """A model with three directions at each node that is not held, and made-up matrices."""
    node = np.repeat(np.setdiff1d(mesh.node, held), 3)
    places = sh.Places(node, np.tile(["x", "y", "z"], len(node) // 3), mesh=mesh)
    one = np.eye(len(node))
    return sh.Model(one, one, 1e4 * one, places=places)
