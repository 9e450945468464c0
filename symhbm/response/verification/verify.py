"""`verify`: every stored point against its equations, energy balance and friction law.

It needs nothing but the dataset. What can be verified is its points, its peaks, and events of what
no force drives.
"""

import json
from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np
import xarray as xr

from symhbm.model.contacts import ContactLaw
from symhbm.numerics import FloatArray, check
from symhbm.response.verification.figures import FIGURES
from symhbm.response.verification.stored_points import (
    OF_POINTS,
    StoredGroup,
    StoredPoints,
    axes_of,
    not_checked,
)
from symhbm.response.verification.unforced_points import StoredEvents, StoredFold, UnforcedPoints
from symhbm.results import OF_PEAKS, Description, without
from symhbm.results.archive import ArchiveError, rebuild
from symhbm.workers import progress_bar, unkept

_ON_A_GRID = (
    "events not verified: the motions at them are not stored on a grid, but without at= they are"
)


def stored_groups(
    dataset: xr.Dataset, laws: Iterable[ContactLaw]
) -> tuple[StoredPoints, list[StoredGroup]]:
    """The points of a dataset, or its peaks where they lack, and all else that can be verified.

    Raises TypeError for anything else, and ArchiveError where there are neither.
    """
    laws = tuple(laws)
    problem = rebuild(dataset, laws)
    description = Description(dataset)
    present = {*dataset.variables}
    kinds = [""] if description.unforced else ["", "peak_"]
    prefixes = [prefix for prefix in kinds if {*_needed(dataset, prefix)} <= present]
    if not prefixes:
        lacking = [name for name in _needed(dataset, "") if name not in dataset.variables]
        if {*lacking} <= {*description.left_out}:
            of_peaks = "; with verifiable=True its peaks can be verified"
            raise ArchiveError(
                f"dataset: nothing to verify, {', '.join(missing(dataset))} were left out by "
                f"keep={'' if description.unforced else of_peaks}"
            )
        raise ArchiveError(
            "dataset: expected a result of frf, follow, solve, nonlinear_modes or limit_cycles "
            f"with all it is verified by, got one {without(dataset, lacking)}"
        )
    if description.unforced:
        return _unforced(UnforcedPoints(dataset, problem, laws))
    first, *others = [StoredPoints(dataset, problem, prefix, laws) for prefix in prefixes]
    return first, [first, *others]


def _unforced(points: UnforcedPoints) -> tuple[StoredPoints, list[StoredGroup]]:
    """Points, and events and folds where the dataset has them."""
    dataset = points.dataset
    groups: list[StoredGroup] = [points]
    if "event_kind" in dataset.variables and not points.description.on_grid:
        groups.append(StoredEvents(points))
    if f"fold_{points.description.moving}" in dataset.variables:
        groups.append(StoredFold(points))
    return points, groups


def notes(points: StoredPoints) -> list[str]:
    """Sentences on what was not verified, and why."""
    why, description = points.without_exact, points.description
    result = [] if why is None else [why]
    has_events = "event_kind" in points.dataset.variables
    if description.unforced and description.on_grid and has_events:
        result.append(_ON_A_GRID)
    return result


def missing(dataset: xr.Dataset) -> list[str]:
    """Missing variables without which a part of the verification is left out."""
    wanted = [*OF_POINTS, *(f"peak_{name}" for name in OF_PEAKS), *_needed(dataset, "peak_")]
    # A dataset without peaks lacks their variables although none was left out.
    absent = [name for name in dict.fromkeys(wanted) if name not in dataset.variables]
    return [n for n in absent if n in (*OF_POINTS, *Description(dataset).left_out)]


def _needed(dataset: xr.Dataset, prefix: str) -> tuple[str, ...]:
    """Variables without which no point, or no peak, is verified."""
    count = "n_peaks" if prefix else "residual_norm"
    axes = axes_of(Description(dataset).moving, prefix).values()
    own = ("damping_ratio",) if Description(dataset).unforced == "nonlinear mode" else ()
    return f"{prefix}coefficient", *axes, *own, count


@unkept("a verification")
def verify(
    dataset: xr.Dataset,
    *,
    points: int | Literal["all"] = "all",
    bounds: Mapping[str, float | None] | None = None,
    exact: int | Literal["all", "none"] = 4,
    laws: Iterable[ContactLaw] = (),
    progress: bool | None = None,
) -> xr.Dataset:
    """Verify a result in memory or loaded, from the dataset alone.

    Of `frf`, `follow`, `other_branches` and `solve` points and peaks are verified; events,
    switching angles, stability and estimated errors are not. Of `nonlinear_modes` and
    `limit_cycles` points, stability, the events along paths and the fold of a parameter are.

    Parameters
    ----------
    dataset
        What to verify, or a part of it.
    points
        Number of points to verify, evenly spread over those with a solution, or all of these.
    bounds
        Largest allowed value by name of `FIGURES`, in place of the default; None lifts it.
    exact
        Number of points compared with their exact periodic motion (up to a second each): those of
        the largest amplitude and the largest ``residual_larger`` of each curve first. With cubic
        springs it is the motion closest to the stored response. Without a force its period is
        unknown, and of a mode its damping ratio: known for springs and sliders. Where there is
        none, `summary` tells why.
    laws
        Contact laws of your own that it was computed with, as of `rebuild`.
    progress
        By default, show a bar when it takes longer than a few seconds; True: at once, False: never.

    Returns
    -------
    Copy of the dataset with the variables of `FIGURES` (all dimensionless) over its points, and
    with the prefix ``peak_`` over its peaks. They are NaN at points without a solution or not asked
    for, infinite where a figure cannot be computed. The attribute ``verification`` holds the worst
    values as JSON, and under ``missing`` the variables without which a part is not verified: where
    ``keep`` left out the coefficients of points, only the peaks are. A bound on a figure that no
    point has is broken: it was not checked.

    Raises
    ------
    TypeError, ValueError
        For bad arguments, or a dataset of another kind; ArchiveError, which is a ValueError, where
        the problem cannot be rebuilt.
    KeyError
        For a bound of an unknown figure.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> verified = sh.verify(sh.frf(problem, (10, 30)), exact="none")
    >>> verified.residual_stored.max().item() < 1e-9
    True
    """
    limits = _limits(bounds)
    n_points = _count("points", points, {"all": None}, minimum=1)
    n_exact = _count("exact", exact, {"all": None, "none": 0}, minimum=0)
    compared, groups = stored_groups(dataset, laws)
    chosen = [[tuple(row) for row in np.argwhere(group.solved).tolist()] for group in groups]
    n_solved = {group.kind: len(rows) for group, rows in zip(groups, chosen, strict=True)}
    if n_points is not None and n_points < n_solved.get("points", 0):
        spread = np.linspace(0, n_solved["points"] - 1, n_points).round().astype(int)
        chosen[0] = [chosen[0][i] for i in spread]
    # Exact motions are compared with the points, or with the peaks where there are no points.
    n_wanted = 0
    if "exact_difference" in compared.available:
        n_wanted = min(len(chosen[0]) if n_exact is None else n_exact, len(chosen[0]))
    results: dict[str, tuple[StoredGroup, FloatArray]] = {}
    n_failed = 0
    with progress_bar("point", progress, sum(map(len, chosen)) + n_wanted) as bar:
        for group, rows in zip(groups, chosen, strict=True):
            names = [n for n in group.available if n != "exact_difference" or group is compared]
            figures = {name: np.full(group.solved.shape, np.nan) for name in names}
            results |= {group.prefix + name: (group, values) for name, values in figures.items()}
            for index in rows:
                for name, value in group.figures(index).items():
                    figures[name][index] = value
                bar.update()
        larger = results.get(f"{compared.prefix}residual_larger", (compared, compared.amplitude))[1]
        for index in compared.ranked(chosen[0], (larger, compared.amplitude))[:n_wanted]:
            difference = compared.exact_difference(index)
            results[f"{compared.prefix}exact_difference"][1][index] = difference
            n_failed += bool(np.isnan(difference))
            bar.update()
    worst = _worst(results, limits, {*(bounds or {})})
    n_checked = {group.kind: len(rows) for group, rows in zip(groups, chosen, strict=True)}
    report = {
        "passed": any(chosen) and not any(entry["broken"] for entry in worst.values()),
        "n_checked": n_checked.get("points", 0),
        "n_unchecked": n_solved.get("points", 0) - n_checked.get("points", 0),
        "n_skipped": sum(group.solved.size for group in groups if group.kind == "points")
        - n_solved.get("points", 0),
        "n_peaks": n_checked.get("peaks", 0),
        "n_events": n_checked.get("events", 0),
        "n_exact": n_wanted - n_failed,
        "n_exact_failed": n_failed,
        "notes": notes(compared),
        "missing": missing(dataset),
        "figures": worst,
    }
    result = dataset.assign(
        {
            name: (group.dims, values, _attributes(name, group.prefix))
            for name, (group, values) in results.items()
            if name in worst
        }
    )
    return result.assign_attrs(verification=json.dumps(report))


def _worst(
    results: dict[str, tuple[StoredGroup, FloatArray]],
    limits: dict[str, float | None],
    bounded: set[str],
) -> dict[str, dict[str, Any]]:
    """The worst value of each figure by name.

    A ``bounded`` figure that no point has is broken. Peaks and events are listed only where they
    have a figure: there may be none, or none compared with the exact motion.
    """
    worst = {}
    for name, (group, values) in results.items():
        if group.kind == "points" or not np.isnan(values).all():
            worst[name] = group.worst(values, limits[name.removeprefix(group.prefix)])
    for name in bounded:
        if not {name, f"peak_{name}"} & worst.keys():
            worst[name] = not_checked(limits[name])
    return worst


def _attributes(name: str, prefix: str) -> dict[str, str]:
    meaning = FIGURES[name.removeprefix(prefix)].long_name
    return {"units": "1", "long_name": f"{meaning}, at the peak" if prefix else meaning}


def summary(dataset: xr.Dataset) -> str:
    """Table of a verified dataset as plain text: figure, worst, bound, verdict and at which point.

    Below it what each broken figure is, and what to do.

    Raises ValueError for a dataset that `verify` has not returned.
    """
    report = Description(dataset).verification if isinstance(dataset, xr.Dataset) else None
    if report is None:
        raise ValueError(f"dataset={check.shown(dataset)}: expected what verify returns")
    rows = [("figure", "worst", "bound", "", "at")]
    for name, entry in report["figures"].items():
        worst, bound = (
            "-" if entry[key] is None else f"{float(entry[key]):.1e}" for key in ("worst", "bound")
        )
        verdict = "" if entry["bound"] is None else "BROKEN" if entry["broken"] else "ok"
        labels = (f"{key}={_short(value)}" for key, value in entry["at"].items())
        rows.append((name, worst, bound, verdict, ", ".join(labels)))
    width = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, width)).rstrip() for row in rows]
    for name, entry in report["figures"].items():
        if entry["broken"]:
            figure = FIGURES[name.removeprefix("peak_")]
            lines.append(f"{name}: {figure.long_name}; {figure.remedy}")
    failures = f" ({report['n_exact_failed']} impossible)" if report["n_exact_failed"] else ""
    exact = f"{report['n_exact']} against the exact motion{failures}"
    peaks = [f"{report['n_peaks']} peaks checked"] if report["n_peaks"] else []
    n_points = report["n_checked"] + report["n_unchecked"] + report["n_skipped"]
    if n_points or not peaks:
        lines.append(
            f"{report['n_checked']} points checked, {exact}; {report['n_unchecked']} not asked "
            f"for, {report['n_skipped']} empty or without solution"
        )
        lines += peaks
    else:
        lines.append(f"{peaks[0]}, {exact}")
    if report.get("n_events"):
        lines.append(f"{report['n_events']} events checked")
    lines += report["notes"]
    for by_keep, reason in ((True, "left out by keep="), (False, "not in the dataset")):
        absent, left_out = report.get("missing", []), Description(dataset).left_out
        names = [name for name in absent if (name in left_out) == by_keep]
        if names:
            lines.append(f"not verified for want of {', '.join(names)}: {reason}")
    return "\n".join(lines)


def _short(value: Any) -> str:
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def _limits(bounds: Mapping[str, float | None] | None) -> dict[str, float | None]:
    limits = {name: figure.bound for name, figure in FIGURES.items()}
    if not isinstance(bounds, Mapping | None):
        raise TypeError(f"bounds={check.shown(bounds)}: expected a mapping from names of figures")
    for name, value in (bounds or {}).items():
        check.known(name, FIGURES, "figure of a verification")
        where = f"bounds[{name!r}]"
        limits[name] = None if value is None else check.scalar(where, value, "non-negative")
    return limits


def _count(name: str, value: Any, words: dict[str, int | None], minimum: int) -> int | None:
    """Number of points, None for all of them."""
    if isinstance(value, str) and value in words:
        return words[value]
    if isinstance(value, str) or value is None:
        allowed = ", ".join(map(repr, words))
        raise ValueError(f"{name}={check.shown(value)}: expected {allowed} or an integer")
    return check.integer(name, value, minimum)
