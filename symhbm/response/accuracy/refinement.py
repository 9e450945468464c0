"""Refinement of a response curve by harmonics until its truncation error meets an accuracy.

The whole band is followed with the smallest set of harmonics. Where the truncated harmonics would
change the response by more than the accuracy, or excite a resonance between two points, that part
of the band is followed again with a larger set, and so on. Parts meet at points where both agree in
amplitude, contact states and slopes, so that no peak and no event is lost or counted twice.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import repeat, zip_longest

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import (
    Branch,
    ContinuationProblem,
    PathPoint,
    Status,
    branches_over,
    filled,
    newton,
    slope_of,
)
from symhbm.continuation.angles import angle_branches
from symhbm.continuation.between import Peak
from symhbm.numerics import FloatArray
from symhbm.response.accuracy.branch_parts import BranchPart, Solution, Span, replaced
from symhbm.response.accuracy.harmonic_sets import HarmonicSets
from symhbm.response.accuracy.superharmonics import superharmonic_levels
from symhbm.response.accuracy.truncation import NONE, Truncation, distance, embed, truncations

_FEW = 3
"""Points in a row that are refined one by one: following a branch costs more."""
_MOST = 0.9
"""Share of the points of a part whose harmonics are expected to suffice; the rest is refined again.
"""

_UNKNOWN = repeat(NONE._replace(error=np.nan))
"""Truncations of a branch of which they are not asked for."""


@dataclass
class Refinement:
    """Branches of one problem with the harmonics that an ``accuracy`` needs.

    ``equations_of`` makes a continuation problem. With an infinite accuracy the harmonics are those
    of the problem. ``with_between`` asks for the solutions between points that interpolation needs.
    ``solves`` counts all linear solves, ``rejected`` all rejected steps.
    """

    problem: HarmonicBalance
    equations_of: Callable[[HarmonicBalance], ContinuationProblem]
    accuracy: float = np.inf
    with_between: bool = False
    solves: int = 0
    rejected: int = 0
    _equations: dict[int, ContinuationProblem] = field(default_factory=dict, init=False)

    @cached_property
    def _sets(self) -> HarmonicSets:
        return HarmonicSets(self.problem)

    def equations(self, level: int) -> ContinuationProblem:
        """The continuation problem with the harmonics of a level."""
        if level not in self._equations:
            problem = self.problem
            if np.isfinite(self.accuracy):
                problem = problem.with_harmonics(self._sets.harmonics(level))
            self._equations[level] = self.equations_of(problem)
        return self._equations[level]

    def settle(self, solution: Solution) -> Solution:
        """The solution with harmonics added until its error is within the accuracy."""
        while solution.unknowns is not None and np.isfinite(self.accuracy):
            value, level, unknowns = solution.value, solution.level, solution.unknowns
            (truncation,) = self._truncations(level, [value], [unknowns])
            solution = solution._replace(error=truncation.error, normal=truncation.normal)
            needed = self._needed(level, truncation)
            if needed == level:
                break
            larger, frequency = self.equations(needed).at(value)
            start = embed(self.equations(level).problem, larger, unknowns)
            result = newton(lambda trial, to=larger, at=frequency: to.evaluate(trial, at), start)
            self.solves += result.iterations
            if not result.converged:
                break
            solution = solution._replace(
                level=needed,
                unknowns=result.unknowns,
                solves=solution.solves + result.iterations,
                tangents=[np.append(slope_of(result.evaluation), 1.0)] * 2,
            )
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

        The other arguments are those of `follow_branch`.
        """
        equations = self.equations(level)
        if equations.angles is not None:
            branches = angle_branches(equations, band, max_points, per_dof)
        else:
            branches = branches_over(equations, band, max_points, per_dof, guess)
        if self.with_between:
            branches = [filled(branch) for branch in branches]
        parts, highest = list[BranchPart](), level
        for branch, beyond in zip_longest(branches, branches[1:]):
            whole, needed = self._assessed(level, branch)
            if np.any(needed > level) and equations.single_valued:
                parts += self._refined(whole, needed, max_points, per_dof)
            else:
                parts.append(whole)
                highest = max(highest, int(needed.max(initial=level)))
            if branch.status == Status.INTERRUPTED:
                begin = branch.points[-1].value if branch.points else band[0]
                middle = (begin + beyond.points[0].value) / 2
                parts.append(BranchPart.gap(branch, level, middle))
        if highest == level:
            return parts
        # A path with folds has no parts that end at values.
        anew = self.follow(highest, band, max_points, per_dof)
        return anew if anew[0].branch.points else parts

    def _assessed(self, level: int, branch: Branch) -> tuple[BranchPart, np.ndarray]:
        """All of a branch, and the level (n_points,) that each of its points needs."""
        points, single_valued = branch.points, self.equations(level).single_valued
        if not points or not np.isfinite(self.accuracy):
            return self.whole(level, branch), np.zeros(0, dtype=int)
        of_points, of_peaks = self._along(level, points), self._along(level, branch.peaks)
        whole = self.whole(level, branch, of_points, of_peaks)
        between = self._needed_between(whole, of_peaks)
        needed = np.maximum(between, [self._needed(level, truncation) for truncation in of_points])
        if single_valued:
            self._settle_few(whole, needed, between > level)
        return whole, needed

    def _refined(
        self, whole: BranchPart, needed: np.ndarray, max_points: int, per_dof: bool
    ) -> list[BranchPart]:
        """A branch with the parts of it that need higher levels followed again."""
        level, points = whole.level, whole.branch.points

        def refined(span: Span) -> list[BranchPart] | None:
            of_span = needed[span[0] : span[1] + 1]
            higher = int(np.quantile(of_span[of_span > level], _MOST, method="lower"))
            start, end = (points[i].value for i in span)
            larger = self.equations(higher).problem
            guess = embed(self.equations(level).problem, larger, points[span[0]].unknowns)
            parts = self.follow(higher, (start, end), max_points, per_dof, guess)
            complete = all(part.branch.status == Status.REACHED_END for part in parts)
            return parts if complete else None

        return replaced(whole, needed > level, refined, self.accuracy)

    def whole(
        self,
        level: int,
        branch: Branch,
        of_points: Iterable[Truncation] = _UNKNOWN,
        of_peaks: Iterable[Truncation] = _UNKNOWN,
    ) -> BranchPart:
        """All of a branch, with the truncations of its points and peaks."""
        self.solves += branch.corrector.solves
        self.rejected += branch.rejected
        pairs = zip(branch.points, of_points, strict=False)
        solutions = [Solution.of(point, level, truncation) for point, truncation in pairs]
        pairs = zip(branch.peaks, of_peaks, strict=False)
        peaks = [(peak, truncation.error) for peak, truncation in pairs]
        return BranchPart(branch, level, 0, len(solutions) - 1, solutions, peaks)

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

    def _truncations(
        self, level: int, values: list[float], unknowns: list[FloatArray]
    ) -> list[Truncation]:
        equations, larger = self.equations(level), self.equations(self._sets.larger(level))
        points = [(*equations.at(value), larger.at(value)[0]) for value in values]
        problems, frequencies, larger_problems = zip(*points, strict=True) if points else [()] * 3
        results = truncations(problems, larger_problems, unknowns, frequencies)
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
        return bool(point.switches.any()) or not equations.single_valued

    def _needed(self, level: int, truncation: Truncation) -> int:
        return self._sets.expected(level, truncation.error, truncation.share, self.accuracy)

    def _needed_between(self, whole: BranchPart, of_peaks: list[Truncation]) -> np.ndarray:
        """Levels (n_points,) that a peak or a resonance next to each point needs."""
        level, values = whole.level, np.array([point.value for point in whole.branch.points])
        needed = np.full(len(values), level)
        for peak, truncation in zip(whole.branch.peaks, of_peaks, strict=True):
            near = np.argsort(np.abs(values - peak.value))[:2]
            needed[near] = np.maximum(needed[near], self._needed(level, truncation))
        levels = superharmonic_levels(
            self.equations(level), whole.branch.points, self._sets, level, self.accuracy
        )
        for i, of_segment in enumerate(levels):
            needed[i : i + 2] = np.maximum(needed[i : i + 2], of_segment)
        return needed
