"""Partition of a structure into masters and interior, and the dynamic stiffness of the masters.

Masters are kept, all other degrees of freedom are the interior. With ``D(s) = K + i s C - s^2 M``
the condensed stiffness is ``Z(s) = D_mm - D_mi D_ii^-1 D_im`` and, for forces on the interior, the
condensed force ``-D_mi D_ii^-1 B``. Displacements of contacts may be among the coordinates.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.contacts import ContactGroups, Weights
from symhbm.model.cyclic import Sector
from symhbm.model.frame import restored
from symhbm.model.linear import LowRankSum, Matrices, RelativeCoordinates, check_held, factorised
from symhbm.model.matrices import Model
from symhbm.model.structure import Structure
from symhbm.numerics import ComplexArray, FloatArray

_COLUMNS = 32
"""Right-hand sides solved at once: little memory."""
_REFINED = 1e-8
"""Relative correction at which refinement ends: the next would be its square, round-off."""
_REFINEMENTS = 5
"""Most refinements of a solution."""
LONG = np.longdouble
"""Precision of residuals: stiff elements cancel most digits of the forces of a soft structure."""


def dynamic_stiffness(parts: Sequence[Any], s: Any) -> Any:
    """``K + i s C - s^2 M`` of three matrices at ``s`` [rad/s], real where nothing damps."""
    stiffness, damping, mass = parts
    real = stiffness - s**2 * mass
    damps = damping.any() if isinstance(damping, np.ndarray) else damping.count_nonzero()
    return real + 1j * s * damping if s and damps else real


def refined(factors: Any, exact: Any, right: Any, trans: str = "N") -> Any:
    """Solution (n, n_columns) of ``exact @ x = right`` from `factorised` rounded equations.

    In the precision of the residuals, which is that of ``exact`` and ``right``. With ``trans="H"``
    the factors are those of the adjoint equations.
    """
    dtype = complex if np.iscomplexobj(exact) else float
    solution = factors.solve(right.astype(dtype), trans).astype(exact.dtype)
    for _ in range(_REFINEMENTS):
        correction = factors.solve((right - exact @ solution).astype(dtype), trans)
        solution += correction
        size = np.linalg.norm(solution.astype(dtype), axis=0)
        if not np.any(np.linalg.norm(correction, axis=0) > _REFINED * size):
            break
    return solution


class Interior:
    """A structure parted into ``masters`` (n_masters,) and the interior, with ``forces`` on it.

    ``forces`` (n_interior, n_forces) are force patterns; ``symmetric`` tells whether all matrices
    are symmetric, or Hermitian, those of a wave around a disk. All are real or all complex. With
    a ``loss_factor`` the stiffness but at rest is ``lossy`` times that of real matrices.

    ValueError where the interior can move without any stiffness.
    """

    def __init__(
        self,
        model: Model | Matrices,
        masters: NDArray[np.intp],
        forces: NDArray,
        loss_factor: float = 0.0,
    ):
        self.masters = masters
        self.others = others = np.setdiff1d(np.arange(model.n_dof), masters)
        self.forces = forces
        whole = model.stiffness_matrix, model.damping_matrix, model.mass_matrix
        self.lossy = 1 + 1j * loss_factor if loss_factor else 1.0
        rows = [matrix.tocsr() for matrix in whole]
        inner, outer = ([m[part].tocsc() for m in rows] for part in (others, masters))
        self._inside = [m[:, others] for m in inner]
        self._inwards = [m[:, masters] for m in inner]
        self._outwards = [m[:, others] for m in outer]
        self._masters = [m[:, masters].toarray() for m in outer]
        self.symmetric = all(_symmetric(matrix) for matrix in whole)
        self.dtype = np.result_type(float, *(matrix.dtype for matrix in whole))
        self.damped = bool(whole[1].count_nonzero())
        self._factors: tuple[float, Any] = 0.0, None
        """Those of the last frequency [rad/s]: they solve the adjoint equations, at minus it."""
        motion, at_rest = self.solve(0.0)
        self.static = static = motion[:, : len(masters)]
        check_held(self._inside[0], static, -self._inwards[0])
        self.at_rest: NDArray = at_rest.astype(self.dtype)

    def solve(self, s: float, only_motion: bool = False) -> tuple[Any, ComplexArray]:
        """Motion of the interior and condensed stiffness of the masters at ``s`` [rad/s].

        Motion (n_interior, n_masters + n_forces), in the precision of residuals, under a unit
        motion of each master and under each unit force; ``[Z, -D_mi D_ii^-1 B]``
        (n_masters, n_masters + n_forces). With ``only_motion`` the motion of symmetric matrices is
        not refined: the condensed stiffness by a basis of such is in error by the square alone.
        """
        lossy = self.lossy if s else 1.0
        blocks = self._inside, self._inwards, self._outwards, self._masters
        exact = [[_long(part) for part in block] for block in blocks]
        inside, inwards, outwards, kept = (
            dynamic_stiffness([lossy * elastic, damping, mass], LONG(s))
            for elastic, damping, mass in exact
        )
        inside = inside.astype(np.result_type(inside.dtype, inwards.dtype))
        motion = np.full((len(self.others), self.n_columns), np.nan, inside.dtype)
        feel = np.full((len(self.masters), self.n_columns), np.nan, inside.dtype)
        rounded = complex if np.iscomplexobj(inside) else float
        trans = "H" if self.symmetric and s and self._factors[0] == -s else "N"
        if trans == "N":
            self._factors = 0.0, None  # memory for the next ones
            try:
                factors = factorised(inside.astype(rounded))
            except RuntimeError:
                return motion, feel
            if self.dtype == complex:
                self._factors = s, factors
        else:
            factors = self._factors[1]
        n = len(self.masters)
        for first in range(0, self.n_columns, _COLUMNS):
            chosen = slice(first, first + _COLUMNS)
            forces = self.forces[:, max(first - n, 0) : max(first + _COLUMNS - n, 0)]
            block = np.hstack([-inwards[:, chosen].toarray(), forces])
            if only_motion and self.symmetric:
                motion[:, chosen] = factors.solve(block.astype(rounded), trans)
            else:
                motion[:, chosen] = refined(factors, inside, block, trans)
        if only_motion:
            return motion, feel
        felt = outwards @ motion
        feel[:, :n], feel[:, n:] = felt[:, :n] + kept, -felt[:, n:]
        return motion, feel

    @property
    def n_columns(self) -> int:
        """Number of masters and forces."""
        return len(self.masters) + self.forces.shape[1]

    def residual(
        self, frequencies: FloatArray, motions: ComplexArray, load: FloatArray
    ) -> FloatArray:
        """Residual of the whole structure's equations, relative to the forces on the interior.

        Of ``motions`` (n_interior, n), one at each of ``frequencies`` (n,) [rad/s], under the
        amplitudes ``load`` (n_masters + n_forces,).
        """
        n = len(self.masters)
        powers = self.lossy * np.ones_like(frequencies), 1j * frequencies, -(frequencies**2)
        push = (self.forces @ load[n:]).astype(complex)[:, None]
        for power, inwards in zip(powers, self._inwards, strict=True):
            push = push - (inwards @ load[:n])[:, None] * power
        residual = -push
        for power, inside in zip(powers, self._inside, strict=True):
            residual += (inside @ motions) * power
        size = np.linalg.norm(push, axis=0)
        return np.linalg.norm(residual, axis=0) / np.where(size > 0, size, 1.0)

    def projected(self, basis: NDArray) -> list[NDArray]:
        """The structure in coordinates of the masters and of a ``basis`` (n_interior, n_basis).

        Coefficients of 1, ``p`` and ``p^2``, ``p = i s``, of its four blocks: masters by masters
        and forces, masters by basis, basis by masters and forces, basis by basis.
        """
        static, forces = self.static.astype(self.dtype), self.forces
        fixed, rows = adjoint(static), adjoint(basis)
        blocks = []
        parts = zip(self._masters, self._outwards, self._inwards, self._inside, strict=True)
        for power, (kept, outwards, inwards, inside) in enumerate(parts):
            elastic = power == 0
            # The static motion has no elastic force on the interior.
            push = np.zeros_like(static)
            if not elastic:
                push = (inwards.toarray() + _product(inside, self.static)).astype(self.dtype)
            moved = _product(inside, basis).astype(self.dtype)
            pull = _product(outwards, basis).astype(self.dtype) + fixed @ moved
            if elastic and self.symmetric:
                pull = np.zeros_like(pull)
            condensed = kept + _product(outwards, self.static)
            condensed = condensed.astype(self.dtype) + fixed @ push
            blocks.append(
                (
                    np.hstack([condensed, elastic * (fixed @ forces)]),
                    pull,
                    np.hstack([rows @ push, elastic * (rows @ forces)]),
                    rows @ moved,
                )
            )
        return [np.array(block) for block in zip(*blocks, strict=True)]


def adjoint(matrices: NDArray) -> NDArray:
    """Transposed matrices (..., n, m), conjugate complex; no copy where they are real."""
    turned = np.swapaxes(matrices, -1, -2)
    return turned.conj() if np.iscomplexobj(matrices) else turned


def _product(matrix: Any, columns: NDArray) -> Any:
    """A product in the precision of residuals: stiff elements cancel in smooth motions."""
    return _long(matrix) @ _long(columns)


def _long(matrix: Any) -> Any:
    return matrix.astype(np.result_type(matrix.dtype, LONG))


def _symmetric(matrix: Any) -> bool:
    if isinstance(matrix, LowRankSum):
        motion = np.random.default_rng(0).normal(size=matrix.shape[0])
        force, other = matrix @ motion, (matrix.T @ motion.conj()).conj()
        return bool(np.allclose(force, other, 1e-12, 1e-12 * np.abs(force).max()))
    skew = abs(matrix - matrix.conj().T)
    return not skew.nnz or float(skew.max()) <= 1e-14 * float(abs(matrix).max())


def in_displacements(
    structure: Model | Sector, watched: NDArray[np.intp]
) -> tuple[Model | Sector, RelativeCoordinates]:
    """A structure in displacements of its contacts, with ``watched`` degrees of freedom as before.

    Of a `Model` it is one whose motion is ``x = T z``, displacements of contacts are some of the
    ``z``. Its matrices are ``T^T M T``, and so on; forces are those on the structure ``beneath``.
    Masters are numbered as its degrees of freedom are. Raises ValueError where displacements depend
    on each other in one wave around a disk, and do not in another.
    """
    if isinstance(structure, Sector):
        held = np.searchsorted(structure.kept, watched)
        coordinates = RelativeCoordinates.of(structure.directions_of(1), held)
        return structure.along_contacts(coordinates), coordinates
    coordinates = RelativeCoordinates.of(structure.directions, watched)
    if not len(coordinates.rows):  # what is watched tells all displacements
        return structure, coordinates
    change = coordinates.change(structure.directions)
    rows = sp.csr_array(structure.directions @ change)
    rows.data[np.abs(rows.data) < 1e-14 * np.abs(rows.data).max(initial=0.0)] = 0.0
    rows.eliminate_zeros()
    parts = np.split(rows.indices, rows.indptr[1:-1]), np.split(rows.data, rows.indptr[1:-1])
    ends = [_ends(*part) for part in zip(*parts, strict=True)] if structure.n_contacts else []
    matrices = {name: _congruent(getattr(structure, name), change) for name in Matrices._fields}
    of_contacts = [tuple(ends[row] for row in rows) for rows in structure.groups.rows]
    contacts = tuple(each[0] if len(each) == 1 else each for each in of_contacts)
    values = ContactGroups(contacts, tuple(ends), structure.groups).attributes | dict(
        places=structure.places,
        damping=structure.damping,
        lumped=False,
        beneath=structure,
        _lift=change,
    )
    return restored(matrices | values, Model), coordinates


def names_of(structure: Structure, rows: NDArray[np.intp]) -> list[str]:
    """What displacements ``rows`` of contacts are called, by contact and by direction."""
    names = {}
    for group in structure.groups:
        for contact, of_contact in zip(group.contacts, group.rows, strict=True):
            for row, direction in zip(of_contact, group.law.directions, strict=True):
                several = f", {direction}" if len(of_contact) > 1 else ""
                names.setdefault(int(row), f"displacement of contact {contact}{several}")
    return [names[row] for row in rows.tolist()]


def _ends(dofs: NDArray, weights: NDArray) -> Any:
    """A displacement by coordinates: mostly one of them alone."""
    order = np.argsort(dofs)
    dofs, weights = dofs[order].tolist(), weights[order].tolist()
    return (dofs[0],) if weights == [1.0] else Weights(tuple(dofs), tuple(weights))


def _congruent(matrix: Any, change: Any) -> Any:
    """``T^T A T``."""
    if isinstance(matrix, LowRankSum):
        factors = change.T @ matrix.left, change.T @ matrix.right
        return LowRankSum(_congruent(matrix.sparse, change), *factors)
    return sp.csc_array(change.T @ matrix @ change)
