"""A structure reduced by Craig and Bampton, by its matrices, and how exact it is.

Motions are ``x = [B 0; Psi Phi] (b, eta)``: of the boundary by ``b``, of the interior by constraint
modes ``Psi = -K_ii^-1 K_ib B`` and modes ``Phi`` with the boundary held. Motions of the interior at
as many degrees of freedom as there are modes stand for ``eta``, so that every coordinate is the
displacement of a place: the structure is a `Model` on some of its degrees of freedom. Direct
solutions of the whole structure measure its error.
"""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import qr

from symhbm.model.condensation import dynamic_stiffness
from symhbm.model.excitation import Excitation
from symhbm.model.linear import LowRankSum, check_held, factorised, lowest_modes
from symhbm.model.matrices import Model
from symhbm.model.reduction.deviations import force_as_felt
from symhbm.model.structure import PlacesAlone
from symhbm.numerics import RADIANS, ComplexArray, FloatArray, FourierBasis

_TIE = 1e-9
"""By how much a row weighs less than the one before it."""
_COLUMNS = 64
"""Right-hand sides solved at once: little memory."""


def chosen_rows(shapes: FloatArray) -> NDArray[np.intp]:
    """Rows of ``shapes`` (n, m) that tell its columns apart best, (m,), ascending."""
    # Of rows that tell as much the first ones, whatever machine rounds them.
    ranked = shapes * (1 - _TIE * np.arange(len(shapes)))[:, None]
    parts: Any = qr(ranked.T, mode="r", pivoting=True)
    return np.sort(parts[1][: shapes.shape[1]]).astype(np.intp)


def by_rows(shapes: FloatArray, rows: NDArray[np.intp]) -> NDArray:
    """Shapes (n, m) that span the same and are those of a unit motion of each of m ``rows``."""
    result = np.linalg.solve(shapes[rows].T, shapes.T).T
    result[rows] = np.eye(len(rows))
    return result


class Component:
    """A component held at its ``boundary`` (n_boundary,): how its interior follows.

    ``motion`` (n_boundary, n) is that of the boundary by its coordinates. ValueError where the
    interior can move without any stiffness, or has fewer than ``modes`` modes.
    """

    def __init__(
        self, mass: Any, stiffness: Any, boundary: NDArray[np.intp], motion: Any, modes: int
    ):
        n_dof = mass.shape[0]
        interior = np.setdiff1d(np.arange(n_dof), boundary)
        rows = stiffness.tocsr()[interior]
        inside = rows[:, interior].tocsc()
        static = follow(inside, -(rows[:, boundary] @ motion))
        self.squares, self.shapes = lowest_modes(
            inside, mass.tocsr()[interior][:, interior].tocsc(), modes
        )
        if len(self.squares) < modes:
            raise ValueError(
                f"modes={modes}: expected at most {len(self.squares)}, the modes of the structure "
                "with what is kept held"
            )
        chosen = chosen_rows(self.shapes) if modes else np.zeros(0, dtype=np.intp)
        self.representatives = interior[chosen]
        self.to_modes = np.linalg.inv(self.shapes[chosen])
        self.basis = np.zeros((n_dof, motion.shape[1] + modes))
        self.basis[boundary, : motion.shape[1]] = (
            motion.toarray() if sp.issparse(motion) else motion
        )
        spread = self.shapes @ self.to_modes
        self.basis[interior, : motion.shape[1]] = static - spread @ static[chosen]
        self.basis[interior, motion.shape[1] :] = spread
        self.basis[self.representatives] = np.eye(motion.shape[1] + modes)[motion.shape[1] :]
        # Of each mode by the coordinates of the reduced component.
        self.modal_rows = np.hstack([-self.to_modes @ static[chosen], self.to_modes])


def follow(inside: Any, push: Any) -> FloatArray:
    """Motion of an interior under static forces (n_interior, n)."""
    push = push.toarray() if sp.issparse(push) else np.asarray(push)
    result = np.empty(push.shape)
    try:
        factors = factorised(inside)
        for first in range(0, push.shape[1], _COLUMNS):
            result[:, first : first + _COLUMNS] = factors.solve(push[:, first : first + _COLUMNS])
    except RuntimeError:
        result[:] = np.nan
    check_held(inside, result, push)
    return result


def projected(matrix: Any, basis: FloatArray) -> FloatArray:
    """``basis^T matrix basis``, symmetric to the bit where the matrix is symmetric."""
    result = basis.T @ (matrix @ basis)
    symmetric = isinstance(matrix, LowRankSum) or not (abs(matrix - matrix.T) > 0).nnz
    return (result + result.T) / 2 if symmetric else result


_RESONANCES = 4
"""Resonances of a wave, with contacts open and stuck each, at which responses are compared."""
_NEAR = 1.25
"""Ratio of a frequency to the nearest end of a band, up to which it is near."""
_MODES = 40
"""Most natural frequencies of a wave that are compared."""


class ReductionCertificate(NamedTuple):
    """Errors of a reduction, measured at single frequencies of a band.

    ``error``, the largest difference of linear responses, relative displacements of contacts and
    watched degrees of freedom under unit forces on them, contacts open and contacts stuck, from
    those of direct factorisations of the whole structure, each relative to the norm of the
    response; ``frequency_error``, that of natural frequencies in the band, relative, NaN where
    there is none;
    ``frequencies`` (n,) [Hz], where responses were compared, resonances among them where something
    damps; ``band`` [Hz]; ``nodal_diameters`` of a sector that were compared, all of those with
    modes in the band or near it among them, None of a structure.
    """

    error: float
    frequency_error: float
    frequencies: FloatArray
    band: tuple[float, float]
    nodal_diameters: tuple[int, ...] | None

    def __repr__(self) -> str:
        modes = f"natural frequencies to {self.frequency_error:.1e}"
        if np.isnan(self.frequency_error):
            modes = "without natural frequencies"
        band = f"from {self.band[0]:g} to {self.band[1]:g} Hz"
        return f"linear responses exact to {self.error:.1e}, {modes} {band}"


def certified(
    whole: Any,
    reduced: Any,
    watched: tuple[NDArray[np.intp], NDArray[np.intp]],
    band: tuple[float, float],
    waves: tuple[int, ...] | None,
) -> ReductionCertificate:
    """The certificate of a ``reduced`` structure, or sector for each of ``waves``.

    ``watched`` are degrees of freedom of either, the same places.
    """
    errors, shifts, compared = [0.0], list[float](), []
    for wave in (None,) if waves is None else waves:
        both = _Wave(whole, wave, watched[0]), _Wave(reduced, wave, watched[1])
        shifts += _shifts(both, band)
        for frequency in _frequencies(both[1], band):
            exact, approximate = (part.responses(RADIANS * frequency) for part in both)
            errors += [_difference(*pair) for pair in zip(exact, approximate, strict=True)]
            compared.append(frequency)
    shift = max(shifts, default=np.nan)
    return ReductionCertificate(max(errors), shift, np.unique(compared), band, waves)


def waves_near(sector: Any, band: tuple[float, float]) -> set[int]:
    """Nodal diameters of a reduced sector with modes in a band or near it, stuck or open."""
    result = set[int]()
    for wave in sector.nodal_diameters:
        part = _Wave(sector, wave, np.zeros(0, dtype=np.intp))
        for stiffness in (part.parts.stiffness_matrix, part.stuck()):
            squares = lowest_modes(stiffness, part.parts.mass_matrix)[0]
            natural = np.sqrt(np.maximum(squares, 0.0)) / RADIANS
            if np.any((band[0] / _NEAR < natural) & (natural < _NEAR * band[1])):
                result.add(wave)
    return result


class _Wave:
    """One wave of a sector, or a whole structure: its matrices and what is compared."""

    def __init__(self, structure: Any, wave: int | None, watched: NDArray[np.intp]):
        self.parts = structure.matrices(wave)
        self.loss = structure.loss_stiffness(wave) if structure.loss_factor else None
        rows: Any = sp.csr_array(structure.directions_of(wave))
        every: Any = sp.eye_array(self.parts.n_dof, format="csr")
        self.rows: Any = sp.vstack([rows, every[watched]]).tocsr()
        self.n_contact = rows.shape[0]
        self.springs = structure.groups.stuck_springs

    @property
    def damped(self) -> bool:
        """Whether anything takes energy."""
        return bool(self.loss is not None or self.parts.damping_matrix.count_nonzero())

    def stuck(self) -> Any:
        """The stiffness with stuck contacts."""
        rows = self.rows[: self.n_contact]
        return self.parts.stiffness_matrix + rows.conj().T @ sp.diags_array(self.springs) @ rows

    def responses(self, s: float) -> list[ComplexArray]:
        """Receptances of what is compared at ``s`` [rad/s], contacts open and stuck."""
        mass, damping, stiffness = self.parts
        if self.loss is not None:
            stiffness = stiffness + 1j * self.loss
        matrix = dynamic_stiffness([stiffness, damping, mass], s).astype(complex)
        loads = self.rows.conj().T.toarray().astype(complex)
        opened = self.rows @ factorised(matrix).solve(loads)
        n = self.n_contact
        coupled = np.eye(n) + self.springs[:, None] * opened[:n, :n]
        held = np.linalg.solve(coupled, self.springs[:, None] * opened[:n])
        return [opened, opened - opened[:, :n] @ held]


def _frequencies(reduced: _Wave, band: tuple[float, float]) -> FloatArray:
    """Frequencies [Hz] to compare at: resonances where something damps, or between them."""
    low, high = band
    found = [np.linspace(low, high, 5)[1:4]]
    for stiffness in (reduced.parts.stiffness_matrix, reduced.stuck()):
        squares = lowest_modes(stiffness, reduced.parts.mass_matrix)[0]
        natural = np.sqrt(np.maximum(squares, 0.0)) / RADIANS
        within = natural[(low < natural) & (natural < high)]
        if not reduced.damped:
            within = (within[1:] + within[:-1]) / 2
        at = np.linspace(0, len(within) - 1, min(len(within), _RESONANCES)).astype(int)
        found.append(within[at])
    return np.unique(np.concatenate(found))


def _shifts(both: tuple[_Wave, _Wave], band: tuple[float, float]) -> list[float]:
    """Relative differences of natural frequencies in a band."""
    exact, own = both
    squares = lowest_modes(own.parts.stiffness_matrix, own.parts.mass_matrix)[0]
    most, top = min(len(squares), _MODES), (RADIANS * band[1]) ** 2
    # Those of a reduced structure are higher: some may have left the band by its upper end.
    count = min(int(np.count_nonzero(squares < top)) + 1, most)
    while True:
        true = lowest_modes(exact.parts.stiffness_matrix, exact.parts.mass_matrix, count)[0]
        if count == most or true[-1] > top:
            break
        count = min(2 * count, most)
    chosen = ((RADIANS * band[0]) ** 2 < true) & (true < top)
    natural = np.sqrt(np.maximum([true, squares[: len(true)]], 0.0))[:, chosen]
    return np.abs(natural[1] / natural[0] - 1).tolist()


def _difference(exact: ComplexArray, approximate: ComplexArray) -> float:
    size = np.linalg.norm(exact, axis=0)
    return float(np.max(np.linalg.norm(approximate - exact, axis=0) / np.where(size > 0, size, 1)))


class ReducedModel(Model):
    """A `Model` on the degrees of freedom that `craig_bampton` keeps, with matrices of its own.

    Forces are those of the whole structure, on any of its degrees of freedom.

    Attributes
    ----------
    dofs : (n_dof,)
        The degrees of freedom that are kept, as the whole structure numbers them: those of the
        boundary, then one for each mode.
    basis : (n_whole, n_dof)
        Motion of the whole structure by that of the kept degrees of freedom.
    fixed_frequencies : (n_modes,)
        Natural frequencies with the boundary held [Hz].
    modal_rows : (n_modes, n_dof)
        Coordinates [m kg^1/2] of the modes with the boundary held, of unit mass, from the motion.
    certificate
        How exact it is, see `ReductionCertificate`.
    """

    dofs: NDArray[np.intp]
    basis: FloatArray
    fixed_frequencies: FloatArray
    modal_rows: FloatArray
    certificate: ReductionCertificate

    def __init__(
        self, structure: Model, dofs: NDArray[np.intp], component: Component, n_right: int = 0
    ):
        basis = component.basis
        self._store(lumped=False, dofs=dofs, basis=basis, kept=dofs, _lift=basis)
        given = structure.places
        self._store(places=None if given is None else given.of(dofs), reduced_from=len(basis))
        self._store(beneath=PlacesAlone(len(basis), places=given))
        natural = np.sqrt(np.maximum(component.squares, 0.0)) / (2 * np.pi)
        self._store(fixed_frequencies=natural, modal_rows=component.modal_rows)
        if structure.damping is not None:
            self._store(damping=structure.damping.of_at_most(len(dofs) - n_right))
        names = "damping_matrix" if structure.damping is None else "coriolis_matrix"
        for name in ("mass_matrix", names, "stiffness_matrix"):
            if (matrix := getattr(structure, name)) is not None:
                self._store(**{name: sp.csc_array(projected(matrix, basis))})
        self._store(speed=structure.speed)
        position = {int(dof): i for i, dof in enumerate(dofs)}
        self._store(**structure.groups.renumbered(position.__getitem__).attributes)
        self._store(outputs={n: out.of(self.seen(out)) for n, out in structure.outputs.items()})

    stored_as = Model
    stored = (
        *("mass_matrix", "damping_matrix", "coriolis_matrix", "stiffness_matrix"),
        *("damping", "lumped", "speed", "places"),
    )
    made_by = "reduce"

    def as_felt(self, excitation: Excitation, basis: FourierBasis) -> Excitation:
        """An excitation as the kept degrees of freedom feel it."""
        return force_as_felt(self, excitation, basis)

    @property
    def remark(self) -> str:
        """What else to tell of it in a line."""
        return (
            f"reduced from {self.n_whole} degrees of freedom, "
            f"{len(self.fixed_frequencies)} modes with what is kept held, "
            f"{self.certificate!r}"
        )
