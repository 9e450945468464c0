"""Motions of a sector that the others repeat one after the other: interfaces, waves, its blade.

In a wave of ``n`` nodal diameters each sector lags the one before by ``n phi``, ``phi = 2 pi / N``.
The right interface of a sector is the left one of the next: ``u_R = R u_L exp(-i n phi)``.
"""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.linear import RelativeCoordinates, components, phasors, turn
from symhbm.model.places import Places
from symhbm.model.records import record
from symhbm.numerics import ComplexArray, FloatArray, check

_AXES = "xyz"
_CARTESIAN = "x", "y", "z", "rx", "ry", "rz"
_AMID = 1.5
"""Distance of a node from the joined ones, over that of their neighbours, that is beside them."""
_TOGETHER = 1e-4
"""Distance of two places of one node, over the size of the structure, that a mesh may leave."""


@record
class Interfaces(NamedTuple):
    """How the sectors of a disk hang together.

    ``left`` and ``right`` (n,) are degrees of freedom of a sector; ``others`` (n_kept,) those that
    are not right, ascending; ``rotation`` (n_dof, n_dof), sparse, turns a motion by one sector.
    Where displacements of contacts take the place of some of the others, ``relative`` tells which,
    and the ``directions`` (n_rows, 2 n_dof) of all displacements in this sector and in the next.
    """

    n_sectors: int
    left: NDArray[np.intp]
    right: NDArray[np.intp]
    others: NDArray[np.intp]
    rotation: Any
    relative: RelativeCoordinates | None = None
    directions: Any = None

    def expansion(self, n: int) -> Any:
        """Motion of all degrees of freedom from that of the ``others``, (n_dof, n_kept), sparse.

        Raises ValueError as `RelativeCoordinates.change`.
        """
        joined = self._joined(n)
        if self.relative is None:
            return joined
        alone = self._replace(relative=None)
        return (joined @ self.relative.change(alone.displacements(n, self.directions))).tocsr()

    @property
    def parts(self) -> tuple[Any, Any]:
        """Motion of all by that of the ``others`` in this sector and in the next, sparse each."""
        every: Any = sp.eye_array(self.rotation.shape[0], format="csr")
        own = every[:, self.others]
        places = np.arange(len(self.right))
        shape = self.rotation.shape[0], len(places)
        at = sp.csr_array((np.ones(len(places)), (self.right, places)), shape)
        return own, at @ self.rotation[self.left] @ own

    def _joined(self, n: int) -> Any:
        own, beyond = self.parts
        return (own + turn(n, self.n_sectors) * beyond).tocsr()

    def everywhere(self, rows: Any) -> Any:
        """Rows (n_rows, n_kept) over the ``others`` as rows (n_rows, n_dof) over all, sparse."""
        result: Any = sp.lil_array((rows.shape[0], self.rotation.shape[0]))
        result[:, self.others] = rows
        return result.tocsr()

    def seen(self, name: str, rows: Any) -> Any:
        """Rows (n_rows, n_dof) of an output, by ``name``, as rows over the ``others``.

        ValueError where it reads a degree of freedom that is right.
        """
        right = np.intersect1d(np.unique(rows.nonzero()[1]), self.right)
        if right.size:
            raise ValueError(
                f"outputs[{name!r}]: expected degrees of freedom that are not right, {right[0]} "
                "is; weigh that of left at the same place, which is its of the next sector"
            )
        return rows[:, self.others]

    def displacements(self, n: int, directions: Any) -> Any:
        """Rows (n_rows, n_kept) of directions (n_rows, 2 n_dof) in this sector and in the next."""
        n_dof = self.rotation.shape[0]
        beyond = turn(n, self.n_sectors) * (directions[:, n_dof:] @ self.rotation)
        return ((directions[:, :n_dof] + beyond) @ self.expansion(n)).tocsr()

    def touched(self, directions: Any) -> set[int]:
        """Degrees of freedom, of the ``others``, that directions (n_rows, 2 n_dof) act on."""
        n_dof, named = self.rotation.shape[0], abs(directions)
        whole = named[:, :n_dof] + named[:, n_dof:] @ abs(self.rotation)
        columns = (whole @ abs(self.expansion(0))).nonzero()[1]
        return {*self.others[np.unique(columns)].tolist()}

    def felt(self, part: FloatArray, n: int, harmonic: int) -> FloatArray:
        """Coefficients of a force in one harmonic as the ``others`` feel it in a wave."""
        return components(self.folded(phasors(part), n), harmonic)

    def folded(self, force: ComplexArray, n: int) -> ComplexArray:
        """A force on a sector (n_dof, n) as the ``others`` feel it in a wave, ``B^H f``."""
        return self.expansion(n).conj().T @ force


def rotation_of(
    places: Places | None, n_dof: int, axis: str | None, n_sectors: int
) -> tuple[Any, NDArray[np.bool_]]:
    """Rotation of motions by one sector, sparse (n_dof, n_dof), and where it is known, (n_dof,).

    It is not where a node has one of the two directions across the axis alone. Raises ValueError
    for an axis that is none, or without places.
    """
    known = np.ones(n_dof, dtype=bool)
    if axis is None:
        return sp.eye_array(n_dof, format="csr"), known
    if axis not in (*_AXES,):
        raise ValueError(
            f"rotation={check.shown(axis)}: expected 'x', 'y' or 'z', or None where directions are "
            "radial, tangential and axial"
        )
    if places is None:
        raise ValueError(
            f"rotation={axis!r}: expected a structure whose places tell directions and nodes; None "
            "where directions are radial, tangential and axial"
        )
    first, second = _AXES[(_AXES.index(axis) + 1) % 3], _AXES[(_AXES.index(axis) + 2) % 3]
    at = {(node, way): i for i, (node, way) in enumerate(_named(places))}
    phi = 2 * np.pi / n_sectors
    rows, columns, values = [], [], []
    for (node, way), i in at.items():
        kind, letter = way[:-1], way[-1:]
        pair = at.get((node, f"{kind}{first}")), at.get((node, f"{kind}{second}"))
        if kind not in ("", "r") or letter not in (first, second):
            rows, columns, values = [*rows, i], [*columns, i], [*values, 1.0]
        elif None in pair:
            known[i] = False
        else:
            c, s = np.cos(phi), np.sin(phi)
            rows += [i, i]
            columns += pair
            values += [c, -s] if letter == first else [s, c]
    return sp.csr_array((values, (rows, columns)), shape=(n_dof, n_dof)), known


def paired(
    places: Places | None, left: str, right: str, axis: str, n_sectors: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Degrees of freedom of two sets of nodes, of which the right one is a sector further.

    Raises ValueError for structures without coordinates and for nodes that have no partner.
    """
    from scipy.spatial import KDTree  # slow to import

    if places is None or places.coordinates is None:
        raise ValueError("structure: expected places with coordinates, by which labels are paired")
    nodes = [places.nodes_of(label) for label in (left, right)]
    points = [places.coordinates[[places.dofs_of(int(node))[0] for node in side]] for side in nodes]
    turned = points[0] @ turn_about(axis, 2 * np.pi / n_sectors).T
    gap, partner = map(np.asarray, KDTree(turned).query(points[1]))
    near = gap <= _TOGETHER * np.abs(places.coordinates).max()
    if len(nodes[0]) != len(nodes[1]) or not near.all() or len({*partner.tolist()}) < len(partner):
        opposite = turned @ turn_about(axis, -4 * np.pi / n_sectors).T
        back = np.asarray(KDTree(opposite).query(points[1])[0])
        hint = "; exchange the two" if (back < gap).all() else ""
        raise ValueError(
            f"left={left!r}, right={right!r}: expected each node of right where one of left is "
            f"turned by {360 / n_sectors:g} degrees about {axis}, {np.count_nonzero(near)} of "
            f"{len(nodes[1])} are, of {len(nodes[0])} of left{hint}"
        )
    at = {(node, way): i for i, (node, way) in enumerate(_named(places))}
    ends: tuple[list[int], list[int]] = [], []
    for one, two in zip(nodes[0][partner].tolist(), nodes[1].tolist(), strict=True):
        for way in places.direction[places.dofs_of(one)].tolist():
            if (two, way) not in at:
                raise ValueError(f"right: expected node {two} to have the direction {way!r}")
            ends[0].append(at[one, way])
            ends[1].append(at[two, way])
    return np.array(ends[0], dtype=np.intp), np.array(ends[1], dtype=np.intp)


def check_geometry(
    places: Places | None,
    left: NDArray[np.intp],
    right: NDArray[np.intp],
    axis: str | None,
    n_sectors: int,
) -> None:
    """Raise ValueError unless the places on the right are those on the left, a sector further.

    Warns of nodes beside them that are left out on both sides: the disk is cracked there.
    """
    if places is None:
        return
    names = [way for _, way in _named(places)]
    for i, j in zip(left.tolist(), right.tolist(), strict=True):
        if names[i] != names[j]:
            raise ValueError(
                f"right: expected the directions of left in the same order, degree of freedom {j} "
                f"is along {names[j]!r}, {i} along {names[i]!r}"
            )
    coordinates, ways = places.coordinates, {names[i] for i in left}
    if axis is None:
        # One direction alone may be along the axis, or along the disk.
        turned = _AXES[:2] if coordinates is not None else _CARTESIAN if len(ways) > 1 else ()
        if ways & {*turned}:
            raise ValueError(
                "rotation=None: expected the axis of the disk, 'x', 'y' or 'z', as directions of "
                "the interfaces are cartesian"
            )
        return
    if coordinates is None or not len(left):
        return
    size = np.abs(coordinates).max()
    off = _distances(coordinates, left, right, axis, 2 * np.pi / n_sectors)
    if off.max() <= _TOGETHER * size:
        _tell_cracks(places, left, right, axis, n_sectors)
        return
    if _distances(coordinates, right, left, axis, 2 * np.pi / n_sectors).max() <= _TOGETHER * size:
        raise ValueError(
            f"left, right: expected the right interface a turn about {axis} ahead of the left one, "
            "exchange the two"
        )
    worst = int(np.argmax(off))
    raise ValueError(
        f"right: expected the places of left turned by {360 / n_sectors:g} degrees about {axis}, "
        f"in the same order; degree of freedom {int(right[worst])} is {off[worst]:.3g} m from there"
    )


def _tell_cracks(
    places: Places, left: NDArray[np.intp], right: NDArray[np.intp], axis: str, n_sectors: int
) -> None:
    """Warn of nodes amid the interfaces, on both sides, that are not joined.

    Nodes farther from them than their neighbours are shrouds, where contacts may be.
    """
    from scipy.spatial import KDTree  # slow to import

    joined = np.unique(places.coordinates[left], axis=0)
    rest = np.setdiff1d(np.arange(places.n_dof), [*left, *right])
    nodes, first = np.unique(places.node[rest], return_index=True)
    if len(joined) < 2 or not len(nodes):
        return
    points = places.coordinates[rest[first]]
    on_axis = np.linalg.norm(np.delete(points, _AXES.index(axis), axis=1), axis=1) == 0
    of_joined = KDTree(joined)
    spacing = np.median(of_joined.query(joined, 2)[0][:, 1])
    near = (of_joined.query(points)[0] <= _AMID * spacing) & ~on_axis
    turned = points @ turn_about(axis, 2 * np.pi / n_sectors).T
    gap, twin = KDTree(points).query(turned)
    apart = near & (gap <= _TOGETHER * np.abs(places.coordinates).max())
    if apart.any():
        j = int(np.argmax(apart))
        pair = int(np.atleast_1d(twin)[j])
        check.warn(
            f"left, right: {apart.sum()} nodes beside the left interface are left out, and those "
            f"at the same places of the next sector (the first: {nodes[j]} and {nodes[pair]}); "
            "the disk is cracked there"
        )


def turn_about(axis: str, angle: float) -> NDArray:
    """Matrix that turns vectors about an axis."""
    k = _AXES.index(axis)
    i, j = (k + 1) % 3, (k + 2) % 3
    turned = np.eye(3)
    turned[[i, i, j, j], [i, j, i, j]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
    return turned


def _distances(
    coordinates: NDArray, left: NDArray[np.intp], right: NDArray[np.intp], axis: str, angle: float
) -> NDArray:
    """How far the places of ``right`` are from those of ``left`` turned about an axis, (n,)."""
    turned = coordinates[left] @ turn_about(axis, angle).T
    return np.linalg.norm(turned - coordinates[right], axis=1)


def _named(places: Places) -> list[tuple[int, str]]:
    return list(zip(places.node.tolist(), places.direction.tolist(), strict=True))


@record
class Blade(NamedTuple):
    """The blade of a sector, for deviations of it.

    ``stiffness`` and ``mass`` (n_dof, n_dof), what of the matrices is the blade's; ``frequencies``
    (n_modes,), natural frequencies of the blade held at its root [Hz]; ``rows`` (n_modes, n_dof),
    coordinates [m kg^1/2] of these modes, of unit mass, from the motion.
    """

    stiffness: FloatArray
    mass: FloatArray
    frequencies: FloatArray
    rows: FloatArray
