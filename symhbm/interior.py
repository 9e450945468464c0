"""The degrees of freedom of a structure that no contact touches, and what is seen of them.

Masters are kept, all others are the interior. With ``D(s) = K + i s C - s^2 M`` the masters feel
``Z(s) = D_mm - D_mi D_ii^-1 D_im`` and, for each force on the interior, ``-D_mi D_ii^-1 B``.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from symhbm.band_function import ComplexArray
from symhbm.fourier import FloatArray
from symhbm.model import Model

_COLUMNS = 32
"""Right-hand sides solved at once: memory stays that of a few vectors."""


def dynamic_stiffness(parts: Sequence[Any], s: float) -> Any:
    """``K + i s C - s^2 M`` of three matrices at ``s`` [rad/s], real where nothing damps."""
    stiffness, damping, mass = parts
    real = stiffness - s**2 * mass
    damps = damping.any() if isinstance(damping, np.ndarray) else damping.count_nonzero()
    return real + 1j * s * damping if s and damps else real


def factorised(matrix: Any) -> Any:
    """Solver of a dynamic stiffness, RuntimeError where it is exactly singular."""
    # Columns ordered for a pattern that is symmetric, as those of structures are.
    options = dict(SymmetricMode=True)
    return splu(sp.csc_array(matrix), "MMD_AT_PLUS_A", diag_pivot_thresh=0.1, options=options)


class Interior:
    """A structure parted into ``masters`` (n_masters,) and the others, with ``forces`` on those.

    ``forces`` (n_interior, n_forces) are force patterns; ``symmetric`` tells that all matrices are.

    ValueError where the interior can move without any stiffness.
    """

    def __init__(self, model: Model, masters: NDArray[np.intp], forces: FloatArray):
        self.masters = masters
        self.others = others = np.setdiff1d(np.arange(model.n_dof), masters)
        self.forces = forces
        whole = model.stiffness_matrix, model.damping_matrix, model.mass_matrix
        rows = [matrix.tocsr() for matrix in whole]
        inner, outer = ([m[part].tocsc() for m in rows] for part in (others, masters))
        self._inside = [m[:, others] for m in inner]
        self._inwards = [m[:, masters] for m in inner]
        self._outwards = [m[:, others] for m in outer]
        self._masters = [m[:, masters].toarray() for m in outer]
        self.symmetric = all(_symmetric(matrix) for matrix in whole)
        found = self.solve(0.0)
        static = found[:, : len(masters)]
        stiffness = self._inside[0]
        rest = np.abs(stiffness @ static + self._inwards[0]).max(initial=0.0)
        terms = abs(stiffness) @ np.abs(static).max(axis=1, initial=0.0)
        if not np.isfinite(static).all() or rest > 1e-6 * terms.max(initial=1e-300):
            raise ValueError(
                "stiffness_matrix: expected one that holds all degrees of freedom once the kept "
                "ones are held; add to dofs one of each part that moves freely"
            )
        self.static = static
        self.at_rest: FloatArray = self.seen(0.0, found).real.astype(float)

    def solve(self, s: float) -> Any:
        """Motion of the interior (n_interior, n_masters + n_forces) at ``s`` [rad/s].

        Under a unit motion of each master and under each unit force.
        """
        matrix = dynamic_stiffness(self._inside, s)
        inwards = dynamic_stiffness(self._inwards, s)
        dtype = np.result_type(matrix, inwards)
        right = np.full((len(self.others), self.n_columns), np.nan, dtype)
        try:
            factors = factorised(matrix.astype(dtype))
        except RuntimeError:
            return right
        for first in range(0, self.n_columns, _COLUMNS):
            chosen = slice(first, first + _COLUMNS)
            block = np.hstack([-inwards[:, chosen].toarray(), self._forces_of(chosen)])
            solution = factors.solve(block)
            right[:, chosen] = solution + factors.solve(block - matrix @ solution)
        return right

    def _forces_of(self, chosen: slice) -> FloatArray:
        n = len(self.masters)
        return self.forces[:, max(chosen.start - n, 0) : max(chosen.stop - n, 0)]

    @property
    def n_columns(self) -> int:
        """Number of masters and forces."""
        return len(self.masters) + self.forces.shape[1]

    def seen(self, s: float, motion: ComplexArray) -> ComplexArray:
        """``[Z, -D_mi D_ii^-1 B]``, (n_masters, n_masters + n_forces), from what `solve` gives."""
        result = np.asarray(dynamic_stiffness(self._outwards, s) @ motion, dtype=complex)
        result[:, len(self.masters) :] *= -1
        result[:, : len(self.masters)] += dynamic_stiffness(self._masters, s)
        return result

    def imbalance(self, s: float, motion: ComplexArray, load: FloatArray) -> float:
        """Residual of the whole structure's equations, relative to the forces on the interior.

        Of a ``motion`` (n_interior,) under the amplitudes ``load`` (n_masters + n_forces,).
        """
        n = len(self.masters)
        push = self.forces @ load[n:] - dynamic_stiffness(self._inwards, s) @ load[:n]
        rest = dynamic_stiffness(self._inside, s) @ motion - push
        return float(np.linalg.norm(rest) / (np.linalg.norm(push) or 1.0))

    def projected(self, basis: FloatArray) -> list[FloatArray]:
        """The structure in coordinates of the masters and of a ``basis`` (n_interior, n_basis).

        Coefficients of 1, ``p`` and ``p^2``, ``p = i s``, of its four blocks: masters by masters
        and forces, masters by basis, basis by masters and forces, basis by basis.
        """
        static, forces = self.static, self.forces
        blocks = []
        parts = zip(self._masters, self._outwards, self._inwards, self._inside, strict=True)
        for power, (own, outwards, inwards, inside) in enumerate(parts):
            elastic = power == 0
            # The static motion leaves no elastic force on the interior.
            push = np.zeros_like(static) if elastic else inwards + inside @ static
            moved = inside @ basis
            pull = outwards @ basis + static.T @ moved
            if elastic and self.symmetric:
                pull = np.zeros_like(pull)
            held = own + outwards @ static + static.T @ push
            blocks.append(
                (
                    np.hstack([held, elastic * (static.T @ forces)]),
                    pull,
                    np.hstack([basis.T @ push, elastic * (basis.T @ forces)]),
                    basis.T @ moved,
                )
            )
        return [np.array(block) for block in zip(*blocks, strict=True)]


def _symmetric(matrix: Any) -> bool:
    skew = abs(matrix - matrix.T)
    return not skew.nnz or float(skew.max()) <= 1e-14 * float(abs(matrix).max())
