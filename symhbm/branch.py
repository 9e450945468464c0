"""One response curve as plain arrays: what a worker computes for one parameter set."""

from dataclasses import dataclass, field

import numpy as np

from symhbm.curve import Curve, FrequencyCurve, ParameterCurve
from symhbm.fourier import FloatArray
from symhbm.peaks import Peak
from symhbm.point import RADIANS, Table, by_harmonic, describe, nothing
from symhbm.residual import HarmonicBalance
from symhbm.status import Status
from symhbm.walk import Walk

SMALLEST = 1e-3
"""Share of the largest value of a band below which lengths along it are no longer relative."""


@dataclass(frozen=True)
class Task:
    """What to follow: the parameter ``name`` over a ``band``, from its first to its last value.

    ``name`` is ``"frequency"`` (in Hz) or a parameter, set for all blades or contacts or for that
    at ``index`` alone, at a constant ``frequency`` [Hz]. ``at``: values at which solutions are
    wanted instead of the points of the path. ``each``: peaks of every degree of freedom.
    ``may_fold``: whether there may be several solutions at one value.
    """

    name: str
    band: tuple[float, float]
    at: FloatArray | None = None
    frequency: float | None = None
    index: int | None = None
    each: bool = False
    may_fold: bool = False
    max_points: int = 5000

    @property
    def unit(self) -> float:
        """The value that continuation sees over that of the user."""
        return RADIANS if self.frequency is None else 1.0

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
    """

    points: Table
    peaks: Table
    events: Table
    status: str
    counts: dict[str, int] = field(default_factory=dict)


def compute_branch(problem: HarmonicBalance, task: Task) -> Branch:
    """Follow the response of one problem."""
    curve = task.curve(problem)
    band = task.unit * task.band[0], task.unit * task.band[1]
    walk = Walk(curve, band, task.max_points, task.each)
    points = _path(walk, task) if task.at is None else _grid(walk, task)
    events = [
        dict(event_value=task.shown(p.value), event_kind=str(e.kind), event_contact=e.contact)
        for p in walk.points
        for e in p.events
    ]
    counts = dict(
        n_points=len(walk.points),
        n_peaks=len(walk.peaks),
        n_events=len(events),
        rejected_steps=walk.rejected,
        linear_solves=walk.corrector.solves,
    )
    none = Peak(0.0, 0.0, 0, "", np.zeros(problem.n_unknowns), 0.0)  # type: ignore[arg-type]
    return Branch(
        points=points,
        peaks=_columns([_peak(problem, task, p) for p in walk.peaks], _peak(problem, task, none)),
        events=_columns(events, dict(event_value=0.0, event_kind="", event_contact=0)),
        status=str(walk.status),
        counts=counts,
    )


def _path(walk: Walk, task: Task) -> Table:
    rows = [
        {"value": np.float64(task.shown(p.value))}
        | _describe(walk.curve, task, p.unknowns, p.solves, p.value)
        for p in walk.points
    ]
    _note_missing(walk, rows)
    first = task.unit * task.band[0]
    return _columns(
        rows, {"value": np.float64(first)} | _describe(walk.curve, task, None, 0, first)
    )


def _grid(walk: Walk, task: Task) -> Table:
    """Solutions at the values asked for; where the curve may fold, several at each."""
    assert task.at is not None
    values = [task.unit * float(value) for value in task.at]
    found = [
        [_describe(walk.curve, task, *solution, value) for solution in walk.at(value)]
        for value in values
    ]
    _note_missing(walk, [row for rows in found for row in rows])
    most = max(len(rows) for rows in found)
    padded = [
        row
        for rows, value in zip(found, values, strict=True)
        for row in rows + [_describe(walk.curve, task, None, 0, value)] * (most - len(rows))
    ]
    table = _columns(padded, padded[0])
    if not task.may_fold:
        return {"value": task.at} | table
    shape = len(values), most
    several = {name: array.reshape(shape + array.shape[1:]) for name, array in table.items()}
    n_solutions = np.array([len(rows) for rows in found], dtype=np.int32)
    return {"value": task.at, "n_solutions": n_solutions} | several


def _describe(
    curve: Curve, task: Task, unknowns: FloatArray | None, solves: int, value: float
) -> Table:
    problem, omega = curve.at(value)
    if unknowns is None:
        return nothing(problem, omega / RADIANS, solves, task.may_fold)
    return describe(problem, unknowns, omega / RADIANS, solves, task.may_fold)


def _note_missing(walk: Walk, rows: list[Table]) -> None:
    if walk.status == Status.REACHED_END and not all(row["converged"] for row in rows):
        walk.status = Status.POINTS_MISSING


def _peak(problem: HarmonicBalance, task: Task, peak: Peak) -> Table:
    return dict(
        peak_value=np.float64(task.shown(peak.value)),
        peak_amplitude=np.float64(peak.amplitude),
        peak_dof=np.int32(peak.dof),
        peak_kind=str(peak.kind),
        peak_residual_norm=np.float64(peak.residual_norm),
        peak_coefficient=by_harmonic(problem.basis, problem.coefficients(peak.unknowns)),
    )


def _columns(rows: list, like: dict) -> Table:
    """Rows of named values as named arrays; ``like`` gives names and shapes where there is none."""
    table = {}
    for name, value in like.items():
        dtype = object if isinstance(value, str) else np.asarray(value).dtype
        table[name] = np.empty((len(rows), *np.shape(value)), dtype=dtype)
        for i, row in enumerate(rows):
            table[name][i] = row[name]
    return table
