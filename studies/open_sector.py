"""An open sector of a bladed disk, by finite elements: a disk and a blade.

The disk reaches from 0.08 m, where it is clamped, to 0.20 m, the blade on the middle third of each
sector to 0.28 m; both are 0.03 m thick, of steel. Displacements are quadratic in straight
hexahedra, directions cartesian, and the axis of the disk is z. Without twist of the blade the disk
is its own mirror image, so that its bending and that of blades along the circumference do not
couple.
"""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import spsolve
from skfem import Basis, BilinearForm, ElementHex2, ElementVector, LinearForm, MeshHex, asm
from skfem.helpers import dot, eye, grad, sym_grad, trace
from skfem.models.elasticity import lame_parameters, linear_elasticity

import symhbm as sh
from symhbm.numerics import FloatArray

RADII = 0.08, 0.20, 0.28
"""Bore, rim of the disk and tip of the blade [m]."""
THICKNESS = 0.03
YOUNG, POISSON, DENSITY = 2e11, 0.3, 7850.0
COARSE, MIDDLE, FINE = (4, 3, 2, 4), (8, 6, 3, 8), (12, 9, 4, 14)
"""Elements of the disk along radius, circumference (a multiple of 3) and axis, and of the blade."""


class OpenSector(NamedTuple):
    """One sector: its ``structure`` with places, without damping, and its interfaces.

    ``left`` and ``right`` (n,) are degrees of freedom in the same order, right a turn of
    ``2 pi / n_sectors`` ahead about z. The elements of ``basis`` have the bore, too, which is held:
    ``free`` are the degrees of freedom of the structure among theirs.
    """

    structure: Any
    left: NDArray[np.intp]
    right: NDArray[np.intp]
    n_sectors: int
    basis: Basis
    free: NDArray[np.intp]

    @property
    def n_all(self) -> int:
        """Number of degrees of freedom with the bore."""
        return self.basis.N

    @property
    def disk(self) -> sh.Sector:
        """The disk of such sectors."""
        return sh.Sector(self.structure, self.left, self.right, self.n_sectors, rotation="z")

    def damped(self, share: float) -> "OpenSector":
        """The same with a damping matrix that is a ``share`` [s] of the stiffness matrix."""
        model = self.structure
        stiffness = model.stiffness_matrix
        damped = sh.Model(model.mass_matrix, share * stiffness, stiffness, places=model.places)
        return self._replace(structure=damped)

    @property
    def rotating(self) -> "OpenSector":
        """The same with stress stiffening and spin softening by rotation, without Coriolis forces.

        Stresses are those of the tuned disk under the centrifugal load, by small displacements.
        """
        added = self.stiffening(self.static())[self.free][:, self.free]
        speed = 1e4  # 1/min; what it adds is not small beside what it is added to
        at_rest = self.structure.stiffness_matrix
        runs = {0.0: at_rest, speed: at_rest + (2 * np.pi * speed / 60) ** 2 * added}
        return self._replace(structure=sh.RotatingModel(self.structure, runs))

    def at(self, speed: float) -> "OpenSector":
        """The same with the matrices at one speed [1/min]."""
        return self._replace(structure=self.rotating.structure.at(speed))

    def static(self) -> FloatArray:
        """Displacements [m s^2] of all degrees of freedom under centrifugal load, over Omega^2."""
        load = asm(LinearForm(lambda v, w: DENSITY * dot(w.x[:2], v[:2])), self.basis)[self.free]
        stiffness = self.disk.matrices(0).stiffness_matrix
        motion = spsolve(sp.csc_array(stiffness.real), self.disk.interfaces.folded(load, 0).real)
        result = np.zeros(self.n_all)
        result[self.free] = self.disk.expanded(motion, 0).real
        return result

    def stiffening(self, static: FloatArray) -> Any:
        """Matrix [kg] over Omega^2, of the stresses of a displacement less spin softening."""
        first, second = lame_parameters(YOUNG, POISSON)

        def form(u: Any, v: Any, w: Any) -> Any:
            strain = sym_grad(w["static"])
            stress = first * eye(trace(strain), 3) + 2 * second * strain
            first_slope: Any = grad(u)
            second_slope: Any = grad(v)
            stiffened = np.einsum("ki...,ij...,kj...", first_slope, stress, second_slope)
            return stiffened - DENSITY * dot(u[:2], v[:2])

        return sp.csc_array(asm(BilinearForm(form), self.basis, static=static))

    def virials(self, static: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Integrals of stresses xx, yy, xy [kg m^2]: by stiffening, and by virtual work."""
        x, y, _ = self.basis.doflocs
        way = self.basis.zeros().astype(int)
        for each in vars(self.basis.dofs).values():
            if isinstance(each, np.ndarray) and each.ndim == 2:
                way[each] = np.arange(each.shape[0])[:, None] % 3
        along_z = [np.where(way == 2, one, 0.0) for one in (x, y)]
        stress = self.stiffening(static)
        stiffness = asm(linear_elasticity(*lame_parameters(YOUNG, POISSON)), self.basis)
        pairs, strains = ((0, 0), (1, 1), (0, 1)), ((0, x), (1, y), (0, y))
        by_stress = [along_z[i] @ stress @ along_z[j] for i, j in pairs]
        work = [np.where(way == k, one, 0.0) @ stiffness @ static for k, one in strains]
        return np.array(by_stress), np.array(work)

    def faces(self) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Corners (n, 4) of the faces, numbers of mesh nodes, and which of them are interfaces."""
        mesh: Any = self.basis.mesh
        found = mesh.facets[:, mesh.boundary_facets()].T
        angle = np.abs(np.arctan2(*mesh.p[1::-1]))[found]
        return found, angle.min(axis=1) > np.pi / self.n_sectors - 1e-6

    def corners(self, motion: Any) -> Any:
        """Displacements (3, n) of the mesh nodes from those (n_dof,) of the structure."""
        whole = np.zeros(self.n_all, dtype=np.asarray(motion).dtype)
        whole[self.free] = motion
        return whole[self.basis.nodal_dofs]

    def near(self, radius: float, angle: float, height: float) -> int:
        """Number of the node nearest to a place: radius [m], angle [rad] from the middle, z [m]."""
        places = self.structure.places
        place = radius * np.cos(angle), radius * np.sin(angle), height
        return int(places.node[np.argmin(np.linalg.norm(places.coordinates - place, axis=1))])


def open_sector(
    grid: tuple[int, int, int, int] = COARSE, n_sectors: int = 24, twist: float = 0.0
) -> OpenSector:
    """One sector of steel on a ``grid``, as `COARSE`, its tip turned about the radius [rad]."""
    n_radius, n_angle, n_height, n_blade = grid
    half = np.pi / n_sectors
    radius = np.concatenate(
        [np.linspace(*RADII[:2], n_radius + 1), np.linspace(*RADII[1:], n_blade + 1)[1:]]
    )
    angle = np.linspace(-half, half, n_angle + 1)
    box = MeshHex.init_tensor(radius, angle, np.linspace(0, THICKNESS, n_height + 1))
    centre = box.p[:, box.t].mean(axis=1)
    there = (centre[0] < RADII[1]) | (np.abs(centre[1]) < half / 3)
    mesh = box.restrict(np.flatnonzero(there))
    r, theta, z = mesh.p
    theta = theta * RADII[1] / np.maximum(r, RADII[1])  # the blade keeps its width
    x, y = r * np.cos(theta), r * np.sin(theta)
    turn = twist * np.maximum(r - RADII[1], 0) / (RADII[2] - RADII[1])
    y, above = (
        y * np.cos(turn) - (z - THICKNESS / 2) * np.sin(turn),
        y * np.sin(turn) + (z - THICKNESS / 2) * np.cos(turn),
    )
    mesh = MeshHex(np.array([x, y, above + THICKNESS / 2]), mesh.t)
    basis = Basis(mesh, ElementVector(ElementHex2()), intorder=4)
    stiffness = asm(linear_elasticity(*lame_parameters(YOUNG, POISSON)), basis)
    mass = asm(BilinearForm(lambda u, v, _: DENSITY * dot(u, v)), basis)
    return _parted(mass, stiffness, basis, n_sectors)


def _parted(mass: Any, stiffness: Any, basis: Basis, n_sectors: int) -> OpenSector:
    """The sector without the bore, its interfaces found by their coordinates."""
    n_all = basis.N
    node, way = np.zeros((2, n_all), dtype=np.intp)
    dofs, first = basis.dofs, 0
    parts: list[Any] = [dofs.nodal_dofs, dofs.edge_dofs, dofs.facet_dofs, dofs.interior_dofs]
    for each in parts:
        places = np.arange(each.shape[0])[:, None]
        node[each] = first + np.arange(each.shape[1]) + places // 3 * each.shape[1]
        way[each] = places % 3
        first += each.shape[0] // 3 * each.shape[1]
    coordinates = basis.doflocs.T
    radius, angle = np.hypot(*coordinates.T[:2]), np.arctan2(*coordinates.T[1::-1])
    free = np.flatnonzero(radius > RADII[0] + 1e-6)
    ends = []
    for side in (-1, 1):
        found = np.flatnonzero(np.abs(angle[free] - side * np.pi / n_sectors) < 1e-6)
        keys = way[free][found], coordinates[free][found, 2].round(9), radius[free][found].round(9)
        ends.append(found[np.lexsort(keys)])
    mass, stiffness = (sp.csc_array(m)[free][:, free] for m in (mass, stiffness))
    names = np.array(["x", "y", "z"])[way[free]]
    places = sh.Places(node[free], names, coordinates[free])
    structure = sh.Model(mass, 0 * stiffness, stiffness, places=places)
    return OpenSector(structure, ends[0], ends[1], n_sectors, basis, free)
