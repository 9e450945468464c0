"""A force at instants, with its slopes and what bends it, compiled once for each law."""

from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symhbm.model.contacts.smooth import graph
from symhbm.numerics import Compiled, FloatArray

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
        results = graph.read(text, ca.vertsplit(arguments), m + sizes.breakpoints)
        force, breakpoints = ca.vertcat(*results[:m]), ca.vertcat(ca.SX(0, 1), *results[m:])
        slope = ca.densify(ca.jacobian(force, arguments))
        weights = ca.SX.sym("weights", m)
        second = ca.vec(ca.densify(ca.hessian(ca.dot(weights, force), arguments)[0]))
        inputs = [arguments, weights]
        second = ca.vertcat(*graph.without_poison(inputs, ca.vertsplit(second)))
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


@lru_cache(maxsize=64)
def force_of(text: str, sizes: Sizes) -> Force:
    """The force of a graph."""
    return Force(text, sizes)


def arguments_of(
    displacement: FloatArray, velocity: FloatArray, parameters: FloatArray
) -> FloatArray:
    """Arguments (..., a) of parts (..., m), (..., m) and (..., p) that broadcast."""
    shape = np.broadcast_shapes(*(part.shape[:-1] for part in (displacement, parameters)))
    parts: list[Any] = [displacement, velocity, parameters]
    return np.concatenate([np.broadcast_to(p, (*shape, p.shape[-1])) for p in parts], axis=-1)
