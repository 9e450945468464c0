"""Pictures of motions that no force drives: nonlinear modes, limit cycles, flutter limits."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.numerics import RADIANS, FloatArray, check
from symhbm.plot.drawing import (
    LINE_STYLES,
    Family,
    axis_label,
    check_anything,
    one_solution,
    parameter_axis,
)
from symhbm.plot.lines import (
    FIRST_HARMONIC,
    MARK,
    at_an_end,
    beside_missing,
    curved,
    draw_ends,
    is_complete,
    mark_ends,
    mark_events,
)
from symhbm.plot.looks import Look, Named, compared, pictured
from symhbm.plot.measurements import check_measured, draw_modes
from symhbm.plot.picture import FAMILY, Axis, Panel, Picture
from symhbm.results import Description, check_dataset, check_present
from symhbm.results.archive import rebuild

_STYLES = {1: "-", 0: "--", -1: ":"}
"""Lines of cycles that are stable, unstable, and of which it is not known."""
_AT_END = 1.1
"""Ratio of amplitudes that are one, at the ends of their band."""


@compared
def limit_cycles(dataset: xr.Dataset, **common: Unpack[Named]) -> Picture:
    """Draw the amplitude of limit cycles over the parameter that moves, one colour per set.

    Cycles that are not stable are dashed, dotted where it is not known; without ``stability`` all
    lines are solid. Squares are folds, where two cycles meet, circles onsets and ends of slip, of
    contact and of opening; changes of stability are marked as in `response`.
    A red cross is where a branch ends of cycles that are not complete.

    Parameters
    ----------
    dataset
        A result of `symhbm.limit_cycles` along a parameter, not on a grid.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no such dataset, and for one without a cycle.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=-0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> cycles = sh.limit_cycles(problem, "damping", (-30, 0), stability=True, progress=False)
    >>> figure = sh.plot.limit_cycles(cycles)
    >>> figure.savefig("cycles.png")
    """
    check_dataset("dataset", dataset, unforced=True)
    description = Description(dataset)
    if description.unforced != "limit cycle" or description.moving == "amplitude":
        raise TypeError("dataset: expected a result of limit_cycles over a parameter")
    if "point" not in dataset.dims:
        raise ValueError("dataset: expected points along branches of cycles, got a grid; ask for "
                         "them without at=")  # fmt: skip
    name = description.moving
    check_present(dataset, "amplitude", "cycle_branch", name)
    check_anything(dataset, "amplitude")
    family = Family.over(dataset, dataset["amplitude"], "point")
    panel = Panel(Axis(axis_label(dataset, name)), Axis(FIRST_HARMONIC, log=True))
    for member, one in family.curves():
        value, amplitude = one[name].values, one["amplitude"].values
        for x, y, verdict in _smooth_runs(one, value, amplitude):
            panel.line(x, y, color=member.color, linestyle=_STYLES[verdict])
        ends = np.array([] if is_complete(one) else [*_ends(one, name)], dtype=int)
        draw_ends(panel, value[ends], amplitude[ends])
        mark_events(panel, one, "amplitude", member.color)
    family.explain(panel)
    return Picture([panel])


def _smooth_runs(
    one: xr.Dataset, value: FloatArray, amplitude: FloatArray
) -> Iterator[tuple[FloatArray, FloatArray, int]]:
    """Lines through branches, in parts whose cycles are alike, up to the first point of the next.

    They are smooth over the whole branch: at a fold, where stability changes, it is vertical.
    """
    found = np.isfinite(amplitude)
    branch = np.where(found, one["cycle_branch"].values, -1)
    known = "stability" in one.variables
    stable = one["stability"].values if known else np.ones(len(found), dtype=int)
    for number in np.unique(branch[found]):
        own = np.flatnonzero(branch == number)
        x, y = curved(value[own], amplitude[own], (False, True))
        turns = np.flatnonzero(np.diff(stable[own])) + 1
        begin = 0
        for first, last in pairwise([0, *turns.tolist(), len(own) - 1]):
            # The place of a point on the line; another one may close the branch there.
            far = np.abs(x - value[own[last]]) + np.abs(y - amplitude[own[last]])
            end = len(x) - 1 if last == len(own) - 1 else begin + int(np.argmin(far[begin:]))
            yield x[begin : end + 1], y[begin : end + 1], int(stable[own[first]])
            begin = end


def _ends(one: xr.Dataset, name: str) -> Iterator[int]:
    """First and last points of branches that are not closed, inside the band and its amplitudes."""
    value, amplitude = one[name].values, one["amplitude"].values
    description = Description(one)
    inside = np.isfinite(amplitude) & ~at_an_end(value, description.band)
    low, high = description.request["amplitudes"]
    inside &= (amplitude > _AT_END * low) & (amplitude < high / _AT_END)
    branch = one["cycle_branch"].values
    for number in np.unique(branch[np.isfinite(amplitude)]):
        own = np.flatnonzero(np.isfinite(amplitude) & (branch == number))
        first, last = int(own[0]), int(own[-1])
        closed = np.isclose([value[first], amplitude[first]], [value[last], amplitude[last]]).all()
        if first == last or not closed:
            yield from (end for end in {first, last} if inside[end])


@pictured
def flutter_limit(dataset: xr.Dataset, **common: Unpack[Look]) -> Picture:
    """Draw the largest negative damping that contacts hold over a parameter.

    Each line is of one disturbance: below it that is held below the largest amplitude. The thick
    part of that of the smallest one is where two limit cycles meet; above it, in grey, none is
    held. A diamond is the best value of a design, two are the ends of a range of such values. A red
    cross is beside values at which no limit was found.

    Parameters
    ----------
    dataset
        A result of `symhbm.flutter_limit` or `symhbm.maximise_flutter_limit`.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no such dataset, and for one without a limit.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> limit = sh.flutter_limit(
    ...     problem, "normal_load", (0.1, 10), amplitudes=(1e-6, 4e-4), disturbance=[1e-6, 1e-4],
    ...     progress=False,
    ... )
    >>> figure = sh.plot.flutter_limit(limit)
    >>> figure.savefig("flutter.png")
    """
    check_dataset("dataset", dataset, unforced=True)
    description = Description(dataset)
    if description.unforced != "flutter limit":
        raise TypeError("dataset: expected a result of flutter_limit or maximise_flutter_limit")
    name = description.moving
    check_present(dataset, "flutter_limit", "limit_kind", name)
    check_anything(dataset, "flutter_limit")
    values, disturbances = dataset[name].values, dataset["disturbance"].values
    limits, largest = dataset["flutter_limit"].values, description.request["amplitudes"][1]
    first = limits[:, 0]
    top, bottom = 1.1 * float(np.nanmax(first)), min(0.0, 1.1 * float(np.nanmin(first)))
    panel = Panel(
        parameter_axis(dataset, name, limits=(values.min(), values.max())),
        Axis(
            f"negative damping ratio held below {1e3 * largest:.4g} mm",
            limits=(bottom, top if top > bottom else None),
        ),
    )
    shades = FAMILY(np.linspace(1.0, 0.0, len(disturbances)))
    for k, disturbance in enumerate(disturbances.tolist()):
        look = dict(color=shades[k], linestyle=LINE_STYLES[k % len(LINE_STYLES)])
        panel.line(values, limits[:, k], f"disturbance of {1e3 * disturbance:.4g} mm", **look)
    for limit in limits.T:
        ends = beside_missing(np.isfinite(limit))
        draw_ends(panel, values[ends], limit[ends])
    lost = np.where(np.isfinite(first), first, np.nan)
    look = dict(color="0.93", linewidth=0, zorder=0)
    panel.band(values, lost, top, "no disturbance is held", **look)
    meets = np.isin(dataset["limit_kind"].values[:, 0].astype(str), ["fold", "corner"])
    if meets.any():
        folds = np.where(meets, first, np.nan)
        look = dict(color="black", linewidth=2.6, zorder=3)
        panel.line(values, folds, "two limit cycles meet", **look)
    if "design_from" in dataset.variables and np.isfinite(dataset["design_damping_ratio"]):
        ends = {float(dataset[end].values[0]): None for end in ("design_from", "design_to")}
        label = "best value" if len(ends) == 1 else "first and last of the best values"
        ratio = [float(dataset["design_damping_ratio"])] * len(ends)
        look = MARK | dict(markersize=5, zorder=4, markerfacecolor="white", clip_on=False)
        panel.line([*ends], ratio, label, marker="D", **look)
    return Picture([panel])


_PANELS = {"frequency": (0.54, "frequency [Hz]"), "damping_ratio": (0.0, "damping ratio")}
"""Variables that are drawn, from the top: where their panels begin, and their labels."""


@compared
def nonlinear_modes(
    dataset: xr.Dataset,
    *,
    over: str = "",
    measured: xr.Dataset | None = None,
    **common: Unpack[Named],
) -> Picture:
    """Draw frequency and damping ratio over what moves, one line per parameter set.

    Circles are onsets and ends of slip, of contact and of opening, squares folds, diamonds maxima
    and minima of the damping ratio. A red cross is where a curve ends that is not complete.

    Parameters
    ----------
    dataset
        A result of `symhbm.nonlinear_modes`.
    over
        ``"energy"`` in the place of what moves: twice the mean kinetic energy over the period [J],
        that of the motion where the mode is linear.
    measured
        Measurements of `symhbm.datasets.measured` to draw as circles over the amplitude; by default
        those that a fit holds.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no such dataset, for several solutions at one amplitude of a grid, and axes
        that hold a picture.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> modes = sh.nonlinear_modes(problem, over={"normal_load": [1, 3]}, progress=False)
    >>> figure = sh.plot.nonlinear_modes(modes)
    >>> figure.savefig("modes.png")
    """
    check_dataset("dataset", dataset, unforced=True)
    if Description(dataset).unforced != "nonlinear mode":
        raise TypeError("dataset: expected a result of nonlinear_modes")
    check_present(dataset, "amplitude", *_PANELS)
    measured = check_measured(dataset, measured)
    dataset = one_solution(dataset)
    if check.one_of("over", over, ("", "energy")):
        dataset = _over_energy(dataset)
    moves = Description(dataset).moving
    along = "point" if "point" in dataset.dims else moves
    of_amplitude = moves == "amplitude"
    label = FIRST_HARMONIC if of_amplitude else axis_label(dataset, moves)
    label = "energy [J]" if over else label
    of_amplitude |= bool(over)
    family, panels = Family.over(dataset, dataset["frequency"], along), []
    for name, (bottom, words) in _PANELS.items():
        panel = Panel(Axis(log=of_amplitude), Axis(words), place=(bottom, 0.46))
        for member, one in family.curves():
            panel.line(*curved(one[moves], one[name], (of_amplitude, False)), **member.look)
            mark_ends(panel, one, moves, one[name].values)
            mark_events(panel, one, name, member.color)
            if measured is not None and moves == "amplitude" and not over:
                draw_modes(panel, measured, one, name, member.color)
        panels.append(panel)
    panels[-1].x.label = label
    if not (dataset["damping_ratio"] < 0).any():
        panels[-1].y.limits = (0.0, None)
    family.explain(panels[0])
    return Picture(panels, (6.4, 5.2), alone=True)


def _over_energy(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with energies in the place of the values of what moves, at events, too."""
    moves, model = Description(dataset).moving, rebuild(dataset).model
    check_present(dataset, "coefficient")
    if "point" not in dataset.dims or not hasattr(model, "matrices_in"):
        raise ValueError(
            "over='energy': expected points along paths of a structure with a mass matrix"
        )
    energy: Any = 0.0
    parts = dataset["coefficient"].transpose(..., "dof")
    for harmonic in dataset["harmonic"].values.tolist():
        each = [parts.sel(harmonic=harmonic, component=part, drop=True) for part in ("cos", "sin")]
        phasor = (each[0] - 1j * each[1]).values
        mass = model.matrices_in(harmonic).mass_matrix
        flat = phasor.reshape(-1, phasor.shape[-1])
        squared = ((mass @ flat.T).T * flat.conj()).sum(axis=1).real.reshape(phasor.shape[:-1])
        size = each[0].isel(dof=0, drop=True).copy(data=squared)
        energy = energy + (harmonic * RADIANS * dataset["frequency"]) ** 2 / 2 * size
    name = f"event_{moves}"
    if name in dataset.variables:
        known = dataset[name].notnull()
        nearest = abs(dataset[moves] - dataset[name]).fillna(np.inf).argmin("point")
        dataset = dataset.assign({name: energy.isel(point=nearest).where(known)})
    return dataset.assign_coords({moves: energy})
