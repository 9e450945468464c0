"""Variables of a design, checked, and parameters as CasADi expressions of the design."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
import scipy

from symhbm.balance import HarmonicBalance
from symhbm.design.variables import DesignVariables, Group, groups_of
from symhbm.numerics import FloatArray, check


class Named(dict[str, Any]):
    """Expressions by name; KeyError lists the names there are."""

    def __init__(self, entries: Mapping[str, Any], what: str):
        super().__init__(entries)
        self._what = what

    def __missing__(self, name: str) -> Any:
        check.known(name, self, self._what)


@dataclass(frozen=True)
class DesignSymbols:
    """The ``values`` (n_variables,) of the variables and all ``parameters`` by name, as symbols.

    Parameters that are designed are expressions of the values; all others are symbols of their own,
    which `numbers` replaces, so that it is known which of them an expression uses. ``x`` are the
    logarithms of the values.
    """

    x: Any
    values: Any
    parameters: Named
    _others: Mapping[str, tuple[Any, FloatArray]]

    @classmethod
    def of(cls, problem: HarmonicBalance, variables: DesignVariables) -> "DesignSymbols":
        """The symbols of a problem whose ``variables`` are designed."""
        values = ca.SX.sym("values", variables.n_variables)
        others: dict[str, tuple[Any, FloatArray]] = {}
        entries = {}
        for name, nominal in problem.parameters.items():
            column = np.atleast_1d(np.asarray(nominal, dtype=float))
            if name in variables.names:
                expression = ca.SX(column)
                for number, group in enumerate(variables.groups):
                    if group.parameter == name:
                        expression[list(group.entries)] = values[number]
            else:
                expression = ca.SX.sym(name, column.size)
                others[name] = expression, column
            entries[name] = expression
        x = ca.SX.sym("x", variables.n_variables)
        return cls(x, values, Named(entries, "parameter of the problem"), others)

    def by_logarithms(self, expression: Any) -> Any:
        """An expression of the values as one of their logarithms ``x``."""
        return ca.substitute(expression, self.values, ca.exp(self.x))

    def numbers(self, expression: Any) -> tuple[Any, frozenset[str]]:
        """An expression with the numbers of parameters that are not designed, and their names."""
        used = set()
        for name, (symbol, values) in self._others.items():
            if any(ca.which_depends(expression, symbol, 1, True)):
                expression = ca.substitute(expression, symbol, ca.DM(values))
                used.add(name)
        return expression, frozenset(used)


def called(name: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function of the user returns for symbols; errors in it name the argument."""
    try:
        return function(*arguments)
    except KeyError as error:
        raise KeyError(f"{name}: {error.args[0]}") from None
    except Exception as error:
        words = " ".join(str(error).split())[:120]
        raise TypeError(
            f"{name}: expected a function that CasADi's symbols go through, as arithmetic and the "
            f"functions of casadi do, it raised {type(error).__name__}: {words}"
        ) from None


def column_of(name: str, value: Any) -> Any:
    """A column of CasADi from an expression or several; TypeError for anything else."""
    several = list(np.ravel(value)) if isinstance(value, np.ndarray) else value
    several = list(several) if isinstance(several, (list, tuple)) else [several]
    if not several or not all(isinstance(one, ca.SX) for one in several):
        numbers = bool(several) and all(isinstance(one, (int, float, ca.DM)) for one in several)
        words = ", a number that no design changes" if numbers else ""
        raise TypeError(
            f"{name}: expected an expression of CasADi's symbols that were given, "
            f"got {check.shown(value)}{words}"
        )
    return ca.vertcat(*(ca.vec(one) for one in several))


def without_symbols_of_its_own(name: str, expression: Any, *symbols: Any) -> None:
    """Raise ValueError for an expression of other symbols than those given."""
    known = {str(symbol) for given in symbols for symbol in ca.symvar(ca.vec(given))}
    unknown = [str(s) for s in ca.symvar(expression) if str(s) not in known]
    if unknown:
        raise ValueError(
            f"{name}: expected an expression of the symbols that were given, it has "
            f"{', '.join(unknown[:3])} of its own"
        )


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
        pattern = read_pattern(_entry_of("vary", vary, said, 1), n_entries)
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


def read_pattern(value: Any, n_entries: int) -> Any:
    """Which values of a parameter are one variable; ValueError for what does not tell it."""
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
