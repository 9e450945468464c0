"""Surfaces of nodes: their areas, by triangles between them, normals, and directions along them."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from symhbm.model.matrices import Model
from symhbm.model.places import Places
from symhbm.numerics import FloatArray, check

_STEEP = 0.1
"""Cosine of the angle between the normal of a triangle and that of all, below which it is none."""
_LARGER = 3.0
"""Radius of a triangle over those beside it, from which on it spans what is no interface."""
_TOLD = 0.01
"""Share of the area of such triangles from which a warning names it."""
_NOTHING = 1e-12
"""Area over the largest one that is 0 but for round-off."""


def areas_of(
    area: ArrayLike | None,
    points: FloatArray,
    normals: FloatArray,
    chosen: NDArray[np.intp],
    n_left: int,
    joined: Any,
    shares: FloatArray | None,
) -> FloatArray:
    """Areas (n,) of pairs, given for all nodes of the first side, as a sum, or found.

    ``shares`` (n,) are those of faces of elements, None where they are not known.
    """
    given = None if area is None else check.array("area", area, "positive")
    if given is not None and given.ndim:
        if given.shape != (n_left,):
            raise ValueError(
                f"area: expected one number or {n_left} (one per node of left), got {given.shape}"
            )
        return given[chosen]
    shares = _shares(points, normals, joined) if shares is None else shares
    return shares if given is None else shares * (given / shares.sum())


def _shares(points: FloatArray, normals: FloatArray, joined: Any) -> FloatArray:
    """Area nearer to each point than to others, of triangles between them, (n,).

    Warns of triangles that are left out, see `_bridges`.
    """
    from scipy.spatial import Delaunay, QhullError  # slow to import

    mean = normals.mean(axis=0)
    flat = np.linalg.svd(mean[None])[2][1:]  # two directions in the plane
    try:
        mesh = Delaunay(points @ flat.T)
    except (QhullError, ValueError):
        raise ValueError("area=None: expected areas for nodes that are on one line") from None
    corners, neighbours = mesh.simplices.astype(np.intp), mesh.neighbors
    one, two = np.moveaxis(np.diff(points[corners], axis=1), 1, 0)
    upright = np.cross(one, two)
    whole = np.linalg.norm(upright, axis=1)
    # Nodes in a row on the rim make triangles that stand on their edges, or of round-off alone.
    real = np.abs(upright @ mean) > _STEEP * np.linalg.norm(mean) * whole
    real &= whole > _NOTHING * whole.max()
    number = np.append(np.cumsum(real) - 1, -1)
    neighbours = np.where(np.append(real, False)[neighbours], number[neighbours], -1)
    bridges = _bridges(points, corners[real], neighbours[real], joined)
    share = whole[real][bridges].sum() / whole[real].sum()
    if share > _TOLD:
        check.warn(
            f"area=None: {share:.0%} of the area between the nodes is left out, where triangles "
            "are in no element or far larger than those beside them: notches, holes, or several "
            "surfaces; area= gives the areas, or their sum"
        )
    corners = corners[real][~bridges]
    result, at = np.zeros(len(points)), points[corners]
    edges = np.stack([at[:, 2] - at[:, 1], at[:, 0] - at[:, 2], at[:, 1] - at[:, 0]], axis=1)
    whole = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    squares = np.einsum("ijk,ijk->ij", edges, edges)
    cosine = (squares.sum(axis=1)[:, None] - 2 * squares) / 2  # times the sides at each corner
    cotangent = cosine / (2 * whole[:, None])
    for corner in range(3):
        one, two = (corner + 1) % 3, (corner + 2) % 3
        nearer = (squares[:, one] * cotangent[:, one] + squares[:, two] * cotangent[:, two]) / 8
        # An obtuse triangle has its circumcentre outside.
        obtuse = (cosine < 0).any(axis=1)
        cut = np.where(cosine[:, corner] < 0, whole / 2, whole / 4)
        np.add.at(result, corners[:, corner], np.where(obtuse, cut, nearer))
    return result


def _bridges(
    points: FloatArray, corners: NDArray[np.intp], neighbours: NDArray[np.intp], joined: Any
) -> NDArray[np.bool_]:
    """Which triangles (n, 3) span a notch, a hole, or what parts two surfaces.

    Their corners are in no element together, ``joined`` (n_points, n_points) where known, or they
    are far larger than all others there.
    ``neighbours`` (n, 3) are the triangles opposite each corner, -1 without.
    """
    from scipy.sparse.csgraph import connected_components  # slow to import

    at = points[corners]
    sides = np.linalg.norm(at - np.roll(at, 1, axis=1), axis=2)
    areas = np.linalg.norm(np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]), axis=1) / 2
    radii = sides.prod(axis=1) / (4 * areas)
    least = np.full(len(points), np.inf)
    np.minimum.at(least, corners.ravel(), np.repeat(radii, 3))
    result = radii > _LARGER * least[corners].max(axis=1)
    if joined is None:
        return result
    # Triangles need not follow the elements of a distorted mesh, but stay near them: what spans a
    # hole joins, somewhere, nodes that are far apart in the mesh.
    near = sp.eye_array(len(points), format="csr") + joined
    outside, far = _apart(near, corners), _apart(near @ near @ near, corners)
    at = np.flatnonzero(outside[:, None] & (neighbours >= 0) & outside[neighbours])
    pairs = at // 3, neighbours.ravel()[at]
    graph = sp.coo_array((np.ones(len(at)), pairs), shape=(len(corners),) * 2)
    _, patch = connected_components(graph, directed=False)
    return result | (outside & np.isin(patch, patch[outside & far]))


def _apart(joined: Any, corners: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Which triangles have an edge between nodes that are not joined."""
    edges = [joined[corners[:, k - 2], corners[:, k - 1]] for k in range(3)]
    return np.any([np.asarray(edge).ravel() == 0 for edge in edges], axis=0)


def joined_of(model: Model, places: Places, nodes: NDArray[np.int64]) -> Any:
    """Which nodes an element joins, sparse (n, n), by the stiffness; None where none is known."""
    order = np.argsort(nodes)
    own = np.flatnonzero(np.isin(places.node, nodes))
    at = order[np.searchsorted(nodes[order], places.node[own])]
    of_node = sp.csr_array((np.ones(len(own)), (at, np.arange(len(own)))))
    matrix = abs(sp.csr_array(model.stiffness_matrix)[own][:, own])
    result = sp.csr_array(of_node @ matrix @ of_node.T)
    result.setdiag(0)
    result.eliminate_zeros()
    return result if result.nnz else None


_NEIGHBOURS = 12
_FLAT = 1e-6
"""Width of a set of points over its length, below which it is a line."""
_PLAIN = 0.05
"""Weight of no curvature beside a node at the distance of the farthest neighbour."""
_CURVED = 0.3
"""Cosine of the angle between a normal and that of all, below which its side is unclear."""


def given_normals(normal: ArrayLike, n_left: int) -> FloatArray:
    """Unit vectors (n_left, 3)."""
    given = check.array("normal", normal)
    if given.shape not in ((3,), (n_left, 3)):
        raise ValueError(f"normal: expected shape (3,) or {(n_left, 3)}, got {given.shape}")
    length = np.linalg.norm(given, axis=-1, keepdims=True)
    if not np.all(length):
        raise ValueError("normal: expected vectors that are not 0")
    return np.broadcast_to(given / length, (n_left, 3))


def normals_of(points: FloatArray, across: FloatArray, about: int | None) -> FloatArray:
    """Normals (n, 3) of a surface, on the side that ``across`` or turning about an axis tells."""
    from scipy.spatial import KDTree  # slow to import

    whole = _axes(points[None])[0, 2]
    near = KDTree(points).query(points, min(_NEIGHBOURS, len(points)))[1]
    axes = _axes(points[near])
    # Through the point itself: a plane amid neighbours leans over at the edges of a curved surface.
    u, v, w = np.einsum("nmk,nik->inm", points[near] - points[:, None], axes)
    length = np.abs([u, v]).max(axis=(0, 2))[:, None]
    u, v, w = u / length, v / length, w / length
    terms = np.stack([u, v, u * u, u * v, v * v], axis=2)
    # No curvature counts a little: two rows of nodes tell none, and what they tell is a slope.
    plain = np.broadcast_to(_PLAIN * np.eye(5)[2:], (len(points), 3, 5))
    inverse = np.linalg.pinv(np.concatenate([terms, plain], axis=1), rcond=_FLAT)
    slope = np.einsum("nim,nm->ni", inverse[:, :2, : w.shape[1]], w)
    normals = axes[:, 2] - slope[:, :1] * axes[:, 0] - slope[:, 1:2] * axes[:, 1]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    cosine = normals @ whole
    if np.any(np.abs(cosine) < _CURVED):
        raise ValueError("normal=None: expected normals for a surface that is so curved")
    normals *= np.sign(cosine)[:, None]
    outwards = np.einsum("ij,ij->i", normals, across).mean()
    if abs(outwards) < _FLAT * np.ptp(points, axis=0).max() and about is not None:
        turning = np.cross(np.eye(3)[about], points)
        outwards = np.einsum("ij,ij->i", normals, turning).mean()
        outwards *= abs(outwards) > _CURVED * np.linalg.norm(turning, axis=1).mean()
    if abs(outwards) < _FLAT * np.ptp(points, axis=0).max():
        raise ValueError(
            "normal=None: expected the direction out of left, as [1, 0, 0]; both sides coincide"
        )
    return normals * np.sign(outwards)


def _axes(sets: FloatArray) -> FloatArray:
    """Unit vectors (n, 3, 3) along sets of points (n, m, 3), across them, and normal to them."""
    centred = sets - sets.mean(axis=1, keepdims=True)
    _, size, rows = np.linalg.svd(centred, full_matrices=True)
    if sets.shape[1] < 3 or np.any(size[:, 1] <= _FLAT * size[:, 0]):
        raise ValueError("normal=None: expected nodes that are not on one line, or normals")
    return rows


def tangents_of(normals: FloatArray, tangential: ArrayLike | None) -> FloatArray:
    """Unit vectors (n, 3) at right angles to normals, near to a given one."""
    if tangential is None:
        wanted = np.eye(3)[np.argmin(np.abs(normals).max(axis=0))]
    else:
        wanted = check.array("tangential", tangential)
        if wanted.shape != (3,):
            raise ValueError(f"tangential: expected shape (3,), got {wanted.shape}")
    along = wanted - np.outer(normals @ wanted, np.ones(3)) * normals
    length = np.linalg.norm(along, axis=1, keepdims=True)
    if np.any(length <= _FLAT * np.linalg.norm(wanted)):
        raise ValueError(
            f"tangential={check.shown(wanted.tolist())}: expected a direction that is normal "
            "nowhere"
        )
    return along / length
