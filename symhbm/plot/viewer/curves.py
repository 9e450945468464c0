"""Curves as a page holds them: their points, lines between them, and what is marked."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from symhbm.numerics import FloatArray
from symhbm.plot.curves import traced
from symhbm.plot.drawing import decibel, moving
from symhbm.plot.lines import located_peaks
from symhbm.plot.measurements import check_measured, measured_points, mode_points
from symhbm.plot.places import Chosen, chosen
from symhbm.plot.viewer.packing import packed, plain, thinned
from symhbm.plot.viewer.sets import Layout, Panel

_OF_POINTS = (
    *("frequency", "truncation_error", "sampling_error", "condensation_error", "residual_norm"),
    *("stability", "growth_rate", "highest_harmonic", "converged", "cycle_branch"),
)
"""Variables of a point that a page shows next to its place on the curve."""
_STRAIGHT = 0.01
"""Distance [dB] of a drawn line from the curve between its points."""
_SAME = 1e-9
"""Relative distance of a mark from the point that it is."""


class Limits(NamedTuple):
    """The most points of a curve, the most of its drawn lines, and the places beside the largest.

    ``dofs`` are the degrees of freedom that have curves of their own.
    """

    points: int
    lines: int
    dofs: tuple[int, ...]


def curve_of(one: xr.Dataset, layout: Layout, limits: Limits) -> dict[str, Any]:
    """The points, lines and marks of one parameter set as the page holds them."""
    value = _rows(one, layout.x, layout)[:, 0]
    panels = [_rows(one, panel.name, layout, panel.places) for panel in layout.panels]
    on_path = layout.along == ("point",) and "n_points" in one.variables
    n_found = int(one["n_points"]) if on_path else 0
    found = np.isfinite(value)
    if not layout.joined:
        found &= np.isfinite(panels[0]).all(axis=1)
    rows = np.flatnonzero(found)
    value, panels = value[rows], [panel[rows] for panel in panels]
    state = _states(one, layout)
    state = None if state is None else state[rows]
    marks = _marks(one, layout, value, panels)
    keep = np.zeros(len(value), dtype=bool)
    keep[[mark["point"] for mark in marks if mark["point"] >= 0]] = True
    keep |= _turns(value, one, layout, state, rows)
    levels = np.concatenate(
        [
            _level(values.max(axis=1, keepdims=True) if panel.places else values, panel)
            for values, panel in zip(panels, layout.panels, strict=True)
        ],
        axis=1,
    )
    chosen = thinned(value, levels, keep, limits.points)
    new = np.full(len(value), -1)
    new[chosen] = np.arange(len(chosen))
    for mark in marks:
        mark["row"] = int(rows[mark["point"]]) if mark["point"] >= 0 else -1
        mark["point"] = int(new[mark["point"]]) if mark["point"] >= 0 else -1
    entry: dict[str, Any] = {
        "n": [len(chosen), len(value)],
        "failed": max(0, n_found - len(value)),
        "x": packed(value[chosen]),
        "row": packed(rows[chosen], "i4"),
        "columns": {},
        "marks": marks,
    }
    for values, panel in zip(panels, layout.panels, strict=True):
        for place, column in _columns(values[chosen], panel, limits.dofs):
            entry["columns"][f"{panel.name}:{place}"] = packed(column)
    for name in _told(one, layout):
        column = _rows(one, name, layout)[rows[chosen], 0]
        entry["columns"][name] = packed(column)
    if layout.panels[0].places and len(chosen) and panels[0].shape[1] > 1:
        first = np.argmax(np.nan_to_num(panels[0][chosen], nan=-1.0), axis=1)
        entry["columns"]["largest"] = packed(first, "i4")
    if state is not None:
        entry["states"] = packed(state[chosen], "i1")
    if layout.panels[0].places and layout.joined and len(value) > 1:
        entry["lines"] = _lines(one, limits)
    measured = check_measured(one, None)
    if measured is not None:
        entry["measured"] = _measured(measured, one, layout, limits)
    return entry


def _measured(
    measured: xr.Dataset, one: xr.Dataset, layout: Layout, limits: Limits
) -> dict[str, Any]:
    """Points that a fit holds, by panel and place as the columns of the curve."""
    points = {}
    for panel in layout.panels:
        if panel.places and layout.x == "frequency":
            for place, where in _places(one, limits):
                points[f"{panel.name}:{place}"] = measured_points(measured, one, where)
        elif layout.x == "amplitude" and panel.name in ("frequency", "damping_ratio"):
            points[f"{panel.name}:0"] = mode_points(measured, one, panel.name)
    return {name: {"x": packed(x), "y": packed(y)} for name, (x, y) in points.items() if len(x)}


def _rows(one: xr.Dataset, name: str, layout: Layout, places: bool = False) -> FloatArray:
    """A variable at all points, (n, 1) or (n, n_dof)."""
    if not layout.along:
        return np.empty((0, one.sizes.get("dof", 1) if places else 1))
    variable = one[name].variable
    if variable.dtype.kind not in "iufb":
        raise TypeError(f"{name} holds {variable.dtype}, expected numbers")
    sizes = {dim: one.sizes[dim] for dim in (*layout.along, *(("dof",) if places else ()))}
    if not set(map(str, variable.dims)) <= set(sizes):
        raise ValueError(f"{name} has the dimensions {variable.dims}, expected {tuple(sizes)}")
    values = variable.set_dims(sizes).transpose(*sizes).values.astype(float)
    return values.reshape(int(np.prod([one.sizes[dim] for dim in layout.along])), -1)


def _told(one: xr.Dataset, layout: Layout) -> list[str]:
    """Names of the variables of each point that a page shows."""
    shown = {layout.x, *(panel.name for panel in layout.panels)}
    if not layout.along:
        return []
    return [
        name
        for name in _OF_POINTS
        if name in one.variables
        and name not in shown
        and set(map(str, one[name].dims)) <= set(layout.along)
    ]


def _states(one: xr.Dataset, layout: Layout) -> np.ndarray | None:
    """What contacts do at all points, (n, n_contacts)."""
    if not layout.along or not {"contact_state", "contact"} <= {*one.variables, *one.dims}:
        return None
    variable = one["contact_state"].variable
    dims = (*layout.along, "contact")
    if set(map(str, variable.dims)) != set(dims) or variable.dtype.kind not in "iu":
        return None
    return variable.transpose(*dims).values.reshape(-1, one.sizes["contact"])


def _level(values: FloatArray, panel: Panel) -> FloatArray:
    """What the eye sees of values: decibels, or shares of their range."""
    if panel.scales[0] != "linear":
        with np.errstate(invalid="ignore"):
            level = decibel(np.abs(values))
        return np.where(np.isfinite(level), level, np.nan)
    finite = values[np.isfinite(values)]
    span = np.ptp(finite) if finite.size else 0.0
    return np.where(np.isfinite(values), 40 * values / (span or 1.0), np.nan)


def _turns(value: FloatArray, one: xr.Dataset, layout: Layout, state: Any, rows: Any) -> np.ndarray:
    """Points beside which something changes: the way of the path, a contact, stability."""
    keep = np.zeros(len(value), dtype=bool)
    if len(value) < 3:
        return keep
    step = np.sign(np.diff(value))
    keep[1:-1] = step[1:] != step[:-1]
    others = [] if state is None else [state]
    if "stability" in _told(one, layout):
        others.append(_rows(one, "stability", layout)[rows])
    for other in others:
        changes = (other[1:] != other[:-1]).any(axis=1)
        keep[1:] |= changes
        keep[:-1] |= changes
    return keep


def _columns(values: FloatArray, panel: Panel, dofs: Sequence[int]) -> list[tuple[int, FloatArray]]:
    """Columns by place: 0 is the largest response, or the only one; k + 1 is place k."""
    if not panel.places:
        return [(0, values[:, 0])]
    largest = values.max(axis=1) if values.shape[1] else np.full(len(values), np.nan)
    return [(0, largest), *((dof + 1, values[:, dof]) for dof in dofs)]


def _places(one: xr.Dataset, limits: Limits) -> list[tuple[int, Chosen]]:
    """The largest response, 0, and each place, by number: names in an archive may be anything."""
    each = [(dof + 1, Chosen((dof,), "", every=False)) for dof in limits.dofs]
    return [(0, chosen(one, None)), *each]


def _lines(one: xr.Dataset, limits: Limits) -> dict[str, Any]:
    """Lines by place that follow the slopes at the points, as pictures draw them."""
    parameter, lines = moving(one), {}
    for place, where in _places(one, limits):
        line = traced(one, parameter, where).line
        if len(line.value) < 2:
            continue
        value, level, unstable = line.polyline()
        joint = np.zeros(len(value), dtype=bool)
        joint[1:-1] = unstable[1:] != unstable[:-1]
        joint[1:-1] |= np.sign(np.diff(value))[1:] != np.sign(np.diff(value))[:-1]
        level = np.where(np.isfinite(level), level, np.nan)
        kept = thinned(value, level[:, None], joint, limits.lines, _STRAIGHT)
        lines[str(place)] = {"x": packed(value[kept], "f8"), "y": packed(level[kept], "f4")}
        if unstable.any():
            lines[str(place)]["unstable"] = packed(unstable[kept[:-1]], "i1")
    return lines


def _marks(
    one: xr.Dataset, layout: Layout, value: FloatArray, panels: list[FloatArray]
) -> list[dict[str, Any]]:
    """Peaks and events: where they are, and the points that they are."""
    parameter, tied = moving(one), dict[float, list[int]]()
    for peak in located_peaks(one, parameter):
        tied.setdefault(peak.value, []).append(peak.dof)
    largest = panels[0].max(axis=1, initial=0.0) if panels else np.empty(0)
    marks = []
    for what in ("peak", "event"):
        name = f"{what}_{layout.x}"
        if name not in one.variables or one[name].dims != (what,):
            continue
        kinds = one[f"{what}_kind"].values if f"{what}_kind" in one.variables else None
        for k in np.flatnonzero(np.isfinite(one[name].values)).tolist():
            at, kind = one[name].values[k].item(), "" if kinds is None else plain(kinds[k], 60)
            mark = {"what": what, "number": k, "x": at, "kind": kind or what}
            marks.append(mark)
            if what == "event":
                contact = _entry(one, "event_contact", k)
                mark["point"] = _same(value, at)
                mark["contact"] = -1 if contact is None else int(contact)
                continue
            top, dof = _entry(one, "peak_amplitude", k), _entry(one, "peak_dof", k)
            own = [] if dof is None else [int(dof)]
            # The number of the point that the peak is; on grids it lies between two of them.
            point = _same(value, at, largest, top)
            mark |= {
                "dofs": own if parameter.per_dof else sorted({*own, *tied.get(at, [])}),
                "y": top,
                "point": point,
                "leads": point < 0 or top is None or bool(top >= (1 - 1e-6) * largest[point]),
                "truncation_error": _entry(one, "peak_truncation_error", k),
                "residual_norm": _entry(one, "peak_residual_norm", k),
            }
    return marks


def _entry(one: xr.Dataset, name: str, number: int) -> float | None:
    """A finite number of a peak or an event, None where there is none."""
    if name not in one.variables or one[name].ndim != 1 or one[name].dtype.kind not in "iuf":
        return None
    entry = one[name].values[number].item()
    return entry if np.isfinite(entry) else None


def _same(
    value: FloatArray, at: float, largest: FloatArray | None = None, top: float | None = None
) -> int:
    """The number of the point at a value, of several that with the nearest amplitude; else -1."""
    near = np.flatnonzero(np.abs(value - at) <= _SAME * abs(at))
    if not len(near):
        return -1
    if largest is None or top is None:
        return int(near[np.argmin(np.abs(value[near] - at))])
    return int(near[np.argmin(np.abs(largest[near] - top))])
