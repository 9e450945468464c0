"""Operating deflection shapes of disks."""

from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.numerics import FloatArray, check, largest_displacement
from symhbm.plot.drawing import (
    check_dims,
    check_variables,
    motions_of,
    moving,
    nothing_to_draw,
    point_of,
    point_text,
    scaled,
)
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Axis, Colours, Panel, Picture
from symhbm.plot.places import Shown, blades_of, chosen, position_of
from symhbm.response.disks import sector_response
from symhbm.results import Description
from symhbm.results.reading import At

HUB, TIP, OFFSET = 0.42, 1.0, 0.3
"""Radii of the hub and of blades at rest, and of the largest displacement over the period."""
_TIE = 1e-9
"""Relative difference of amplitudes up to which blades move alike."""
DOMINANT = 0.5
"""Share of the motion from which a nodal diameter is named."""


@pictured
def disk(
    dataset: xr.Dataset,
    *,
    at: At | None = None,
    angle: float | None = None,
    place: Shown = None,
    **common: Unpack[Look],
) -> Picture:
    """Draw the operating deflection shape of a disk at one instant.

    Tips stand outside of the dashed circle where the displacement is positive, inside where it is
    negative; colours tell the same. Short arcs are the extremes of each blade over the period, so
    mistuned disks show where the motion is localised. The title names the nodal diameter that
    makes more than half of the motion (the sum of squared amplitudes), if one does.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf`, `symhbm.follow` or `symhbm.solve`, of one parameter set.
    at
        Which point of a curve, as of `symhbm.datasets.at`: ``"peak"``, the number of a peak, a
        frequency [Hz], ``"largest"``. By default the highest peak, else the largest response.
    angle
        Instant ``omega t`` [rad]; by default that of the largest displacement.
    place
        The degrees of freedom of the blades by their names or numbers, in their order around the
        disk. By default those that the problem knows: all of `symhbm.bladed_disk`, else those of
        the `symhbm.forces.EngineOrder`. Of a `symhbm.Sector` one place, ``"tip:z"``, which is drawn
        of all sectors; by default the one that moves the most.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For a dataset of several parameter sets, or without coefficients, for one that does not
        know its blades, and bad arguments.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     13, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> response = sh.frf(sh.HarmonicBalance(disk, sh.forces.EngineOrder(3)), (200, 220))
    >>> sh.plot.disk(response).savefig("disk.png")
    """
    check_variables(dataset, "coefficient", "harmonic", "frequency")
    check.known("dof", [str(d) for d in dataset["coefficient"].dims], "dimension of coefficient")
    parameter = moving(dataset)
    if {parameter.along} & {*dataset["coefficient"].dims}:
        allowed = parameter.along, "dof", "harmonic", "component", "solution"
        check_dims(dataset["coefficient"], allowed, "one parameter set")
        dataset = point_of(dataset, at)
    elif at is not None:
        raise ValueError(f"at={at!r}: expected None, the dataset is one point")
    coefficient, names, where = _ring(dataset, place)
    text = ", ".join(filter(None, [point_text(dataset), where]))
    basis, motions = motions_of(dataset, coefficient)
    amplitude, when = largest_displacement(basis, motions)
    ahead = amplitude >= (1 - _TIE) * amplitude.max()
    leading = int(np.argmax(ahead))
    angle = float(when[leading]) if angle is None else check.scalar("angle", angle)
    instant = motions @ basis.values(angle)
    factor, unit = scaled(amplitude[leading], "m")
    top = amplitude[leading] or 1.0
    label = f"displacement [{unit}], offset of tips alike"
    colors = Colours("RdBu_r", -factor * top, factor * top, label=label)
    who = "all blades alike" if ahead.all() else f"blade {names[leading]} leads"
    limits = -(TIP + OFFSET + 0.24), TIP + OFFSET + 0.24
    panel = Panel(Axis(limits=limits), Axis(limits=limits), bare=True, even="box", bar=colors)
    panel.title_size = 9
    panel.title = (
        f"{text}, {_diameter(coefficient)}\n"
        f"{who}: {factor * amplitude[leading]:.3g} {unit}, "
        rf"$\omega t$ = {angle % (2 * np.pi):.2f} rad"
    )
    _draw(panel, instant / top, amplitude / top, colors.of(factor * instant), names)
    return Picture([panel], (5.4, 4.8), alone=True)


def nodal_shares(coefficient: FloatArray) -> FloatArray:
    """Share of each nodal diameter in the motion of a ring, (n_blades // 2 + 1,); they add to 1.

    ``coefficient`` (n_blades, n_harmonics, 2) is summed over harmonics and both directions of
    travel.
    """
    wave = np.fft.fft(coefficient[..., 0] - 1j * coefficient[..., 1], axis=0)
    power = (np.abs(wave) ** 2).sum(axis=1)
    number = np.arange(len(power))
    folded = np.bincount(np.minimum(number, len(power) - number), power)
    return folded / (folded.sum() or 1.0)


def _diameter(coefficient: FloatArray) -> str:
    shares = nodal_shares(coefficient)
    first = int(np.argmax(shares))
    if shares[first] <= DOMINANT:
        return "no nodal diameter dominates"
    share = "" if shares[first] > 0.9995 else f" ({100 * shares[first]:.3g} %)"
    return f"nodal diameter {first}{share}"


def _ring(dataset: xr.Dataset, place: Shown) -> tuple[FloatArray, list[str], str]:
    """Coefficients of the blades in their order around the disk, their names, and the place."""
    inner = ("dof", "harmonic", "component")
    coefficient = dataset["coefficient"]
    check_dims(coefficient, inner, "one parameter set")
    if not np.isfinite(coefficient).all():
        raise nothing_to_draw(dataset)
    n_sectors = Description(dataset).problem.get("n_sectors")
    if n_sectors is not None:
        largest = int(largest_displacement(*motions_of(dataset, coefficient.values))[0].argmax())
        where = chosen(dataset, largest if place is None else place)
        if where.alone is None:
            raise ValueError(
                f"place={check.shown(place)}: expected one degree of freedom of the sector, "
                f"this is {len(where.dofs)}"
            )
        around = sector_response(dataset, range(n_sectors))["coefficient"].isel(dof=where.alone)
        words = where.words.removeprefix("response of ")
        return around.transpose("sector", *inner[1:]).values, [*map(str, range(n_sectors))], words
    dofs = _blades_of_problem(dataset) if place is None else [*chosen(dataset, place).dofs]
    if len(dofs) < 3:
        has = f"a structure of {len(dofs)} blade{'' if len(dofs) == 1 else 's'}"
        what = f"dataset: {has}" if place is None else f"place={check.shown(place)}"
        raise ValueError(f"{what}: expected at least three different blades")
    given: Any = range(len(dofs)) if place is None else dofs if isinstance(place, str) else place
    names = [str(one) for one in (given if len(given) == len(dofs) else dofs)]
    return coefficient.transpose(*inner).values[dofs], names, ""


def _blades_of_problem(dataset: xr.Dataset) -> list[int]:
    """Positions along ``dof`` of the blades that the model or the excitation names."""
    blades, position = blades_of(dataset), position_of(dataset)
    if blades is None:
        raise ValueError(
            "place=None: expected the degrees of freedom of the blades in their order around the "
            "disk, as neither the model nor the force tells which they are"
        )
    missing = [dof for dof in blades if dof not in position]
    if missing:
        kept = (
            "places= of condense keeps them"
            if Description(dataset).condensed_from
            else "select all of them"
        )
        raise ValueError(
            f"dataset: expected all {len(blades)} blades, {len(missing)} are not in it (degrees of "
            f"freedom {check.shown(missing)}); {kept}, or place= tells which to draw"
        )
    return [position[dof] for dof in blades]


def _draw(
    panel: Panel, instant: FloatArray, amplitude: FloatArray, colors: np.ndarray, names: list[str]
) -> None:
    n_blades = len(instant)
    turn = np.pi / 2 - 2 * np.pi * np.arange(n_blades) / n_blades  # the first on top, clockwise
    radius = TIP + OFFSET * instant
    half = min(0.36 * 2 * np.pi / n_blades * HUB, 0.07)
    along = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    corners = ((HUB, -1), (radius[:, None], -1), (radius[:, None], 1), (HUB, 1))
    outline = np.stack([r * along + side * half * across for r, side in corners], axis=1)
    panel.add("areas", outline, facecolors=colors, edgecolors="0.25", linewidths=0.7)
    for sign in (-1, 1):
        middle = (TIP + sign * OFFSET * amplitude[:, None]) * along
        arcs = np.stack([middle - half * across, middle + half * across], axis=1)
        panel.add("segments", arcs, colors="0.45", linewidths=1.1, zorder=3)
    closed = np.append(np.arange(n_blades), 0)
    tips = radius[:, None] * along
    panel.line(*tips[closed].T, color="black", linewidth=0.8, zorder=4)
    rest: Any = dict(fill=False, linestyle=(0, (4, 3)), color="0.55", linewidth=0.9)
    panel.add("circle", (0, 0), TIP, **rest)
    hub: Any = dict(facecolor="0.93", edgecolor="0.25", linewidth=0.8, zorder=2)
    panel.add("circle", (0, 0), HUB, **hub)
    step = -(-n_blades // 40)
    for name, point in list(zip(names, (TIP + OFFSET + 0.14) * along, strict=True))[::step]:
        panel.text(point, name, ha="center", va="center", fontsize=8, color="0.25")
