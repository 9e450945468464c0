"""Branches that hold the highest maximum of the response over one parameter, verified by surveys.

Surveys at some values of the parameter find all maxima; those that may lead are followed from each
value to the next and back. A survey in the middle of an interval tells whether a maximum was
missed. If one that may lead appears there, both halves are surveyed in turn, until two surveys in a
row agree with the branches followed.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.numerics import FloatArray
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.survey import Survey, survey
from symhbm.peaks.tracking.branches import FollowedBranches, Parameter
from symhbm.peaks.tracking.step import verified
from symhbm.workers import Workers, progress_bar

AGREEMENT = 1e-9
"""Relative difference by which a survey may be higher than the followed branches."""
_CANDIDATE_SHARE = 0.9
"""Share of the largest response from which a maximum is followed."""
_PER_DECADE = 6, 2
"""First surveys per decade: with many DOFs, and with one."""
_MIN_INTERVALS = 4, 2
"""Least number of intervals between the first surveys: with many DOFs, and with one."""
_FIRST_SHARE = 1e-3
"""Share of the largest value at which a band that begins at zero has its second survey."""
_MAX_DEPTH = 7
"""How often an interval is halved."""
_MIN_INTERVAL = 0.08
"""Relative width of an interval below which it is halved only if surveys disagree."""
_CONFIRMATIONS = 2
"""Surveys in a row that must agree, with many DOFs; one suffices with a single DOF."""
_SLOPE_FACTOR = 2.0
"""Factor by which slopes between two surveys may exceed those at one of them."""

Bands = Sequence[tuple[float, float]]


class Surveyor:
    """Surveys of problems over ``bands`` [Hz]; ``count`` is the number made.

    Surveys that an ``executor`` fails to compute, because workers die or it is closed, are
    computed in this process. A failed survey is empty, with a status that says so.
    """

    def __init__(self, bands: Bands, executor: Executor | None, progress: bool):
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


@dataclass
class SurveyedValue:
    """The survey at one value, and those of its maxima that are ``candidates`` for the lead."""

    value: float
    survey: Survey
    candidates: list[Conditions]


class LeadingBranches:
    """Branches that hold the highest maximum over a whole band of the parameter.

    Surveys are made at ``wanted`` values and where these are far apart. ``unresolved`` are the
    ranges where a survey is higher than the followed branches, ``incomplete`` the surveys that did
    not reach the end of the frequency band.
    """

    def __init__(self, parameter: Parameter, surveyor: Surveyor, wanted: FloatArray | None = None):
        self.parameter, self.surveyor = parameter, surveyor
        bands = [(2 * np.pi * low, 2 * np.pi * high) for low, high in surveyor.bands]
        self.followed = FollowedBranches(parameter, bands)
        self.surveyed: dict[float, SurveyedValue] = {}
        self.unresolved: list[tuple[float, float]] = []
        self.incomplete: list[SurveyedValue] = []
        self._build([] if wanted is None else wanted.tolist())

    def check(self, values: list[float]) -> bool:
        """Survey further values and follow what was missed there; whether all surveys agree."""
        agrees = True
        new_values = self.survey([value for value in values if value not in self.surveyed])
        all_values = sorted(self.surveyed)
        for surveyed in new_values:
            index = all_values.index(surveyed.value)
            low, high = (
                self.surveyed[all_values[i]]
                for i in (max(index - 1, 0), min(index + 1, len(all_values) - 1))
            )
            if not self._agrees(surveyed) or self._reveals_leader(low, surveyed, high):
                self._follow_candidates(low, surveyed)
                self._follow_candidates(surveyed, high)
                agrees = False
        self.unresolved += [(s.value, s.value) for s in new_values if not self._agrees(s)]
        return agrees

    def survey(self, values: list[float]) -> list[SurveyedValue]:
        """Surveys at some values, with the candidates for the lead."""
        surveys = self.surveyor.survey(self.parameter.at, values)
        surveyed_values = []
        for value, result in zip(values, surveys, strict=True):
            surveyed = SurveyedValue(value, result, [])
            if not result.complete:
                self.incomplete.append(surveyed)
            if not result.unbounded:
                floor = _CANDIDATE_SHARE * result.height
                high_maxima = [s for s in result.maxima if s.amplitude >= floor]
                second_order = self.parameter.second_order
                candidates = [verified(second_order, maximum) for maximum in high_maxima]
                surveyed.candidates = [c for c in candidates if c is not None]
            surveyed_values.append(surveyed)
            self.surveyed[value] = surveyed
        return surveyed_values

    @property
    def unbounded(self) -> list[tuple[float, float]]:
        """Ranges over which a peak is unbounded, or may be."""
        ranges = []
        for low, high in pairwise(sorted(self.surveyed)):
            at_ends = [bool(self.surveyed[value].survey.unbounded) for value in (low, high)]
            if all(at_ends):
                ranges.append((low, high))
            elif any(at_ends):
                inside = [r for r in self.followed.unbounded if r[0] < high and r[1] > low]
                # Without a located pole the whole interval may be unbounded.
                ranges += [(max(r[0], low), min(r[1], high)) for r in inside] or [(low, high)]
        return ranges

    def _build(self, wanted: list[float]) -> None:
        # One call for all first surveys, which an executor computes in parallel.
        surveyed = self.survey(_first_values(self.parameter, wanted))
        remaining = 1 if self.parameter.problem.n_dof == 1 else _CONFIRMATIONS
        pending = [
            (*triple, remaining)
            for triple in zip(surveyed[::2], surveyed[1::2], surveyed[2::2], strict=False)
        ]
        for depth in range(_MAX_DEPTH + 1):
            intervals: list[tuple[SurveyedValue, SurveyedValue, int]] = []
            for low, middle, high, remaining in pending:
                self._follow_candidates(low, high)
                agrees = all(map(self._agrees, (low, middle, high)))
                remaining = (
                    remaining - 1
                    if agrees and not self._reveals_leader(low, middle, high)
                    else _CONFIRMATIONS
                )
                self._follow_candidates(low, middle)
                self._follow_candidates(middle, high)
                if not agrees and depth == _MAX_DEPTH:
                    self.unresolved.append((low.value, high.value))
                if remaining and (not agrees or high.value > (1 + _MIN_INTERVAL) * low.value):
                    intervals += [(low, middle, remaining), (middle, high, remaining)]
            if depth == _MAX_DEPTH:
                return
            middles = self.survey(
                [self.parameter.value(low.value, high.value, 0.5) for low, high, _ in intervals]
            )
            pending = [
                (low, middle, high, remaining)
                for (low, high, remaining), middle in zip(intervals, middles, strict=True)
            ]

    def _reveals_leader(
        self, low: SurveyedValue, middle: SurveyedValue, high: SurveyedValue
    ) -> bool:
        """Whether the survey in the middle shows a maximum, not followed, that may lead nearby."""
        if not middle.candidates:
            return False
        reach = _SLOPE_FACTOR * max(high.value - middle.value, middle.value - low.value)
        highest, *others = sorted(middle.candidates, key=lambda c: -c.maximum.amplitude)

        def rate(conditions: Conditions) -> float:
            return self.parameter.slope(conditions) / conditions.maximum.amplitude

        return any(
            np.log(highest.maximum.amplitude / c.maximum.amplitude)
            <= reach * abs(rate(c) - rate(highest))
            for c in (highest, *others)
            if not self.followed.branches_through(c, middle.value)
        )

    def _follow_candidates(self, low: SurveyedValue, high: SurveyedValue) -> None:
        """Follow the candidates at either end of an interval to the other end."""
        for start, end in ((low, high), (high, low)):
            for candidate in start.candidates:
                if not self.followed.is_followed(candidate, start.value, up=end is high):
                    self.followed.follow(candidate, start.value, end.value)

    def _agrees(self, surveyed: SurveyedValue) -> bool:
        """Whether the followed branches are as high as a survey."""
        if surveyed.survey.unbounded:
            # The extent of an unbounded range is known from tracks towards it or its neighbours.
            inside = any(low <= surveyed.value <= high for low, high in self.followed.unbounded)
            return inside or self._between_unbounded(surveyed)
        if not surveyed.survey.maxima:
            return False
        highest = self.followed.highest(surveyed.value)
        floor = (1 - AGREEMENT) * surveyed.survey.height
        return highest is not None and highest[1].maximum.amplitude >= floor

    def _between_unbounded(self, surveyed: SurveyedValue) -> bool:
        """Whether the surveys on both sides are unbounded."""
        values = sorted(self.surveyed)
        index = values.index(surveyed.value)
        neighbours = [self.surveyed[v] for v in values[max(index - 1, 0) : index + 2]]
        return all(neighbour.survey.unbounded for neighbour in neighbours)


def _first_values(parameter: Parameter, wanted: list[float]) -> list[float]:
    """An odd number of values over the whole band, those ``wanted`` among them."""
    low, high, single_dof = parameter.low, parameter.high, parameter.problem.n_dof == 1
    first = low if low > 0 else _FIRST_SHARE * high
    fixed = [first]
    for value in wanted:
        if (1 + _MIN_INTERVAL) * fixed[-1] < value < high:
            fixed.append(value)
    fixed.append(high)
    widest = min(
        np.log(10) / _PER_DECADE[single_dof], np.log(high / first) / _MIN_INTERVALS[single_dof]
    )
    values = [] if low > 0 else [low]
    for start, end in pairwise(fixed):
        number = max(1, int(np.ceil(np.log(end / start) / widest - 1e-9)))
        values += [start, *np.geomspace(start, end, number + 1)[1:-1].tolist()]
    values.append(high)
    if len(values) % 2 == 0:
        values.insert(-1, parameter.value(values[-2], high, 0.5))
    return values


def _try_survey(problem: HarmonicBalance, bands: Bands) -> Survey:
    try:
        return survey(problem, bands)
    except ArithmeticError:
        return Survey([], [], Status.COMPUTATION_FAILED)


def _survey_in_worker(problem: HarmonicBalance, bands: Bands) -> Survey:
    result = _try_survey(problem, bands)
    maxima = [replace(maximum, problem=None) for maximum in result.maxima]  # type: ignore[arg-type]
    return replace(result, maxima=maxima)
