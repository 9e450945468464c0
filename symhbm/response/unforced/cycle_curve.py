"""Limit cycles over a parameter, or at the problem's own: the computation for one parameter set."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Branch, Status
from symhbm.continuation.unforced import (
    Cycle,
    Cycles,
    LimitCycleProblem,
    NoModeError,
    NonlinearModeProblem,
    cycles_of_mode,
    first_harmonic,
    follow_cycles,
    follow_mode,
    linear_mode,
    settled,
)
from symhbm.numerics import FloatArray, Table
from symhbm.response.accuracy import Solution
from symhbm.response.curve_table import smallest_in
from symhbm.response.unforced.curve import (
    UnforcedCurve,
    free_problem,
    mode_curve,
    modes_in,
)
from symhbm.results import Request
from symhbm.time_domain import cycle_growth, verdict

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
