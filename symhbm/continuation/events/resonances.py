"""Resonances between two points of a path: those too narrow to show in the response at either.

Where the response is smooth, steps are long, and a lightly damped mode may lie unseen inside one.
The modes of the structure with its contacts at their present stiffness tell where to look.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky

from symhbm.balance import HarmonicBalance
from symhbm.continuation.correctors import Corrected
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.resonance_count import LARGEST_SIZE, springs_of, structure_matrices
from symhbm.model.contacts import ContactState
from symhbm.numerics import FloatArray

SEEN = 2.0
"""Distance from a resonance ahead, in half widths, at which the path feels it."""
AT = 0.3
"""Distance from a resonance, in half widths, at which a point stands for it."""
_SPANNED = 3.0
"""Half widths from one flank of a resonance to the other beyond which its top is looked at."""
_FAINT = 1e-9
"""Resonant response, relative to the response, of a mode that nothing excites."""


class Modes(NamedTuple):
    """Modes by harmonic at one point, arrays (n_harmonics, n_dof).

    ``exciting`` (n_harmonics, 1), the exciting frequency of each [rad/s]; ``detuning``, the natural
    less the exciting frequency [rad/s]; ``width``, half that of the resonance [rad/s]; ``excited``,
    whether a force or the slip of a contact makes the mode respond; ``near``, whether these are of
    the mode and not what a mode far away could be.
    """

    exciting: FloatArray
    detuning: FloatArray
    width: FloatArray
    excited: NDArray[np.bool_]
    near: NDArray[np.bool_]


def modes(
    curve: ContinuationProblem, unknowns: FloatArray, value: float, friction: ContactState
) -> Modes | None:
    """Modes of the structure at a point of a curve, None for one too large or without inertia."""
    problem, frequency = curve.at(value)
    if problem.n_dof > LARGEST_SIZE:
        return None
    size = float(np.linalg.norm(unknowns))
    found = []
    limit = _largest_contact_force(problem, size, friction)
    harmonics = [n for n in problem.harmonics if n > 0]
    springs = springs_of(problem, unknowns, friction)
    for n, *contacts in zip(harmonics, *springs, strict=True):
        cosine, sine = _columns(problem, n)
        if not problem.model.has_matrices:
            found.append(_without_matrices(problem, n, frequency, contacts, size, limit))
            if found[-1] is None:
                return None
            continue
        try:
            structure = reduced(problem, n)
        except np.linalg.LinAlgError:
            return None  # a motion without inertia: no coordinates of unit mass
        natural, width, shapes = _resonances(structure, n * frequency, *contacts)
        force = structure.force[:, cosine] - 1j * structure.force[:, sine]
        pulled = structure.springs.conj().T @ shapes
        drive = _drive(shapes.conj().T @ force, pulled, limit)
        motion = np.linalg.norm(structure.inverse.conj().T @ shapes, axis=0)
        excited = _excited(drive * motion, natural, width, size)
        near = np.ones(len(natural), dtype=bool)
        found.append((natural - n * frequency, width, excited, near))
    exciting = frequency * np.array(harmonics)[:, None]
    return Modes(exciting, *(np.array(parts) for parts in zip(*found, strict=True)))


def _without_matrices(
    problem: HarmonicBalance,
    harmonic: int,
    frequency: float,
    contacts: Sequence[FloatArray],
    size: float,
    limit: FloatArray,
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], NDArray[np.bool_]] | None:
    """The same as the structure itself tells its modes, None if it does not."""
    found = problem.model.modes_near(harmonic, frequency, *contacts)
    if found is None:
        return None
    detuning, width, near, shapes = found
    force = problem.force(frequency)[:, _columns(problem, harmonic)] @ [1, -1j]
    natural = (harmonic * frequency + detuning)[near]
    drive = _drive(shapes.T @ force, problem.model.directions @ shapes, limit)
    motion = np.linalg.norm(shapes, axis=0)
    excited = np.ones(len(width), dtype=bool)
    excited[near] = _excited(drive * motion, natural, width[near], size)
    return detuning, width, excited, near


def _largest_contact_force(
    problem: HarmonicBalance, size: float, friction: ContactState
) -> FloatArray:
    """Bound of what contacts (n_contacts,) put into other harmonics [N], 0 where none slips."""
    spring = problem.contact_stiffness * friction.slip.any()
    return size * (spring + problem.cubic_stiffness * size**2)


def _drive(by_force: NDArray, pulled: NDArray, limit: FloatArray) -> FloatArray:
    """Force on modes of unit mass, from motions ``pulled`` of the contacts where no other acts."""
    return np.abs(by_force) if by_force.any() else limit @ np.abs(pulled)


def _excited(
    drive: FloatArray, natural: FloatArray, width: FloatArray, size: float
) -> NDArray[np.bool_]:
    """Whether the resonant response to a ``drive``, times the motion of the mode, is not faint."""
    return drive > _FAINT * size * natural * np.maximum(width, 1e-12 * natural)


class ResonanceFinder:
    """Looks for resonances between the last point of a path and the next."""

    def __init__(self, curve: ContinuationProblem):
        self._curve = curve
        self._known: list[tuple[FloatArray, Modes | None]] = []

    def first_passed(self, base: PathPoint, found: Corrected) -> float | None:
        """Share of the way from a point to the next of the first resonance that neither shows."""
        if base.resonances_below is None or base.resonances_below == found.resonances_below:
            return None  # as many natural frequencies below each harmonic: none was passed
        before = self._at(base.state, base.slip)
        after = self._at(found.point, base.slip)
        if before is None or after is None:
            return None
        # A mode that is near one end alone has the natural frequency that it has there.
        way = after.exciting - before.exciting
        left = np.where(after.near & ~before.near, after.detuning + way, before.detuning)
        right = np.where(before.near & ~after.near, before.detuning - way, after.detuning)
        width = np.minimum(before.width, after.width)
        # A point beside the top, on either side, stands for it.
        passed = (left * right < 0) & (np.minimum(np.abs(left), np.abs(right)) > AT * width)
        passed &= (np.abs(left) > SEEN * width) | (np.abs(left - right) > _SPANNED * width)
        passed &= before.excited | after.excited
        if not passed.any():
            return None
        distance, width = np.abs(left[passed]), width[passed]
        # The flank first, then the top: a mode may add on one side what it takes on the other.
        aim = np.where(distance > 2 * SEEN * width, distance - 1.5 * SEEN * width, distance)
        return float((aim / np.abs(left - right)[passed]).min())

    def _at(self, state: FloatArray, slip: NDArray[np.bool_]) -> Modes | None:
        for known, found in self._known:
            if np.array_equal(known, state):
                return found
        value = float(state[-1])
        friction = self._curve.at(value)[0].locate(state[:-1], slip)
        found = modes(self._curve, state[:-1], value, friction)
        # The end of a step is the start of the next one, or the step is tried again, shorter.
        self._known = [(state, found), *self._known[:2]]
        return found


class Reduced(NamedTuple):
    """Matrices, contact directions and force in coordinates of unit mass, and the way there.

    ``stiffest`` is the highest natural frequency with all contacts stuck [rad/s], infinite with
    springs that grow stiffer.
    """

    stiffness: NDArray
    damping: NDArray
    springs: NDArray
    force: NDArray
    contact_stiffness: FloatArray
    inverse: NDArray
    stiffest: float


def reduced(problem: HarmonicBalance, harmonic: int) -> Reduced:
    """A structure, as one harmonic moves it, in coordinates of unit mass.

    LinAlgError where a motion has no inertia. One sector of a symmetric structure has Hermitian
    matrices, those of its wave around the disk.
    """
    symmetry = problem.symmetry
    return _reduced(problem, 0 if symmetry is None else symmetry.wave(harmonic))


@lru_cache(maxsize=32)
def _reduced(problem: HarmonicBalance, wave: int) -> Reduced:
    mass, *matrices, directions = structure_matrices(problem, wave)
    # Where a triangular system has several right-hand sides, LAPACK starts threads.
    inverse = np.linalg.inv(cholesky(mass, lower=True))

    def scaled(matrix: NDArray) -> NDArray:
        return inverse @ matrix

    damping, stiffness = (scaled(scaled(0.5 * (m + m.conj().T)).conj().T) for m in matrices)
    shape = problem.excitation.shape(problem.model.n_dof, problem.basis)[: problem.n_dof]
    springs = scaled(directions.conj().T)
    force = scaled(problem.excitation.amplitude * shape)
    highest = np.inf
    if not problem.model.has_cubic_springs:
        whole = stiffness + (springs * problem.contact_stiffness) @ springs.conj().T
        highest = float(np.sqrt(np.linalg.eigvalsh(whole)[-1]))
    return Reduced(stiffness, damping, springs, force, problem.contact_stiffness, inverse, highest)


def _columns(problem: HarmonicBalance, harmonic: int) -> list[int]:
    return [problem.basis.component(harmonic, sine) for sine in (False, True)]


def _resonances(
    structure: Reduced, frequency: float, spring: FloatArray, loss: FloatArray
) -> tuple[FloatArray, FloatArray, NDArray]:
    """Natural frequencies, half widths [rad/s] and shapes with contacts of one harmonic."""
    springs = structure.springs
    whole = structure.stiffness + (springs * spring) @ springs.conj().T
    squares, shapes = np.linalg.eigh(whole)
    natural = np.sqrt(np.maximum(squares, 1e-300))
    viscous = structure.damping + (springs * loss / frequency) @ springs.conj().T
    width = np.einsum("ik,ij,jk->k", shapes.conj(), viscous, shapes).real / 2
    return natural, width, shapes
