"""Branches that hold the highest maximum of the response over one parameter, verified by surveys.

Surveys at some values of the parameter find all maxima; those that may lead are followed from each
value to the next and back. A survey in the middle of an interval tells whether a maximum was
missed. If one that may lead appears there, both halves are surveyed in turn, until two surveys in a
row agree with the branches followed.
"""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from symhbm.continuation import Status
from symhbm.numerics import RADIANS
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.survey import Survey, Surveyor
from symhbm.peaks.tracking.branches import FollowedBranches, Parameter
from symhbm.peaks.tracking.step import verified

_AGREEMENT = 1e-9
"""Difference by which a survey may be higher than the followed branches: peaks of a survey are
located that accurately."""
_CANDIDATE_SHARE = 0.9
"""Share of the largest response from which a maximum is followed: others reveal themselves by their
slopes, or at the next survey."""
_SURVEYS_PER_DECADE = 6, 2
"""First surveys per decade: with many degrees of freedom, and with one, which has one peak."""
_MIN_INTERVALS = 4, 2
"""Least number of intervals between the first surveys, likewise: each has a middle to verify it."""
_FIRST_SHARE = 1e-3
"""Share of the largest value at which a band that begins at zero has its second survey: logarithmic
steps from zero never end."""
_SURVEY_DEPTH = 7
"""How often an interval is halved: below one per cent of a value."""
_MIN_INTERVAL = 0.08
"""Width of an interval below which it is halved only if surveys disagree: the spacing that
`peak_curve` documents."""
_CONFIRMATIONS = 2
"""Surveys in a row that must agree, with many degrees of freedom: one may do so by chance."""
_SLOPE_FACTOR = 2.0
"""Factor by which slopes between two surveys may exceed those at one of them."""


@dataclass
class SurveyedValue:
    """The survey at one value, and those of its maxima that are ``candidates`` for the lead."""

    value: float
    survey: Survey
    candidates: list[Conditions]


@dataclass
class LeadingBranches:
    """Branches that hold the highest maximum over a whole band of the parameter, once `follow` ran.

    ``unresolved`` are the ranges where a survey is higher than the followed branches,
    ``incomplete`` the surveys that did not reach the end of the frequency band, ``statuses`` how
    all of them ended.
    """

    parameter: Parameter
    surveyor: Surveyor
    surveyed: dict[float, SurveyedValue] = field(default_factory=dict)
    unresolved: list[tuple[float, float]] = field(default_factory=list)
    incomplete: list[SurveyedValue] = field(default_factory=list)
    statuses: set[Status] = field(default_factory=set)

    @cached_property
    def followed(self) -> FollowedBranches:
        """All branches that were followed."""
        bands = [(RADIANS * low, RADIANS * high) for low, high in self.surveyor.bands]
        return FollowedBranches(self.parameter, bands)

    def follow(self, wanted: list[float]) -> None:
        """Survey at ``wanted`` values and where these are far apart, and follow what may lead."""
        # One call for all first surveys, which an executor computes in parallel.
        surveyed = self.survey(_first_values(self.parameter, wanted))
        remaining = 1 if self.parameter.problem.n_dof == 1 else _CONFIRMATIONS
        triples = zip(surveyed[::2], surveyed[1::2], surveyed[2::2], strict=False)
        pending = [(*triple, remaining) for triple in triples]
        for depth in range(_SURVEY_DEPTH + 1):
            last = depth == _SURVEY_DEPTH
            intervals: list[tuple[SurveyedValue, SurveyedValue, int]] = []
            for low, middle, high, remaining in pending:
                self._follow_candidates(low, high)
                agrees = all(map(self._agrees, (low, middle, high)))
                confirmed = agrees and not self._reveals_leader(low, middle, high)
                remaining = remaining - 1 if confirmed else _CONFIRMATIONS
                self._follow_candidates(low, middle)
                self._follow_candidates(middle, high)
                if not agrees and last:
                    self.unresolved.append((low.value, high.value))
                wide = high.value > (1 + _MIN_INTERVAL) * low.value
                if remaining and (wide or not agrees):
                    intervals += [(low, middle, remaining), (middle, high, remaining)]
            if last:
                return
            middles = self.survey(
                [self.parameter.value(low.value, high.value, 0.5) for low, high, _ in intervals]
            )
            pending = [
                (low, middle, high, remaining)
                for (low, high, remaining), middle in zip(intervals, middles, strict=True)
            ]

    def check(self, values: list[float]) -> bool:
        """Survey further values and follow what was missed there; whether all surveys agree."""
        agrees = True
        new_values = self.survey([value for value in values if value not in self.surveyed])
        for surveyed in new_values:
            low, *_, high = self._neighbours(surveyed)
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
            self.statuses.add(result.status)
            if result.complete and result.height == 0:
                raise ValueError(
                    f"problem: expected a goal that is above 0 in the whole band, "
                    f"{self.parameter.problem.goal!r} is 0 at {self.parameter.name}={value:g}"
                )
            if not result.unbounded:
                floor = _CANDIDATE_SHARE * result.height
                high_maxima = [s for s in result.maxima if s.amplitude >= floor]
                candidates = [verified(self.parameter.second_order, s) for s in high_maxima]
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
            return inside or all(side.survey.unbounded for side in self._neighbours(surveyed))
        if not surveyed.survey.maxima:
            return False
        highest = self.followed.highest(surveyed.value)
        floor = (1 - _AGREEMENT) * surveyed.survey.height
        return highest is not None and highest[1].maximum.amplitude >= floor

    def _neighbours(self, surveyed: SurveyedValue) -> list[SurveyedValue]:
        """The survey at the value before, the one given and that at the value after."""
        values = sorted(self.surveyed)
        index = values.index(surveyed.value)
        return [self.surveyed[v] for v in values[max(index - 1, 0) : index + 2]]


def _first_values(parameter: Parameter, wanted: list[float]) -> list[float]:
    """An odd number of values over the whole band, those ``wanted`` among them."""
    low, high, single_dof = parameter.low, parameter.high, parameter.problem.n_dof == 1
    first = low if low > 0 else _FIRST_SHARE * high
    fixed = [first]
    for value in wanted:
        if (1 + _MIN_INTERVAL) * fixed[-1] < value < high:
            fixed.append(value)
    fixed.append(high)
    per_decade, least = (counts[single_dof] for counts in (_SURVEYS_PER_DECADE, _MIN_INTERVALS))
    widest = min(np.log(10) / per_decade, np.log(high / first) / least)
    values = [] if low > 0 else [low]
    for start, end in pairwise(fixed):
        number = max(1, int(np.ceil(np.log(end / start) / widest - 1e-9)))
        values += [start, *np.geomspace(start, end, number + 1)[1:-1].tolist()]
    values.append(high)
    if len(values) % 2 == 0:
        values.insert(-1, parameter.value(values[-2], high, 0.5))
    return values
