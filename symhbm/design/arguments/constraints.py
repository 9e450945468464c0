"""Constraints on a design, checked: those of SciPy, and relations of parameters."""

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
import scipy

from symhbm.balance import HarmonicBalance
from symhbm.design.arguments.designed import (
    DesignSymbols,
    called,
    column_of,
    without_symbols_of_its_own,
)
from symhbm.design.program import Limits
from symhbm.design.variables import DesignVariables
from symhbm.numerics import FloatArray, check, full

_KINDS = (
    "a scipy.optimize.LinearConstraint or NonlinearConstraint on the values of the variables, or a "
    "function of the parameters that returns relations, or several of these"
)
_RELATIONS = (ca.OP_LE, ca.OP_LT, ca.OP_EQ)
_JACOBIAN = 1e-6
"""Largest relative difference of a Jacobian that is given from that of the function itself."""


def read_limits(problem: HarmonicBalance, variables: DesignVariables, constraint: Any) -> Limits:
    """The constraints on the variables, each row of size 1 at the most.

    Raises TypeError or ValueError for bad ones, and for some that no values in the bounds satisfy.
    """
    result = Limits.none(variables.n_variables)
    if constraint is None:
        return result
    several = isinstance(constraint, Sequence) and not isinstance(constraint, str)
    for number, one in enumerate(constraint if several else [constraint]):
        name = f"constraint[{number}]" if several else "constraint"
        result = result.joined(_limits_of(name, problem, variables, one))
    names = result.contradiction(np.exp(variables.lower), np.exp(variables.upper))
    if names:
        raise ValueError(
            f"{names}: expected limits that some values within the bounds satisfy, no values from "
            f"{check.brief(np.exp(variables.lower).round(9))} to "
            f"{check.brief(np.exp(variables.upper).round(9))} do"
        )
    return result


def _limits_of(
    name: str, problem: HarmonicBalance, variables: DesignVariables, constraint: Any
) -> Limits:
    symbols = DesignSymbols.of(problem, variables)
    values = symbols.values
    others: frozenset[str] = frozenset()
    if isinstance(constraint, scipy.optimize.LinearConstraint):
        rows = _linear_rows(name, variables, constraint, values)
        low, high = _ends(name, constraint, rows.shape[0])
    elif isinstance(constraint, scipy.optimize.NonlinearConstraint):
        rows = _nonlinear_rows(name, variables, constraint, values)
        low, high = _ends(name, constraint, rows.shape[0])
    elif callable(constraint):
        given = getattr(constraint, "__name__", "")
        name = name if given in ("", "<lambda>") else f"{name} ({given})"
        rows, low, high, others = _relations(name, symbols, constraint)
    else:
        raise TypeError(f"{name}={check.shown(constraint)}: expected {_KINDS}")
    if np.any(low > high):
        row = int(np.argmax(low > high))
        raise ValueError(
            f"{name}: expected lower limits no larger than upper ones, row {row} has "
            f"{low[row]:g} and {high[row]:g}"
        )
    return _scaled(name, variables, symbols, rows, low, high, others)


def _scaled(
    name: str,
    variables: DesignVariables,
    symbols: DesignSymbols,
    rows: Any,
    low: FloatArray,
    high: FloatArray,
    others: frozenset[str],
) -> Limits:
    """Rows over their sizes; those that are linear in the values without their constants."""
    upper, values = np.exp(variables.upper), symbols.values
    bends = np.array(ca.which_depends(rows, values, 2, True))
    numbers = ca.Function("rows", [values], [rows, ca.jacobian(rows, values)])
    middle = np.exp((variables.lower + variables.upper) / 2)
    known = [numbers(at) for at in (middle, np.exp(variables.lower), upper)]
    at = np.array([np.asarray(found[0].full()).ravel() for found in known])
    if not np.all(np.isfinite(at)):
        row = int(np.argmin(np.isfinite(at).all(axis=0)))
        raise ValueError(
            f"{name}: expected finite numbers within the bounds, row {row} has "
            f"{check.shown(at[:, row].tolist())} in their middle and at both ends"
        )
    slopes = np.asarray(known[0][1].full(), dtype=float)
    matrix = np.where(bends[:, None], np.nan, slopes)
    moves = np.array(ca.which_depends(rows, values, 1, True)) & (bends | slopes.any(axis=1))
    if not moves.all():
        raise ValueError(
            f"{name}: expected rows with an entry other than 0, row {int(np.argmin(moves))} "
            "has none"
        )
    constant = np.where(bends, 0.0, at[0] - np.where(bends[:, None], 0.0, slopes) @ middle)
    low, high = low - constant, high - constant
    limits = np.abs(np.where(np.isfinite([low, high]), [low, high], 0.0)).max(axis=0)
    largest = np.maximum(np.abs(at).max(axis=0), limits)
    size = np.where(bends, np.maximum(largest, 1e-300), np.abs(matrix) @ upper)
    sized = (symbols.by_logarithms(rows) - ca.DM(constant)) / ca.DM(size)
    function = ca.Function("limits", [symbols.x], [sized])
    names = (name,) * len(size)
    return Limits(function, low / size, high / size, names, matrix / size[:, None], others)


def _linear_rows(name: str, variables: DesignVariables, constraint: Any, values: Any) -> Any:
    matrix = np.atleast_2d(full(constraint.A)).astype(float)
    if matrix.shape[1] != variables.n_variables or not np.all(np.isfinite(matrix)):
        raise ValueError(
            f"{name}: expected a finite matrix with {variables.n_variables} columns, one for "
            f"each variable, got shape {matrix.shape}"
        )
    return ca.mtimes(ca.DM(matrix), values)


def _nonlinear_rows(name: str, variables: DesignVariables, constraint: Any, values: Any) -> Any:
    """The function of a constraint of SciPy, by symbols in an array of NumPy or a column."""
    entries = np.array(ca.vertsplit(values), dtype=object)
    try:
        rows = column_of(f"{name}.fun", constraint.fun(entries))
    except Exception:
        rows = column_of(f"{name}.fun", called(f"{name}.fun", constraint.fun, values))
    without_symbols_of_its_own(f"{name}.fun", rows, values)
    if callable(constraint.jac):
        middle = np.exp((variables.lower + variables.upper) / 2)
        matrix = np.atleast_2d(full(constraint.jac(middle)))
        exact = ca.Function("jacobian", [values], [ca.jacobian(rows, values)])(middle).full()
        if matrix.shape != exact.shape or not np.allclose(
            matrix, exact, rtol=_JACOBIAN, atol=_JACOBIAN * np.abs(exact).max(initial=0.0)
        ):
            raise ValueError(
                f"{name}.jac: expected the derivative of fun, which at {check.shown(middle)} is "
                f"{check.shown(exact.tolist())}, got {check.shown(np.asarray(matrix).tolist())}"
            )
    return rows


def _ends(name: str, constraint: Any, n_rows: int) -> tuple[FloatArray, FloatArray]:
    words = f"{name}: expected numbers as bounds, -inf below or inf above for none, got"
    shown = f"lb={check.shown(constraint.lb)}, ub={check.shown(constraint.ub)}"
    try:
        low, high = (
            np.broadcast_to(np.asarray(bound, dtype=float), n_rows)
            for bound in (constraint.lb, constraint.ub)
        )
    except (TypeError, ValueError):
        raise ValueError(f"{words} {shown} for {n_rows} rows") from None
    if not np.all((low < np.inf) & (high > -np.inf)):
        raise ValueError(f"{words} {shown}")
    return low, high


def _relations(
    name: str, symbols: DesignSymbols, function: Any
) -> tuple[Any, FloatArray, FloatArray, frozenset[str]]:
    """Rows that are to be 0 at the most, or 0, from relations such as ``a <= b``."""
    found = called(name, function, symbols.parameters)
    several = found if isinstance(found, (list, tuple)) else [found]
    column, others = symbols.numbers(column_of(name, list(several)))
    rows, low = [], []
    for entry in ca.vertsplit(column):
        if entry.is_constant() or entry.op() not in _RELATIONS:
            raise TypeError(
                f"{name}: expected relations of parameters, for example "
                f'parameters["normal_load"] <= 5, got {check.shown(entry)}'
            )
        rows.append(entry.dep(0) - entry.dep(1))
        low.append(0.0 if entry.op() == ca.OP_EQ else -np.inf)
    expression = ca.vertcat(*rows)
    without_symbols_of_its_own(name, expression, symbols.values)
    return expression, np.array(low), np.zeros(len(low)), others
