"""The verb `pareto_front`: designs of which none is better in two aims, as a labelled dataset."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.design import tolerances
from symhbm.design.cases import Cases, amplitudes
from symhbm.design.outcome import (
    checked,
    in_units,
    infeasible,
    is_complete,
    labelled,
    table_of,
    with_certificate,
)
from symhbm.design.pareto.points import (
    END,
    FLAT,
    FrontPoint,
    KeptDesigns,
    on_front,
    points_of,
    signature,
)
from symhbm.design.program import Aim, Program
from symhbm.design.search import feasible
from symhbm.design.task import Task
from symhbm.design.variables import DesignVariables
from symhbm.numerics import check
from symhbm.results import records_of_problem, runs
from symhbm.workers import noted


def dataset_of(
    points: Sequence[FrontPoint], program: Program, aims: Sequence[Aim], cases: Cases
) -> xr.Dataset:
    """All variables of a front but its responses; removed points are apart."""
    variables = program.variables
    on, off = ([p for p in points if bool(p.removed) == removed] for removed in (False, True))
    actives = [point.found.active for point in on]
    heights = [
        program.levels(np.array([state.height for state in point.found.design.states]))
        for point in on
    ]
    n_active = np.array([0 if a is None else len(a.maxima) for a in actives], dtype=np.int32)
    table = table_of(variables, cases) | {
        "aim": ("aim", _texts([aim.name for aim in aims])),
        "named_peak": ("named_peak", _texts(program.peaks)),
        "front_aim": (("front", "aim"), _aims(on)),
        "front_value": (("front", "variable"), _values(variables, on)),
        "front_kind": ("front", _texts([point.kind for point in on])),
        "front_place": ("front", np.array([point.along for point in on])),
        "front_status": ("front", _texts([str(point.status) for point in on])),
        "front_optimality": (
            "front",
            np.array([np.nan if a is None else a.stationarity for a in actives]),
        ),
        "front_n_active": ("front", n_active),
        "front_peak_amplitude": (
            ("front", "named_peak"),
            amplitudes(np.array(heights)).reshape(-1, len(program.peaks)),
        ),
        "removed_aim": (("removed", "aim"), _aims(off)),
        "removed_value": (("removed", "variable"), _values(variables, off)),
        "removed_place": ("removed", np.array([point.along for point in off])),
        "removed_reason": ("removed", _texts([point.removed for point in off])),
        "n_surveys": ((), np.int32(cases.surveys)),
        "n_followed": ((), np.int32(cases.follows)),
        "n_failed": ((), np.int32(len(cases.failed))),
    }
    return in_units(labelled(table, records_of_problem(cases.work.problem)), cases.work.peaks)


def status_of_front(points: Sequence[FrontPoint]) -> Status:
    """Status of a front: good where both ends are there and no point failed."""
    ends = [point for point in points if point.kind == END]
    if not all(np.all(np.isfinite(point.aims)) for point in ends):
        return next(p.status for p in ends if not np.all(np.isfinite(p.aims)))
    failed = [point for point in points if point.removed == str(point.status)]
    doubtful = [point for point in points if point.status == Status.DESIGN_BESIDE_FAILURES]
    return Status.FRONT_INCOMPLETE if failed or doubtful else Status.FRONT_FOUND


def certificate_of(points: Sequence[FrontPoint], aims: Sequence[Aim], check: str) -> str:
    """Sentences on the points of a front, those removed, and what is not known."""
    on = [point for point in points if not point.removed]
    sentences = [f"{len(on)} of {len(points)} points are on the front of {_both(aims)}."]
    for point in points:
        if point.kind == END:
            aim = aims[round(point.along)].name
            share = f", up to {point.up_to:g} of it" if point.up_to else ""
            share += ", which is as good at designs around it" if point.status in FLAT else ""
            said = f"at the optimum of {aim}{share}: {_told(point, aims)}"
            sentences.append(f"End {said}{f' ({point.removed})' if point.removed else ''}.")
    optima = [p.found.active.stationarity for p in on if p.found.active is not None]
    if optima:
        sentences.append(
            f"{len(optima)} satisfy the conditions of a minimum of their scalarised aim: slopes "
            f"that nothing holds are below {max(*optima, 1e-16):.1e}."
        )
    if check:
        sentences.append(check)
    below = [number for number, point in enumerate(on) if _beaten(point, points)]
    if below:
        sentences.append(
            "Designs that were removed, as no condition shows them to be optimal, are better in "
            f"both aims than the points {', '.join(map(str, below))} of the front."
        )
    reasons = [point.removed for point in points if point.removed]
    for reason in dict.fromkeys(reasons):
        sentences.append(f"{reasons.count(reason)} removed: {reason}.")
    sentences.append(
        "Not proved: that no design is better in both aims than a point, as minima were reached "
        "from several starts and not from all; nothing is said of the front between points."
    )
    return "\n".join(sentences)


def _beaten(point: FrontPoint, points: Sequence[FrontPoint]) -> bool:
    """Whether another design is better in both aims, be it an optimum or not."""
    return any(bool(np.all(other.aims < point.aims - tolerances.AGREE)) for other in points)


def _both(aims: Sequence[Aim]) -> str:
    return " and ".join(aim.name for aim in aims)


def _told(point: FrontPoint, aims: Sequence[Aim]) -> str:
    pairs = zip(aims, amplitudes(point.aims), strict=True)
    return ", ".join(f"{aim.name} {value:.10g}" for aim, value in pairs)


def _texts(words: Sequence[str]) -> np.ndarray:
    return np.array(list(words), dtype=object)


def _aims(points: Sequence[FrontPoint]) -> np.ndarray:
    return amplitudes(np.array([point.aims for point in points])).reshape(-1, 2)


def _values(variables: DesignVariables, points: Sequence[FrontPoint]) -> np.ndarray:
    values = [variables.values(point.x) for point in points]
    return np.array(values).reshape(-1, variables.n_variables)


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
    reason; ``status``, and the ``certificate``: what was computed and checked, and what was
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
    if (
        not isinstance(aims, Mapping)
        or len(aims) != 2
        or not all(isinstance(name, str) and name for name in aims)
    ):
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
    with noted(kept_designs.kept):
        found = points_of(program, (both[0], both[1]), cases, n_points, n_starts, kept_designs)
        points = on_front(found)
        kept = [point for point in points if not point.removed]
        status = status_of_front(points)
        if not kept:
            result = infeasible(problem, task.variables, task.limits.names)
            text = (
                "Nothing was found: no point of the front satisfies the conditions of an optimum."
            )
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
        return is_complete(result), ""
    counts = sum(one.n_points for one in known), sum(one.n_peaks for one in known)
    what = f"of {counts[0]} stored points and {counts[1]} peaks of all responses in the band"
    if all(one.agrees for one in known):
        return True, f"Checked: each response was followed once more, and none {what} is higher."
    bad = [number for number, one in enumerate(known) if not one.agrees]
    return False, f"The check failed at the points {', '.join(map(str, bad))} of the front."
