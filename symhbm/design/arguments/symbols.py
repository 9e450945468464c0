"""Parameters as CasADi expressions of the design, and what functions of the user make of them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.design.variables import DesignVariables
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
                        for entry in group.entries:
                            expression[entry] = values[number]
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
        names = [
            name
            for name, (symbol, _) in self._others.items()
            if any(ca.which_depends(expression, symbol, 1, True))
        ]
        symbols = [self._others[name][0] for name in names]
        values = [ca.DM(self._others[name][1]) for name in names]
        if names:
            (expression,) = ca.substitute([expression], symbols, values)
        return expression, frozenset(names)


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
