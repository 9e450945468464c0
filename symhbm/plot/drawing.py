"""Style, colours and labels of figures, and families of curves in a dataset."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from symhbm.model import PARAMETERS
from symhbm.model.contacts import Parameter
from symhbm.numerics import FloatArray, FourierBasis, check, unknowns_of
from symhbm.plot.picture import FAMILY, Axis, Colours, Panel
from symhbm.results import Description, check_dataset, check_present, meaning
from symhbm.results.reading import CHOSEN, At, curve_status
from symhbm.results.reading import at as points_of_curves

SYMBOLS = {"frequency": ("$f$", "Hz")}
SYMBOLS |= {name: about.shown_as(name) for name, about in PARAMETERS.items()}
LINE_STYLES: tuple[Any, ...] = (
    *("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5))),
    *((0, (9, 2)), (0, (5, 1.5, 1.2, 1.5, 1.2, 1.5))),
)
MOST_LEGEND_ENTRIES = 14
"""Largest family of curves with a legend; a larger one has a colour bar."""
WIDE = 30
"""Ratio of values from which a scale is logarithmic."""


def check_variables(dataset: xr.Dataset, *names: str) -> None:
    """Raise TypeError unless it is a dataset, KeyError for the first missing variable."""
    check_dataset("dataset", dataset)
    check_present(dataset, *names)


def check_anything(dataset: xr.Dataset, name: str) -> None:
    """Raise ValueError where a variable holds no number."""
    if not np.isfinite(dataset[name]).any():
        raise nothing_to_draw(dataset)


def nothing_to_draw(dataset: xr.Dataset) -> ValueError:
    """The error of a dataset without a converged point, with the statuses of its curves.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> response = sh.frf(problem, (10, 30))
    >>> isinstance(sh.plot.nothing_to_draw(response), ValueError)
    True
    """
    ends: Counter[str] = Counter()
    if (status := curve_status(dataset)) is not None:
        ends.update(str(end) for end in status.values.ravel())
    reasons = "".join(f"; {count} ended with: {end}" for end, count in ends.most_common(3))
    if len(ends) > 3:
        reasons += f"; and others, {len(ends)} reasons in all"
    return ValueError(
        f"dataset: expected a converged point, there is none, and so nothing to draw{reasons}"
    )


def check_dims(array: xr.DataArray, allowed: Sequence[str], what: str) -> None:
    """Raise ValueError where an array of the dataset has other dimensions than those allowed."""
    more = [str(dim) for dim in array.dims if dim not in allowed]
    if more:
        raise ValueError(
            f"dataset: expected {what}, got the dimension{'s' * (len(more) > 1)} "
            f"{', '.join(more)} as well; select one value of each first, for example "
            f"dataset.isel({more[0]}=0)"
        )


def one_solution(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset without the dimension ``solution``; ValueError where there are several."""
    if "solution" not in dataset.dims:
        return dataset
    if dataset.sizes["solution"] > 1:
        raise ValueError(
            "dataset: expected one solution at each value, got the dimension solution; "
            "select one first, for example dataset.isel(solution=0)"
        )
    return dataset.isel(solution=0)


def motions_of(dataset: xr.Dataset, coefficient: FloatArray) -> tuple[FourierBasis, FloatArray]:
    """The basis of a dataset, and motions (n, n_components) from (n, n_harmonics, 2)."""
    harmonics = tuple(dataset["harmonic"].values.tolist())
    basis = FourierBasis(harmonics)
    return basis, unknowns_of(basis, harmonics, coefficient).reshape(len(coefficient), -1)


class Moving(NamedTuple):
    """Moving parameter of a curve, its dimension, and whether peaks are those of every DOF."""

    name: str
    along: str
    per_dof: bool


def moving(dataset: xr.Dataset) -> Moving:
    """The moving parameter of a result of `symhbm.frf` or `symhbm.follow`, else the frequency."""
    description = Description(dataset)
    along = "point" if "point" in dataset.dims else description.moving
    return Moving(description.moving, along, description.per_dof)


def point_of(dataset: xr.Dataset, at: At | None) -> xr.Dataset:
    """One point of each curve; ValueError where none converged, and as `symhbm.datasets.at`."""
    check_variables(dataset, "amplitude")
    check_anything(dataset, "amplitude")
    return points_of_curves(dataset, at)


def decibel(amplitude: Any) -> Any:
    """Level in dB re 1 m."""
    with np.errstate(divide="ignore"):
        return 20 * np.log10(amplitude)


class Scale(NamedTuple):
    """How amplitudes are drawn: in decibels re one ``unit``, or in the unit."""

    kind: str = "decibel"
    unit: str = "m"

    @property
    def label(self) -> str:
        """The unit of what is drawn."""
        unit = _METRES.get(self.unit, (1.0, self.unit))[1]
        level = "dB re 1" if unit == "1" else f"dB re 1 {unit}"
        return level if self.kind == "decibel" else unit

    def of(self, amplitude: Any) -> Any:
        """What is drawn of amplitudes [m]."""
        shown = amplitude / _METRES.get(self.unit, (1.0, ""))[0]
        return decibel(shown) if self.kind == "decibel" else shown

    def of_level(self, level: Any) -> Any:
        """What is drawn of levels [dB re 1 m]."""
        if self == DECIBEL:
            return level
        return self.of(10 ** (np.asarray(level) / 20))

    def axis(self, words: str) -> Axis:
        """The axis of amplitudes."""
        limits = (0.0, None) if self.kind == "linear" else None
        label = words if self.label == "1" else f"{words} [{self.label}]"
        return Axis(label, log=self.kind == "log", limits=limits)


DECIBEL = Scale()
_METRES = {"m": (1.0, "m"), "mm": (1e-3, "mm"), "um": (1e-6, "µm")}
SCALES = ("decibel", "linear", "log")


def scale_of(scale: str, unit: str, dataset: xr.Dataset) -> Scale:
    """The scale of two words, of an output in its own unit; ValueError for others."""
    kind = check.one_of("scale", scale, SCALES)
    unit = check.one_of("unit", unit, _METRES)
    own = dataset["amplitude"].attrs.get("units", "m") if "amplitude" in dataset else "m"
    return Scale(kind, unit if own == "m" else own)


def is_wide(values: np.ndarray) -> bool:
    """Whether values ask for a logarithmic scale."""
    return bool(values.min() > 0 and values.max() / values.min() > WIDE)


def scaled(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit with an SI prefix in which ``largest`` has one to three digits."""
    prefixes = ("n", "µ", "m", "", "k", "M")
    power = int(np.floor(np.log10(largest) / 3)) if np.isfinite(largest) and largest > 0 else 0
    power = min(max(power, -3), 2)
    return 10.0 ** (-3 * power), prefixes[power + 3] + unit


def symbol_of(dataset: xr.Dataset, name: str) -> tuple[str, str] | None:
    """Symbol and unit of a parameter of the problem behind a dataset, None for none."""
    about = Description(dataset).records.get(name)
    if not isinstance(about, Parameter):
        return SYMBOLS.get(name)
    group, point, own = name.partition(".")
    symbol, unit = about.shown_as(own if point else name)
    return (f"{symbol} of {group}" if point else symbol), unit


def axis_label(dataset: xr.Dataset, name: str) -> str:
    """Meaning, symbol and unit of a parameter, or the name of a dimension of the user's own."""
    known = symbol_of(dataset, name)
    if known is None:
        return name.replace("_", " ")
    words = meaning(name, Description(dataset).records).long_name
    plain = name == "engine_order" or not known[0].startswith("$")
    text = words if plain else f"{words} {known[0].partition(' of ')[0]}"
    return f"{text} [{known[1]}]" if known[1] else text


def parameter_axis(dataset: xr.Dataset, name: str, **more: Any) -> Axis:
    """The axis of a parameter, logarithmic where its values ask for it, or a dimension."""
    values = dataset[name].values if name in dataset.variables else np.empty(0)
    finite = values[np.isfinite(values)] if values.dtype.kind == "f" else np.empty(0)
    log = name != "frequency" and bool(finite.size) and is_wide(finite)
    return Axis(axis_label(dataset, name), log, **more)


def value_label(dataset: xr.Dataset, dim: str, index: int) -> str:
    """Symbol, value and unit of one value of a dimension; its number where it has no values."""
    symbol, unit = symbol_of(dataset, dim) or (dim.replace("_", " "), "")
    if dim not in dataset.coords:
        return f"{symbol} {index}"
    value = dataset[dim].values[index]
    text = f"{value:g}" if isinstance(value, (int, float, np.number)) else str(value)
    return f"{symbol} = {text} {unit}".rstrip()


def point_text(dataset: xr.Dataset) -> str:
    """Where one point is, and which of its curve."""
    name, words = Description(dataset).moving, [f"{float(dataset['frequency']):.5g} Hz"]
    if name != "frequency" and name in dataset.variables:
        symbol, unit = symbol_of(dataset, name) or (name.replace("_", " "), "")
        words.insert(0, f"{symbol} = {float(dataset[name]):.4g} {unit}")
    return ", ".join([*words, str(dataset[CHOSEN].values)] if CHOSEN in dataset.coords else words)


def shades(number: int) -> np.ndarray:
    """Colours of a family of curves, light to dark; black for one."""
    return FAMILY(np.linspace(0, 1, number)) if number > 1 else np.array([[0.0, 0.0, 0.0, 1.0]])


def numbers_along(dataset: xr.Dataset, dim: str) -> np.ndarray:
    """Values of a dimension where they are numbers, else their positions."""
    values = dataset[dim].values if dim in dataset.coords else np.empty(0, dtype=object)
    return values.astype(float) if values.dtype.kind in "iuf" else np.arange(dataset.sizes[dim])


class Member(NamedTuple):
    """One curve of a family: its position in the dataset, and its colour, style and label."""

    position: dict[str, int]
    color: Any
    style: Any
    label: str

    @property
    def look(self) -> dict[str, Any]:
        """Of a line."""
        return dict(color=self.color, linestyle=self.style)


class Family:
    """Curves over the dimensions ``dims`` of a dataset: few have a legend, many a colour bar.

    Where there are many, the longest dimension gives the colours and the others the line styles.
    """

    def __init__(self, dataset: xr.Dataset, dims: Sequence[str]):
        self._dataset, self.dims = dataset, list(dims)
        self._sizes = [dataset.sizes[dim] for dim in dims]
        self._ramp, self._bar = "", None
        if int(np.prod(self._sizes)) > MOST_LEGEND_ENTRIES:
            self._ramp = self.dims[int(np.argmax(self._sizes))]
            self._values = numbers_along(dataset, self._ramp)
            ends, wide = (self._values.min(), self._values.max()), is_wide(self._values)
            self._bar = Colours(FAMILY, *ends, wide, axis_label(dataset, self._ramp))

    @classmethod
    def over(cls, dataset: xr.Dataset, values: xr.DataArray, along: str) -> "Family":
        """Curves over all dimensions of some values but the one that is drawn ``along``."""
        return cls(dataset, [str(dim) for dim in values.dims if dim != along])

    def __iter__(self) -> Iterator[Member]:
        colors = shades(int(np.prod(self._sizes)))
        others: dict[tuple[int, ...], int] = {}
        for number, index in enumerate(np.ndindex(*self._sizes)):
            position = dict(zip(self.dims, index, strict=True))
            color, turn = colors[number], number
            named = {dim: i for dim, i in position.items() if dim != self._ramp}
            if self._bar is not None:
                color = self._bar.of(self._values[position[self._ramp]])
                turn = others.setdefault(tuple(named.values()), len(others))
            label = ", ".join(value_label(self._dataset, dim, i) for dim, i in named.items())
            yield Member(position, color, LINE_STYLES[turn % len(LINE_STYLES)], label)

    def curves(self) -> Iterator[tuple[Member, xr.Dataset]]:
        """The members with their parts of the dataset."""
        return ((member, self._dataset.isel(member.position)) for member in self)

    def explain(self, panel: Panel) -> None:
        """Add the legend before that of marks, or the colour bar and a legend of line styles."""
        panel.bar, marks = self._bar or panel.bar, panel.items
        styles = {member.label: member for member in self if member.label}
        if len(styles) > MOST_LEGEND_ENTRIES:
            styles = {}
        panel.legend_at = "outside" if styles and self._bar is None else "best"
        panel.legend, panel.items = {"handlelength": 2.8}, []
        for member in styles.values():
            look = member.look if self._bar is None else member.look | {"color": "black"}
            panel.entry(member.label, **look)
        panel.items += marks
