"""Expressions as plain operations: text that archives keep, read back without running any code.

A graph is a list of operations. Each is a name and its operands, the numbers of operations before
it: ``["mul", 0, 2]``. Inputs are ``["input", i]``, constants ``["constant", text]``, all digits.
"""

import json
import math
import operator
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import casadi as ca

_ONE: dict[str, Callable[[Any], Any]] = {
    "neg": operator.neg,
    "sq": lambda a: a * a,
    "twice": lambda a: 2 * a,
    "inv": lambda a: 1 / a,
    "not": ca.logic_not,
    **{
        name: getattr(ca, name)
        for name in (
            *("exp", "log", "expm1", "log1p", "sqrt", "fabs", "sign", "erf"),
            *("sin", "cos", "tan", "asin", "acos", "atan"),
            *("sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
        )
    },
}
_TWO: dict[str, Callable[[Any, Any], Any]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "pow": operator.pow,
    "constpow": operator.pow,
    "lt": operator.lt,
    "le": operator.le,
    "eq": ca.eq,
    "ne": ca.ne,
    "and": ca.logic_and,
    "or": ca.logic_or,
    "if_else_zero": lambda a, b: ca.if_else(a, b, 0),
    **{name: getattr(ca, name) for name in ("fmin", "fmax", "atan2", "hypot", "copysign")},
}
_NAMES = {getattr(ca, f"OP_{name.upper()}"): name for name in (*_ONE, *_TWO)}
_CHOICES = {"fabs", "sign", "fmin", "fmax", "copysign", "lt", "le", "eq", "ne", "not", "and", "or"}
"""Operations that choose, at which slopes may jump."""
_MOST = 100_000
"""Operations above which a graph is refused."""


def written(inputs: Sequence[Any], outputs: Sequence[Any]) -> str:
    """The graph of expressions (n,) of symbols (n,), as text.

    Raises ValueError for what graphs do not have.
    """
    function = ca.Function("graph", list(inputs), [ca.densify(ca.vertcat(*outputs))])
    first = [0]
    for symbol in inputs:
        first.append(first[-1] + symbol.numel())
    operations: list[list[Any]] = []
    number_in: dict[int, int] = {}  # the operation whose result is in a place of CasADi's memory
    results = [-1] * len(outputs)
    for k in range(function.n_instructions()):
        kind, result = function.instruction_id(k), function.instruction_output(k)
        operands = function.instruction_input(k)
        if kind == ca.OP_OUTPUT:
            results[result[1]] = number_in[operands[0]]
            continue
        if kind == ca.OP_INPUT:
            operation = ["input", first[operands[0]] + operands[1]]
        elif kind == ca.OP_CONST:
            constant = float(function.instruction_constant(k))
            if not math.isfinite(constant):
                raise ValueError(f"the constant {constant}")
            operation = ["constant", constant.hex()]
        elif kind in _NAMES:
            name = _NAMES[kind]
            operation = [name, *(number_in[i] for i in operands[: 1 if name in _ONE else 2])]
        else:
            raise ValueError(f"an operation that is none of {', '.join((*_ONE, *_TWO))}")
        operations.append(operation)
        number_in[result[0]] = len(operations) - 1
    return json.dumps({"operations": operations, "results": results})


def read(text: Any, inputs: Sequence[Any], n_results: int) -> list[Any]:
    """The expressions (n_results,) of a graph at inputs (n,).

    Raises ValueError for what is no graph of so many inputs and results.
    """
    try:
        graph = json.loads(text)
        operations, results = graph["operations"], graph["results"]
        if not len(operations) <= _MOST or len(results) != n_results:
            raise ValueError("sizes")
        values: list[Any] = []
        for name, *operands in operations:
            values.append(_value(name, operands, values, inputs))
        return [values[_number(i, len(values))] for i in results]
    except (TypeError, ValueError, KeyError, IndexError, OverflowError, RecursionError) as error:
        raise ValueError(
            f"graph of a contact law: damaged, or of another version ({error})"
        ) from None


@lru_cache(maxsize=64)
def has_choices(text: str) -> bool:
    """Whether a graph has operations at which slopes may jump."""
    return any(operation[0] in _CHOICES for operation in json.loads(text)["operations"])


def without_poison(inputs: Sequence[Any], outputs: Any) -> list[Any]:
    """Expressions in which zero times infinity is zero.

    The second derivative of a power is infinite at zero; a branch that is not taken multiplies it
    by zero.
    """
    graph = json.loads(written(inputs, outputs))
    symbols = [element for symbol in inputs for element in ca.vertsplit(symbol)]
    values: list[Any] = []
    for name, *operands in graph["operations"]:
        value = _value(name, operands, values, symbols)
        if name in {"mul", "div"}:
            one, other = (values[i] for i in operands)
            value = ca.if_else(one, value if name == "div" else ca.if_else(other, value, 0), 0)
        values.append(value)
    return [values[i] for i in graph["results"]]


def _value(name: str, operands: list[Any], values: list[Any], inputs: Sequence[Any]) -> Any:
    if name == "input":
        (number,) = operands
        return inputs[_number(number, len(inputs))]
    if name == "constant":
        (digits,) = operands
        constant = float.fromhex(digits)
        if not math.isfinite(constant):
            raise ValueError(f"constant {digits}")
        return ca.SX(constant)
    known: Any = _ONE.get(name) or _TWO[name]
    if len(operands) != (1 if name in _ONE else 2):
        raise ValueError(f"operands of {name}")
    return known(*(values[_number(i, len(values))] for i in operands))


def _number(value: Any, count: int) -> int:
    if type(value) is not int or not 0 <= value < count:
        raise ValueError(f"number {value!r}")
    return value
