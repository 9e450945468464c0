"""The highest maximum of the response over one parameter: followed between surveys, and verified.

Surveys at some values of the parameter find all maxima; those that may lead are followed from each
value to the next and back. A survey in the middle tells whether any was overlooked: one that was
born in between is followed from there, and both halves are verified in turn.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from symhbm.landscape import Landscape
from symhbm.peak_conditions import Conditions
from symhbm.tracking.branches import Parameter, Pool
from symhbm.tracking.step import verified
from symhbm.tracking.surveys import Surveyor

AGREES = 1e-9
"""Relative difference by which a survey may be higher than what was followed."""
_CONTENDER = 0.9
"""Share of the largest response that a maximum needs to be followed."""
_PER_DECADE = 3
_FEWEST = 4
"""Intervals at first: by decade, and at least."""
_SMALLEST = 1e-3
"""Share of the largest value below which one step leads to a band that begins at zero."""
_DEEPEST = 7
"""How often an interval is halved."""


@dataclass
class Scene:
    """All maxima at one value, and those of them that are ``contenders``."""

    value: float
    landscape: Landscape
    contenders: list[Conditions]


class Ridge:
    """Branches that hold the highest maximum over a whole band of the parameter.

    ``gaps`` are the ranges where a survey was higher than what could be followed, ``incomplete``
    the surveys that did not reach the end of the band of frequencies.
    """

    def __init__(self, parameter: Parameter, surveyor: Surveyor):
        self.parameter, self.surveyor = parameter, surveyor
        bands = [(2 * np.pi * low, 2 * np.pi * high) for low, high in surveyor.bands]
        self.pool = Pool(parameter, bands)
        self.scenes: dict[float, Scene] = {}
        self.gaps: list[tuple[float, float]] = []
        self.incomplete: list[Scene] = []
        self._build()

    def check(self, values: list[float]) -> bool:
        """Verify what was followed at some values; where it is too low, follow what is there."""
        held = True
        scenes = self.survey([value for value in values if value not in self.scenes])
        places = sorted(self.scenes)
        for scene in scenes:
            if not self._holds(scene):
                place = places.index(scene.value)
                for other in (places[place - 1], places[min(place + 1, len(places) - 1)]):
                    self._cover(*sorted((scene, self.scenes[other]), key=lambda s: s.value))
                held = False
        self.gaps += [(s.value, s.value) for s in scenes if not self._holds(s)]
        return held

    def survey(self, values: list[float]) -> list[Scene]:
        """Surveys at some values."""
        found = self.surveyor.survey(self.parameter.at, values)
        result = []
        for value, landscape in zip(values, found, strict=True):
            scene = Scene(value, landscape, [])
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

    def _build(self) -> None:
        anchors = _anchors(self.parameter)
        middles = [self._middle(*pair) for pair in pairwise(anchors)]
        # All at once, for the executor.
        scenes = self.survey(anchors + middles)
        at_anchors = scenes[: len(anchors)]
        intervals = list(zip(at_anchors, at_anchors[1:], scenes[len(anchors) :], strict=False))
        for depth in range(_DEEPEST + 1):
            failed: list[tuple[Scene, Scene]] = []
            for low, high, middle in intervals:
                self._cover(low, high)
                held = self._holds(low) and self._holds(middle) and self._holds(high)
                self._cover(low, middle)
                self._cover(middle, high)
                if not held:
                    failed += [(low, middle), (middle, high)]
            if depth == _DEEPEST:
                self.gaps = [(low.value, high.value) for low, high in failed]
                return
            values = [self._middle(low.value, high.value) for low, high in failed]
            middles = self.survey(values)
            intervals = [(*pair, middle) for pair, middle in zip(failed, middles, strict=True)]

    def _middle(self, low: float, high: float) -> float:
        return self.parameter.value(low, high, 0.5)

    def _cover(self, low: Scene, high: Scene) -> None:
        """Follow all contenders from either end of an interval to the other."""
        for start, end in ((low, high), (high, low)):
            for contender in start.contenders:
                if not self.pool.knows(contender, start.value, up=end is high):
                    self.pool.follow(contender, start.value, end.value)

    def _holds(self, scene: Scene) -> bool:
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

    def _surrounded(self, scene: Scene) -> bool:
        values = sorted(self.scenes)
        place = values.index(scene.value)
        around = [self.scenes[v] for v in values[max(place - 1, 0) : place + 2]]
        return all(other.landscape.unbounded for other in around)


def _anchors(parameter: Parameter) -> list[float]:
    low, high = parameter.low, parameter.high
    first = low if low > 0 else _SMALLEST * high
    number = max(_FEWEST, int(np.ceil(_PER_DECADE * np.log10(high / first))))
    values = np.geomspace(first, high, number + 1).tolist()
    values[0], values[-1] = first, high
    return values if low > 0 else [low, *values]
