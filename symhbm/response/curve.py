"""One response curve as plain arrays: the computation for one parameter set."""

import sys
from dataclasses import replace
from functools import cache, partial
from itertools import chain
from typing import Any

import numpy as np

from symhbm.balance import HarmonicBalance, compile_checks, slip_angles
from symhbm.continuation import (
    ContinuationProblem,
    FrequencyProblem,
    ParameterProblem,
    Status,
    by_machine_code,
    prepare,
)
from symhbm.continuation.angles import ANGLES_ENDED, covered
from symhbm.continuation.between import PeakKind
from symhbm.model import Symmetry, is_pattern
from symhbm.numerics import RADIANS, Table, by_harmonic, on_one_thread
from symhbm.response.accuracy import (
    BranchPart,
    Refinement,
    Solution,
    advice,
    joined,
    status_of,
    truncation_table,
)
from symhbm.response.curve_table import CurveTable, put, smallest_in
from symhbm.response.describe import describe_each, unsolved
from symhbm.response.events import events_between
from symhbm.response.unforced import unforced_curve
from symhbm.results import SLOPES, Request, Sweep, values_of

_MANY = 500
"""Curves of a sweep from which machine code of their checks saves more time than it takes."""


@on_one_thread
def compute_curve(problem: HarmonicBalance, request: Request) -> Table:
    """The response curve of one problem, or that of motions without a force."""
    if request.unforced is not None:
        return unforced_curve(problem, request)
    symmetry = symmetry_of(request, problem)
    refinement = _refinement(problem if symmetry is None else problem.of_sector(symmetry), request)
    band = request.unit * request.band[0], request.unit * request.band[1]
    parts = refinement.follow(0, band, request.max_points, request.per_dof)
    solutions_at: list[list[Solution]] = []
    for part in parts:
        refinement.fill(part)
    if request.at is not None:
        values = request.unit * np.array(request.at)
        solutions_at = [_solutions_at(refinement, parts, value) for value in values.tolist()]
    return Curve(request, refinement, parts, solutions_at).table()


def blank_curve(problem: HarmonicBalance, request: Request) -> Table:
    """A curve without points that has the names and shapes of a request's."""
    if request.unforced is not None:
        return unforced_curve(problem, request, blank=True)
    n_values = 0 if request.at is None else len(request.at)
    solutions_at = [[Solution(np.nan, 0, None, np.nan, 0)]] * n_values
    return Curve(request, _refinement(problem, request), [], solutions_at).table()


def _refinement(problem: HarmonicBalance, request: Request) -> Refinement:
    accuracy = np.inf if request.accuracy is None else request.accuracy
    equations_of = partial(continuation_problem_of, request)
    return Refinement(problem, equations_of, accuracy, with_between=request.at is None)


def _solutions_at(refinement: Refinement, parts: list[BranchPart], value: float) -> list[Solution]:
    """The solutions at a value of a grid; where the curve may fold, there may be several."""
    containing = [part for part in parts if part.contains(value)] or parts[:1]
    finest = max(containing, key=lambda part: part.level)
    return [
        refinement.settle(Solution.at(value, finest.level, state, solves))
        for state, solves in finest.branch.at(value)
    ]


def continuation_problem_of(request: Request, problem: HarmonicBalance) -> ContinuationProblem:
    """The equations along the moving parameter of a request."""
    if request.frequency is None:
        equations = FrequencyProblem(problem)
    else:
        axis = request.name, RADIANS * request.frequency, request.index, smallest_in(request)
        equations = ParameterProblem(problem, *axis)
        if request.name == "damping" and min(request.band) < 0:
            equations.single_valued = False
    equations.angles, equations.machine_code = request.angles, request.machine_code
    return equations


def prepared(
    problem: HarmonicBalance, sweep: Sweep, request: Request, progress: bool | None
) -> Request:
    """The request with what evaluates all of its curves, compiled in front of the first one."""
    if request.unforced is not None:
        return request

    @cache
    def announce() -> None:
        if progress is not False:
            print("symhbm: compiling the equations, once for each structure", file=sys.stderr)

    # Compiled once: copies of the problem for all parameter sets share the functions.
    equations = continuation_problem_of(request, problem)
    scattered = any(is_pattern(dim) for value in sweep.values.values() for dim in value.dims)
    symmetry = None if scattered else symmetry_of(request, problem)
    if symmetry is not None:
        equations = continuation_problem_of(request, problem.of_sector(symmetry))
    machine_code = prepare(equations, sweep.size, announce)
    if machine_code and sweep.size >= _MANY:
        compile_checks(equations.problem, announce)
    return replace(request, machine_code=machine_code)


def symmetry_of(request: Request, problem: HarmonicBalance) -> Symmetry | None:
    """Symmetry of sectors that move alike, so that one is solved for all; None without one.

    Only unique responses are as symmetric as the problem. Perturbations of a response and friction
    forces over samples are not.
    """
    unique = problem.single_valued and not request.may_fold and not request.stability
    alike = unique and request.index is None and problem.samples is None
    return problem.equal_sectors if alike else None


class Curve(CurveTable):
    """A response curve: its branch ``parts``, and on a grid the solutions at each of its values."""

    def __init__(
        self,
        request: Request,
        refinement: Refinement,
        parts: list[BranchPart],
        solutions_at: list[list[Solution]],
    ):
        self.request, self.refinement, self.parts = request, refinement, parts
        self.solutions, self.solutions_at = joined(parts), solutions_at
        solutions = chain(*(part.solutions() for part in parts), *solutions_at)
        self.highest_level = max((item.level for item in chain(parts, solutions)), default=0)

    @property
    def ended(self) -> Status:
        """How the parts end."""
        accuracy = self.request.accuracy
        return status_of(self.parts, accuracy) if self.parts else Status.NOT_STARTED

    def status(self, points: Table) -> Status:
        """How the curve ends, of all parts and of its ``points``."""
        status = super().status(points)
        whole = status in (Status.REACHED_END, Status.CLOSED, Status.POINTS_MISSING)
        accuracy = self.request.accuracy or np.inf
        if whole and any(error > accuracy for error in self._grid_errors):
            return Status.ACCURACY_NOT_REACHED
        return status

    @property
    def _grid_errors(self) -> list[float]:
        return [solution.error for several in self.solutions_at for solution in several]

    def _advice(self) -> str:
        """What to condense a structure for whose responses are not as accurate as asked for."""
        errors = [solution.error for solution in self.solutions] + self._grid_errors
        errors += [error for part in self.parts for _, error in part.peaks]
        assert self.request.accuracy is not None
        worst = float(np.nanmax(errors))
        return advice(self.problem_of(self.highest_level), worst, self.request.accuracy)

    def table(self) -> Table:
        """All results as arrays."""
        request, solutions, lost, points = self.request, self.solutions, 0, self.points()
        if request.at is None and (request.tells_stability or request.phase_resonances):
            solutions, inserted, lost = events_between(request, self.refinement, solutions, points)
            if inserted:
                points = self.inserted(points, inserted)
            for place, solution in reversed(inserted):
                solutions.insert(place, solution)
        events = self.events(solutions)
        peaks = self._peaks()
        counts: dict[str, float] = dict(
            n_points=len(solutions),
            n_peaks=len(peaks["peak_value"]),
            rejected_steps=self.refinement.rejected,
            linear_solves=self.refinement.solves,
        )
        ended = self.status(points)
        if lost and ended in (Status.REACHED_END, Status.CLOSED):
            ended = Status.CHANGE_NOT_LOCATED
        if ended == Status.REACHED_END and str(PeakKind.UNBOUNDED) in peaks["peak_kind"]:
            ended = Status.WITHOUT_BOUND
        status = str(ended)
        if ended == Status.ACCURACY_NOT_REACHED:
            status += self._advice()
        if request.angles is not None:
            share = covered([part.branch for part in self.parts], request.unit, request.band)
            counts["angles_share"] = share
            if ended in ANGLES_ENDED:
                status += f" (it was followed over {share:.1%} of the band)"
        evaluated = by_machine_code(self.refinement.equations(0)) if self.parts else -1
        points.pop("doubling", None)
        return self.whole(points | peaks, events, status, evaluated, **counts)

    def problem_of(self, level: int) -> HarmonicBalance:
        """The problem with the harmonics of a level."""
        return self.refinement.equations(level).problem

    def blank(self, size: int) -> Table:
        """Results of as many solutions that were not found."""
        highest = self.highest_level
        table = unsolved(self.problem_of(highest), size, self.request.stability)
        table |= self._truncation(highest, [np.nan] * size)
        if self.request.tells_stability:
            table["doubling"] = np.full(size, np.nan)
        return table | {name: np.full_like(table["amplitude"], np.nan) for name in self._slopes}

    def rows(self, level: int, solutions: list[Solution]) -> Table:
        """Results of solutions with the harmonics of one level."""
        equations = self.refinement.equations(level)
        problems, omegas = zip(*(equations.at(s.value) for s in solutions), strict=True)
        unknowns = np.array([solution.unknowns for solution in solutions])
        frequencies, solves = np.array(omegas) / RADIANS, [s.solves for s in solutions]
        tangents = np.array([solution.tangents for solution in solutions])
        options = self.request.tells_stability, self.request.machine_code, tangents
        # Angles that another solver found are not to be mended by this one.
        alone = self.request.angles is not None
        held = np.array([bool(solution.events) and not alone for solution in solutions])
        table = describe_each(problems, unknowns, frequencies, solves, *options, held=held)
        slopes = {name: table.pop(name) * self.request.unit for name in SLOPES}
        if self.request.angles is not None:
            for i, pair in enumerate(zip(problems, unknowns, strict=True)):
                both = slip_angles(*pair, table["contact_state"][i] == 1)
                for name, angles in zip(("theta_0", "theta_star"), both, strict=True):
                    # Located angles are NaN for motion that reverses while it sticks.
                    unknown = np.isnan(table[name][i])
                    table[name][i] = np.where(unknown, angles, table[name][i])
        errors, normal = zip(*((s.error, s.normal) for s in solutions), strict=True)
        table |= self._truncation(level, errors, normal)
        return table | {name: slopes[name] for name in self._slopes}

    @property
    def _slopes(self) -> tuple[str, ...]:
        """Names of slopes of amplitudes: on a grid of those after its values alone."""
        return SLOPES if self.request.at is None else SLOPES[:1]

    def _truncation(self, level: int, *errors: Any) -> Table:
        """As of `truncation_table` with the harmonics of a level; empty without an accuracy."""
        asked = self.request.accuracy is not None
        return truncation_table(self.problem_of(level), *errors) if asked else {}

    def _peaks(self) -> Table:
        """Results of peaks; those of every degree of freedom also for the other sectors."""
        per_dof, symmetry = self.request.per_dof, self.problem_of(0).symmetry
        offsets = [0]
        # Outputs and goals are of all sectors as they are.
        if symmetry is not None and per_dof and self.problem_of(0).peaks_of is None:
            offsets = [i * symmetry.n_dof for i in range(symmetry.n_sectors)]
        located = [(peak, part.level, error) for part in self.parts for peak, error in part.peaks]
        shown = self.request.shown([peak.value for peak, _, _ in located]).tolist()
        rows = [
            (value, peak.dof + offset, peak, level, error)
            for value, (peak, level, error) in zip(shown, located, strict=True)
            for offset in offsets
        ]
        rows.sort(key=lambda row: (per_dof * row[1], row[0]))
        whole = self.problem_of(self.highest_level)
        shape = whole.model.n_dof, len(whole.harmonics)
        table: Table = dict(
            peak_value=np.array([value for value, *_ in rows], float),
            peak_amplitude=np.array([peak.amplitude for _, _, peak, _, _ in rows], float),
            peak_dof=np.array([dof for _, dof, *_ in rows], np.int32),
            peak_kind=np.array([str(peak.kind) for _, _, peak, _, _ in rows], object),
            peak_residual_norm=np.array([peak.residual_norm for _, _, peak, _, _ in rows], float),
            peak_coefficient=np.full((len(rows), *shape, 2), np.nan),
        )
        if self.request.accuracy is not None:
            highest = [self.problem_of(level).basis.highest for *_, level, _ in rows]
            table["peak_highest_harmonic"] = np.array(highest, np.int32)
            table["peak_truncation_error"] = np.array([error for *_, error in rows], float)
        for name, output in whole.model.outputs.items():
            size = output.rows.shape[:1] if output.several else ()
            table[f"peak_{name}_amplitude"] = np.full((len(rows), *size), np.nan)
        for level in {level for _, level, _ in located}:
            problem, at = self.problem_of(level), [i for i, r in enumerate(rows) if r[3] == level]
            unknowns, basis = np.array([rows[i][2].unknowns for i in at]), problem.basis
            found = dict(peak_coefficient=by_harmonic(basis, problem.layout.everywhere(unknowns)))
            for name, output in problem.model.outputs.items():
                of_output = values_of(output, basis, problem.observed[name].of(unknowns))
                found[f"peak_{name}_amplitude"] = of_output[f"{name}_amplitude"]
            put(table, np.array(at), found)
        return table
