"""Variables of a design, checked: which parameters, between which bounds, from where."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy

from symhbm.balance import HarmonicBalance
from symhbm.design.variables import DesignVariables, Group, groups_of
from symhbm.numerics import FloatArray, check

_FORMS = "'common', 'each', or a sequence of numbers that repeats, for example [0, 1]"
_ANY = 1.0, 2.0
"""Bounds of groups before those of an array are read."""


def read_variables(
    problem: HarmonicBalance, parameters: Any, bounds: Any, vary: Any
) -> DesignVariables:
    """The design variables; raises KeyError, TypeError or ValueError for bad arguments."""
    names = [parameters] if isinstance(parameters, str) else parameters
    if not isinstance(names, Sequence) or not names or len(set(names)) != len(names):
        raise TypeError(
            f"parameters={check.shown(parameters)}: expected a name or several different ones"
        )
    for argument, value in (("bounds", bounds), ("vary", vary)):
        unused = [name for name in value if name not in names] if isinstance(value, Mapping) else []
        if unused:
            raise ValueError(
                f"{argument}={check.shown(value)}: expected entries for "
                f"{', '.join(map(str, names))} alone, {unused[0]!r} is not designed"
            )
    allowed = [name for name in problem.parameters if problem.model.about(name).designed]
    groups: list[Group] = []
    given, names = names, [_designed(problem, name, allowed) for name in names]
    for said, name in zip(given, names, strict=True):
        where = "bounds" if len(names) == 1 else f"bounds[{said!r}]"
        lower, upper = _ANY
        if not isinstance(bounds, scipy.optimize.Bounds):
            lower, upper = _pair(where, _entry_of("bounds", bounds, said, len(names)))
        n_entries = np.size(problem.parameters[name])
        if not n_entries:
            raise ValueError(f"parameters={name!r}: expected contacts, the structure has none")
        pattern = _pattern(_entry_of("vary", vary, said, 1), n_entries)
        groups += groups_of(name, pattern, n_entries, lower, upper)
    if isinstance(bounds, scipy.optimize.Bounds):
        groups = _within(groups, bounds)
    ratios = {name: np.ones(np.size(problem.parameters[name])) for name in names}
    return DesignVariables(tuple(groups), ratios)


def read_start(variables: DesignVariables, start: Any) -> FloatArray | None:
    """Logarithms of the design to start from, None for none."""
    if start is None:
        return None
    values = check.array("start", start, "positive")
    if values.ndim > 1 or (values.ndim == 1 and len(values) != variables.n_variables):
        raise ValueError(
            f"start={check.shown(start)}: expected one value, or one for each of the "
            f"{variables.n_variables} variables, got shape {values.shape}"
        )
    return np.log(np.broadcast_to(values, variables.n_variables))


def _designed(problem: HarmonicBalance, name: str, allowed: list[str]) -> str:
    """The name in the problem of a parameter that designs may vary; raises KeyError."""
    what = "parameter that can be designed"
    if name in problem.parameters and name not in allowed:
        what += ", as its record does not say designed=True"
    return problem.parameter_name(name, allowed, what)


def _entry_of(argument: str, value: Any, name: str, n_names: int) -> Any:
    """The entry of an argument for one parameter."""
    if isinstance(value, Mapping):
        if name not in value:
            raise ValueError(f"{argument}={check.shown(value)}: expected an entry for {name!r}")
        return value[name]
    if n_names > 1:
        raise TypeError(
            f"{argument}={check.shown(value)}: expected a mapping with an entry for each parameter"
            f"{', or scipy.optimize.Bounds' if argument == 'bounds' else ''}"
        )
    return value


def _pair(where: str, value: Any) -> tuple[float, float]:
    edges = check.array(where, value, "positive")
    if edges.shape != (2,) or edges[0] >= edges[1]:
        raise ValueError(f"{where}={check.shown(value)}: expected two values, lower < upper")
    return float(edges[0]), float(edges[1])


def _within(groups: list[Group], bounds: Any) -> list[Group]:
    """The groups within bounds of SciPy, one of each or for all."""
    ends = []
    for name in ("lb", "ub"):
        values = check.array(f"bounds.{name}", getattr(bounds, name), "positive")
        if values.size not in (1, len(groups)):
            raise ValueError(
                f"bounds.{name}={check.shown(getattr(bounds, name))}: expected one value, or one "
                f"for each of the {len(groups)} variables "
                f"{', '.join(group.label for group in groups)}"
            )
        ends.append(np.broadcast_to(np.ravel(values), len(groups)).tolist())
    result = []
    for group, lower, upper in zip(groups, *ends, strict=True):
        if lower >= upper:
            raise ValueError(
                f"bounds: expected lower < upper for {group.label}, got {lower:g} and {upper:g}"
            )
        result.append(replace(group, lower=lower, upper=upper))
    return result


def _pattern(value: Any, n_entries: int) -> Any:
    if isinstance(value, str):
        if value not in ("common", "each"):
            raise ValueError(f"vary={check.shown(value)}: expected {_FORMS}")
        return value
    numbers = check.array("vary", value)
    if numbers.ndim != 1 or not 0 < len(numbers) <= n_entries or np.any(numbers % 1):
        raise ValueError(
            f"vary={check.shown(value)}: expected {_FORMS}, no longer than the {n_entries} values "
            "of the parameter"
        )
    return numbers.astype(int)
