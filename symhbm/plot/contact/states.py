"""What contacts do over the band, or through the period."""

from itertools import pairwise, product
from typing import Any, NamedTuple, Unpack

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from symhbm.model.contacts import Behaviour, History
from symhbm.numerics import FloatArray, check
from symhbm.plot.contact.histories import TURN, angle_axis, contact_of, from_zero, histories
from symhbm.plot.drawing import (
    Moving,
    check_variables,
    moving,
    nothing_to_draw,
    parameter_axis,
    point_of,
    point_text,
    value_label,
)
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.results.reading import At

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
def states(
    dataset: xr.Dataset, *, contact: int | None = None, at: At | None = None, **common: Unpack[Look]
) -> Picture:
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
    at
        One point of each curve, as of `symhbm.datasets.at`: what contacts do through the period
        there. So is the only point of a dataset without curves drawn.
    common
        As of all pictures.

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
    check.known("contact", dims, "dimension of contact_state")
    if at is not None or parameter.along not in dims:
        return _over_the_period(dataset if at is None else point_of(dataset, at), contact)
    if contact is not None:
        number = check.integer("contact", contact, 0, dataset.sizes["contact"] - 1)
        dataset = dataset.isel(contact=[number])
    swept = [dim for dim in dims if dim not in (parameter.along, "contact", "solution")]
    rows = _rows(dataset, swept)
    some = f"dataset.isel({(swept or ['contact'])[0]}=slice(10))"
    _check_rows(len(rows), f"contact=, or select some, for example {some}")
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
    _explain(panel, seen)
    height = 1.0 + 0.45 * sum(max(len(runs), 1) for runs in every)
    return Picture([panel], (6.4, min(max(2.0, height), _TALLEST)))


def _over_the_period(dataset: xr.Dataset, contact: int | None) -> Picture:
    """A row for each contact and parameter set at one point of each curve."""
    if contact is not None:
        contact = check.integer("contact", contact, 0, dataset.sizes["contact"] - 1)
    numbers = range(dataset.sizes["contact"]) if contact is None else [contact]
    rows: list[tuple[str, History]] = []
    dims: list[str] = []
    for number in numbers:
        found = histories(dataset, contact_of(dataset, number))
        dims = found.dims
        for index, history in found.of.items():
            words = [
                value_label(found.dataset, *pair) for pair in zip(found.dims, index, strict=True)
            ]
            if history is not None:
                rows.append((", ".join([*words, f"contact {number}"]), history))
    if not rows:
        raise nothing_to_draw(dataset)
    _check_rows(len(rows), "contact=")
    ticks = range(len(rows)), [label for label, _ in reversed(rows)]
    panel = Panel(
        angle_axis(),
        Axis(limits=(-0.5, len(rows) - 0.5), ticks=ticks, grid=False, marks=False),
        title="" if dims else point_text(dataset),
    )
    panel.x.grid = False
    for row, (_, history) in enumerate(reversed(rows)):
        history = from_zero(history)
        for state in np.unique(history.state):
            where = np.flatnonzero(history.state[:-1] == state)
            edges = np.stack([history.angle[where], history.angle[where + 1]], axis=1).clip(0, TURN)
            low, high = np.full(len(edges), row - _ROW / 2), np.full(len(edges), row + _ROW / 2)
            boxes = np.stack([edges[:, [0, 1, 1, 0]], np.stack([low, low, high, high], axis=1)], -1)
            panel.add("areas", boxes, facecolors=LOOKS[state][0], linewidths=0)
    _explain(panel, {int(state) for _, history in rows for state in np.unique(history.state)})
    return Picture([panel], (6.4, min(max(2.0, 1.0 + 0.45 * len(rows)), _TALLEST)))


def _explain(panel: Panel, seen: set[int]) -> None:
    """Entries of the states that are seen, and of those that stick."""
    for state in sorted(seen & {*LOOKS} | {Behaviour.STICKS}):
        color, words = LOOKS[state]
        panel.entry(words, facecolor=color)


def _check_rows(number: int, advice: str) -> None:
    if number > MOST_ROWS:
        raise ValueError(
            f"dataset: expected at most {MOST_ROWS} rows, got {number} of contacts and parameter "
            f"sets; give {advice}"
        )


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
