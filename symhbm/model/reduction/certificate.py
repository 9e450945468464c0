"""How exact a reduced structure is, measured against direct solutions of the whole one."""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.condensation import dynamic_stiffness, factorised
from symhbm.model.linear import lowest_modes
from symhbm.numerics import RADIANS, ComplexArray, FloatArray

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
        self.springs = structure.stuck_springs

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
