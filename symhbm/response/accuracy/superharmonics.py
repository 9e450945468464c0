"""Superharmonic resonances: modes that friction forces excite with truncated harmonics.

They lie far from the main peak, can be narrow, and are absent from responses that lack their
harmonic. The contact forces and the modes of the structure tell where they are.
"""

from collections.abc import Sequence

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import LARGEST_SIZE, ContinuationProblem, PathPoint
from symhbm.continuation.events import Reduced, reduced
from symhbm.model.contacts import stick_intervals
from symhbm.numerics import FloatArray, FourierBasis, largest_displacement
from symhbm.response.accuracy.harmonic_sets import HarmonicSets
from symhbm.response.accuracy.truncation import reference

_LEAST_DAMPING = 1e-300
"""[rad2/s2] Keeps resonant responses of undamped modes finite."""


def superharmonic_levels(
    equations: ContinuationProblem,
    points: Sequence[PathPoint],
    sets: HarmonicSets,
    level: int,
    accuracy: float,
) -> list[int]:
    """Levels with the harmonics that excite resonances between points, by segment.

    ``points`` solve the equations with the harmonics of a ``level``. Resonances count where their
    response is larger than the ``accuracy``. Empty without harmonics that reach a mode.
    """
    problems, frequencies = zip(*(equations.at(p.value) for p in points), strict=True)
    if problems[0].in_modes is None or problems[0].in_modes.n_dof > LARGEST_SIZE:
        return []
    harmonics = np.array([n for n in sets.harmonics(sets.last) if n > sets.highest(level)])
    try:
        # A followed parameter makes the structure stiffest at one of its ends.
        ends = problems[0], problems[-1]
        stiffest = [max(_reduced(p, n).stiffest for p in ends) for n in harmonics]
        harmonics = harmonics[harmonics * min(frequencies) < np.array(stiffest)]
        if not len(harmonics):
            return []
        unknowns = [point.unknowns for point in points]
        detuning, response = _superharmonics(problems, unknowns, frequencies, harmonics)
    except np.linalg.LinAlgError:
        return []  # without inertia there are no modes
    large = np.maximum(response[1:], response[:-1]) > accuracy
    crossed = np.any(large & (detuning[1:] * detuning[:-1] < 0), axis=2)
    return [sets.level(int(harmonics[of].max())) if of.any() else level for of in crossed]


def _superharmonics(
    problems: Sequence[HarmonicBalance],
    unknowns: Sequence[FloatArray],
    frequencies: Sequence[float],
    harmonics: np.ndarray,
) -> tuple[FloatArray, FloatArray]:
    """Modes of one structure that the friction of responses excites in other ``harmonics``.

    Natural minus exciting frequencies [rad/s], and the largest displacements at resonance over
    those of the responses, (n_points, n_harmonics, n_modes) each.
    """
    sliders = [p.contacts.sliders(omega) for p, omega in zip(problems, frequencies, strict=True)]
    rows, n_rows = sliders[0].row, problems[0].layout.n_rows
    relative = [p.layout.relative(u)[rows] for p, u in zip(problems, unknowns, strict=True)]
    stiffness = np.concatenate([of_point.stiffness for of_point in sliders])
    limit = np.concatenate([of_point.limit for of_point in sliders])
    basis = problems[0].basis
    of_friction = friction_beyond(basis, np.concatenate(relative), stiffness, limit, harmonics)
    # Other contacts count as springs that nothing excites.
    force = np.zeros((len(problems), n_rows, len(harmonics)), complex)
    share = np.ones(force.shape)
    for whole, part in zip((force, share), of_friction, strict=True):
        whole[:, rows] = part.reshape(len(problems), len(rows), len(harmonics))
    symmetry = problems[0].symmetry
    wave = np.array([0 if symmetry is None else symmetry.wave(int(n)) for n in harmonics])
    assert problems[0].in_modes is not None
    shape = len(problems), len(harmonics), problems[0].in_modes.n_dof
    detuning, response = np.empty((2, *shape))
    by_point = zip(problems, unknowns, frequencies, strict=True)
    for i, (problem, motion, omega) in enumerate(by_point):
        coefficients = problem.layout.coefficients(motion)
        size = reference(largest_displacement(problem.basis, coefficients)[0])
        for same_wave in (wave == w for w in np.unique(wave)):
            natural, width, shapes, modal_force = _modes(
                _reduced(problem, harmonics[same_wave][0]),
                force[i][:, same_wave],
                share[i][:, same_wave],
            )
            exciting = harmonics[same_wave, None] * omega
            resonant = modal_force / np.maximum(2 * exciting * width, _LEAST_DAMPING)
            detuning[i, same_wave] = natural - exciting
            largest = np.abs(shapes[: problem.n_dof] / size[:, None]).max(axis=0)
            response[i, same_wave] = resonant * largest
    return detuning, response


def _reduced(problem: HarmonicBalance, harmonic: np.integer) -> Reduced:
    assert problem.in_modes is not None
    return reduced(problem.in_modes, int(harmonic))


def friction_beyond(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    harmonics: np.ndarray,
) -> tuple[np.ndarray, FloatArray]:
    """Friction force in other ``harmonics`` (n_harmonics,) above 0, arguments as of `locate`.

    Returns the coefficients ``a_n - i b_n`` [N] and the share of the contact stiffness that acts on
    a small motion in each harmonic, both (n_contacts, n_harmonics).
    """
    contact, begin, end = stick_intervals(basis, coefficients, contact_stiffness, slip_limit)
    n_contacts = len(coefficients)
    slips = np.isin(np.arange(n_contacts), contact) | (slip_limit == 0)
    # The force changes only while the contact sticks, as the spring does: integration by parts.
    orders = basis.order[basis.is_sine]
    cosines = coefficients[:, ~basis.is_sine & (basis.order > 0)]
    rate = orders * (coefficients[:, basis.is_sine] + 1j * cosines)
    width, middle = end - begin, (end + begin) / 2
    integral = np.zeros((len(contact), len(harmonics)), dtype=complex)
    for m, amplitude in zip(orders, rate[contact].T, strict=True):
        for factor, number in ((amplitude, m - harmonics), (amplitude.conj(), -m - harmonics)):
            phase = np.exp(1j * number * middle[:, None])
            wave = width[:, None] * np.sinc(number * width[:, None] / (2 * np.pi)) * phase
            integral += factor[:, None] / 2 * wave
    total = np.zeros((n_contacts, len(harmonics)), dtype=complex)
    np.add.at(total, contact, integral)
    # The force of a contact that begins to stick does not depend on its displacement before.
    share = np.zeros((n_contacts, len(harmonics)))
    memory_loss = np.sin(harmonics * width[:, None]) / harmonics
    np.add.at(share, contact, (width[:, None] - memory_loss) / (2 * np.pi))
    share[~slips] = 1.0
    return contact_stiffness[:, None] * total / (1j * np.pi * harmonics), share


def _modes(
    structure: Reduced, force: np.ndarray, share: FloatArray
) -> tuple[FloatArray, FloatArray, np.ndarray, FloatArray]:
    """Natural frequencies by harmonic, half widths [rad/s], shapes, and modal forces by harmonic.

    The modes are those with the mean contact stiffness over the harmonics; their frequencies are
    corrected to first order for each harmonic.
    """
    springs = structure.springs
    stiffness = structure.stiffest_springs[:, None] * share
    mean = stiffness.mean(axis=1)
    squares, vectors = np.linalg.eigh(structure.stiffness + (springs * mean) @ springs.conj().T)
    travel = springs.conj().T @ vectors
    squares = squares + (stiffness.T - mean) @ np.abs(travel) ** 2
    width = np.sum(vectors.conj() * (structure.damping @ vectors), axis=0).real / 2
    shape = structure.inverse.conj().T @ vectors
    modal_force = np.abs(force.T @ travel.conj())
    return np.sqrt(np.maximum(squares, 0.0)), width, shape, modal_force
