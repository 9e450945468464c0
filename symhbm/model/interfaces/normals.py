"""Normals of surfaces of nodes, and directions along them."""

import numpy as np
from numpy.typing import ArrayLike

from symhbm.numerics import FloatArray, check

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
