"""Floquet multipliers of a response: the map of small perturbations over its period."""

import math
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.numerics import FloatArray
from symhbm.time_domain.event_march import March, march
from symhbm.time_domain.linear_motion import LinearMotion
from symhbm.time_domain.periodic_orbit import size_of, state_of
from symhbm.time_domain.perturbations.curved import along_curved
from symhbm.time_domain.perturbations.sliders import along_sliders
from symhbm.time_domain.planar_march import planar_march
from symhbm.time_domain.planar_motion import PlanarMotion

_SHORT = 1e-7
"""Share of a cell over which friction forces are nearly linear."""


def multipliers(
    problem: HarmonicBalance, frequency: float, unknowns: FloatArray
) -> NDArray[np.complex128]:
    """Floquet multipliers of the period, (2 n_dof + n_slipping,), largest magnitude first.

    ``unknowns`` (n_unknowns,) is a solution [m], ``frequency`` in rad/s. The state is displacement,
    velocity and the friction forces of the contacts that slip; one that never slips is a spring,
    whose neutral multiplier is left out. Friction is located, whatever law the problem has. Where
    contacts open or their normal load moves they are those of the exact period that follows the
    state at ``tau = 0``, else those along the motion of the solution.

    Raises errors as `multipliers_of_part`.
    """
    values, parts = multipliers_of_part(problem, frequency, unknowns)
    return values**parts


def multipliers_of_part(
    problem: HarmonicBalance, frequency: float, unknowns: FloatArray
) -> tuple[NDArray[np.complex128], int]:
    """Those of the part of the period after which perturbations meet the same, and how many it has.

    Where the motion is then the opposite one, so are perturbations whose multiplier is 1.

    Raises `numpy.linalg.LinAlgError` for a mass matrix that is not positive definite,
    ArithmeticError for a structure too stiff and too large to follow its oscillations, and for
    smooth laws beside normal loads that move.
    """
    if problem.planar_groups and problem.loads_move:
        planar = PlanarMotion(problem, frequency, size_of(problem, unknowns))
        state = planar.of_active(state_of(problem.located(), unknowns, frequency))
        return planar_march(planar, state, 2 * np.pi).multipliers(planar).astype(complex), 1
    found = period_map(problem, frequency, unknowns)
    values = np.linalg.eigvals(found.matrix)
    values = values[np.argsort(-np.abs(values), kind="stable")].astype(complex)
    return (-values if found.turns else values), found.repeats


class PeriodMap(NamedTuple):
    """What becomes of a small perturbation after a share ``1 / repeats`` of the period.

    ``matrix`` (n, n) maps states, whose derivative by the angle at the start is ``drift`` (n,).
    ``turns`` tells that the motion is then the opposite one.
    """

    matrix: FloatArray
    drift: FloatArray
    repeats: int
    turns: bool

    def across(self) -> NDArray[np.complex128]:
        """Eigenvalues but that of a shift in time, by which the motion becomes itself.

        They are those of the map between states that differ by no shift: one of a motion without a
        force is 1, and where another one is as well, none of both has an eigenvector of its own.
        """
        direction = self.drift / np.linalg.norm(self.drift)
        others = scipy.linalg.null_space(direction[None])
        values = np.linalg.eigvals(others.T @ self.matrix @ others)
        return (-values if self.turns else values).astype(complex)


def period_map(problem: HarmonicBalance, frequency: float, unknowns: FloatArray) -> PeriodMap:
    """The map of small perturbations of a solution, as of `multipliers`; no planar friction."""
    laws = problem.curved_groups
    if problem.loads_move:
        if laws:
            raise ArithmeticError("smooth laws beside loads that move are not known in time")
        return _of_march(problem, frequency, unknowns)
    odd = all(group.law.odd for group in laws)
    parts = repeats(problem.harmonics, odd)
    along = along_curved if laws else along_sliders
    matrix, drift = along(problem, frequency, unknowns, 2 * np.pi / parts)
    return PeriodMap(matrix, drift, parts, odd and parts > math.gcd(*problem.harmonics))


def _of_march(problem: HarmonicBalance, frequency: float, unknowns: FloatArray) -> PeriodMap:
    """The map along the exact motion over a period from the state of a solution.

    How long a stiff contact stays closed decides what becomes of perturbations, and few harmonics
    miss that by far more than the displacement; a march from their state does not.
    """
    linear = LinearMotion(problem, frequency)
    state = linear.of_active(state_of(problem.located(), unknowns, frequency))
    run = march(linear, state, 2 * np.pi)
    kept, matrix = run.perturbed(linear)
    return PeriodMap(matrix, _drift(linear, run)[kept], 1, False)


def _drift(linear: LinearMotion, run: March) -> FloatArray:
    """Derivative of the state (2 n_dof + n_active,) by the angle, at the start of a march."""
    cells, first = run.cells, np.zeros(2, dtype=int)
    width, powers = cells.width[0], cells.displacement[0]
    friction = cells.inside(linear, first, np.array([0.0, _SHORT]))[2]
    rates = (friction[1] - friction[0]) / (_SHORT * width)
    return np.concatenate([powers[1] / width, 2 * powers[2] / width**2, rates])


def repeats(harmonics: tuple[int, ...], odd: bool) -> int:
    """Number of periods of the perturbation equations in one: of ``odd`` laws they see no sign."""
    common = math.gcd(*harmonics)
    return common * (2 if odd and all(n // common % 2 for n in harmonics) else 1)
