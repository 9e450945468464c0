"""Constraints on designs: functions of the variables between limits, with exact derivatives."""

from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca
import numpy as np
import scipy
from numpy.typing import NDArray

from symhbm.design import tolerances
from symhbm.design.program.aim import Aim
from symhbm.numerics import FloatArray


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

    def values(self, x: FloatArray) -> FloatArray:
        """The values of all rows at a design, (n_rows,)."""
        return np.asarray(self.function(x).full(), dtype=float).ravel()

    def violation(self, x: FloatArray) -> float:
        """How far a design is beyond a limit, 0 where it satisfies all; NaN counts as infinite."""
        values = self.values(x)
        beyond = np.maximum(self.low - values, values - self.high)
        return float(np.where(np.isnan(beyond), np.inf, beyond).max(initial=0.0))

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
        spread = ca.vertcat(*(x[int(j)] for j in index))
        matrix = np.zeros((self.n_rows, n_variables))
        for j, target in enumerate(index):
            matrix[:, target] += self.matrix[:, j]
        function = ca.Function("limits", [x], [self(spread)])
        return replace(self, function=function, matrix=matrix)

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
        return self.violation(x) <= tolerances.VIOLATION
