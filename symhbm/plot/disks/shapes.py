"""Operating deflection shapes of disks."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from symhbm.numerics import FloatArray, check, largest_displacement
from symhbm.plot.drawing import (
    check_dims,
    check_variables,
    motions_of,
    moving,
    nothing_to_draw,
    one_solution,
    scaled,
    symbol_of,
)
from symhbm.plot.picture import Axis, Colours, Panel, Picture
from symhbm.plot.places import blades_of, position_of
from symhbm.plot.rendering import pictured
from symhbm.results import Description

HUB, TIP, OFFSET = 0.42, 1.0, 0.3
"""Radii of the hub and of blades at rest, and of the largest displacement over the period."""
_TIE = 1e-9
"""Relative difference of amplitudes up to which blades move alike."""
DOMINANT = 0.5
"""Share of the motion from which a nodal diameter is named."""


_Shape = tuple[FloatArray, str]
"""Coefficients (n_dof, n_harmonics, 2) [m] of one response, and its text."""


@pictured
def disk(
    dataset: xr.Dataset,
    *,
    frequency: float | None = None,
    peak: int | None = None,
    angle: float | None = None,
    blades: Sequence[int] | None = None,
    ax: Axes | None = None,
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
    frequency
        Draw the stored point nearest to this frequency [Hz].
    peak
        Draw the peak of this number. By default it is the highest one, where the dataset is a
        curve and has peaks, else the largest response of the points.
    angle
        Instant ``omega t`` [rad]; by default that of the largest displacement.
    blades
        Places of the blades along ``dof``, in their order around the disk. By default those that
        the problem knows: all of `symhbm.bladed_disk`, else those of the
        `symhbm.forces.EngineOrder`.
    ax
        Axes to draw into, without another picture; by default a new figure.

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
    chosen, names = _blades(dataset, blades)
    coefficient, text = _pick(dataset, frequency, peak)
    coefficient = coefficient[chosen]
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


def _blades(dataset: xr.Dataset, blades: Sequence[int] | None) -> tuple[list[int], list[int]]:
    """Positions of the blades along ``dof`` in their order around the disk, and their names."""
    check.known("dof", [str(d) for d in dataset["coefficient"].dims], "dimension of coefficient")
    n_dof = dataset.sizes["dof"]
    if blades is None:
        chosen = _blades_of_problem(dataset)
        names = list(range(len(chosen)))
    elif isinstance(blades, str) or not isinstance(blades, Iterable):
        raise TypeError(f"blades={check.shown(blades)}: expected a sequence of integers")
    else:
        chosen = [check.integer(f"blades[{i}]", dof, 0, n_dof - 1) for i, dof in enumerate(blades)]
        names = chosen
    if len(chosen) < 3 or len(set(chosen)) < len(chosen):
        has = f"a structure of {len(chosen)} blade{'' if len(chosen) == 1 else 's'}"
        what = f"dataset: {has}" if blades is None else f"blades={check.shown(blades)}"
        raise ValueError(f"{what}: expected at least three different blades")
    return chosen, names


def _blades_of_problem(dataset: xr.Dataset) -> list[int]:
    """Positions along ``dof`` of the blades that the model or the excitation names."""
    blades, position = blades_of(dataset), position_of(dataset)
    if blades is None:
        raise ValueError(
            "blades=None: expected the degrees of freedom of the blades in their order around the "
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
            f"freedom {check.shown(missing)}); {kept}, or blades= tells which to draw"
        )
    return [position[dof] for dof in blades]


def _pick(dataset: xr.Dataset, frequency: float | None, peak: int | None) -> _Shape:
    if frequency is not None and peak is not None:
        raise ValueError(f"frequency={frequency!r}, peak={peak!r}: expected one of them at most")
    name, along, _ = moving(dataset)
    curve = one_solution(dataset)
    inner = ("dof", "harmonic", "component")
    check_dims(curve["coefficient"], (along, *inner), "one parameter set")
    is_curve = along in curve["coefficient"].dims
    if peak is not None or (frequency is None and is_curve):
        shape = _peak(curve, name, peak)
        if shape is not None:
            return shape
    points = curve if is_curve else curve.expand_dims("point")
    along = along if is_curve else "point"
    coefficient = points["coefficient"].transpose(along, *inner).values
    value = np.broadcast_to(points[name].values, coefficient.shape[:1])
    finite = np.flatnonzero(np.isfinite(coefficient).all(axis=(1, 2, 3)))
    if not len(finite):
        raise nothing_to_draw(dataset)
    note = ""
    if frequency is not None:
        frequency = check.scalar("frequency", frequency, "positive")
        hertz = np.broadcast_to(points["frequency"].values, value.shape)[finite]
        if not hertz.min() <= frequency <= hertz.max():
            raise ValueError(
                f"frequency={frequency:g}: expected a value within the converged points, "
                f"{hertz.min():g} to {hertz.max():g} Hz"
            )
        at = finite[np.argmin(np.abs(hertz - frequency))]
    else:
        at = finite[np.argmax(np.abs(coefficient[finite]).max(axis=(1, 2, 3)))]
        note = ", largest point" if is_curve else ""
    return coefficient[at], _text(dataset, name, float(value[at])) + note


def _peak(curve: xr.Dataset, name: str, peak: int | None) -> _Shape | None:
    """A peak by its number, by default the highest; None where a curve has no highest peak."""
    needed = ("peak_coefficient", "peak_amplitude", f"peak_{name}")
    if peak is None and not all(key in curve for key in needed):
        return None
    check_variables(curve, *needed)
    if "peak" not in curve["peak_coefficient"].dims:
        curve = curve.expand_dims("peak")
    coefficient = curve["peak_coefficient"].transpose("peak", "dof", "harmonic", "component").values
    value = curve[f"peak_{name}"].values
    finite = np.flatnonzero(np.isfinite(coefficient).all(axis=(1, 2, 3)))
    if peak is None:
        if not len(finite):
            return None
        at = finite[np.argmax(curve["peak_amplitude"].values[finite])]
        note = "highest peak" if len(finite) > 1 else "peak"
    else:
        if not len(finite):
            raise ValueError(f"peak={check.shown(peak)}: expected None, the curve has no peak")
        at = check.integer("peak", peak, 0, int(finite[-1]))
        if at not in finite:
            raise ValueError(f"peak={peak}: expected a bounded peak, this one has no shape")
        note = f"peak {at}"
    return coefficient[at], f"{_text(curve, name, float(value[at]))}, {note}"


def _text(dataset: xr.Dataset, name: str, value: float) -> str:
    if name == "frequency":
        return f"{value:.5g} Hz"
    symbol, unit = symbol_of(dataset, name) or (name.replace("_", " "), "")
    return f"{symbol} = {value:.4g} {unit}, {float(dataset['frequency']):.5g} Hz"


def _draw(
    panel: Panel, instant: FloatArray, amplitude: FloatArray, colors: np.ndarray, names: list[int]
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
        panel.text(point, str(name), ha="center", va="center", fontsize=8, color="0.25")
