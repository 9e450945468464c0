"""One curve of motions that no force drives as plain arrays: what all have, and nonlinear modes."""

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from symhbm.balance import HarmonicBalance, check_mass, check_mean, matrices_in, unforced
from symhbm.continuation import Status
from symhbm.continuation.unforced import (
    LinearMode,
    ModeOverParameterProblem,
    NonlinearModeProblem,
    UnforcedProblem,
    follow_mode,
    follow_mode_over,
    linear_mode,
)
from symhbm.numerics import RADIANS, FloatArray, Table
from symhbm.response.accuracy import Solution
from symhbm.response.curve_table import CurveTable, smallest_in
from symhbm.response.describe import describe_each, unsolved
from symhbm.results import Request


class UnforcedCurve(CurveTable):
    """The motions along a ``branch``, or `Cycles`, None for a curve without points.

    What a kind of motion tells of itself beside its frequency it adds to `own`; ``NAMES`` are those
    of `describe_each` that it calls otherwise.
    """

    NAMES: ClassVar[dict[str, str]] = {}

    def __init__(self, request: Request, curve: UnforcedProblem, branch: Any):
        self.request, self.curve, self.branch, self.highest_level = request, curve, branch, 0
        points, at = () if branch is None else branch.points, request.at
        self.solutions = [
            Solution(p.value, 0, p.unknowns, np.nan, p.solves, events=p.events) for p in points
        ]
        values = [] if at is None else request.followed(at).tolist()
        self.solutions_at = [_solutions_at(branch, value) for value in values]

    def own(self, unknowns: FloatArray) -> Table:
        """Results (n,) of motions with all their unknowns (n, n_unknowns), by their names."""
        return {"frequency": unknowns[:, self.problem_of().n_unknowns] / RADIANS}

    def problem_of(self, level: int = 0) -> HarmonicBalance:
        """The problem that the motions solve, at its nominal values."""
        return self.curve.problem

    @property
    def ended(self) -> Status:
        """How the branch ends."""
        return Status.NOT_STARTED if self.branch is None else self.branch.status

    def table(self) -> Table:
        """All results as arrays."""
        branch, points, events = self.branch, self.points(), self.events(self.solutions)
        at_events = self.own(self._unknowns([solution for solution, _ in events]))
        counts = dict(n_points=len(self.solutions), rejected_steps=0, linear_solves=0)
        if branch is not None:
            counts |= dict(rejected_steps=branch.rejected, linear_solves=branch.corrector.solves)
        points |= {f"event_{name}": values for name, values in at_events.items()}
        evaluated = -1 if branch is None else 0
        return self.whole(points, events, str(self.status(points)), evaluated, **counts)

    def blank(self, size: int) -> Table:
        """Results of as many motions that were not found."""
        table = self._renamed(unsolved(self.problem_of(), size, self.request.tells_stability))
        return table | {name: np.full(size, np.nan) for name in self.own(self._unknowns([]))}

    def rows(self, level: int, solutions: list[Solution]) -> Table:
        """Results of motions that were found."""
        curve, unknowns = self.curve, self._unknowns(solutions)
        pairs = [*zip(unknowns, (solution.value for solution in solutions), strict=True)]
        table = describe_each(
            [curve.problem_at(value) for _, value in pairs],
            np.ascontiguousarray(unknowns[:, : self.problem_of().n_unknowns]),
            np.array([curve.frequency(row) for row in unknowns]) / RADIANS,
            [solution.solves for solution in solutions],
            norms=np.array([curve.evaluate(*pair).norm for pair in pairs]),
        )
        return self._renamed(table) | self.own(unknowns)

    def _renamed(self, table: Table) -> Table:
        return {self.NAMES.get(name, name): values for name, values in table.items()}

    def _unknowns(self, solutions: list[Solution]) -> FloatArray:
        """All unknowns (n, n_unknowns) of motions that were found."""
        rows = [solution.unknowns for solution in solutions]
        return np.array(rows, dtype=float).reshape(len(rows), self.curve.n_unknowns)


def _solutions_at(branch: Any, value: float) -> list[Solution]:
    """The motions at a value of a grid, one that was not found where there is no branch."""
    states: list[Any] = [(None, 0)] if branch is None else branch.at(value)
    return [Solution.at(value, 0, *state) for state in states]


class ModeCurve(UnforcedCurve):
    """A nonlinear mode over its amplitude, or one of a constant amplitude over a parameter."""

    NAMES: ClassVar = {"amplitude": "largest_displacement"}  # the amplitude is what moves
    curve: NonlinearModeProblem

    def own(self, unknowns: FloatArray) -> Table:
        """As of any unforced motion, the damping ratio and the modal amplitude of all sectors."""
        symmetry = self.problem_of().symmetry
        several = 1.0 if symmetry is None else np.sqrt(symmetry.n_sectors)
        amplitudes = [several * self.curve.modal_amplitude(row) for row in unknowns]
        return super().own(unknowns) | dict(
            damping_ratio=unknowns[:, self.curve.damping_place],
            modal_amplitude=np.array(amplitudes, dtype=float),
        )


def mode_curve(problem: HarmonicBalance, request: Request, blank: bool = False) -> Table:
    """The nonlinear mode of one problem, or a ``blank`` one; raises as `mode_problem`."""
    if blank:
        curve = _mode_over(unforced(problem, request.nodal_diameter), 0, request)
        return ModeCurve(request, curve, None).table()
    curve, linear = mode_problem(problem, request)
    low, high = request.followed(request.band).tolist()

    def linear_at(problem: HarmonicBalance) -> LinearMode:
        assert isinstance(request.mode, int)
        return linear_mode(problem, request.mode, linear.dof)

    if isinstance(curve, ModeOverParameterProblem):
        branch = follow_mode_over(curve, linear_at, (low, high), request.max_points)
    else:
        branch = follow_mode(curve, linear, (low, high), request.max_points)
    return ModeCurve(request, curve, branch).table()


def mode_problem(
    problem: HarmonicBalance, request: Request
) -> tuple[NonlinearModeProblem, LinearMode]:
    """The equations of a nonlinear mode, and the linear one that it starts from.

    Over a parameter that is the one at the first value. Without a degree of freedom that tells the
    amplitude it is the one that moves most. Raises TypeError or ValueError for a structure without
    a mass matrix, such a wave or such a mode, and for a parameter that changes the mass matrix.
    """
    alone, dof, numbers = free_problem(problem, request)
    assert isinstance(request.mode, int)
    if request.amplitude is None:
        linear = linear_mode(alone, request.mode, dof, numbers)
        return _mode_over(alone, linear.dof, request), linear
    moving, ends = _mode_over(alone, 0, request), request.band
    masses = [matrices_in(moving.problem_at(end), 1).mass_matrix for end in ends]
    if abs(masses[0] - masses[1]).max() > 0:
        raise ValueError(
            f"parameter={request.name!r}: expected one that does not change the mass matrix, which "
            "the damping of nonlinear modes is measured by; use over= for masses"
        )
    linear = linear_mode(moving.problem_at(ends[0]), request.mode, dof, numbers)
    return _mode_over(alone, linear.dof, request), linear


def _mode_over(problem: HarmonicBalance, dof: int, request: Request) -> NonlinearModeProblem:
    """The equations of a mode along what moves in a request."""
    if request.amplitude is None:
        return NonlinearModeProblem(problem, dof)
    level, index = request.amplitude, request.index
    smallest = smallest_in(request)
    return ModeOverParameterProblem(problem, dof, request.name, level, index, smallest)


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
            f"place={own}: expected a degree of freedom that is kept; those at the right interface "
            "of a sector are not, their twins at the left one move as much"
        )
    return alone, None if own is None else numbers.index(own), numbers


def _numbers(problem: HarmonicBalance) -> list[int]:
    """Numbers that the user gives the unknown degrees of freedom."""
    kept = problem.model.kept
    return [*range(problem.n_dof)] if kept is None else kept.tolist()


def modes_in(request: Request) -> list[int]:
    """The numbers of the modes of a request."""
    return np.atleast_1d(np.array(request.mode)).tolist()


def with_dof(problem: HarmonicBalance, request: Request) -> Request:
    """The request with the degree of freedom that moves most in its first mode, or its own.

    Raises as `mode_problem`, of all modes.
    """
    first, *others = modes_in(request)
    curve, linear = mode_problem(problem, replace(request, mode=first))
    check_mean(curve.problem)
    if request.dof is None:
        request = replace(request, dof=_numbers(curve.problem)[linear.dof])
    for mode in others:
        mode_problem(problem, replace(request, mode=mode))
    return request
