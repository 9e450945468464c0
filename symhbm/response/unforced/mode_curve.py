"""One nonlinear mode over its amplitude: the computation for one parameter set."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from symhbm.balance import HarmonicBalance, check_mass, check_mean, unforced
from symhbm.continuation.unforced import (
    LinearMode,
    NonlinearModeProblem,
    follow_mode,
    linear_mode,
)
from symhbm.numerics import FloatArray, Table
from symhbm.response.unforced.curve import UnforcedCurve
from symhbm.results import Request


class ModeCurve(UnforcedCurve):
    """A nonlinear mode over its amplitude."""

    NAMES: ClassVar = {"amplitude": "largest_displacement"}  # the amplitude is what moves
    curve: NonlinearModeProblem

    def own(self, unknowns: FloatArray) -> Table:
        """As of any unforced motion, the damping ratio and the modal amplitude of all sectors."""
        symmetry = self.problem.symmetry
        several = 1.0 if symmetry is None else np.sqrt(symmetry.n_sectors)
        amplitudes = [several * self.curve.modal_amplitude(row) for row in unknowns]
        return super().own(unknowns) | dict(
            damping_ratio=unknowns[:, self.curve.damping_place],
            modal_amplitude=np.array(amplitudes, dtype=float),
        )


def mode_curve(problem: HarmonicBalance, request: Request) -> Table:
    """The nonlinear mode of one problem; raises as `mode_problem`."""
    curve, linear = mode_problem(problem, request)
    low, high = request.followed(request.band).tolist()
    branch = follow_mode(curve, linear, (low, high), request.max_points)
    return ModeCurve(request, curve, branch).table()


def blank_mode_curve(problem: HarmonicBalance, request: Request) -> Table:
    """A curve without points that has the names and shapes of a request's."""
    curve = NonlinearModeProblem(unforced(problem, request.nodal_diameter), 0)
    return ModeCurve(request, curve, None).table()


def mode_problem(
    problem: HarmonicBalance, request: Request
) -> tuple[NonlinearModeProblem, LinearMode]:
    """The equations of a nonlinear mode, and the linear one that it starts from.

    Without a degree of freedom that tells the amplitude it is the one that moves most. Raises
    TypeError or ValueError for a structure without a mass matrix, such a wave or such a mode.
    """
    alone, dof, numbers = free_problem(problem, request)
    assert isinstance(request.mode, int)
    linear = linear_mode(alone, request.mode, dof, numbers)
    return NonlinearModeProblem(alone, linear.dof), linear


def free_problem(
    problem: HarmonicBalance, request: Request
) -> tuple[HarmonicBalance, int | None, list[int]]:
    """The problem without a force, and the unknown degree of freedom that tells amplitudes, if any.

    And the numbers that the user gives all unknown ones. Raises as `mode_problem`, but for modes.
    """
    check_mass(problem)
    alone = unforced(problem, request.nodal_diameter)
    numbers, own = _numbers(alone), request.dof
    if own is not None and alone.symmetry is not None:
        own %= alone.n_dof  # all sectors move alike
    if own is not None and own not in numbers:
        raise ValueError(
            f"dof={own}: expected a degree of freedom that is kept; those at the right interface "
            "of a sector are not, their twins at the left one move as much"
        )
    return alone, None if own is None else numbers.index(own), numbers


def _numbers(problem: HarmonicBalance) -> list[int]:
    """Numbers that the user gives the unknown degrees of freedom."""
    kept = problem.model.kept
    return [*range(problem.n_dof)] if kept is None else kept.tolist()


def with_dof(problem: HarmonicBalance, request: Request) -> Request:
    """The request with the degree of freedom that moves most, where it tells none.

    Raises as `mode_problem`.
    """
    curve, linear = mode_problem(problem, request)
    check_mean(curve.problem)
    if request.dof is not None:
        return request
    return replace(request, dof=_numbers(curve.problem)[linear.dof])
