"""Nested sets of harmonics of one structure, as an accuracy asks for them."""

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.numerics import FloatArray, check, complete_harmonics

HIGHEST = 55
"""Harmonic, in units of the lowest, beyond which sets do not grow: errors fall with its cube."""
_GROWTH = 1.3
_LARGER = 2
"""The larger set has so many times the highest harmonic; an eighth of the error is beyond it."""


def check_accuracy(problem: HarmonicBalance, accuracy: float | None) -> float | None:
    """An accuracy as a number, None for none.

    Raises ValueError or TypeError unless it is between 0 and 1, and for sampled friction, whose
    error does not vanish with the harmonics.
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
    if not problem.model.has_matrices:
        raise ValueError(
            f"accuracy={check.shown(accuracy)}: expected None for a condensed structure, which has "
            "the harmonics it was condensed for; compare results of two sets of them"
        )
    if problem.samples is not None:
        raise ValueError(
            f"accuracy={check.shown(accuracy)}: expected None for friction over samples, "
            f"samples={problem.samples}"
        )
    return value


class HarmonicSets:
    """Sets of more and more harmonics, by number.

    The first has all harmonics of the kind of those of ``problem``, up to its highest.
    """

    def __init__(self, problem: HarmonicBalance):
        self._first = harmonics = problem.harmonics
        self._divisor = int(np.gcd.reduce(harmonics))
        self._step = self._divisor * (2 if 0 not in complete_harmonics(harmonics, 1) else 1)
        self._tops = [max(harmonics)]

    def harmonics(self, level: int) -> tuple[int, ...]:
        """The harmonics of a set."""
        return complete_harmonics(self._first, self.top(level))

    def top(self, level: int) -> int:
        """The highest harmonic of a set."""
        while len(self._tops) <= level:
            last = self._tops[-1]
            steps = max(1, round((_GROWTH - 1) * last / self._step))
            self._tops.append(last + steps * self._step)
        return self._tops[level]

    def level(self, harmonic: int) -> int:
        """The smallest set that holds a harmonic, the last one beyond."""
        level = 0
        while self.top(level) < harmonic:
            level += 1
        return level

    def larger(self, level: int) -> int:
        """The set that judges another."""
        return self.level(_LARGER * self.top(level) + 3 * self._divisor)

    @property
    def last(self) -> int:
        """The largest set to be used."""
        return max(0, self.level(HIGHEST * self._divisor + 1) - 1)

    def expected(self, level: int, error: float, share: FloatArray, accuracy: float) -> int:
        """The smallest set that is expected to make no larger error than ``accuracy``.

        ``error`` is that of one set, ``share`` what each harmonic of its larger one adds.
        """
        if error <= accuracy:
            return level
        harmonics = np.array(self.harmonics(self.larger(level)))
        judge = harmonics.max()
        missing = share[harmonics > self.top(level)].sum() if len(share) else 0.0
        if not np.isfinite(error) or not missing:
            return min(level + 1, self.last)
        for higher in range(level + 1, self.last):
            # Beyond the larger set, errors fall with the cube of the highest harmonic.
            rest = (self.top(level) / max(judge, self.top(higher))) ** 3
            rest += share[harmonics > self.top(higher)].sum() / missing
            if error * rest <= accuracy:
                return higher
        return self.last
