"""The sector that a mesh is: its axis, its angle and its two sides, by where nodes are."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.cyclic import turn_about
from symhbm.model.mesh import Mesh
from symhbm.numerics import FloatArray

_TOGETHER = 1e-5
"""Distance of two nodes, over the size of the mesh, that are at one place of two sectors."""
_WHOLE = 1e-3
"""How far from an integer the number of sectors of an angle is, relative."""
_LEAST = 3
"""Nodes on a side of what is a sector."""


class Sides(NamedTuple):
    """A sector about ``axis`` of ``n_sectors``: nodes (n,) of ``left`` and their twins ``right``.

    ``gap``: the largest distance [m] of a node from its twin, turned by one sector.
    """

    axis: str
    n_sectors: int
    left: NDArray[np.int64]
    right: NDArray[np.int64]
    gap: float


def find_sides(mesh: Mesh, axis: str | None = None, n_sectors: int | None = None) -> Sides | None:
    """The sides of a sector, about a given axis or the one with most pairs; None without any.

    Nodes of the outside at one radius and one height span an angle: that of most of them is the
    sector's, unless ``n_sectors`` tells it.
    """
    found = [_about(mesh, each, n_sectors) for each in axis or "zxy"]
    sides = [each for each in found if each is not None]
    return max(sides, key=lambda each: len(each.left), default=None)


def twins(mesh: Mesh, axis: str, n_sectors: int, left: NDArray, right: NDArray) -> Sides:
    """Pairs of two given sides that are at one place, one sector apart."""
    from scipy.spatial import KDTree  # slow to import

    turned = mesh.points(left) @ turn_about(axis, 2 * np.pi / n_sectors).T
    gap, at = map(np.asarray, KDTree(turned).query(mesh.points(right)))
    near = gap <= _TOGETHER * np.abs(mesh.coordinates).max()
    return Sides(axis, n_sectors, left[at[near]], right[near], gap[near].max(initial=0.0))


def _about(mesh: Mesh, axis: str, n_sectors: int | None) -> Sides | None:
    from scipy.sparse.csgraph import connected_components  # slow to import
    from scipy.spatial import KDTree

    faces = [*map(np.ravel, mesh.skin.values())]
    if not faces:
        return None
    nodes = np.unique(np.concatenate(faces))
    k = "xyz".index(axis)
    points = mesh.points(nodes)
    plane = points[:, (k + 1) % 3] + 1j * points[:, (k + 2) % 3]
    radius, near = np.abs(plane), _TOGETHER * np.abs(points).max()
    away = radius > near
    nodes, plane, radius = nodes[away], plane[away], radius[away]
    angle = np.angle(plane * np.conj((plane / radius).mean() or 1.0))
    rings = KDTree(np.column_stack([radius, points[away, k]])).query_pairs(
        near, output_type="ndarray"
    )
    size = len(nodes)
    graph = sp.coo_array((np.ones(len(rings)), tuple(rings.T)), shape=(size, size))
    count, ring = connected_components(graph, directed=False)
    first, last = _ends(ring, angle, count)
    span = angle[last] - angle[first]
    apart = span * radius[first] > 10 * near
    if n_sectors is None:
        whole = 2 * np.pi / np.where(apart, span, np.inf)
        number = np.round(whole).astype(int)
        number[np.abs(whole - number) > _WHOLE * whole] = 0
        votes = np.bincount(number)
        votes[:3] = 0  # a whole body may have nodes on both sides of a plane
        if votes.max() < _LEAST:
            return None
        n_sectors = int(votes.argmax())
    gap = np.abs(span - 2 * np.pi / n_sectors) * radius[first]
    twin = apart & (gap <= 2 * near)
    left, right = nodes[first[twin]], nodes[last[twin]]
    if not all(mesh.faces_of(None, side) for side in (left, right)):
        return None  # nodes here and there of a body that is no sector
    return Sides(axis, n_sectors, left, right, float(gap[twin].max()))


def _ends(
    ring: NDArray[np.intp], angle: FloatArray, count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first and the last node of each ring, by angle."""
    order = np.lexsort((angle, ring))
    begin = np.searchsorted(ring[order], np.arange(count))
    return order[begin], order[np.append(begin[1:], len(order)) - 1]
