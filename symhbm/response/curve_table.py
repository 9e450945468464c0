"""One curve as plain arrays: what responses and motions without a force have in common."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from itertools import chain

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Event, Status
from symhbm.numerics import FloatArray, Table
from symhbm.response.accuracy import Solution
from symhbm.results import Request, tables

AtEvents = list[tuple[Solution, Event]]
"""Events, each with the solution at it."""
_SMALLEST = 1e-3
"""Share of the largest value of a band below which steps along it are no longer relative."""
_WHOLE = (Status.REACHED_END, Status.CLOSED)


def smallest_in(request: Request) -> float:
    """The value of what moves below which steps along the band are no longer relative."""
    return _SMALLEST * max(map(abs, request.band))


class CurveTable(ABC):
    """The ``solutions`` along the path of a request, and those at each value of its grid.

    ``highest_level`` is that of the harmonics of all solutions.
    """

    request: Request
    solutions: list[Solution]
    solutions_at: list[list[Solution]]
    highest_level: int

    @abstractmethod
    def problem_of(self, level: int) -> HarmonicBalance:
        """The problem that solutions of a level solve, at its nominal values."""

    @abstractmethod
    def rows(self, level: int, solutions: list[Solution]) -> Table:
        """Results of solutions that were found, with the harmonics of one level."""

    @abstractmethod
    def blank(self, size: int) -> Table:
        """Results of as many solutions that were not found, with the highest level of harmonics."""

    @property
    @abstractmethod
    def ended(self) -> Status:
        """How the path ended."""

    def points(self) -> Table:
        """Results of the points of the path, or of the solutions on a grid."""
        if self.request.at is not None:
            return self._grid(self.request.at)
        return self._along(self.solutions)

    def status(self, points: Table) -> Status:
        """How the curve ends, of its path and of its ``points``."""
        solved = points["converged"]
        if "n_solutions" in points:
            solved = solved | (np.arange(solved.shape[1]) >= points["n_solutions"][:, None])
        missing = self.ended in _WHOLE and not solved.all()
        return Status.POINTS_MISSING if missing else self.ended

    def events(self, solutions: Sequence[Solution]) -> AtEvents:
        """The events at solutions, of the contacts of all sectors."""
        symmetry = self.problem_of(0).symmetry
        found: AtEvents = []
        for solution in solutions:
            events = solution.events
            if symmetry is not None and events:
                of_all_sectors = [
                    event._replace(contact=contact)
                    for event in events
                    # What is of no contact is one event of all sectors.
                    for contact in symmetry.images(event.contact).tolist() or [-1]
                ]
                events = sorted(of_all_sectors, key=lambda event: event.contact)
            found += [(solution, event) for event in events]
        return found

    def whole(
        self, points: Table, events: AtEvents, status: str, evaluated: int, **counts: float
    ) -> Table:
        """Results of points and events, single numbers of the curve, and how it ended.

        ``evaluated`` is 1 by machine code, 0 without, -1 where nothing was computed.
        """
        problem = self.problem_of(self.highest_level)
        counts["n_events"] = len(events)
        counts["n_sectors"] = 1 if problem.symmetry is None else problem.symmetry.n_sectors
        return (
            points
            | {name: np.array(count) for name, count in counts.items()}
            | dict(
                event_value=self.request.shown([solution.value for solution, _ in events]),
                event_kind=np.array([str(event.kind) for _, event in events], dtype=object),
                event_contact=np.array([event.contact for _, event in events], dtype=int),
                harmonics=np.array(problem.harmonics),
                by_machine_code=np.array(evaluated, dtype=np.int8),
                status=np.array(status, dtype=object),
            )
        )

    def inserted(self, points: Table, new: list[tuple[int, Solution]]) -> Table:
        """The results of the path with those of solutions in front of given places."""
        solutions, places = [solution for _, solution in new], [place for place, _ in new]
        rows = self._along(solutions)
        return {name: np.insert(of, places, rows[name], axis=0) for name, of in points.items()}

    def _along(self, solutions: list[Solution]) -> Table:
        shown = self.request.shown([solution.value for solution in solutions])
        at = np.arange(len(solutions))
        return {"value": shown} | self._described(solutions, at.shape, at)

    def _grid(self, at: FloatArray) -> Table:
        """Solutions at the values of a grid; where the curve may fold, several at one value."""
        sizes = [len(several) for several in self.solutions_at]
        shape = len(at), max(1, *sizes)
        places = [i * shape[1] + k for i, size in enumerate(sizes) for k in range(size)]
        table = self._described([*chain(*self.solutions_at)], shape, np.array(places, dtype=int))
        if not self.request.may_fold:
            return {"value": at} | {name: values[:, 0] for name, values in table.items()}
        return {"value": at, "n_solutions": np.array(sizes, dtype=np.int32)} | table

    def _described(
        self, solutions: list[Solution], shape: tuple[int, ...], at: np.ndarray
    ) -> Table:
        """Results of solutions in arrays of a ``shape``, at their places in the flattened array."""
        size, highest = math.prod(shape), self.highest_level
        solved = [i for i, solution in enumerate(solutions) if solution.unknowns is not None]
        levels = {solutions[i].level for i in solved}
        if len(solved) == size and levels == {highest}:
            table = self.rows(highest, solutions)  # all of them, in order
        else:
            table = self.blank(size)
            table["iterations"][at] = [solution.solves for solution in solutions]
            for level in levels:
                of_level = [i for i in solved if solutions[i].level == level]
                put(table, at[of_level], self.rows(level, [solutions[i] for i in of_level]))
        return {name: values.reshape(shape + values.shape[1:]) for name, values in table.items()}


def put(table: Table, at: np.ndarray, rows: Table) -> None:
    """Put rows into a table, with coefficients of the harmonics that they lack."""
    for name, values in rows.items():
        if name.endswith("coefficient"):
            values = tables.widened(values, table[name].shape[-2])
        table[name][at] = values
