"""What is said of a design, or of a front of two aims, in an archive."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from symhbm.results.telling.words import Rows, Words


def designs(words: Words) -> Rows:
    """Values, aims and certificate of a design, or of every point of a front."""
    dataset = words.dataset
    if "design_status" not in dataset.variables:
        return
    yield "design", str(dataset["design_status"].item())
    if "front_aim" in dataset.variables:
        yield from _front(words)
    elif "design_value" in dataset.variables:
        yield from _design(words)
    if "certificate" in dataset.variables:
        yield "certificate", str(dataset["certificate"].item())


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
