"""What a design makes small, and within what: aims, statistics of responses, constraints.

An aim is a function of named peaks and of the design. A statistic is of the largest responses of
several cases: its epigraph has a height ``t`` for each response, no less than any of its maxima,
and an amplitude that is the statistic where the heights are as low as that allows. Constraints are
functions of the variables between limits, with exact derivatives.
"""

from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
import scipy
from numpy.typing import NDArray

from symhbm.design import tolerances
from symhbm.numerics import FloatArray


@dataclass(frozen=True)
class Aim:
    """One aim; designs compare by ``(log(aim) - offset) / scale``.

    ``logarithm`` is a CasADi function of the logarithms of the named peaks (n_peaks,) and of the
    design variables (n_variables,), which are logarithms, too; ``name`` and those of the ``peaks``
    are for messages. ``is_peak`` tells that it is the one peak there is, and nothing else.
    """

    name: str
    logarithm: ca.Function = field(compare=False)
    peaks: tuple[str, ...] = ("largest",)
    offset: float = 0.0
    scale: float = 1.0
    is_peak: bool = False

    @classmethod
    def of_peak(cls, n_variables: int) -> "Aim":
        """The peak itself, of one name."""
        peak, x = ca.SX.sym("peak"), ca.SX.sym("x", n_variables)
        function = ca.Function("aim", [peak, x], [peak])
        return cls("the largest response", function, is_peak=True)

    def __call__(self, peaks: Any, x: Any) -> Any:
        """The expression that designs compare by."""
        return (self.logarithm(peaks, x) - self.offset) / self.scale

    @cached_property
    def uses(self) -> NDArray[np.bool_]:
        """Which of the named peaks it depends on, (n_peaks,)."""
        return np.array(self._depends(0))

    @cached_property
    def by_design(self) -> bool:
        """Whether it depends on the design by itself, besides through the peaks."""
        return any(self._depends(1))

    def _depends(self, number: int) -> list[bool]:
        inputs = self.logarithm.sx_in()
        return ca.which_depends(self.logarithm(*inputs), inputs[number], 1, False)

    @cached_property
    def _with_slopes(self) -> ca.Function:
        inputs = self.logarithm.sx_in()
        value = self.logarithm(*inputs)
        return ca.Function("slopes", inputs, [value, ca.gradient(value, inputs[0])])

    def value(self, peaks: FloatArray, x: FloatArray) -> float:
        """The logarithm at a design; infinite where a peak that it uses is.

        Raises ValueError where it is no positive number, or falls while a peak rises.
        """
        if not np.all(np.isfinite(peaks[self.uses])):
            return np.inf
        known = np.where(self.uses, peaks, 0.0)
        value, slopes = (np.asarray(out.full()).ravel() for out in self._with_slopes(known, x))
        amplitudes = zip(self.peaks, np.exp(known), self.uses, strict=True)
        at = [f"{name} = {amplitude:.6g} m" for name, amplitude, used in amplitudes if used]
        design = ", ".join(f"{number:.6g}" for number in np.exp(x))
        where = f"at the values {design}{' with ' if at else ''}{', '.join(at)}"
        if not np.isfinite(value[0]):
            raise ValueError(
                f"{self.name}: expected a positive number, got {self._number(known, x):g} {where}"
            )
        if np.any(slopes < -1e-9):
            raise ValueError(
                f"{self.name}: expected an expression that falls with no peak that rises; it falls "
                f"with {self.peaks[int(np.argmin(slopes))]!r} {where}"
            )
        return float(value[0])

    def _number(self, peaks: FloatArray, x: FloatArray) -> float:
        """The aim itself where it has no logarithm."""
        inputs = self.logarithm.sx_in()
        logarithm = self.logarithm(*inputs)
        number = logarithm.dep(0) if logarithm.op() == ca.OP_LOG else ca.exp(logarithm)
        return float(ca.Function("number", inputs, [number])(peaks, x))

    def relative(self, peaks: FloatArray, x: FloatArray) -> float:
        """What designs compare by, a number."""
        return (self.value(peaks, x) - self.offset) / self.scale

    def merged(self, index: NDArray[np.intp], n_variables: int) -> "Aim":
        """The same of fewer variables, where variable ``j`` here is ``index[j]`` of those."""
        peaks, x = self.logarithm.sx_in()[0], ca.SX.sym("x", n_variables)
        merged = self.logarithm(peaks, x[index.tolist()])
        return replace(self, logarithm=ca.Function("aim", [peaks, x], [merged]))


@dataclass(frozen=True)
class Limits:
    """Rows ``low <= function(x) <= high`` of the logarithms ``x`` of the variables.

    ``names`` (n_rows,) tells where each is from; ``matrix`` (n_rows, n_variables) are rows that are
    linear in the values, NaN of others; ``others`` are parameters they depend on that are not
    designed.
    """

    function: ca.Function = field(compare=False)
    low: FloatArray
    high: FloatArray
    names: tuple[str, ...]
    matrix: FloatArray
    others: frozenset[str] = frozenset()

    @classmethod
    def none(cls, n_variables: int) -> "Limits":
        """No constraint."""
        x = ca.SX.sym("x", n_variables)
        function = ca.Function("limits", [x], [ca.SX(0, 1)])
        return cls(function, np.zeros(0), np.zeros(0), (), np.zeros((0, n_variables)))

    @classmethod
    def of_aim(cls, aim: Aim, most: float, n_variables: int) -> "Limits":
        """An aim that no peak is part of, whose logarithm is ``most`` at the most."""
        x, peaks = ca.SX.sym("x", n_variables), ca.SX(len(aim.peaks), 1)
        function = ca.Function("limits", [x], [aim.logarithm(peaks, x)])
        low, high = np.array([-np.inf]), np.array([most])
        return cls(function, low, high, (aim.name,), np.full((1, n_variables), np.nan))

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return len(self.names)

    def __call__(self, x: Any) -> Any:
        """The expressions of all rows, (n_rows,)."""
        return self.function(x)

    def joined(self, other: "Limits") -> "Limits":
        """The rows of both."""
        x = self.function.sx_in()[0]
        return Limits(
            ca.Function("limits", [x], [ca.vertcat(self(x), other(x))]),
            np.append(self.low, other.low),
            np.append(self.high, other.high),
            (*self.names, *other.names),
            np.vstack([self.matrix, other.matrix]),
            self.others | other.others,
        )

    def merged(self, index: NDArray[np.intp], n_variables: int) -> "Limits":
        """The same of fewer variables, where variable ``j`` here is ``index[j]`` of those."""
        x = ca.SX.sym("x", n_variables)
        function = ca.Function("limits", [x], [self(x[index.tolist()])])
        return replace(self, function=function, matrix=self.matrix @ np.eye(n_variables)[index])

    def contradiction(self, lower: FloatArray, upper: FloatArray) -> str:
        """Names of linear rows that no values in the bounds satisfy together, "" for none found."""
        linear = np.flatnonzero(np.isfinite(self.matrix).all(axis=1))
        # The fewest rows that contradict each other tell most.
        for chosen in [*([row] for row in linear), linear]:
            rows, low, high = self.matrix[chosen], self.low[chosen], self.high[chosen]
            above, below = np.isfinite(high), np.isfinite(low)
            found = scipy.optimize.linprog(
                np.zeros(len(lower)),
                A_ub=np.vstack([rows[above], -rows[below]]),
                b_ub=np.concatenate([high[above], -low[below]]),
                bounds=np.column_stack([lower, upper]),
            )
            if found.status == 2:
                return " and ".join(dict.fromkeys(self.names[row] for row in chosen))
        return ""

    def holds(self, x: FloatArray) -> bool:
        """Whether a design satisfies all rows, to round-off of the solver."""
        values = np.asarray(self.function(x).full(), dtype=float).ravel()
        beyond = np.maximum(self.low - values, values - self.high)
        return bool(np.all(beyond <= tolerances.VIOLATION))


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
