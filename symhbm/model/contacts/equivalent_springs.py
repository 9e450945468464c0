"""Contacts as springs and dampers of each harmonic: what the modes of a structure feel of them."""

from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symhbm.model.contacts.coulomb import ContactState
from symhbm.numerics import Compiled, FloatArray, FourierBasis

LEADING = 0.5
"""Share of a harmonic in the square of a motion from which it leads."""


class ContactSprings(NamedTuple):
    """Stiffness and loss of contacts [N/m], by harmonic above 0, (n_harmonics, n_contacts) each."""

    stiffness: FloatArray
    loss: FloatArray


def contact_springs(
    basis: FourierBasis, coefficients: FloatArray, friction: ContactState, *parameters: Any
) -> ContactSprings:
    """Springs of contacts with some ``coefficients`` (n_contacts, n_components) [m] of motion.

    ``parameters`` (n_contacts,) are their stiffness [N/m], limit of slip [N] and cubic stiffness
    [N/m^3].
    """
    if not len(coefficients):
        return ContactSprings(*np.zeros((2, sum(n > 0 for n in basis.harmonics), 0)))
    # CasADi stores columns one after the other.
    matrix = friction.matrix.transpose(0, 2, 1).ravel()
    given = coefficients.ravel(), matrix, friction.vector.ravel(), *parameters
    found = _each(basis, len(coefficients))(*given)
    return ContactSprings(*(part.reshape(len(coefficients), -1).T for part in found))


@lru_cache(maxsize=32)
def _each(basis: FourierBasis, n_contacts: int) -> Compiled:
    return Compiled(spring_kernel(basis).map(n_contacts))


@lru_cache(maxsize=32)
def spring_kernel(basis: FourierBasis) -> ca.Function:
    """CasADi function of one contact: its stiffness and loss in each harmonic above 0 [N/m].

    In the mean over its motion where that harmonic leads it, else for a small motion beside it:
    what the other harmonics make a contact do is a force, and no stiffness. Inputs:
    ``coefficients`` [m], ``matrix`` and ``vector`` of `ContactState`, ``contact_stiffness``
    [N/m], ``slip_limit`` [N] and ``cubic_stiffness`` [N/m^3].
    """
    size = basis.n_components
    y, vector = ca.SX.sym("coefficients", size), ca.SX.sym("vector", size)
    matrix = ca.SX.sym("matrix", size, size)
    names = ("contact_stiffness", "slip_limit", "cubic_stiffness")
    stiffness, limit, cubic = map(ca.SX.sym, names)
    force = stiffness * ca.mtimes(matrix, y) + limit * vector
    total = ca.sumsqr(y)
    springs, losses = [], []
    for a in np.flatnonzero(~basis.is_sine & (basis.order > 0)).tolist():
        b = a + 1
        square = ca.sumsqr(y[a : a + 2])
        leads = square > LEADING * total
        safe = ca.if_else(leads, square, 1)
        in_phase = ca.dot(force[a : a + 2], y[a : a + 2]) / safe
        out_of_phase = (force[a] * y[b] - force[b] * y[a]) / safe
        beside = stiffness / 2 * (matrix[a, a] + matrix[b, b])
        turned = stiffness / 2 * (matrix[a, b] - matrix[b, a])
        share = ca.fmin(ca.fmax(ca.if_else(leads, in_phase, beside), 0), stiffness)
        # The mean stiffness of a cube to its own motion is half that to a motion beside it.
        springs.append(share + cubic * (0.75 * square + 1.5 * (total - square)))
        losses.append(ca.fmax(ca.if_else(leads, out_of_phase, turned), 0))
    inputs = [y, matrix, vector, stiffness, limit, cubic]
    return ca.Function("springs", inputs, [ca.vertcat(*springs), ca.vertcat(*losses)])
