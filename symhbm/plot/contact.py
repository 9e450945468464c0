"""Hysteresis loops of contacts."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import CubicHermiteSpline

from symhbm.model.contacts import (
    Coulomb,
    Ends,
    HysteresisLoop,
    from_stored,
    hysteresis_loops,
    named,
    weights_of,
)
from symhbm.numerics import FloatArray, check
from symhbm.plot.drawing import (
    MOST_LEGEND_ENTRIES,
    Family,
    canvas,
    check_variables,
    figure_of,
    motions_of,
    moving,
    nothing_to_draw,
    scaled,
)
from symhbm.results import Description

N_ANGLES = 512
"""Points of a loop beside its events: more than a figure resolves."""


def hysteresis(dataset: xr.Dataset, *, contact: int = 0, ax: Axes | None = None) -> Figure:
    """Draw the friction force of a contact over its relative displacement through a period.

    The area of a loop is the energy dissipated per cycle. Triangles are onsets of slip, circles its
    ends. Of a result of the balance it is the force of the slider marched over the motion, not the
    few terms of its series that the balance sees. Several points or parameter sets are a family;
    points that did not converge are left out, and the title tells how many.

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
        For a dataset without the motion, one without a converged point, and bad arguments.
    """
    loops, dataset, dims = loops_of(dataset, contact)
    drawn = [loop for loop in loops.values() if loop is not None]
    if not drawn:
        raise nothing_to_draw(dataset)
    largest = max(float(np.abs(loop.displacement).max()) for loop in drawn)
    factor, unit = scaled(largest, "m")
    family = Family(dataset, dims)
    with canvas(ax) as ax:
        for member in family:
            loop = loops.get(tuple(member.position[dim] for dim in dims))
            if loop is None:
                continue
            x = factor * loop.displacement
            few = len(drawn) <= MOST_LEGEND_ENTRIES
            width = 1.4 if few else 0.8
            ax.plot(x, loop.force, color=member.color, linestyle=member.style, linewidth=width)
            if few:
                look: Any = dict(color=member.color, linestyle="", markersize=5, zorder=3)
                ax.plot(x[loop.onset], loop.force[loop.onset], "^", **look)
                ax.plot(x[loop.end], loop.force[loop.end], "o", markerfacecolor="white", **look)
        notes = []
        if len(loops) == 1:
            ax.fill(factor * drawn[0].displacement, drawn[0].force, color="0.94", zorder=0)
            for level in (-drawn[0].limit, drawn[0].limit):
                ax.axhline(level, color="0.4", linewidth=0.9, linestyle=(0, (1, 2)), zorder=1)
            lost, joule = scaled(drawn[0].area, "J")
            notes.append(f"contact {contact}: {lost * drawn[0].area:.4g} {joule} per cycle")
        if len(drawn) < len(loops):
            missing = len(loops) - len(drawn)
            notes.append(f"left out, not converged: {missing} of {len(loops)} points")
        ax.set_title("\n".join(notes))
        ax.set_xlabel(f"relative displacement [{unit}]")
        ax.set_ylabel("friction force [N]")
        family.explain(ax)
    return figure_of(ax)


def loops_of(
    dataset: xr.Dataset, contact: int = 0
) -> tuple[dict[tuple[int, ...], HysteresisLoop | None], xr.Dataset, list[str]]:
    """Loops by their indices along the listed dimensions, None where a point did not converge.

    Also returns the dataset without the padding of its paths. Arguments and errors as of
    `hysteresis`.
    """
    check_variables(dataset, "frequency")
    check.known("problem", dataset.attrs, "attribute of the dataset")
    for dim in ("dof", "contact"):
        check.known(dim, [str(d) for d in dataset.dims], "dimension of the dataset")
    pairs = Description(dataset).problem["contacts"]
    contact = check.integer("contact", contact, 0, len(pairs) - 1)
    friction = _friction_of(dataset, contact)
    ends = from_stored(pairs[contact])
    check_variables(dataset, *friction.parameters)
    if "angle" in dataset.dims:
        check_variables(dataset, "displacement", "velocity", "friction_force", "event_angle")
        return {(): _stored_loop(dataset, contact, ends, friction)}, dataset, []
    check_variables(dataset, "coefficient", "harmonic")
    return _marched_loops(dataset, ends, friction)


class _Friction(NamedTuple):
    """Where a dataset has the parameters of a friction contact.

    What it calls ``k_d``, ``mu`` and ``F_n``, and the number of the contact ``within`` its group.
    """

    parameters: list[str]
    within: int

    def values(self, value: xr.DataArray) -> xr.DataArray:
        """A parameter of this contact, of that of all contacts of its group."""
        dims = [dim for dim in value.dims if dim == "contact" or str(dim).endswith("_contact")]
        return value.isel(dict.fromkeys(dims, self.within), drop=True)


def _friction_of(dataset: xr.Dataset, contact: int) -> _Friction:
    """ValueError for a contact whose law is not the friction of this library."""
    groups = Description(dataset).problem.get("groups")
    if groups is None:
        return _Friction([*Coulomb.parameters], contact)
    owners = [(name, i) for name, each in groups.items() for i in range(len(each["pairs"][0]))]
    name, within = owners[contact]
    if groups[name]["law"] != Coulomb.__name__:
        raise ValueError(
            f"contact={contact}: expected one of friction with a limit mu F_n, it is of "
            f"{groups[name]['law']} in the group {name!r}"
        )
    called = named({name: group["parameters"] for name, group in groups.items()})[name]
    return _Friction([called[own] for own in Coulomb.parameters], within)


def _relative(values: xr.DataArray, ends: Ends) -> xr.DataArray:
    each = zip(*weights_of(ends), strict=True)
    return sum(weight * values.isel(dof=dof, drop=True) for dof, weight in each)  # type: ignore


def _stored_loop(
    dataset: xr.Dataset, contact: int, ends: Ends, friction: _Friction
) -> HysteresisLoop | None:
    """Loop of a motion stored over its period, with its events among the points."""
    angle, period = dataset["angle"].values, 2 * np.pi
    omega = period * float(dataset["frequency"])
    y = _relative(dataset["displacement"], ends).values
    slope = _relative(dataset["velocity"], ends).values / omega
    force = dataset["friction_force"].isel(contact=contact).values
    if not np.isfinite(y).all():
        return None
    closed = np.append(angle, angle[0] + period)
    motion = CubicHermiteSpline(closed, np.append(y, y[0]), np.append(slope, slope[0]))
    limit = float(np.prod([friction.values(dataset[name]) for name in friction.parameters[1:]]))
    of_contact = dataset["event_contact"].values == contact
    event = angle[0] + (dataset["event_angle"].values[of_contact] - angle[0]) % period
    begins = dataset["event_kind"].values[of_contact] == "onset of slip"
    # At its events the slider is at its limit, on the side of the force nearby.
    side = np.sign(np.interp(event, closed, np.append(force, force[0])))
    points = np.concatenate([closed, event])
    order = np.argsort(points, kind="stable")
    position = np.argsort(order)[len(closed) :]
    return HysteresisLoop(
        points[order],
        np.concatenate([y, y[:1], motion(event)])[order],
        np.concatenate([force, force[:1], side * limit])[order],
        position[begins],
        position[~begins],
        limit,
    )


def _marched_loops(
    dataset: xr.Dataset, ends: Ends, friction: _Friction
) -> tuple[dict[tuple[int, ...], HysteresisLoop | None], xr.Dataset, list[str]]:
    parameter = moving(dataset)
    if dataset.sizes.get("solution") == 1:
        dataset = dataset.isel(solution=0)
    if "point" in dataset["coefficient"].dims and dataset[parameter.name].dims == ("point",):
        dataset = dataset.isel(point=np.isfinite(dataset[parameter.name].values))
        dataset = dataset.swap_dims(point=parameter.name)
    coefficient = _relative(dataset["coefficient"], ends)
    dims = [str(dim) for dim in coefficient.dims if dim not in ("harmonic", "component")]
    values = coefficient.transpose(*dims, "harmonic", "component").values
    shape, flat = values.shape[:-2], values.reshape(-1, *values.shape[-2:])
    basis, motions = motions_of(dataset, flat)
    like = coefficient.isel(harmonic=0, component=0, drop=True)
    stiffness, coefficients, load = (
        _of_contact(dataset, name, friction, like, dims) for name in friction.parameters
    )
    is_solution = dataset[parameter.name].notnull()
    if "solution" in dims and "n_solutions" in dataset:
        number = xr.DataArray(np.arange(dataset.sizes["solution"]), dims="solution")
        is_solution = is_solution & (number < dataset["n_solutions"])
    finite = np.flatnonzero(np.isfinite(motions).all(axis=1))
    limit = (coefficients * load)[finite]
    stiffness, motions = stiffness[finite], motions[finite]
    loops: list[HysteresisLoop | None] = [None] * len(flat)
    marched = hysteresis_loops(basis, motions, stiffness, limit, N_ANGLES)
    for number, loop in zip(finite, marched, strict=True):
        loops[number] = loop
    # The padding of a table is no point.
    is_point = is_solution.broadcast_like(like).transpose(*dims).values.ravel()
    every = zip(np.ndindex(*shape), loops, is_point, strict=True)
    return {index: loop for index, loop, point in every if point}, dataset, dims


def _of_contact(
    dataset: xr.Dataset, name: str, friction: _Friction, like: xr.DataArray, dims: list[str]
) -> FloatArray:
    """Values of a parameter of one contact at all points, flattened in the order of ``dims``."""
    followed = Description(dataset).request
    value = dataset[name]
    if followed.get("name") == name and followed["index"] not in (None, friction.within):
        value = dataset[f"{name}_nominal"]
    value = friction.values(value)
    return value.broadcast_like(like).transpose(*dims).values.ravel()
