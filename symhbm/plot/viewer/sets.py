"""What a page shows: which curves, over what, in which panels, and what all is called."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from symhbm.plot import places
from symhbm.plot.drawing import is_wide
from symhbm.plot.viewer.packing import number, plain, with_units
from symhbm.results import Description, places_of
from symhbm.results.reading import COMPLETE, curve_status, set_dimensions
from symhbm.results.telling import Words

MOST_CURVES, _FEWEST, _STATES = 120, 6, 2_000_000
"""Most curves that a page shows one by one, fewest of many, and most states of their contacts."""
MOST_NAMES = 300
"""Most places and contacts that have a name in a menu."""


@dataclass(frozen=True)
class Sets:
    """The parameter sets of an archive: dimensions, and the positions along each that are shown."""

    dims: tuple[str, ...]
    sizes: tuple[int, ...]
    shown: tuple[tuple[int, ...], ...]

    @property
    def total(self) -> int:
        """Number of all sets."""
        return int(np.prod(self.sizes))

    @property
    def n_shown(self) -> int:
        """Number of the sets that are shown one by one."""
        return int(np.prod([len(positions) for positions in self.shown]))

    def positions(self) -> Iterator[dict[str, int]]:
        """The sets that are shown, each by its position along every dimension."""
        for index in product(*self.shown):
            yield dict(zip(self.dims, index, strict=True))


def sets_of(dataset: xr.Dataset, share: float = 1.0) -> Sets:
    """The sets to show: all, or the longest dimension thinned to its extremes and an even rest.

    ``share`` is that of the room of a page.
    """
    dims = set_dimensions(dataset)
    states = dataset.sizes.get("contact", 0) * dataset.sizes.get("point", 0)
    room = max(_FEWEST, min(MOST_CURVES, _STATES // max(1, states)))
    room = max(1, int(share * room))
    shown = [tuple(range(dataset.sizes[dim])) for dim in dims]
    while np.prod([len(positions) for positions in shown]) > room:
        longest = int(np.argmax([len(positions) for positions in shown]))
        others = np.prod([len(p) for k, p in enumerate(shown) if k != longest])
        most = max(1, int(room // others))
        most = max(1, min(most, len(shown[longest]) - 1))
        shown[longest] = _chosen(dataset, dims[longest], most)
    return Sets(dims, tuple(dataset.sizes[dim] for dim in dims), tuple(shown))


def _chosen(dataset: xr.Dataset, dim: str, most: int) -> tuple[int, ...]:
    """Positions along a dimension: the highest, the middle and the lowest peak, then evenly."""
    size = dataset.sizes[dim]
    wanted: list[int] = []
    if "peak_amplitude" in dataset.variables and dim in dataset["peak_amplitude"].dims:
        tops = dataset["peak_amplitude"]
        tops = tops.where(np.isfinite(tops)).max([d for d in tops.dims if d != dim]).values
        order = np.argsort(tops)[: np.count_nonzero(np.isfinite(tops))]
        wanted += [int(order[k]) for k in (-1, len(order) // 2, 0) if len(order)]
    failed = np.zeros(size, dtype=bool)
    if (status := curve_status(dataset)) is not None:
        complete = np.isin(status.values.astype(str), [*COMPLETE])
        axes = tuple(k for k, d in enumerate(status.dims) if d != dim)
        failed = (~complete).any(axis=axes)
    wanted += np.flatnonzero(failed)[: most // 4].tolist()
    evenly = np.unique(np.linspace(0, size - 1, most).astype(int)).tolist()
    # The evenly spread ones give way to those that were asked for.
    chosen = [*dict.fromkeys([*wanted, *evenly])][:most]
    return tuple(sorted(chosen))


def label_of(dataset: xr.Dataset, dim: str, position: int) -> str:
    """The value of a dimension, its number where it has no values."""
    if dim == "branch" and "branch_origin" in dataset.variables:
        origin = dataset["branch_origin"]
        if origin.dims == ("branch",):
            return f"{position}: {plain(origin.values[position], 40)}"
    if dim not in dataset.coords:
        return str(position)
    return number(dataset[dim].values[position])


def values_of(dataset: xr.Dataset, position: dict[str, int]) -> str:
    """The swept values of one set in words, those that are single numbers."""
    words = []
    for name, value, units in Words(dataset).parameter_set(position):
        value = label_of(dataset, name, position[name]) if name in position else value
        words.append(f"{spoken(name)} = {with_units(value, units)}")
    return ", ".join(words)


def spoken(name: Any) -> str:
    """A name as words."""
    return plain(str(name).replace("_", " "), 60)


def place_names(dataset: xr.Dataset) -> list[str]:
    """What the degrees of freedom are called, those that a menu can hold."""
    n_dof = dataset.sizes.get("dof", 0)
    count = range(min(n_dof, MOST_NAMES))
    known = places_of(dataset)
    if known is not None:
        return [plain(known.name(dof), 60) for dof in count]
    if "structure_dof" in dataset.variables:
        return [
            f"DOF {int(dof)} (kept {k})" for k, dof in enumerate(dataset["structure_dof"].values)
        ]
    word = "blade" if Description(dataset).lumped else "DOF"
    labels = dataset["dof"].values if "dof" in dataset.coords else np.arange(n_dof)
    return [f"{word} {plain(labels[k], 40)}" for k in count]


def contact_names(dataset: xr.Dataset) -> list[str]:
    """What the contacts are called: their numbers, and their groups where there are several."""
    n_contacts = dataset.sizes.get("contact", 0)
    labels = dataset["contact"].values if "contact" in dataset.coords else np.arange(n_contacts)
    groups = Description(dataset).groups
    owners = [name for name, each in groups.items() for _ in each["pairs"][0]]
    several = len(groups) > 1 and len(owners) == n_contacts
    return [
        f"{plain(labels[k], 40)} of {plain(owners[k], 60)}" if several else plain(labels[k], 40)
        for k in range(n_contacts)
    ]


def blades_of(dataset: xr.Dataset) -> list[int] | None:
    """Positions of the blades along ``dof`` in their order around the disk, None for no disk."""
    blades, position = places.blades_of(dataset) or [], places.position_of(dataset)
    found = [position[dof] for dof in blades if dof in position]
    return found if len(found) == len(blades) >= 3 else None


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
