"""The verb `minimise_peak`: parameters that minimise the largest response."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance, advise_condensing, check_mean, check_problem
from symhbm.continuation import SolveError, Status
from symhbm.design import arguments
from symhbm.design.cases import Bands, Cases, Work
from symhbm.design.certificate import certificate, status_of
from symhbm.design.program import Program, Statistic
from symhbm.design.report import infeasible, report, report_of_fresh, with_certificate
from symhbm.design.search import SearchResult, search
from symhbm.design.variables import DesignVariables
from symhbm.model import DOUBT, warn_of_doubts
from symhbm.model.linear import natural_band
from symhbm.numerics import check
from symhbm.peaks import COMPLETE
from symhbm.response import frf
from symhbm.results import Sweep, parse
from symhbm.workers import check_executor, check_progress

if TYPE_CHECKING:
    from scipy.optimize import LinearConstraint

_GOOD = (Status.DESIGN_OPTIMAL, Status.DESIGN_AT_BOUND)
"""Statuses of an optimum."""


def minimise_peak(
    problem: HarmonicBalance,
    parameters: str | Sequence[str],
    bounds: Any,
    frequency: ArrayLike | None = None,
    over: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    vary: Any = "common",
    statistic: Literal["worst", "mean", "tail"] = "worst",
    tail: float = 0.1,
    constraint: LinearConstraint | None = None,
    start: ArrayLike | None = None,
    n_starts: int | None = None,
    fresh: Mapping[str, Any] | xr.Dataset | None = None,
    executor: Executor | None = None,
    throw: bool = False,
    progress: bool | None = None,
) -> xr.Dataset:
    """Parameters that make the largest response as small as it gets, with a certificate.

    The maxima over the frequency, smooth peaks, corners and ends of the band, are functions of the
    parameters with exact first and second derivatives; their largest is minimised in a trust region
    of quadratic models by IPOPT, from several starts, and the whole response is followed at the
    optimum. There is no library of responses and no grid.

    Parameters
    ----------
    problem
        What to design.
    parameters
        Names of the parameters to choose: ``normal_load``, ``contact_stiffness``,
        ``friction_coefficient``, or those of the blades.
    bounds
        Lower and upper value, positive; a mapping by name for several parameters.
    frequency
        First and last frequency [Hz], several such pairs, or a DataArray of pairs over the
        dimensions of ``over``; by default a band that holds all resonances.
    over
        Cases: parameters to sweep as in `frf`, for example ``{"engine_order": [1, 3]}`` or samples
        of mistuning. Swept values of a parameter that is designed are taken relative to the
        problem's, and stay in proportion.
    vary
        Which values of a parameter are one variable: all (``"common"``), ``"each"``, or those of
        equal numbers in a pattern that repeats, for example ``[0, 1]``; a mapping by name for
        several parameters.
    statistic
        Statistic of the largest responses of the cases to minimise: the worst, their mean, or the
        mean of the worst share ``tail`` of them (the conditional value at risk).
    constraint
        On the values of the variables, in their order, for example
        ``LinearConstraint(np.ones(13) / 13, 2.0, 2.0)`` for a given mean of 13.
    start
        Values to start from, one or one per variable, beside those that are spread over the bounds.
    n_starts
        Number of those that are spread; by default one per factor of 25, at least 3. Where values
        of one parameter may differ, the best equal ones are found first, and these are as many
        designs around them, by default 2.
    fresh
        Other cases, not designed for, whose statistic at the optimum is reported.
    executor
        Where the cases are computed; by default in this process.
    throw
        Raise SolveError where no optimum was found instead of returning its status.
    progress
        By default, show a bar when it takes longer than a few seconds; True: at once, False: never.

    Returns
    -------
    Dataset as that of `frf` at the optimum (`symhbm.rebuild` gives the optimal problem), with the
    values along ``variable``, the active maxima along ``active``, with multipliers that sum to 1,
    all starts and descents, derivatives by every parameter, ``design_status`` and the
    ``certificate``: sentences on what is proved and what is not.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    SolveError
        If there is no optimum and ``throw`` is True; its ``result`` is the dataset.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.PointForce())
    >>> best = sh.minimise_peak(problem, "normal_load", bounds=(0.1, 100), frequency=(5, 40))
    >>> best.design_value.values.round(6), best.design_status.item() == sh.Status.DESIGN_OPTIMAL
    (array([3.088579]), True)
    """
    check_problem(problem, bends=True)
    advise_condensing(problem, "second derivatives take minutes")
    check_executor(executor)
    if problem.samples is not None:
        raise ValueError(
            f"problem: expected located switching angles, got friction over {problem.samples} "
            "samples, which has no second derivatives"
        )
    throw = check.flag("throw", throw)
    sweep = parse(problem, over)
    arguments.check_dimensions(sweep)
    arguments.check_forces(problem, sweep)
    variables = arguments.read_variables(problem, parameters, bounds, vary)
    arguments.check_ratios(problem, variables, sweep)
    if statistic not in [str(member) for member in Statistic]:
        raise ValueError(f"statistic={check.shown(statistic)}: expected 'worst', 'mean' or 'tail'")
    if not 0 < check.scalar("tail", tail) <= 1:
        raise ValueError(f"tail={check.shown(tail)}: expected a share above 0, up to 1")
    program = Program(
        variables, Statistic(statistic), tail, arguments.read_constraint(variables, constraint)
    )
    fixed_start = arguments.read_start(variables, start)
    check_mean(problem)
    if frequency is None:
        frequency = _resonances(problem, sweep, variables)
    bands = arguments.read_bands(frequency, sweep)
    problem.model.check_frequencies("frequency", _hull(bands))
    moving = {*variables.names, *sweep.values}
    warn_of_doubts(problem.model, _hull(bands), problem.harmonics, moving=moving)
    if n_starts is not None:
        n_starts = check.integer("n_starts", n_starts, minimum=1)
    fresh_sweep = None if fresh is None else parse(problem, fresh, "fresh")
    if fresh_sweep is not None:
        arguments.check_ratios(problem, variables, fresh_sweep, "fresh")
        arguments.check_forces(problem, fresh_sweep)
        if len(set(bands)) > 1:
            raise ValueError("fresh: expected None where cases have bands of their own")
    if not program.feasible():
        return _checked(infeasible(problem, variables), throw)
    work = Work(problem, sweep, variables, bands)
    cases = Cases(work, executor, check_progress(progress))
    search_result = search(program, cases, [] if fixed_start is None else [fixed_start], n_starts)
    status = status_of(program, search_result)
    result = _responses(problem, program, search_result, sweep, bands, executor, progress)
    if status in _GOOD and not bool(result["status"].isin([*map(str, COMPLETE)]).all()):
        status = Status.DESIGN_NOT_SURVEYED
    dims = dict(zip(sweep.dims, sweep.shape, strict=True))
    result = result.merge(report(program, cases, search_result, dims))
    hulls = sorted({band for case_bands in bands for band in case_bands})
    text = certificate(program, search_result, hulls, sweep.size, cases.unique)
    if fresh_sweep is not None:
        fresh_cases = cases.changed(sweep=fresh_sweep, bands=[bands[0]] * fresh_sweep.size)
        states = fresh_cases(search_result.design.x)
        result = result.merge(report_of_fresh(problem, program, [state.height for state in states]))
        text += (
            f" Over {fresh_sweep.size} cases that were not designed for, the same statistic is "
            f"{float(result['fresh_amplitude']):.6g} m."
        )
    return _checked(with_certificate(result, status, text), throw)


def _resonances(
    problem: HarmonicBalance, sweep: Sweep, variables: DesignVariables
) -> tuple[float, float]:
    """A band [Hz] that holds the resonances of all cases at all designs."""
    models = []
    for number in range(sweep.size):
        chosen = sweep.chosen(number)
        case, own = problem.with_parameters(**chosen), variables.proportional(problem, chosen)
        models += [own.problem(case, x).model for x in (variables.lower, variables.upper)]
    return natural_band(models)


def _responses(
    problem: HarmonicBalance,
    program: Program,
    search_result: SearchResult,
    sweep: Sweep,
    bands: list[Bands],
    executor: Executor | None,
    progress: bool | None,
) -> xr.Dataset:
    """Frequency responses of all cases at a design, over the hull of all bands."""
    variables, x = program.variables, search_result.design.x
    over: dict[str, Any] = {k: v for k, v in sweep.values.items() if k not in variables.names}
    own = [variables.proportional(problem, sweep.chosen(i)) for i in range(sweep.size)]
    for name in [name for name in variables.names if name in sweep.values]:
        values = [of_case.parameters(problem, x)[name] for of_case in own]
        inner, coords = problem.model.dims_of(name), sweep.values[name].coords
        labels = {str(label): coords[label] for label in coords if label not in inner}
        array = np.reshape(values, (*sweep.shape, *np.shape(values[0])))
        over[name] = xr.DataArray(array, dims=(*sweep.dims, *inner), coords=labels)
    best = variables.problem(problem, x)
    with warnings.catch_warnings():
        # The problem was warned of already.
        warnings.filterwarnings("ignore", message=DOUBT)
        return frf(best, _hull(bands), over=over or None, executor=executor, progress=progress)


def _hull(bands: list[Bands]) -> tuple[float, float]:
    edges = np.array([band for case_bands in bands for band in case_bands])
    return float(edges.min()), float(edges.max())


def _checked(result: xr.Dataset, throw: bool) -> xr.Dataset:
    status = str(result["design_status"].item())
    if throw and status not in _GOOD:
        raise SolveError(status, result)
    return result
