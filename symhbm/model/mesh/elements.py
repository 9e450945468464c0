"""Finite elements by reference cells: shape functions, quadratures, and faces that look outwards.

Kinds and the order of their nodes are those of VTK and meshio, which are those of Abaqus and
CalculiX; faces have the order of the latter.
"""

from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from symhbm.numerics import FloatArray

Faces = tuple[tuple[str, tuple[int, ...]], ...]
_SQUARE = (-1, -1), (1, -1), (1, 1), (-1, 1)
_TRIANGLE = (0, 0), (1, 0), (0, 1)
_RING = (0, 1), (1, 2), (2, 3), (3, 0)
_CELLS = {
    "triangle": (_TRIANGLE, ((0, 1), (1, 2), (2, 0)), ((0, 1, 2),)),
    "quad": (_SQUARE, _RING, ((0, 1, 2, 3),)),
    "tetra": (
        ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
        ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    ),
    "wedge": (
        tuple((*corner, z) for z in (-1, 1) for corner in _TRIANGLE),
        ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
        ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    ),
    "hexahedron": (
        tuple((*corner, z) for z in (-1, 1) for corner in _SQUARE),
        (*_RING, (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
        ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    ),
}
"""Corners, edges, and faces by their corners, of which the right hand tells the outside."""
_QUADRATIC = {
    "triangle": "triangle6",
    "quad": "quad8",
    "tetra": "tetra10",
    "wedge": "wedge15",
    "hexahedron": "hexahedron20",
}


class Element(NamedTuple):
    """A kind of element, of the order 1 or 2.

    ``points`` (n_nodes, n_axes) are its nodes in the reference cell, ``powers`` (n_nodes, n_axes)
    the exponents of its polynomials, ``faces`` their kinds and the numbers of their nodes.
    """

    cell: str
    order: int
    points: FloatArray
    powers: NDArray[np.intp]
    faces: Faces

    @property
    def n_axes(self) -> int:
        """2 of faces, 3 of solids."""
        return self.points.shape[1]

    def shape(self, at: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Shape functions (n, n_nodes) at points (n, n_axes), and slopes (n, n_axes, n_nodes)."""
        weights = np.linalg.inv(_monomials(self.points, self.powers))
        slopes = []
        for axis in range(self.n_axes):
            lower = self.powers - np.eye(self.n_axes, dtype=int)[axis]
            factor = self.powers[:, axis]
            slopes.append(factor * _monomials(at, np.maximum(lower, 0)) @ weights)
        return _monomials(at, self.powers) @ weights, np.stack(slopes, axis=1)

    def quadrature(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Points (n, n_axes) and weights (n,), ``count`` of Gauss along each axis."""
        at, weight = leggauss(count)
        grid = np.array([*product(at, repeat=self.n_axes)])
        weights = np.prod([*product(weight, repeat=self.n_axes)], axis=1)
        collapsed = {"triangle": 2, "tetra": 3, "wedge": 2}.get(self.cell, 0)
        if collapsed:
            # A square whose side shrinks to a corner: its points are those of the triangle.
            part = (1 + grid[:, :collapsed]) / 2
            left = np.cumprod(1 - part, axis=1)
            grid[:, 0], grid[:, 1:collapsed] = part[:, 0], part[:, 1:] * left[:, :-1]
            weights = weights * np.prod(left[:, :-1], axis=1) / 2**collapsed
        return grid, weights


def _monomials(at: FloatArray, powers: NDArray[np.intp]) -> FloatArray:
    return np.prod(at[:, None, :] ** powers, axis=2)


@cache
def _made() -> dict[str, Element]:
    result = {}
    for cell, (corners, edges, faces) in _CELLS.items():
        points = np.array(corners, dtype=float)
        middles = points[np.array(edges)].mean(axis=1)
        midside = {frozenset(edge): len(corners) + i for i, edge in enumerate(edges)}
        linear, quadratic = [], []
        for face in faces:
            kind = "triangle" if len(face) == 3 else "quad"
            around = zip(face, face[1:] + face[:1], strict=True)
            between = tuple(midside[frozenset(edge)] for edge in around)
            linear.append((kind, face))
            quadratic.append((_QUADRATIC[kind], face + between))
        powers = [_powers(cell, order) for order in (1, 2)]
        result[cell] = Element(cell, 1, points, powers[0], tuple(linear))
        both = np.vstack([points, middles])
        result[_QUADRATIC[cell]] = Element(cell, 2, both, powers[1], tuple(quadratic))
    return result


def _powers(cell: str, order: int) -> NDArray[np.intp]:
    """Exponents of the polynomials of a cell, serendipity ones of squares and cubes."""
    n_axes = len(_CELLS[cell][0][0])
    every = np.array([*product(range(order + 1), repeat=n_axes)])
    sums = every.sum(axis=1)
    if cell in ("triangle", "tetra"):
        return every[sums <= order]
    if cell == "wedge":
        return every[every[:, :2].sum(axis=1) <= np.where(every[:, 2] < 2, order, 1)]
    return every[np.where(every > 1, every, 0).sum(axis=1) <= order]


def element(kind: str) -> Element:
    """The element of a kind; KeyError for one that is not known."""
    return _made()[kind]


def kinds() -> tuple[str, ...]:
    """All kinds of elements."""
    return tuple(_made())
