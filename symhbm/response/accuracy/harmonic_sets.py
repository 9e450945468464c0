"""Nested sets of harmonics, from which an accuracy chooses."""

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.numerics import FloatArray, check, complete_harmonics

HIGHEST = 55
"""Harmonic, in units of the lowest, beyond which sets do not grow: errors fall with its cube."""
_GROWTH = 1.3
"""Ratio of the highest harmonics of successive levels: few levels, few harmonics in vain."""
_LARGER = 2
"""Ratio of highest harmonics to the set that estimates errors: an eighth of the error is beyond."""


def check_accuracy(problem: HarmonicBalance, accuracy: float | None) -> float | None:
    """An accuracy as a float, or None.

    Raises ValueError or TypeError unless it is between 0 and 1, and for sampled friction, whose
    error does not vanish with the harmonics, and a structure that knows too few harmonics to
    estimate errors.
    """
    if accuracy is None:
        return None
    value = check.scalar("accuracy", accuracy, "positive")
    if value >= 1:
        raise ValueError(f"accuracy={check.shown(accuracy)}: expected a value below 1")
    if not problem.model.has_matrices and problem.model.kept is None:
        raise ValueError(
            f"accuracy={check.shown(accuracy)}: expected None for a structure without matrices; "
            "compare results of two sets of harmonics"
        )
    sets = HarmonicSets(problem)
    if sets.last < 0:
        raise ValueError(
            f"accuracy={check.shown(accuracy)}: expected a structure condensed for "
            f"harmonics={sets.harmonics(sets.larger(0))} at least, by which errors of "
            f"{problem.harmonics} are estimated, got {problem.model.harmonics}; condense it for "
            "them"
        )
    if problem.samples is not None:
        raise ValueError(
            f"accuracy={check.shown(accuracy)}: expected None for friction over samples, "
            f"samples={problem.samples}"
        )
    return value


def advice(problem: HarmonicBalance, error: float, accuracy: float) -> str:
    """What to condense a structure for where an error is larger than an accuracy, else empty."""
    if problem.model.harmonics is None:
        return ""
    sets = HarmonicSets(problem)
    # Errors fall with the cube of the highest harmonic.
    factor = (error / accuracy) ** (1 / 3) if np.isfinite(error) else _LARGER
    needed = sets.level(int(np.ceil(factor * sets.highest(0))))
    harmonics = sets.harmonics(sets.larger(needed))
    return f" (or condense the structure for more harmonics, about harmonics={harmonics})"


class HarmonicSets:
    """Nested sets of harmonics by level.

    Level 0 has all harmonics of the kind of those of ``problem`` up to its highest: all multiples
    of their common divisor, or the odd ones. A condensed structure has no others than those that
    it was condensed for.
    """

    def __init__(self, problem: HarmonicBalance):
        self._first = harmonics = problem.harmonics
        self._divisor = int(np.gcd.reduce(harmonics))
        self._step = self._divisor * (2 if 0 not in complete_harmonics(harmonics, 1) else 1)
        self._highest = [max(harmonics)]
        self._known = problem.model.harmonics

    def harmonics(self, level: int) -> tuple[int, ...]:
        """The harmonics of a level."""
        return complete_harmonics(self._first, self.highest(level))

    def highest(self, level: int) -> int:
        """The highest harmonic of a level."""
        while len(self._highest) <= level:
            last = self._highest[-1]
            steps = max(1, round((_GROWTH - 1) * last / self._step))
            self._highest.append(last + steps * self._step)
        return self._highest[level]

    def level(self, harmonic: int) -> int:
        """The lowest level that has a harmonic."""
        level = 0
        while self.highest(level) < harmonic:
            level += 1
        return level

    def larger(self, level: int) -> int:
        """The level whose set estimates the truncation error of a level."""
        return self.level(_LARGER * self.highest(level) + 3 * self._divisor)

    @property
    def last(self) -> int:
        """The highest level to be used, -1 where the errors of none can be estimated."""
        last = max(0, self.level(HIGHEST * self._divisor + 1) - 1)
        while self._known is not None and last >= 0:
            if {*self.harmonics(self.larger(last))} <= {*self._known}:
                break
            last -= 1
        return last

    def expected(self, level: int, error: float, share: FloatArray, accuracy: float) -> int:
        """The lowest level whose error is expected to be within ``accuracy``.

        ``error`` is that of ``level``, ``share`` the change by each harmonic of its larger set.
        """
        if error <= accuracy:
            return level
        harmonics = np.array(self.harmonics(self.larger(level)))
        highest_estimated = harmonics.max()
        missing = share[harmonics > self.highest(level)].sum() if len(share) else 0.0
        if not np.isfinite(error) or not missing:
            return min(level + 1, self.last)
        for higher in range(level + 1, self.last):
            # Beyond the larger set, errors fall with the cube of the highest harmonic.
            rest = (self.highest(level) / max(highest_estimated, self.highest(higher))) ** 3
            rest += share[harmonics > self.highest(higher)].sum() / missing
            if error * rest <= accuracy:
                return higher
        return self.last
