"""One nonlinear mode over its amplitude: the computation for one parameter set."""

from typing import ClassVar

import numpy as np

from symhbm.balance import HarmonicBalance, check_mass, unforced
from symhbm.continuation.unforced import (
    LinearMode,
    NonlinearModeProblem,
    follow_mode,
    linear_mode,
)
from symhbm.model.cyclic import Sector
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

    Raises TypeError or ValueError for a structure without a mass matrix, without such a wave or
    such a mode.
    """
    alone, dof, numbers = free_problem(problem, request)
    assert isinstance(request.mode, int)
    return NonlinearModeProblem(alone, dof), linear_mode(alone, request.mode, dof, numbers)


def free_problem(problem: HarmonicBalance, request: Request) -> tuple[HarmonicBalance, int, list]:
    """The problem without a force, and the unknown degree of freedom that tells amplitudes.

    And the numbers that the user gives all unknown ones. Raises as `mode_problem`, but for modes.
    """
    check_mass(problem)
    alone = unforced(problem, request.nodal_diameter)
    assert request.dof is not None
    numbers = [*range(alone.n_dof)]
    if isinstance(problem.model, Sector):
        numbers = problem.model.interfaces.others.tolist()
    # Of a ring of sectors, all move alike.
    own = request.dof if isinstance(problem.model, Sector) else request.dof % alone.n_dof
    if own not in numbers:
        raise ValueError(
            f"dof={own}: expected a degree of freedom that is not at the right interface of the "
            "sector; its twin at the left one moves as much"
        )
    return alone, numbers.index(own), numbers
