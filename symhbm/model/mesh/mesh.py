"""Meshes of finite elements: where nodes are, elements and their faces, named sets of both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from symhbm.model.mesh.elements import element, kinds
from symhbm.model.records import Record
from symhbm.numerics import FloatArray, check

_EXACT = 8
"""Gauss points along each axis of a face: those of curved ones are integrated to round-off."""

Blocks = Mapping[str, Any]
"""Numbers of nodes (n, n_nodes) of elements or faces, by their kind."""


class Shares(NamedTuple):
    """What nodes have of faces, (n_nodes,) and (n_nodes, 3): area [m^2], and the normal there."""

    area: FloatArray
    normal: FloatArray


class Weights(NamedTuple):
    """Mass (n_nodes,) [kg] and moments (n_nodes, 3) [kg m] of nodes, mass of elements by kind."""

    mass: FloatArray
    moment: FloatArray
    elements: dict[str, FloatArray]


def _ascending(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Each number once; most sets have them in order already."""
    return nodes if nodes.ndim == 1 and np.all(np.diff(nodes) > 0) else np.unique(nodes)


@dataclass(frozen=True, eq=False, repr=False)
class Mesh(Record):
    """Nodes, elements and named sets of them, as a finite-element program has them.

    Parameters
    ----------
    node : (n_nodes,)
        Numbers of the nodes, in any order.
    coordinates : (n_nodes, 3)
        Where they are [m].
    elements : {kind: (n_elements, n)}
        Numbers of the nodes of each element, by the kinds of meshio: ``"tetra"``, ``"tetra10"``,
        ``"wedge"``, ``"wedge15"``, ``"hexahedron"``, ``"hexahedron20"``; also ``"triangle"``,
        ``"triangle6"``, ``"quad"``, ``"quad8"``.
    sets : {name: (n,)}
        Numbers of nodes by the names of sets, which may share nodes.
    surfaces : {name: {kind: (n_faces, n)}}
        Faces of elements by the names of surfaces, as numbers of their nodes.
    materials : {kind: (n_elements,)}
        Name of the material of each element, ``""`` where nobody told it.

    Raises
    ------
    TypeError, ValueError, KeyError
        For nodes that come twice, unknown kinds, and sets, elements or faces of unknown nodes.

    Examples
    --------
    >>> from symhbm.model.mesh import Mesh
    >>> corners = [[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]]
    >>> mesh = Mesh([1, 2, 3, 4], corners, {"quad": [[1, 2, 3, 4]]}, {"edge": [1, 2]})
    >>> mesh.shares({"quad": [[1, 2, 3, 4]]}).area
    array([0.5, 0.5, 0.5, 0.5])
    """

    node: Any
    coordinates: Any
    elements: Any = field(default_factory=dict)
    sets: Any = field(default_factory=dict)
    surfaces: Any = field(default_factory=dict)
    materials: Any = field(default_factory=dict)

    def __post_init__(self):
        node = np.asarray(self.node, dtype=np.int64)
        order = np.argsort(node, kind="stable")
        if node.ndim != 1 or np.any(np.diff(node[order]) == 0):
            raise ValueError("node: expected the number of each node once")
        coordinates = check.array("coordinates", self.coordinates)
        if coordinates.shape != (len(node), 3):
            raise ValueError(f"coordinates: expected shape {(len(node), 3)}")
        of = dict(node=node[order], coordinates=coordinates[order])
        for name, values in of.items():
            object.__setattr__(self, name, values)
        whole: dict[str, Any] = {"elements": self._blocks("elements", self.elements)}
        whole["surfaces"] = {
            str(name): self._blocks(f"surfaces[{name!r}]", faces)
            for name, faces in self.surfaces.items()
        }
        whole["sets"] = {
            str(name): _ascending(self._known(f"sets[{name!r}]", nodes))
            for name, nodes in self.sets.items()
        }
        for kind, names in self.materials.items():
            check.known(kind, whole["elements"], "kind of materials")
            if np.shape(names) != (len(whole["elements"][kind]),):
                raise ValueError(f"materials[{kind!r}]: expected one name for each element")
        whole["materials"] = {kind: np.asarray(each, str) for kind, each in self.materials.items()}
        for name, values in whole.items():
            object.__setattr__(self, name, values)

    def _blocks(self, name: str, given: Blocks) -> dict[str, NDArray[np.int64]]:
        for kind, block in given.items():
            check.known(kind, kinds(), f"kind of {name}")
            size = len(element(kind).points)
            if np.ndim(block) != 2 or np.shape(block)[1] != size:
                raise ValueError(f"{name}[{kind!r}]: expected {size} nodes in each row")
        return {kind: self._known(name, block) for kind, block in given.items()}

    def _known(self, name: str, nodes: Any) -> NDArray[np.int64]:
        given = np.asarray(nodes, dtype=np.int64)
        unknown = given[~np.isin(given, self.node)]
        if unknown.size:
            raise ValueError(f"{name}: {unknown.flat[0]} is no node of the mesh")
        return given

    def __repr__(self) -> str:
        count = {kind: len(block) for kind, block in self.elements.items()}
        return f"Mesh: {len(self.node)} nodes, elements {count}, sets {check.brief([*self.sets])}"

    def at(self, nodes: ArrayLike) -> NDArray[np.intp]:
        """Where nodes are among those of the mesh, which are ascending."""
        return np.searchsorted(self.node, nodes)

    def points(self, nodes: ArrayLike) -> FloatArray:
        """Coordinates (..., 3) of nodes [m]."""
        return self.coordinates[self.at(nodes)]

    @cached_property
    def names(self) -> dict[str, NDArray[np.int64]]:
        """Nodes of all sets and surfaces, ascending; of a name of both, those of the set."""
        faces = {
            name: np.unique(np.concatenate([*map(np.ravel, blocks.values()), np.zeros(0, int)]))
            for name, blocks in self.surfaces.items()
        }
        return faces | self.sets

    @cached_property
    def skin(self) -> dict[str, NDArray[np.int64]]:
        """Faces of one solid alone, and of plane elements: the outside."""
        faces: dict[str, list[NDArray]] = {}
        for kind, block in self.elements.items():
            for face, nodes in element(kind).faces:
                faces.setdefault(face, []).append(block[:, list(nodes)])
        result = {}
        for kind, blocks in faces.items():
            every = np.concatenate(blocks)
            corners = np.sort(every[:, : 3 if element(kind).cell == "triangle" else 4], axis=1)
            order = np.lexsort(corners.T)
            same = np.all(np.diff(corners[order], axis=0) == 0, axis=1)
            alone = np.ones(len(every), dtype=bool)
            alone[order[1:][same]] = alone[order[:-1][same]] = False
            result[kind] = every[alone]
        return result

    @property
    def n_hanging(self) -> int:
        """Number of faces at which a linear and a quadratic element meet."""
        count = 0
        for linear, quadratic in (("triangle", "triangle6"), ("quad", "quad8")):
            if {linear, quadratic} <= {*self.skin}:
                n = len(element(linear).points)
                both = [
                    np.unique(np.sort(self.skin[k][:, :n]), axis=0) for k in (linear, quadratic)
                ]
                whole = np.concatenate(both)
                count += len(whole) - len(np.unique(whole, axis=0))
        return count

    def faces_of(self, name: Any, nodes: ArrayLike) -> dict[str, NDArray[np.int64]]:
        """Faces of a surface, by its name, or else those of the skin whose nodes are all given."""
        if isinstance(name, str) and name in self.surfaces:
            return self.surfaces[name]
        inside = {kind: np.isin(faces, nodes).all(axis=1) for kind, faces in self.skin.items()}
        return {kind: self.skin[kind][chosen] for kind, chosen in inside.items() if chosen.any()}

    def shares(self, faces: Blocks) -> Shares:
        """What each node of the mesh has of some faces.

        Of linear faces the integral of its shape function. That of the corners of quadratic ones is
        negative or nothing, which a contact cannot have: nodes have the area of a face as the
        integrals of the squares of their shape functions. Normals point outwards, of faces that
        meet at a node the mean; 0 of nodes in no face.
        """
        area, normal = np.zeros(len(self.node)), np.zeros((len(self.node), 3))
        for kind, block in faces.items():
            of, nodes = element(kind), self.at(block)
            at, weight = of.quadrature(_EXACT)
            shape, slope = of.shape(at)
            along = np.einsum("qan,fnb->afqb", slope, self.coordinates[nodes])
            upright = np.cross(along[0], along[1]) * weight[:, None]
            size = np.linalg.norm(upright, axis=2)
            share = size @ shape**of.order
            share *= (size.sum(axis=1) / share.sum(axis=1))[:, None]
            np.add.at(area, nodes, share)
            at_nodes = np.einsum("qan,fnb->afqb", of.shape(of.points)[1], self.coordinates[nodes])
            leaning = np.cross(at_nodes[0], at_nodes[1])
            leaning /= np.linalg.norm(leaning, axis=2, keepdims=True)
            np.add.at(normal, nodes, share[:, :, None] * leaning)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        return Shares(area, normal / np.where(length > 0, length, 1.0))

    def of_materials(self, values: Mapping[str, float]) -> dict[str, FloatArray]:
        """A number for each element (n_elements,) by its material, NaN where it has none."""
        result = {}
        for kind, block in self.elements.items():
            names, at = np.unique(self.materials.get(kind, [""] * len(block)), return_inverse=True)
            result[kind] = np.array([values.get(str(name), np.nan) for name in names])[at]
        return result

    def materials_at(self, nodes: ArrayLike) -> set[str]:
        """Names of the materials of elements with some of these nodes, ``""`` of untold ones."""
        names: set[str] = set()
        for kind, block in self.elements.items():
            here = np.isin(block, nodes).any(axis=1)
            known = self.materials.get(kind)
            names |= {""} if known is None and here.any() else set()
            names |= set() if known is None else {*known[here].tolist()}
        return names

    def weighed(self, density: Blocks) -> Weights:
        """Mass of nodes and of elements, and moments of nodes.

        The integrals of ``rho N`` and of ``rho N x``, of bricks with so many Gauss points as most
        programs take, two along each axis of linear ones and three of quadratic ones, of
        tetrahedra and wedges with one more, as they are collapsed squares; ``density`` (n,)
        [kg/m^3] by kind of elements.
        """
        mass, moment = np.zeros(len(self.node)), np.zeros((len(self.node), 3))
        of_elements = {}
        for kind, block in self.elements.items():
            of, nodes = element(kind), self.at(block)
            if of.n_axes < 3:
                continue
            at, weight = of.quadrature(of.order + 1 + (of.cell in ("tetra", "wedge")))
            shape, slope = of.shape(at)
            corners = self.coordinates[nodes]
            frame = np.einsum("qan,enb->eqab", slope, corners, optimize=True)
            heavy = np.linalg.det(frame) * weight * np.asarray(density[kind])[:, None]
            np.add.at(mass, nodes, heavy @ shape)
            here = np.einsum("qn,enb->eqb", shape, corners, optimize=True)
            apart = heavy[:, :, None] * here
            np.add.at(moment, nodes, np.einsum("qn,eqb->enb", shape, apart, optimize=True))
            of_elements[kind] = heavy.sum(axis=1)
        return Weights(mass, moment, of_elements)

    def gradients(self, nodes: ArrayLike) -> list[Any]:
        """Slopes along x, y and z at nodes, three sparse matrices (n, n_nodes) of values of nodes.

        Those of solids at two Gauss points along each axis, where they are nearest to the truth,
        go on linearly to the nodes of the element; a node has the mean of its elements.
        ValueError for nodes of no solid, and for elements that are flat or inside out.
        """
        row_of = np.full(len(self.node), -1)
        chosen, back = np.unique(nodes, return_inverse=True)
        row_of[self.at(chosen)] = np.arange(len(chosen))
        entries: list[FloatArray] = [np.zeros((6, 0))]
        for kind, block in self.elements.items():
            of, corners, at = element(kind), element(element(kind).cell), self.at(block)
            if of.n_axes < 3:
                continue
            at = at[(row_of[at] >= 0).any(axis=1)]
            points = of.quadrature(2)[0]
            onwards = corners.shape(of.points)[0] @ np.linalg.pinv(corners.shape(points)[0])
            slope = of.shape(points)[1]
            frame = np.einsum("qan,enb->eqab", slope, self.coordinates[at])
            if (flat := (np.linalg.det(frame) <= 0).any(axis=1)).any():
                raise ValueError(f"the element of {self.node[at[flat][0]]} is flat or inside out")
            values = np.einsum("iq,eqbn->bein", onwards, np.linalg.solve(frame, slope))
            shape = values.shape[1:]
            row = np.broadcast_to(row_of[at][:, :, None], shape)
            column = np.broadcast_to(at[:, None, :], shape)
            first = np.broadcast_to(np.arange(shape[2]) == 0, shape)
            inside = row >= 0
            every = row, column, first, *values
            entries.append(np.array([each[inside] for each in every], dtype=float))
        row, column, first, *slopes = np.concatenate(entries, axis=1)
        count = np.bincount(row.astype(int), first, minlength=len(chosen))
        if not count.all():
            raise ValueError(f"nodes: {chosen[count == 0][0]} is in no solid element")
        size, at = (len(chosen), len(self.node)), (row.astype(int), column.astype(int))
        return [sp.csr_array((each / count[at[0]], at), shape=size)[back] for each in slopes]

    def scaled(self, length: float) -> Mesh:
        """The same mesh with coordinates of which 1 is so many metres."""
        return replace(self, coordinates=length * self.coordinates)

    def with_sets(self, sets: Mapping[str, Any]) -> Mesh:
        """The same mesh with more sets of nodes."""
        return replace(self, sets={**self.sets, **sets})
