"""Numbers of natural frequencies below the harmonics of the excitation, without modes.

With contacts of stiffness ``k``, a structure has as many natural frequencies below ``s`` as its
dynamic stiffness ``K + B' k B - s^2 M`` has negative eigenvalues (Sylvester's law of inertia).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import ContactStates, HarmonicBalance, by_row, contact_springs
from symhbm.continuation.problem import ContinuationProblem
from symhbm.numerics import FloatArray, negative_eigenvalues

LARGEST_SIZE = 300
"""Number of degrees of freedom above which modes take longer to compute than the path."""


class ResonanceCount:
    """Counts the resonances below each harmonic above 0 at points of a curve."""

    def __init__(self, curve: ContinuationProblem):
        self._curve = curve
        self._cached_model: tuple[Any, Any] = None, None
        self._cached: list[NDArray] = []

    def below(
        self, unknowns: FloatArray, value: float, states: ContactStates
    ) -> tuple[int, ...] | None:
        """The count by harmonic, contacts replaced by springs; None for a large structure.

        None, too, of a motion that no force drives: it is at a resonance itself.
        """
        if self._curve.problem.n_dof > LARGEST_SIZE or not self._curve.driven:
            return None
        problem, frequency = self._curve.at(value)
        springs = contact_springs(problem, unknowns, frequency, states)
        return self._below(problem, frequency, by_row(problem, springs[0]))

    def below_with(self, springs: FloatArray, value: float) -> tuple[int, ...] | None:
        """The same from the springs (n_harmonics, m^2 of each contact) [N/m]."""
        problem, frequency = self._curve.at(value)
        if problem.n_dof > LARGEST_SIZE:
            return None
        return self._below(problem, frequency, by_row(problem, springs))

    def _below(
        self, problem: HarmonicBalance, frequency: float, springs: FloatArray
    ) -> tuple[int, ...] | None:
        harmonics, model = [n for n in problem.harmonics if n > 0], problem.model
        if not model.has_matrices:
            pairs = zip(harmonics, springs, strict=True)
            counts = [model.modes_below(n, frequency, spring) for n, spring in pairs]
            return None if None in counts else tuple(counts)  # type: ignore[arg-type]
        mass, stiffness, spread, directions = self._matrices(problem, harmonics)
        square = (frequency * np.array(harmonics))[:, None, None] ** 2
        dynamic = stiffness + _weighted(spread, springs) @ directions - square * mass
        return tuple(map(negative_eigenvalues, dynamic))

    def _matrices(self, problem: HarmonicBalance, harmonics: list[int]) -> list[NDArray]:
        """Mass, stiffness, directions transposed and directions, by harmonic or one for all."""
        model, symmetry = problem.model, problem.symmetry
        current = model.mass_matrix, model.stiffness_matrix
        if not all(a is b for a, b in zip(current, self._cached_model, strict=True)):
            waves = [0] if symmetry is None else [symmetry.wave(n) for n in harmonics]
            by_wave = [structure_matrices(problem, wave) for wave in waves]
            mass, _, stiffness, directions = map(np.array, zip(*by_wave, strict=True))
            stiffness = (stiffness + _adjoint(stiffness)) / 2
            self._cached_model = current
            self._cached = [mass, stiffness, _adjoint(directions), directions]
        return self._cached


def structure_matrices(problem: HarmonicBalance, wave: int) -> list[NDArray]:
    """Mass, damping and stiffness matrices (n_dof, n_dof) and directions (n_rows, n_dof).

    Those of a symmetric structure are of one sector, complex, for a ``wave`` around the disk.
    """
    model, symmetry = problem.model, problem.symmetry

    def made() -> list[NDArray]:
        names = ("mass_matrix", "damping_matrix", "stiffness_matrix", "directions")
        matrices = [getattr(model, name) for name in names]
        if symmetry is None:
            return [matrix.toarray() for matrix in matrices]
        phases = symmetry.phases(wave)
        rows = [*(np.arange(symmetry.n_dof),) * 3, model.rows_of(symmetry.contacts)]
        return [
            (matrix[row] @ phases).toarray() for matrix, row in zip(matrices, rows, strict=True)
        ]

    return model.of_matrices(("by wave", symmetry, wave), made)


def _adjoint(matrices: NDArray) -> NDArray:
    return matrices.conj().transpose(0, 2, 1)


def _weighted(spread: NDArray, springs: FloatArray) -> NDArray:
    return spread * springs[:, None, :] if springs.ndim == 2 else spread @ springs
