"""Hysteresis loops of contacts, and their normal forces."""

from collections.abc import Iterator
from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.model.contacts import Behaviour, History, MemorylessLaw
from symhbm.numerics import FloatArray, check
from symhbm.plot.contact.histories import (
    TURN,
    Histories,
    angle_axis,
    contact_of,
    from_zero,
    histories,
)
from symhbm.plot.drawing import (
    MOST_LEGEND_ENTRIES,
    Family,
    Member,
    check_variables,
    moving,
    nothing_to_draw,
    point_of,
    point_text,
    scaled,
)
from symhbm.plot.looks import Look, Named, compared, pictured
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.results import Description
from symhbm.results.reading import CHOSEN, At

_APART = 0.01
"""Share of the energy by which the loop of a group may differ from the sum of its contacts."""
_TOUCHES = Behaviour.STICKS, Behaviour.SLIPS
_EVENTS: dict[str, Any] = {
    "onset of slip": ((Behaviour.STICKS,), (Behaviour.SLIPS,), dict(marker="^")),
    "end of slip": (
        *((Behaviour.SLIPS,), (Behaviour.STICKS,)),
        dict(marker="o", markerfacecolor="white"),
    ),
    "opening": (_TOUCHES, (Behaviour.OPENS,), dict(marker="s", markerfacecolor="white")),
    "closing": ((Behaviour.OPENS,), _TOUCHES, dict(marker="D")),
}
"""What a contact does before and after its events, and their marks."""
_MARK: Any = dict(linestyle="", markersize=5)
_LIMIT: Any = dict(color="0.4", linewidth=0.9, linestyle=(0, (1, 2)), zorder=1)
_OPEN: Any = dict(linewidth=1.0, linestyle=(0, (2, 2)), alpha=0.6)
"""Lines of limits, and of contacts that are open."""


@compared
def hysteresis(
    dataset: xr.Dataset, *, contact: int | str = 0, at: At | None = None, **common: Unpack[Named]
) -> Picture:
    """Draw the friction force of a contact over its relative displacement through a period.

    Of planar friction the force across is a broken line, over the displacement across; each is
    within the circle of radius ``mu N``. Of a law without memory it is the force in each of its
    directions. The area of loops is the energy dissipated per cycle. Triangles are onsets of slip,
    circles its ends, squares openings and diamonds closings; where a contact is open the line is
    broken. Dotted lines are the limits of slip ``mu N``, which move with the normal force. Of a
    result of the balance it is the force located on the motion, not the few terms of its series
    that the balance sees. Of paths, and of more than 14 points on grids, it is the loop at the
    highest peak of each curve; else all points are drawn. Those that did not converge are left out,
    and the title tells how many.

    Parameters
    ----------
    dataset
        A result of `symhbm.periodic_motion`, `symhbm.frf`, `symhbm.follow` or `symhbm.solve`.
    contact
        The contact to show, or the name of a group: the sum of its forces over the mean of its
        displacements. The title tells what all of them dissipate, and the area of the loop where
        that is another one, as of contacts that do not move alike.
    at
        The points to show of curves, as of `symhbm.datasets.at`: ``"peak"``, the number of a peak,
        or a frequency [Hz].
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For a dataset without the motion, one without a converged point, a contact without friction,
        and bad arguments.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> sh.plot.hysteresis(sh.solve(problem, 20.0)).savefig("loop.png")
    """
    dataset = _at_points(dataset, at)
    if isinstance(contact, str):
        found, all_lost = _together(dataset, contact)
    else:
        found, all_lost = _of_friction(dataset, contact), None
    smooth, directions = isinstance(found.contact.law, MemorylessLaw), found.contact.rubbing
    loops = _Loops(found, directions)
    panel = Panel(
        Axis(f"relative displacement [{loops.unit}]"),
        Axis("contact force [N]" if smooth else "friction force [N]"),
    )
    for member, history in loops.members():
        for k in directions:
            look = member if k == directions[0] else member._replace(style="--")
            x = loops.factor * history.displacement[k]
            loops.add(panel, x, history.force[k], history, look)
    title = "" if all_lost is None else _apart(found, all_lost)
    if len(found.of) == 1:
        [history], area = loops.drawn, loops.drawn[0].area(directions)
        for k in directions:
            x, force = loops.factor * history.displacement[k], history.force[k]
            outline = np.stack([x, force], axis=-1)
            panel.add("areas", [outline], facecolors="0.94", edgecolors="0.94", zorder=0)
        for sign in (-1, 1) if history.limit.any() else ():
            if np.ptp(history.limit):
                x = loops.factor * history.displacement[0]
                panel.line(x, sign * history.limit, **_LIMIT)
            else:
                panel.add("level", sign * history.limit[0], **_LIMIT)
        total = area if all_lost is None else next(iter(all_lost.values()))
        factor, joule = scaled(total, "J")
        name = f"contact {contact}" if all_lost is None else f"all of {contact}"
        title = f"{name}: {factor * total:.4g} {joule} per cycle{title}"
    loops.explain(panel, title, r"limit $\pm\mu N$")
    return Picture([panel])


@pictured
def normal_force(
    dataset: xr.Dataset,
    *,
    contact: int = 0,
    over: str = "angle",
    at: At | None = None,
    **common: Unpack[Look],
) -> Picture:
    """Draw the normal force of a contact over the period, or over its normal displacement.

    Squares are openings and diamonds closings; where a contact is open the line is broken. Of
    contacts with friction, triangles are onsets of slip and circles its ends.

    Parameters
    ----------
    dataset
        A result of `symhbm.periodic_motion`, `symhbm.frf`, `symhbm.follow` or `symhbm.solve`.
    contact
        The contact to show.
    over
        ``"angle"`` of the period, or ``"displacement"``, positive where the contact closes.
    at
        The points to show of curves, as of `hysteresis`.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For a dataset without the motion, one without a converged point, a contact without a normal
        direction, and bad arguments.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.Model(
    ...     [[1.0]], [[2.0]], [[1e4]],
    ...     contacts={"stop": sh.Gap(normal=(0,), normal_stiffness=2e4, gap=1e-3)},
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=15.0), (0, 1, 2, 3))
    >>> figure = sh.plot.normal_force(sh.solve(problem, 17))
    >>> figure.savefig("normal_force.png")
    """
    over = check.one_of("over", over, ("angle", "displacement"))
    which = contact_of(dataset, contact)
    if "normal" not in which.law.directions:
        raise ValueError(
            f"contact={contact}: expected one with a normal direction, it is of "
            f"{type(which.law).__name__} in the group {which.group!r}, whose load is constant"
        )
    found = histories(_at_points(dataset, at), which)
    loops = _Loops(found, [-1])
    label = f"normal displacement, positive where it closes [{loops.unit}]"
    panel = Panel(Axis(label), Axis("normal force [N]"))
    if over == "angle":
        panel.x = angle_axis()
    for member, history in loops.members():
        if over == "angle":
            history = from_zero(history)
        x = history.angle if over == "angle" else loops.factor * history.displacement[-1]
        loops.add(panel, x, history.force[-1], history, member)
    loops.explain(panel, f"contact {contact}" if len(found.of) == 1 else "")
    return Picture([panel])


def _apart(found: Histories, lost: dict[tuple[int, ...], float]) -> str:
    """Text on a group whose loop has another area than the sum of its contacts."""
    of = found.of.items()
    areas = [(h.area(found.contact.rubbing), lost[index]) for index, h in of if h is not None]
    shares = [area / total for area, total in areas if abs(area - total) > _APART * abs(total)]
    if not shares:
        return ""
    held = " to ".join(dict.fromkeys(f"{100 * share:.3g}" for share in (min(shares), max(shares))))
    return f"; contacts move apart, the loop holds {held} %"


def _of_friction(dataset: xr.Dataset, contact: int) -> Histories:
    which = contact_of(dataset, contact)
    if "tangential" not in which.law.directions and not isinstance(which.law, MemorylessLaw):
        raise ValueError(
            f"contact={contact}: expected one with friction, it is of {type(which.law).__name__} "
            f"in the group {which.group!r}; symhbm.plot.normal_force draws its force"
        )
    return histories(dataset, which)


class _Loops:
    """Lines over a period of a family of histories: those of converged points.

    ``factor`` and ``unit`` are of the displacements in some ``directions``. Raises ValueError
    where no point converged.
    """

    def __init__(self, found: Histories, directions: list[int]):
        self._found, self._family = found, Family(found.dataset, found.dims)
        self.drawn = [history for history in found.of.values() if history is not None]
        if not self.drawn:
            raise nothing_to_draw(found.dataset)
        self._few = len(self.drawn) <= MOST_LEGEND_ENTRIES
        largest = max(float(np.abs(h.displacement[directions]).max()) for h in self.drawn)
        self.factor, self.unit = scaled(largest, "m")

    def members(self) -> Iterator[tuple[Member, History]]:
        """The histories with their looks."""
        for member in self._family:
            history = self._found.of.get(tuple(member.position[dim] for dim in self._found.dims))
            if history is not None:
                yield member, history

    def _which(self) -> str:
        """Which points of curves these are, and of how many curves there are none."""
        dataset = self._found.dataset
        if CHOSEN not in dataset.coords:
            return ""
        words = dataset[CHOSEN].values.ravel().tolist()
        named = " or ".join(dict.fromkeys(word for word in words if word))
        if len(words) == 1:
            return point_text(dataset)
        none = f", {words.count('')} of {len(words)} have none" if "" in words else ""
        return f"{named} of each curve{none}"

    def add(
        self, panel: Panel, x: FloatArray, y: FloatArray, history: History, member: Member
    ) -> None:
        """A line, broken where the contact is open, and marks of events where lines are few."""
        apart = history.state == Behaviour.OPENS
        closed = ~apart | np.append(False, ~apart[:-1])
        open_too = apart | np.append(False, apart[:-1])
        width = 1.4 if self._few else 0.8
        panel.line(x, np.where(closed, y, np.nan), linewidth=width, **member.look)
        if open_too.any():
            panel.line(x, np.where(open_too, y, np.nan), color=member.color, **_OPEN)
        for before, after, mark in _EVENTS.values() if self._few else ():
            at = history.changes(before, after)
            panel.line(x[at], y[at], **_MARK | dict(color=member.color, zorder=3) | mark)

    def explain(self, panel: Panel, title: str, limit: str = "") -> None:
        """The title, which tells what is left out, and the legend.

        That is of the family, or of the marks of the only contact that opens or closes.
        """
        missing, total = len(self._found.of) - len(self.drawn), len(self._found.of)
        left_out = f"left out, not converged: {missing} of {total} points" if missing else ""
        panel.title = "\n".join(filter(None, [title, self._which(), left_out]))
        names = self._found.contact.law.directions
        if total > 1 or not {"normal", "across"} & {*names}:
            return self._family.explain(panel)
        if limit and "across" in names:
            for name, style in (("tangential", "-"), ("across", "--")):
                panel.entry(name, color="black", linestyle=style)
        if limit:
            panel.entry(limit, **_LIMIT)
        if (self.drawn[0].state == Behaviour.OPENS).any():
            panel.entry("open", color="black", **_OPEN)
        for name, (before, after, mark) in _EVENTS.items():
            if len(self.drawn[0].changes(before, after)):
                panel.entry(name, **_MARK | dict(color="black") | mark)
        return None


def _at_points(dataset: xr.Dataset, at: At | None) -> xr.Dataset:
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


def _together(dataset: xr.Dataset, name: str) -> tuple[Histories, dict[tuple[int, ...], float]]:
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
