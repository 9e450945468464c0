"""Resonance finder: narrow resonances between two points of a path that neither point shows.

Where the response is smooth, steps are long, and a step may pass over a lightly damped mode. The
modes of the structure with its contacts at their present stiffness place such resonances.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky

from symhbm.balance import ContactSprings, HarmonicBalance, contact_springs
from symhbm.continuation.correctors import Corrected
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.resonance_count import LARGEST_SIZE, structure_matrices
from symhbm.model import weighted
from symhbm.numerics import FloatArray

_FELT = 2.0
"""Distance from a resonance ahead, in half widths, up to which it changes the path."""
_AT_RESONANCE = 0.3
"""Distance from a resonance, in half widths, up to which a point represents it."""
_SPANNED = 3.0
"""Longest step between both flanks of a resonance without a point at its peak, in half widths."""
_NOT_EXCITED = 1e-9
"""Resonant response, relative to the response, up to which a mode counts as not excited."""


_NONE = 1e100, 1.0, False, False
"""What stands for a mode where another harmonic has more, in the order of `Modes`."""


class Modes(NamedTuple):
    """Modes by harmonic at one point, arrays (n_harmonics, n_dof).

    ``exciting`` (n_harmonics, 1), the exciting frequency of each [rad/s]; ``detuning``, the natural
    less the exciting frequency [rad/s]; ``width``, the half width of the resonance [rad/s];
    ``excited``, whether a force or the slip of a contact excites the mode; ``near``, whether the
    values are those of the mode and not bounds for a mode far away.
    """

    exciting: FloatArray
    detuning: FloatArray
    width: FloatArray
    excited: NDArray[np.bool_]
    near: NDArray[np.bool_]


def modes(
    curve: ContinuationProblem,
    unknowns: FloatArray,
    value: float,
    switches: NDArray[np.bool_],
    springs: ContactSprings | None = None,
) -> Modes | None:
    """Modes of the structure at a point of a curve, None for one too large or without inertia.

    ``springs`` are those of the contacts there, by default those of their states ``switches``.
    """
    problem, frequency = curve.at(value)
    if problem.n_dof > LARGEST_SIZE:
        return None
    size = float(np.linalg.norm(unknowns))
    by_harmonic = []
    limit = _largest_contact_force(problem, size, bool(switches.any()))
    harmonics = [n for n in problem.harmonics if n > 0]
    if springs is None:
        states = problem.locate(unknowns, frequency, switches)
        springs = contact_springs(problem, unknowns, frequency, states)
    for n, *contacts in zip(harmonics, *springs, strict=True):
        cosine, sine = _columns(problem, n)
        if not problem.model.has_matrices:
            by_harmonic.append(_without_matrices(problem, n, frequency, contacts, size, limit))
            if by_harmonic[-1] is None:
                return None
            continue
        try:
            structure = reduced(problem, n)
        except np.linalg.LinAlgError:
            return None  # without inertia there are no coordinates of unit mass
        natural, width, shapes = _resonances(structure, n * frequency, *contacts)
        force = structure.force[:, cosine] - 1j * structure.force[:, sine]
        contact_motion = structure.springs.conj().T @ shapes
        modal_force = _modal_force(shapes.conj().T @ force, contact_motion, limit)
        motion = np.linalg.norm(structure.inverse.conj().T @ shapes, axis=0)
        excited = _excited(modal_force * motion, natural, width, size)
        near = np.ones(len(natural), dtype=bool)
        by_harmonic.append((natural - n * frequency, width, excited, near))
    exciting = frequency * np.array(harmonics)[:, None]
    count = [len(parts[0]) for parts in by_harmonic]
    if len({*count}) > 1:  # waves around a disk, each with modes of its own
        by_harmonic = [
            [
                np.pad(part, (0, max(count) - n), constant_values=none)
                for part, none in zip(parts, _NONE, strict=True)
            ]
            for parts, n in zip(by_harmonic, count, strict=True)
        ]
    return Modes(exciting, *(np.array(parts) for parts in zip(*by_harmonic, strict=True)))


def _without_matrices(
    problem: HarmonicBalance,
    harmonic: int,
    frequency: float,
    contacts: Sequence[FloatArray],
    size: float,
    limit: FloatArray,
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], NDArray[np.bool_]] | None:
    """The same as the structure itself tells its modes, None if it does not."""
    near_modes = problem.model.modes_near(harmonic, frequency, *contacts)
    if near_modes is None:
        return None
    detuning, width, near, shapes = near_modes
    force = problem.force(frequency)[:, _columns(problem, harmonic)] @ [1, -1j]
    natural = (harmonic * frequency + detuning)[near]
    contact_motion = problem.model.directions_in(harmonic) @ shapes
    modal_force = _modal_force(shapes.conj().T @ force, contact_motion, limit)
    motion = np.linalg.norm(shapes, axis=0)
    excited = np.ones(len(width), dtype=bool)
    excited[near] = _excited(modal_force * motion, natural, width[near], size)
    return detuning, width, excited, near


def _largest_contact_force(problem: HarmonicBalance, size: float, switched: bool) -> FloatArray:
    """Bound of the contact forces in other harmonics (n_rows,) [N], 0 where none slips."""
    result = np.zeros(problem.layout.n_rows)
    for group in problem.contacts.groups:
        largest = group.law.largest_force(problem.contacts.values_of(group), size, switched)
        result[group.rows] += largest[:, None]
    return result


def _modal_force(by_force: NDArray, contact_motion: NDArray, limit: FloatArray) -> FloatArray:
    """Force on modes of unit mass: the exciting one, or the bound from contacts where it is 0."""
    return np.abs(by_force) if by_force.any() else limit @ np.abs(contact_motion)


def _excited(
    modal_force: FloatArray, natural: FloatArray, width: FloatArray, size: float
) -> NDArray[np.bool_]:
    """Whether the resonant response to a modal force, times the motion of the mode, matters."""
    return modal_force > _NOT_EXCITED * size * natural * np.maximum(width, 1e-12 * natural)


class ResonanceFinder:
    """Finds resonances between the last point of a path and the next."""

    def __init__(self, curve: ContinuationProblem):
        self._curve = curve
        self._cached: list[tuple[FloatArray, Modes | None]] = []

    def first_passed(self, base: PathPoint, solution: Corrected) -> float | None:
        """Share of a step at which the first resonance lies that neither of its ends shows."""
        if base.resonances_below is None or base.resonances_below == solution.resonances_below:
            return None  # as many natural frequencies below each harmonic: none was passed
        before = self._modes_at(base.state, base.switches, base.springs)
        after = self._modes_at(solution.point, base.switches, solution.springs)
        if before is None or after is None:
            return None
        # A mode near only one end keeps the natural frequency that it has there.
        change = after.exciting - before.exciting
        left = np.where(after.near & ~before.near, after.detuning + change, before.detuning)
        right = np.where(before.near & ~after.near, before.detuning - change, after.detuning)
        width = np.minimum(before.width, after.width)
        # A point beside the peak, on either side, represents it.
        nearest = np.minimum(np.abs(left), np.abs(right))
        passed = (left * right < 0) & (nearest > _AT_RESONANCE * width)
        passed &= (np.abs(left) > _FELT * width) | (np.abs(left - right) > _SPANNED * width)
        passed &= before.excited | after.excited
        if not passed.any():
            return None
        distance, width = np.abs(left[passed]), width[passed]
        # The flank first, then the peak: its two flanks change the response in opposite senses.
        aim = np.where(distance > 2 * _FELT * width, distance - 1.5 * _FELT * width, distance)
        return float((aim / np.abs(left - right)[passed]).min())

    def _modes_at(
        self, state: FloatArray, switches: NDArray[np.bool_], springs: ContactSprings | None
    ) -> Modes | None:
        for cached_state, at_state in self._cached:
            if np.array_equal(cached_state, state):
                return at_state
        at_state = modes(self._curve, state[:-1], float(state[-1]), switches, springs)
        # The end of a step starts the next one, or a shorter step starts at the same point.
        self._cached = [(state, at_state), *self._cached[:2]]
        return at_state


class Reduced(NamedTuple):
    """Matrices, contact directions and force in coordinates of unit mass.

    ``inverse`` transforms to these coordinates: ``inverse @ mass @ inverse^H`` is the unit matrix.
    ``stiffest`` is the highest natural frequency with all contacts stuck [rad/s], infinite where
    their stiffness has no bound.
    """

    stiffness: NDArray
    damping: NDArray
    springs: NDArray
    force: NDArray
    stuck_springs: FloatArray
    inverse: NDArray
    stiffest: float


def reduced(problem: HarmonicBalance, harmonic: int) -> Reduced:
    """The structure as one harmonic moves it, in coordinates of unit mass.

    Raises LinAlgError where a motion has no inertia. One sector of a symmetric structure has
    Hermitian matrices, those of its wave around the disk.
    """
    symmetry = problem.symmetry
    return _reduced(problem, 0 if symmetry is None else symmetry.wave(harmonic))


@lru_cache(maxsize=32)
def _reduced(problem: HarmonicBalance, wave: int) -> Reduced:
    mass, *matrices, directions = structure_matrices(problem, wave)
    # A triangular solve with several right-hand sides would start threads in LAPACK.
    inverse = np.linalg.inv(cholesky(mass, lower=True))

    def scaled(matrix: NDArray) -> NDArray:
        return inverse @ matrix

    damping, stiffness = (scaled(scaled(0.5 * (m + m.conj().T)).conj().T) for m in matrices)
    shape = problem.model.felt_shape(problem.excitation, problem.basis)[: problem.n_dof]
    springs = scaled(directions.conj().T)
    force = scaled(problem.excitation.amplitude * shape)
    highest = np.inf
    stuck_springs = problem.model.stuck_springs
    if problem.symmetry is not None:
        stuck_springs = stuck_springs[problem.model.rows_of(problem.symmetry.contacts)]
    if problem.model.bounded:
        stuck = stiffness + (springs * stuck_springs) @ springs.conj().T
        highest = float(np.sqrt(np.linalg.eigvalsh(stuck)[-1]))
    return Reduced(stiffness, damping, springs, force, stuck_springs, inverse, highest)


def _columns(problem: HarmonicBalance, harmonic: int) -> list[int]:
    return [problem.basis.component(harmonic, sine) for sine in (False, True)]


def _resonances(
    structure: Reduced, frequency: float, spring: FloatArray, loss: FloatArray
) -> tuple[FloatArray, FloatArray, NDArray]:
    """Natural frequencies, half widths [rad/s] and shapes with the contacts in one harmonic."""
    springs = structure.springs
    stiffness = structure.stiffness + weighted(springs, spring) @ springs.conj().T
    squares, shapes = np.linalg.eigh(stiffness)
    natural = np.sqrt(np.maximum(squares, 1e-300))
    viscous = structure.damping + weighted(springs, loss / frequency) @ springs.conj().T
    width = np.sum(shapes.conj() * (viscous @ shapes), axis=0).real / 2
    return natural, width, shapes
