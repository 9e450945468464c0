"""What of a dataset can be verified: its points, its peaks, and events of what no force drives."""

from collections.abc import Iterable

import xarray as xr

from symhbm.model.contacts import ContactLaw
from symhbm.response.verification.stored_group import StoredGroup
from symhbm.response.verification.stored_points import OF_POINTS, StoredPoints, axes_of
from symhbm.response.verification.unforced_events import StoredEvents, StoredFold
from symhbm.response.verification.unforced_points import UnforcedPoints
from symhbm.results import OF_PEAKS, Description, without
from symhbm.results.archive import ArchiveError, rebuild

_ON_A_GRID = (
    "events not verified: the motions at them are not stored on a grid, but without at= they are"
)


def stored_groups(
    dataset: xr.Dataset, laws: Iterable[ContactLaw] = ()
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
