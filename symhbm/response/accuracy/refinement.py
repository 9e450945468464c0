"""A curve whose harmonics follow an accuracy: few where few do, more where it asks for them.

The whole band is walked with the smallest set. Where the harmonics left out change the response by
more than the accuracy, or would meet a resonance between two points, that part of the band is
walked again with a larger set, and so on. Parts meet at points where both agree in amplitude,
contact states and slopes, so that no peak and no event is lost or told twice.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import (
    LARGEST_SIZE,
    Branch,
    ContinuationProblem,
    PathPoint,
    Status,
    newton,
    slope_of,
)
from symhbm.continuation.angles import angle_branches
from symhbm.continuation.between import Peak, solved_between
from symhbm.continuation.events import reduced
from symhbm.numerics import FloatArray, largest_displacement
from symhbm.response.accuracy.harmonic_sets import HarmonicSets
from symhbm.response.accuracy.parts import BranchPart, Solution, agree, merged
from symhbm.response.accuracy.superharmonics import superharmonics
from symhbm.response.accuracy.truncation import (
    NONE,
    Truncation,
    distance,
    embed,
    reference,
    truncations,
)

_MARGIN = 2
"""Points by which a part reaches beyond those that ask for it, so that it meets the others well."""
_FEW = 3
"""Points in a row that are not worth a walk."""
_MOST = 0.9
"""Share of the points of a part that its set is expected to suffice for: the others come again."""

Span = tuple[int, int]


class Refinement:
    """Curves of one problem, by set of harmonics, as an ``accuracy`` asks for them.

    ``curve_of`` makes a curve from a problem. Without an accuracy there is one curve, that of the
    problem. ``solves`` counts all linear solves, ``rejected`` all steps in vain.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        curve_of: Callable[[HarmonicBalance], ContinuationProblem],
        accuracy: float | None,
    ):
        self.solves = 0
        self.rejected = 0
        self._problem = problem
        self._sets = HarmonicSets(problem)
        self._curve_of = curve_of
        self._curves: dict[int, ContinuationProblem] = {}
        self._accuracy = np.inf if accuracy is None else accuracy
        if accuracy is None:
            self._curves[0] = curve_of(problem)

    def curve(self, level: int) -> ContinuationProblem:
        """The curve with one set of harmonics."""
        if level not in self._curves:
            problem = self._problem.with_harmonics(self._sets.harmonics(level))
            self._curves[level] = self._curve_of(problem)
        return self._curves[level]

    def settle(self, response: Solution) -> Solution:
        """Add harmonics to a response until it is accurate."""
        value, level, solves = response.value, response.level, response.solves
        unknowns, tangents, events = response.unknowns, response.tangents, response.events
        while unknowns is not None and np.isfinite(self._accuracy):
            (found,) = self._truncations(level, [value], [unknowns])
            response = Solution(value, level, unknowns, found.error, solves, tangents, events)
            needed = self._needed(level, found)
            if needed == level:
                break
            larger, frequency = self.curve(needed).at(value)
            start = embed(self.curve(level).problem, larger, unknowns)
            result = newton(lambda trial, to=larger, at=frequency: to.evaluate(trial, at), start)
            self.solves += result.iterations
            if not result.converged:
                break
            solves += result.iterations
            level, unknowns = needed, result.unknowns
            tangents = np.stack([np.append(slope_of(result.evaluation), 1.0)] * 2)
        return response

    def fill(self, stretch: BranchPart) -> None:
        """Add the responses between points of a stretch that its amplitudes do not tell."""
        walk, points = stretch.walk, stretch.walk.points[stretch.first : stretch.last + 1]
        before = walk.corrector.solves
        found = solved_between(points, walk.corrector, walk.per_dof)
        for i, stations in found.items():
            responses = [Solution.at(float(s.state[-1]), stretch.level, s, n) for s, n in stations]
            stretch.between[stretch.first + i] = [self.settle(each) for each in responses]
        self.solves += walk.corrector.solves - before

    def cover(
        self,
        level: int,
        band: tuple[float, float],
        max_points: int,
        each: bool,
        guess: FloatArray | None = None,
    ) -> list[BranchPart]:
        """Stretches from the first to the last value of a ``band``, in this order.

        ``max_points`` and ``each`` as of `Branch`; ``guess`` may be a response at the first value.
        """
        curve = self.curve(level)
        if curve.angles is not None:
            return [
                self._whole(level, walk) for walk in angle_branches(curve, band, max_points, each)
            ]
        walk = Branch(curve, band, max_points, each, guess)
        if not np.isfinite(self._accuracy) or not walk.points:
            return [self._whole(level, walk)]
        self.solves += walk.corrector.solves
        self.rejected += walk.rejected
        points, last = walk.points, len(walk.points) - 1
        found, of_peaks = self._along(level, points), self._along(level, walk.peaks)
        pairs = zip(points, found, strict=True)
        responses = [Solution.of(point, level, here.error) for point, here in pairs]
        peak_errors = [peak.error for peak in of_peaks]
        whole = BranchPart(walk, level, 0, last, responses, walk.peaks, peak_errors)
        between = self._asked_between(whole, of_peaks)
        needed = np.maximum(between, [self._needed(level, here) for here in found])
        if curve.single_valued:
            self._settle_few(whole, needed, between > level)
        if np.all(needed == level):
            return [whole]
        if not curve.single_valued:
            # A path with folds has no parts that end at values.
            anew = self.cover(int(needed.max()), band, max_points, each)
            return anew if anew[0].walk.points else [whole]

        def refined(span: Span) -> list[BranchPart] | None:
            asked = needed[span[0] : span[1] + 1]
            higher = int(np.quantile(asked[asked > level], _MOST, method="lower"))
            start, end = (points[i].value for i in span)
            guess = embed(curve.problem, self.curve(higher).problem, points[span[0]].unknowns)
            parts = self.cover(higher, (start, end), max_points, each, guess)
            complete = all(part.walk.status == Status.REACHED_END for part in parts)
            return parts if complete else None

        return self._replaced(whole, needed > level, refined)

    def _whole(self, level: int, walk: Branch) -> BranchPart:
        """All of a walk, without errors by truncation."""
        self.solves += walk.corrector.solves
        self.rejected += walk.rejected
        responses = [Solution.of(point, level, np.nan) for point in walk.points]
        unknown = [np.nan] * len(walk.peaks)
        return BranchPart(walk, level, 0, len(walk.points) - 1, responses, walk.peaks, unknown)

    def _settle_few(self, whole: BranchPart, needed: np.ndarray, between: np.ndarray) -> None:
        """Settle points one by one where few in a row ask for more harmonics.

        Not so where something ``between`` points asks for them.
        """
        first = 0
        for i in np.flatnonzero(np.append(needed, whole.level) == whole.level).tolist():
            if i - first <= _FEW and not between[first:i].any():
                for k in range(first, i):
                    whole.responses[k] = self.settle(whole.responses[k])
                    needed[k] = whole.level
            first = i + 1

    def _replaced(
        self,
        whole: BranchPart,
        poor: np.ndarray,
        refined: Callable[[Span], list[BranchPart] | None],
    ) -> list[BranchPart]:
        """The stretch with its ``poor`` points replaced, by parts that it agrees with."""
        done: dict[Span, list[BranchPart] | None] = {}
        spans = merged([_widened(whole, (i, i), poor) for i in np.flatnonzero(poor).tolist()])
        while True:
            for span in spans:
                if span not in done:
                    done[span] = refined(span)
            wider = [self._agreeing(whole, span, done[span], poor) for span in spans]
            if wider == spans:
                break
            spans = merged(wider)
        result, at = [], 0
        for first, last in spans:
            parts = done[first, last]
            if parts is not None:
                result += [whole.part(at, first)] if first > at else []
                result += parts
                at = last
        return result + ([whole.part(at, whole.last)] if at < whole.last else [])

    def _agreeing(
        self, whole: BranchPart, span: Span, parts: list[BranchPart] | None, poor: np.ndarray
    ) -> Span:
        """The same span where its ends agree with what replaces it, else a wider one."""
        if parts is None:
            return span
        first, last = span
        wide = _widened(whole, span, poor, by=max(_MARGIN, (last - first) // 2))
        low, high = parts[0], parts[-1]
        if first > 0 and not agree(whole, first, low, low.first, self._accuracy):
            first = wide[0]
        if last < whole.last and not agree(whole, last, high, high.last, self._accuracy):
            last = wide[1]
        return first, last

    def _truncations(
        self, level: int, values: list[float], unknowns: list[FloatArray]
    ) -> list[Truncation]:
        judge = self._sets.larger(level)
        problems, frequencies, larger = [], [], []
        for value in values:
            problem, frequency = self.curve(level).at(value)
            problems.append(problem)
            frequencies.append(frequency)
            larger.append(self.curve(judge).at(value)[0])
        found = truncations(problems, larger, unknowns, frequencies)
        self.solves += sum(each.solves for each in found)
        return found

    def _along(self, level: int, found: Sequence[PathPoint | Peak]) -> list[Truncation]:
        """Errors of points or peaks on a curve; nothing is left out where all contacts stick."""
        curve, result = self.curve(level), [NONE] * len(found)
        asked = [i for i, point in enumerate(found) if self._slips(point, curve)]
        values, unknowns = [found[i].value for i in asked], [found[i].unknowns for i in asked]
        if curve.single_valued:
            errors = self._truncations(level, values, unknowns)
        else:
            judge = self.curve(self._sets.larger(level))
            pairs = zip(unknowns, values, strict=True)
            errors = [distance(curve, judge, *pair) for pair in pairs]
            self.solves += sum(each.solves for each in errors)
        for i, each in zip(asked, errors, strict=True):
            result[i] = each
        return result

    @staticmethod
    def _slips(point: PathPoint | Peak, curve: ContinuationProblem) -> bool:
        """Whether other harmonics than those of the force may act; not so at an unbounded peak."""
        if isinstance(point, Peak):
            return bool(np.all(np.isfinite(point.unknowns)))
        return bool(point.slip.any()) or not curve.single_valued

    def _needed(self, level: int, found: Truncation) -> int:
        return self._sets.expected(level, found.error, found.share, self._accuracy)

    def _asked_between(self, whole: BranchPart, of_peaks: list[Truncation]) -> np.ndarray:
        """The set that a peak or a resonance next to each point asks for."""
        level, values = whole.level, np.array([point.value for point in whole.walk.points])
        asked = np.full(len(values), level)
        for peak, here in zip(whole.peaks, of_peaks, strict=True):
            near = np.argsort(np.abs(values - peak.value))[:2]
            asked[near] = np.maximum(asked[near], self._needed(level, here))
        for i, here in enumerate(self._unseen(level, whole.walk.points)):
            asked[i : i + 2] = np.maximum(asked[i : i + 2], here)
        return asked

    def _unseen(self, level: int, points: list[PathPoint]) -> list[int]:
        """The set with the resonances between points that harmonics left out would excite."""
        problems, frequencies = zip(*(self.curve(level).at(p.value) for p in points), strict=True)
        # A parameter that is followed makes the structure stiffer towards one of its ends.
        harmonics = self._audible(level, (problems[0], problems[-1]), min(frequencies))
        if not len(harmonics):
            return []
        unknowns = [point.unknowns for point in points]
        references = [
            reference(largest_displacement(p.basis, p.coefficients(u))[0])
            for p, u in zip(problems, unknowns, strict=True)
        ]
        modes = superharmonics(problems, unknowns, frequencies, harmonics, references)
        asked = []
        for left, right in pairwise(modes or []):
            heard = np.maximum(left.response, right.response) > self._accuracy
            passed = np.any(heard & (left.detuning * right.detuning < 0), axis=1)
            asked.append(self._sets.level(int(harmonics[passed].max())) if passed.any() else level)
        return asked

    def _audible(
        self, level: int, problems: Sequence[HarmonicBalance], slowest: float
    ) -> np.ndarray:
        """The harmonics left out that reach a mode of one of some problems."""
        beyond = [n for n in self._sets.harmonics(self._sets.last) if n > self._sets.top(level)]
        if problems[0].n_dof > LARGEST_SIZE:
            return np.array([])
        try:
            stiffest = [max(reduced(p, n).stiffest for p in problems) for n in beyond]
        except np.linalg.LinAlgError:
            return np.array([])
        return np.array(beyond)[np.array(beyond) * slowest < np.array(stiffest)]


def _widened(whole: BranchPart, span: Span, poor: np.ndarray, by: int = _MARGIN) -> Span:
    """A span and a margin around it, ended by points that are neither poor nor events nor peaks."""
    tops, points, ends = {peak.value for peak in whole.peaks}, whole.walk.points, []
    for end, heading in zip(span, (-1, 1), strict=True):
        at = end + heading * by
        while 0 < at < whole.last and (poor[at] or points[at].events or points[at].value in tops):
            at += heading
        ends.append(min(max(at, 0), whole.last))
    return ends[0], ends[1]
