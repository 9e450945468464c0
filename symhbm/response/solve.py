"""`solve`: the response at one frequency; `static_states`: where a structure rests without one.

States of rest under static loads tell which contacts are closed, and in how many ways.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, check_mean, check_problem, is_held
from symhbm.continuation import (
    AtRest,
    FrequencyProblem,
    NewtonResult,
    SolveError,
    Status,
    deflated_steps,
    newton,
    other_solution,
    solve_point,
    step_of,
)
from symhbm.continuation.angles import check_angles, solve_angles
from symhbm.model import warn_of_doubts
from symhbm.model.contacts import NormalLaw
from symhbm.numerics import RADIANS, FloatArray, Table, check
from symhbm.response.accuracy import Refinement, Solution, advice, check_accuracy, truncation_table
from symhbm.response.describe import describe, results_of_contacts, unsolved
from symhbm.results import Angles, schema
from symhbm.time_domain import check_stability
from symhbm.workers import unkept

_MOST_PATTERNS = 64
"""Patterns of open and closed contacts that are tried as starts."""
_SAME = 1e-8
"""Distance of two states, relative to their size, up to which they are one."""
_NUDGES = 10.0 ** np.arange(-6, 2)
"""Distances from a state at which others are looked for [m]."""
_INDIFFERENT = 1e-12
"""Smallest stiffness, over the largest, that holds something."""


@unkept("a solution")
def solve(
    problem: HarmonicBalance,
    frequency: float,
    *,
    accuracy: float | None = None,
    stability: bool | None = None,
    angles: Angles | None = None,
    throw: bool = False,
) -> xr.Dataset:
    """Solve Eq. (9) at one ``frequency`` [Hz], without a guess.

    Parameters
    ----------
    problem
        What to solve.
    frequency
        Excitation frequency [Hz].
    accuracy
        Largest error by truncation of the harmonics, as in `symhbm.frf`; the dataset has the
        harmonics that this needs. By default it has those of the problem.
    stability
        Add ``growth_rate`` and ``stability``, as in `symhbm.frf`.
    angles
        Solve Eqs. (4)-(11) with the switching angles as unknowns, by Newton's method, CasADi's
        ``rootfinder`` or IPOPT, started from the solution with located angles and checked against
        it. By default the located angles are the result.
    throw
        Raise SolveError where it did not converge.

    Returns
    -------
    Dataset without a ``point`` dimension. Where it did not converge, ``converged`` is False, the
    values are NaN and ``status`` says why, also where the form with angles as unknowns does not
    apply to the motion. Where cubic springs make several solutions, it is one of them; `frf` finds
    those on one connected branch, which need not be all.

    Raises
    ------
    TypeError, ValueError
        If the frequency is not positive and finite; for angles as unknowns, if there is no such
        solver, a harmonic is even, or friction is sampled.
    SolveError
        If it did not converge and ``throw`` is True.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> sh.solve(problem, 19.5).amplitude.values.round(8)
    array([0.00030797])
    """
    check_problem(problem)
    frequency = check.scalar("frequency", frequency, "positive")
    problem.model.check_frequencies("frequency", frequency)
    check_mean(problem, growing=accuracy is not None)
    warn_of_doubts(problem.model, (frequency, frequency), problem.harmonics)
    if angles is not None:
        check_angles(problem, angles)
    accuracy = check_accuracy(problem, accuracy)
    if stability is not None:
        stability = check_stability(problem, stability)
    problem, solution, error, normal = _solved(problem, RADIANS * frequency, accuracy)
    stability = not problem.single_valued if stability is None else stability
    point = describe(problem, solution.unknowns, frequency, solution.iterations, stability)
    status: str = solution.status
    if solution.converged and not point["converged"]:
        status = Status.NO_CONVERGENCE
    if status == Status.SUCCESS and angles is not None:
        result = solve_angles(problem, RADIANS * frequency, angles, solution.unknowns)
        status, iterations = result.status, solution.iterations + result.iterations
        if result.converged:
            point = describe(problem, result.unknowns, frequency, iterations, stability)
            point |= {"theta_0": result.theta_0, "theta_star": result.theta_star}
        else:
            blank = unsolved(problem, 1, stability) | {"iterations": np.array([iterations])}
            point = {name: values[0] for name, values in blank.items()}
    if accuracy is not None:
        errors = ([error], [normal]) if point["converged"] else ([np.nan], ())
        truncation = truncation_table(problem, *errors)
        point |= {name: values[0] for name, values in truncation.items()}
        if status == Status.SUCCESS and error > accuracy:
            status = Status.ACCURACY_NOT_REACHED + advice(problem, error, accuracy)
    point.pop("doubling", None)
    result = schema.label_point(problem, frequency, point, str(status), accuracy)
    if throw and status != Status.SUCCESS:
        raise SolveError(f"frequency={frequency:g} Hz: {status}", result)
    return result


def _solved(
    problem: HarmonicBalance, frequency: float, accuracy: float | None
) -> tuple[HarmonicBalance, NewtonResult, float, FloatArray]:
    """The problem with the harmonics that the accuracy needs, its solution and truncation errors.

    The last are those of normal forces.
    """
    unknown = np.zeros(0)
    if accuracy is None:
        return problem, solve_point(problem, frequency), np.nan, unknown
    refinement = Refinement(problem, FrequencyProblem, accuracy)
    problem = refinement.equations(0).problem
    start = solve_point(problem, frequency)
    if not start.converged:
        return problem, start, np.nan, unknown
    solution = Solution(frequency, 0, start.unknowns, np.nan, start.iterations)
    solution = refinement.settle(solution)
    problem = refinement.equations(solution.level).problem
    assert solution.unknowns is not None
    result = replace(start, unknowns=solution.unknowns, iterations=solution.solves)
    return problem, result, solution.error, solution.normal


def static_states(
    problem: HarmonicBalance, *, frequency: float = 0.0, throw: bool = False
) -> xr.Dataset:
    """States of rest under the static loads, ``K x + sum w f(w^T x) = F_0``, without vibration.

    Parameters
    ----------
    problem
        What rests: its static loads act, what oscillates does not. Its harmonics do not matter.
    frequency
        Excitation frequency [Hz], for loads of contacts that depend on it.
    throw
        Raise SolveError where no state is found.

    Returns
    -------
    Dataset along ``solution``: ``static_displacement`` [m] of each degree of freedom, and of each
    contact ``contact_state`` (0 closed, 3 apart, -1 where its law does not tell) and
    ``mean_normal_force`` [N]. ``stability`` is 1 where the potential energy has a minimum, 0 where
    it has none, -1 where something moves freely. Friction bears any tangential force up to its
    limit at rest; the state is that without one, as harmonic 0 of `frf` is. Starts are all patterns
    of open and closed contacts of a few contacts, and deflation from each state: with springs that
    only push there is one state, with other laws some may be missing. ``status`` is a sentence.

    Raises
    ------
    TypeError, ValueError
        For bad arguments, a problem of one sector, or of a structure without matrices.
    SolveError
        If no state is found and ``throw`` is True.

    Examples
    --------
    A blade that a static load presses against a stop behind a gap of 1 mm:

    >>> import symhbm as sh
    >>> blade = sh.Model(
    ...     [[1.0]], [[2.0]], [[1e4]],
    ...     contacts={"stop": sh.Gap(normal=(0,), normal_stiffness=2e4, gap=1e-3)},
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce() + sh.forces.StaticLoad([40.0]))
    >>> sh.static_states(problem).static_displacement.values.round(6)
    array([[0.002]])
    """
    check_problem(problem, whole=True)
    if problem.symmetry is not None:
        raise ValueError("problem: expected one of the whole structure, this is of one sector")
    omega = RADIANS * check.scalar("frequency", frequency, "non-negative")
    harmonics = tuple(sorted({0, *problem.harmonics}))
    rest = problem.with_harmonics(harmonics).with_parameters(force_amplitude=0.0)
    at_rest = AtRest(rest, omega)
    if not is_held(rest):
        states, status = [], Status.NOT_HELD
    else:
        states = _states(at_rest)
        status = Status.SUCCESS if states else Status.NO_CONVERGENCE
    result = schema.label_static(rest, _described(at_rest, states), str(status))
    if throw and status != Status.SUCCESS:
        raise SolveError(str(status), result)
    return result


def _states(at_rest: AtRest) -> list[NewtonResult]:
    """All states that starts and deflation lead to, the stable ones first."""
    found: list[NewtonResult] = []

    def solve(start: FloatArray) -> NewtonResult:
        return newton(at_rest, start)

    def add(start: FloatArray) -> None:
        result = solve(start)
        size = np.linalg.norm(result.unknowns)
        distances = [np.linalg.norm(result.unknowns - known.unknowns) for known in found]
        if result.converged and all(d > _SAME * size for d in distances):
            found.append(result)

    starts = list(_starts(at_rest))
    for start in starts:
        add(start)
    for known in found:  # which grows
        jacobian = known.evaluation.jacobian
        softest = np.linalg.eigh((jacobian + jacobian.T) / 2)[1][:, 0]  # the least stiff direction
        away = [known.unknowns + sign * s * softest for s in _NUDGES for sign in (1, -1)]
        approach = partial(deflated_steps, lambda unknowns: step_of(at_rest(unknowns)))
        other = other_solution(approach, solve, known.unknowns, [*starts, *away])
        for start in away if other is None else [other, *away]:
            add(start)
    return sorted(found, key=lambda state: (-_verdict(state), np.linalg.norm(state.unknowns)))


def _starts(at_rest: AtRest) -> Iterator[FloatArray]:
    """Nothing, and the linear states of patterns of open and closed contacts."""
    problem = at_rest.problem
    model = problem.model
    yield np.zeros(problem.n_dof)
    stiffness, directions = model.static_stiffness.toarray(), model.directions.toarray()
    force = problem.force(at_rest.omega)[:, 0]
    springs, loads, rows = [], [], []
    for group in model.groups:
        if isinstance(group.law, NormalLaw) and "normal" in group.law.directions:
            values = group.values
            load = np.broadcast_to(group.law.load(at_rest.omega, values), group.n)
            balanced = np.maximum(load, 0) if group.law.preload == "balanced" else 0 * load
            springs += np.broadcast_to(values["normal_stiffness"], group.n).tolist()
            loads += np.column_stack([load, balanced]).tolist()
            rows += group.rows[:, group.law.directions.index("normal")].tolist()
    n = len(rows)
    patterns = product((1, 0), repeat=n) if 2**n <= _MOST_PATTERNS else [(1,) * n, (0,) * n]
    for pattern in patterns if n else [()]:
        matrix, right = stiffness.copy(), force.copy()
        contacts = zip(pattern, springs, loads, rows, strict=True)
        for closed, spring, (load, balanced), row in contacts:
            normal = directions[row]
            matrix += closed * spring * np.outer(normal, normal)
            right -= (closed * load - balanced) * normal
        yield np.linalg.lstsq(matrix, right, rcond=None)[0]


def _verdict(state: NewtonResult) -> int:
    """1 at a minimum of the potential energy, 0 at none, -1 where something moves freely."""
    jacobian = state.evaluation.jacobian
    sizes = np.linalg.eigvals(jacobian).real
    if np.abs(sizes).min() <= _INDIFFERENT * np.abs(sizes).max():
        return -1
    return int(sizes.min() > 0)


def _described(at_rest: AtRest, states: list[NewtonResult]) -> Table:
    """Results of the states by the names of the dataset."""
    problem, omega = at_rest.problem, at_rest.omega
    motions = [at_rest.whole(state.unknowns) for state in states]
    located = [
        (motion[None], np.array([omega]), problem.locate(motion, omega)) for motion in motions
    ]
    contacts = [results_of_contacts([problem], *state) for state in located]

    def of_contacts(name: str, kind: type) -> np.ndarray:
        rows = [table[name][0] for table in contacts if name in table]
        return np.array(rows, dtype=kind).reshape(len(rows), problem.n_contacts)

    displacement = np.array([state.unknowns for state in states]).reshape(-1, problem.n_dof)
    force = of_contacts("mean_normal_force", float)
    result: Table = dict(
        static_displacement=displacement,
        contact_state=of_contacts("contact_state", np.int8),
        stability=np.array([_verdict(state) for state in states], dtype=np.int8),
        residual_norm=np.array([state.evaluation.norm for state in states], dtype=float),
    )
    return result | ({"mean_normal_force": force} if np.isfinite(force).any() else {})
