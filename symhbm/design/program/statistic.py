"""Statistics of the largest responses of several cases, and their epigraphs.

An epigraph has a height ``t`` for each response, no less than any of its maxima, and an amplitude
that is the statistic where the heights are as low as that allows.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import casadi as ca
import numpy as np

from symhbm.design import tolerances
from symhbm.numerics import FloatArray


class Statistic(StrEnum):
    """Statistic of the largest responses of several cases that is minimised."""

    WORST = "worst"
    MEAN = "mean"
    TAIL = "tail"


@dataclass(frozen=True)
class Epigraph:
    """Symbols of one statistic, where they begin, and rows that are to be 0 at the most.

    ``heights`` (n_cases,) are logarithms over the largest height, the ``logarithm`` is that of the
    statistic over the same.
    """

    symbols: Any
    start: FloatArray
    heights: list[Any]
    logarithm: Any
    rows: list[Any]

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return sum(row.shape[0] for row in self.rows)


@dataclass(frozen=True)
class CaseStatistic:
    """One statistic; ``tail`` is the share of the worst cases that `Statistic.TAIL` averages."""

    kind: Statistic = Statistic.WORST
    tail: float = 0.1

    def value(self, heights: FloatArray) -> float:
        """Logarithm of the statistic of amplitudes whose logarithms are ``heights`` (n_cases,)."""
        top = float(np.max(heights))
        if not np.isfinite(top) or self.kind == Statistic.WORST:
            return top
        return top + float(np.log(self.weights(heights) @ np.exp(heights - top)))

    def weights(self, heights: FloatArray) -> FloatArray:
        """Share of each case in the statistic of amplitudes, (n_cases,)."""
        n_cases = len(heights)
        if self.kind == Statistic.MEAN:
            return np.full(n_cases, 1 / n_cases)
        share = 1 / n_cases if self.kind == Statistic.WORST else self.tail
        # The worst cases have each 1 / (share n), until the shares are used up.
        order = np.argsort(-heights)
        left = 1 - np.arange(n_cases) / (share * n_cases)
        result = np.zeros(n_cases)
        result[order] = np.clip(left, 0, 1 / (share * n_cases))
        return result

    def tied(self, heights: FloatArray) -> list[int]:
        """Cases that are equally high at the lower end of the statistic, where it has a kink."""
        if self.kind == Statistic.MEAN:
            return []
        lowest = heights[self.weights(heights) > 0].min()
        return np.flatnonzero(np.abs(heights - lowest) <= tolerances.TIE).tolist()

    def epigraph(self, heights: FloatArray) -> Epigraph:
        """The epigraph, begun at finite ``heights`` (n_cases,)."""
        n_cases, above = len(heights), heights - heights.max()
        if self.kind == Statistic.WORST:
            t = ca.SX.sym("t")
            return Epigraph(t, np.zeros(1), [t] * n_cases, t, [])
        t = ca.SX.sym("t", n_cases)
        each = ca.vertsplit(t)
        if self.kind == Statistic.MEAN:
            return Epigraph(t, above, each, ca.log(ca.sum1(ca.exp(t)) / n_cases), [])
        quantile, beyond = ca.SX.sym("q"), ca.SX.sym("b", n_cases)
        amplitudes = np.exp(above)
        middle = np.quantile(amplitudes, 1 - self.tail)
        # Where the tail holds all cases, the quantile has no other lower bound.
        rows = [ca.exp(t) - quantile - beyond, -beyond, -quantile]
        start = np.concatenate([above, [middle], np.maximum(amplitudes - middle, 0)])
        statistic = quantile + ca.sum1(beyond) / (self.tail * n_cases)
        return Epigraph(ca.vertcat(t, quantile, beyond), start, each, ca.log(statistic), rows)
