"""Half the sum of squared residuals, with exact first and second derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.design.identification.kinds import Curve, Nearby, Reading, Solved, Work, curves_of
from symhbm.design.identification.observations import Rows, readings
from symhbm.design.identification.unknowns import Unknowns, read_unknowns
from symhbm.numerics import RADIANS, FloatArray

_SAME = 1e-7
"""Difference of sums of squares that is none, relative, and of residuals, over all readings."""
CORNER = 1e-5
"""Margin of a contact, the logarithm of its motion over its limit, below which it is on it."""


@dataclass
class Objective:
    """Residuals of all measurements as functions of the variables of a fit."""

    unknowns: Unknowns
    rows: Rows
    curves: Sequence[Curve]
    work: Work
    _near: Point | None = None
    _last: Point | None = None
    _best: Point | None = None

    @cached_property
    def read(self) -> list[Reading]:
        """What all rows read of their solutions."""
        each = {i: one for curve in self.curves for i, one in curve.read.items()}
        return [each[i] for i in range(self.rows.n)]

    def best_words(self) -> str:
        """The best values so far, as `start` of `symhbm.identify` takes them."""
        if self._best is None:
            return "nothing is kept of a fit that has no values yet"
        values = self.unknowns.values(self._best.x).tolist()
        named = dict(zip(self.unknowns.labels, values, strict=True))
        return f"begin again from the best values so far with start={named}"

    def at(self, x: FloatArray) -> Point:
        """The point of some variables; ArithmeticError where a response is not found."""
        last = self._last
        if last is None or not np.array_equal(last.x, x):
            parameters = self.unknowns.parameters(x)
            solved = []
            for number, curve in enumerate(self.curves):
                problem = curve.problem.with_parameters(**parameters)
                nearby = self._near.nearby(number, x) if self._near else ()
                solved.append(curve.solve(problem, nearby, self.work))
            self._last = Point(self, np.array(x), solved)
            if self._best is None or self._last.value < self._best.value:
                self._best = self._last
        assert self._last is not None
        return self._last

    def remember(self, point: Point) -> None:
        """Start from the solutions of a point next to those of which others are looked for."""
        self._near = point

    def afresh(self, x: FloatArray) -> float:
        """The value where no solution is known before: of the highest peaks, of the modes asked."""
        return replace(self, _near=None, _last=None).at(x).value


@dataclass(frozen=True, eq=False)
class Point:
    """An objective at some variables ``x`` (n,), with the solutions of all curves."""

    objective: Objective
    x: FloatArray
    solved: list[list[Solved]]

    def nearby(self, number: int, x: FloatArray) -> Nearby:
        """The solutions of a curve, and states where variables are others, to first order."""
        both = zip(self.solved[number], self._moves[number], strict=True)
        return [(one, one.state + move @ (x - self.x)) for one, move in both]

    @property
    def _each(self) -> Iterator[tuple[int, Solved]]:
        """All rows, each with the solution that it is of."""
        for curve, solved in zip(self.objective.curves, self.solved, strict=True):
            for rows, one in zip(curve.rows, solved, strict=True):
                yield from ((i, one) for i in rows.tolist())

    @cached_property
    def _sensors(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Values (n_rows, 3) of the sensors of all rows, first and second derivatives."""
        unknowns, rows = self.objective.unknowns, self.objective.rows
        by_place = {place: unknowns.of_sensor(place, self.x) for place in rows.sensors}
        none = unknowns.of_sensor("", self.x)
        each = [
            by_place[place] if read.by_sensor else none
            for place, read in zip(rows.place.tolist(), self.objective.read, strict=True)
        ]
        values, slopes, curvatures = zip(*each, strict=True)
        return np.array(values), np.array(slopes), np.array(curvatures)

    @cached_property
    def _read(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Readings (n_rows,) with derivatives by cosine, sine, gain, phase and delay."""
        rows, read = self.objective.rows, self.objective.read
        parts = np.zeros((rows.n, 2))
        for i, one in self._each:
            parts[i] = read[i].seen @ one.state
        power, form = np.array([one.power for one in read]), np.array([one.part for one in read])
        return readings(parts, self._sensors[0], rows.harmonic * rows.omega, power, form)

    @property
    def readings(self) -> FloatArray:
        """What all rows, those that are left out, too, should be, (n_rows,)."""
        return self._read[0]

    @cached_property
    def all_residuals(self) -> FloatArray:
        """Residuals of all rows over their scales, NaN where nothing was measured, (n_rows,)."""
        rows = self.objective.rows
        difference = self.readings - rows.value
        turns = rows.form == "phase"
        difference[turns] = np.angle(np.exp(1j * difference[turns]))
        return difference / rows.scales

    @cached_property
    def residuals(self) -> FloatArray:
        """Residuals of the rows that are fitted, then those of priors, (n,)."""
        own = self.all_residuals[self.objective.rows.kept]
        return np.concatenate([own, self.objective.unknowns.priors(self.x)[0]])

    @property
    def value(self) -> float:
        """Half the sum of their squares."""
        return float(self.residuals @ self.residuals) / 2

    @cached_property
    def afresh(self) -> float:
        """The value where no solution is known before: of paths, highest peaks, modes asked."""
        return self.objective.afresh(self.x)

    @property
    def is_found_again(self) -> bool:
        """Whether that is the same value, to round-off."""
        return abs(self.afresh - self.value) <= _SAME * self.value + (_SAME * self.size) ** 2

    @cached_property
    def _moves(self) -> list[list[FloatArray]]:
        """Derivatives of the state of every solution by the variables, (n_state, n) each."""
        return [
            [one.move(self._balanced_slopes(one.problem)) for one in solved]
            for solved in self.solved
        ]

    @cached_property
    def _slopes(self) -> dict[str, FloatArray]:
        return self.objective.unknowns.slopes(self.x)

    def _balanced_slopes(self, problem: HarmonicBalance) -> FloatArray:
        """Derivatives by the variables of the parameters that a problem balances."""
        return balanced(problem, self._slopes, (len(self.x),))

    @cached_property
    def all_slopes(self) -> FloatArray:
        """Derivatives of all readings by the variables, (n_rows, n)."""
        return np.einsum("ri,rij->rj", self._read[1], self._inner)

    @cached_property
    def _inner(self) -> FloatArray:
        """Derivatives by the variables of cosine, sine, gain, phase and delay, (n_rows, 5, n)."""
        inner = np.concatenate(
            [np.zeros((len(self.readings), 2, len(self.x))), self._sensors[1]], 1
        )
        for curve, moves in zip(self.objective.curves, self._moves, strict=True):
            for rows, move in zip(curve.rows, moves, strict=True):
                for i in rows.tolist():
                    inner[i, :2] = curve.read[i].seen @ move
        return inner

    @cached_property
    def jacobian(self) -> FloatArray:
        """Derivatives of the residuals, (n_residuals, n)."""
        rows = self.objective.rows
        own = (self.all_slopes / rows.scales[:, None])[rows.kept]
        return np.concatenate([own, self.objective.unknowns.priors(self.x)[1]])

    @property
    def gradient(self) -> FloatArray:
        """Derivative of the value, (n,)."""
        return self.jacobian.T @ self.residuals

    @cached_property
    def hessian(self) -> FloatArray:
        """Second derivative of the value, exact, (n, n)."""
        rows, n = self.objective.rows, len(self.x)
        result = self.jacobian.T @ self.jacobian
        prior, _, bend = self.objective.unknowns.priors(self.x)
        result += np.diag(prior @ bend) if len(prior) else 0.0
        weights = np.where(rows.kept, np.nan_to_num(self.all_residuals) / rows.scales, 0.0)
        first, second = (weights[(..., *[None] * (d.ndim - 1))] * d for d in self._read[1:])
        result += np.einsum("rij,rik,rjl->kl", second, self._inner, self._inner, optimize=True)
        result += np.diag(np.einsum("ri,rik->k", first[:, 2:], self._sensors[2]))
        bends = self.objective.unknowns.bends(self.x)
        for curve, solved in zip(self.objective.curves, self.solved, strict=True):
            problem = solved[0].problem
            own, bend = self._balanced_slopes(problem), balanced(problem, bends, (n, n))
            for at, one in zip(curve.rows, solved, strict=True):
                pull = sum(first[i, :2] @ curve.read[i].seen for i in at.tolist())
                result += one.bend(np.asarray(pull), own, bend)
        return result

    @property
    def size(self) -> float:
        """Norm over all measurements of what a sensor might see at most, over their scales."""
        rows, reach = self.objective.rows, np.zeros(self.objective.rows.n)
        for i, one in self._each:
            read = self.objective.read[i]
            reach[i] = read.reach * (np.abs(one.motion).max() if read.of_motion else 1.0)
        return float(np.linalg.norm((reach / rows.scales)[rows.kept]))

    def on_corners(self) -> list[tuple[float, int]]:
        """Frequencies [Hz] and contacts that are on a limit there."""
        found = []
        for solved in self.solved:
            for one in solved:
                for switch in np.flatnonzero(np.abs(one.margins) <= CORNER).tolist():
                    contact = int(one.problem.contacts.of_switches[switch])
                    found.append((one.omega / RADIANS, contact))
        return found


def balanced(
    problem: HarmonicBalance, derivatives: dict[str, FloatArray], shape: tuple[int, ...]
) -> FloatArray:
    """Derivatives (n_balanced, *shape) of the parameters that a problem balances.

    From those of all entries of parameters by name, (n_entries, *shape) each.
    """
    parts = []
    for name, of in derivatives.items():
        columns = np.moveaxis(of.reshape(len(of), -1), 0, 1)
        nominal = np.shape(problem.parameters[name])
        own = [np.ravel(problem.own(name, column.reshape(nominal))) for column in columns]
        parts.append(np.array(own).T.reshape(-1, *shape))
    return np.concatenate(parts) if parts else np.zeros((0, *shape))


def objective_of(
    problem: HarmonicBalance, rows: Rows, unknown: Any, start: Any = None, checked: bool = True
) -> Objective:
    """The objective of measurements and unknowns, checked against each other.

    Those that are not ``checked`` may be fewer than the unknowns.
    """
    problem.model.check_frequencies("frequency", np.unique(rows.frequency))
    unknowns = read_unknowns(problem, unknown, rows.sensors)
    if start is not None:
        unknowns = _started(unknowns, start)
    n_priors = sum(one.prior is not None for one in unknowns.each)
    n_rows = int(rows.kept.sum())
    if checked and n_rows + n_priors < unknowns.n:
        raise ValueError(
            f"data: expected at least as many values as unknowns, got {n_rows} for {unknowns.n} "
            f"({', '.join(unknowns.labels)})"
        )
    _ = rows.has_noise
    for name in unknowns.names:
        problem.derivative(name)  # compiles contacts that do nothing so far
    alike = not any("[" in one.label and one.entries for one in unknowns.each)
    alike &= not unknowns.relations
    curves = curves_of(problem, rows, unknowns.names, alike)
    return Objective(unknowns, rows, curves, Work(unknowns.names))


def _started(unknowns: Unknowns, start: Any) -> Unknowns:
    """Unknowns that begin at other values."""
    values = _start_of(start, unknowns.labels)
    each = []
    for one in unknowns.each:
        value = float(values.get(one.label, one.value))
        each.append(replace(one, value=float(np.clip(value, one.lower, one.upper))))
    return replace(unknowns, each=tuple(each))


def _start_of(result: Any, labels: Sequence[str]) -> Mapping[str, float]:
    """Values to start from, of a fit or a mapping from names of unknowns."""
    if isinstance(result, xr.Dataset) and "estimate" in result.variables:
        values = result["estimate"].values.tolist()
        result = dict(zip(result["unknown"].values.tolist(), values, strict=True))
    if not isinstance(result, Mapping) or isinstance(result, xr.Dataset):
        raise TypeError("start: expected a result of identify, or values by names of unknowns")
    for name in result:
        if name not in labels:
            raise KeyError(f"start: {name!r} is no unknown; allowed: {', '.join(labels)}")
    return result
