"""The first point of a path: a solution at one frequency without a neighbouring solution.

What nothing drives rests where static loads hold it: Newton's method compares steps with the size
of a motion, and has none there.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from symhbm.balance import Evaluation, HarmonicBalance, is_held
from symhbm.continuation.newton import NewtonResult, newton
from symhbm.continuation.path import Path
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem, ParameterProblem
from symhbm.continuation.status import Status
from symhbm.numerics import Factorisation, FloatArray, full, on_one_thread

_REDUCTIONS = 0.1 ** np.arange(5)
"""Shares of the force tried until the response is nearly linear."""
_OFF_RESONANCE = 1.01
"""Frequency of a linear response to start from, over that of an unbounded resonance."""
_BESIDE = (1.05, 0.95, 1.25, 0.8)
"""Frequencies from which a response is followed, over that where Newton's method fails."""


def linear_response(problem: HarmonicBalance, frequency: float) -> FloatArray | None:
    """Response with all contacts stuck, None where it is unbounded.

    ``frequency`` in rad/s; the result (n_unknowns,) in m. Contacts are closed that are so at rest.
    """
    rest = position_at_rest(problem, frequency)
    at_rest = problem.evaluate(rest, frequency)
    step = Factorisation(at_rest.jacobian).solve(-at_rest.residual)
    return None if step is None else rest + step


@on_one_thread
def solve_point(problem: HarmonicBalance, frequency: float) -> NewtonResult:
    """Solve Eq. (9) at one angular ``frequency`` [rad/s] without a guess.

    Newton's method starts from the response with all contacts stuck, then from that without
    friction; where responses are unique, first from the one with less residual force. Where both
    fail, the response is followed from a small force, at which every contact sticks and cubic
    springs hardly act, to the full force, and where there may be several from frequencies
    beside. At an undamped resonance, which only cubic springs bound, the start is the linear
    response beside it.
    """
    if not problem.excitation.amplitude:
        rest = state_of_rest(problem, frequency)
        if rest is not None:
            return NewtonResult(rest, problem.evaluate(rest, frequency), 1, Status.SUCCESS)
    result = _solve_at(problem, frequency)
    failed = result.status == Status.NO_CONVERGENCE and problem.samples is None
    if failed and not problem.single_valued and problem.model.has_matrices:
        return _from_beside(problem, frequency) or result
    return result


def _solve_at(problem: HarmonicBalance, frequency: float) -> NewtonResult:
    """As `solve_point`, at this frequency alone."""
    if 0 in problem.harmonics and not is_held(problem):
        at_rest = np.zeros(problem.n_unknowns)
        return NewtonResult(at_rest, problem.evaluate(at_rest, frequency), 0, Status.NOT_HELD)
    if problem.samples is not None:
        return _solve_sampled(problem, frequency)
    stuck = linear_response(problem, frequency)
    free = linear_response(problem.released(), frequency)
    results = []

    def balance(unknowns: FloatArray) -> Evaluation:
        return problem.evaluate(unknowns, frequency)

    def residual_size(unknowns: FloatArray) -> float:
        return float(np.linalg.norm(balance(unknowns).residual))

    starts = [start for start in (stuck, free) if start is not None]
    if not starts and not problem.single_valued:
        off_resonance = linear_response(problem, _OFF_RESONANCE * frequency)
        starts = [] if off_resonance is None else [off_resonance]
    for start in sorted(starts, key=residual_size) if problem.single_valued else starts:
        results.append(newton(balance, start))
        if results[-1].converged:
            return results[-1]
    if stuck is not None:
        grown = _grow_force(problem, stuck, frequency)
        if grown is not None:
            results.append(newton(balance, grown))
    if not results:
        at_rest = np.zeros(problem.n_unknowns)
        evaluation = problem.evaluate(at_rest, frequency)
        singular = np.isfinite(evaluation.norm)
        status = Status.SYSTEM_SINGULAR if singular else Status.UNDEFINED_FORCE
        return NewtonResult(at_rest, evaluation, 1, status)
    # The equations may be singular at an iterate although the structure is regular.
    last = results[-1]
    known = last.converged or last.status == Status.UNDEFINED_FORCE
    return last if known else replace(last, status=Status.NO_CONVERGENCE)


def _from_beside(problem: HarmonicBalance, frequency: float) -> NewtonResult | None:
    """The response followed along the frequency, None where no path comes from beside."""
    for start in np.array(_BESIDE) * frequency:
        beside = _solve_at(problem, start)
        if not beside.converged:
            continue
        end = Path(FrequencyProblem(problem), beside.unknowns, start, frequency).end()
        if end is not None:
            result = newton(partial(problem.evaluate, frequency=frequency), end.unknowns)
            if result.converged:
                return result
    return None


def _solve_sampled(problem: HarmonicBalance, frequency: float) -> NewtonResult:
    """The solution with sampled friction, which has many corners, from that with located angles."""
    located = solve_point(problem.located(), frequency)
    result = newton(partial(problem.evaluate, frequency=frequency), located.unknowns)
    return replace(result, iterations=result.iterations + located.iterations)


def _grow_force(problem: HarmonicBalance, stuck: FloatArray, frequency: float) -> FloatArray | None:
    margins = problem.locate(stuck, frequency).margins
    margins = margins[np.isfinite(margins)]
    share = 0.5 * np.exp(-margins.max(initial=0.0))
    amplitude = problem.excitation.amplitude
    if not amplitude:
        return None
    curve = ParameterProblem(problem, "force_amplitude", frequency)
    rest = position_at_rest(problem, frequency)
    for start in share * _REDUCTIONS:
        near = rest + start * (stuck - rest)
        small = newton(partial(curve.evaluate, value=start * amplitude), near)
        if small.converged:
            end = Path(curve, small.unknowns, start * amplitude, amplitude).end()
            if end is not None:
                return end.unknowns
    return None


class AtRest:
    """The equations of harmonic 0, without vibration, at an angular frequency [rad/s]."""

    def __init__(self, problem: HarmonicBalance, omega: float):
        self.problem, self.omega = problem, omega
        still = problem.basis.order == 0
        self.places = np.flatnonzero(np.tile(still, problem.n_dof))

    def whole(self, displacement: FloatArray) -> FloatArray:
        """Unknowns of the balance (n_unknowns,) of a displacement (n_dof,) [m]."""
        unknowns = np.zeros(self.problem.n_unknowns)
        unknowns[self.places] = displacement
        return unknowns

    def __call__(self, displacement: FloatArray) -> Evaluation:
        """The balance of forces and its derivative by the displacement."""
        evaluation = self.problem.evaluate(self.whole(displacement), self.omega)
        jacobian = full(evaluation.jacobian)[np.ix_(self.places, self.places)]
        parts = evaluation.residual[self.places], evaluation.by_parameter[self.places]
        return replace(evaluation, residual=parts[0], jacobian=jacobian, by_parameter=parts[1])


def position_at_rest(problem: HarmonicBalance, frequency: float) -> FloatArray:
    """Where static loads hold a structure without other forces, (n_unknowns,) [m].

    Newton's method starts from where all contacts are closed. Nothing moves where responses are
    unique: there the start does not matter.
    """
    rest = np.zeros(problem.n_unknowns)
    if problem.single_valued or not problem.loaded:
        return rest
    still = problem
    if problem.excitation.amplitude:
        still = problem.with_parameters(force_amplitude=0.0)
    at_rest = still.closed().evaluate(rest, frequency)
    closed = Factorisation(at_rest.jacobian).solve(-at_rest.residual)
    found = newton(partial(still.evaluate, frequency=frequency), rest if closed is None else closed)
    return found.unknowns if found.converged else rest


def state_of_rest(problem: HarmonicBalance, frequency: float) -> FloatArray | None:
    """Unknowns (n_unknowns,) [m] where static loads hold a structure, None where none is found."""
    if not problem.loaded:
        return np.zeros(problem.n_unknowns)
    at_rest = AtRest(problem, frequency)
    result = newton(at_rest, position_at_rest(problem, frequency)[at_rest.places])
    return at_rest.whole(result.unknowns) if result.converged else None


def points_at_rest(curve: ContinuationProblem, band: tuple[float, float]) -> list[PathPoint] | None:
    """The points at both ends of a band, None where no state of rest is found."""
    points = []
    for value in band:
        unknowns = state_of_rest(*curve.at(value))
        if unknowns is None:
            return None
        evaluation, state = curve.evaluate(unknowns, value), np.append(unknowns, value)
        scale, states = curve.scale(state), evaluation.states
        along = np.zeros(len(state))
        along[-1] = np.sign(band[1] - band[0]) * scale[-1]
        point = PathPoint(
            state=state,
            scale=scale,
            before=along,
            after=along,
            switches=states.switches,
            margins=states.margins,
            rate=np.zeros(len(states.margins)),
            residual_norm=evaluation.norm,
            amplification=0.0,
            resonances_below=None,
            solves=1,
        )
        points.append(point)
    return points
