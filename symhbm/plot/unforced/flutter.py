"""Flutter limits over a parameter: how much negative damping contacts hold."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from symhbm.plot.drawing import LINE_STYLES, check_anything, parameter_axis
from symhbm.plot.marks import MARK, beside_missing, draw_ends
from symhbm.plot.picture import FAMILY, Axis, Panel, Picture
from symhbm.plot.rendering import pictured
from symhbm.results import Description, check_dataset, check_present


@pictured
def flutter_limit(dataset: xr.Dataset, *, ax: Axes | None = None) -> Picture:
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
    ...     problem, "normal_load", (0.1, 10), amplitudes=(1e-6, 4e-4), disturbance=[1e-6, 1e-4],
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
    check_anything(dataset, "flutter_limit")
    values, disturbances = dataset[name].values, dataset["disturbance"].values
    limits, largest = dataset["flutter_limit"].values, description.request["amplitudes"][1]
    first = limits[:, 0]
    top, bottom = 1.1 * float(np.nanmax(first)), min(0.0, 1.1 * float(np.nanmin(first)))
    panel = Panel(
        parameter_axis(dataset, name, limits=(values.min(), values.max())),
        Axis(
            f"negative damping ratio held below {1e3 * largest:.4g} mm",
            limits=(bottom, top if top > bottom else None),
        ),
    )
    shades = FAMILY(np.linspace(1.0, 0.0, len(disturbances)))
    for k, disturbance in enumerate(disturbances.tolist()):
        look = dict(color=shades[k], linestyle=LINE_STYLES[k % len(LINE_STYLES)])
        panel.line(values, limits[:, k], f"disturbance of {1e3 * disturbance:.4g} mm", **look)
    for limit in limits.T:
        ends = beside_missing(np.isfinite(limit))
        draw_ends(panel, values[ends], limit[ends])
    lost = np.where(np.isfinite(first), first, np.nan)
    look = dict(color="0.93", linewidth=0, zorder=0)
    panel.band(values, lost, top, "no disturbance is held", **look)
    meets = np.isin(dataset["limit_kind"].values[:, 0].astype(str), ["fold", "corner"])
    if meets.any():
        folds = np.where(meets, first, np.nan)
        look = dict(color="black", linewidth=2.6, zorder=3)
        panel.line(values, folds, "two limit cycles meet", **look)
    if "design_from" in dataset.variables and np.isfinite(dataset["design_damping_ratio"]):
        ends = {float(dataset[end].values[0]): None for end in ("design_from", "design_to")}
        label = "best value" if len(ends) == 1 else "first and last of the best values"
        ratio = [float(dataset["design_damping_ratio"])] * len(ends)
        look = MARK | dict(markersize=5, zorder=4, markerfacecolor="white", clip_on=False)
        panel.line([*ends], ratio, label, marker="D", **look)
    return Picture([panel])
