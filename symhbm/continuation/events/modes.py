"""Modes of a structure with its contacts as springs, and resonances between two points of a path.

Where the response is smooth, steps are long, and a step may pass over a lightly damped mode that
neither point shows. The modes of the structure with its contacts at their present stiffness place
such resonances.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, eigh

from symhbm.balance import HarmonicBalance
from symhbm.continuation.correctors import LARGEST_SIZE, structure_matrices
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem, Corrected
from symhbm.model.linear import weighted
from symhbm.numerics import FloatArray, length_of

_NOT_EXCITED = 1e-9
"""Resonant response, relative to the response, up to which a mode counts as not excited."""
_FEW = 40
"""Degrees of freedom up to which all modes take no longer than some of them."""


class Modes(NamedTuple):
    """Modes at one point in the order of their frequencies, harmonic by harmonic, arrays (n,).

    ``exciting``, the exciting frequency [rad/s]; ``detuning``, the natural less the exciting
    frequency [rad/s]; ``width``, the half width of the resonance [rad/s]; ``excited``, whether a
    force or the slip of a contact excites the mode; ``near``, whether the values are those of the
    mode and not bounds for a mode far away.
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
    springs: FloatArray | None = None,
    wanted: Sequence[tuple[int, int]] | None = None,
) -> Modes | None:
    """Modes of the structure at a point of a curve, None for one too large or without inertia.

    ``springs`` are those of the contacts there, as of ``contacts.springs``, by default in their
    states ``switches``. Of a structure with matrices those ``wanted`` by harmonic, from a first to
    before a last one; all by default.
    """
    problem, frequency = curve.at(value)
    if problem.n_dof > LARGEST_SIZE:
        return None
    size = length_of(unknowns)
    limit = _largest_contact_force(problem, size, bool(switches.any()))
    harmonics = [n for n in problem.harmonics if n > 0]
    wanted = wanted or [(0, problem.n_dof)] * len(harmonics)
    if springs is None:
        states = problem.locate(unknowns, frequency, switches)
        springs = problem.contacts.springs(unknowns, frequency, states)
    rows = (problem.contacts.by_row(part) for part in springs)
    by_harmonic = []
    for n, some, *contacts in zip(harmonics, wanted, *rows, strict=True):
        if not problem.model.has_matrices:
            found = _without_matrices(problem, n, frequency, contacts, size, limit)
            if found is None:
                return None
        elif some[0] == some[1]:
            continue
        else:
            try:
                structure = reduced(problem, n)
            except np.linalg.LinAlgError:
                return None  # without inertia there are no coordinates of unit mass
            at = structure, n * frequency, *contacts
            found = _with_matrices(at, some, _of_force(problem, n, frequency), size, limit)
        by_harmonic.append((np.full(len(found[0]), n * frequency), *found))
    if not by_harmonic:
        return None
    return Modes(*map(np.concatenate, zip(*by_harmonic, strict=True)))


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


@dataclass(frozen=True, eq=False)
class Reduced:
    """Matrices, contact directions and force in coordinates of unit mass.

    ``inverse`` transforms to these coordinates: ``inverse @ mass @ inverse^H`` is the unit matrix.
    ``bounded`` tells whether contacts have a largest stiffness, ``stiffest_springs``. ``rows`` are
    those of all other matrices, one below the other: damping, adjoints of directions, of
    ``inverse`` and of the force.
    """

    stiffness: NDArray
    damping: NDArray
    springs: NDArray
    force: NDArray
    stiffest_springs: FloatArray
    inverse: NDArray
    bounded: bool
    rows: NDArray

    @cached_property
    def stiffest(self) -> float:
        """The highest natural frequency with all contacts stuck [rad/s]; infinite without bound."""
        if not self.bounded:
            return np.inf
        stuck = self.stiffness + (self.springs * self.stiffest_springs) @ self.springs.conj().T
        return float(np.sqrt(np.linalg.eigvalsh(stuck)[-1]))


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
    shapes = problem.model.felt_shapes(problem.excitation, problem.basis)
    shape = np.hstack([shapes[power][: problem.n_dof] for power in sorted(shapes)])
    springs = scaled(directions.conj().T)
    force = scaled(problem.excitation.amplitude * shape)
    stiffest_springs = problem.model.groups.stiffest_springs
    if problem.symmetry is not None:
        stiffest_springs = stiffest_springs[problem.model.groups.rows_of(problem.symmetry.contacts)]
    bounded = problem.model.groups.bounded
    rows = np.vstack([damping, *(part.conj().T for part in (springs, inverse, force))])
    return Reduced(stiffness, damping, springs, force, stiffest_springs, inverse, bounded, rows)


def _columns(problem: HarmonicBalance, harmonic: int) -> list[int]:
    return [problem.basis.component(harmonic, sine) for sine in (False, True)]


def _of_force(
    problem: HarmonicBalance, harmonic: int, frequency: float
) -> list[tuple[list[int], FloatArray]]:
    """Columns of the force in one harmonic and what each is multiplied by, of cosine and sine."""
    powers, size = problem.equations.powers, problem.basis.n_components
    factors = frequency ** np.array(powers, dtype=float)
    columns = _columns(problem, harmonic)
    return [([k * size + one for k in range(len(powers))], factors) for one in columns]


def _with_matrices(
    at: tuple[Any, ...],
    wanted: tuple[int, int],
    of_force: list[tuple[list[int], FloatArray]],
    size: float,
    limit: FloatArray,
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], NDArray[np.bool_]]:
    """Detuning, half widths [rad/s] and whether modes are excited and near, in one harmonic.

    ``at`` has the structure, the frequency of the harmonic, springs and losses of contacts;
    ``of_force`` the columns of the force and their factors, of cosine and sine.
    """
    structure, frequency, spring, loss = at
    springs = structure.springs
    n, m = springs.shape
    stiffness = structure.stiffness + weighted(springs, spring) @ springs.conj().T
    if n <= _FEW:
        squares, shapes = np.linalg.eigh(stiffness)
        squares, shapes = squares[slice(*wanted)], shapes[:, slice(*wanted)]
    else:
        some: Any = dict(subset_by_index=[wanted[0], wanted[1] - 1], driver="evr")
        squares, shapes = eigh(stiffness, check_finite=False, **some)
    seen = structure.rows @ shapes
    damped, contacts, whole = seen[:n], seen[n : n + m], seen[n + m : 2 * n + m]
    forces = seen[2 * n + m :]
    cosine, sine = (factors @ forces[columns] for columns, factors in of_force)
    lossy = weighted(contacts.T, loss / frequency).T
    natural = np.sqrt(np.maximum(squares, 1e-300))
    moving, lost = np.vstack([shapes, contacts]), np.vstack([damped, lossy])
    width = np.einsum("ij,ij->j", moving.conj(), lost).real / 2
    modal_force = _modal_force(cosine + 1j * sine, contacts, limit)
    excited = _excited(modal_force * np.linalg.norm(whole, axis=0), natural, width, size)
    return natural - frequency, width, excited, np.ones(len(squares), dtype=bool)


_FELT = 2.0
"""Distance from a resonance ahead, in half widths, up to which it changes the path."""
_AT_RESONANCE = 0.3
"""Distance from a resonance, in half widths, up to which a point represents it."""
_SPANNED = 3.0
"""Longest step between both flanks of a resonance without a point at its peak, in half widths."""


class ResonanceFinder:
    """Finds resonances between the last point of a path and the next."""

    def __init__(self, curve: ContinuationProblem):
        self._curve = curve
        self._cached: list[tuple[FloatArray, Any, Modes | None]] = []

    def first_passed(self, base: PathPoint, solution: Corrected) -> float | None:
        """Share of a step at which the first resonance lies that neither of its ends shows."""
        if base.resonances_below is None or base.resonances_below == solution.resonances_below:
            return None  # as many natural frequencies below each harmonic: none was passed
        passed = None
        if solution.resonances_below is not None:
            below = zip(base.resonances_below, solution.resonances_below, strict=True)
            passed = [(min(both), max(both)) for both in below]
        before = self._modes_at(base.state, base.switches, base.springs, passed)
        after = self._modes_at(solution.point, base.switches, solution.springs, passed)
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
        self,
        state: FloatArray,
        switches: NDArray[np.bool_],
        springs: FloatArray | None,
        passed: list[tuple[int, int]] | None,
    ) -> Modes | None:
        for known, of, at_state in self._cached:
            if of == passed and np.array_equal(known, state):
                return at_state
        at_state = modes(self._curve, state[:-1], float(state[-1]), switches, springs, passed)
        # A shorter step starts at the same point.
        self._cached = [(state, passed, at_state), *self._cached[:2]]
        return at_state
