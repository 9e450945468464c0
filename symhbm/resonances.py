"""Resonances between two points of a path: those too narrow to show in the response at either.

Where the response is smooth, steps are long, and a lightly damped mode may lie unseen inside one.
The modes of the structure with its contacts at their present stiffness tell where to look.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from symhbm.corrector import Corrected
from symhbm.curve import Curve
from symhbm.events import PathPoint
from symhbm.fourier import FloatArray
from symhbm.friction import LocatedFriction
from symhbm.residual import HarmonicBalance

LARGEST_SIZE = 300
"""Number of degrees of freedom above which modes cost more than the path."""
SEEN = 2.0
"""Distance from a resonance ahead, in half widths, at which the path feels it."""
AT = 0.3
"""Distance from a resonance behind, in half widths, at which a point stands for it."""
_SMALL = 1e-3
"""Share of a harmonic in a motion below which its own contact forces mean little."""
_FAINT = 1e-9
"""Resonant response, relative to the response, of a mode that nothing excites."""


class Modes(NamedTuple):
    """Modes by harmonic at one point, arrays (n_harmonics, n_dof).

    ``detuning``, the natural less the exciting frequency [rad/s]; ``width``, half that of the
    resonance [rad/s]; ``excited``, whether a force or the slip of a contact makes the mode respond.
    """

    detuning: FloatArray
    width: FloatArray
    excited: NDArray[np.bool_]


def modes(
    curve: Curve, unknowns: FloatArray, value: float, friction: LocatedFriction
) -> Modes | None:
    """Modes of the structure at a point of a curve, None for one too large or without inertia."""
    problem, frequency = curve.at(value)
    if problem.model.n_dof > LARGEST_SIZE:
        return None
    try:
        stiffness, damping, springs, force = _reduced(problem)
    except np.linalg.LinAlgError:
        return None  # a motion without inertia: no coordinates of unit mass
    size = np.linalg.norm(unknowns)
    found = []
    nonlinear = bool(friction.slip.any()) or problem.model.has_cubic_springs
    for n in (n for n in problem.harmonics if n > 0):
        column = [problem.basis.component(n, sine) for sine in (False, True)]
        spring, loss = _contacts(problem, unknowns, friction, column)
        squares, shapes = np.linalg.eigh(stiffness + (springs * spring) @ springs.T)
        natural = np.sqrt(np.maximum(squares, 1e-300))
        viscous = damping + (springs * loss / (n * frequency)) @ springs.T
        width = np.einsum("ik,ij,jk->k", shapes, viscous, shapes) / 2
        drive = np.abs(shapes.T @ force[:, column]).max(axis=1)
        loud = drive > _FAINT * size * natural * np.maximum(width, 1e-12 * natural)
        forced = force[:, column].any()
        excited = loud if forced else np.full(len(natural), nonlinear)
        found.append((natural - n * frequency, width, excited))
    return Modes(*(np.array(parts) for parts in zip(*found, strict=True)))


class Lookout:
    """Looks for resonances between the last point of a path and the next."""

    def __init__(self, curve: Curve):
        self._curve = curve
        self._known: list[tuple[FloatArray, Modes | None]] = []

    def first_passed(self, base: PathPoint, found: Corrected) -> float | None:
        """Share of the way from a point to the next of the first resonance that neither shows."""
        before = self._at(base.state, None, base.slip)
        after = self._at(found.point, found.evaluation.friction, base.slip)
        if before is None or after is None:
            return None
        left, right = before.detuning, after.detuning
        width = np.minimum(before.width, after.width)
        passed = (left * right < 0) & (np.abs(left) > SEEN * width) & (np.abs(right) > AT * width)
        passed &= before.excited | after.excited
        if not passed.any():
            return None
        distance, width = np.abs(left[passed]), width[passed]
        # The flank first, then the top: a mode may add on one side what it takes on the other.
        aim = np.where(distance > 2 * SEEN * width, distance - 1.5 * SEEN * width, distance)
        return float((aim / np.abs(left - right)[passed]).min())

    def _at(
        self, state: FloatArray, friction: LocatedFriction | None, slip: NDArray[np.bool_]
    ) -> Modes | None:
        for known, found in self._known:
            if np.array_equal(known, state):
                return found
        value = float(state[-1])
        if friction is None:
            friction = self._curve.at(value)[0].locate(state[:-1], slip)
        found = modes(self._curve, state[:-1], value, friction)
        # The end of a step is the start of the next one, or the step is tried again, shorter.
        self._known = [(state, found), *self._known[:2]]
        return found


@lru_cache(maxsize=4)
def _reduced(problem: HarmonicBalance) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Stiffness, damping, contact directions and force in coordinates of unit mass."""
    model = problem.model
    factor = cholesky(model.mass_matrix.toarray(), lower=True)

    def scaled(matrix: FloatArray) -> FloatArray:
        return solve_triangular(factor, matrix, lower=True)

    matrices = (model.stiffness_matrix.toarray(), model.damping_matrix.toarray())
    stiffness, damping = (scaled(scaled(0.5 * (m + m.T)).T) for m in matrices)
    shape = problem.excitation.shape(model.n_dof, problem.basis)
    springs = scaled(model.directions.toarray().T)
    return stiffness, damping, springs, scaled(problem.excitation.amplitude * shape)


def _contacts(
    problem: HarmonicBalance, unknowns: FloatArray, friction: LocatedFriction, column: list[int]
) -> tuple[FloatArray, FloatArray]:
    """Stiffness of the contacts in one harmonic and what they take out of it [N/m], (n_contacts,).

    In the mean over its motion where there is one, else for a small one.
    """
    model = problem.model
    relative = problem.relative(unknowns)
    y = relative[:, column]
    force = model.contact_stiffness[:, None] * np.einsum("cij,cj->ci", friction.matrix, relative)
    force += (model.friction_coefficient * model.normal_load)[:, None] * friction.vector
    in_phase = np.sum(force[:, column] * y, axis=1)
    out_of_phase = force[:, column[0]] * y[:, 1] - force[:, column[1]] * y[:, 0]
    square, total = np.sum(y**2, axis=1), np.sum(relative**2, axis=1)
    moves = square > _SMALL**2 * total
    safe = np.where(moves, square, 1.0)
    small = np.mean(np.einsum("cii->ci", friction.matrix)[:, column], axis=1)
    share = np.where(moves, in_phase / safe, small * model.contact_stiffness)
    # The mean stiffness of a cube to its own motion is half that to a motion beside it.
    cubic = model.cubic_stiffness * (0.75 * square + 1.5 * (total - square))
    spring = np.clip(share, 0.0, model.contact_stiffness) + cubic
    return spring, np.where(moves, np.maximum(out_of_phase / safe, 0.0), 0.0)
