"""Hysteresis loops of contacts, and their normal forces."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from symhbm.model.contacts import Behaviour, History, MemorylessLaw
from symhbm.numerics import FloatArray, check
from symhbm.plot.contact.histories import Histories, contact_of, histories
from symhbm.plot.drawing import MOST_LEGEND_ENTRIES, Family, Member, nothing_to_draw, scaled
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.plot.rendering import pictured

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


@pictured
def hysteresis(dataset: xr.Dataset, *, contact: int = 0, ax: Axes | None = None) -> Picture:
    """Draw the friction force of a contact over its relative displacement through a period.

    Of planar friction the force across is a broken line, over the displacement across; each is
    within the circle of radius ``mu N``. Of a law without memory it is the force in each of its
    directions. The area of loops is the energy dissipated per cycle. Triangles are onsets of slip,
    circles its ends, squares openings and diamonds closings; where a contact is open the line is
    broken. Dotted lines are the limits of slip ``mu N``, which move with the normal force. Of a
    result of the balance it is the force located on the motion, not the few terms of its series
    that the balance sees. Several points or parameter sets are a family; points that did not
    converge are left out, and the title tells how many.

    Parameters
    ----------
    dataset
        A result of `symhbm.periodic_motion`, `symhbm.frf`, `symhbm.follow` or `symhbm.solve`.
    contact
        The contact to show.
    ax
        Axes to draw into; by default a new figure.

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
    found = _of_friction(dataset, contact)
    names, smooth = found.contact.law.directions, isinstance(found.contact.law, MemorylessLaw)
    directions = [k for k, name in enumerate(names) if smooth or name != "normal"]
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
    title = ""
    if len(found.of) == 1:
        [history], area = loops.drawn, 0.0
        for k in directions:
            x, force = loops.factor * history.displacement[k], history.force[k]
            outline = np.stack([x, force], axis=-1)
            panel.add("areas", [outline], facecolors="0.94", edgecolors="0.94", zorder=0)
            area += float(np.trapezoid(force, history.displacement[k]))
        for sign in (-1, 1) if history.limit.any() else ():
            if np.ptp(history.limit):
                x = loops.factor * history.displacement[0]
                panel.line(x, sign * history.limit, **_LIMIT)
            else:
                panel.add("level", sign * history.limit[0], **_LIMIT)
        lost, joule = scaled(area, "J")
        title = f"contact {contact}: {lost * area:.4g} {joule} per cycle"
    loops.explain(panel, title, r"limit $\pm\mu N$")
    return Picture([panel])


@pictured
def normal_force(
    dataset: xr.Dataset, *, contact: int = 0, over: str = "angle", ax: Axes | None = None
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
    ax
        Axes to draw into; by default a new figure.

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
    found = histories(dataset, which)
    loops = _Loops(found, [-1])
    label = f"normal displacement, positive where it closes [{loops.unit}]"
    panel = Panel(Axis(label), Axis("normal force [N]"))
    if over == "angle":
        ticks = [f"${each}$" for each in ("0", r"\pi/2", r"\pi", r"3\pi/2", r"2\pi")]
        label = r"angle of the period $\omega t$ [rad]"
        panel.x = Axis(label, limits=(0, 2 * np.pi), ticks=(np.arange(5) * np.pi / 2, ticks))
    for member, history in loops.members():
        if over == "angle":
            history = _from_zero(history)
        x = history.angle if over == "angle" else loops.factor * history.displacement[-1]
        loops.add(panel, x, history.force[-1], history, member)
    loops.explain(panel, f"contact {contact}" if len(found.of) == 1 else "")
    return Picture([panel])


def _of_friction(dataset: xr.Dataset, contact: int) -> Histories:
    which = contact_of(dataset, contact)
    if "tangential" not in which.law.directions and not isinstance(which.law, MemorylessLaw):
        raise ValueError(
            f"contact={contact}: expected one with friction, it is of {type(which.law).__name__} "
            f"in the group {which.group!r}; symhbm.plot.normal_force draws its force"
        )
    return histories(dataset, which)


def _from_zero(history: History) -> History:
    """The same with points that lie around one period from 0 on."""
    period = 2 * np.pi
    turned = history.angle[:-1] % period
    order = np.argsort(turned, kind="stable")
    order = np.concatenate([order[-1:], order, order[:1]])
    angle = turned[order] - period * (np.arange(len(order)) == 0)
    angle[-1] += period
    sides = history.displacement[:, order], history.force[:, order]
    return History(angle, *sides, history.limit[order], history.state[order])


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
        panel.title = "\n".join(filter(None, [title, left_out]))
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
