"""Flutter limits over a parameter: how much negative damping contacts hold."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symhbm.plot.drawing import (
    FAMILY,
    LINE_STYLES,
    OUTSIDE,
    WIDE,
    axis_label,
    canvas,
    figure_of,
    nothing_to_draw,
)
from symhbm.plot.ends import beside_missing, draw_ends
from symhbm.results import Description, check_dataset, check_present

_LOST: Any = dict(color="0.93", lw=0, label="no disturbance is held")
"""Look of the region above the line of the smallest disturbance."""
_MARK: Any = dict(ls="none", markeredgecolor="black", markeredgewidth=0.6, markersize=5, zorder=4)


def flutter_limit(dataset: xr.Dataset, *, ax: Axes | None = None) -> Figure:
    """Draw the largest negative damping that contacts hold over a parameter.

    Each line is of one disturbance: below it that is held below the largest amplitude. The thick
    part of that of the smallest one is where two limit cycles meet; above it, in grey, none is
    held. A diamond is the best value of a design, two are the ends of a range of such values. A red
    cross is beside values at which no limit was found.

    Parameters
    ----------
    dataset
        A result of `symhbm.flutter_limit` or `symhbm.maximise_flutter_limit`.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no such dataset, and for one without a limit.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> limit = sh.flutter_limit(
    ...     problem, "normal_load", (0.1, 10), amplitude=(1e-6, 4e-4), disturbance=[1e-6, 1e-4],
    ...     progress=False,
    ... )
    >>> figure = sh.plot.flutter_limit(limit)
    >>> figure.savefig("flutter.png")
    """
    check_dataset("dataset", dataset, unforced=True)
    description = Description(dataset)
    if description.unforced != "flutter limit":
        raise TypeError("dataset: expected a result of flutter_limit or maximise_flutter_limit")
    name = description.moving
    check_present(dataset, "flutter_limit", "limit_kind", name)
    if not np.isfinite(dataset["flutter_limit"]).any():
        raise nothing_to_draw(dataset)
    values, disturbances = dataset[name].values, dataset["disturbance"].values
    largest = description.request["amplitudes"][1]
    is_wide = values.max() > WIDE * values.min()
    with canvas(ax) as axes:
        shades = np.linspace(1.0, 0.0, len(disturbances))
        for k, disturbance in enumerate(disturbances.tolist()):
            axes.plot(
                values,
                dataset["flutter_limit"].values[:, k],
                color=FAMILY(shades[k]),
                ls=LINE_STYLES[k % len(LINE_STYLES)],
                label=f"disturbance of {1e3 * disturbance:.4g} mm",
            )
        for limit in dataset["flutter_limit"].values.T:
            ends = beside_missing(np.isfinite(limit))
            draw_ends(axes, values[ends], limit[ends])
        _draw_lost(axes, dataset.isel(disturbance=0), values)
        if "design_from" in dataset.variables:
            _mark_best(axes, dataset)
        axes.set(
            xlabel=axis_label(dataset, name),
            ylabel=f"negative damping ratio held below {1e3 * largest:.4g} mm",
            xlim=(values.min(), values.max()),
            xscale="log" if values.min() > 0 and is_wide else "linear",
        )
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles=[*dict(zip(labels, handles, strict=True)).values()], **OUTSIDE)
        return figure_of(axes)


def _draw_lost(axes: Axes, first: xr.Dataset, values: np.ndarray) -> None:
    """The folds of the smallest disturbance, and the region above its line."""
    limit = first["flutter_limit"].values
    top = 1.1 * float(np.nanmax(limit))
    bottom = min(0.0, 1.1 * float(np.nanmin(limit)))
    axes.fill_between(values, limit, top, where=np.isfinite(limit), zorder=0, **_LOST)
    meets = np.isin(first["limit_kind"].values.astype(str), ["fold", "corner"])
    if meets.any():
        folds = np.where(meets, limit, np.nan)
        axes.plot(values, folds, color="black", lw=2.6, zorder=3, label="two limit cycles meet")
    axes.set(ylim=(bottom, top if top > bottom else None))


def _mark_best(axes: Axes, dataset: xr.Dataset) -> None:
    """The best value of a design, or the range of such values."""
    first, last = (float(dataset[name].values[0]) for name in ("design_from", "design_to"))
    ratio = float(dataset["design_damping_ratio"])
    if np.isfinite(ratio):
        ends = [first] if first == last else [first, last]
        label = "best value" if first == last else "first and last of the best values"
        look = _MARK | dict(markerfacecolor="white", clip_on=False, label=label)
        axes.plot(ends, [ratio] * len(ends), "D", **look)
