"""One response curve as plain arrays: the computation for one parameter set."""

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
from symhbm.response.describe import amplitude_slopes, describe_each, unsolved
from symhbm.results import CurveTable, Request

SMALLEST = 1e-3
"""Share of the largest value of a band below which steps along it are no longer relative."""


def compute_curve(problem: HarmonicBalance, request: Request) -> CurveTable:
    """The response curve of one problem."""
    return _Computation(problem, request).table()


def blank_curve(problem: HarmonicBalance, request: Request) -> CurveTable:
    """A curve without points that has the names and shapes of a request's."""
    return _Computation(problem, request, blank=True).table()


def continuation_problem_of(request: Request, problem: HarmonicBalance) -> ContinuationProblem:
    """The equations along the moving parameter of a request."""
    if request.frequency is None:
        equations = FrequencyProblem(problem)
    else:
        smallest = SMALLEST * max(abs(value) for value in request.band)
        omega = RADIANS * request.frequency
        equations = ParameterProblem(problem, request.name, omega, request.index, smallest)
    equations.angles = request.angles
    return equations


def symmetry_of(request: Request, problem: HarmonicBalance) -> Symmetry | None:
    """Symmetry of sectors that move alike, so that one is solved for all; None without one.

    Only unique responses are as symmetric as the problem. Perturbations of a response and friction
    forces over samples are not.
    """
    unique = problem.single_valued and not request.may_fold and not request.stability
    if not request.sector or not unique or request.index is not None or problem.samples is not None:
        return None
    return find_symmetry(problem.model, problem.excitation, problem.basis)


class _Computation:
    """Response curve of one parameter set: branch parts first, then their tables."""

    def __init__(self, problem: HarmonicBalance, request: Request, blank: bool = False):
        self._request = request
        self._symmetry = None if blank else symmetry_of(request, problem)
        if self._symmetry is not None:
            problem = problem.of_sector(self._symmetry)
        equations_of = partial(continuation_problem_of, request)
        self._refinement = Refinement(problem, equations_of, request.accuracy, request.at is None)
        self._parts, self._status, self._highest_level = [], Status.NOT_STARTED, 0
        if not blank:
            self._follow()

    def _follow(self) -> None:
        request = self._request
        band = request.unit * request.band[0], request.unit * request.band[1]
        self._parts = self._refinement.follow(0, band, request.max_points, request.per_dof)
        for part in self._parts:
            self._refinement.fill(part)
        self._status = status_of(self._parts, request.accuracy)
        levels = [part.level for part in self._parts]
        levels += [solution.level for part in self._parts for solution in part.solutions()]
        self._highest_level = max(levels)

    def table(self) -> CurveTable:
        """All results as arrays."""
        request, solutions = self._request, joined(self._parts)
        points = self._path(solutions) if request.at is None else self._grid(request.at)
        events = [(s.value, event) for s in solutions for event in self._events(s)]
        located = [
            (peak, part.level, error)
            for part in self._parts
            for peak, error in zip(part.peaks, part.peak_errors, strict=True)
        ]
        peaks = self._peaks(located)
        counts: dict[str, float] = dict(
            n_points=len(solutions),
            n_peaks=len(peaks["peak_value"]),
            n_events=len(events),
            rejected_steps=self._refinement.rejected,
            linear_solves=self._refinement.solves,
            n_sectors=1 if self._symmetry is None else self._symmetry.n_sectors,
        )
        status = str(self._status)
        if request.angles is not None:
            share = covered([part.branch for part in self._parts], request.unit, request.band)
            counts["angles_share"] = share
            if self._status in ANGLES_ENDED:
                status += f" (it was followed over {share:.1%} of the band)"
        return CurveTable(
            points=points,
            peaks=peaks,
            events=dict(
                event_value=np.array([request.shown(value) for value, _ in events], dtype=float),
                event_kind=np.array([str(event.kind) for _, event in events], dtype=object),
                event_contact=np.array([event.contact for _, event in events], dtype=int),
            ),
            status=status,
            harmonics=self._problem(self._highest_level).harmonics,
            counts=counts,
        )

    def _problem(self, level: int) -> HarmonicBalance:
        return self._refinement.equations(level).problem

    def _path(self, solutions: list[Solution]) -> Table:
        table = self._described(solutions)
        values = [self._request.shown(solution.value) for solution in solutions]
        return {"value": np.array(values, dtype=float)} | table

    def _grid(self, at: FloatArray) -> Table:
        """Solutions at the values of a grid; where the curve may fold, several at one value."""
        solutions = [self._at(self._request.unit * float(value)) for value in at]
        shape = len(at), max(map(len, solutions))
        rows = [
            i * shape[1] + k for i, several in enumerate(solutions) for k in range(len(several))
        ]
        table = self._described([s for several in solutions for s in several], shape, rows)
        if not self._request.may_fold:
            return {"value": at} | {name: values[:, 0] for name, values in table.items()}
        n_solutions = np.array([len(several) for several in solutions], dtype=np.int32)
        return {"value": at, "n_solutions": n_solutions} | table

    def _at(self, value: float) -> list[Solution]:
        containing = [part for part in self._parts if part.contains(value)] or self._parts[:1]
        if not containing:
            return [Solution(value, self._highest_level, None, np.nan, 0)]
        finest = max(containing, key=lambda part: part.level)
        solutions = [
            self._refinement.settle(Solution.at(value, finest.level, state, solves))
            for state, solves in finest.branch.at(value)
        ]
        self._highest_level = max(self._highest_level, *(s.level for s in solutions))
        accuracy = self._request.accuracy or np.inf
        if self._status == Status.REACHED_END and any(s.error > accuracy for s in solutions):
            self._status = Status.ACCURACY_NOT_REACHED
        return solutions

    def _described(
        self,
        solutions: list[Solution],
        shape: tuple[int, ...] | None = None,
        rows: list[int] | None = None,
    ) -> Table:
        """Results of solutions in arrays of a ``shape``.

        ``rows`` are their places in the flattened array, by default one after the other.
        """
        shape = (len(solutions),) if shape is None else shape
        at = np.arange(len(solutions)) if rows is None else np.array(rows, dtype=int)
        size, highest = math.prod(shape), self._highest_level
        table = unsolved(self._problem(highest), size, self._request.stability)
        table |= self._truncation(size, highest)
        table |= self._slopes(np.full((size, 2, *table["amplitude"].shape[1:]), np.nan))
        table["iterations"][at] = [solution.solves for solution in solutions]
        solved = [i for i, solution in enumerate(solutions) if solution.unknowns is not None]
        for level in {solutions[i].level for i in solved}:
            of_level = [i for i in solved if solutions[i].level == level]
            _put(table, at[of_level], self._rows(level, [solutions[i] for i in of_level]))
        if self._status == Status.REACHED_END and not table["converged"][at].all():
            self._status = Status.POINTS_MISSING
        return {name: values.reshape(shape + values.shape[1:]) for name, values in table.items()}

    def _rows(self, level: int, solutions: list[Solution]) -> Table:
        """Results of solutions with the harmonics of one level."""
        equations = self._refinement.equations(level)
        problems, omegas = zip(*(equations.at(s.value) for s in solutions), strict=True)
        unknowns = np.array([solution.unknowns for solution in solutions])
        frequencies, solves = np.array(omegas) / RADIANS, [s.solves for s in solutions]
        table = describe_each(problems, unknowns, frequencies, solves, self._request.stability)
        if self._request.angles is not None:
            for i, pair in enumerate(zip(problems, unknowns, strict=True)):
                both = slip_angles(*pair, table["contact_state"][i] == 1)
                for name, angles in zip(("theta_0", "theta_star"), both, strict=True):
                    # Located angles are NaN for motion that reverses while it sticks.
                    unknown = np.isnan(table[name][i])
                    table[name][i] = np.where(unknown, angles, table[name][i])
        errors = [solution.error for solution in solutions]
        tangents = np.array([solution.tangents for solution in solutions])
        slopes = amplitude_slopes(problems[0], unknowns, tangents) * self._request.unit
        slopes[~table["converged"]] = np.nan
        return table | self._truncation(len(solutions), level, errors) | self._slopes(slopes)

    def _slopes(self, slopes: FloatArray) -> Table:
        """Slopes of the amplitudes (n_points, 2, n_dof) before and after the points, by name."""
        if self._request.at is not None:
            return dict(amplitude_slope=slopes[:, 1])
        return dict(amplitude_slope=slopes[:, 1], amplitude_slope_before=slopes[:, 0])

    def _truncation(self, count: int, level: int, errors: Any = np.nan) -> Table:
        """Highest harmonics and errors of ``count`` rows; empty without an accuracy."""
        if self._request.accuracy is None:
            return {}
        highest = np.full(count, max(self._problem(level).harmonics), dtype=np.int32)
        return dict(highest_harmonic=highest, truncation_error=np.full(count, errors, dtype=float))

    def _events(self, solution: Solution) -> list[Event]:
        """The events at one point, of the contacts of all sectors."""
        symmetry = self._symmetry
        if symmetry is None:
            return list(solution.events)
        of_all_sectors = [
            replace(event, contact=int(contact))
            for event in solution.events
            for contact in symmetry.images(event.contact)
        ]
        return sorted(of_all_sectors, key=lambda event: event.contact)

    def _peaks(self, located: list[tuple[Peak, int, float]]) -> Table:
        """Results of peaks, located with the harmonics of a level and a truncation error.

        Peaks of every degree of freedom are repeated for those of the other sectors.
        """
        per_dof, symmetry = self._request.per_dof, self._symmetry
        offsets = [0]
        if symmetry is not None and per_dof:
            offsets = [i * symmetry.n_dof for i in range(symmetry.n_sectors)]
        rows = [
            (peak.dof + offset, peak, level, error)
            for peak, level, error in located
            for offset in offsets
        ]
        rows.sort(key=lambda row: (per_dof * row[0], self._request.shown(row[1].value)))
        shape = (
            self._problem(self._highest_level).model.n_dof,
            len(self._problem(self._highest_level).harmonics),
        )
        table: Table = dict(
            peak_value=np.array([self._request.shown(peak.value) for _, peak, _, _ in rows], float),
            peak_amplitude=np.array([peak.amplitude for _, peak, _, _ in rows], float),
            peak_dof=np.array([dof for dof, _, _, _ in rows], np.int32),
            peak_kind=np.array([str(peak.kind) for _, peak, _, _ in rows], object),
            peak_residual_norm=np.array([peak.residual_norm for _, peak, _, _ in rows], float),
            peak_coefficient=np.full((len(rows), *shape, 2), np.nan),
        )
        truncation = self._truncation(len(rows), self._highest_level)
        table |= {f"peak_{name}": values for name, values in truncation.items()}
        for i, (_, peak, level, error) in enumerate(rows):
            problem = self._problem(level)
            coefficients = by_harmonic(problem.basis, problem.everywhere(peak.unknowns))
            row = dict(coefficient=coefficients[None]) | self._truncation(1, level, error)
            _put(table, np.array([i]), {f"peak_{name}": values for name, values in row.items()})
        return table


def _put(table: Table, at: np.ndarray, rows: Table) -> None:
    """Put rows into a table.

    Coefficients of harmonics that the rows lack are 0, or NaN where all others are.
    """
    for name, values in rows.items():
        if name.endswith("coefficient"):
            whole = np.zeros((len(at), *table[name].shape[1:]))
            whole[np.isnan(values).all(axis=(1, 2, 3))] = np.nan
            whole[:, :, : values.shape[2]] = values
            values = whole
        table[name][at] = values
