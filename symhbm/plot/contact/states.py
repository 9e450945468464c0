"""What contacts do: over the band, and over the interface that they lie in."""

from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from symhbm.model.contacts import Behaviour
from symhbm.numerics import FloatArray, check
from symhbm.plot.drawing import (
    Moving,
    check_variables,
    moving,
    nothing_to_draw,
    parameter_axis,
    scaled,
    value_label,
)
from symhbm.plot.picture import Axis, Colours, Panel, Picture
from symhbm.plot.rendering import pictured
from symhbm.results import Description, meaning

MOST_ROWS = 40
"""Most rows of contacts and parameter sets: more cannot be distinguished."""
LOOKS: dict[int, tuple[Any, str]] = {
    Behaviour.STICKS: ("#2f5d8a", "sticks"),
    Behaviour.SLIPS: ("#f0a030", "slips"),
    Behaviour.OPENS: ("#b03a5b", "opens"),
    Behaviour.NEVER_TOUCHES: ("#d9d9d9", "open; never touches"),
}
"""Colours and words of states."""
_ROW, _STRIP = 0.8, 0.25
"""Height of a row, and share of it for its states."""
_TALLEST = 12.0
"""Largest height of a figure [inch]."""


class _Run(NamedTuple):
    """One contact along points (n,) of a path, one way, or of a grid.

    ``value`` of the moving parameter, ``state``, shares of the period that it is open and that it
    ``sticks``, and values at which its state changes, the ``events``.
    """

    value: FloatArray
    state: NDArray[np.int_]
    open: FloatArray
    sticks: FloatArray
    events: FloatArray


@pictured
def states(dataset: xr.Dataset, *, contact: int | None = None, ax: Axes | None = None) -> Picture:
    """Draw what contacts do over the moving parameter, a row for each contact and parameter set.

    The strip on top of a row is the state: a contact sticks throughout the period, or slips in some
    part of it, or opens, or never touches. Below it are the shares of the period that it sticks,
    slips and is open, as heights. Where a path folds, each way of it has a part of the row, the
    first at the bottom, and so has each solution on a grid. Rows are empty where points did not
    converge or the path does not reach.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow`.
    contact
        The contact to show; by default all of them.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For a dataset without curves, one without a converged point, more than 40 rows, and bad
        arguments.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.Model(
    ...     [[1.0]], [[2.0]], [[1e4]],
    ...     contacts={"stop": sh.Gap(normal=(0,), normal_stiffness=2e4, gap=1e-3)},
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=15.0), (0, 1, 2, 3))
    >>> figure = sh.plot.states(sh.frf(problem, (10, 25), progress=False))
    >>> figure.savefig("states.png")
    """
    check_variables(dataset, "contact_state", "frequency")
    parameter = moving(dataset)
    dims = [str(dim) for dim in dataset["contact_state"].dims]
    for dim in (parameter.along, "contact"):
        check.known(dim, dims, "dimension of contact_state")
    if contact is not None:
        number = check.integer("contact", contact, 0, dataset.sizes["contact"] - 1)
        dataset = dataset.isel(contact=[number])
    swept = [dim for dim in dims if dim not in (parameter.along, "contact", "solution")]
    rows = _rows(dataset, swept)
    if len(rows) > MOST_ROWS:
        raise ValueError(
            f"dataset: expected at most {MOST_ROWS} rows, got {len(rows)} of contacts and "
            "parameter sets; give contact=, or select some, for example "
            f"dataset.isel({(swept or ['contact'])[0]}=slice(10))"
        )
    every = [_runs(dataset.isel(position), parameter) for position, _ in rows]
    if not any(every):
        raise nothing_to_draw(dataset)
    values = np.concatenate([run.value for runs in every for run in runs])
    seen = {int(state) for runs in every for run in runs for state in np.unique(run.state)}
    if Behaviour.OPENS in seen:
        seen.add(Behaviour.NEVER_TOUCHES)  # the share that it is open has the same colour
    across = parameter_axis(dataset, parameter.name, limits=(values.min(), values.max()))
    ticks = range(len(rows)), [label for _, label in reversed(rows)]
    upward = Axis(limits=(-0.5, len(rows) - 0.5), ticks=ticks, grid=False, marks=False)
    panel = Panel(across, upward)
    for row, runs in enumerate(reversed(every)):
        height = _ROW / max(len(runs), 1)
        for i, run in enumerate(runs):
            _draw(panel, run, row - _ROW / 2 + i * height, 0.94 * height)
    for state in sorted(seen & {*LOOKS} | {Behaviour.STICKS}):
        color, words = LOOKS[state]
        panel.entry(words, facecolor=color)
    height = 1.0 + 0.45 * sum(max(len(runs), 1) for runs in every)
    return Picture([panel], (6.4, min(max(2.0, height), _TALLEST)))


def _rows(dataset: xr.Dataset, swept: list[str]) -> list[tuple[dict[str, int], str]]:
    """Position and label of each contact and parameter set."""
    rows = []
    numbers = [range(dataset.sizes[dim]) for dim in (*swept, "contact")]
    for *index, contact in product(*numbers):
        position = dict(zip(swept, index, strict=True))
        words = [value_label(dataset, dim, i) for dim, i in position.items()]
        if dataset.sizes["contact"] > 1 or not swept:
            words.append(f"contact {dataset['contact'].values[contact]}")
        rows.append((position | {"contact": contact}, ", ".join(words)))
    return rows


def _runs(curve: xr.Dataset, parameter: Moving) -> list[_Run]:
    """The ways of a path, or the solutions on a grid, those of known states."""
    value, state = curve[parameter.name].values, curve["contact_state"]
    open_, sticks = (
        curve[name] if name in curve.variables else xr.full_like(state, np.nan, dtype=float)
        for name in ("open_fraction", "stick_fraction")
    )
    events = np.empty(0)
    if f"event_{parameter.name}" in curve and "event_contact" in curve:
        own = curve["event_contact"].values == curve["contact"].values
        events = curve[f"event_{parameter.name}"].values[own]
    solutions = [{}]
    if "solution" in state.dims:
        solutions = [dict(solution=i) for i in range(curve.sizes["solution"])]
    runs = []
    for solution in solutions:
        parts = [of.isel(solution).values for of in (state, open_, sticks)]
        known = np.isfinite(value) & (parts[0] >= 0)
        if not known.any():
            continue
        # Points that did not converge leave holes: what lies between them is not known.
        own, opened, stuck = parts
        apart = np.where(own == Behaviour.NEVER_TOUCHES, 1.0, np.nan_to_num(opened))
        sticking = np.where(np.isnan(stuck), np.where(own == Behaviour.SLIPS, 0, 1 - apart), stuck)
        turns = _turns(value)
        for first, last in pairwise(turns):
            part = slice(first, last + 1)
            if known[part].any():
                runs.append(_Run(value[part], own[part], apart[part], sticking[part], events))
    return runs


def _turns(value: FloatArray) -> list[int]:
    """Numbers of the first and the last point and of those between at which a path turns back."""
    finite = np.flatnonzero(np.isfinite(value))
    steps = np.sign(np.diff(value[finite]))
    moved = np.flatnonzero(steps)
    back = moved[1:][steps[moved[1:]] != steps[moved[:-1]]]
    return [int(finite[0]), *finite[back].tolist(), int(finite[-1])]


def _draw(panel: Panel, run: _Run, bottom: float, height: float) -> None:
    """Shares of the period as heights, and the states above them."""
    if run.value[0] > run.value[-1]:
        turned = run.value[::-1], run.state[::-1], run.open[::-1], run.sticks[::-1]
        run = _Run(*turned, run.events)
    known = run.state >= 0
    top = bottom + (1 - _STRIP) * height
    levels = [np.zeros(len(known)), run.sticks, 1 - run.open, np.ones(len(known))]
    for state, pair in zip(
        (Behaviour.STICKS, Behaviour.SLIPS, Behaviour.NEVER_TOUCHES), pairwise(levels), strict=True
    ):
        edges = (bottom + np.clip(level, 0, 1) * (top - bottom) for level in pair)
        look: Any = dict(color=LOOKS[state][0], linewidth=0, alpha=0.55, where=known)
        panel.band(run.value, *edges, **look)
    for state, (low, high) in zip(run.state.tolist(), pairwise(_borders(run)), strict=True):
        if state >= 0 and high > low:
            strip = [low, high], bottom + 0.03 * height + (1 - _STRIP) * height, bottom + height
            panel.band(*strip, color=LOOKS[state][0], linewidth=0)


def _borders(run: _Run) -> FloatArray:
    """Where the states of points begin and the last ends: half-way, or at the event between."""
    value = run.value
    middle = (value[1:] + value[:-1]) / 2
    for i in np.flatnonzero(run.state[1:] != run.state[:-1]):
        inside = run.events[(run.events >= value[i]) & (run.events <= value[i + 1])]
        if len(inside):
            middle[i] = inside[0]
    return np.concatenate([value[:1], middle, value[-1:]])


_AXES = "xyz"


@pictured
def contact_map(
    dataset: xr.Dataset, variable: str = "contact_state", *, ax: Axes | None = None
) -> Picture:
    """Draw what contacts do where they are: the state, a force or a loss over an interface.

    The picture is the plane of the two axes along which contacts lie farthest apart.

    Parameters
    ----------
    dataset
        One point of a result of a structure whose places have coordinates, as
        ``response.isel(point=3)``; some contacts of it, as ``.isel(contact=slice(20))``, are one
        interface of several.
    variable
        A variable with one value per contact: ``"contact_state"``, ``"dissipation"``,
        ``"stick_fraction"``, or those of a law, for example ``"open_fraction"``.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For a dataset without places of contacts or without the variable, for more than one point,
        and where no value is known.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> places = sh.Places(
    ...     node=[1, 2], direction="x", coordinates=[[0, 0, 0], [0, 0.01, 0]], label=["tip", ""]
    ... )
    >>> blade = sh.Model(
    ...     np.eye(2), np.eye(2), 1e4 * np.eye(2), contacts=[("1:x",), ("2:x",)],
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=[0.1, 5], places=places,
    ... )
    >>> point = sh.solve(sh.HarmonicBalance(blade, sh.forces.PointForce("tip:x")), 19)
    >>> figure = sh.plot.contact_map(point)
    >>> figure.savefig("contacts.png")
    """
    check_variables(dataset, variable, "contact_state")
    check_variables(dataset, *(f"contact_{axis}" for axis in _AXES))
    values = dataset[variable]
    if values.dims != ("contact",):
        raise ValueError(
            f"dataset: expected one value of {variable} per contact, it is along "
            f"{', '.join(map(str, values.dims)) or 'nothing'}; select one point, as "
            "dataset.isel(point=0)"
        )
    at = np.column_stack([dataset[f"contact_{axis}"].values for axis in _AXES])
    axes = sorted(np.argsort(-np.ptp(at, axis=0), kind="stable")[:2].tolist())
    known = values.values >= 0 if variable == "contact_state" else np.isfinite(values.values)
    if not known.any():
        raise nothing_to_draw(dataset)
    factor, unit = scaled(float(np.abs(at[:, axes]).max()), "m")
    x, y = factor * at[:, axes].T
    across, upward = (Axis(f"${_AXES[k]}$ [{unit}]", room=0.08) for k in axes)
    panel = Panel(across, upward, even="datalim")
    look: Any = dict(linewidths=0.4, edgecolors="black", zorder=3)
    if not known.all():
        panel.add("dots", x, y, ~known, facecolors="none", **look)
    shown = values.values[known]
    if variable == "contact_state":
        colors = [LOOKS[state][0] for state in shown.tolist()]
        panel.add("dots", x, y, known, c=colors, **look)
        for state in sorted({*shown.tolist()}):
            color, words = LOOKS[state]
            panel.entry(words.removeprefix("open; "), facecolor=color)
    else:
        about = meaning(variable, Description(dataset).records)
        factor, unit = 1.0, "" if about.units == "1" else about.units
        if unit:
            factor, unit = scaled(float(np.abs(shown).max()), unit)
        shown, label = factor * shown, f"{about.long_name} [{unit}]" if unit else about.long_name
        panel.bar = Colours("viridis", shown.min(), shown.max(), label=label)
        panel.add("dots", x, y, known, c=shown, cmap=panel.bar.map, **look)
    return Picture([panel], (6.4, 4.2))
