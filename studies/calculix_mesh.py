"""A bladed sector with a platform and a shroud, meshed by gmsh, as input of CalculiX.

The sector is made of blocks in radius, angle and height. A stagger turns what is far out about the
axis, more the higher it is, all sectors alike: both sides of a sector stay images of each other.
The shroud is cut where neighbours touch: the arm of one blade ends at the right side of the sector,
and its rest, the stub, stands at the left side before the other arm of the blade.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.numerics import FloatArray

RADII = 0.08, 0.15, 0.17, 0.18, 0.26, 0.28
"""Bore, rim, under and upper side of the platform, under side of the shroud, tip [m]."""
HEIGHT = 0.03
STAGGER = 6.0
"""Angle over height of the tip [rad/m]: faces of the shroud lean by 59 degrees."""
YOUNG, POISSON, DENSITY = 2e11, 0.3, 7850.0
_BLADE, _PLATFORM, _ARM, _STUB = 0.25, 0.9, 0.86, 0.92
"""Angles over half of that of the sector: half of the blade, ends of platform, arm and stub."""
_BLOCKS = {
    "disk_left": (0, 1, -1.0, -_BLADE),
    "disk": (0, 1, -_BLADE, _BLADE),
    "disk_right": (0, 1, _BLADE, 1.0),
    "neck": (1, 2, -_BLADE, _BLADE),
    "platform_left": (2, 3, -_PLATFORM, -_BLADE),
    "platform": (2, 3, -_BLADE, _BLADE),
    "platform_right": (2, 3, _BLADE, _PLATFORM),
    "blade": (3, 4, -_BLADE, _BLADE),
    "stub": (4, 5, -1.0, -_STUB),
    "arm": (4, 5, -_ARM, -_BLADE),
    "tip": (4, 5, -_BLADE, _BLADE),
    "long_arm": (4, 5, _BLADE, 1.0),
}
"""Blocks by their radii and their angles."""
_SURFACES = {
    "LEFT": lambda r, a: (a < -1 + 1e-6) & (r > RADII[0] + 1e-9),
    "RIGHT": lambda r, a: (a > 1 - 1e-6) & (r > RADII[0] + 1e-9),
    "BORE": lambda r, a: r < RADII[0] + 1e-9,
    "PLATFORM_LEFT": lambda r, a: (abs(r - RADII[2]) < 1e-9) & (a < -_BLADE + 1e-6),
    "PLATFORM_RIGHT": lambda r, a: (abs(r - RADII[2]) < 1e-9) & (a > _BLADE - 1e-6),
    "SHROUD_STUB": lambda r, a: (abs(a + _STUB) < 1e-6) & (r > RADII[4] - 1e-9),
    "SHROUD_ARM": lambda r, a: (abs(a + _ARM) < 1e-6) & (r > RADII[4] - 1e-9),
}
"""Which nodes, by radius and angle over half of that of the sector, are corners of a surface."""
_FACES = {
    1: (0, 1, 2, 3),
    2: (4, 7, 6, 5),
    3: (0, 4, 5, 1),
    4: (1, 5, 6, 2),
    5: (2, 6, 7, 3),
    6: (3, 7, 4, 0),
}
"""Corners of the faces of a brick, as CalculiX numbers them."""
_EDGES = (8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15)
"""Nodes amid the edges of a brick: where gmsh has those of CalculiX."""


class SectorMesh(NamedTuple):
    """``coordinates`` (n, 3) [m] of nodes from 1 on, ``elements`` (m, 8 or 20) of their numbers.

    ``sets`` are nodes and ``surfaces`` (element, face) by name, numbered from 1 on.
    """

    coordinates: FloatArray
    elements: NDArray[np.int64]
    sets: dict[str, NDArray[np.int64]]
    surfaces: dict[str, NDArray[np.int64]]
    n_sectors: int

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.coordinates)

    def write(self, path: Path) -> None:
        """The mesh and its material as a file that decks include."""
        kind = "C3D8" if self.elements.shape[1] == 8 else "C3D20"
        lines = [
            "** bladed sector with platform and shroud, made by gmsh; m, kg, s",
            "*NODE, NSET=NALL",
        ]
        lines += [
            f"{i},{x:.14g},{y:.14g},{z:.14g}" for i, (x, y, z) in enumerate(self.coordinates, 1)
        ]
        lines.append(f"*ELEMENT, TYPE={kind}, ELSET=EALL")
        for number, nodes in enumerate(self.elements.tolist(), 1):
            words = [number, *nodes]
            lines += [
                ",".join(map(str, words[k : k + 15])) + "," * (k + 15 < len(words))
                for k in range(0, len(words), 15)
            ]
        for name, nodes in self.sets.items():
            lines.append(f"*NSET, NSET={name}")
            each = nodes.tolist()
            lines += [", ".join(map(str, each[k : k + 12])) + "," for k in range(0, len(each), 12)]
        for name, faces in self.surfaces.items():
            lines.append(f"*SURFACE, NAME=S_{name}, TYPE=ELEMENT")
            lines += [f"{element},S{face}" for element, face in faces.tolist()]
        lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{YOUNG:g},{POISSON:g}"]
        lines += ["*DENSITY", f"{DENSITY:g}", "*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL"]
        path.write_text("\n".join(lines) + "\n")

    def ring(self) -> "SectorMesh":
        """The whole disk, its sectors one after the other and joined, without sets of sides."""
        turned, where = [], np.zeros((self.n_sectors, self.n_nodes), dtype=np.int64)
        left = self.sets["LEFT"] - 1
        partner = self.partners()
        own = np.setdiff1d(np.arange(self.n_nodes), self.sets["RIGHT"] - 1)
        for k in range(self.n_sectors):
            angle = 2 * np.pi * k / self.n_sectors
            c, s = np.cos(angle), np.sin(angle)
            turned.append(self.coordinates[own] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
            where[k, own] = k * len(own) + np.arange(len(own)) + 1
        for k in range(self.n_sectors):
            where[k, partner] = where[(k + 1) % self.n_sectors, left]
        elements = np.concatenate([where[k][self.elements - 1] for k in range(self.n_sectors)])
        sets = {
            name: np.concatenate([each[nodes - 1] for each in where])
            for name, nodes in self.sets.items()
            if name not in ("LEFT", "RIGHT", "SECTOR")
        }
        return SectorMesh(np.concatenate(turned), elements, sets, {}, self.n_sectors)

    def beside_a_block(self, n: int) -> "SectorMesh":
        """The same of bricks of 8 nodes, and a block of ``3 n (n + 1)^2`` degrees of freedom.

        It is so small that its frequencies are above all others. CalculiX finds a quarter of as
        many modes as there are degrees of freedom: with the block, all of the disk.
        """
        line = np.linspace(0, 1e-4, n + 1)
        points = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
        number = np.arange(len(points)).reshape([n + 1] * 3) + self.n_nodes + 1
        low, high = slice(None, -1), slice(1, None)
        around = [(low, low), (high, low), (high, high), (low, high)]
        corners = [number[i, j, k].ravel() for k in (low, high) for i, j in around]
        elements = np.concatenate([self.elements, np.column_stack(corners)])
        sets = self.sets | {"BORE": np.concatenate([self.sets["BORE"], number[0].ravel()])}
        return self._replace(
            coordinates=np.concatenate([self.coordinates, points]), elements=elements, sets=sets
        )

    def partners(self) -> NDArray[np.intp]:
        """Rows of the nodes of RIGHT that are images of those of LEFT, in their order."""
        left, right = self.sets["LEFT"] - 1, self.sets["RIGHT"] - 1
        angle = 2 * np.pi / self.n_sectors
        c, s = np.cos(angle), np.sin(angle)
        image = self.coordinates[left] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        distance = np.linalg.norm(image[:, None] - self.coordinates[right][None], axis=2)
        assert distance.min(axis=1).max() < 1e-9
        return right[distance.argmin(axis=1)]


def sector_mesh(
    quadratic: bool,
    divisions: dict[str, int],
    n_sectors: int,
    overclosure: float = 0.0,
    blocks: Iterable[str] = _BLOCKS,
) -> SectorMesh:
    """Mesh the sector of ``n_sectors`` by bricks of 8 or 20 nodes.

    ``divisions`` of disk, neck, platform, blade and shroud along the radius, of ``width`` of blade
    and ``side`` of what is beside it along the angle, of ``height``. The stub reaches
    ``overclosure`` [m] into the arm of the blade. ``blocks`` are those that are meshed.
    """
    points, bricks = _blocks(quadratic, divisions, [_BLOCKS[name] for name in blocks])
    radius, angle, height = points.T
    nodes = {name: test(radius, angle) for name, test in _SURFACES.items()}
    # Nodes amid the edges that gmsh counts to a surface are on it, as coordinates tell.
    sets = {name: np.flatnonzero(found) + 1 for name, found in nodes.items()}
    tip = np.hypot((radius - radius.max()) / 0.01, angle) + np.abs(height - HEIGHT / 2) / HEIGHT
    sets |= {"TIP": np.array([np.argmin(tip) + 1]), "SECTOR": np.arange(1, len(points) + 1)}
    faces: dict[str, Any] = {}
    for name in sorted(nodes.keys() - {"LEFT", "RIGHT"}):
        found = nodes[name]
        faces[name] = np.array(
            [
                (element + 1, face)
                for face, corners in _FACES.items()
                for element in np.flatnonzero(found[bricks[:, corners]].all(axis=1)).tolist()
            ]
        )
    half = np.pi / n_sectors
    stub = (angle <= -_STUB + 1e-6) & (radius > RADII[4] - 1e-9)
    reach = (_STUB - _ARM) + overclosure / (half * RADII[4])
    angle = np.where(stub, angle + (angle + 1) / (1 - _STUB) * reach, angle)
    out = np.clip((radius - RADII[3]) / (RADII[4] - RADII[3]), 0, 1)
    turn = half * angle + STAGGER * out * (height - HEIGHT / 2)
    coordinates = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])
    # A number of CalculiX has 20 characters at most.
    return SectorMesh(coordinates.round(14), bricks + 1, sets, faces, n_sectors)


def _blocks(
    quadratic: bool, divisions: dict[str, int], blocks: list[tuple[int, int, float, float]]
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Radius, angle over half of the sector's and height of nodes, and bricks (m, 8 or 20)."""
    import gmsh

    along = ["disk", "neck", "platform", "blade", "shroud"]
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        occ, mesh = gmsh.model.occ, gmsh.model.mesh
        boxes = [
            (3, occ.addBox(RADII[i], a, 0, RADII[j] - RADII[i], b - a, HEIGHT))
            for i, j, a, b in blocks
        ]
        occ.fragment(boxes, [])
        occ.synchronize()
        for _, curve in gmsh.model.getEntities(1):
            box = gmsh.model.getBoundingBox(1, curve)
            size = np.subtract(box[3:], box[:3])
            way = int(np.argmax(size))
            if way == 0:
                which = along[int(np.searchsorted(RADII, (box[0] + box[3]) / 2)) - 1]
            elif way == 1:
                middle = abs(box[1] + box[4]) / 2 < 1e-3
                which = "width" if middle else "side"
            else:
                which = "height"
            mesh.setTransfiniteCurve(curve, divisions[which] + 1)
        for _, face in gmsh.model.getEntities(2):
            mesh.setTransfiniteSurface(face)
            mesh.setRecombine(2, face)
        for _, volume in gmsh.model.getEntities(3):
            mesh.setTransfiniteVolume(volume)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
        mesh.generate(3)
        if quadratic:
            mesh.setOrder(2)
        tags, points, _ = mesh.getNodes()
        [kind], _, [corners] = mesh.getElements(3)
    finally:
        gmsh.finalize()
    tags, points, corners = map(np.asarray, (tags, points, corners))
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    bricks = corners.reshape(-1, 20 if kind == 17 else 8)
    used = np.isin(tags, bricks)
    number[tags[used]] = np.arange(used.sum())
    bricks = number[bricks]
    if quadratic:
        bricks = np.column_stack([bricks[:, :8], bricks[:, _EDGES]])
    points = points.reshape(-1, 3)[used]
    order = np.lexsort(points.T[[2, 1, 0]].round(9))
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    return points[order], back[bricks]
