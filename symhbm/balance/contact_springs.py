"""Contacts as springs and dampers of each harmonic: what the modes of a structure feel of them."""

import math
from functools import lru_cache

import numpy as np

from symhbm.balance.evaluation import ContactStates
from symhbm.balance.harmonic_balance import HarmonicBalance
from symhbm.model.contacts import ContactLaw, graph_of
from symhbm.numerics import Compiled, FloatArray, FourierBasis


def contact_springs(
    problem: HarmonicBalance, unknowns: FloatArray, frequency: float, contacts: ContactStates
) -> FloatArray:
    """Springs equivalent to the contacts in a motion, see `symhbm.laws.ContactLaw.springs`.

    Stiffness and loss [N/m] by harmonic above 0, (2, n_harmonics, m^2 of each contact).
    """
    n_harmonics = sum(n > 0 for n in problem.harmonics)
    relative = problem.layout.relative(unknowns)
    parts: list[list[FloatArray]] = [[], []]
    for group in problem.contacts.groups:
        if not group.n:
            continue
        given = (
            problem.contacts.motions(group, relative).ravel(),
            frequency,
            problem.contacts.packed(group),
            contacts.groups[group.name].events.ravel(),
        )
        springs = _each(group.law, problem.basis, group.n)(*given)
        for part, found in zip(parts, springs, strict=True):
            # Contact by contact, and by harmonic within.
            by_contact = found.reshape(group.n, n_harmonics, -1)
            part.append(by_contact.transpose(1, 0, 2).reshape(n_harmonics, -1))
    nothing = np.zeros((n_harmonics, 0))
    return np.array([np.concatenate([nothing, *part], axis=1) for part in parts])


def by_row(problem: HarmonicBalance, springs: FloatArray) -> FloatArray:
    """Springs (n_harmonics, m^2 of each contact) by the displacements that they act on.

    (n_harmonics, n_rows), or (n_harmonics, n_rows, n_rows) where a law couples displacements.
    """
    size, places = problem.contacts.places_of_springs
    result, first = np.zeros((len(springs), math.prod(size))), 0
    for of_group in places:  # groups may act on the same displacements
        result[:, of_group] += springs[:, first : first + len(of_group)]
        first += len(of_group)
    return result.reshape(len(springs), *size)


@lru_cache(maxsize=64)
def _each(law: ContactLaw, basis: FourierBasis, n_contacts: int) -> Compiled:
    return Compiled(graph_of(law, basis).springs.map(n_contacts))
