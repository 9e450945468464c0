"""`solve`: the response at one frequency."""

from dataclasses import replace

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, check_mean, check_problem
from symhbm.continuation import FrequencyProblem, NewtonResult, SolveError, Status, solve_point
from symhbm.continuation.angles import check_angles, solve_angles
from symhbm.model import warn_of_doubts
from symhbm.numerics import RADIANS, FloatArray, check
from symhbm.response.accuracy import Refinement, Solution, advice, check_accuracy, truncation_table
from symhbm.response.describe import describe, unsolved
from symhbm.results import Angles, schema
from symhbm.time_domain import check_stability
from symhbm.workers import unkept


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
