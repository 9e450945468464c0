"""Maps of the share of a period that contacts stick."""

from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.numerics import FloatArray, check
from symhbm.plot.drawing import (
    Moving,
    axis_label,
    check_anything,
    check_dims,
    check_variables,
    is_wide,
    moving,
    numbers_along,
    one_solution,
)
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Axis, Colours, Panel, Picture

N_VALUES = 600
"""Values of the common grid of paths: about the pixels of a figure."""


@pictured
def stick_map(
    dataset: xr.Dataset,
    *,
    contact: int | str = "mean",
    over: str | None = None,
    **common: Unpack[Look],
) -> Picture:
    """Draw the share of the period that contacts stick, over the moving and a swept parameter.

    Each cell is one value. A line divides cells that slip or open from those that do not. Hatched
    cells hold nothing: their points did not converge, or the path does not reach them. Paths are
    read off a common grid of 600 values, linearly between their points.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow`, over a grid (``at=``) or paths.
    contact
        One contact, or the ``"mean"`` or the ``"least"`` of all that have friction.
    over
        The swept parameter or dimension; by default the only one there is.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For a dataset that is no family of curves, one that folds, one without a converged point,
        and bad arguments.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> loads = sh.frf(problem, (10, 30), at=range(10, 31), over={"normal_load": [1, 3, 10]})
    >>> sh.plot.stick_map(loads).savefig("map.png")
    """
    check_variables(dataset, "stick_fraction", "frequency")
    parameter = moving(dataset)
    for dim in (parameter.along, "contact"):
        dims = [str(d) for d in dataset["stick_fraction"].dims]
        check.known(dim, dims, "dimension of stick_fraction")
    dataset = one_solution(dataset)
    check_anything(dataset, "stick_fraction")
    over = _swept(dataset, parameter, over)
    fraction, title = _chosen(dataset, contact)
    values = numbers_along(dataset, over)
    order = np.argsort(values, kind="stable")
    y = values[order]
    if np.any(np.diff(y) == 0):
        raise ValueError(f"over={over!r}: expected different values, some are there twice")
    table, x = fraction.transpose(over, parameter.along).values[order], dataset[parameter.name]
    if parameter.along == "point":
        paths = x.broadcast_like(fraction).transpose(over, "point").values[order]
        x, table = _on_common_grid(paths, table)
    across = Axis(axis_label(dataset, parameter.name), grid=False)
    across.log = parameter.name != "frequency" and is_wide(np.asarray(x))
    upward = Axis(axis_label(dataset, over), grid=False)
    upward.log = over in dataset.coords and is_wide(y)
    labels = dataset[over].values[order] if over in dataset.coords else y
    upward.whole = labels.dtype.kind in "iu" and not upward.log
    if labels.dtype.kind not in "iuf":
        upward.ticks = y.tolist(), [str(label) for label in labels]
    missing = int(np.isnan(table).sum())
    if missing:
        title += f"; hatched: {100 * missing / table.size:.2g} % without values"
    panel = Panel(across, upward, title=title)
    panel.add("ground", facecolor="0.93", edgecolor="0.6", hatch="////", linewidth=0)
    panel.bar = Colours("viridis", 0, 1, label="share of the period that sticks")
    edges = _edges(np.asarray(x), across.log), _edges(y, upward.log)
    panel.add("cells", *edges, table, panel.bar)
    for color, width in (("white", 2.6), ("black", 1.0)):
        look: Any = dict(colors=color, linewidths=width, capstyle="projecting")
        panel.add("segments", _outline(*edges, table), **look)
    return Picture([panel])


def _outline(x: FloatArray, y: FloatArray, table: FloatArray) -> FloatArray:
    """Edges (n, 2, 2) of cells between those that slip and those that do not."""
    filled, slips = np.isfinite(table), table < 1
    row, column = np.nonzero((slips[:, 1:] != slips[:, :-1]) & filled[:, 1:] & filled[:, :-1])
    upright = np.stack([x[column + 1], y[row], x[column + 1], y[row + 1]], axis=-1)
    row, column = np.nonzero((slips[1:] != slips[:-1]) & filled[1:] & filled[:-1])
    level = np.stack([x[column], y[row + 1], x[column + 1], y[row + 1]], axis=-1)
    return np.concatenate([upright, level]).reshape(-1, 2, 2)


def _swept(dataset: xr.Dataset, parameter: Moving, over: str | None) -> str:
    dims = [str(d) for d in dataset["stick_fraction"].dims if d not in (parameter.along, "contact")]
    if over is None:
        if not dims:
            raise ValueError("over=None: expected a dataset of several parameter sets, this is one")
        over = dims[0]
    check.known(over, dims, "swept dimension of the dataset")
    check_dims(dataset["stick_fraction"], (parameter.along, "contact", over), "one swept dimension")
    return over


def _chosen(dataset: xr.Dataset, contact: int | str) -> tuple[xr.DataArray, str]:
    """Stick fraction of one contact or of all, and its name."""
    fraction = dataset["stick_fraction"]
    if not isinstance(contact, str):
        contact = check.integer("contact", contact, 0, dataset.sizes["contact"] - 1)
        return fraction.isel(contact=contact), f"contact {contact}"
    names = {"mean": "mean of the contacts", "least": "contact that sticks least"}
    if contact not in names:
        raise ValueError(
            f"contact={contact!r}: expected the number of a contact, 'mean' or 'least'"
        )
    if "contact_stiffness" in dataset.variables:
        stiffness = dataset["contact_stiffness"]
        others = [dim for dim in stiffness.dims if dim != "contact"]
        rubs = (stiffness > 0).any(others)
        if "contact" in rubs.dims and rubs.any():
            fraction = fraction.isel(contact=rubs.values)
    told = fraction.notnull().any([dim for dim in fraction.dims if dim != "contact"])
    if told.any():
        fraction = fraction.isel(contact=told.values)
    name = names[contact] if fraction.sizes["contact"] > 1 else "contact 0"
    reduced = fraction.mean if contact == "mean" else fraction.min
    return reduced("contact", skipna=False), name


def _on_common_grid(value: FloatArray, table: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values (n,) and the table (n_sets, n) from paths (n_sets, n_points), padded with NaN."""
    finite = value[np.isfinite(value)]
    wide = is_wide(finite)
    grid = (np.geomspace if wide else np.linspace)(finite.min(), finite.max(), N_VALUES)
    rows = np.full((len(value), N_VALUES), np.nan)
    for row, x, y in zip(rows, value, table, strict=True):
        inside = np.isfinite(x)
        x, y = x[inside], y[inside]
        if len(x) > 1 and x[0] > x[-1]:
            x, y = x[::-1], y[::-1]
        if np.any(np.diff(x) <= 0):
            raise ValueError(
                "dataset: expected curves that do not fold, which have one value at each place; "
                "compute them on a grid, with at="
            )
        if len(x):
            row[:] = np.interp(grid, x, y, left=np.nan, right=np.nan)
    return grid, rows


def _edges(centre: FloatArray, logarithmic: bool) -> FloatArray:
    """Edges (n + 1,) of cells around values (n,): half-way, in logarithms where asked."""
    if logarithmic:
        return np.exp(_edges(np.log(centre), False))
    if len(centre) == 1:
        return centre[0] + np.array([-0.5, 0.5])
    middle = (centre[1:] + centre[:-1]) / 2
    return np.concatenate([[2 * centre[0] - middle[0]], middle, [2 * centre[-1] - middle[-1]]])
