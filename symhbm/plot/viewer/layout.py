"""What a page draws over what: the variable along curves, and the panels of what depends on it."""

from typing import Any, NamedTuple

import xarray as xr

from symhbm.plot.drawing import is_wide
from symhbm.plot.viewer.packing import plain
from symhbm.plot.viewer.sets import spoken
from symhbm.results import Description
from symhbm.results.reading import set_dimensions

_OF_FIRST = "amplitude of the first harmonic"


class Panel(NamedTuple):
    """One axis: its variable, what that is, its unit, its scales, the first by default.

    With ``places`` it has a value for each degree of freedom.
    """

    name: str
    title: str
    units: str
    scales: tuple[str, ...]
    places: bool = False


_RESPONSE = Panel(
    "amplitude",
    "largest displacement over the period",
    "m",
    ("decibel", "log", "linear"),
    places=True,
)


class Layout(NamedTuple):
    """The variable ``x`` along curves, what it is, and the panels over it from top to bottom.

    ``along`` are the dimensions of the points of a curve: one, or the value and its solutions;
    none where peaks alone were kept. Points that are ``apart`` are no curve.
    """

    x: str
    title: str
    units: str
    wide: bool
    along: tuple[str, ...]
    panels: tuple[Panel, ...]
    apart: bool = False

    @property
    def joined(self) -> bool:
        """Whether a line goes through the points."""
        return bool(self.along) and "solution" not in self.along and not self.apart

    def to_json(self) -> dict[str, Any]:
        """The same for the page."""
        return {
            "x": {"title": self.title, "units": self.units, "wide": self.wide},
            "joined": self.joined,
            "panels": [panel._asdict() for panel in self.panels],
        }


def layout_of(dataset: xr.Dataset) -> Layout | None:
    """The curves of a dataset, None where it holds none."""
    description = Description(dataset)
    x = description.moving
    if x not in dataset.variables or "amplitude" not in dataset.variables:
        return _of_peaks(dataset, x)
    panels, inner = _panels(dataset, x, description.unforced)
    panels = tuple(panel for panel in panels if panel.name in dataset.variables)
    if not panels:
        return None
    outer = {*set_dimensions(dataset), *inner}
    dims = [str(dim) for dim in dataset[panels[0].name].dims if str(dim) not in outer]
    along = tuple(sorted(dims, key=lambda dim: dim == "solution"))
    if not along or along[0] not in ("point", x) or (*along[1:], "solution")[0] != "solution":
        return None
    if set(map(str, dataset[x].dims)) - {*set_dimensions(dataset), along[0]}:
        return None
    values = dataset[x].values
    finite = values[values > 0] if values.dtype.kind == "f" else values[:0]
    wide = x == "amplitude" or bool(x != "frequency" and finite.size and is_wide(finite))
    about = dataset[x].attrs
    title = _OF_FIRST if x == "amplitude" else plain(about.get("long_name", spoken(x)))
    # Limit cycles of one problem are single motions.
    apart = description.unforced == "limit cycle" and x == "amplitude"
    return Layout(x, title, plain(about.get("units", ""), 40), wide, along, panels, apart)


def _of_peaks(dataset: xr.Dataset, x: str) -> Layout | None:
    """The peaks alone, where the points were not kept; None where there are none."""
    at = f"peak_{x}"
    if not {at, "peak_amplitude"} <= {*dataset.variables} or "peak" not in dataset[at].dims:
        return None
    about = dataset[at].attrs
    title = plain(about.get("long_name", spoken(x)))
    return Layout(x, title, plain(about.get("units", ""), 40), False, (), (_RESPONSE,))


def _panels(
    dataset: xr.Dataset, x: str, unforced: str | None
) -> tuple[tuple[Panel, ...], tuple[str, ...]]:
    """Panels over the variable ``x``, and the dimensions within a point of the first of them."""
    frequency = Panel("frequency", "frequency", "Hz", ("linear", "log"))
    if unforced == "nonlinear mode":
        ratio = Panel("damping_ratio", "damping ratio", "", ("linear", "log"))
        return (frequency, ratio), ()
    if unforced == "limit cycle":
        size = Panel("amplitude", "amplitude", "m", ("log", "linear"))
        return (frequency,) if x == "amplitude" else (size, frequency), ()
    if "peak_amplitude" in dataset.variables and x in dataset["peak_amplitude"].dims:
        top = Panel("peak_amplitude", "largest peak", "m", ("decibel", "log", "linear"))
        return (top, frequency._replace(name="peak_frequency", title="its frequency")), ()
    return (_RESPONSE,), ("dof",)
