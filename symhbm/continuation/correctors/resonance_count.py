"""Numbers of natural frequencies below the harmonics of the excitation, without modes.

With contacts of stiffness ``k``, a structure has as many natural frequencies below ``s`` as its
dynamic stiffness ``K + B' k B - s^2 M`` has negative eigenvalues (Sylvester's law of inertia).
"""

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import ContactStates, HarmonicBalance
from symhbm.continuation.problem import ContinuationProblem
from symhbm.numerics import FloatArray, negative_eigenvalues

LARGEST_SIZE = 300
"""Number of degrees of freedom above which modes take longer to compute than the path."""


def counted(
    curve: ContinuationProblem, point: FloatArray, states: ContactStates
) -> tuple[tuple[int, ...] | None, FloatArray | None]:
    """The resonances below each harmonic at a point of a curve, and the springs of contacts there.

    None for a large structure, and of a motion that no force drives: it is at a resonance itself.
    """
    if curve.problem.n_dof > LARGEST_SIZE or not curve.driven:
        return None, None
    problem, frequency = curve.at(float(point[-1]))
    springs = problem.contacts.springs(point[:-1], frequency, states)
    return resonances_below(problem, frequency, springs[0]), springs


def resonances_below(
    problem: HarmonicBalance, frequency: float, springs: FloatArray
) -> tuple[int, ...] | None:
    """The count by harmonic above 0, contacts replaced by ``springs``; None for a large structure.

    Springs are (n_harmonics, m^2 of each contact) [N/m].
    """
    harmonics, model = [n for n in problem.harmonics if n > 0], problem.model
    if problem.n_dof > LARGEST_SIZE:
        return None
    springs = problem.contacts.by_row(springs)
    if not model.has_matrices:
        pairs = zip(harmonics, springs, strict=True)
        counts = [model.modes_below(n, frequency, spring) for n, spring in pairs]
        return None if None in counts else tuple(counts)  # type: ignore[arg-type]
    mass, stiffness, spread, directions = _by_harmonic(problem, harmonics)
    square = (frequency * np.array(harmonics))[:, None, None] ** 2
    dynamic = stiffness + _weighted(spread, springs) @ directions - square * mass
    return tuple(map(negative_eigenvalues, dynamic))


def _by_harmonic(problem: HarmonicBalance, harmonics: list[int]) -> list[NDArray]:
    """Mass, stiffness, directions transposed and directions, by harmonic or one for all."""
    symmetry = problem.symmetry
    waves = (0,) if symmetry is None else tuple(symmetry.wave(n) for n in harmonics)

    def made() -> list[NDArray]:
        by_wave = [structure_matrices(problem, wave) for wave in waves]
        mass, _, stiffness, directions = map(np.array, zip(*by_wave, strict=True))
        return [mass, (stiffness + _adjoint(stiffness)) / 2, _adjoint(directions), directions]

    return problem.model.of_matrices(("by harmonic", symmetry, waves), made)


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
        rows = [*(np.arange(symmetry.n_dof),) * 3, model.groups.rows_of(symmetry.contacts)]
        return [
            (matrix[row] @ phases).toarray() for matrix, row in zip(matrices, rows, strict=True)
        ]

    return model.of_matrices(("by wave", symmetry, wave), made)


def _adjoint(matrices: NDArray) -> NDArray:
    return matrices.conj().transpose(0, 2, 1)


def _weighted(spread: NDArray, springs: FloatArray) -> NDArray:
    return spread * springs[:, None, :] if springs.ndim == 2 else spread @ springs
