"""Half the sum of squared residuals, with exact first and second derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from symhbm.balance import Evaluation, HarmonicBalance, SecondOrder
from symhbm.continuation import ACCEPTED, FrequencyProblem, follow_branch, newton, solve_point
from symhbm.design.identification.curves import Curve
from symhbm.design.identification.observations import Rows, readings
from symhbm.design.identification.solutions import Response, Solved, mode_of, peak_of
from symhbm.design.identification.unknowns import Unknowns
from symhbm.numerics import RADIANS, FloatArray

_MOST_POINTS = 5000
"""Points of one path of a response that may jump."""
CORNER = 1e-5
"""Margin of a contact, the logarithm of its motion over its limit, below which it is on it."""


@dataclass
class Objective:
    """Residuals of all measurements as functions of the variables of a fit."""

    unknowns: Unknowns
    rows: Rows
    curves: Sequence[Curve]
    n_solved: int = 0
    n_iterations: int = 0
    _orders: dict[int, SecondOrder] = field(default_factory=dict)
    _near: Point | None = None
    _last: Point | None = None
    _best: Point | None = None

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
                solved.append(self._solved(number, curve, problem, x))
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

    def second_order(self, problem: HarmonicBalance) -> SecondOrder:
        """Derivatives by the parameters of the fit, compiled once for all copies of a problem."""
        key = id(problem.compiled[0])
        if key not in self._orders:
            self._orders[key] = SecondOrder(problem, self.unknowns.names)
        return self._orders[key]

    def _solved(
        self, number: int, curve: Curve, problem: HarmonicBalance, x: FloatArray
    ) -> list[Solved]:
        """The solutions of one curve."""
        if curve.kind != "response":
            return self._of_given(number, curve, problem, x)
        if curve.followed or not problem.single_valued:
            return self._followed(curve, problem)
        solved, starts, missed = list[Solved](), list[FloatArray](), 0.0
        for k, omega in enumerate(curve.omegas.tolist()):
            predicted = None if self._near is None else self._near.predicted(number, k, x)
            if predicted is not None:
                starts = [predicted + missed, *starts, predicted]
            solved.append(self._one(problem, omega, starts))
            # What a prediction misses changes little from one frequency to the next.
            starts = [solved[-1].state]
            missed = 0.0 if predicted is None else starts[0] - predicted
        return solved

    def _of_given(
        self, number: int, curve: Curve, problem: HarmonicBalance, x: FloatArray
    ) -> list[Solved]:
        """Peaks in given bands, or modes of given amplitudes."""
        order, near, solved = self.second_order(problem), self._near, list[Solved]()
        for k, given in enumerate(curve.given):
            self.n_solved += 1
            if curve.kind == "peak":
                beside = None if near is None else near.solved[number][k]
                solved.append(peak_of(order, problem, given, beside))
            else:
                predicted = None if near is None else near.predicted(number, k, x)
                if near is None and solved and np.isfinite(given):
                    # Motions of all amplitudes are nearly alike.
                    before = solved[-1].state
                    ratio = given / curve.given[k - 1]
                    predicted = np.append(ratio * before[:-2], before[-2:])
                solved.append(mode_of(order, problem, curve.mode, given, predicted))
        return solved

    def _response(
        self, problem: HarmonicBalance, omega: float, unknowns: FloatArray, at: Evaluation
    ) -> Solved:
        return Response(self.second_order(problem), problem, omega, unknowns, at)

    def _one(self, problem: HarmonicBalance, omega: float, starts: list[FloatArray]) -> Solved:
        """The one solution at a frequency, from the first start that leads to it."""
        self.n_solved += 1
        for start in starts:
            result = newton(partial(problem.evaluate, frequency=omega), start, damped=False)
            self.n_iterations += result.iterations
            if result.converged:
                return self._response(problem, omega, result.unknowns, result.evaluation)
        result = solve_point(problem, omega)
        self.n_iterations += result.iterations
        if not result.converged:
            raise ArithmeticError(f"no response was found at {omega / RADIANS:g} Hz")
        return self._response(problem, omega, result.unknowns, result.evaluation)

    def _followed(self, curve: Curve, problem: HarmonicBalance) -> list[Solved]:
        """The response as a sweep follows it: the first on the path that reaches a frequency."""
        ends = float(curve.omegas[0]), float(curve.omegas[-1])
        if len(curve.omegas) == 1:
            return [self._one(problem, ends[0], [])]
        branch = follow_branch(FrequencyProblem(problem), ends, _MOST_POINTS, False)
        self.n_iterations += branch.corrector.solves
        solved = []
        for omega in curve.omegas.tolist():
            found, solves = branch.at(omega)[0]
            self.n_solved, self.n_iterations = self.n_solved + 1, self.n_iterations + solves
            if found is None:
                raise ArithmeticError(f"no response was found at {omega / RADIANS:g} Hz")
            unknowns = found.state[:-1]
            evaluation = problem.evaluate(unknowns, omega)
            if evaluation.norm > ACCEPTED:
                raise ArithmeticError(f"no response was found at {omega / RADIANS:g} Hz")
            solved.append(self._response(problem, omega, unknowns, evaluation))
        return solved


@dataclass(frozen=True, eq=False)
class Point:
    """An objective at some variables ``x`` (n,), with the solutions of all curves."""

    objective: Objective
    x: FloatArray
    solved: list[list[Solved]]

    def predicted(self, number: int, k: int, x: FloatArray) -> FloatArray:
        """Unknowns where variables are others, next to a solution, to first order."""
        return self.solved[number][k].state + self._moves[number][k] @ (x - self.x)

    @cached_property
    def _sensors(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Values (n_rows, 3) of the sensors of all rows, first and second derivatives."""
        by_place = {
            place: self.objective.unknowns.of_sensor(place, self.x)
            for place in self.objective.rows.sensors
        }
        each = [by_place[place] for place in self.objective.rows.place.tolist()]
        values, slopes, curvatures = zip(*each, strict=True)
        return np.array(values), np.array(slopes), np.array(curvatures)

    @cached_property
    def _read(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Readings (n_rows,) with derivatives by cosine, sine, gain, phase and delay."""
        parts = np.zeros((self.objective.rows.n, 2))
        for curve, solved in zip(self.objective.curves, self.solved, strict=True):
            for rows, one in zip(curve.rows, solved, strict=True):
                for i in rows.tolist():
                    parts[i] = curve.seen[i] @ one.state
        rows = self.objective.rows
        return readings(rows, parts, self._sensors[0])

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
                    inner[i, :2] = curve.seen[i] @ move
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
                pull = sum(first[i, :2] @ curve.seen[i] for i in at.tolist())
                result += one.bend(np.asarray(pull), own, bend)
        return result

    @property
    def size(self) -> float:
        """Norm over all measurements of what a sensor might see at most, over their scales."""
        rows, total = self.objective.rows, 0.0
        for curve, solved in zip(self.objective.curves, self.solved, strict=True):
            for at, one in zip(curve.rows, solved, strict=True):
                chosen = at[rows.kept[at]]
                total += float(np.sum((rows.reach(chosen, one.size) / rows.scales[chosen]) ** 2))
        return float(np.sqrt(total))

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
