"""The first point: a solution at one frequency without a known neighbour."""

from dataclasses import replace
from functools import partial

import numpy as np

from symhbm.balance import Evaluation, HarmonicBalance, is_held
from symhbm.continuation.newton import NewtonResult, newton
from symhbm.continuation.path import Path
from symhbm.continuation.problem import ParameterProblem
from symhbm.continuation.status import Status
from symhbm.numerics import Factorisation, FloatArray

_REDUCTIONS = 0.1 ** np.arange(5)
"""Shares of the force tried until the response is nearly linear."""
_BESIDE = 1.01
"""Frequency, over that of a resonance without bound, of a response to start from."""


def linear_response(problem: HarmonicBalance, frequency: float) -> FloatArray | None:
    """Response with every contact held by its spring, None where it is unbounded.

    ``frequency`` in rad/s; the result (n_unknowns,) in m.
    """
    nothing = problem.evaluate(np.zeros(problem.n_unknowns), frequency)
    return Factorisation(nothing.jacobian).solve(-nothing.residual)


def solve_point(problem: HarmonicBalance, frequency: float) -> NewtonResult:
    """Solve Eq. (9) at one angular ``frequency`` [rad/s] from nothing.

    Newton's method starts from the response with all contacts stuck, then from that without
    friction; where responses are unique, first from the one with less residual force. Where both
    fail, the force grows from an amplitude at which every contact sticks and cubic springs do
    little, and the response there is followed to the full amplitude. At a resonance without damping
    that cubic springs bound, the linear response beside it is the start.
    """
    if 0 in problem.harmonics and not is_held(problem):
        nothing = np.zeros(problem.n_unknowns)
        return NewtonResult(nothing, problem.evaluate(nothing, frequency), 0, Status.NOT_HELD)
    if problem.samples is not None:
        return _solve_sampled(problem, frequency)
    stuck = linear_response(problem, frequency)
    free = linear_response(problem.with_parameters(normal_load=0.0), frequency)
    results = []

    def balance(unknowns: FloatArray) -> Evaluation:
        return problem.evaluate(unknowns, frequency)

    def left(unknowns: FloatArray) -> float:
        return float(np.linalg.norm(balance(unknowns).residual))

    starts = [start for start in (stuck, free) if start is not None]
    if not starts and not problem.single_valued:
        beside = linear_response(problem, _BESIDE * frequency)
        starts = [] if beside is None else [beside]
    for start in sorted(starts, key=left) if problem.single_valued else starts:
        results.append(newton(balance, start))
        if results[-1].converged:
            return results[-1]
    if stuck is not None:
        grown = _grow_force(problem, stuck, frequency)
        if grown is not None:
            results.append(newton(balance, grown))
    if not results:
        nothing = np.zeros(problem.n_unknowns)
        evaluation = problem.evaluate(nothing, frequency)
        return NewtonResult(nothing, evaluation, 1, Status.SYSTEM_SINGULAR)
    # An iterate may be singular where the structure is not.
    last = results[-1]
    return last if last.converged else replace(last, status=Status.NO_CONVERGENCE)


def _solve_sampled(problem: HarmonicBalance, frequency: float) -> NewtonResult:
    """Sampled friction from the response with located angles: its corners are many."""
    located = solve_point(problem.located(), frequency)
    found = newton(partial(problem.evaluate, frequency=frequency), located.unknowns)
    return replace(found, iterations=found.iterations + located.iterations)


def _grow_force(problem: HarmonicBalance, stuck: FloatArray, frequency: float) -> FloatArray | None:
    slip_margin = problem.locate(stuck).slip_margin
    slip_margin = slip_margin[np.isfinite(slip_margin)]
    share = 0.5 * np.exp(-max(slip_margin.max(initial=0.0), 0.0))
    amplitude = float(problem.parameters["force_amplitude"])
    curve = ParameterProblem(problem, "force_amplitude", frequency)
    for start in share * _REDUCTIONS:
        weak = newton(partial(curve.evaluate, value=start * amplitude), start * stuck)
        if weak.converged:
            path = Path(curve, weak.unknowns, start * amplitude, amplitude)
            points = list(path)
            if path.status == Status.REACHED_END:
                return points[-1].unknowns
    return None
