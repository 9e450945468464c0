"""Interfaces of two sets of nodes: pairs by coordinates, normals, areas, directions of contacts."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from symhbm.model.files import read_columns
from symhbm.model.matrices import Model
from symhbm.model.places import Places, next_sector
from symhbm.numerics import FloatArray, check

_SHARE = 0.1
"""Largest distance of a pair over the distance of neighbours, unless a tolerance is given."""
_NEIGHBOURS = 12
_FLAT = 1e-6
"""Width of a set of points over its length, below which it is a line."""
_STEEP = 0.1
"""Cosine of the angle between the normal of a triangle and that of all, below which it is none."""
_LARGER = 3.0
"""Radius of a triangle over those beside it, from which on it spans what is no interface."""
_TOLD = 0.01
"""Share of the area of such triangles that is told."""
_NOTHING = 1e-12
"""Area over the largest one that is 0 but for round-off."""
_PLAIN = 0.05
"""Weight of no curvature beside a node at the distance of the farthest neighbour."""
_CURVED = 0.3
"""Cosine of the angle between a normal and that of all, below which its side is unclear."""


@dataclass(frozen=True, eq=False, repr=False)
class ContactPairs:
    """Pairs of nodes that touch, and what contacts between them need.

    Attributes
    ----------
    nodes : (n, 2)
        Nodes of the first side and of the second.
    coordinates : (n, 3)
        Amid the two nodes of each pair [m].
    axes : (n, 3, 3)
        Unit vectors by pair: tangential, across and normal, which points out of the first side.
    gap : (n,)
        Distance of the second node from the first along the normal [m].
    area : (n,)
        Share of each pair of the area of the interface [m^2].
    tangential, across, normal : (n,) of {place: weight}
        Relative displacements along the axes, for `symhbm.Friction`: first side less second, so
        that the normal one closes where it is positive. ``across`` is empty where the structure
        has no displacements along it.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> places = sh.Places(
    ...     node=[1, 1, 2, 2], direction=["x", "y"] * 2, coordinates=np.zeros((4, 3)),
    ... )
    >>> model = sh.Model(np.eye(4), np.eye(4), 1e4 * np.eye(4), places=places)
    >>> pairs = sh.contact_pairs(model, [1], [2], normal=[1, 0, 0], area=[2e-4])
    >>> pairs.gap, pairs.area
    (array([0.]), array([0.0002]))
    >>> pairs.tangential
    [{'1:y': 1.0, '2:y': -1.0}]
    """

    nodes: NDArray[np.int64]
    coordinates: FloatArray
    axes: FloatArray
    gap: FloatArray
    area: FloatArray
    tangential: list[dict[Any, float]]
    across: list[dict[Any, float]]
    normal: list[dict[Any, float]]

    def __len__(self) -> int:
        return len(self.nodes)

    def __repr__(self) -> str:
        return f"ContactPairs: {len(self)} pairs, {self.area.sum():.4g} m^2"

    def nearest(
        self, table: Any, tolerance: float | None = None, *, length: float = 1.0
    ) -> dict[str, NDArray]:
        """Values at each pair of the nearest point of a table, a static analysis for example.

        Parameters
        ----------
        table
            A file of comma-separated values or columns by name, ``x``, ``y``, ``z`` and others.
        tolerance
            Largest distance to a point [m]; by default that of neighbouring pairs.
        length
            Unit of its coordinates [m], 0.001 where they are in mm.

        Returns
        -------
        The other columns by name, (n,) each, in their own units.

        Raises
        ------
        FileNotFoundError, ValueError
            For a table without coordinates or with columns of several lengths, and for pairs that
            have no point so near.

        Examples
        --------
        ``load = pairs.nearest("static.csv", length=1e-3)["pressure"] * 1e6 * pairs.area``
        """
        from scipy.spatial import KDTree  # slow to import

        given = read_columns(table) if isinstance(table, (str, os.PathLike)) else table
        if not isinstance(given, Mapping) or not {*"xyz"} <= {*given}:
            raise ValueError(f"table={check.shown(table)}: expected columns x, y, z and others")
        columns = {str(name): np.asarray(column) for name, column in given.items()}
        lengths = {name: column.shape for name, column in columns.items()}
        if len({*lengths.values()}) > 1 or columns["x"].ndim != 1:
            raise ValueError(f"table: expected columns of one length, got the shapes {lengths}")
        points = np.column_stack([check.array(axis, columns.pop(axis)) for axis in "xyz"])
        distance, at = KDTree(length * points).query(self.coordinates)
        most = (
            _spacing(self.coordinates)
            if tolerance is None
            else check.scalar("tolerance", tolerance, "positive")
        )
        if distance.max() > most:
            far = int(np.argmax(distance))
            raise ValueError(
                f"table: expected a point within {most:.3g} m of each pair, that of the nodes "
                f"{self.nodes[far].tolist()} has none within {distance[far]:.3g} m; length= is the "
                "unit of its coordinates"
            )
        return {name: column[at] for name, column in columns.items()}


def contact_pairs(
    model: Model,
    left: Any,
    right: Any,
    *,
    tolerance: float | None = None,
    normal: ArrayLike | None = None,
    tangential: ArrayLike | None = None,
    area: ArrayLike | None = None,
    n_sectors: int | None = None,
    axis: str = "z",
) -> ContactPairs:
    """Pair the nodes of two surfaces that touch, with normals, areas and directions.

    Parameters
    ----------
    model
        A structure whose places have coordinates.
    left, right
        The nodes of the two surfaces: a label, or numbers.
    tolerance
        Largest distance of the nodes of a pair [m]; by default a tenth of that of neighbours.
    normal : (3,) or (n_left, 3)
        Normal out of ``left``, one or one for each of its nodes, of any length; by default that
        of a parabola through the neighbours of each, towards ``right``.
    tangential : (3,)
        What the first tangential direction is as near to as it can; by default an axis of
        coordinates.
    area : (n_left,) or one number
        Area of each node of ``left`` [m^2], or of the whole interface; by default found from
        triangles between the pairs, a node having what is nearer to it than to others. Triangles
        whose nodes the stiffness tells to be in no element together, and those far larger than all
        beside them, are left out and told: they span notches and holes.
    n_sectors
        ``right`` is of the next of so many sectors, which is turned about the ``axis``.
    axis
        ``"x"``, ``"y"`` or ``"z"``, of the disk and of radial, tangential and axial directions.

    Returns
    -------
    `ContactPairs`, in the order of ``left`` as given (of a label, by ascending numbers).

    Warns
    -----
    UserWarning
        Of nodes without a partner, in one line; of triangles that are left out of areas.

    Raises
    ------
    TypeError, ValueError, KeyError
        For a structure without coordinates, unknown nodes, surfaces without a pair, and normals or
        areas that cannot be found: of nodes on a line, of sides that coincide, whose outside is
        not known.

    Examples
    --------
    Two nodes that touch two others along x, whose places are known:

    >>> import numpy as np
    >>> import symhbm as sh
    >>> places = sh.Places(
    ...     node=np.repeat([1, 2, 3, 4], 2), direction=["x", "y"] * 4,
    ...     coordinates=np.repeat([[0, 0, 0], [0, 1, 0], [0, 0, 0], [0, 1, 0]], 2, axis=0),
    ... )
    >>> model = sh.Model(np.eye(8), np.eye(8), 1e4 * np.eye(8), places=places)
    >>> pairs = sh.contact_pairs(model, [1, 2], [3, 4], normal=[1, 0, 0], area=[2e-4, 2e-4])
    >>> pairs.normal[0]
    {'1:x': 1.0, '3:x': -1.0}
    >>> shroud = sh.Friction(
    ...     tangential=pairs.tangential, normal=pairs.normal, contact_stiffness=1e9 * pairs.area,
    ...     normal_stiffness=1e9 * pairs.area, friction_coefficient=0.3, normal_load=5.0,
    ... )
    >>> model.with_contacts(shroud=shroud).n_contacts
    2
    """
    from scipy.spatial import KDTree  # slow to import

    places = _places_of(model)
    turn = np.eye(3)
    about = "xyz".index(check.one_of("axis", axis, "xyz"))
    if n_sectors is not None:
        angle = 2 * np.pi / check.integer("n_sectors", n_sectors, minimum=2)
        turn = _rotation(about, angle)
    sides = [_side(places, name, nodes) for name, nodes in (("left", left), ("right", right))]
    points = [_coordinates(places, sides[0]), _coordinates(places, sides[1]) @ turn.T]
    most = (
        _SHARE * max(map(_spacing, points))
        if tolerance is None
        else check.scalar("tolerance", tolerance, "positive")
    )
    distance, partner = map(np.asarray, KDTree(points[1]).query(points[0]))
    back = np.asarray(KDTree(points[0]).query(points[1])[1])
    paired = (distance <= most) & (back[partner] == np.arange(len(partner)))
    _tell_unmatched(sides, paired, partner, most, float(distance.min()))
    chosen, other = np.flatnonzero(paired), partner[paired]
    first, second = points[0][chosen], points[1][other]
    between = (first + second) / 2
    if normal is None:
        normals = _normals(between, second - first, about if n_sectors else None)
    else:
        normals = _given_normals(normal, len(paired))[chosen]
    along = _tangents(normals, tangential)
    axes = np.stack([along, np.cross(normals, along), normals], axis=1)
    nodes = np.column_stack([sides[0][chosen], sides[1][other]])
    joined = _joined(model, places, nodes[:, 0])
    areas = _areas(area, between, normals, chosen, len(paired), joined)
    weights = [[], [], []]
    for pair, (a, b) in enumerate(nodes.tolist()):
        one = _components(places, a, first[pair], about)
        two = _components(places, b, second[pair], about)
        for of_axis, vector in zip(weights, axes[pair], strict=True):
            of_axis.append(_weights(vector, one, two, n_sectors is not None))
    for name, of_axis in zip(("tangential", "across", "normal"), weights, strict=True):
        if not all(of_axis):
            if name != "across":
                raise ValueError(f"{name}: expected displacements of the nodes along it")
            of_axis.clear()  # a structure in a plane
    gap = np.einsum("ij,ij->i", second - first, normals)
    return ContactPairs(nodes, between, axes, gap, areas, *weights)


def _places_of(model: Model) -> Places:
    if not isinstance(model, Model):
        raise TypeError(f"model={check.shown(model)}: expected a Model with places")
    if model.places is None or model.places.coordinates is None:
        raise ValueError("model: expected places with coordinates")
    return model.places


def _side(places: Places, name: str, nodes: Any) -> NDArray[np.int64]:
    try:
        found = places.nodes_of(nodes)
    except KeyError as error:
        raise KeyError(f"{name}: {error.args[0]}") from None
    if np.unique(found).size < found.size:
        raise ValueError(f"{name}: expected each node once")
    return found


def _coordinates(places: Places, nodes: NDArray[np.int64]) -> FloatArray:
    return np.array([places.coordinates[places.dofs_of(node)[0]] for node in nodes.tolist()])


def _spacing(points: FloatArray) -> float:
    """Median distance of neighbours, 0 for a single point."""
    from scipy.spatial import KDTree  # slow to import

    if len(points) == 1:
        return 0.0
    return float(np.median(KDTree(points).query(points, 2)[0][:, 1]))


def _tell_unmatched(
    sides: list[NDArray[np.int64]],
    paired: NDArray[np.bool_],
    partner: NDArray[np.intp],
    most: float,
    nearest: float,
) -> None:
    """Warn of nodes without a partner; ValueError where none has one."""
    if not paired.any():
        raise ValueError(
            f"tolerance={most:.3g}: expected pairs within it [m], the nearest two nodes are "
            f"{nearest:.3g} m apart"
        )
    lonely = sides[0][~paired], np.delete(sides[1], partner[paired])
    told = [
        f"{len(nodes)} of {len(side)} nodes of {name} (the first: {nodes[0]})"
        for name, nodes, side in zip(("left", "right"), lonely, sides, strict=True)
        if len(nodes)
    ]
    if told:
        words = f"contact_pairs: no partner within {most:.3g} m for {' and '.join(told)}"
        warnings.warn(words, stacklevel=3)


def _given_normals(normal: ArrayLike, n_left: int) -> FloatArray:
    """Unit vectors (n_left, 3)."""
    given = check.array("normal", normal)
    if given.shape not in ((3,), (n_left, 3)):
        raise ValueError(f"normal: expected shape (3,) or {(n_left, 3)}, got {given.shape}")
    length = np.linalg.norm(given, axis=-1, keepdims=True)
    if not np.all(length):
        raise ValueError("normal: expected vectors that are not 0")
    return np.broadcast_to(given / length, (n_left, 3))


def _normals(points: FloatArray, across: FloatArray, about: int | None) -> FloatArray:
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


def _tangents(normals: FloatArray, tangential: ArrayLike | None) -> FloatArray:
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


def _areas(
    area: ArrayLike | None,
    points: FloatArray,
    normals: FloatArray,
    chosen: NDArray[np.intp],
    n_left: int,
    joined: Any,
) -> FloatArray:
    """Areas (n,) of pairs, given for all nodes of the first side, as a sum, or found."""
    given = None if area is None else check.array("area", area, "positive")
    if given is not None and given.ndim:
        if given.shape != (n_left,):
            raise ValueError(
                f"area: expected one number or {n_left} (one per node of left), got {given.shape}"
            )
        return given[chosen]
    shares = _shares(points, normals, joined)
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
        warnings.warn(
            f"area=None: {share:.0%} of the area between the nodes is left out, where triangles "
            "are in no element or far larger than those beside them: notches, holes, or several "
            "surfaces; area= gives the areas, or their sum",
            stacklevel=4,
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


def _joined(model: Model, places: Places, nodes: NDArray[np.int64]) -> Any:
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


def _rotation(about: int, angle: float) -> FloatArray:
    """Matrix that turns vectors about an axis."""
    one, two = (about + 1) % 3, (about + 2) % 3
    result = np.eye(3)
    result[[one, two], [one, two]] = np.cos(angle)
    result[two, one], result[one, two] = np.sin(angle), -np.sin(angle)
    return result


def _components(places: Places, node: int, point: FloatArray, about: int) -> dict[str, FloatArray]:
    """Unit vectors of the displacements of a node at a point, by the names of its places.

    Cartesian directions of the next sector are told in the axes of this one.
    """
    axial = np.eye(3)[about]
    radial = point - (point @ axial) * axial
    length = np.linalg.norm(radial)
    vectors = dict(zip("xyz", np.eye(3), strict=True)) | {"axial": axial}
    if length > 0:
        vectors |= {"radial": radial / length, "tangential": np.cross(axial, radial / length)}
    return {
        f"{node}:{direction}": vectors[direction]
        for direction in places.direction[places.dofs_of(node)].tolist()
        if direction in vectors
    }


def _weights(
    vector: FloatArray,
    one: dict[str, FloatArray],
    two: dict[str, FloatArray],
    beyond: bool,
) -> dict[Any, float]:
    """Weights of the displacement of one node less that of another along a direction."""
    result: dict[Any, float] = {}
    for sign, side in ((1.0, one), (-1.0, two)):
        for place, unit in side.items():
            weight = sign * float(unit @ vector)
            if abs(weight) > 1e-12:
                result[next_sector(place) if beyond and sign < 0 else place] = weight
    return result
