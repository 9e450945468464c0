"""Responses of large structures without condensation: exact receptances of all equations.

One sparse factorisation of the whole dynamic stiffness per harmonic gives the response to the
excitation and to unit forces of the contacts; Newton's method on the contacts alone does the rest.
Long residuals leave no round-off of stiff elements.
"""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

import symhbm as sh
from symhbm.model import force_coefficients

LONG, LONG_COMPLEX = np.longdouble, np.clongdouble
NEEDS_LONG = np.finfo(LONG).eps < 1e-18


class Response(NamedTuple):
    """Motion of all degrees of freedom (n_dof, n_components) [m], and what proves it.

    ``residual``, the largest of all equations over the largest sum of absolute force terms;
    ``step``, the last one of Newton's method, relative.
    """

    coefficients: np.ndarray
    residual: float
    step: float


def whole_response(model, force, harmonics, frequency, kept, start):
    """Response at a frequency [Hz], from one of the ``kept`` degrees of freedom.

    ``start`` (n_kept, n_components) [m].
    """
    omega = 2 * np.pi * frequency
    touched = sorted({dof for contact in model.contacts for dof in contact})
    alone = contacts_alone(model, touched, harmonics)
    basis = alone.basis
    size, n_touched = basis.n_components, len(touched)
    shape = force_coefficients(force, model.n_dof, basis)
    parts = [m.astype(LONG).tocsc() for m in matrices(model)]
    free = np.zeros((model.n_dof, size))
    whole = np.zeros((model.n_dof, size, n_touched, size))
    for n in basis.harmonics:
        at = [basis.component(n) + k for k in range(1 + (n > 0))]
        load = np.zeros((model.n_dof, n_touched + 1), complex)
        load[touched, np.arange(n_touched)] = 1.0
        load[:, -1] = shape[:, at] @ np.array([1.0, -1j])[: len(at)]
        motion = solved(parts, n * omega, load)
        # a cos + b sin is the real part of (a - i b) e^(i tau).
        free[:, at] = pair(motion[:, -1])[:, : len(at)]
        receptance = motion[:, :n_touched]
        whole[:, at[0], :, at[0]] = receptance.real
        if n:
            whole[:, at[1], :, at[1]] = receptance.real
            whole[:, at[1], :, at[0]] = -receptance.imag
            whole[:, at[0], :, at[1]] = receptance.imag
    whole = whole.reshape(model.n_dof * size, n_touched * size)
    own = (np.array(touched)[:, None] * size + np.arange(size)).ravel()
    place = [list(kept).index(dof) for dof in touched]
    x = np.asarray(start)[place].ravel()
    for _ in range(12):
        contact = alone.evaluate(x, 0.0)
        jacobian = contact.jacobian
        jacobian = jacobian.toarray() if sp.issparse(jacobian) else jacobian
        rest = x - free.ravel()[own] + whole[own] @ contact.residual
        step = np.linalg.solve(np.eye(len(x)) + whole[own] @ jacobian, -rest)
        x = x + step
        length = float(np.linalg.norm(step) / np.linalg.norm(x))
        if length < 1e-14:
            break
    forces = alone.evaluate(x, 0.0).residual
    everywhere = (free.ravel() - whole @ forces).reshape(model.n_dof, size)
    push = shape.copy()
    push[touched] -= forces.reshape(n_touched, size)
    return Response(everywhere, balance(model, basis, everywhere, push, omega), length)


def contacts_alone(model, touched, harmonics):
    """The contacts without a structure: at frequency 0 their forces are all there is."""
    size = len(touched)
    place = {dof: i for i, dof in enumerate(touched)}
    nothing = np.zeros((size, size))
    contacts = [tuple(place[dof] for dof in contact) for contact in model.contacts]
    return sh.HarmonicBalance(
        sh.Model(np.eye(size), nothing, nothing, contacts=contacts, **model.parameters),
        sh.forces.PointForce(0, amplitude=0.0),
        harmonics,
    )


def matrices(model):
    return model.stiffness_matrix, model.damping_matrix, model.mass_matrix


def solved(parts, s, load):
    """Motion (n_dof, n) under complex forces at ``s`` [rad/s], refined with long residuals."""
    stiffness, damping, mass = parts
    s = LONG(s)
    exact = (stiffness - s**2 * mass).astype(LONG_COMPLEX) + 1j * s * damping
    factors = splu(sp.csc_matrix(exact.astype(complex)))
    motion = np.zeros(load.shape, LONG_COMPLEX)
    for _ in range(4):
        motion += factors.solve((load - exact @ motion).astype(complex))
    return motion.astype(complex)


def balance(model, basis, motion, push, omega):
    """Largest residual of all equations over the largest sum of absolute force terms."""
    rest = 0
    level = np.abs(push)
    for matrix, power in zip(matrices(model), range(3), strict=True):
        turned = motion @ np.linalg.matrix_power(omega * basis.derivative_matrix.T, power)
        rest = rest + matrix.astype(LONG) @ turned.astype(LONG)
        level = level + abs(matrix) @ np.abs(turned)
    return float(np.abs(rest - push).max() / level.max())


def pair(complex_motion):
    return np.column_stack([complex_motion.real, -complex_motion.imag])
