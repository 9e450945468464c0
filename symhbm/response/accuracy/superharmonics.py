"""Superharmonic resonances: modes that a friction force excites with harmonics left out.

They lie far from the main peak, can be narrow, and show in no response of those that lack their
harmonic: the force of the contacts and the modes of the structure tell where to look.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import LARGEST_SIZE
from symhbm.continuation.events import Reduced, reduced
from symhbm.model.contacts import stick_intervals
from symhbm.numerics import FloatArray, FourierBasis


class Superharmonics(NamedTuple):
    """Modes under harmonics left out, arrays (n_harmonics, n_dof).

    ``detuning``, the natural less the exciting frequency [rad/s]; ``response``, the largest
    displacement at resonance over that of a reference.
    """

    detuning: FloatArray
    response: FloatArray


def superharmonics(
    problems: Sequence[HarmonicBalance],
    unknowns: Sequence[FloatArray],
    frequencies: Sequence[float],
    harmonics: np.ndarray,
    references: Sequence[FloatArray],
) -> list[Superharmonics] | None:
    """Modes that each of several responses of one structure would excite with other ``harmonics``.

    ``unknowns`` (n_unknowns,) [m], ``frequencies`` in rad/s, ``harmonics`` (n_harmonics,),
    ``references`` (n_dof,) [m]. None for a structure too large for its modes, or without inertia.
    """
    if not problems or problems[0].n_dof > LARGEST_SIZE:
        return None
    relative = np.concatenate([p.relative(u) for p, u in zip(problems, unknowns, strict=True)])
    stiffness = np.concatenate([problem.contact_stiffness for problem in problems])
    limit = np.concatenate([problem.slip_limit for problem in problems])
    force, share = friction_beyond(problems[0].basis, relative, stiffness, limit, harmonics)
    symmetry = problems[0].symmetry
    wave = np.array([0 if symmetry is None else symmetry.wave(int(n)) for n in harmonics])
    count, found = len(problems), []
    given = (problems, frequencies, references, np.split(force, count), np.split(share, count))
    for problem, omega, size, push, spring in zip(*given, strict=True):
        detuning = np.empty((len(harmonics), problem.n_dof))
        response = np.empty_like(detuning)
        for alike in (wave == w for w in np.unique(wave)):
            try:
                structure = reduced(problem, int(harmonics[alike][0]))
            except np.linalg.LinAlgError:
                return None
            natural, width, shape, drive = _modes(structure, push[:, alike], spring[:, alike])
            exciting = harmonics[alike, None] * omega
            resonant = drive / np.maximum(2 * exciting * width, 1e-300)
            detuning[alike] = natural - exciting
            response[alike] = resonant * np.abs(shape / size[:, None]).max(axis=0)
        found.append(Superharmonics(detuning, response))
    return found


def friction_beyond(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    harmonics: np.ndarray,
) -> tuple[np.ndarray, FloatArray]:
    """Friction force in other ``harmonics`` (n_harmonics,) above 0, arguments as of `locate`.

    Returns ``a_n - i b_n`` [N] and the share of the spring that a small motion in each harmonic
    meets, both (n_contacts, n_harmonics).
    """
    contact, begin, end = stick_intervals(basis, coefficients, contact_stiffness, slip_limit)
    n_contacts = len(coefficients)
    slips = np.isin(np.arange(n_contacts), contact) | (slip_limit == 0)
    # The rate of the force is that of the spring while it sticks, and nothing else: by parts.
    own = basis.order[basis.is_sine]
    rate = own * (coefficients[:, basis.is_sine] + 1j * _cosines(basis, coefficients))
    width, middle = end - begin, (end + begin) / 2
    integral = np.zeros((len(contact), len(harmonics)), dtype=complex)
    for m, amplitude in zip(own, rate[contact].T, strict=True):
        for factor, number in ((amplitude, m - harmonics), (amplitude.conj(), -m - harmonics)):
            phase = np.exp(1j * number * middle[:, None])
            wave = width[:, None] * np.sinc(number * width[:, None] / (2 * np.pi)) * phase
            integral += factor[:, None] / 2 * wave
    total = np.zeros((n_contacts, len(harmonics)), dtype=complex)
    np.add.at(total, contact, integral)
    # A contact that begins to stick forgets how it was displaced until then.
    share = np.zeros((n_contacts, len(harmonics)))
    forgetting = np.sin(harmonics * width[:, None]) / harmonics
    np.add.at(share, contact, (width[:, None] - forgetting) / (2 * np.pi))
    share[~slips] = 1.0
    return contact_stiffness[:, None] * total / (1j * np.pi * harmonics), share


def _cosines(basis: FourierBasis, coefficients: FloatArray) -> FloatArray:
    return coefficients[:, ~basis.is_sine & (basis.order > 0)]


def _modes(
    structure: Reduced, force: np.ndarray, share: FloatArray
) -> tuple[FloatArray, FloatArray, np.ndarray, FloatArray]:
    """Natural frequencies by harmonic, half widths [rad/s], shapes, and their forces by harmonic.

    The modes are those of the mean over the harmonics, their frequencies to first order beside it.
    """
    springs = structure.springs
    held = structure.contact_stiffness[:, None] * share
    mean = held.mean(axis=1)
    squares, vectors = np.linalg.eigh(structure.stiffness + (springs * mean) @ springs.conj().T)
    travel = springs.conj().T @ vectors
    squares = squares + (held.T - mean) @ np.abs(travel) ** 2
    width = np.einsum("ik,ij,jk->k", vectors.conj(), structure.damping, vectors).real / 2
    shape = structure.inverse.conj().T @ vectors
    drive = np.abs(force.T @ travel.conj())
    return np.sqrt(np.maximum(squares, 0.0)), width, shape, drive
