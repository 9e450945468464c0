"""One curve of motions that no force drives as plain arrays, with what all of them have."""

from typing import Any, ClassVar

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.continuation.unforced import UnforcedProblem
from symhbm.numerics import RADIANS, FloatArray, Table
from symhbm.response.accuracy import Solution
from symhbm.response.curve_table import CurveTable
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
        table = self.of_events(events)
        at_events = self.own(self._unknowns([solution for solution, _ in events]))
        table |= {f"event_{name}": values for name, values in at_events.items()}
        table |= self.counts(
            n_points=len(self.solutions),
            n_events=len(events),
            rejected_steps=0 if branch is None else branch.rejected,
            linear_solves=0 if branch is None else branch.corrector.solves,
        )
        by_machine_code = np.array(-1 if branch is None else 0, dtype=np.int8)
        status = np.array(str(self.status(points)), dtype=object)
        return points | table | dict(by_machine_code=by_machine_code, status=status)

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
