"""One curve of motions that no force drives as plain arrays: nonlinear modes, and limit cycles."""

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from symhbm.balance import HarmonicBalance, check_mass, check_mean, matrices_in, unforced
from symhbm.continuation import Branch, Status
from symhbm.continuation.unforced import (
    Cycle,
    Cycles,
    LimitCycleProblem,
    LinearMode,
    ModeOverParameterProblem,
    NoModeError,
    NonlinearModeProblem,
    UnforcedProblem,
    cycles_of_mode,
    first_harmonic,
    follow_cycles,
    follow_mode,
    follow_mode_over,
    linear_mode,
    settled,
)
from symhbm.numerics import RADIANS, FloatArray, Table
from symhbm.response.accuracy import Solution
from symhbm.response.curve_table import CurveTable, smallest_in
from symhbm.response.describe import describe_each, unsolved
from symhbm.results import Request
from symhbm.time_domain import cycle_growth, verdict


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


_MORE = (0.25, 0.75, 0.125, 0.375, 0.625, 0.875)
"""Shares of a band at which cycles are searched where none were found at its ends and middle."""


class CycleCurve(UnforcedCurve):
    """Limit cycles, along a parameter or alone."""

    NAMES: ClassVar = {"amplitude": "largest_displacement"}  # not of a harmonic
    curve: LimitCycleProblem
    branch: Cycles | None

    def own(self, unknowns: FloatArray) -> Table:
        """As of any unforced motion, and the amplitude where it is not what moves."""
        if self.request.name == "amplitude":
            return super().own(unknowns)
        amplitudes = [self.curve.amplitude(row) for row in unknowns]
        return super().own(unknowns) | {"amplitude": np.array(amplitudes, dtype=float)}

    def table(self) -> Table:
        """As of any unforced motion, and where two cycles meet."""
        table = super().table()
        if self.request.name != "amplitude":
            fold = np.nan if self.branch is None else self.branch.fold
            table["fold_value"] = np.array(fold)
            if self.request.at is None:
                numbers = [] if self.branch is None else self.branch.numbers
                table["cycle_branch"] = np.array(numbers, dtype=np.int32)
        return table

    def rows(self, level: int, solutions: list[Solution]) -> Table:
        """As of any unforced motion, and its stability where that is wanted."""
        table = super().rows(level, solutions)
        if self.request.tells_stability:
            curve, unknowns = self.curve, self._unknowns(solutions)
            problems = [curve.problem_at(motion.value) for motion in solutions]
            found = [
                cycle_growth(problem, own[-1], own[:-1], curve.phase)
                for problem, own in zip(problems, unknowns, strict=True)
            ]
            rates = [each.rate for each in found]
            table["growth_rate"] = np.array(rates)
            table["stability_method"] = np.array([of.method for of in found], dtype=np.int8)
            verdicts = [*map(verdict, rates, unknowns[:, -1])]
            table["stability"] = np.array(verdicts, dtype=np.int8)
        return table


def unforced_curve(problem: HarmonicBalance, request: Request, blank: bool = False) -> Table:
    """The nonlinear mode or the limit cycles of one problem; raises as `mode_problem`.

    A ``blank`` curve has no points, but the names and shapes of the others.
    """
    return (mode_curve if request.amplitudes is None else _cycle_curve)(problem, request, blank)


def _cycle_curve(problem: HarmonicBalance, request: Request, blank: bool) -> Table:
    search = _Search(problem, request)
    curve = search.curve
    if blank:
        return CycleCurve(request, curve, None).table()
    if request.name == "amplitude":
        return CycleCurve(request, curve, search.alone()).table()
    low, high = sorted(request.band)
    nominal = [value for value in _nominal(problem, request) if low < value < high]
    seeds = [seed for value in [low, high, (low + high) / 2, *nominal] for seed in search.at(value)]
    for share in _MORE:
        seeds = seeds or search.at(low + share * (high - low))
    cycles = follow_cycles(curve, seeds, (low, high), request.max_points)
    cycles = replace(cycles, status=search.told(cycles.status))
    return CycleCurve(request, curve, cycles).table()


def _nominal(problem: HarmonicBalance, request: Request) -> list[float]:
    """The one value that the parameter has in the problem itself."""
    values = np.atleast_1d(problem.parameters[request.name]).ravel()
    values = values if request.index is None else values[[request.index]]
    return [float(values[0])] if values.size and np.all(values == values[0]) else []


class _Search:
    """Limit cycles of one problem, looked for along its nonlinear modes."""

    def __init__(self, problem: HarmonicBalance, request: Request):
        self.request, self.lost = request, 0
        self.problem, self.dof, self.numbers = free_problem(problem, request)
        assert self.dof is not None
        size, phase = first_harmonic(self.problem, self.dof)
        name = None if request.name == "amplitude" else request.name
        smallest = 0.0 if name is None else smallest_in(request)
        assert request.amplitudes is not None
        more = request.index, smallest, size, request.amplitudes
        self.curve = LimitCycleProblem(self.problem, name, phase, *more)

    def alone(self) -> Cycles:
        """The cycles at the parameters of the problem, by the logarithms of their amplitudes."""
        curve, modes = self.curve, self._followed(self.problem)
        cycles = [
            cycle._replace(value=float(np.log10(curve.amplitude(cycle.unknowns))))
            for cycle in self._on(modes, 0.0)
        ]
        statuses = [mode.status for mode in modes if mode.status != Status.REACHED_END]
        status = self.told(statuses[0] if statuses else Status.REACHED_END)
        return Cycles(modes[0].corrector, status, alone=tuple(cycles))

    def at(self, value: float) -> list[Cycle]:
        """The cycles at a value of the parameter, none where the problem has no such modes."""
        try:
            modes = self._followed(self.curve.problem_at(value))
        except (ArithmeticError, NoModeError):
            return []
        return self._on(modes, value)

    def _followed(self, problem: HarmonicBalance) -> list[Branch]:
        assert self.request.amplitudes is not None
        low, high = np.log10(self.request.amplitudes).tolist()
        branches = []
        for mode in modes_in(self.request):
            linear = linear_mode(problem, mode, self.dof, self.numbers)
            curve = NonlinearModeProblem(problem, linear.dof)
            branches.append(follow_mode(curve, linear, (low, high), self.request.max_points))
        return branches

    def _on(self, modes: list[Branch], value: float) -> list[Cycle]:
        starts = [cycle for mode in modes for cycle in cycles_of_mode(mode)]
        cycles, lost = settled(self.curve, starts, value)
        self.lost += lost
        return cycles

    def told(self, status: Status) -> Status:
        """How the search ends, from how all else does."""
        return Status.CYCLE_LOST if self.lost and status == Status.REACHED_END else status
