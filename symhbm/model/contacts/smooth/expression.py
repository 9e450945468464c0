"""Expressions as plain operations, which archives keep as text, and compiled for instants.

A graph is a list of operations. Each is a name and its operands, the numbers of operations before
it: ``["mul", 0, 2]``. Inputs are ``["input", i]``, constants ``["constant", text]``, all digits.
It is read back without running any code, and compiled once for each law: the force at instants,
with its slopes and what bends it.
"""

import json
import math
import operator
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symhbm.numerics import Compiled, FloatArray

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


_BLOCK = 4096
"""Instants evaluated at once."""


class Sizes(NamedTuple):
    """Of a force: ``m`` directions, parameters, and functions whose zeros are break points."""

    directions: int
    parameters: int
    breakpoints: int

    @property
    def arguments(self) -> int:
        """Displacements, velocities and parameters, in this order."""
        return 2 * self.directions + self.parameters


class Force:
    """A force (m) of arguments (a): displacements [m], velocities [m/s] and parameters.

    ``text`` is its graph, whose results are the force and the functions of break points.
    """

    def __init__(self, text: str, sizes: Sizes):
        self.sizes = sizes
        arguments, m = ca.SX.sym("arguments", sizes.arguments), sizes.directions
        results = read(text, ca.vertsplit(arguments), m + sizes.breakpoints)
        force, breakpoints = ca.vertcat(*results[:m]), ca.vertcat(ca.SX(0, 1), *results[m:])
        slope = ca.densify(ca.jacobian(force, arguments))
        weights = ca.SX.sym("weights", m)
        second = ca.vec(ca.densify(ca.hessian(ca.dot(weights, force), arguments)[0]))
        inputs = [arguments, weights]
        second = ca.vertcat(*without_poison(inputs, ca.vertsplit(second)))
        margin_slope = ca.densify(ca.jacobian(breakpoints, arguments))
        self._functions = {
            "force": ca.Function("force", [arguments], [ca.densify(force)]),
            "slopes": ca.Function("slopes", [arguments], [ca.densify(force), slope.T]),
            "bends": ca.Function("bends", inputs, [second]),
            "margins": ca.Function(
                "margins", [arguments], [ca.densify(breakpoints), margin_slope.T]
            ),
        }
        self._compiled: dict[tuple[str, int], Compiled] = {}

    def force(self, arguments: FloatArray) -> FloatArray:
        """Forces (..., m) [N] at arguments (..., a)."""
        (found,) = self._call("force", arguments)
        return found

    def slopes(self, arguments: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Forces (..., m), and their derivatives by the arguments (..., m, a)."""
        force, slope = self._call("slopes", arguments)
        return force, slope.reshape(*force.shape, -1)

    def bends(self, arguments: FloatArray, weights: FloatArray) -> FloatArray:
        """Second derivatives (..., a, a) of forces times ``weights`` (..., m)."""
        (found,) = self._call("bends", arguments, weights)
        return found.reshape(*arguments.shape, -1)

    def margins(self, arguments: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Functions of break points (..., b), and their derivatives (..., b, a)."""
        value, slope = self._call("margins", arguments)
        return value, slope.reshape(*value.shape, self.sizes.arguments)

    def _call(self, name: str, *inputs: FloatArray) -> list[FloatArray]:
        """Call a function at as many instants, block by block."""
        shape = inputs[0].shape[:-1]
        rows = [values.reshape(-1, values.shape[-1]) for values in inputs]
        blocks = []
        for i in range(0, len(rows[0]), _BLOCK):
            blocks.append(self._call_block(name, [part[i : i + _BLOCK] for part in rows]))
        joined = blocks[0] if len(blocks) == 1 else map(np.concatenate, zip(*blocks, strict=True))
        return [part.reshape(*shape, -1) for part in joined]

    def _call_block(self, name: str, rows: list[FloatArray]) -> list[FloatArray]:
        """The same at few instants; their number is rounded up, so that few are compiled."""
        n = len(rows[0])
        count = 1 << (n - 1).bit_length()
        key = name, count
        if key not in self._compiled:
            self._compiled[key] = Compiled(self._functions[name].map(count))
        filled = [np.append(part, np.repeat(part[-1:], count - n, axis=0)) for part in rows]
        return [part.reshape(count, -1)[:n] for part in self._compiled[key](*filled)]


force_of = lru_cache(maxsize=64)(Force)
"""The force of a graph, made once."""


def arguments_of(
    displacement: FloatArray, velocity: FloatArray, parameters: FloatArray
) -> FloatArray:
    """Arguments (..., a) of parts (..., m), (..., m) and (..., p) that broadcast."""
    shape = np.broadcast_shapes(*(part.shape[:-1] for part in (displacement, parameters)))
    parts: list[Any] = [displacement, velocity, parameters]
    return np.concatenate([np.broadcast_to(p, (*shape, p.shape[-1])) for p in parts], axis=-1)
