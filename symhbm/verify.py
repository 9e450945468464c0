"""Archives that verify themselves: every stored point against equations, energy and friction law.

Nothing is needed but the dataset.
"""

import json
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import xarray as xr
from tqdm import tqdm

from symhbm import check
from symhbm.audit import FIGURES
from symhbm.stored_points import StoredPoints

_BAR_DELAY = 2.0
"""Seconds before a progress bar appears."""


def verify(
    dataset: xr.Dataset,
    *,
    points: int | Literal["all"] = "all",
    bounds: Mapping[str, float | None] | None = None,
    exact: int | Literal["all", "none"] = 4,
    progress: bool = True,
) -> xr.Dataset:
    """Verify a result of `frf`, `follow` or `solve`, in memory or loaded, from itself alone.

    Parameters
    ----------
    dataset
        What to verify, or a part of it.
    points
        All points that have a solution, or so many of them, evenly spread.
    bounds
        Largest allowed value by name of `FIGURES`, in place of the default; None lifts it.
    exact
        How many points are compared with their exact periodic motion (up to a second each): those
        of the largest amplitude and the largest ``residual_larger`` of each curve first. With cubic
        springs it is the motion closest to what is stored.
    progress
        Show a bar when it takes longer than a few seconds.

    Returns
    -------
    Copy of the dataset with the variables of `FIGURES` (all dimensionless) over its points, NaN
    where there is no solution or none was asked for, infinite where a figure cannot be computed;
    the attribute ``verification`` holds the worst of each as JSON. A bound on a figure that no
    point has is broken: what was not checked does not pass.

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
    >>> problem = sh.HarmonicBalance(blade, sh.PointForce())
    >>> verified = sh.verify(sh.frf(problem, (10, 30)), exact="none")
    >>> verified.residual_stored.max().item() < 1e-9
    True
    """
    limits = _limits(bounds)
    n_points = _count("points", points, {"all": None}, minimum=1)
    n_exact = _count("exact", exact, {"all": None, "none": 0}, minimum=0)
    archive = StoredPoints(dataset)
    solved = chosen = [tuple(row) for row in np.argwhere(archive.solved).tolist()]
    if n_points is not None and n_points < len(solved):
        chosen = [solved[i] for i in np.linspace(0, len(solved) - 1, n_points).round().astype(int)]
    figures = {name: np.full(archive.solved.shape, np.nan) for name in FIGURES}
    failed = 0
    total = len(chosen) + min(len(chosen) if n_exact is None else n_exact, len(chosen))
    with tqdm(
        total=total, unit="point", delay=_BAR_DELAY, disable=not progress, leave=False
    ) as bar:
        for index in chosen:
            for name, value in archive.figures(index).items():
                figures[name][index] = value
            bar.update()
        scores = figures["residual_larger"], archive.stored["amplitude"].max(axis=-1, initial=0.0)
        wanted = archive.ranked(chosen, scores)[:n_exact]
        for index in wanted:
            difference = archive.exact_difference(index)
            figures["exact_difference"][index] = difference
            failed += bool(np.isnan(difference))
            bar.update()
    worst = {name: archive.worst(figures[name], limits[name]) for name in FIGURES}
    report = {
        "passed": not any(entry["broken"] for entry in worst.values()),
        "n_checked": len(chosen),
        "n_unchecked": len(solved) - len(chosen),
        "n_skipped": archive.solved.size - len(solved),
        "n_exact": len(wanted) - failed,
        "n_exact_failed": failed,
        "figures": worst,
    }
    result = dataset.assign(
        {
            name: (archive.dims, figures[name], {"units": "1", "long_name": about.long_name})
            for name, about in FIGURES.items()
        }
    )
    return result.assign_attrs(verification=json.dumps(report))


def summary(dataset: xr.Dataset) -> str:
    """Table of a verified dataset as plain text: figure, worst, bound, verdict and at which point.

    Raises ValueError for a dataset that `verify` has not returned.
    """
    if not isinstance(dataset, xr.Dataset) or "verification" not in dataset.attrs:
        raise ValueError(f"dataset={check.shown(dataset)}: expected what verify returns")
    report = json.loads(dataset.attrs["verification"])
    rows = [("figure", "worst", "bound", "", "at")]
    for name, entry in report["figures"].items():
        worst, bound = (
            "-" if entry[key] is None else f"{float(entry[key]):.1e}" for key in ("worst", "bound")
        )
        verdict = "" if entry["bound"] is None else "BROKEN" if entry["broken"] else "ok"
        places = (f"{key}={_short(value)}" for key, value in entry["at"].items())
        rows.append((name, worst, bound, verdict, ", ".join(places)))
    width = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, width)).rstrip() for row in rows]
    failures = f" ({report['n_exact_failed']} impossible)" if report["n_exact_failed"] else ""
    lines.append(
        f"{report['n_checked']} points checked, {report['n_exact']} against the exact motion"
        f"{failures}; {report['n_unchecked']} not asked for, {report['n_skipped']} without solution"
    )
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
