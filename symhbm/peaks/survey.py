"""Surveys: all maxima of the response in given bands, located peaks as well as band ends.

Many of them are computed here or by workers.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import FrequencyProblem, Status, follow_branch, solve_point
from symhbm.continuation.between import Peak, PeakKind
from symhbm.numerics import RADIANS, FloatArray, largest_displacement
from symhbm.peaks.maximum import Maximum, MaximumKind
from symhbm.workers import Workers, progress_bar

COMPLETE = (
    Status.REACHED_END, Status.OTHER_SOLUTIONS, Status.BRANCH_POINTS, Status.WITHOUT_BOUND,
)  # fmt: skip
"""Statuses of branches, and of responses, that reached the end of their band."""

Bands = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Survey:
    """Maxima of each degree of freedom over a frequency response, the highest first.

    ``unbounded`` are peaks that nothing limits; ``status`` tells how the branch ended.
    """

    maxima: list[Maximum]
    unbounded: list[Peak]
    status: Status

    @property
    def complete(self) -> bool:
        """Whether the branch reached the end of the band."""
        return self.status in COMPLETE

    @property
    def height(self) -> float:
        """The largest response [m], infinite where a peak is unbounded or no maximum exists."""
        if self.unbounded or not self.maxima:
            return np.inf
        return self.maxima[0].amplitude


def sector_of(problem: HarmonicBalance) -> HarmonicBalance:
    """The equations of one sector where all are alike, else the problem itself."""
    if not problem.single_valued or problem.symmetry is not None:
        return problem
    symmetry = problem.equal_sectors
    if symmetry is None:
        return problem
    return problem.of_sector(symmetry)


def survey(
    problem: HarmonicBalance, bands: Bands, max_points: int = 5000, dof: int | None = None
) -> Survey:
    """All maxima in ``bands`` [Hz], from the frequency response over each of them.

    Those of one ``dof`` alone where it is given; unbounded peaks are those of all. Of a band
    without width it is the response at that frequency.
    """
    maxima: list[Maximum] = []
    unbounded: list[Peak] = []
    status = Status.REACHED_END
    for band in bands:
        ends = RADIANS * band[0], RADIANS * band[1]
        if ends[0] == ends[1]:
            found = solve_point(problem, ends[0])
            if found.converged:
                maxima += _held(problem, found.unknowns, ends[0], dof, MaximumKind.POINT)
            else:
                status = found.status
            continue
        branch = follow_branch(FrequencyProblem(problem), ends, max_points, per_dof=True)
        if branch.status not in COMPLETE:
            status = branch.status
        unbounded += [peak for peak in branch.peaks if peak.kind == PeakKind.UNBOUNDED]
        bounded = [peak for peak in branch.peaks if peak.kind != PeakKind.UNBOUNDED]
        bounded = [peak for peak in bounded if dof in (None, peak.dof)]
        maxima += [Maximum.at_peak(problem, peak) for peak in bounded]
        for point in {id(p): p for p in (branch.points[:1] + branch.points[-1:])}.values():
            if point.value in ends:
                maxima += _held(problem, point.unknowns, point.value, dof)
    maxima.sort(key=lambda maximum: -maximum.amplitude)
    return Survey(maxima, unbounded, status)


def _held(
    problem: HarmonicBalance,
    unknowns: FloatArray,
    frequency: float,
    dof: int | None,
    kind: MaximumKind = MaximumKind.EDGE,
) -> list[Maximum]:
    """The responses of all degrees of freedom, of one, or the goal, at a given frequency."""
    at = problem, unknowns, frequency
    if problem.goal is not None or dof is not None:
        return [Maximum.at_edge(*at, dof or 0, kind)]
    amplitude, _ = largest_displacement(problem.basis, problem.peaking.of(unknowns))
    largest = amplitude.max(initial=0.0)
    dofs = np.flatnonzero(amplitude >= 0.5 * largest) if largest > 0 else []
    return [Maximum.at_edge(*at, int(dof), kind) for dof in dofs]


class Surveyor:
    """Surveys of problems over ``bands`` [Hz]; ``count`` is the number made.

    Surveys that an ``executor`` fails to compute, because workers die or it is closed, are
    computed in this process. A failed survey is empty, with a status that says so.
    """

    def __init__(self, bands: Bands, executor: Executor | None, progress: bool | None):
        self.bands, self.count = list(bands), 0
        self._workers = Workers(executor, "surveys")
        self._bar = progress_bar("survey", progress)

    def __enter__(self) -> "Surveyor":
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def survey(
        self, problem: Callable[[float], HarmonicBalance], values: Iterable[float]
    ) -> list[Survey]:
        """Surveys at values of a parameter, for each of which ``problem`` gives the problem."""
        calls = [(problem(value), self.bands) for value in values]
        surveys: list[Survey] = []
        results = self._workers.map(_survey_in_worker, _try_survey, calls)
        for (problem_at, _), result in zip(calls, results, strict=True):
            self.count += 1
            self._bar.update()
            # Maxima from a worker come without their problem.
            maxima = [replace(maximum, problem=problem_at) for maximum in result.maxima]
            surveys.append(replace(result, maxima=maxima))
        return surveys


def _try_survey(problem: HarmonicBalance, bands: Bands) -> Survey:
    try:
        return survey(problem, bands)
    except ArithmeticError:
        return Survey([], [], Status.COMPUTATION_FAILED)


def _survey_in_worker(problem: HarmonicBalance, bands: Bands) -> Survey:
    result = _try_survey(problem, bands)
    maxima = [replace(maximum, problem=None) for maximum in result.maxima]  # type: ignore[arg-type]
    return replace(result, maxima=maxima)
