"""Responses at given frequencies: real and imaginary parts, magnitudes, phases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.continuation import ACCEPTED, FrequencyProblem, follow_branch, newton, solve_point
from symhbm.design.identification.kinds.curve import (
    Curve,
    Members,
    Nearby,
    Reading,
    Sensor,
    Solved,
    Work,
)
from symhbm.design.identification.observations import Rows
from symhbm.numerics import RADIANS, Factorisation, FloatArray

_MOST_POINTS = 5000
"""Points of one path of a response that may jump."""


@dataclass(frozen=True, eq=False)
class Response(Solved):
    """A response, whose state are its unknowns.

    It solves ``R(s, p) = 0`` and moves by ``-R_s^-1 R_p``. The second derivative of a sum of
    readings is that of the Lagrangian: one solution with the transposed Jacobian gives the
    multipliers of all parameters.
    """

    order: SecondOrder

    @property
    def _by_parameters(self) -> FloatArray:
        at = self.problem, self.motion, self.omega, self.evaluation.states
        return self.order.by_parameters(*at)

    def move(self, own: FloatArray) -> FloatArray:
        """As of any solution."""
        right = np.zeros((len(self.state), own.shape[1]))
        right[: self.problem.n_unknowns] = self._by_parameters @ own
        found = Factorisation(self.evaluation.jacobian).solve(-right)
        if found is None:
            raise ArithmeticError(f"the solution at {self.omega / RADIANS:g} Hz is singular")
        return found

    def bend(self, pull: FloatArray, own: FloatArray, bends: FloatArray) -> FloatArray:
        """As of any solution."""
        found = Factorisation(self.evaluation.jacobian.T).solve(pull)
        assert found is not None
        weights, move = found[: self.problem.n_unknowns], self.move(own)
        at = self.problem, self.motion, self.omega, weights
        hessian = self.order(*at, evaluation=self.evaluation).hessian
        along = np.vstack([move[: len(weights)], self._of_frequency(move), own])
        result = -(along.T @ (hessian @ along)) - self._added(weights, move)
        return result - np.tensordot(self._by_parameters.T @ weights, bends, 1)

    def _of_frequency(self, move: FloatArray) -> FloatArray:
        """How the frequency moves: of a response it is given."""
        return np.zeros((1, move.shape[1]))

    def _added(self, weights: FloatArray, move: FloatArray) -> Any:
        """Second derivatives of weighted forces that are not in the balance."""
        return 0.0


@dataclass(frozen=True, eq=False)
class ResponseCurve(Curve):
    """Responses at given frequencies. Where they may jump, the path of the sweep is followed."""

    forms = "real", "imaginary", "magnitude", "phase"

    @staticmethod
    def asked(rows: Rows, i: int) -> tuple[None, float]:
        """All of a sweep are of one curve, at angular frequencies [rad/s]."""
        return None, float(rows.omega[i])

    @classmethod
    def of(cls, members: Members) -> ResponseCurve:
        """As of any kind."""
        problem, rows = members.problem, members.rows
        unique = problem.single_valued and not problem.may_fold(members.names)
        if members.alike and unique and problem.samples is None:
            symmetry = problem.equal_sectors
            problem = problem if symmetry is None else problem.of_sector(symmetry)
        sensors = {i: Sensor.of(rows, i) for i in members.numbers.tolist()}
        seen = {one: _seen(problem, one) for one in dict.fromkeys(sensors.values())}
        read = {}
        for i, one in sensors.items():
            reach = 1.0 if rows.form[i] == "phase" else one.reach(rows, i)
            read[i] = Reading(seen[one], rows.form[i], reach, one.power)
        return cls._from(members, problem, read)

    @property
    def followed(self) -> bool:
        """As of any kind."""
        return not self.problem.single_valued

    def solve(self, problem: HarmonicBalance, nearby: Nearby, work: Work) -> list[Response]:
        """As of any kind."""
        if self.followed or not problem.single_valued:
            return self._along_path(problem, work)
        solved, starts, missed = list[Response](), list[FloatArray](), 0.0
        for k, omega in enumerate(self.omegas.tolist()):
            predicted = nearby[k][1] if nearby else None
            if predicted is not None:
                starts = [predicted + missed, *starts, predicted]
            solved.append(_one(problem, omega, starts, work))
            # What a prediction misses changes little from one frequency to the next.
            starts = [solved[-1].state]
            missed = 0.0 if predicted is None else starts[0] - predicted
        return solved

    def _along_path(self, problem: HarmonicBalance, work: Work) -> list[Response]:
        """The response as a sweep follows it: the first on the path that reaches a frequency."""
        ends = float(self.omegas[0]), float(self.omegas[-1])
        if len(self.omegas) == 1:
            return [_one(problem, ends[0], [], work)]
        branch = follow_branch(FrequencyProblem(problem), ends, _MOST_POINTS, False, searched=False)
        work.n_iterations += branch.corrector.solves
        solved = list[Response]()
        for omega in self.omegas.tolist():
            found, solves = branch.at(omega)[0]
            work.n_solved, work.n_iterations = work.n_solved + 1, work.n_iterations + solves
            state = None if found is None else found.state[:-1]
            evaluation = None if state is None else problem.evaluate(state, omega)
            if state is None or evaluation is None or evaluation.norm > ACCEPTED:
                raise ArithmeticError(f"no response was found at {omega / RADIANS:g} Hz")
            solved.append(Response(problem, omega, state, evaluation, work.order(problem)))
        return solved


def _seen(problem: HarmonicBalance, sensor: Sensor) -> FloatArray:
    """Cosine and sine of a harmonic that a sensor reads of the unknowns, (2, n_unknowns)."""
    row, basis = sensor.row(problem), problem.basis
    parts = np.zeros((2, basis.n_components))
    parts[0, basis.component(sensor.harmonic)] = 1.0
    if sensor.harmonic:
        parts[1, basis.component(sensor.harmonic, sine=True)] = 1.0
    return np.asarray((sp.kron(row, parts) @ problem.layout.expansion).todense())


def _one(
    problem: HarmonicBalance, omega: float, starts: Sequence[FloatArray], work: Work
) -> Response:
    """The one solution at a frequency, from the first start that leads to it, or from scratch."""
    work.n_solved += 1
    evaluate = partial(problem.evaluate, frequency=omega)
    for start in [*starts, None]:
        if start is None:
            result = solve_point(problem, omega)
        else:
            result = newton(evaluate, start, damped=False)
        work.n_iterations += result.iterations
        if result.converged:
            found = result.unknowns, result.evaluation
            return Response(problem, omega, *found, work.order(problem))
    raise ArithmeticError(f"no response was found at {omega / RADIANS:g} Hz")
