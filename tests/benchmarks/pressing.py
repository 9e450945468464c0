"""Friction under a load that varies, marched over samples of the period, for numba.

Two loops of one sampled law: `by_samples` adds up the force and its exact Jacobian sample by
sample, and remembers at which one the slider came to rest; `by_runs` adds up whole runs of samples
between two events from sums before each sample, which takes as few operations as sampling can.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from symhbm.numerics import FourierBasis
from tests.benchmarks.marching import add_block, tables_of

APART, UP, DOWN, CLOSED, LOW, HIGH = range(6)
"""Apart, pushed by either wall, and at rest since one of the three."""


class Samples(NamedTuple):
    """Basis functions at samples (n, K), what they (n + 1, K) and their products sum up to.

    ``norm`` (K,) is the weight of a sample in each coefficient.
    """

    functions: np.ndarray
    sums: np.ndarray
    products: np.ndarray
    norm: np.ndarray


def samples_of(basis: FourierBasis, samples: int) -> Samples:
    """Tables of the samples of a period."""
    return Samples(*tables_of(basis, samples), basis.norm * (2 * np.pi / samples))


class Pressed(NamedTuple):
    """Contacts of a structure.

    ``dofs`` (n_contacts, 2, 2) are the ends of the tangential and the normal displacement, the
    second -1 for the ground; ``values`` (n_contacts, 4): ``k_t``, ``k_n``, ``mu`` and ``N0``.
    """

    dofs: np.ndarray
    values: np.ndarray
    samples: Samples


@njit
def _march(values, u, v, kind, anchor):
    """Two periods of a contact; kind and anchor of each sample of the second."""
    stiffness, normal, friction, load = values
    place, at, state = stiffness * u[0], 0, CLOSED
    for period in range(2):
        for t in range(len(u)):
            press, pull = load + normal * v[t], stiffness * u[t]
            if press <= 0:
                place, state, at = pull, APART, t
            elif place < pull - friction * press:
                place, state, at = pull - friction * press, UP, t
            elif place > pull + friction * press:
                place, state, at = pull + friction * press, DOWN, t
            elif state < CLOSED:
                state += CLOSED
            if period == 1:
                kind[t], anchor[t] = state, at


@njit
def by_samples(samples, motions, values, force, slope):
    """Force coefficients (n, 2 K) of contacts and their derivatives (n, 2 K, 2 K)."""
    functions, norm = samples.functions, samples.norm
    n_samples, size = functions.shape
    kind, anchor = np.empty(n_samples, np.int64), np.empty(n_samples, np.int64)
    pull, press = np.empty(size), np.empty(size)
    for j in range(len(motions)):
        stiffness, normal, friction, load = values[j]
        u, v = functions @ motions[j, :size], functions @ motions[j, size:]
        _march(values[j], u, v, kind, anchor)
        force[j], slope[j] = 0.0, 0.0
        for t in range(n_samples):
            state, at = kind[t], anchor[t]
            if state == APART:
                continue
            side = friction if state in (UP, LOW) else -friction if state in (DOWN, HIGH) else 0.0
            rests = state >= CLOSED
            tangential = side * (load + normal * v[at])
            if rests:
                tangential += stiffness * (u[t] - u[at])
            carried = load + normal * v[t]
            for a in range(size):
                pull[a] = stiffness * (functions[t, a] - functions[at, a]) if rests else 0.0
                press[a] = side * normal * functions[at, a]
            for a in range(size):
                weight = functions[t, a]
                force[j, a] += weight * tangential
                force[j, size + a] += weight * carried
                for b in range(size):
                    slope[j, a, b] += weight * pull[b]
                    slope[j, a, size + b] += weight * press[b]
                    slope[j, size + a, size + b] += weight * normal * functions[t, b]
        for a in range(size):
            force[j, a] *= norm[a]
            force[j, size + a] *= norm[a]
            slope[j, a] *= norm[a]
            slope[j, size + a] *= norm[a]


@njit
def by_runs(samples, motions, values, force, slope):
    """The same from runs of samples of one kind."""
    functions, sums, products, norm = samples
    n_samples, size = functions.shape
    kind, anchor = np.empty(n_samples, np.int64), np.empty(n_samples, np.int64)
    for j in range(len(motions)):
        stiffness, normal, friction, load = values[j]
        u, v = functions @ motions[j, :size], functions @ motions[j, size:]
        _march(values[j], u, v, kind, anchor)
        force[j], slope[j] = 0.0, 0.0
        first = 0
        while first < n_samples:
            state, last = kind[first], first + 1
            rests = state >= CLOSED
            while last < n_samples and kind[last] == state:
                if rests and anchor[last] != anchor[first]:
                    break
                last += 1
            if state != APART:
                side = 0.0
                if state in (UP, LOW):
                    side = friction
                elif state in (DOWN, HIGH):
                    side = -friction
                at = functions[anchor[first]]
                for a in range(size):
                    total = sums[last, a] - sums[first, a]
                    force[j, a] += side * load * total
                    force[j, size + a] += load * total
                    for b in range(size):
                        product = products[last, a, b] - products[first, a, b]
                        slope[j, size + a, size + b] += normal * product
                        if rests:
                            slope[j, a, b] += stiffness * (product - total * at[b])
                            slope[j, a, size + b] += side * normal * total * at[b]
                        else:
                            slope[j, a, size + b] += side * normal * product
            first = last
        for a in range(size):
            force[j, a] *= norm[a]
            force[j, size + a] *= norm[a]
            slope[j, a] *= norm[a]
            slope[j, size + a] *= norm[a]
        force[j] += slope[j] @ motions[j]


@njit
def add_pressed(pressed, point, residual, matrix):
    """Add the forces and their derivatives by the unknowns, without what the equilibrium holds."""
    n, size = len(pressed.values), len(pressed.samples.norm)
    motions = np.zeros((n, 2 * size))
    for j in range(n):
        for k in range(2):
            first, second = pressed.dofs[j, k]
            motion = motions[j, k * size : (k + 1) * size]
            motion += point[first * size : (first + 1) * size]
            if second >= 0:
                motion -= point[second * size : (second + 1) * size]
    force, slope = np.empty((n, 2 * size)), np.empty((n, 2 * size, 2 * size))
    by_runs(pressed.samples, motions, pressed.values, force, slope)
    for j in range(n):
        force[j, size] -= pressed.values[j, 3]
        for k in range(2):
            of_row = slice(k * size, (k + 1) * size)
            for end in range(2):
                row, sign = pressed.dofs[j, k, end], 1.0 - 2.0 * end
                if row < 0:
                    continue
                residual[row * size : (row + 1) * size] += sign * force[j, of_row]
                for m in range(2):
                    block = slope[j, of_row, m * size : (m + 1) * size]
                    for other in range(2):
                        column = pressed.dofs[j, m, other]
                        if column >= 0:
                            add_block(row, column, sign * (1.0 - 2.0 * other), block, matrix)
