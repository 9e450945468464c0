"""One curve of motions that no force drives as plain arrays, with what all of them have."""

from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Event, Status
from symhbm.continuation.unforced import UnforcedProblem
from symhbm.numerics import RADIANS, FloatArray, Table
from symhbm.response.describe import describe_each, unsolved
from symhbm.results import Request


class Motion(NamedTuple):
    """A motion at a ``value`` of continuation: all its unknowns, None if it was not found."""

    value: float
    unknowns: FloatArray | None
    solves: int
    events: tuple[Event, ...] = ()


class UnforcedCurve:
    """The motions along a ``branch``, or `Cycles`, None for a curve without points.

    What a kind of motion tells of itself beside its frequency it adds to `own`; ``NAMES`` are those
    of `describe_each` that it calls otherwise.
    """

    NAMES: ClassVar[dict[str, str]] = {}

    def __init__(self, request: Request, curve: UnforcedProblem, branch: Any):
        self.request, self.curve, self.branch = request, curve, branch

    def own(self, unknowns: FloatArray) -> Table:
        """Results (n,) of motions with all their unknowns (n, n_unknowns), by their names."""
        return {"frequency": unknowns[:, self.problem.n_unknowns] / RADIANS}

    @property
    def problem(self) -> HarmonicBalance:
        """The problem that the motions solve, at its nominal values."""
        return self.curve.problem

    def table(self) -> Table:
        """All results as arrays."""
        branch, symmetry = self.branch, self.problem.symmetry
        motions = [] if branch is None else [
            Motion(point.value, point.unknowns, point.solves, point.events)
            for point in branch.points
        ]  # fmt: skip
        points = self._path(motions) if self.request.at is None else self._grid(self.request.at)
        events = [(motion, event) for motion in motions for event in self._events(motion)]
        counts = dict(
            n_points=len(motions),
            n_events=len(events),
            rejected_steps=0 if branch is None else branch.rejected,
            linear_solves=0 if branch is None else branch.corrector.solves,
            n_sectors=1 if symmetry is None else symmetry.n_sectors,
        )
        table: Table = dict(
            event_value=self.request.shown([motion.value for motion, _ in events]),
            event_kind=np.array([str(event.kind) for _, event in events], dtype=object),
            event_contact=np.array([event.contact for _, event in events], dtype=int),
        )
        at_events = self._unknowns([motion for motion, _ in events])
        for name, values in self.own(at_events).items():
            table[f"event_{name}"] = values
        table |= {name: np.array(count) for name, count in counts.items()}
        by_machine_code = np.array(-1 if branch is None else 0, dtype=np.int8)
        table |= dict(harmonics=np.array(self.problem.harmonics), by_machine_code=by_machine_code)
        return points | table | dict(status=np.array(str(self.status(points)), dtype=object))

    def status(self, points: Table) -> Status:
        """How the curve ends, of its branch and of its ``points``."""
        status = Status.NOT_STARTED if self.branch is None else self.branch.status
        solved = points["converged"]
        if "n_solutions" in points:
            solved = solved | (np.arange(solved.shape[1]) >= points["n_solutions"][:, None])
        complete = status != Status.REACHED_END or bool(solved.all())
        return status if complete else Status.POINTS_MISSING

    def _events(self, motion: Motion) -> list[Event]:
        """The events at one point, of the contacts of all sectors."""
        symmetry = self.problem.symmetry
        if symmetry is None:
            return [*motion.events]
        return [
            Event(event.kind, contact, event.turns_on)
            for event in motion.events
            # What is of no contact is one event of all sectors.
            for contact in symmetry.images(event.contact).tolist() or [-1]
        ]

    def _path(self, motions: Sequence[Motion]) -> Table:
        values = self.request.shown([motion.value for motion in motions])
        return {"value": values} | self._described(motions, len(motions), range(len(motions)))

    def _grid(self, at: FloatArray) -> Table:
        """Motions at the values of a grid, several at one value where the curve turns back."""
        found: list[list[Motion]] = []
        for value in self.request.followed(at).tolist():
            pairs = [(None, 0)] if self.branch is None else self.branch.at(value)
            states = [(None if s is None else s.state[:-1], solves) for s, solves in pairs]
            found.append([Motion(value, *state) for state in states])
        sizes = np.array([len(several) for several in found], dtype=np.int32)
        width = max(1, int(sizes.max()))
        places = [i * width + k for i, several in enumerate(found) for k in range(len(several))]
        motions = [motion for several in found for motion in several]
        table = self._described(motions, len(at) * width, places)
        shaped = {name: of.reshape(len(at), width, *of.shape[1:]) for name, of in table.items()}
        return {"value": at, "n_solutions": sizes} | shaped

    def _described(self, motions: Sequence[Motion], size: int, places: Sequence[int]) -> Table:
        """Results of motions at their ``places`` among ``size`` ones."""
        table = self._renamed(unsolved(self.problem, size, self.request.tells_stability))
        table |= {name: np.full(size, np.nan) for name in self.own(self._unknowns([]))}
        table["iterations"][[*places]] = [motion.solves for motion in motions]
        pairs = zip(places, motions, strict=True)
        solved = [(place, motion) for place, motion in pairs if motion.unknowns is not None]
        if solved:
            at = [place for place, _ in solved]
            for name, values in self._rows([motion for _, motion in solved]).items():
                table[name][at] = values
        return table

    def _renamed(self, table: Table) -> Table:
        return {self.NAMES.get(name, name): values for name, values in table.items()}

    def _rows(self, motions: Sequence[Motion]) -> Table:
        curve, unknowns = self.curve, self._unknowns(motions)
        pairs = [*zip(unknowns, (motion.value for motion in motions), strict=True)]
        table = describe_each(
            [curve.problem_at(value) for _, value in pairs],
            np.ascontiguousarray(unknowns[:, : self.problem.n_unknowns]),
            np.array([curve.frequency(row) for row in unknowns]) / RADIANS,
            [motion.solves for motion in motions],
            norms=np.array([curve.evaluate(*pair).norm for pair in pairs]),
        )
        return self._renamed(table) | self.own(unknowns)

    def _unknowns(self, motions: Sequence[Motion]) -> FloatArray:
        """All unknowns (n, n_unknowns) of motions that were found."""
        rows = [motion.unknowns for motion in motions if motion.unknowns is not None]
        return np.array(rows).reshape(len(rows), self.curve.n_unknowns)
