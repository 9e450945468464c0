"""One response curve as plain arrays: what a worker computes for one parameter set."""

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from symhbm.balance import HarmonicBalance, slip_angles
from symhbm.continuation import (
    ContinuationProblem,
    Event,
    FrequencyProblem,
    ParameterProblem,
    Status,
)
from symhbm.continuation.angles import ANGLES_ENDED, covered
from symhbm.continuation.between import Peak
from symhbm.model import Symmetry, find_symmetry
from symhbm.numerics import RADIANS, FloatArray, Table, by_harmonic
from symhbm.response.accuracy import Refinement, Solution, joined, status_of
from symhbm.response.describe import amplitude_slopes, describe_each, nothing
from symhbm.results import CurveTable, Request

SMALLEST = 1e-3
"""Share of the largest value of a band below which lengths along it are no longer relative."""


def compute_curve(problem: HarmonicBalance, task: Request) -> CurveTable:
    """Follow the response of one problem."""
    return _Computation(problem, task).branch()


def blank_curve(problem: HarmonicBalance, task: Request) -> CurveTable:
    """A branch with every name and shape of those of a task, before anything is computed."""
    return _Computation(problem, task, blank=True).branch()


def curve_of(task: Request, problem: HarmonicBalance) -> ContinuationProblem:
    """The equations to follow."""
    if task.frequency is None:
        curve = FrequencyProblem(problem)
    else:
        smallest = SMALLEST * max(abs(value) for value in task.band)
        omega = RADIANS * task.frequency
        curve = ParameterProblem(problem, task.name, omega, task.index, smallest)
    curve.angles = task.angles
    return curve


def symmetry_of(task: Request, problem: HarmonicBalance) -> Symmetry | None:
    """Sectors of a problem that stay alike, and of which one tells all, None for none.

    Only responses that are unique are as symmetric as the problem; small motions beside them,
    and frictions forces over samples, are not.
    """
    unique = problem.single_valued and not task.may_fold and not task.stability
    if not task.sector or not unique or task.index is not None or problem.samples is not None:
        return None
    return find_symmetry(problem.model, problem.excitation, problem.basis)


class _Computation:
    def __init__(self, problem: HarmonicBalance, task: Request, blank: bool = False):
        self._task = task
        self._symmetry = None if blank else symmetry_of(task, problem)
        if self._symmetry is not None:
            problem = problem.of_sector(self._symmetry)
        self._refinement = Refinement(problem, partial(curve_of, task), task.accuracy)
        self._stretches, self._status, self._largest = [], Status.NOT_STARTED, 0
        if not blank:
            self._cover()

    def _cover(self) -> None:
        task = self._task
        band = task.unit * task.band[0], task.unit * task.band[1]
        self._stretches = self._refinement.cover(0, band, task.max_points, task.each)
        if task.at is None:
            for stretch in self._stretches:
                self._refinement.fill(stretch)
        self._status = status_of(self._stretches, task.accuracy)
        levels = [part.level for part in self._stretches]
        levels += [response.level for part in self._stretches for response in part.own()]
        self._largest = max(levels)

    def branch(self) -> CurveTable:
        """All results as arrays."""
        task, along = self._task, joined(self._stretches)
        points = self._path(along) if task.at is None else self._grid(task.at)
        events = [(p.value, event) for p in along for event in self._events(p)]
        found = [
            (peak, part.level, error)
            for part in self._stretches
            for peak, error in zip(part.peaks, part.peak_errors, strict=True)
        ]
        peaks = self._peaks(found)
        counts: dict[str, float] = dict(
            n_points=len(along),
            n_peaks=len(peaks["peak_value"]),
            n_events=len(events),
            rejected_steps=self._refinement.rejected,
            linear_solves=self._refinement.solves,
            n_sectors=1 if self._symmetry is None else self._symmetry.n_sectors,
        )
        status = str(self._status)
        if task.angles is not None:
            share = covered([part.walk for part in self._stretches], task.unit, task.band)
            counts["angles_share"] = share
            if self._status in ANGLES_ENDED:
                status += f" (it was followed over {share:.1%} of the band)"
        return CurveTable(
            points=points,
            peaks=peaks,
            events=dict(
                event_value=np.array([task.shown(value) for value, _ in events], dtype=float),
                event_kind=np.array([str(event.kind) for _, event in events], dtype=object),
                event_contact=np.array([event.contact for _, event in events], dtype=int),
            ),
            status=status,
            harmonics=self._problem(self._largest).harmonics,
            counts=counts,
        )

    def _problem(self, level: int) -> HarmonicBalance:
        return self._refinement.curve(level).problem

    def _path(self, along: list[Solution]) -> Table:
        table = self._described(along)
        values = np.array([self._task.shown(response.value) for response in along], dtype=float)
        return {"value": values} | table

    def _grid(self, at: FloatArray) -> Table:
        """Solutions at the values asked for; where the curve may fold, several at each."""
        found = [self._at(self._task.unit * float(value)) for value in at]
        shape = len(at), max(map(len, found))
        place = [i * shape[1] + k for i, several in enumerate(found) for k in range(len(several))]
        table = self._described([r for several in found for r in several], shape, place)
        if not self._task.may_fold:
            return {"value": at} | {name: values[:, 0] for name, values in table.items()}
        n_solutions = np.array([len(several) for several in found], dtype=np.int32)
        return {"value": at, "n_solutions": n_solutions} | table

    def _at(self, value: float) -> list[Solution]:
        holding = [part for part in self._stretches if part.holds(value)] or self._stretches[:1]
        if not holding:
            return [Solution(value, self._largest, None, np.nan, 0)]
        stretch = max(holding, key=lambda part: part.level)
        found = [
            self._refinement.settle(Solution.at(value, stretch.level, station, solves))
            for station, solves in stretch.walk.at(value)
        ]
        self._largest = max(self._largest, *(response.level for response in found))
        accuracy = self._task.accuracy or np.inf
        if self._status == Status.REACHED_END and any(r.error > accuracy for r in found):
            self._status = Status.ACCURACY_NOT_REACHED
        return found

    def _described(
        self,
        responses: list[Solution],
        shape: tuple[int, ...] | None = None,
        place: list[int] | None = None,
    ) -> Table:
        """Rows of responses, in an array of a ``shape`` at their places, by default in a row."""
        shape = (len(responses),) if shape is None else shape
        at = np.arange(len(responses)) if place is None else np.array(place, dtype=int)
        table = nothing(self._problem(self._largest), math.prod(shape), self._task.stability)
        table |= self._truncation(math.prod(shape), self._largest)
        table |= self._slopes(np.full((math.prod(shape), 2, *table["amplitude"].shape[1:]), np.nan))
        table["iterations"][at] = [response.solves for response in responses]
        solved = [i for i, response in enumerate(responses) if response.unknowns is not None]
        for level in {responses[i].level for i in solved}:
            here = [i for i in solved if responses[i].level == level]
            rows = self._rows(level, [responses[i] for i in here])
            _put(table, at[here], rows)
        if self._status == Status.REACHED_END and not table["converged"][at].all():
            self._status = Status.POINTS_MISSING
        return {name: values.reshape(shape + values.shape[1:]) for name, values in table.items()}

    def _rows(self, level: int, responses: list[Solution]) -> Table:
        """Rows of responses that are known, with one set of harmonics."""
        curve = self._refinement.curve(level)
        problems, omegas = zip(*(curve.at(response.value) for response in responses), strict=True)
        unknowns = np.array([response.unknowns for response in responses])
        frequencies, solves = np.array(omegas) / RADIANS, [r.solves for r in responses]
        table = describe_each(problems, unknowns, frequencies, solves, self._task.stability)
        if self._task.angles is not None:
            for i, pair in enumerate(zip(problems, unknowns, strict=True)):
                both = slip_angles(*pair, table["contact_state"][i] == 1)
                for name, angles in zip(("theta_0", "theta_star"), both, strict=True):
                    # Located angles know no motion that reverses while it sticks.
                    unknown = np.isnan(table[name][i])
                    table[name][i] = np.where(unknown, angles, table[name][i])
        errors = [response.error for response in responses]
        tangents = np.array([response.tangents for response in responses])
        slopes = amplitude_slopes(problems[0], unknowns, tangents) * self._task.unit
        slopes[~table["converged"]] = np.nan
        return table | self._truncation(len(responses), level, errors) | self._slopes(slopes)

    def _slopes(self, slopes: FloatArray) -> Table:
        """Slopes of the amplitudes (n_points, 2, n_dof) before and after each point."""
        if self._task.at is not None:
            return dict(amplitude_slope=slopes[:, 1])
        return dict(amplitude_slope=slopes[:, 1], amplitude_slope_before=slopes[:, 0])

    def _truncation(self, count: int, level: int, errors: Any = np.nan) -> Table:
        """The harmonics and the errors of so many rows, where an accuracy is asked for."""
        if self._task.accuracy is None:
            return {}
        highest = np.full(count, max(self._problem(level).harmonics), dtype=np.int32)
        return dict(highest_harmonic=highest, truncation_error=np.full(count, errors, dtype=float))

    def _events(self, response: Solution) -> list[Event]:
        """The events of one point, of all contacts that do alike."""
        symmetry = self._symmetry
        if symmetry is None:
            return list(response.events)
        every = [
            replace(event, contact=int(contact))
            for event in response.events
            for contact in symmetry.images(event.contact)
        ]
        return sorted(every, key=lambda event: event.contact)

    def _peaks(self, found: list[tuple[Peak, int, float]]) -> Table:
        """Rows of peaks, each with its set of harmonics and its error by truncation.

        Where those of each degree of freedom are asked for, one for each of all that move alike.
        """
        each, symmetry = self._task.each, self._symmetry
        others = [0]
        if symmetry is not None and each:
            others = [i * symmetry.n_dof for i in range(symmetry.n_sectors)]
        rows = [(peak.dof + other, peak, level, e) for peak, level, e in found for other in others]
        rows.sort(key=lambda row: (each * row[0], self._task.shown(row[1].value)))
        shape = (
            self._problem(self._largest).model.n_dof,
            len(self._problem(self._largest).harmonics),
        )
        table: Table = dict(
            peak_value=np.array([self._task.shown(peak.value) for _, peak, _, _ in rows], float),
            peak_amplitude=np.array([peak.amplitude for _, peak, _, _ in rows], float),
            peak_dof=np.array([dof for dof, _, _, _ in rows], np.int32),
            peak_kind=np.array([str(peak.kind) for _, peak, _, _ in rows], object),
            peak_residual_norm=np.array([peak.residual_norm for _, peak, _, _ in rows], float),
            peak_coefficient=np.full((len(rows), *shape, 2), np.nan),
        )
        extra = self._truncation(len(rows), self._largest)
        table |= {f"peak_{name}": values for name, values in extra.items()}
        for i, (_, peak, level, error) in enumerate(rows):
            problem = self._problem(level)
            coefficients = by_harmonic(problem.basis, problem.everywhere(peak.unknowns))
            row = dict(coefficient=coefficients[None]) | self._truncation(1, level, error)
            _put(table, np.array([i]), {f"peak_{name}": values for name, values in row.items()})
        return table


def _put(table: Table, at: np.ndarray, rows: Table) -> None:
    """Put rows into a table.

    Coefficients of harmonics that they leave out are 0, or as unknown as their others.
    """
    for name, values in rows.items():
        if name.endswith("coefficient"):
            whole = np.zeros((len(at), *table[name].shape[1:]))
            whole[np.isnan(values).all(axis=(1, 2, 3))] = np.nan
            whole[:, :, : values.shape[2]] = values
            values = whole
        table[name][at] = values
