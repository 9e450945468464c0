"""Harmonic balance over samples (alternating frequency and time), compiled by numba.

The dry friction elements are marched over samples, the Jacobian is that of the marching. For models
with friction alone: under constant normal loads without harmonic 0, under varying ones with it.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

import symhbm as sh
from symhbm.model import force_coefficients
from tests.benchmarks.marching import Friction, add_friction, tables_of
from tests.benchmarks.pressing import Pressed, add_pressed, samples_of

PRESSED = "contact_stiffness", "normal_stiffness", "friction_coefficient", "normal_load"


class System(NamedTuple):
    """Equations of one problem as arrays: the linear part by its entries, and the contacts."""

    row: np.ndarray
    column: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    order: np.ndarray
    force: np.ndarray
    friction: Friction
    pressed: Pressed


def system_of(problem: sh.HarmonicBalance, samples: int) -> System:
    """The equations of a problem, its friction marched over so many samples of a period."""
    model, basis = problem.model, problem.basis
    (dofs, given), pressed = (
        _contacts(model, law, names)
        for law, names in (
            (sh.laws.Coulomb, ("contact_stiffness", "friction_coefficient", "normal_load")),
            (sh.laws.VariableLoadFriction, PRESSED),
        )
    )
    if len(given) + len(pressed[1]) != model.n_contacts or (len(given) and basis.order[0] == 0):
        raise ValueError("expected friction alone, without harmonic 0 under constant loads")
    mass, damping, stiffness = (
        np.asarray(matrix.todense())
        for matrix in (model.mass_matrix, model.damping_matrix, model.stiffness_matrix)
    )
    row, column = np.nonzero(abs(mass) + abs(damping) + abs(stiffness))
    force = force_coefficients(problem.excitation, model.n_dof, basis)
    tables = tables_of(basis, samples)
    friction = Friction(dofs[:, 0], given[:, 0].copy(), given[:, 1] * given[:, 2], *tables)
    return System(
        row,
        column,
        mass[row, column],
        damping[row, column],
        stiffness[row, column],
        basis.order.astype(float),
        force.ravel(),
        friction,
        Pressed(*pressed, samples_of(basis, samples)),
    )


def _contacts(model: Any, law: type, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Ends (n, m, 2) of the displacements of a law's contacts, and their values (n, p)."""
    groups = [group for group in model.groups if type(group.law) is law]
    ends = [
        [(*model.groups.row_ends[row], -1)[:2] for row in rows]
        for group in groups
        for rows in group.rows
    ]
    values = [np.transpose([group.values[name] for name in names]) for group in groups]
    n_rows = len(law.directions)  # type: ignore[attr-defined]
    dofs = np.array(ends, dtype=int).reshape(-1, n_rows, 2)
    return dofs, np.concatenate([np.empty((0, len(names))), *values])


@njit
def evaluate(system, point, matrix):
    """Residual; its Jacobian by the unknowns and the frequency goes to the rows of ``matrix``."""
    size, omega = len(system.order), point[-1]
    matrix[:-1] = 0.0
    residual = -system.force
    for entry in range(len(system.row)):
        i, j = system.row[entry] * size, system.column[entry] * size
        mass, damping = system.mass[entry], system.damping[entry]
        first = 0
        if system.order[0] == 0:
            first = 1
            matrix[i, j] += system.stiffness[entry]
            residual[i] += system.stiffness[entry] * point[j]
        for c in range(first, size, 2):
            n = system.order[c]
            direct = system.stiffness[entry] - (n * omega) ** 2 * mass
            across = n * omega * damping
            a, b = point[j + c], point[j + c + 1]
            matrix[i + c, j + c] += direct
            matrix[i + c, j + c + 1] += across
            matrix[i + c + 1, j + c] -= across
            matrix[i + c + 1, j + c + 1] += direct
            residual[i + c] += direct * a + across * b
            residual[i + c + 1] += direct * b - across * a
            slope = -2 * n * n * omega * mass
            matrix[i + c, -1] += slope * a + n * damping * b
            matrix[i + c + 1, -1] += slope * b - n * damping * a
    add_friction(system.friction, point, residual, matrix)
    add_pressed(system.pressed, point, residual, matrix)
    return residual


@njit
def amplitudes(system, point):
    """Amplitude of each degree of freedom: the highest sample and a parabola through it."""
    size = len(system.order)
    n_dof = (len(point) - 1) // size
    found = np.empty(n_dof)
    for dof in range(n_dof):
        x = point[dof * size : (dof + 1) * size]
        if size == 2:
            found[dof] = np.hypot(x[0], x[1])
            continue
        motion = np.abs(np.dot(system.friction.at_sample, x))
        top = np.argmax(motion)
        before, after = motion[top - 1], motion[(top + 1) % len(motion)]
        curvature = before - 2 * motion[top] + after
        found[dof] = motion[top] - (after - before) ** 2 / (8 * curvature)
    return found


def evaluation(problem: sh.HarmonicBalance, samples: int, unknowns: np.ndarray, omega: float):
    """A call that evaluates residual and Jacobian at the unknowns [m] and a frequency [rad/s]."""
    system, point = system_of(problem, samples), np.append(unknowns, omega)
    matrix = np.zeros((len(point),) * 2)
    return lambda: evaluate(system, point, matrix)
