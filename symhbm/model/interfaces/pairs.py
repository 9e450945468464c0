"""Interfaces of two sets of nodes: pairs by coordinates, and directions of contacts."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symhbm.model.cyclic import turn_about
from symhbm.model.files import read_columns
from symhbm.model.interfaces.sides import (
    ALONE,
    coordinates_of,
    held_of,
    places_of,
    shares_of,
    side_of,
    spacing,
    tell_unmatched,
)
from symhbm.model.interfaces.surfaces import (
    areas_of,
    given_normals,
    joined_of,
    normals_of,
    tangents_of,
)
from symhbm.model.matrices import Model
from symhbm.model.places import Places, next_sector
from symhbm.numerics import FloatArray, check

_SHARE = 0.1
"""Largest distance of a pair over the distance of neighbours, unless a tolerance is given."""


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
            spacing(self.coordinates)
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
        The nodes of the two surfaces: a label, or numbers. Between sectors left and right are those
        of `symhbm.Sector`, which has a drawing: right of a sector touches left of the next.
    tolerance
        Largest distance of the nodes of a pair [m]; by default a tenth of that of neighbours.
    normal : (3,) or (n_left, 3)
        Normal out of ``left``, between sectors out of ``right``, one or one for each of its nodes,
        of any length; by default that of the faces of elements out of it, or, where no mesh is
        known, of a parabola through the neighbours of each, towards the other side.
    tangential : (3,)
        What the first tangential direction is as near to as it can; by default an axis of
        coordinates.
    area : (n_left,) or one number
        Area of each node of that side [m^2], or of the whole interface; by default that of the
        faces of elements, shared among their nodes. Where no mesh is known it is found from
        triangles between the pairs, a node having what is nearer to it than to others. Triangles
        whose nodes the stiffness tells to be in no element together, and
        those far larger than all beside them, are left out and told: they span notches and holes.
    n_sectors
        ``left`` is of the next of so many sectors, which is turned about the ``axis``; the first
        side of the pairs is then ``right``.
    axis
        ``"x"``, ``"y"`` or ``"z"``, of the disk and of radial, tangential and axial directions.

    Returns
    -------
    `ContactPairs`, in the order of their first side as given (of a label, by ascending numbers).

    Warns
    -----
    UserWarning
        Of nodes without a partner, or without degrees of freedom, in one line, with the share of
        the area that is theirs; of triangles that are left out of areas.

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

    places = places_of(model)
    turn = np.eye(3)
    about = "xyz".index(check.one_of("axis", axis, "xyz"))
    if n_sectors is not None:
        angle = 2 * np.pi / check.integer("n_sectors", n_sectors, minimum=2)
        turn = turn_about(axis, angle)
    named = {"left": left, "right": right}
    order = ("left", "right") if n_sectors is None else ("right", "left")
    sides = [side_of(places, name, named[name]) for name in order]
    points = [coordinates_of(places, sides[0]), coordinates_of(places, sides[1]) @ turn.T]
    most = (
        _SHARE * max(map(spacing, points))
        if tolerance is None
        else check.scalar("tolerance", tolerance, "positive")
    )
    distance, partner = map(np.asarray, KDTree(points[1]).query(points[0]))
    back = np.asarray(KDTree(points[0]).query(points[1])[1])
    paired = (distance <= most) & (back[partner] == np.arange(len(partner)))
    partners = np.where(paired, sides[1][partner], ALONE)
    given = [named[name] for name in order]
    shares = shares_of(places, given, sides, partners)
    lost = 0.0 if shares is None else 1 - shares[0].area[paired].sum() / shares[1]
    others = [(f"of {name} are held", held_of(places, named[name])) for name in order]
    bare = sides[0][:0] if shares is None else sides[0][paired & (shares[0].area == 0)]
    others.append((f"of {order[0]} are in no face and have no area", bare))
    tell_unmatched(order, sides, others, partners, most, float(distance.min()), lost)
    chosen, other = np.flatnonzero(paired), partner[paired]
    first, second = points[0][chosen], points[1][other]
    between = (first + second) / 2
    if normal is not None:
        normals = given_normals(normal, len(paired))[chosen]
    elif shares is not None:
        normals = shares[0].normal[chosen]
    else:
        normals = normals_of(between, second - first, about if n_sectors else None)
    along = tangents_of(normals, tangential)
    axes = np.stack([along, np.cross(normals, along), normals], axis=1)
    nodes = np.column_stack([sides[0][chosen], sides[1][other]])
    known = None if shares is None else shares[0].area[chosen]
    joined = joined_of(model, places, nodes[:, 0]) if known is None else None
    areas = areas_of(area, between, normals, chosen, len(paired), joined, known)
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


def _components(places: Places, node: int, point: FloatArray, about: int) -> dict[str, FloatArray]:
    """Unit vectors of the displacements of a node at a point, by the names of its places.

    Cartesian directions of the next sector are components in the axes of this one.
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
    vector: FloatArray, one: dict[str, FloatArray], two: dict[str, FloatArray], beyond: bool
) -> dict[Any, float]:
    """Weights of the displacement of one node less that of another along a direction."""
    result: dict[Any, float] = {}
    for sign, side in ((1.0, one), (-1.0, two)):
        for place, unit in side.items():
            weight = sign * float(unit @ vector)
            if abs(weight) > 1e-12:
                result[next_sector(place) if beyond and sign < 0 else place] = weight
    return result
