"""The front door to one point."""

from dataclasses import replace
from typing import Literal

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, check_mean, check_problem
from symhbm.continuation import FrequencyProblem, NewtonResult, SolveError, Status, solve_point
from symhbm.continuation.angles import check_angles, solve_angles
from symhbm.model import warn_of_doubts
from symhbm.numerics import RADIANS, check
from symhbm.response.accuracy import Refinement, Solution, check_accuracy
from symhbm.response.describe import describe, nothing
from symhbm.results import schema
from symhbm.time_domain import check_stability


def solve(
    problem: HarmonicBalance,
    frequency: float,
    *,
    accuracy: float | None = None,
    stability: bool = False,
    angles: Literal["newton", "rootfinder", "ipopt"] | None = None,
    throw: bool = False,
) -> xr.Dataset:
    """Solve Eq. (9) at one ``frequency`` [Hz], from nothing.

    Parameters
    ----------
    problem
        What to solve.
    frequency
        Excitation frequency [Hz].
    accuracy
        Error of the displacements that the harmonics left out may make, as in `symhbm.frf`; the
        dataset has the harmonics that takes. By default those of the problem.
    stability
        Add ``growth_rate`` and ``stability``, as in `symhbm.frf`.
    angles
        Solve Eqs. (4)-(11) with the switching angles as unknowns, by Newton's method, CasADi's
        ``rootfinder`` or IPOPT, started from the solution with located angles and checked against
        it. By default the located angles are the result.
    throw
        Raise SolveError where nothing converged.

    Returns
    -------
    Dataset without a ``point`` dimension. Where nothing converged, ``converged`` is False, the
    values are NaN and ``status`` says why, also where the form with angles as unknowns does not
    apply to the motion. Where cubic springs make several solutions, it is one of them; `frf` finds
    those on one connected branch, which need not be all.

    Raises
    ------
    TypeError, ValueError
        If the frequency is not positive and finite; for angles as unknowns, if there is no such
        solver, a harmonic is even, or friction is sampled.
    SolveError
        If nothing converged and ``throw`` is True.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.PointForce())
    >>> sh.solve(problem, 19.5).amplitude.values.round(8)
    array([0.00030797])
    """
    check_problem(problem)
    frequency = check.scalar("frequency", frequency, "positive")
    problem.check_frequencies("frequency", frequency)
    if accuracy is None:  # else the set is made complete
        check_mean(problem)
    warn_of_doubts(problem.model, (frequency, frequency))
    if angles is not None:
        check_angles(problem, angles)
    target, wanted = check_accuracy(problem, accuracy), check_stability(problem, stability)
    problem, found, error = _solved(problem, RADIANS * frequency, target)
    stability = wanted or not problem.single_valued
    point = describe(problem, found.unknowns, frequency, found.iterations, stability)
    status: str = found.status
    if found.converged and not point["converged"]:
        status = Status.NO_CONVERGENCE
    if status == Status.SUCCESS and angles is not None:
        result = solve_angles(problem, RADIANS * frequency, angles, found.unknowns)
        status, iterations = result.status, found.iterations + result.iterations
        if result.converged:
            point = describe(problem, result.unknowns, frequency, iterations, stability)
            point |= {"theta_0": result.theta_0, "theta_star": result.theta_star}
        else:
            blank = nothing(problem, 1, stability) | {"iterations": np.array([iterations])}
            point = {name: values[0] for name, values in blank.items()}
    if target is not None:
        point["highest_harmonic"] = np.int32(problem.basis.highest)
        point["truncation_error"] = np.float64(error if point["converged"] else np.nan)
        if status == Status.SUCCESS and error > target:
            status = Status.ACCURACY_NOT_REACHED
    result = schema.label_point(problem, frequency, point, str(status), target)
    if throw and status != Status.SUCCESS:
        raise SolveError(f"frequency={frequency:g} Hz: {status}", result)
    return result


def _solved(
    problem: HarmonicBalance, frequency: float, accuracy: float | None
) -> tuple[HarmonicBalance, NewtonResult, float]:
    """The problem with the harmonics it takes, its solution and the error of that."""
    if accuracy is None:
        return problem, solve_point(problem, frequency), np.nan
    refinement = Refinement(problem, FrequencyProblem, accuracy)
    problem = refinement.curve(0).problem
    found = solve_point(problem, frequency)
    if not found.converged:
        return problem, found, np.nan
    response = Solution(frequency, 0, found.unknowns, np.nan, found.iterations)
    response = refinement.settle(response)
    problem = refinement.curve(response.level).problem
    assert response.unknowns is not None
    found = replace(found, unknowns=response.unknowns, iterations=response.solves)
    return problem, found, response.error
