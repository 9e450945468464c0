"""Response curves: amplitude over the parameter that moves."""

from typing import Any, NamedTuple, Unpack

import numpy as np
import xarray as xr

from symhbm.numerics import FloatArray, check
from symhbm.plot.drawing import (
    Family,
    Moving,
    Scale,
    check_anything,
    check_dims,
    check_variables,
    decibel,
    moving,
    one_solution,
    parameter_axis,
    scale_of,
    scaled,
    symbol_of,
)
from symhbm.plot.lines import (
    MARK,
    MARKERS,
    OF_EVENTS,
    Line,
    Peak,
    knows_peaks,
    line_of,
    located_peaks,
    mark_ends,
)
from symhbm.plot.looks import Named, compared
from symhbm.plot.measurements import check_measured, draw_measured, place_of
from symhbm.plot.picture import Panel, Picture
from symhbm.plot.places import Chosen, Shown, chosen

_PEAKS = ("smooth", "corner")
"""Kinds of peaks that have a place."""
_NOTHING = 1e-12
"""Share of the largest amplitude of a harmonic that is round-off."""
_LEADS = 1e-6
"""Relative distance within which a peak belongs to the largest response."""


@compared
def response(
    dataset: xr.Dataset,
    *,
    place: Shown = None,
    harmonic: int | None = None,
    peaks: bool = True,
    annotate: bool = False,
    scale: str = "decibel",
    unit: str = "m",
    measured: xr.Dataset | None = None,
    **common: Unpack[Named],
) -> Picture:
    """Draw amplitude over the moving parameter, by default in dB re 1 m, a line per parameter set.

    Lines follow the slopes of the amplitudes at their points (``amplitude_slope``) and go through
    located peaks, which lie between the points of a grid (``at=``). Without slopes, as in archives
    of older versions or where ``keep=`` left them out, lines are monotone between their points, or
    straight where they fold. Paths tell the largest response between their points within 1 % as a
    rule; for the antiresonances of a single degree of freedom, compute them with ``peaks="each"``.

    Unstable responses are dotted lines, or hollow circles. More than 14 curves have a colour bar
    in the place of a legend; those of a dimension ``sample`` are thin, without marks of peaks.
    A red cross is where a curve ends that is not complete, as its ``status`` says.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow`.
    place
        What to show: the number of a degree of freedom, ``"blade 3"``, a label or a node as
        ``"tip"``, one of its directions as ``"tip:y"``, or several of these. Of several degrees of
        freedom, by default of all, it is the largest response.
    harmonic
        Draw the amplitude of this harmonic alone, without peaks; by default the largest
        displacement.
    peaks
        Mark the located peaks of what is shown: circles are smooth, triangles corners, vertical
        lines unbounded. Squares are folds, diamonds branch points, triangles that point down period
        doublings, pluses Neimark-Sacker events, crosses other changes of stability.
    annotate
        Write value and amplitude at peaks.
    scale
        ``"decibel"``, or amplitudes on a ``"linear"`` or a ``"log"`` axis.
    unit
        ``"m"``, ``"mm"`` or ``"um"``: the unit of amplitudes, and what 0 dB are one of.
    measured
        Measurements of `symhbm.datasets.measured` to draw as circles, each in the colour of the
        curve of its parameters; by default those that a fit holds. They are amplitudes of one
        harmonic, curves the largest displacement over the period.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError
        If the dataset holds no curve, or ``place`` is the name of no place.
    ValueError
        If ``place`` is out of range, no point converged, or a scale or a unit is unknown.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> figure = sh.plot.response(sh.frf(problem, (10, 30), over={"normal_load": [1, 3]}))
    >>> figure.savefig("response.png")
    """
    measured = check_measured(dataset, measured)
    parameter, where = check_curves(dataset, place_of(measured, place))
    shown = scale_of(scale, unit, dataset)
    if harmonic is not None:
        dataset = of_harmonic(dataset, harmonic)
        where = where._replace(words=f"harmonic {harmonic}, {where.words}")
    check_anything(dataset, "amplitude")
    inner = parameter.along, "dof", "solution"
    swept = [str(dim) for dim in dataset["amplitude"].dims if dim not in inner]
    family = Family(dataset, [dim for dim in swept if dim != "sample"])
    panel = response_panel(dataset, parameter, where, shown)
    for member, each in family.curves():
        look, curves = member.look, [each]
        if measured is not None and parameter.name == "frequency":
            draw_measured(panel, measured, each, where, shown, member.color)
        if "sample" in swept:
            look |= dict(linewidth=0.6, alpha=0.45)
            curves = [each.isel(sample=i) for i in range(dataset.sizes["sample"])]
        for one in curves:
            if "solution" in one["amplitude"].dims:
                _dots(panel, one, parameter, where, shown, member.color)
                marks = marks_of(located_peaks(one, parameter), parameter, where)
            else:
                line, marks = traced(one, parameter, where)
                draw_line(panel, line, shown, **look)
            points = shown_amplitude(one, where)
            points = points.max([dim for dim in points.dims if dim != parameter.along])
            mark_ends(panel, one, parameter.name, shown.of(points.values))
            for mark in marks if peaks and "sample" not in swept else ():
                _mark(panel, *mark, shown, member.color)
                if annotate and mark[0] in _PEAKS:
                    _annotate(panel, dataset, parameter.name, mark, shown)
    family.explain(panel)
    return Picture([panel])


def response_panel(dataset: xr.Dataset, parameter: Moving, where: Chosen, scale: Scale) -> Panel:
    """The axes of a response over its parameter."""
    return Panel(parameter_axis(dataset, parameter.name, room=0), scale.axis(where.words))


def draw_line(panel: Panel, line: Line, scale: Scale, label: str = "", **look: Any) -> None:
    """Draw a curve, dotted where it is unstable."""
    value, level, unstable = drawn(line, scale)
    solid, dotted = (
        np.append(chosen, False) | np.append(False, chosen) for chosen in (~unstable, unstable)
    )
    solid |= not len(unstable)
    panel.line(value, np.where(solid, level, np.nan), label, **look)
    if dotted.any():
        look |= dict(linestyle=":", linewidth=1.0)
        panel.line(value, np.where(dotted, level, np.nan), **look)


def _dots(
    panel: Panel, curve: xr.Dataset, parameter: Moving, where: Chosen, scale: Scale, color: Any
) -> None:
    """Draw every solution at each value; hollow circles are unstable."""
    dims = parameter.along, "solution"
    level = scale.of(shown_amplitude(curve, where).transpose(*dims).values)
    unstable = np.zeros(level.shape, dtype=bool)
    if "stability" in curve.variables:
        unstable = curve["stability"].transpose(*dims).values == 0
    value, look = curve[parameter.name].values, dict(color=color, linestyle="")
    panel.line(value, np.where(unstable, np.nan, level), marker=".", markersize=3.5, **look)
    look |= dict(marker="o", markersize=2.5, markerfacecolor="white")
    panel.line(value, np.where(unstable, level, np.nan), **look)


def _mark(panel: Panel, kind: str, at: float, level: float, scale: Scale, color: Any) -> None:
    """Mark a peak or an event; what has no bound is a line."""
    if kind in MARKERS:
        look = MARK | dict(marker=MARKERS[kind], color=color, zorder=3)
        panel.line([at], [scale.of_level(level)], **look)
    elif kind == "unbounded":
        panel.add("upright", at, color=color, linestyle=":", linewidth=0.8)


def _annotate(
    panel: Panel, dataset: xr.Dataset, name: str, mark: tuple[str, float, float], scale: Scale
) -> None:
    """Write value and amplitude of a peak above it."""
    _, at, level = mark
    _, unit = symbol_of(dataset, name) or ("", "")
    factor, of_size = scaled(10 ** (level / 20), dataset["amplitude"].attrs.get("units", "m"))
    text = f"{at:.4g} {unit}\n{factor * 10 ** (level / 20):.4g} {of_size}"
    look: Any = dict(ha="center", va="bottom", fontsize="x-small", annotation_clip=False)
    panel.text((at, scale.of_level(level)), text, offset=(0, 5), **look)


def of_harmonic(dataset: xr.Dataset, harmonic: int) -> xr.Dataset:
    """The dataset with the amplitudes of one harmonic, without slopes and peaks of others."""
    check_variables(dataset, "coefficient")
    check.known(str(harmonic), [*map(str, dataset["harmonic"].values)], "harmonic of the dataset")
    parts = dataset["coefficient"].sel(harmonic=harmonic, drop=True)
    others = [n for n in dataset.variables if str(n).startswith(("amplitude_slope", "peak_"))]
    like = dataset["amplitude"]
    a, b = (parts.sel(component=part, drop=True) for part in ("cos", "sin"))
    size: Any = np.hypot(a, b)
    size = size.where(size > _NOTHING * size.max()).transpose(*like.dims).assign_attrs(like.attrs)
    return dataset.drop_vars(others).assign(amplitude=size)


def curve(dataset: xr.Dataset, *, place: Shown = None) -> tuple[FloatArray, FloatArray]:
    """Values (n,) and amplitudes (n,) [m] of a curve as `response` draws it, for other pictures.

    There are as many as straight lines need between decibels; points of the dataset are among
    them, in their order.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow`, or some points of it, of one parameter set.
    place
        As of `response`.

    Raises
    ------
    TypeError, KeyError, ValueError
        As `response`, and for several curves.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> response = sh.frf(sh.HarmonicBalance(blade, sh.forces.PointForce()), (10, 30))
    >>> frequency, amplitude = sh.plot.curve(response)
    >>> f"{1e3 * amplitude.max():.2f} mm"
    '0.31 mm'
    """
    parameter, where = check_curves(dataset, place)
    check_dims(dataset["amplitude"], (parameter.along, "dof", "solution"), "one curve")
    if "solution" in dataset["amplitude"].dims:
        dataset = one_solution(dataset)
    value, level, _ = traced(dataset, parameter, where).line.polyline()
    return value, 10 ** (level / 20)


def check_curves(dataset: xr.Dataset, place: Any) -> tuple[Moving, Chosen]:
    """The moving parameter of a dataset of curves, and the degrees of freedom to show.

    Raises as `response`.
    """
    check_variables(dataset, "amplitude", "frequency")
    parameter = moving(dataset)
    if parameter.along not in dataset["amplitude"].dims:
        raise KeyError("the dataset holds one point; a response curve has many")
    check.known("dof", [str(d) for d in dataset["amplitude"].dims], "dimension of the dataset")
    return parameter, chosen(dataset, place)


def shown_amplitude(dataset: xr.Dataset, where: Chosen) -> xr.DataArray:
    """The largest amplitude of some degrees of freedom; NaN where any is unknown."""
    amplitude = dataset["amplitude"]
    amplitude = amplitude if where.every else amplitude.isel(dof=[*where.dofs])
    return amplitude.max("dof", skipna=False)


Marks = list[tuple[str, float, float]]
"""Kind, value and level [dB] of peaks and events."""


class Traced(NamedTuple):
    """Line and marks of one curve."""

    line: Line
    marks: Marks


def traced(curve: xr.Dataset, parameter: Moving, where: Chosen) -> Traced:
    """Line and marks of one curve, of the largest response of some degrees of freedom."""
    line, peaks = line_of(curve, parameter, where.dofs), located_peaks(curve, parameter)
    if line.is_function:
        column = {dof: i for i, dof in enumerate(where.dofs)}
        own = [p._replace(dof=column[p.dof]) for p in peaks if p.dof in column]
        line = line.ascending().through(own)
        if parameter.along != "point" and knows_peaks(curve, parameter):
            # A path has points enough; between those of a grid slopes may promise anything.
            largest = curve["amplitude"].transpose(parameter.along, "dof").values.max(axis=1)
            at = np.concatenate([curve[parameter.name].values, [peak.value for peak in peaks]])
            known = np.isfinite(at)
            top = np.concatenate([largest, [peak.amplitude for peak in peaks]])
            line = line.held(at[known], top[known])
    marks = marks_of(peaks, parameter, where, line)
    if parameter.along == "point" and f"event_{parameter.name}" in curve and "event_kind" in curve:
        level = decibel(line.amplitude.max(axis=1, initial=0.0))
        events = curve["event_kind"].values, curve[f"event_{parameter.name}"].values
        for kind, at in zip(*events, strict=True):
            if kind in OF_EVENTS:
                marks.append((kind, float(at), level[np.abs(line.value - at).argmin()]))
    return Traced(line, marks)


def marks_of(
    peaks: list[Peak], parameter: Moving, where: Chosen, line: Line | None = None
) -> Marks:
    """Marks of the peaks that are shown, one where several degrees of freedom peak together.

    Of several degrees of freedom, peaks of each count where they are the largest response on a
    ``line``.
    """
    if not where.every:
        peaks = [peak for peak in peaks if parameter.per_dof and peak.dof in where.dofs]
    if parameter.per_dof and where.alone is None:
        top = np.full(len(peaks), np.inf)
        if line is not None and line.is_function:
            top = line.read(np.array([peak.value for peak in peaks]))
        pairs = zip(peaks, top, strict=True)
        peaks = [peak for peak, at in pairs if not peak.amplitude < (1 - _LEADS) * at]
    shown = [(peak.kind, peak.value, float(decibel(peak.amplitude))) for peak in peaks]
    return [*dict.fromkeys(shown)]


def drawn(line: Line, scale: Scale) -> tuple[Any, Any, np.ndarray]:
    """Values and what is drawn over them, and which of the straight lines are unstable."""
    if scale.kind == "linear":
        value, amplitude, unstable = line.polyline(linear=True)
        return value, scale.of(amplitude), unstable
    value, level, unstable = line.polyline()
    return value, scale.of_level(level), unstable
