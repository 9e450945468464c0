"""One response curve as plain arrays: what a worker computes for one parameter set."""

from dataclasses import dataclass, field, replace

import numpy as np

from symhbm.condensed_model import CondensedModel
from symhbm.curve import Curve, FrequencyCurve, ParameterCurve
from symhbm.events import Event
from symhbm.fourier import FloatArray
from symhbm.harmonic_sets import HarmonicSets
from symhbm.peaks import Peak
from symhbm.point import RADIANS, Table, by_harmonic, describe, nothing
from symhbm.refinement import Refinement
from symhbm.residual import HarmonicBalance
from symhbm.status import Status
from symhbm.stretches import Response, joined, status_of
from symhbm.symmetry import Symmetry, find_symmetry

SMALLEST = 1e-3
"""Share of the largest value of a band below which lengths along it are no longer relative."""


@dataclass(frozen=True)
class Task:
    """What to follow: the parameter ``name`` over a ``band``, from its first to its last value.

    ``name`` is ``"frequency"`` (in Hz) or a parameter, set for all blades or contacts or for that
    at ``index`` alone, at a constant ``frequency`` [Hz]. ``at``: values at which solutions are
    wanted instead of the points of the path. ``each``: peaks of every degree of freedom.
    ``may_fold``: whether there may be several solutions at one value. ``stability``: whether that
    of each is wanted. ``accuracy``: error of the displacements that the harmonics left out may
    make, relatively. ``sector``: solve one sector where there are several that move alike.
    ``keep``: names of the dataset to keep, None for all.
    """

    name: str
    band: tuple[float, float]
    at: FloatArray | None = None
    frequency: float | None = None
    index: int | None = None
    each: bool = False
    may_fold: bool = False
    stability: bool = False
    max_points: int = 5000
    accuracy: float | None = None
    sector: bool = True
    keep: tuple[str, ...] | None = None

    @property
    def unit(self) -> float:
        """The value that continuation sees over that of the user."""
        return RADIANS if self.frequency is None else 1.0

    def symmetry(self, problem: HarmonicBalance) -> Symmetry | None:
        """Sectors of a problem that stay alike, and of which one tells all, None for none.

        Only responses that are unique are as symmetric as the problem; small motions beside them,
        and frictions forces over samples, are not.
        """
        unique = problem.single_valued and not self.may_fold and not self.stability
        if not self.sector or not unique or self.index is not None or problem.samples is not None:
            return None
        if isinstance(problem.model, CondensedModel):
            return None
        return find_symmetry(problem.model, problem.excitation, problem.basis)

    def curve(self, problem: HarmonicBalance) -> Curve:
        """The equations to follow."""
        if self.frequency is None:
            return FrequencyCurve(problem)
        smallest = SMALLEST * max(abs(value) for value in self.band)
        omega = RADIANS * self.frequency
        return ParameterCurve(problem, self.name, omega, self.index, smallest)

    def shown(self, value: float) -> float:
        """A value in the user's unit; the ends of the band come back as they were given."""
        ends = {self.unit * edge: edge for edge in self.band}
        return ends.get(value, value / self.unit)


@dataclass
class Branch:
    """A response curve.

    ``points``, ``peaks`` and ``events`` hold arrays by the names of the dataset, ``value`` for that
    of the moving parameter, each with the point, peak or event as the first axis and, for points
    on a grid where the curve may fold, the solution as the second; ``counts``, one number each.
    ``harmonics`` are those of the coefficients.
    """

    points: Table
    peaks: Table
    events: Table
    status: str
    harmonics: tuple[int, ...]
    counts: dict[str, int] = field(default_factory=dict)


def compute_branch(
    problem: HarmonicBalance, task: Task, sets: HarmonicSets | None = None
) -> Branch:
    """Follow the response of one problem; ``sets`` of its structure may be shared by several."""
    return _Computation(problem, task, sets or HarmonicSets(problem)).branch()


def blank_branch(problem: HarmonicBalance, task: Task) -> Branch:
    """A branch with every name and shape of those of a task, before anything is computed."""
    return _Computation(problem, task, HarmonicSets(problem), blank=True).branch()


class _Computation:
    def __init__(
        self, problem: HarmonicBalance, task: Task, sets: HarmonicSets, blank: bool = False
    ):
        self._task = task
        self._symmetry = None if blank else task.symmetry(problem)
        if self._symmetry is not None:
            sets = sets.of_sector(problem, self._symmetry)
            problem = sets.problem.with_parameters(**problem.parameters)
        self._refinement = Refinement(problem, sets, task.curve, task.accuracy)
        self._stretches, self._status, self._largest = [], Status.NOT_STARTED, 0
        if not blank:
            self._cover()

    def _cover(self) -> None:
        task = self._task
        band = task.unit * task.band[0], task.unit * task.band[1]
        self._stretches = self._refinement.cover(0, band, task.max_points, task.each)
        self._status = status_of(self._stretches, task.accuracy)
        rungs = [part.rung for part in self._stretches]
        rungs += [response.rung for part in self._stretches for response in part.own()]
        self._largest = max(rungs)

    def branch(self) -> Branch:
        """All results as arrays."""
        task, along = self._task, joined(self._stretches)
        points = self._path(along) if task.at is None else self._grid(task.at)
        peaks = [
            row
            for stretch in self._stretches
            for peak, error in zip(stretch.peaks, stretch.peak_errors, strict=True)
            for row in self._peaks(stretch.rung, peak, error)
        ]
        peaks.sort(key=lambda row: (task.each * row["peak_dof"], row["peak_value"]))
        events = [
            dict(event_value=task.shown(p.value), event_kind=str(e.kind), event_contact=e.contact)
            for p in along
            for e in self._events(p)
        ]
        counts = dict(
            n_points=len(along),
            n_peaks=len(peaks),
            n_events=len(events),
            rejected_steps=self._refinement.rejected,
            linear_solves=self._refinement.solves,
            n_sectors=1 if self._symmetry is None else self._symmetry.n_sectors,
        )
        problem = self._refinement.curve(self._largest).problem
        none = Peak(0.0, 0.0, 0, "", np.zeros(problem.n_unknowns), 0.0)  # type: ignore[arg-type]
        return Branch(
            points=points,
            peaks=_columns(peaks, self._peaks(self._largest, none, 0.0)[0]),
            events=_columns(events, dict(event_value=0.0, event_kind="", event_contact=0)),
            status=str(self._status),
            harmonics=problem.harmonics,
            counts=counts,
        )

    def _path(self, along: list[Response]) -> Table:
        rows = [{"value": np.float64(self._task.shown(p.value))} | self._row(p) for p in along]
        self._note_missing(rows)
        first = self._task.unit * self._task.band[0]
        return _columns(rows, {"value": np.float64(first)} | self._nothing(first))

    def _grid(self, at: FloatArray) -> Table:
        """Solutions at the values asked for; where the curve may fold, several at each."""
        values = [self._task.unit * float(value) for value in at]
        found = [[self._row(response) for response in self._at(value)] for value in values]
        self._note_missing([row for rows in found for row in rows])
        most = max(len(rows) for rows in found)
        padded = [
            row
            for rows, value in zip(found, values, strict=True)
            for row in (*rows, *(self._nothing(value) for _ in range(most - len(rows))))
        ]
        table = _columns(padded, self._nothing(values[0]))
        if not self._task.may_fold:
            return {"value": at} | table
        shape = len(values), most
        several = {name: array.reshape(shape + array.shape[1:]) for name, array in table.items()}
        n_solutions = np.array([len(rows) for rows in found], dtype=np.int32)
        return {"value": at, "n_solutions": n_solutions} | several

    def _at(self, value: float) -> list[Response]:
        holding = [part for part in self._stretches if part.holds(value)] or self._stretches[:1]
        if not holding:
            return [Response(value, self._largest, None, np.nan, 0)]
        stretch = max(holding, key=lambda part: part.rung)
        found = [
            self._refinement.settle(Response(value, stretch.rung, unknowns, np.nan, solves))
            for unknowns, solves in stretch.walk.at(value)
        ]
        self._largest = max(self._largest, *(response.rung for response in found))
        accuracy = self._task.accuracy or np.inf
        if self._status == Status.REACHED_END and any(r.error > accuracy for r in found):
            self._status = Status.ACCURACY_NOT_REACHED
        return found

    def _row(self, response: Response) -> Table:
        if response.unknowns is None:
            return self._nothing(response.value, response.solves)
        problem, omega = self._refinement.curve(response.rung).at(response.value)
        frequency, stability = omega / RADIANS, self._task.stability
        row = describe(problem, response.unknowns, frequency, response.solves, stability)
        return row | self._truncation(response.rung, response.error)

    def _nothing(self, value: float, solves: int = 0) -> Table:
        problem, omega = self._refinement.curve(self._largest).at(value)
        row = nothing(problem, omega / RADIANS, solves, self._task.stability)
        return row | self._truncation(self._largest, np.nan)

    def _truncation(self, rung: int, error: float) -> Table:
        if self._task.accuracy is None:
            return {}
        highest = max(self._refinement.curve(rung).problem.harmonics)
        return dict(highest_harmonic=np.int32(highest), truncation_error=np.float64(error))

    def _note_missing(self, rows: list[Table]) -> None:
        if self._status == Status.REACHED_END and not all(row["converged"] for row in rows):
            self._status = Status.POINTS_MISSING

    def _events(self, response: Response) -> list[Event]:
        """The events of one point, of all contacts that do alike."""
        if self._symmetry is None:
            return list(response.events)
        every = [replace(e, contact=j) for e in response.events for j in self._alike(e.contact)]
        return sorted(every, key=lambda event: event.contact)

    def _alike(self, contact: int) -> list[int]:
        assert self._symmetry is not None
        return self._symmetry.images(contact).tolist()

    def _peaks(self, rung: int, peak: Peak, error: float) -> list[Table]:
        """Rows of one peak: of each of the degrees of freedom that peak together, if asked for."""
        row = self._peak(rung, peak, error)
        if self._symmetry is None or not self._task.each:
            return [row]
        others = np.arange(self._symmetry.n_sectors) * self._symmetry.n_dof
        return [row | {"peak_dof": np.int32(peak.dof + other)} for other in others]

    def _peak(self, rung: int, peak: Peak, error: float) -> Table:
        problem = self._refinement.curve(rung).problem
        row = dict(
            peak_value=np.float64(self._task.shown(peak.value)),
            peak_amplitude=np.float64(peak.amplitude),
            peak_dof=np.int32(peak.dof),
            peak_kind=str(peak.kind),
            peak_residual_norm=np.float64(peak.residual_norm),
            peak_coefficient=by_harmonic(problem.basis, problem.everywhere(peak.unknowns)),
        )
        extra = self._truncation(rung, error)
        return row | {f"peak_{name}": value for name, value in extra.items()}


def _columns(rows: list, like: dict) -> Table:
    """Rows of named values as named arrays; ``like`` gives names and the largest shapes.

    Coefficients of harmonics that a row leaves out are 0, or as unknown as its others.
    """
    table = {}
    for name, value in like.items():
        dtype = object if isinstance(value, str) else np.asarray(value).dtype
        table[name] = np.zeros((len(rows), *np.shape(value)), dtype=dtype)
        for i, row in enumerate(rows):
            here = row[name]
            if np.shape(here) != np.shape(value):
                table[name][i] = np.nan if np.isnan(here).all() else 0.0
                table[name][i][tuple(slice(size) for size in np.shape(here))] = here
            else:
                table[name][i] = here
    return table
