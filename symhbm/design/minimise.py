"""The verb `minimise_peak`: parameters that minimise the largest response."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.design import arguments
from symhbm.design.cases import Cases
from symhbm.design.outcome import (
    certificate,
    checked,
    infeasible,
    is_complete,
    report,
    report_of_fresh,
    status_of,
    with_certificate,
)
from symhbm.design.search import feasible, search
from symhbm.design.task import Task
from symhbm.numerics import check
from symhbm.results import Sweep, parse, runs
from symhbm.workers import unkept

_GOOD = (Status.DESIGN_OPTIMAL, Status.DESIGN_AT_BOUND)
"""Statuses of an optimum."""


@unkept("a design")
def minimise_peak(
    problem: HarmonicBalance,
    parameters: str | Sequence[str],
    bounds: Any,
    frequency_band: ArrayLike | None = None,
    over: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    vary: Any = "common",
    statistic: Literal["worst", "mean", "tail"] = "worst",
    tail: float = 0.1,
    constraint: Any = None,
    objective: Callable[[Any, Any], Any] | None = None,
    peaks: Mapping[str, Mapping[str, Any]] | None = None,
    start: ArrayLike | None = None,
    n_starts: int | None = None,
    fresh: Mapping[str, Any] | xr.Dataset | None = None,
    **run: Unpack[runs.Sharing],
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
        Lower and upper value, positive; a mapping by name for several parameters, or
        ``scipy.optimize.Bounds`` on all variables in their order.
    frequency_band
        First and last frequency [Hz], several such pairs, one frequency whose response alone
        counts, or a DataArray of pairs or of frequencies over the dimensions of ``over``; by
        default a band that holds all resonances.
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
        ``scipy.optimize.LinearConstraint`` or ``NonlinearConstraint`` on the values of the
        variables, in their order, for example ``LinearConstraint(np.ones(13) / 13, 2.0, 2.0)`` for
        a given mean of 13; a function of the parameters that returns relations, for example
        ``lambda p: p["friction_coefficient"] * p["normal_load"] <= 2``; or several of these.
        Functions are called once, with CasADi's symbols: their derivatives are exact.
    objective
        What to make as small as it gets in place of the largest response: a function of peaks [m]
        and parameters, both mappings by name to CasADi's symbols, that returns one expression, for
        example ``lambda peaks, parameters: peaks["tip"] * (1 + parameters["normal_load"][0])``.
        Parameters are columns with one value per blade or contact. It is positive, and falls with
        no peak that rises; ``statistic`` is that of each peak.
    peaks
        The peaks that it is called with, by name: mappings with ``frequency``, bands as below,
        ``dof``, the one whose response counts, ``goal``, one of ``symhbm.goals`` in the place of
        the response, or ``problem``, another one that has the same parameters. By default one,
        ``"largest"``.
    start
        Values to start from, one or one per variable, beside those that are spread over the bounds.
    n_starts
        Number of those that are spread; by default one per factor of 25, at least 3, and eight
        times as many where an end of a band is the highest at the best of them. Where values
        of one parameter may differ, the best equal ones are found first, and these are as many
        designs around them, by default 2.
    fresh
        Other cases, not designed for, whose statistic at the optimum is reported.
    **run
        ``executor`` (of the cases), ``throw`` (where no optimum was found) and ``progress``, as
        `symhbm.Run` tells.

    Returns
    -------
    Dataset as that of `frf` at the optimum (`symhbm.datasets.rebuild` gives the optimal problem),
    with the values along ``variable``, the active maxima along ``active``, with multipliers that
    sum to 1, all starts and descents, derivatives by every parameter, ``status`` and the
    ``certificate``: sentences on what was computed and checked, and what was not. With an
    ``objective`` it has ``design_aim`` in place of ``design_amplitude`` [m], the peaks along
    ``named_peak``, with ``named_peak_units`` where some are of goals, and no derivatives by
    parameters; the response is that of ``problem``.

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
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> best = sh.minimise_peak(problem, "normal_load", bounds=(0.1, 100), frequency_band=(5, 40))
    >>> best.design_value.values.round(6), best.status.item() == sh.Status.DESIGN_OPTIMAL
    (array([3.088579]), True)

    A load weighs, too: 2e-5 m of the peak are as bad as 1 N.

    >>> light = sh.minimise_peak(
    ...     problem, "normal_load", bounds=(0.1, 100), frequency_band=(5, 40),
    ...     objective=lambda peaks, p: peaks["largest"] + 2e-5 * p["normal_load"][0],
    ... )
    >>> light.design_value.values.round(6), light.named_peak_amplitude.values.round(8)
    (array([2.845496]), array([0.00031046]))
    """
    task = Task.of(
        *(problem, parameters, bounds, frequency_band, over),
        vary=vary,
        statistic=statistic,
        tail=tail,
        constraint=constraint,
        peaks=peaks,
    )
    running = runs.Running.of(run, runs.Sharing)
    fixed_start = arguments.read_start(task.variables, start)
    given = objective is not None or peaks is not None
    program = task.program(*([task.read_aim("objective", objective)] if given else []))
    if n_starts is not None:
        n_starts = check.integer("n_starts", n_starts, minimum=1)
    fresh_sweep = None if fresh is None else _read_fresh(task, fresh, given)
    if feasible(program) is None:
        return checked(infeasible(problem, task.variables, task.limits.names), _GOOD, running.throw)
    cases = Cases(task.work, running.executor, running.progress)
    starts = [] if fixed_start is None else [fixed_start]
    search_result = search(program, cases, starts, n_starts)
    design = search_result.design
    status = status_of(program, search_result, cases.failed)
    result = task.responses([design.x], running)
    found = None
    if np.isfinite(design.value):
        found = task.compared(result, np.array([state.height for state in design.states]))
    if status in _GOOD and not (is_complete(result) if found is None else found.agrees):
        status = Status.DESIGN_NOT_SURVEYED
    dims = dict(zip(task.sweep.dims, task.sweep.shape, strict=True))
    result = result.merge(report(program, cases, search_result, dims))
    check_of = "" if found is None else found.text
    text = certificate(program, search_result, task.all_bands, cases, check_of)
    if fresh_sweep is not None:
        own = [replace(peak, bands=[task.bands[0]] * fresh_sweep.size) for peak in task.peaks]
        states = cases.changed(sweep=fresh_sweep, peaks=own)(design.x)
        result = result.merge(report_of_fresh(problem, program, [state.height for state in states]))
        text += (
            f"\nOver {fresh_sweep.size} cases that were not designed for, the same statistic is "
            f"{float(result['fresh_amplitude']):.6g} m."
        )
    return checked(with_certificate(result, status, text), _GOOD, running.throw)


def _read_fresh(task: Task, fresh: Any, given: bool) -> Sweep:
    """Cases that are not designed for; ``given`` tells that there is an objective."""
    sweep = parse(task.problem, fresh, "fresh")
    arguments.check_ratios(task.problem, task.variables, sweep, "fresh")
    arguments.check_forces(task.problem, sweep)
    if len(set(task.bands)) > 1 or given:
        raise ValueError(
            "fresh: expected None where cases have bands of their own, or with an objective"
        )
    return sweep
