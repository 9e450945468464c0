"""Which histories a picture shows: those of chosen points, of a group together, from angle 0 on."""

from typing import Any

import numpy as np
import xarray as xr

from symhbm.model.contacts import Behaviour, History
from symhbm.numerics import check
from symhbm.plot.contact.histories import Histories, contact_of, histories
from symhbm.plot.drawing import MOST_LEGEND_ENTRIES, check_variables, moving, point_of
from symhbm.plot.picture import Axis
from symhbm.results import Description
from symhbm.results.reading import At

TURN = 2 * np.pi
"""A period [rad]."""


def at_points(dataset: xr.Dataset, at: At | None) -> xr.Dataset:
    """One point of each curve, by default of whole paths and of more than a legend names."""
    check_variables(dataset, "frequency")
    name = moving(dataset).name
    values = dataset.get(name, xr.DataArray(0.0))
    shape = dataset.get("amplitude", values)
    shape = shape.isel(dof=0, drop=True) if "dof" in shape.dims else shape
    count = int(np.isfinite(values.broadcast_like(shape)).sum())
    whole = "point" in values.dims and count == dataset.get("n_points", xr.DataArray(0)).sum()
    many = {"point", name} & {*map(str, values.dims)} and count > MOST_LEGEND_ENTRIES
    return point_of(dataset, at) if at is not None or whole or many else dataset


def together(dataset: xr.Dataset, name: str) -> tuple[Histories, dict[tuple[int, ...], float]]:
    """A group of contacts as one: their forces over their mean displacement, and their losses.

    The latter are the energies [J] that all of them dissipate per cycle, by the same indices.
    """
    groups = Description(dataset).groups
    sizes = {n: len(each["pairs"][0]) for n, each in groups.items()}
    sizes = sizes or {"friction": dataset.sizes["contact"]}
    check.known(name, sizes, "group of contacts")
    first = sum(sizes[before] for before in [*sizes][: [*sizes].index(name)])
    numbers = range(first, first + sizes[name])
    every = [histories(dataset, contact_of(dataset, number)) for number in numbers]
    of: dict[tuple[int, ...], History | None] = {}
    lost: dict[tuple[int, ...], float] = {}
    for index in every[0].of:
        members = [h for h in (one.of[index] for one in every) if h is not None]
        of[index] = _sum(members) if len(members) == len(every) else None
        lost[index] = sum(history.area(every[0].contact.rubbing) for history in members)
    return every[0]._replace(of=of), lost


def _sum(members: list[History]) -> History:
    """Mean displacements and summed forces, slipping where any of the members does."""
    first = members[0].angle[0]
    inside = np.concatenate([(each.angle - first) % TURN for each in members])
    angle = np.unique(np.append(inside, [0.0, TURN]))
    parts: list[tuple[Any, ...]] = []
    for each in members:
        own, at = each.angle - each.angle[0], (angle + first - each.angle[0]) % TURN
        at[-1] = at[0]
        table = np.vstack([each.displacement, each.force, each.limit])
        seen = np.array([np.interp(at, own, row) for row in table])
        state = each.state[np.searchsorted(own, at, side="right").clip(1, len(own) - 1) - 1]
        parts.append((*np.split(seen, [len(each.displacement), -1]), state))
    moved, force, limit, states = (np.array(part) for part in zip(*parts, strict=True))
    state = np.where((states == Behaviour.SLIPS).any(axis=0), Behaviour.SLIPS, states.min(axis=0))
    sums = force.sum(axis=0), limit.sum(axis=0)[0]
    return History(angle + first, moved.mean(axis=0), *sums, state)


def from_zero(history: History) -> History:
    """The same with points that lie around one period from 0 on."""
    turned = history.angle[:-1] % TURN
    order = np.argsort(turned, kind="stable")
    order = np.concatenate([order[-1:], order, order[:1]])
    angle = turned[order] - TURN * (np.arange(len(order)) == 0)
    angle[-1] += TURN
    sides = history.displacement[:, order], history.force[:, order]
    return History(angle, *sides, history.limit[order], history.state[order])


def angle_axis() -> Axis:
    """The axis of a period."""
    ticks = [f"${each}$" for each in ("0", r"\pi/2", r"\pi", r"3\pi/2", r"2\pi")]
    label = r"angle of the period $\omega t$ [rad]"
    return Axis(label, limits=(0, TURN), ticks=(np.arange(5) * np.pi / 2, ticks))
