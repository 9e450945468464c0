"""`peak_curve`: the largest peak over one parameter, with its minima and events."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance, check_mean, check_problem
from symhbm.continuation import SolveError, Status
from symhbm.model import advise_condensing, warn_of_doubts
from symhbm.model.linear import natural_band
from symhbm.numerics import check
from symhbm.peaks.peak_rows import Islands, results_of, rows_of, status_of
from symhbm.peaks.survey import Surveyor, sector_of
from symhbm.peaks.tracking import LeadingBranches, Parameter, UpperEnvelope
from symhbm.results import Request, check_axis, check_band, runs, schema
from symhbm.workers import unkept

_ROUNDS = 6
"""Largest number of times that minima and exchanges are surveyed and missed branches followed."""


@unkept("a curve")
def peak_curve(
    problem: HarmonicBalance,
    parameter: str,
    band: tuple[float, float],
    at: ArrayLike | None = None,
    *,
    frequency_band: float | tuple[float, float] | Sequence[tuple[float, float]] | None = None,
    **run: Unpack[runs.Sharing],
) -> xr.Dataset:
    """Largest peak of the response over a named parameter, with its minima and events.

    Surveys at some values find all peaks (``surveyed`` is True there), exact continuation follows
    those that may lead. Surveys are at most a factor of 3.2 apart with one degree of freedom (or
    one per sector), and 1.25 with several. Where one shows a peak that was not followed and may
    lead close by, both sides are surveyed until two in a row show nothing new or they are 8 %
    apart; minima and exchanges of the lead are surveyed too. A peak that leads only between two
    surveys, and is low or absent at both, is missed: close values in ``at`` make this less likely.

    Parameters
    ----------
    problem
        What to solve, with located events, and what has peaks (``peaks_of``): an output, or a goal
        that is above 0 at all values of ``band``, in the place of displacements. Where responses
        need not be unique, surveys see the branch that starts at the low end of each band, as `frf`
        does. A followed peak may come off it with an island of responses: it is on the curve for as
        long as it is the highest, and ``peak_on_island`` and ``status`` tell, by the surveys on
        both sides. Islands that are apart at all values of ``band`` are not found.
    parameter
        The name of the parameter that moves, for example ``"normal_load"``, for all contacts or
        blades alike, or with the number of one: ``"normal_load[2]"``.
    band
        Its first and last value (SI units).
    at : (n,), ascending
        Values at which the peak is wanted; those more than 8 % apart are surveyed. By default the
        result holds the points that were solved for on the way, with all minima and events: as
        many as cubic interpolation of logarithms with the slopes needs for 1e-5 in between.
    frequency_band
        Band (first, last) of excitation frequencies [Hz], several that do not overlap, or one
        frequency whose response is followed; by default a band that holds all resonances.
    **run
        ``executor`` (of the surveys), ``throw`` (unless the curve is complete and bounded) and
        ``progress``, as `symhbm.Run` tells.

    Returns
    -------
    Dataset along the parameter, ascending: ``peak_amplitude`` [m], ``peak_frequency`` [Hz],
    ``peak_kind`` (smooth, corner, edge, point, unbounded), ``peak_dof``,
    ``peak_amplitude_slope`` (its exact derivative by the parameter, at an event that of one side,
    which points right below and above tell apart), ``peak_residual_norm``, ``peak_coefficient``
    [m], ``surveyed`` and ``peak_on_island`` (whether `frf` from the low end of the band does not
    reach it); along ``minimum`` the local minima of the curve and what makes them (smooth,
    exchange, kink, end); along ``event`` where another peak takes the lead or the leading one
    changes its kind. ``status`` tells whether surveys agree, and whether the peak is at an end of
    the band of frequencies or unbounded somewhere.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    SolveError
        If the curve is incomplete, unbounded or at an edge somewhere and ``throw`` is True; its
        ``result`` is the dataset.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> curve = sh.peak_curve(problem, "normal_load", (1, 10))
    >>> curve.minimum_normal_load.values.round(6)
    array([3.088579])
    """
    check_problem(problem, bends=True)
    advise_condensing(problem.model, problem.n_unknowns, "second derivatives take minutes")
    axis = check_axis(problem, parameter, band, at)
    parameter, grid, index = axis["name"], axis["at"], axis["index"]
    low, high = sorted(axis["band"])
    running = runs.Running.of(run, runs.Sharing)
    if problem.samples is not None:
        raise ValueError(
            f"samples={problem.samples}: expected a problem with located switching angles; "
            "peaks of friction over samples cannot be followed"
        )
    check_mean(problem)
    # Of a copy: what is derived by the parameter of an idle contact takes part from then on.
    moving = Parameter(problem.with_parameters(), parameter, index, low, high)
    first, last = map(moving.at, (low, high))
    bands = _bands(frequency_band, first, last)
    limits = float(np.min(bands)), float(np.max(bands))
    problem.model.check_frequencies("frequency_band", limits)
    warn_of_doubts(problem.model, limits, problem.harmonics, moving=[parameter])
    start = last if index is not None else sector_of(last)
    surveyor = Surveyor(bands, running.executor, running.progress)
    with surveyor:
        leading = LeadingBranches(Parameter(start, parameter, index, low, high), surveyor)
        leading.follow([] if grid is None else grid.tolist())
        envelope = _verified_envelope(leading)
        rows = rows_of(leading, envelope, grid)
        islands = Islands.of(leading, [row.value for row in rows])
    axis["at"] = np.array([row.value for row in rows])
    results = results_of(leading, envelope, rows, islands)
    status = status_of(leading, envelope, rows, islands)
    result = schema.label_over_parameter(
        "peak_amplitude", problem, Request(**axis), results, status, bands
    )
    if running.throw and result["status"].item() != Status.REACHED_END:
        raise SolveError(result["status"].item(), result)
    return result


def _verified_envelope(leading: LeadingBranches) -> UpperEnvelope:
    """The upper envelope, with what surveys at its minima and exchanges show followed too."""
    for _ in range(_ROUNDS):
        envelope = UpperEnvelope.of(leading.followed, leading.unbounded)
        if leading.check(envelope.values_to_verify):
            return envelope
    return UpperEnvelope.of(leading.followed, leading.unbounded)


def _bands(given: Any, *problems: HarmonicBalance) -> list[tuple[float, float]]:
    """Ascending bands [Hz]."""
    if given is None:
        return [natural_band([problem.model for problem in problems])]
    edges = check.array("frequency_band", given, "positive")
    if not edges.ndim:
        return [(float(edges), float(edges))]
    pairs = [given] if edges.ndim == 1 else edges
    if edges.ndim != 1 and (edges.ndim != 2 or edges.shape[1] != 2 or not len(edges)):
        raise ValueError(
            f"frequency_band={check.shown(given)}: expected a band (first, last) in Hz, or several"
        )
    ends = [check_band("frequency_band", pair, "positive", " in Hz") for pair in pairs]
    bands = sorted((min(pair), max(pair)) for pair in ends)
    if any(band[1] >= following[0] for band, following in pairwise(bands)):
        raise ValueError(f"frequency_band={check.shown(given)}: expected bands that do not overlap")
    return bands
