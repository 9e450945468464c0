"""The periodic motion in time: event-driven for springs and sliders, by shooting with others."""

from functools import partial
from typing import Any

from symhbm.balance import HarmonicBalance
from symhbm.continuation import newton, solve_point
from symhbm.numerics import FloatArray, by_harmonic, larger_set, unknowns_of
from symhbm.time_domain.exact_motion import ExactMotion, exact_motion
from symhbm.time_domain.linear_motion import curved, in_plane
from symhbm.time_domain.periodic_orbit import state_of
from symhbm.time_domain.planar_march import planar_march, planar_shot
from symhbm.time_domain.planar_motion import PlanarMotion
from symhbm.time_domain.shooting import shoot

Balanced = tuple[HarmonicBalance, FloatArray]
"""A problem and its unknowns (n_unknowns,) [m]."""


def exact_motion_of(
    problem: HarmonicBalance, frequency: float, near: Balanced | None = None
) -> ExactMotion:
    """Find the periodic motion at an angular ``frequency`` [rad/s], exact for springs and sliders.

    There may be several, but with friction of a constant load alone: it is the one close to the
    response ``near``, by default to one that is solved for. Raises as `exact_motion` and `shoot`.
    """
    if not (curved(problem) or in_plane(problem)):
        return exact_motion(
            problem, frequency, None if near is None else state_of(*near, frequency)
        )
    if near is None:
        balance = problem.located()
        if not all(group.law.odd for group in curved(problem) + in_plane(problem)):
            balance = balance.with_harmonics((*range(max(*problem.harmonics, 2) + 1),))
        near = balance, solve_point(balance, frequency).unknowns
    how: Any = (PlanarMotion, planar_shot, planar_march) if in_plane(problem) else ()
    motion = shoot(*near, frequency, *how)
    if motion.converged:
        return motion
    return shoot(*_with_more_harmonics(*near, frequency), frequency, *how)


def _with_more_harmonics(
    balance: HarmonicBalance, unknowns: FloatArray, frequency: float
) -> Balanced:
    """The solution of the balance with more harmonics."""
    larger = HarmonicBalance(balance.model, balance.excitation, larger_set(balance.harmonics))
    coefficient = by_harmonic(balance.basis, balance.layout.coefficients(unknowns))
    start = unknowns_of(larger.basis, balance.harmonics, coefficient)
    return larger, newton(partial(larger.evaluate, frequency=frequency), start).unknowns
