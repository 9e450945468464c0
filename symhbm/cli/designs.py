"""What is said of a design, or of a front of two aims, in an archive."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from symhbm.cli.findings import short

Lines = Iterator[tuple[str, str]]


def designs(dataset: xr.Dataset) -> Lines:
    """Values, aims and certificate of a design, or of every point of a front."""
    if "design_status" not in dataset.variables:
        return
    yield "design", str(dataset["design_status"].item())
    if "front_aim" in dataset.variables:
        yield from _front(dataset)
    elif "design_value" in dataset.variables:
        yield from _design(dataset)
    if "certificate" in dataset.variables:
        yield "certificate", str(dataset["certificate"].item())


def _design(dataset: xr.Dataset) -> Lines:
    for i, told in enumerate(_variables(dataset, dataset["design_value"].values)):
        label, value, units = told
        text = short(value)
        if np.isnan(value) and "design_from" in dataset.variables:
            text = " to ".join(
                short(dataset[end].values[i]) for end in ("design_from", "design_to")
            )
        yield f"  {label}", f"{text}{units}"
    if "design_amplitude" in dataset.variables:
        amplitude = dataset["design_amplitude"]
        units = amplitude.attrs.get("units", "m")
        yield "  largest response", f"{short(amplitude.item())} {units}"
    if "design_aim" in dataset.variables:
        yield "  objective", short(dataset["design_aim"].item())


def _front(dataset: xr.Dataset) -> Lines:
    names = dataset["aim"].values
    for which in ("front", "removed"):
        points = zip(dataset[f"{which}_aim"].values, dataset[f"{which}_value"].values, strict=True)
        for number, (aims, values) in enumerate(points):
            told = [f"{name} {short(aim)}" for name, aim in zip(names, aims, strict=True)]
            told += [f"{label} {short(v)}{unit}" for label, v, unit in _variables(dataset, values)]
            if which == "removed":
                told.append(str(dataset["removed_reason"].values[number]))
            yield f"  {which} {number}", ", ".join(told)


def _variables(dataset: xr.Dataset, values: np.ndarray) -> Iterator[tuple[str, float, str]]:
    labels = dataset["variable"].values
    units = dataset.get("variable_units", xr.DataArray(["1"] * len(labels))).values
    for label, value, unit in zip(labels, values, units, strict=True):
        yield str(label), float(value), "" if unit == "1" else f" {unit}"
