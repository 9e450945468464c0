"""Where degrees of freedom are, a table of their nodes and directions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symhbm.model.mesh import elastic_of, stress_rows
from symhbm.model.places.names import DIRECTIONS, RELATIVE, Place, check_name, node_numbers, texts
from symhbm.model.records import Record
from symhbm.numerics import check


@dataclass(frozen=True, eq=False, repr=False)
class Places(Record):
    """Where the degrees of freedom of a structure are, one entry for each, in their order.

    Parameters
    ----------
    node : (n_dof,)
        Number of the node.
    direction : (n_dof,)
        ``"x"``, ``"y"``, ``"z"``, ``"rx"``, ``"ry"``, ``"rz"``, ``"radial"``, ``"tangential"`` or
        ``"axial"``; one for all where they have the same.
    coordinates : (n_dof, 3)
        Where the node is [m], if known.
    label : (n_dof,)
        Name of the node or of the set of nodes it is in, ``""`` for none.
    mesh
        The mesh whose nodes these are, a ``symhbm.model.mesh.Mesh``: it tells coordinates, and
        names of its sets and surfaces, which may share nodes, are names of nodes here.
    program
        What else the finite-element program told, a ``symhbm.model.mesh.Program``.

    Raises
    ------
    TypeError, ValueError
        For columns of different lengths, unknown directions, a direction of a node that comes
        twice, coordinates of one node that differ, and labels that are numbers or hold a colon.

    Examples
    --------
    >>> import symhbm as sh
    >>> places = sh.Places(node=[7, 7, 9], direction=["x", "y", "x"], label=["tip", "tip", ""])
    >>> places.number("tip:y"), places.number("9:x")
    (1, 2)
    """

    node: Any
    direction: Any
    coordinates: Any = None
    label: Any = None
    mesh: Any = None
    program: Any = None

    def __post_init__(self):
        node = node_numbers("node", self.node)
        if node.ndim != 1 or not node.size:
            raise ValueError(f"node={check.shown(self.node)}: expected one integer per DOF")
        n = node.size
        label = texts("label", "" if self.label is None else self.label, n)
        columns: dict[str, NDArray] = dict(
            node=node, direction=texts("direction", self.direction, n), label=label
        )
        for text in {*columns["direction"].tolist()}:
            check.one_of("direction", text, (*DIRECTIONS, RELATIVE))
        for text in {*label.tolist()}:
            if ":" in text or text.lstrip("+-").isdigit():
                raise ValueError(f"label={text!r}: expected no number, and no colon")
        if self.mesh is not None and not np.isin(node[node >= 0], self.mesh.node).all():
            raise ValueError("node: expected nodes of the mesh")
        coordinates = self.coordinates
        if self.mesh is not None and coordinates is None:
            coordinates = self.mesh.points(node)
        if coordinates is not None:
            columns["coordinates"] = check.array("coordinates", coordinates)
            if columns["coordinates"].shape != (n, 3):
                raise ValueError(
                    f"coordinates: expected shape {(n, 3)}, got {columns['coordinates'].shape}"
                )
        for name, column in columns.items():
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        self._check_nodes()

    def _check_nodes(self) -> None:
        """Raise ValueError where two degrees of freedom of a node do not go together."""
        order = np.lexsort((self.direction, self.node))
        node, direction = self.node[order], self.direction[order]
        same = node[1:] == node[:-1]
        twice = same & (direction[1:] == direction[:-1])
        if twice.any():
            j = int(np.argmax(twice))
            raise ValueError(
                f"direction: expected each direction of a node once, node {node[j]} has "
                f"{str(direction[j])!r} twice"
            )
        for name in ("label", "coordinates"):
            values = getattr(self, name)
            if values is None:
                continue
            values = values[order].reshape(len(order), -1)
            apart = same & (values[1:] != values[:-1]).any(axis=1)
            if apart.any():
                raise ValueError(f"{name}: node {node[np.argmax(apart)]} has different ones")

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom."""
        return len(self.node)

    def __len__(self) -> int:
        return self.n_dof

    def __repr__(self) -> str:
        labels = check.brief([*self.labels], "labels")[1:-1] or "none"
        return (
            f"Places: {self.n_dof} degrees of freedom of {self.nodes.size} nodes; labels: {labels}"
        )

    @cached_property
    def nodes(self) -> NDArray[np.int64]:
        """Numbers of the nodes, ascending."""
        _, node = self._by_node
        return node[np.append(True, np.diff(node) > 0)]

    @cached_property
    def labels(self) -> dict[str, NDArray[np.int64]]:
        """The nodes that each label, set and surface is of, ascending."""
        named = np.flatnonzero(self.label != "")
        texts, node = self.label[named], self.node[named]
        sets = {} if self.mesh is None else self.mesh.names
        own = {str(text): np.unique(node[texts == text]) for text in np.unique(texts)}
        return {name: nodes[np.isin(nodes, self.nodes)] for name, nodes in sets.items()} | own

    @cached_property
    def _by_node(self) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
        order = np.argsort(self.node, kind="stable")
        return order, self.node[order]

    def dofs_of(self, node: int) -> NDArray[np.intp]:
        """Degrees of freedom of a node; none of one that is not here."""
        order, sorted_nodes = self._by_node
        return order[slice(*np.searchsorted(sorted_nodes, [node, node + 1]))]

    def nodes_of(self, name: object) -> NDArray[np.int64]:
        """The nodes of a label, of a number or of several numbers; KeyError for unknown ones."""
        if isinstance(name, str) and name in self.labels:
            if not self.labels[name].size:
                raise KeyError(f"{name} is a set of nodes without degrees of freedom")
            return self.labels[name]
        if isinstance(name, str):
            digits = name.lstrip("+-").isdigit()
            given = np.array([int(name)]) if digits else None
        else:
            given = node_numbers("node", name)
        if given is None or not np.isin(given, self.nodes).all():
            unknown = name if given is None else given[~np.isin(given, self.nodes)][0]
            raise KeyError(f"{unknown!s} is no node and no label of one{self._near(str(unknown))}")
        return given

    def number(self, place: Place) -> int:
        """The number of a degree of freedom; KeyError for the name of none or of several."""
        if not isinstance(place, str):
            return check.integer("place", place, 0, self.n_dof - 1)
        owner, _, direction = check_name("place", place).partition(":")
        nodes = self.nodes_of(owner)
        if len(nodes) > 1:
            several = ", ".join(map(str, nodes[:5])) + (", ..." if len(nodes) > 5 else "")
            raise KeyError(f"{place!r} is of the nodes {several}; say which, as '{nodes[0]}:x'")
        dofs = self.dofs_of(int(nodes[0]))
        known = self.direction[dofs].tolist()
        if direction not in known:
            raise KeyError(f"{place!r} is no place; {owner} has {', '.join(known)}")
        return int(dofs[known.index(direction)])

    def name(self, dof: int) -> str:
        """Name of a degree of freedom: by its label, where no other node has it, or its node."""
        label = str(self.label[dof])
        alone = label and len(self.labels[label]) == 1
        return f"{label if alone else self.node[dof]}:{self.direction[dof]}"

    def _near(self, name: str) -> str:
        """Text that tells the nearest names, empty where none is near."""
        if name.lstrip("+-").isdigit():
            distance = np.abs(self.nodes - int(name))
            near = self.nodes[np.argsort(distance, kind="stable")[:2]].tolist()
        else:
            near = get_close_matches(name, self.labels, n=3, cutoff=0.4) or [*self.labels][:3]
        return f"; the nearest are {', '.join(map(repr, near))}" if near else ""

    def of(self, dofs: ArrayLike) -> Places:
        """The places of some degrees of freedom, in their order."""
        chosen = np.asarray(dofs, dtype=np.intp)
        parts = (self.node, self.direction, self.coordinates, self.label)
        columns = [None if part is None else part[chosen] for part in parts]
        return Places(*columns, mesh=self.mesh, program=self.program)

    def beside(self, rows: ArrayLike, labels: list[str], coordinates: Any) -> Places:
        """These places, and after them displacements ``rows`` of contacts, which have no node.

        Theirs are -1 and below, their direction is ``"relative"``.
        """
        columns: dict[str, Any] = dict(
            node=-1 - np.asarray(rows), direction=np.full(len(labels), RELATIVE), label=labels
        )
        if coordinates is not None:
            columns["coordinates"] = coordinates
        whole = {n: np.concatenate([getattr(self, n), c]) for n, c in columns.items()}
        return Places(**whole, mesh=self.mesh, program=self.program)

    def centrifugal_load(self, speed: float) -> NDArray:
        """Load of rotation at a speed [1/min], (n_dof,) [N], for `symhbm.forces.StaticLoad`.

        That of the place of each node where the structure was at rest. ValueError where mesh,
        densities or axis are not known, or directions are not x, y and z.
        """
        program, speed = self.program, check.scalar("speed", speed, "non-negative")
        axes = ("x", "y", "z")
        if program is None or program.moment is None or program.axis is None:
            raise ValueError("places: expected a mesh with densities, and the axis of rotation")
        if not np.isin(self.direction, axes).all():
            raise ValueError("places: expected the directions x, y and z")
        way = np.searchsorted(axes, self.direction)
        pull = np.where(self.direction == program.axis, 0.0, 1.0)
        return (2 * np.pi / 60 * speed) ** 2 * pull * program.moment[self.mesh.at(self.node), way]

    def stress(
        self, nodes: Any, *, held: Any = (), modulus: Any = None, poisson: Any = None
    ) -> dict[str, Any]:
        """Stresses at nodes as linear outputs, of a structure of solids whose places have a mesh.

        Slopes of displacements at two Gauss points along each axis of an element go on linearly to
        its nodes, as CalculiX does; a node has the mean of its solid elements, of which those of
        other sectors are not here. Without the stresses of a preload.

        Parameters
        ----------
        nodes
            Name of a set, or numbers of nodes of the mesh, supports among them.
        held
            Name of a set, or numbers of nodes, whose displacements are 0 where they are no degree
            of freedom: supports, of which import knows those of decks of CalculiX.
        modulus, poisson
            Young's modulus [N/m^2] and Poisson's ratio; by default those of the elements at these
            nodes, which need to be the same.

        Returns
        -------
        Sparse rows (n_nodes, n_dof) [N/m^3] for `Structure.with_outputs` by component, ``"xx"``,
        ``"yy"``, ``"zz"``, ``"xy"``, ``"yz"`` and ``"zx"``, of the nodes of a set in ascending
        order.

        Raises
        ------
        KeyError, ValueError
            For unknown nodes, those of no solid, materials that are not known or differ, and
            stresses that need a displacement that is neither a degree of freedom nor held.

        Examples
        --------
        >>> import numpy as np
        >>> import symhbm as sh
        >>> from symhbm.model.mesh import Mesh
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> mesh = Mesh([1, 2, 3, 4], corners, {"tetra": [[1, 2, 3, 4]]})
        >>> places = sh.Places(node=[2, 2, 2], direction=["x", "y", "z"], mesh=mesh)
        >>> stress = places.stress(2, held=[1, 3, 4], modulus=2.6e11, poisson=0.3)
        >>> (stress["xy"] @ [0, 1e-3, 0]).round(-3)
        array([1.e+08])
        """
        if self.mesh is None:
            raise ValueError("places: expected a mesh")
        chosen = self._of_mesh("nodes", nodes)
        if not chosen.size:
            raise ValueError(f"nodes={check.shown(nodes)}: expected one node at least")
        materials = {} if self.program is None else self.program.materials or {}
        elastic = elastic_of(self.mesh, chosen, materials, (modulus, poisson))
        supports = self._of_mesh("held", held)
        dof_of = np.full((len(self.mesh.node), 3), -2)
        dof_of[self.mesh.at(supports)] = -1
        if self.program is not None and self.program.held is not None:
            node, way = np.asarray(self.program.held, dtype=int).reshape(-1, 2).T
            dof_of[self.mesh.at(node), way] = -1
        for way, letter in enumerate(("x", "y", "z")):
            dofs = np.flatnonzero((self.direction == letter) & (self.node >= 0))
            dof_of[self.mesh.at(self.node[dofs]), way] = dofs
        return stress_rows(self.mesh, chosen, dof_of, self.n_dof, elastic)

    def _of_mesh(self, what: str, given: Any) -> NDArray[np.int64]:
        """Numbers of nodes of the mesh, from the name of a set, or from numbers or names."""
        if isinstance(given, str):
            check.known(given, self.mesh.names, f"set of {what}")
            return self.mesh.names[given]
        nodes = node_numbers(what, given) if np.size(given) else np.zeros(0, dtype=np.int64)
        unknown = nodes[~np.isin(nodes, self.mesh.node)]
        if unknown.size:
            raise KeyError(f"{what}: {unknown[0]} is no node of the mesh")
        return nodes

    def labelled(self, names: Mapping[str, Any]) -> Places:
        """The same places with labels ``{name: node}``, or ``{name: nodes}`` of a set of them.

        Raises KeyError for unknown nodes, ValueError for a node of two names.
        """
        check.instance("names", names, Mapping, "{label: node or nodes}")
        label, named = self.label.astype(object), set[int]()
        for text, nodes in names.items():
            of_name = self.nodes_of(nodes)
            if named & {*of_name.tolist()}:
                raise ValueError(f"names[{text!r}]: expected nodes of no other name")
            named |= {*of_name.tolist()}
            label[np.isin(self.node, of_name)] = str(text)
        return replace(self, label=label)


def check_places(given: Any, n_dof: int) -> Places | None:
    """The table of places of ``n_dof`` degrees of freedom, from `Places` or its columns by name."""
    if isinstance(given, Mapping):
        for name in given:
            check.known(
                str(name), ("node", "direction", "coordinates", "label"), "column of places"
            )
        for name in ("node", "direction"):
            if name not in given:
                raise ValueError(f"places: expected the column {name!r}")
        given = Places(**given)
    if given is not None and not isinstance(given, Places):
        raise TypeError(
            f"places={check.shown(given)}: expected symhbm.Places(node, direction, ...)"
        )
    if given is not None and given.n_dof != n_dof:
        raise ValueError(f"places: expected {n_dof} (one per degree of freedom), got {given.n_dof}")
    return given
