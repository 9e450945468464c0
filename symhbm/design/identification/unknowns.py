"""What a fit looks for: parameters of a problem and of sensors, as functions of few variables."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.design.arguments import (
    Named,
    called,
    column_of,
    read_pattern,
    without_symbols_of_its_own,
)
from symhbm.design.variables import groups_of
from symhbm.numerics import FloatArray, check

OF_SENSORS = {"gain": "1", "phase": "rad", "delay": "s"}
"""What may be unknown of a sensor, with units: ``gain exp(i (phase - omega delay))``."""
_WIDE = 1e3
"""How far beside the start the bounds of a positive unknown are by default."""
_OF_ONE = {"bounds", "value", "vary", "prior", "log_prior", "logarithm"}
_FORM = (
    "expected bounds (low, high), a function of the parameters, or a mapping with some of bounds, "
    "value, vary, prior, log_prior and logarithm"
)


class Prior(NamedTuple):
    """What is known of an unknown before: ``mean`` and ``deviation``, of its logarithm or not."""

    mean: float
    deviation: float
    of_logarithm: bool


@dataclass(frozen=True)
class Unknown:
    """One value that a fit looks for, of some ``entries`` of a parameter.

    Its variable is the logarithm of the value, or the value over a ``scale``.
    """

    label: str
    parameter: str
    units: str
    entries: tuple[int, ...]
    lower: float
    upper: float
    value: float
    logarithmic: bool
    prior: Prior | None = None

    @property
    def scale(self) -> float:
        """Unit of a variable that is no logarithm."""
        return max(abs(self.lower), abs(self.upper))

    def variable(self, value: Any) -> Any:
        """The variable of a value."""
        return np.log(value) if self.logarithmic else np.asarray(value) / self.scale

    def of_variable(self, x: float) -> tuple[float, float, float]:
        """The value of a variable, and its first and second derivative."""
        if not self.logarithmic:
            return self.scale * x, self.scale, 0.0
        value = float(np.clip(np.exp(x), self.lower, self.upper))
        return value, value, value


@dataclass(frozen=True)
class Unknowns:
    """All unknowns of a fit, as variables ``x`` (n,), and the ``relations`` of other parameters.

    ``nominal`` are the parameters of the problem.
    """

    each: tuple[Unknown, ...]
    relations: Mapping[str, Callable[..., Any]]
    nominal: Mapping[str, Any]

    @property
    def n(self) -> int:
        """Number of variables."""
        return len(self.each)

    @property
    def labels(self) -> list[str]:
        """Names of the unknowns."""
        return [one.label for one in self.each]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters of the problem that the fit changes."""
        own = [one.parameter for one in self.each if one.parameter not in OF_SENSORS]
        return tuple(dict.fromkeys([*own, *self.relations]))

    @cached_property
    def bounds(self) -> FloatArray:
        """Lower and upper bounds of the variables, (2, n)."""
        return np.array(
            [
                [float(one.variable(one.lower)) for one in self.each],
                [float(one.variable(one.upper)) for one in self.each],
            ]
        )

    @property
    def start(self) -> FloatArray:
        """Variables of the given values, (n,)."""
        return np.array([float(one.variable(one.value)) for one in self.each])

    def values(self, x: FloatArray) -> FloatArray:
        """Values of the unknowns, (n,)."""
        return np.array([one.of_variable(at)[0] for one, at in zip(self.each, x, strict=True)])

    def parameters(self, x: FloatArray) -> dict[str, FloatArray]:
        """Values of the parameters of the problem that the fit changes."""
        stacked = self._call("values", x)
        return {
            name: stacked[self._places[name]].reshape(np.shape(self.nominal[name]))
            for name in self.names
        }

    def slopes(self, x: FloatArray) -> dict[str, FloatArray]:
        """Their derivatives by the variables, (n_entries, n) each."""
        stacked = self._call("slopes", x)
        return {name: stacked[self._places[name]] for name in self.names}

    def bends(self, x: FloatArray) -> dict[str, FloatArray]:
        """Their second derivatives by the variables, (n_entries, n, n) each."""
        # CasADi stores columns one after the other.
        stacked = self._call("bends", x).reshape(self.n, -1, self.n).transpose(1, 0, 2)
        return {name: stacked[self._places[name]] for name in self.names}

    @property
    def text(self) -> str:
        """All that the parameters are of the variables, functions of the user as well."""
        return self._functions["values"].serialize()

    def of_sensor(self, place: str, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gain, phase and delay of a sensor (3,), and derivatives (3, n) by each variable alone."""
        values, slopes, curvatures = np.array([1.0, 0, 0]), *np.zeros((2, 3, self.n))
        for j, one in enumerate(self.each):
            if one.parameter in OF_SENSORS and one.label == f"{one.parameter}[{place}]":
                row = [*OF_SENSORS].index(one.parameter)
                values[row], slopes[row, j], curvatures[row, j] = one.of_variable(x[j])
        return values, slopes, curvatures

    def priors(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Residuals of what is known before, and first and second derivatives, (n_priors, n)."""
        rows = []
        for j, (one, at) in enumerate(zip(self.each, x, strict=True)):
            if one.prior is None:
                continue
            value, first, second = one.of_variable(at)
            mean, deviation, of_logarithm = one.prior
            if of_logarithm:
                second, first = second / value - (first / value) ** 2, first / value
                value, mean = np.log(value), np.log(mean)
            unit = np.eye(self.n)[j] / deviation
            rows.append(((value - mean) / deviation, first * unit, second * unit))
        if not rows:
            return np.zeros(0), np.zeros((0, self.n)), np.zeros((0, self.n))
        residual, first, second = zip(*rows, strict=True)
        return np.array(residual), np.array(first), np.array(second)

    @cached_property
    def _places(self) -> dict[str, slice]:
        ends = np.cumsum([0, *(np.size(self.nominal[name]) for name in self.names)]).tolist()
        return {name: slice(*ends[i : i + 2]) for i, name in enumerate(self.names)}

    def _call(self, which: str, x: FloatArray) -> FloatArray:
        return np.asarray(self._functions[which](x).full())

    @cached_property
    def _functions(self) -> dict[str, ca.Function]:
        """The parameters as CasADi functions of the variables, with derivatives."""
        x, columns = ca.SX.sym("x", self.n), {}
        for name, nominal in self.nominal.items():
            columns[name] = ca.SX(np.ravel(np.asarray(nominal, dtype=float)))
        for j, one in enumerate(self.each):
            if one.parameter not in OF_SENSORS:
                value = ca.exp(x[j]) if one.logarithmic else one.scale * x[j]
                columns[one.parameter][list(one.entries)] = value
        named = Named(columns, "parameter of the problem")
        for name, relation in self.relations.items():
            said, size = f"unknown[{name!r}]", columns[name].numel()
            column = column_of(said, called(said, relation, named))
            if column.numel() not in (1, size):
                raise ValueError(
                    f"{said}: expected 1 or {size} values, the function returns {column.numel()}"
                )
            without_symbols_of_its_own(said, column, x)
            columns[name] = ca.repmat(column, size, 1) if column.numel() == 1 else column
        stacked = ca.vertcat(*(columns[name] for name in self.names))
        slopes = ca.jacobian(stacked, x)
        results = {"values": stacked, "slopes": slopes, "bends": ca.jacobian(ca.vec(slopes), x)}
        return {name: ca.Function(name, [x], [ca.densify(of)]) for name, of in results.items()}


def read_unknowns(problem: HarmonicBalance, unknown: Any, sensors: Sequence[str]) -> Unknowns:
    """The unknowns that a user gives; raises KeyError, TypeError or ValueError for bad ones."""
    if isinstance(unknown, str):
        unknown = [unknown]
    if isinstance(unknown, Sequence):
        unknown = dict.fromkeys(check.text("unknown", one) for one in unknown)
    if not isinstance(unknown, Mapping) or not unknown:
        raise TypeError(
            f"unknown={check.shown(unknown)}: expected names of parameters, or a mapping of them"
        )
    each: list[Unknown] = []
    relations = {}
    for said, given in unknown.items():
        check.text("unknown", said)
        name, index = _split(said)
        if name in OF_SENSORS:
            each.append(_of_sensor(said, name, index, given, sensors))
            continue
        allowed = [n for n, of in problem.parameters.items() if not isinstance(of, int)]
        name = problem.parameter_name(name, allowed)
        if callable(given):
            relations[name] = given
        else:
            each += _of_parameter(problem, said, name, index, given)
    taken: dict[tuple[str, int], str] = {}
    for one in each:
        for entry in one.entries if one.parameter not in OF_SENSORS else ():
            if (one.parameter, entry) in taken or one.parameter in relations:
                raise ValueError(f"unknown: {one.label!r} is there twice, expected it once")
            taken[one.parameter, entry] = one.label
    if not each:
        raise ValueError("unknown: expected at least one that is no function of the others")
    result = Unknowns(tuple(each), relations, dict(problem.parameters))
    result.slopes(result.start)  # functions of the user are called, and refused, here
    return result


def _split(said: str) -> tuple[str, str | None]:
    """A name and what stands in square brackets behind it."""
    name, bracket, rest = said.partition("[")
    return (name, rest.removesuffix("]")) if bracket else (said, None)


def _of_parameter(
    problem: HarmonicBalance, said: str, name: str, index: str | None, given: Any
) -> list[Unknown]:
    nominal = np.asarray(problem.parameters[name], dtype=float)
    if not nominal.size:
        raise ValueError(f"unknown[{said!r}]: expected contacts, the structure has none")
    pattern: Any = "common"
    if isinstance(given, Mapping):
        pattern = read_pattern(given.get("vary", "common"), nominal.size)
    if index is not None:
        if not index.isdecimal() or not nominal.ndim or int(index) >= nominal.size:
            raise ValueError(
                f"unknown[{said!r}]: expected a number from 0 to {nominal.size - 1} in []"
            )
        chosen = [(said, (int(index),))]
    else:
        groups = groups_of(name, pattern, nominal.size, 0.0, 0.0)
        chosen = [(group.label, group.entries) for group in groups]
    about = problem.records[name]
    result = []
    for label, entries in chosen:
        value = float(nominal.flat[entries[0]])
        result.append(_one(said, label, name, about.units, entries, given, value, about.bound))
    return result


def _of_sensor(
    said: str, name: str, place: str | None, given: Any, sensors: Sequence[str]
) -> Unknown:
    if place not in sensors:
        raise KeyError(
            f"unknown[{said!r}]: expected the place of a measurement in [], one of "
            f"{', '.join(map(repr, sensors))}"
        )
    usual = {"gain": (0.1, 10.0), "phase": (-np.pi, np.pi)}
    if given is None and name in usual:
        given = usual[name]
    value, bound = (1.0, "positive") if name == "gain" else (0.0, "any")
    return _one(said, said, name, OF_SENSORS[name], (), given, value, bound)


def _one(
    said: str,
    label: str,
    name: str,
    units: str,
    entries: tuple[int, ...],
    given: Any,
    value: float,
    bound: str,
) -> Unknown:
    where = f"unknown[{said!r}]"
    entry = {"bounds": given} if not isinstance(given, Mapping) else given
    if wrong := [key for key in entry if key not in _OF_ONE]:
        raise ValueError(f"{where}: {wrong[0]!r} is none of its entries, {_FORM}")
    value = check.scalar(f"{where} value", entry.get("value", value))
    edges = entry.get("bounds")
    if edges is None:
        if value <= 0:
            raise ValueError(f"{where}: expected bounds (low, high), as its start is {value:g}")
        edges = value / _WIDE, value * _WIDE
    limits = check.array(f"{where} bounds", edges, bound)
    if limits.shape != (2,) or limits[0] >= limits[1]:
        raise ValueError(f"{where}={check.shown(edges)}: {_FORM}, with low < high")
    lower, upper = limits.tolist()
    logarithmic = check.flag(f"{where} logarithm", entry.get("logarithm", lower > 0))
    if logarithmic and lower <= 0:
        raise ValueError(f"{where}: expected a lower bound above 0 for its logarithm")
    if "value" in entry and not lower <= value <= upper:
        raise ValueError(f"{where}: expected a value from {lower:g} to {upper:g}, got {value:g}")
    value = float(np.clip(value, lower, upper))
    if "prior" in entry and "log_prior" in entry:
        raise ValueError(f"{where}: expected one of prior and log_prior, got both")
    prior = None
    for key in ("prior", "log_prior"):
        if entry.get(key) is not None:
            pair = check.array(f"{where} {key}", entry[key])
            if pair.shape != (2,) or pair[1] <= 0 or (key == "log_prior" and pair[0] <= 0):
                raise ValueError(
                    f"{where} {key}={check.shown(entry[key])}: expected a mean"
                    f"{' above 0' if key == 'log_prior' else ''} and a standard deviation above 0"
                )
            prior = Prior(float(pair[0]), float(pair[1]), key == "log_prior")
    return Unknown(label, name, units, entries, lower, upper, value, logarithmic, prior)
