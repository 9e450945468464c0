"""Phases of responses, and pictures of harmonics, motions and what a base transmits."""

from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.model import Place
from symhbm.numerics import check
from symhbm.plot.curves import check_curves, response
from symhbm.plot.drawing import (
    SCALES,
    Family,
    Moving,
    Scale,
    check_anything,
    check_variables,
    moving,
    one_solution,
    parameter_axis,
    point_of,
    point_text,
    scale_of,
    scaled,
)
from symhbm.plot.lines import curved, mark_ends
from symhbm.plot.looks import Named, compared
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.plot.places import Chosen, chosen
from symhbm.results.reading import At, amplitude_of, motion, seen_from

_ANGLES = 257
"""Points of a period."""
_UNITS = {"deg": 180 / np.pi, "rad": 1.0}


@compared
def phase(
    dataset: xr.Dataset,
    *,
    place: Place = 0,
    harmonic: int | None = None,
    unit: str = "deg",
    **common: Unpack[Named],
) -> Picture:
    """Draw the phase lag of a harmonic over the moving parameter, a line per parameter set.

    It is positive where the harmonic ``n`` comes later than ``cos(n omega t)``, as of
    `symhbm.datasets.motion`, and runs on beyond half a turn along a curve. A red cross is where a
    curve ends that is not complete.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow` with ``coefficient``.
    place
        The degree of freedom to show: its number, ``"blade 3"``, or its name as ``"tip:y"``.
    harmonic
        The harmonic; by default the lowest one above 0.
    unit
        ``"deg"`` or ``"rad"``.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        If the dataset holds no curve or no coefficients, no point converged, there are several
        solutions at a value, or ``place``, ``harmonic`` or ``unit`` are unknown.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> figure = sh.plot.phase(sh.frf(problem, (10, 30), over={"normal_load": [1, 3]}))
    >>> figure.savefig("phase.png")
    """
    factor = _UNITS[check.one_of("unit", unit, _UNITS)]
    dataset, parameter, which = _of_place(dataset, place, harmonic)
    harmonic = harmonic or int(dataset["harmonic"].where(dataset["harmonic"] > 0).min())
    lag = motion(dataset)["phase_lag"].sel(harmonic=harmonic)
    turn = r"\omega t" if harmonic == 1 else rf"{harmonic} \omega t"
    panel = Panel(
        parameter_axis(dataset, parameter.name, room=0),
        Axis(rf"phase lag of {which} behind $\cos({turn})$ [{unit}]"),
    )
    family = Family.over(dataset, lag, parameter.along)
    for member, one in family.curves():
        value, angle = one[parameter.name].values, lag.isel(member.position).values
        inside = np.isfinite(value) & np.isfinite(angle)
        shown = np.full(len(value), np.nan)
        shown[inside] = factor * np.unwrap(angle[inside])
        panel.line(*curved(value, shown), **member.look)
        mark_ends(panel, one, parameter.name, shown)
    family.explain(panel)
    return Picture([panel])


@compared
def bode(
    dataset: xr.Dataset,
    *,
    place: Place = 0,
    harmonic: int = 1,
    scale: str = "decibel",
    unit: str = "m",
    **common: Unpack[Named],
) -> Picture:
    """Draw amplitude over phase lag of a harmonic, one above the other.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow` with ``coefficient``.
    place, harmonic
        As of `phase`.
    scale, unit
        As of `response`, by default dB re 1 m.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        As of `response` and `phase`.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> sh.plot.bode(sh.frf(problem, (10, 30))).savefig("bode.png")
    """
    options: Any = dict(place=place, harmonic=harmonic)
    [above] = response.picture(dataset, scale=scale, unit=unit, **options).panels
    [below] = phase.picture(dataset, **options).panels
    above.place, below.place, above.x.label = (0.52, 0.48), (0.0, 0.48), ""
    below.items = [item for item in below.items if item.kind != "entry"]
    above.title, _, words = above.y.label.rpartition(" [")
    above.y.label, below.y.label = f"amplitude [{words}", "phase lag [deg]"
    return Picture([above, below], (6.4, 5.6), alone=True)


@compared
def nyquist(
    dataset: xr.Dataset,
    *,
    place: Place = 0,
    harmonic: int = 1,
    unit: str = "m",
    **common: Unpack[Named],
) -> Picture:
    """Draw the complex amplitude of a harmonic, ``a - i b``, in its plane.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow` with ``coefficient``.
    place, harmonic
        As of `phase`.
    unit
        ``"m"``, ``"mm"`` or ``"um"``.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        As of `phase`.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.Model([[1.0]], [[5.0]], [[1e4]])
    >>> response = sh.frf(sh.HarmonicBalance(blade, sh.forces.PointForce()), (5, 40))
    >>> sh.plot.nyquist(response, unit="mm").savefig("circle.png")
    """
    one, parameter, words = _of_place(dataset, place, harmonic)
    shown = scale_of("linear", unit, one)
    values = shown.of(motion(one)["complex_amplitude"].sel(harmonic=harmonic))
    across, upward = (
        Axis(f"{part} part of {words} [{shown.label}]") for part in ("real", "imaginary")
    )
    panel = Panel(across, upward, even="datalim")
    family = Family.over(one, values, parameter.along)
    for member in family:
        z = values.isel(member.position).values
        panel.line(*curved(z.real, z.imag, closed=True), **member.look)
    family.explain(panel)
    return Picture([panel])


@compared
def phase_portrait(
    dataset: xr.Dataset, *, place: Place = 0, at: At | None = None, **common: Unpack[Named]
) -> Picture:
    """Draw the velocity of one degree of freedom over its displacement through a period.

    Parameters
    ----------
    dataset
        A result of `symhbm.periodic_motion`, or with ``coefficient`` one of `symhbm.solve`, or
        curves, of which it is one point each.
    place
        As of `phase`.
    at
        Which point of curves, as of `symhbm.datasets.at`, by default the highest peak.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        As of `symhbm.datasets.at` and `symhbm.datasets.motion`, and for a place that is none.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce(), (1, 3))
    >>> figure = sh.plot.phase_portrait(sh.frf(problem, (10, 30), over={"normal_load": [1, 3]}))
    >>> figure.savefig("portrait.png")
    """
    check_variables(dataset, "frequency")
    if "angle" not in dataset.dims:
        if at is not None or moving(dataset).along in dataset.dims:
            dataset = point_of(dataset, at)
        histories = motion(dataset, angle=np.linspace(0, 2 * np.pi, _ANGLES))
        dataset = dataset.drop_vars(["displacement", "velocity"], errors="ignore")
        dataset = dataset.assign({name: histories[name] for name in ("displacement", "velocity")})
    where = chosen(dataset, place)
    one = dataset[["displacement", "velocity"]].isel(dof=_number(where, place))
    factor, unit = scaled(float(abs(one["displacement"]).max()), "m")
    words = where.words.removeprefix("response of ")
    panel = Panel(Axis(f"displacement of {words} [{unit}]"), Axis(f"velocity [{unit}/s]"))
    family = Family.over(dataset, one["displacement"], "angle")
    for member in family:
        x, v = (factor * one[n].isel(member.position).values for n in ("displacement", "velocity"))
        panel.line(np.append(x, x[:1]), np.append(v, v[:1]), **member.look)
    family.explain(panel)
    panel.title = "" if family.dims else point_text(dataset)
    return Picture([panel])


@compared
def transmissibility(
    dataset: xr.Dataset, *, place: Place = 0, scale: str = "decibel", **common: Unpack[Named]
) -> Picture:
    """Draw the largest absolute displacement over that of the moving base.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` with ``coefficient`` under a `symhbm.forces.BaseMotion`.
    place
        As of `phase`.
    scale
        ``"decibel"``, or the ratio on a ``"linear"`` or a ``"log"`` axis.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        As of `phase` and `symhbm.datasets.seen_from`.

    Examples
    --------
    >>> import symhbm as sh
    >>> table = sh.Model([[1.0]], [[10.0]], [[1e4]])
    >>> problem = sh.HarmonicBalance(table, sh.forces.BaseMotion(displacement=1e-3))
    >>> figure = sh.plot.transmissibility(sh.frf(problem, (5, 40)), scale="log")
    >>> figure.savefig("isolator.png")
    """
    one, parameter, words = _of_place(dataset, place, None)
    seen = [seen_from(dataset, where) for where in ("ground", "base")]
    base = amplitude_of(seen[0]["coefficient"] - seen[1]["coefficient"])
    number = chosen(dataset, place).alone
    ratio = (seen[0]["amplitude"] / base.max("dof")).isel(dof=number)
    ratio = ratio.isel(solution=0) if "solution" in ratio.dims else ratio
    shown = Scale(check.one_of("scale", scale, SCALES), "1")
    across = parameter_axis(one, parameter.name, room=0)
    panel = Panel(across, shown.axis(f"transmissibility to {words}"))
    family = Family.over(one, ratio, parameter.along)
    for member, curve in family.curves():
        values = shown.of(ratio.isel(member.position).values)
        panel.line(*curved(curve[parameter.name], values), **member.look)
        mark_ends(panel, curve, parameter.name, values)
    family.explain(panel)
    return Picture([panel])


def _number(where: Chosen, place: Any) -> int:
    """The one degree of freedom that was asked for."""
    if where.alone is None:
        raise ValueError(
            f"place={check.shown(place)}: expected one degree of freedom, this is {len(where.dofs)}"
        )
    return where.alone


def _of_place(
    dataset: xr.Dataset, place: Place, harmonic: int | None
) -> tuple[xr.Dataset, Moving, str]:
    """A curve of one degree of freedom, what moves along it, and its name; checks a harmonic."""
    parameter, where = check_curves(dataset, place)
    number = _number(where, place)
    check_variables(dataset, "coefficient")
    known = [n for n in dataset["harmonic"].values.tolist() if n > 0]
    if harmonic is not None and check.integer("harmonic", harmonic, 1) not in known:
        raise ValueError(f"harmonic={harmonic}: expected one of {known}")
    check_anything(dataset, "amplitude")
    words = where.words.removeprefix("response of ")
    return one_solution(dataset).isel(dof=number), parameter, words
