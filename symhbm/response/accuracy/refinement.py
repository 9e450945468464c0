"""Refinement of a response curve by harmonics until its truncation error meets an accuracy.

The whole band is followed with the smallest set of harmonics. Where the truncated harmonics would
change the response by more than the accuracy, or excite a resonance between two points, that part
of the band is followed again with a larger set, and so on. Parts meet at points where both agree in
amplitude, contact states and slopes, so that no peak and no event is lost or counted twice.
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
from symhbm.continuation.between import Peak
from symhbm.continuation.events import reduced
from symhbm.numerics import FloatArray, largest_displacement
from symhbm.response.accuracy.branch_parts import BranchPart, Solution, agree, merged
from symhbm.response.accuracy.harmonic_sets import HarmonicSets
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
"""Points that a refined part adds at both ends, so that it agrees with its neighbours there."""
_FEW = 3
"""Points in a row that are refined one by one: following a branch costs more."""
_MOST = 0.9
"""Share of the points of a part whose harmonics are expected to suffice; the rest is refined again.
"""

Span = tuple[int, int]


class Refinement:
    """Branches of one problem with the harmonics that an ``accuracy`` needs.

    ``equations_of`` makes a continuation problem. Without an accuracy the harmonics are those of
    the problem. ``fill`` asks for the solutions between points that interpolation needs. ``solves``
    counts all linear solves, ``rejected`` all rejected steps.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        equations_of: Callable[[HarmonicBalance], ContinuationProblem],
        accuracy: float | None,
        fill: bool = False,
    ):
        self.solves = 0
        self.rejected = 0
        self._problem = problem
        self._sets = HarmonicSets(problem)
        self._equations_of = equations_of
        self._equations: dict[int, ContinuationProblem] = {}
        self._fill = fill
        self._accuracy = np.inf if accuracy is None else accuracy
        if accuracy is None:
            self._equations[0] = equations_of(problem)

    def equations(self, level: int) -> ContinuationProblem:
        """The continuation problem with the harmonics of a level."""
        if level not in self._equations:
            problem = self._problem.with_harmonics(self._sets.harmonics(level))
            self._equations[level] = self._equations_of(problem)
        return self._equations[level]

    def settle(self, solution: Solution) -> Solution:
        """The solution with harmonics added until its error is within the accuracy."""
        value, level, solves = solution.value, solution.level, solution.solves
        unknowns, tangents, events = solution.unknowns, solution.tangents, solution.events
        while unknowns is not None and np.isfinite(self._accuracy):
            (truncation,) = self._truncations(level, [value], [unknowns])
            solution = Solution(value, level, unknowns, truncation.error, solves, tangents, events)
            needed = self._needed(level, truncation)
            if needed == level:
                break
            larger, frequency = self.equations(needed).at(value)
            start = embed(self.equations(level).problem, larger, unknowns)
            result = newton(lambda trial, to=larger, at=frequency: to.evaluate(trial, at), start)
            self.solves += result.iterations
            if not result.converged:
                break
            solves += result.iterations
            level, unknowns = needed, result.unknowns
            tangents = np.stack([np.append(slope_of(result.evaluation), 1.0)] * 2)
        return solution

    def fill(self, part: BranchPart) -> None:
        """Add the solutions between points that interpolation of the amplitudes needs."""
        for i, states in part.branch.between.items():
            if part.first <= i < part.last:
                solutions = [Solution.at(float(s.state[-1]), part.level, s, n) for s, n in states]
                part.between[i] = [self.settle(solution) for solution in solutions]

    def follow(
        self,
        level: int,
        band: tuple[float, float],
        max_points: int,
        per_dof: bool,
        guess: FloatArray | None = None,
    ) -> list[BranchPart]:
        """Branch parts from the first to the last value of a ``band``, from a ``level`` upwards.

        ``max_points`` and ``per_dof`` as of `Branch`; ``guess`` may be a response at the first
        value.
        """
        equations = self.equations(level)
        if equations.angles is not None:
            branches = angle_branches(equations, band, max_points, per_dof)
        else:
            branches = [Branch(equations, band, max_points, per_dof, guess)]
        for branch in branches if self._fill else ():
            branch.fill()
        branch = branches[0]
        if not np.isfinite(self._accuracy) or not branch.points:
            return [self._whole(level, branch) for branch in branches]
        self.solves += branch.corrector.solves
        self.rejected += branch.rejected
        points, last = branch.points, len(branch.points) - 1
        of_points, of_peaks = self._along(level, points), self._along(level, branch.peaks)
        pairs = zip(points, of_points, strict=True)
        solutions = [Solution.of(point, level, truncation.error) for point, truncation in pairs]
        peak_errors = [truncation.error for truncation in of_peaks]
        whole = BranchPart(branch, level, 0, last, solutions, branch.peaks, peak_errors)
        between = self._needed_between(whole, of_peaks)
        needed = np.maximum(between, [self._needed(level, truncation) for truncation in of_points])
        if equations.single_valued:
            self._settle_few(whole, needed, between > level)
        if np.all(needed == level):
            return [whole]
        if not equations.single_valued:
            # A path with folds has no parts that end at values.
            anew = self.follow(int(needed.max()), band, max_points, per_dof)
            return anew if anew[0].branch.points else [whole]

        def refined(span: Span) -> list[BranchPart] | None:
            of_span = needed[span[0] : span[1] + 1]
            higher = int(np.quantile(of_span[of_span > level], _MOST, method="lower"))
            start, end = (points[i].value for i in span)
            larger = self.equations(higher).problem
            guess = embed(equations.problem, larger, points[span[0]].unknowns)
            parts = self.follow(higher, (start, end), max_points, per_dof, guess)
            complete = all(part.branch.status == Status.REACHED_END for part in parts)
            return parts if complete else None

        return self._replaced(whole, needed > level, refined)

    def _whole(self, level: int, branch: Branch) -> BranchPart:
        """All of a branch, without truncation errors."""
        self.solves += branch.corrector.solves
        self.rejected += branch.rejected
        solutions = [Solution.of(point, level, np.nan) for point in branch.points]
        errors = [np.nan] * len(branch.peaks)
        return BranchPart(branch, level, 0, len(solutions) - 1, solutions, branch.peaks, errors)

    def _settle_few(self, whole: BranchPart, needed: np.ndarray, between: np.ndarray) -> None:
        """Settle points one by one where few in a row need more harmonics.

        Points next to a peak or resonance ``between`` points are left: there a branch is followed.
        """
        first = 0
        for i in np.flatnonzero(np.append(needed, whole.level) == whole.level).tolist():
            if i - first <= _FEW and not between[first:i].any():
                for k in range(first, i):
                    whole.at_points[k] = self.settle(whole.at_points[k])
                    needed[k] = whole.level
            first = i + 1

    def _replaced(
        self,
        whole: BranchPart,
        inaccurate: np.ndarray,
        refined: Callable[[Span], list[BranchPart] | None],
    ) -> list[BranchPart]:
        """The whole with its ``inaccurate`` points replaced, by parts that agree at their ends."""
        by_span: dict[Span, list[BranchPart] | None] = {}
        numbers = np.flatnonzero(inaccurate).tolist()
        spans = merged([_widened(whole, (i, i), inaccurate) for i in numbers])
        while True:
            for span in spans:
                if span not in by_span:
                    by_span[span] = refined(span)
            wider = [self._agreeing(whole, span, by_span[span], inaccurate) for span in spans]
            if wider == spans:
                break
            spans = merged(wider)
        result, at = [], 0
        for first, last in spans:
            parts = by_span[first, last]
            if parts is not None:
                result += [whole.cut(at, first)] if first > at else []
                result += parts
                at = last
        return result + ([whole.cut(at, whole.last)] if at < whole.last else [])

    def _agreeing(
        self, whole: BranchPart, span: Span, parts: list[BranchPart] | None, inaccurate: np.ndarray
    ) -> Span:
        """The same span if the whole agrees with ``parts`` at both ends, else a wider one."""
        if parts is None:
            return span
        first, last = span
        wide = _widened(whole, span, inaccurate, by=max(_MARGIN, (last - first) // 2))
        low, high = parts[0], parts[-1]
        if first > 0 and not agree(whole, first, low, low.first, self._accuracy):
            first = wide[0]
        if last < whole.last and not agree(whole, last, high, high.last, self._accuracy):
            last = wide[1]
        return first, last

    def _truncations(
        self, level: int, values: list[float], unknowns: list[FloatArray]
    ) -> list[Truncation]:
        larger_level = self._sets.larger(level)
        problems, frequencies, larger = [], [], []
        for value in values:
            problem, frequency = self.equations(level).at(value)
            problems.append(problem)
            frequencies.append(frequency)
            larger.append(self.equations(larger_level).at(value)[0])
        results = truncations(problems, larger, unknowns, frequencies)
        self.solves += sum(truncation.solves for truncation in results)
        return results

    def _along(self, level: int, points: Sequence[PathPoint | Peak]) -> list[Truncation]:
        """Truncations of points or peaks of a branch; without error where all contacts stick."""
        equations, result = self.equations(level), [NONE] * len(points)
        numbers = [i for i, point in enumerate(points) if self._may_truncate(point, equations)]
        values, unknowns = [points[i].value for i in numbers], [points[i].unknowns for i in numbers]
        if equations.single_valued:
            errors = self._truncations(level, values, unknowns)
        else:
            larger = self.equations(self._sets.larger(level))
            pairs = zip(unknowns, values, strict=True)
            errors = [distance(equations, larger, *pair) for pair in pairs]
            self.solves += sum(truncation.solves for truncation in errors)
        for i, truncation in zip(numbers, errors, strict=True):
            result[i] = truncation
        return result

    @staticmethod
    def _may_truncate(point: PathPoint | Peak, equations: ContinuationProblem) -> bool:
        """Whether the response may have other harmonics than the force; False if unbounded."""
        if isinstance(point, Peak):
            return bool(np.all(np.isfinite(point.unknowns)))
        return bool(point.slip.any()) or not equations.single_valued

    def _needed(self, level: int, truncation: Truncation) -> int:
        return self._sets.expected(level, truncation.error, truncation.share, self._accuracy)

    def _needed_between(self, whole: BranchPart, of_peaks: list[Truncation]) -> np.ndarray:
        """Levels (n_points,) that a peak or a resonance next to each point needs."""
        level, values = whole.level, np.array([point.value for point in whole.branch.points])
        needed = np.full(len(values), level)
        for peak, truncation in zip(whole.peaks, of_peaks, strict=True):
            near = np.argsort(np.abs(values - peak.value))[:2]
            needed[near] = np.maximum(needed[near], self._needed(level, truncation))
        for i, of_segment in enumerate(self._superharmonic(level, whole.branch.points)):
            needed[i : i + 2] = np.maximum(needed[i : i + 2], of_segment)
        return needed

    def _superharmonic(self, level: int, points: list[PathPoint]) -> list[int]:
        """Levels with the harmonics that excite resonances between points, by segment."""
        equations = self.equations(level)
        problems, frequencies = zip(*(equations.at(p.value) for p in points), strict=True)
        # A followed parameter makes the structure stiffest at one of its ends.
        harmonics = self._reaching(level, (problems[0], problems[-1]), min(frequencies))
        if not len(harmonics):
            return []
        unknowns = [point.unknowns for point in points]
        references = [
            reference(largest_displacement(p.basis, p.coefficients(u))[0])
            for p, u in zip(problems, unknowns, strict=True)
        ]
        modes = superharmonics(problems, unknowns, frequencies, harmonics, references)
        levels = []
        for left, right in pairwise(modes or []):
            large = np.maximum(left.response, right.response) > self._accuracy
            crossed = np.any(large & (left.detuning * right.detuning < 0), axis=1)
            needed = self._sets.level(int(harmonics[crossed].max())) if crossed.any() else level
            levels.append(needed)
        return levels

    def _reaching(
        self, level: int, problems: Sequence[HarmonicBalance], slowest: float
    ) -> np.ndarray:
        """Truncated harmonics below the highest natural frequency, at the ``slowest`` [rad/s]."""
        highest = self._sets.highest(level)
        beyond = [n for n in self._sets.harmonics(self._sets.last) if n > highest]
        if problems[0].n_dof > LARGEST_SIZE:
            return np.array([])
        try:
            stiffest = [max(reduced(p, n).stiffest for p in problems) for n in beyond]
        except np.linalg.LinAlgError:
            return np.array([])
        return np.array(beyond)[np.array(beyond) * slowest < np.array(stiffest)]


def _widened(whole: BranchPart, span: Span, inaccurate: np.ndarray, by: int = _MARGIN) -> Span:
    """A span and a margin, with ends at accurate points that are neither events nor peaks."""
    peaks, points, ends = {peak.value for peak in whole.peaks}, whole.branch.points, []

    def unfit(i: int) -> bool:
        return bool(inaccurate[i] or points[i].events or points[i].value in peaks)

    for end, direction in zip(span, (-1, 1), strict=True):
        at = end + direction * by
        while 0 < at < whole.last and unfit(at):
            at += direction
        ends.append(min(max(at, 0), whole.last))
    return ends[0], ends[1]
