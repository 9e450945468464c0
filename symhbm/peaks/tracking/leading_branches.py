"""The highest maximum of the response over one parameter: followed between surveys, and verified.

Surveys at some values of the parameter find all maxima; those that may lead are followed from each
value to the next and back. A survey in the middle tells whether any was overlooked: where one was
born in between that may lead there, both halves are verified in turn, until two surveys one after
the other show nothing new.
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
from symhbm.peaks.tracking.branches import Parameter, Pool
from symhbm.peaks.tracking.step import verified
from symhbm.workers import Workers, progress_bar

AGREES = 1e-9
"""Relative difference by which a survey may be higher than what was followed."""
_CONTENDER = 0.9
"""Share of the largest response that a maximum needs to be followed."""
_PER_DECADE = 6, 2
_FEWEST = 4, 2
"""Distances between surveys at first, by decade and at least: of many DOF, and of one."""
_SMALLEST = 1e-3
"""Share of the largest value below which one step leads to a band that begins at zero."""
_DEEPEST = 7
"""How often an interval is halved."""
_NARROW = 0.08
"""Distance between surveys, relative, below which only one that was higher asks for more."""
_QUIET = 2
"""Surveys in the middle, one after the other, that show nothing new: of many DOF; one of one."""
_HASTE = 2.0
"""Factor by which slopes between two surveys may be larger than at one of them."""

Bands = Sequence[tuple[float, float]]


class Surveyor:
    """Surveys ``bands`` [Hz] of problems; ``count`` tells how many it made.

    What an ``executor`` does not compute, as workers die or it is closed, is computed in this
    process. A survey that fails is empty, and its status says so.
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
        """All maxima at some values of a parameter, ``problem`` giving that at each."""
        calls = [(problem(value), self.bands) for value in values]
        surveys: list[Survey] = []
        results = self._workers.map(_work, _survey, calls)
        for (of, _), landscape in zip(calls, results, strict=True):
            self.count += 1
            self._bar.update()
            # Those of a worker come with equations of their own.
            summits = [replace(summit, problem=of) for summit in landscape.summits]
            surveys.append(replace(landscape, summits=summits))
        return surveys


@dataclass
class SurveyedValue:
    """All maxima at one value, and those of them that are ``contenders``."""

    value: float
    landscape: Survey
    contenders: list[Conditions]


class LeadingBranches:
    """Branches that hold the highest maximum over a whole band of the parameter.

    Surveys are made at ``wanted`` values and wherever these are far from each other. ``gaps`` are
    the ranges where a survey was higher than what could be followed, ``incomplete`` the surveys
    that did not reach the end of the band of frequencies.
    """

    def __init__(self, parameter: Parameter, surveyor: Surveyor, wanted: FloatArray | None = None):
        self.parameter, self.surveyor = parameter, surveyor
        bands = [(2 * np.pi * low, 2 * np.pi * high) for low, high in surveyor.bands]
        self.pool = Pool(parameter, bands)
        self.scenes: dict[float, SurveyedValue] = {}
        self.gaps: list[tuple[float, float]] = []
        self.incomplete: list[SurveyedValue] = []
        self._build([] if wanted is None else wanted.tolist())

    def check(self, values: list[float]) -> bool:
        """Verify what was followed at some values; where it is too low, follow what is there."""
        held = True
        scenes = self.survey([value for value in values if value not in self.scenes])
        places = sorted(self.scenes)
        for scene in scenes:
            place = places.index(scene.value)
            low, high = (
                self.scenes[places[i]] for i in (max(place - 1, 0), min(place + 1, len(places) - 1))
            )
            if not self._holds(scene) or self._news(low, scene, high):
                self._cover(low, scene)
                self._cover(scene, high)
                held = False
        self.gaps += [(s.value, s.value) for s in scenes if not self._holds(s)]
        return held

    def survey(self, values: list[float]) -> list[SurveyedValue]:
        """Surveys at some values."""
        found = self.surveyor.survey(self.parameter.at, values)
        result = []
        for value, landscape in zip(values, found, strict=True):
            scene = SurveyedValue(value, landscape, [])
            if not landscape.complete:
                self.incomplete.append(scene)
            if not landscape.unbounded:
                floor = _CONTENDER * landscape.height
                leading = [s for s in landscape.summits if s.amplitude >= floor]
                second_order = self.parameter.second_order
                found_there = [verified(second_order, summit) for summit in leading]
                scene.contenders = [c for c in found_there if c is not None]
            result.append(scene)
            self.scenes[value] = scene
        return result

    @property
    def unbounded(self) -> list[tuple[float, float]]:
        """Ranges over which a peak is unbounded, or may be."""
        ranges = []
        for low, high in pairwise(sorted(self.scenes)):
            ends = [bool(self.scenes[value].landscape.unbounded) for value in (low, high)]
            if all(ends):
                ranges.append((low, high))
            elif any(ends):
                known = [r for r in self.pool.infinite if r[0] < high and r[1] > low]
                # One that dies on the way up leaves open where that is.
                ranges += [(max(r[0], low), min(r[1], high)) for r in known] or [(low, high)]
        return ranges

    def _build(self, wanted: list[float]) -> None:
        # All at once, for the executor.
        scenes = self.survey(_first_values(self.parameter, wanted))
        quiet = 1 if self.parameter.problem.n_dof == 1 else _QUIET
        pending = [
            (*three, quiet) for three in zip(scenes[::2], scenes[1::2], scenes[2::2], strict=False)
        ]
        for depth in range(_DEEPEST + 1):
            parts: list[tuple[SurveyedValue, SurveyedValue, int]] = []
            for low, middle, high, quiet in pending:
                self._cover(low, high)
                held = all(map(self._holds, (low, middle, high)))
                quiet = quiet - 1 if held and not self._news(low, middle, high) else _QUIET
                self._cover(low, middle)
                self._cover(middle, high)
                if not held and depth == _DEEPEST:
                    self.gaps.append((low.value, high.value))
                if quiet and (not held or high.value > (1 + _NARROW) * low.value):
                    parts += [(low, middle, quiet), (middle, high, quiet)]
            if depth == _DEEPEST:
                return
            middles = self.survey(
                [self.parameter.value(low.value, high.value, 0.5) for low, high, _ in parts]
            )
            pending = [
                (low, middle, high, quiet)
                for (low, high, quiet), middle in zip(parts, middles, strict=True)
            ]

    def _news(self, low: SurveyedValue, middle: SurveyedValue, high: SurveyedValue) -> bool:
        """Whether a maximum that was not followed there may lead somewhere between two surveys."""
        if not middle.contenders:
            return False
        reach = _HASTE * max(high.value - middle.value, middle.value - low.value)
        top, *others = sorted(middle.contenders, key=lambda c: -c.summit.amplitude)

        def rate(found: Conditions) -> float:
            return self.parameter.slope(found) / found.summit.amplitude

        return any(
            np.log(top.summit.amplitude / c.summit.amplitude) <= reach * abs(rate(c) - rate(top))
            for c in (top, *others)
            if not self.pool.holds(c, middle.value)
        )

    def _cover(self, low: SurveyedValue, high: SurveyedValue) -> None:
        """Follow all contenders from either end of an interval to the other."""
        for start, end in ((low, high), (high, low)):
            for contender in start.contenders:
                if not self.pool.knows(contender, start.value, up=end is high):
                    self.pool.follow(contender, start.value, end.value)

    def _holds(self, scene: SurveyedValue) -> bool:
        """Whether what was followed is as high as a survey found."""
        if scene.landscape.unbounded:
            # Up to where an unbounded peak reaches is told by those around.
            inside = any(low <= scene.value <= high for low, high in self.pool.infinite)
            return inside or self._surrounded(scene)
        if not scene.landscape.summits:
            return False
        top = self.pool.highest(scene.value)
        floor = (1 - AGREES) * scene.landscape.height
        return top is not None and top[1].summit.amplitude >= floor

    def _surrounded(self, scene: SurveyedValue) -> bool:
        values = sorted(self.scenes)
        place = values.index(scene.value)
        around = [self.scenes[v] for v in values[max(place - 1, 0) : place + 2]]
        return all(other.landscape.unbounded for other in around)


def _first_values(parameter: Parameter, wanted: list[float]) -> list[float]:
    """An odd number of values over the whole band, those ``wanted`` among them."""
    low, high, one = parameter.low, parameter.high, parameter.problem.n_dof == 1
    first = low if low > 0 else _SMALLEST * high
    fixed = [first]
    for value in wanted:
        if (1 + _NARROW) * fixed[-1] < value < high:
            fixed.append(value)
    fixed.append(high)
    widest = min(np.log(10) / _PER_DECADE[one], np.log(high / first) / _FEWEST[one])
    values = [] if low > 0 else [low]
    for start, end in pairwise(fixed):
        number = max(1, int(np.ceil(np.log(end / start) / widest - 1e-9)))
        values += [start, *np.geomspace(start, end, number + 1)[1:-1].tolist()]
    values.append(high)
    if len(values) % 2 == 0:
        values.insert(-1, parameter.value(values[-2], high, 0.5))
    return values


def _survey(problem: HarmonicBalance, bands: Bands) -> Survey:
    try:
        return survey(problem, bands)
    except ArithmeticError:
        return Survey([], [], Status.COMPUTATION_FAILED)


def _work(problem: HarmonicBalance, bands: Bands) -> Survey:
    found = _survey(problem, bands)
    bare = [replace(summit, problem=None) for summit in found.summits]  # type: ignore[arg-type]
    return replace(found, summits=bare)
