"""The verb `pareto_front`: designs of which none is better in two aims."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.design.cases import Cases
from symhbm.design.outcome import checked, infeasible, with_certificate
from symhbm.design.pareto.dataset import certificate_of, dataset_of, status_of_front
from symhbm.design.pareto.kept_designs import KeptDesigns, signature
from symhbm.design.pareto.points import FrontPoint, on_front, points_of
from symhbm.design.search import feasible
from symhbm.design.task import Task
from symhbm.numerics import check
from symhbm.results import runs

_GOOD = (Status.FRONT_FOUND,)


def pareto_front(
    problem: HarmonicBalance,
    parameters: str | Sequence[str],
    bounds: Any,
    frequency_band: ArrayLike | None = None,
    over: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    aims: Mapping[str, Callable[[Any, Any], Any]],
    n_points: int = 11,
    peaks: Mapping[str, Mapping[str, Any]] | None = None,
    vary: Any = "common",
    statistic: Literal["worst", "mean", "tail"] = "worst",
    tail: float = 0.1,
    constraint: Any = None,
    n_starts: int | None = None,
    **run: Unpack[runs.Archiving],
) -> xr.Dataset:
    """Designs of which none is better in both of two aims, from one aim's optimum to the other's.

    Parameters
    ----------
    problem, parameters, bounds, frequency_band, over
        As in `minimise_peak`.
    aims
        Two aims by name, each to be small: functions of peaks and parameters as the ``objective``
        of `minimise_peak`, for example ``{"peak": lambda peaks, p: peaks["largest"],
        "load": lambda peaks, p: p["normal_load"][0]}``.
    n_points
        Points that are looked for, both ends among them.
    peaks, vary, statistic, tail, constraint
        As in `minimise_peak`.
    n_starts
        Designs spread over the bounds that a search between the ends begins at, beside those of
        its neighbours; by default 1.
    **run
        ``archive``, ``executor``, ``throw`` and ``progress``, as `symhbm.Run` tells. Every point
        that is found is kept in a working file beside the archive.

    Returns
    -------
    Dataset as that of `frf` at all points along ``front``, with ``front_aim`` (front, aim),
    ``front_value`` (front, variable), ``front_peak_amplitude`` (front, named_peak) [m] and the
    status of each; designs that were found and are not on the front along ``removed``, with the
    reason; ``design_status``, and the ``certificate``: what was computed and checked, and what was
    not. ``sh.datasets.rebuild(front.isel(front=0))`` gives the problem of a point,
    `symhbm.plot.pareto_front` a picture.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    ArchiveError
        If the archive, or its working file, is of another computation or cannot be written.
    SolveError
        If a point was not found and ``throw`` is True; its ``result`` is the dataset.

    Notes
    -----
    The ends are the optima of one aim each. Between them the worse of both aims, in logarithms over
    their ranges, relative to points on the chord from end to end, is minimised with exact first and
    second derivatives: so parts of a front that are not convex are found, too.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> front = sh.pareto_front(
    ...     sh.HarmonicBalance(blade, sh.forces.PointForce()), "normal_load", (0.5, 20), (5, 40),
    ...     aims={
    ...         "peak": lambda peaks, parameters: peaks["largest"],
    ...         "load": lambda peaks, parameters: parameters["normal_load"][0],
    ...     },
    ...     n_points=3, progress=False,
    ... )
    >>> front.front_aim.sel(aim="load").values.round(3)
    array([3.089, 1.401, 0.5  ])
    """
    running = runs.Running.of(run, runs.Archiving)
    n_points = check.integer("n_points", n_points, minimum=2)
    if n_starts is not None:
        n_starts = check.integer("n_starts", n_starts, minimum=1)
    if not isinstance(aims, Mapping) or len(aims) != 2 or not all(map(_is_name, aims)):
        raise TypeError(
            f"aims={check.shown(aims)}: expected a mapping of two names to functions of peaks and "
            "parameters"
        )
    task = Task.of(
        *(problem, parameters, bounds, frequency_band, over),
        vary=vary,
        statistic=statistic,
        tail=tail,
        constraint=constraint,
        peaks=peaks,
    )
    both = [task.read_aim(name, function) for name, function in aims.items()]
    program = task.program(*both)
    if feasible(program) is None:
        return checked(infeasible(problem, task.variables, task.limits.names), _GOOD, running.throw)
    kept_designs = KeptDesigns.of(running.archive, signature(task, both, n_points, n_starts))
    if kept_designs.complete is not None:
        return checked(kept_designs.complete, _GOOD, running.throw)
    cases = Cases(task.work, running.executor, running.progress)
    with kept_designs.told():
        found = points_of(program, (both[0], both[1]), cases, n_points, n_starts, kept_designs)
    points = on_front(found)
    kept = [point for point in points if not point.removed]
    status = status_of_front(points)
    if not kept:
        result = infeasible(problem, task.variables, task.limits.names)
        text = "Nothing was found: no point of the front satisfies the conditions of an optimum."
        return checked(with_certificate(result, status, text), _GOOD, running.throw)
    result = task.responses([point.x for point in kept], running, dim="front")
    agrees, text = _compared(task, result, kept)
    if not agrees and status == Status.FRONT_FOUND:
        status = Status.FRONT_INCOMPLETE
    result = result.merge(dataset_of(points, program, both, cases))
    text = certificate_of(points, both, text)
    return checked(
        kept_designs.finished(with_certificate(result, status, text)), _GOOD, running.throw
    )


def _is_name(name: object) -> bool:
    return isinstance(name, str) and bool(name)


def _compared(task: Task, result: xr.Dataset, points: Sequence[FrontPoint]) -> tuple[bool, str]:
    """Whether the responses at all points agree with what was found there, in words."""
    found = [
        task.compared(
            result.isel(front=number),
            np.array([state.height for state in point.found.design.states]),
        )
        for number, point in enumerate(points)
    ]
    known = [comparison for comparison in found if comparison is not None]
    if not known:
        return task.complete(result), ""
    counts = sum(one.n_points for one in known), sum(one.n_peaks for one in known)
    what = f"of {counts[0]} stored points and {counts[1]} peaks of all responses in the band"
    if all(one.agrees for one in known):
        return True, f"Checked: each response was followed once more, and none {what} is higher."
    bad = [number for number, one in enumerate(known) if not one.agrees]
    return False, f"The check failed at the points {', '.join(map(str, bad))} of the front."
