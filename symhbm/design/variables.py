"""Design variables: logarithms of groups of parameter values, with bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.numerics import FloatArray


@dataclass(frozen=True)
class Group:
    """Values of one parameter that are one variable: ``entries`` of its array, with bounds."""

    parameter: str
    label: str
    entries: tuple[int, ...]
    lower: float
    upper: float


@dataclass(frozen=True)
class DesignVariables:
    """Design variables ``x``, the logarithms of positive values, each set for a group of entries.

    ``ratios`` has, for each parameter, the factors (n_entries,) between its entries and the
    variable: 1, or how the entries of a sample differ from the nominal ones.
    """

    groups: tuple[Group, ...]
    ratios: dict[str, FloatArray]

    @property
    def n_variables(self) -> int:
        """Number of variables."""
        return len(self.groups)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that are designed."""
        return tuple(dict.fromkeys(group.parameter for group in self.groups))

    @cached_property
    def lower(self) -> FloatArray:
        """Lower bounds of ``x``, (n_variables,)."""
        return np.log([group.lower for group in self.groups])

    @cached_property
    def upper(self) -> FloatArray:
        """Upper bounds of ``x``, (n_variables,)."""
        return np.log([group.upper for group in self.groups])

    def values(self, x: FloatArray) -> FloatArray:
        """Values of the variables, within their bounds to the last digit, (n_variables,)."""
        bounds = np.array([[group.lower, group.upper] for group in self.groups])
        return np.clip(np.exp(x), bounds[:, 0], bounds[:, 1])

    def parameters(self, problem: HarmonicBalance, x: FloatArray) -> dict[str, FloatArray]:
        """Parameters of a problem at ``x``; entries of no group keep their values."""
        result = {name: np.array(problem.parameters[name], dtype=float) for name in self.names}
        for group, value in zip(self.groups, self.values(x), strict=True):
            entries = list(group.entries)
            result[group.parameter].flat[entries] = value * self.ratios[group.parameter][entries]
        return result

    def problem(self, problem: HarmonicBalance, x: FloatArray) -> HarmonicBalance:
        """The problem at ``x``."""
        return problem.with_parameters(**self.parameters(problem, x))

    def proportional(
        self, problem: HarmonicBalance, chosen: dict[str, FloatArray]
    ) -> "DesignVariables":
        """The variables of a parameter set whose designed values keep their nominal proportions."""
        ratios = dict(self.ratios)
        for name in self.names:
            if name in chosen:
                nominal = np.asarray(problem.parameters[name], dtype=float)
                ratios[name] = np.broadcast_to(chosen[name] / nominal, ratios[name].shape)
        return DesignVariables(self.groups, ratios)

    def common(self) -> "DesignVariables":
        """The variables of designs in which all values of one parameter are one variable."""
        groups = []
        for name in self.names:
            same = [group for group in self.groups if group.parameter == name]
            entries = tuple(sorted(entry for group in same for entry in group.entries))
            lower, upper = max(g.lower for g in same), min(g.upper for g in same)
            groups.append(Group(name, name, entries, lower, upper))
        return DesignVariables(tuple(groups), self.ratios)

    @cached_property
    def apart(self) -> FloatArray:
        """A design of which no two variables are alike, (n_variables,)."""
        share = 0.3 + 0.4 * np.arange(self.n_variables) / max(self.n_variables, 2)
        return self.lower + (self.upper - self.lower) * share

    def derivative(self, problem: HarmonicBalance, slices: dict[str, slice]) -> FloatArray:
        """Derivative of the balanced parameters by ``x``, (n_parameters, n_variables).

        ``slices`` are the ``places`` of a `SecondOrder`. It is the second derivative as well.
        """
        first = min(target.start for target in slices.values())
        size = max(target.stop for target in slices.values()) - first
        result = np.zeros((size, self.n_variables))
        for number, group in enumerate(self.groups):
            values = np.asarray(problem.parameters[group.parameter], dtype=float)
            chosen, entries = np.zeros(values.shape), list(group.entries)
            chosen.flat[entries] = values.flat[entries]
            target = slices[group.parameter]
            balanced = np.atleast_1d(problem.own(group.parameter, chosen))
            result[target.start - first : target.stop - first, number] = balanced
        return result


def groups_of(
    name: str, pattern: Sequence[int] | str, n_entries: int, lower: float, upper: float
) -> list[Group]:
    """Groups of one parameter: ``"common"``, ``"each"``, or a pattern of numbers that repeats."""
    if isinstance(pattern, str):
        numbers = np.zeros(n_entries, int) if pattern == "common" else np.arange(n_entries)
    else:
        numbers = np.resize(np.asarray(pattern, dtype=int), n_entries)
    return [
        Group(
            name,
            name if np.ptp(numbers) == 0 else f"{name}[{number}]",
            tuple(np.flatnonzero(numbers == number).tolist()),
            lower,
            upper,
        )
        for number in np.unique(numbers)
    ]
