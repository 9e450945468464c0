"""What values, places, parameter sets and designs of a dataset are called in words."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from symhbm.results.description import Description
from symhbm.results.provenance import LARGEST_OF
from symhbm.results.reading import largest, moving, set_dimensions

Rows = Iterator[tuple[str, str]]
"""Labels and texts; a text without a label goes on with the one before."""


class Words:
    """The words for what is in a dataset; numbers have so many significant ``digits``."""

    def __init__(self, dataset: xr.Dataset, digits: int = 6):
        self.dataset, self.description, self.digits = dataset, Description(dataset), digits
        self.along = moving(dataset)
        self.body = "blade" if self.description.lumped else "DOF"

    def short(self, value: Any) -> str:
        """A label as text, numbers to so many digits."""
        value = np.asarray(value).item()
        return f"{value:.{self.digits}g}" if isinstance(value, float) else str(value)

    def within(self, value: float, error: float) -> str:
        """A number to the second digit of its error, or to as many as others without one."""
        if not (np.isfinite([value, error]).all() and 0 < error < abs(value)):
            return self.short(value)
        first, last = (int(np.floor(np.log10(abs(of)))) for of in (value, float(f"{error:.1e}")))
        scale, power = (0, "") if -3 <= first < 6 and last < 2 else (first, f"e{first:+03d}")
        digits = 1 + scale - last
        text = " ± ".join(f"{of / 10.0**scale:.{digits}f}" for of in (value, error))
        return f"({text}){power}" if power else text

    def span(self, values: Any) -> str:
        """From the smallest to the largest of some numbers, or the only one."""
        return " to ".join(dict.fromkeys([self.short(np.min(values)), self.short(np.max(values))]))

    def at(self, value: xr.DataArray) -> str:
        """The value at which something is."""
        return f"at {self.short(value.values)} {value.attrs.get('units', '')}".rstrip()

    def level(self, amplitude: float, units: str = "m", error: float = np.nan) -> str:
        """An amplitude, with its level, to what its relative ``error`` leaves of it."""
        level = f" ({20 * np.log10(amplitude):.2f} dB re 1 {units})" if amplitude > 0 else ""
        return f"{self.within(amplitude, error * amplitude)} {units}{level}"

    def place(self, number: int) -> str:
        """A degree of freedom by its name, node and direction, or number."""
        coordinates = self.dataset.coords
        numbers = np.atleast_1d(coordinates["dof"].values).tolist() if "dof" in coordinates else []
        if {"node", "direction"} <= {*coordinates} and number in numbers:
            at = numbers.index(number)
            nodes, ways = (
                np.atleast_1d(coordinates[name].values) for name in ("node", "direction")
            )
            names = np.atleast_1d(coordinates["label"].values) if "label" in coordinates else nodes
            one = names[at] != "" and np.unique(nodes[names == names[at]]).size == 1
            return f"{names[at] if one else nodes[at]}:{ways[at]}"
        return f"{self.body} {number}"

    def kept(self) -> list[str]:
        """The degrees of freedom among which a response of a condensed structure is the largest."""
        attributes = self.dataset.attrs
        return [f"of the {attributes[LARGEST_OF]}"] if LARGEST_OF in attributes else []

    def parameter_set(self, index: dict[str, int]) -> list[tuple[str, Any, str]]:
        """Names, values and units of the swept parameters of one set; numbers without values."""
        dataset, found = self.dataset, []
        for dim, position in index.items():
            known = dim in dataset.coords
            value = dataset[dim].values[position] if known else position
            found.append((dim, value, dataset[dim].attrs.get("units", "") if known else ""))
        for name in self.description.swept:
            if name in index or name not in dataset.variables or not dataset[name].ndim:
                continue
            if set(dataset[name].dims) <= set(index):
                value = dataset[name].isel({d: index[str(d)] for d in dataset[name].dims})
                found.append((name, value.values.item(), value.attrs.get("units", "")))
        return found

    def set_words(self, index: dict[str, int]) -> list[str]:
        """The parameter set of an entry, as it is selected on the command line."""
        own = {dim: index[dim] for dim in set_dimensions(self.dataset) if dim in index}
        return [f"{name}={self.short(value)}" for name, value, _ in self.parameter_set(own)]

    def location(self, index: dict[str, int]) -> list[str]:
        """Location of an entry of a variable: frequency, blade or contact, parameters."""
        dataset, words = self.dataset, []
        for label in (f"peak_{self.along}" if "peak" in index else self.along, "angle"):
            dims = dataset[label].dims if label in dataset.variables else ()
            if dims and set(dims) <= set(index):
                words.append(self.at(dataset[label].isel({d: index[str(d)] for d in dims})))
        if "dof" in index:
            words.append(self.place(int(dataset["dof"].values[index["dof"]])))
        if "contact" in index:
            words.append(f"contact {dataset['contact'].values[index['contact']]}")
        return words + self.set_words(index)

    def worst(self, name: str, text: str = "{}") -> list[str]:
        """The largest value of a variable, and where it is; nothing where it is not known."""
        found = largest(self.dataset, name) if name in self.dataset.variables else None
        return [] if found is None else [text.format(found[0]), *self.location(found[1])]


def count(number: int, noun: str) -> str:
    """A number of things."""
    plural = noun.replace("degree", "degrees") if noun.startswith("degree") else f"{noun}s"
    return f"{number} {noun if number == 1 else plural}"


def counted(names: np.ndarray) -> str:
    """How many there are of each name, the empty one left out."""
    counts = Counter(map(str, names.ravel().tolist()))
    counts.pop("", None)
    kinds = ", ".join(f"{number} {kind}" for kind, number in sorted(counts.items()))
    return f"{counts.total()}: {kinds}" if counts else "none"


def designs(words: Words) -> Rows:
    """Values, aims and certificate of a design, or of every point of a front."""
    dataset = words.dataset
    if "certificate" not in dataset.variables or "estimate" in dataset.variables:
        return
    yield "design", str(dataset["status"].item())
    if "front_aim" in dataset.variables:
        yield from _front(words)
    elif "design_value" in dataset.variables:
        yield from _design(words)
    if "certificate" in dataset.variables:
        yield from certificate(words)


def certificate(words: Words) -> Rows:
    """The certificate of a design or a fit, line by line, but the first, which is its status."""
    _, *lines = str(words.dataset["certificate"].item()).split("\n")
    yield from zip(["certificate", *[""] * len(lines)], lines, strict=False)


def _design(words: Words) -> Rows:
    dataset, short = words.dataset, words.short
    for i, (label, value, units) in enumerate(_variables(words, dataset["design_value"].values)):
        if np.isnan(value) and "design_from" in dataset.variables:
            ends = (dataset[end].values[i] for end in ("design_from", "design_to"))
            yield f"  {label}", f"{' to '.join(map(short, ends))}{units}"
        else:
            yield f"  {label}", f"{short(value)}{units}"
    if "design_amplitude" in dataset.variables:
        amplitude = dataset["design_amplitude"]
        units = amplitude.attrs.get("units", "m")
        yield "  largest response", f"{short(amplitude.item())} {units}"
    if "design_aim" in dataset.variables:
        yield "  objective", short(dataset["design_aim"].item())


def _front(words: Words) -> Rows:
    dataset, short = words.dataset, words.short
    for which in ("front", "removed"):
        points = zip(dataset[f"{which}_aim"].values, dataset[f"{which}_value"].values, strict=True)
        for number, (aims, values) in enumerate(points):
            named = zip(dataset["aim"].values, aims, strict=True)
            told = [f"{name} {short(aim)}" for name, aim in named]
            told += [f"{label} {short(v)}{unit}" for label, v, unit in _variables(words, values)]
            if which == "removed":
                told.append(str(dataset["removed_reason"].values[number]))
            yield f"  {which} {number}", ", ".join(told)


def _variables(words: Words, values: np.ndarray) -> Iterator[tuple[str, float, str]]:
    labels = words.dataset["variable"].values
    units = words.dataset.get("variable_units", xr.DataArray(["1"] * len(labels))).values
    for label, value, unit in zip(labels, values, units, strict=True):
        yield str(label), float(value), "" if unit == "1" else f" {unit}"
