"""Selection of parts of a dataset by texts ``NAME=VALUE``."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from symhbm.numerics import check
from symhbm.results.reading import INNER, moving

_FORMS = "NAME=VALUE, NAME=VALUE,VALUE or NAME=LOW:HIGH"
_ROUND_OFF = 1e-9
"""Relative difference up to which a number equals a label."""
_MOST_LISTED = 12
"""Most labels that an error lists one by one."""


class Selection(NamedTuple):
    """A part of a dataset, and the selected range of the moving parameter."""

    dataset: xr.Dataset
    low: float = -np.inf
    high: float = np.inf

    def limited(self, dataset: xr.Dataset) -> xr.Dataset:
        """A dataset with missing values for the points, peaks and events outside the range."""
        if self.low == -np.inf and self.high == np.inf:
            return dataset
        name, dataset = moving(dataset), dataset.copy()
        for axis, label in (("point", name), ("peak", f"peak_{name}"), ("event", f"event_{name}")):
            if label not in dataset.variables or axis not in dataset[label].dims:
                continue
            inside = (dataset[label] >= self.low) & (dataset[label] <= self.high)
            along = [key for key, variable in dataset.variables.items() if axis in variable.dims]
            for key in along:
                nothing: Any = {"f": np.nan, "i": -1, "b": False, "O": ""}[dataset[key].dtype.kind]
                dataset[key] = dataset[key].where(inside, nothing)
        return dataset


def select(dataset: xr.Dataset, choices: Iterable[str]) -> Selection:
    """Select by texts ``NAME=VALUE``, ``NAME=VALUE,VALUE`` or ``NAME=LOW:HIGH``, ends included.

    A name is a dimension, or a variable with one. Numbers agree to round-off; dimensions without
    labels count from 0. All dimensions stay, with their labels or positions.

    Raises
    ------
    KeyError
        For an unknown name.
    ValueError
        For another form of text, or where nothing is selected.
    """
    selection = Selection(dataset)
    names = set()
    for choice in choices:
        name, sign, text = (part.strip() for part in choice.partition("="))
        if not (sign and name and text):
            raise ValueError(f"--select {choice}: expected {_FORMS}")
        if name in names:
            raise ValueError(f"--select {choice}: {name!r} is selected twice, expected {_FORMS}")
        names.add(name)
        selection = _chosen(selection, name, text)
    return selection


def _chosen(selection: Selection, name: str, text: str) -> Selection:
    dataset = selection.dataset
    along = moving(dataset)
    on_path = along in dataset.variables and "point" in dataset[along].dims
    lines = [n for n, v in dataset.variables.items() if v.ndim == 1 and v.dims[0] not in INNER]
    names = {str(name): None for name in (*dataset.dims, *([along] if on_path else []), *lines)}
    names = [n for n in names if dataset.sizes.get(n, 1) and not n.endswith("_entry")]
    if name not in names:
        shown = [n for n in names if n in dataset.dims or n == along]
        check.known(name, shown, "dimension to select along")
    low, high = _range(name, text) if ":" in text else (-np.inf, np.inf)
    if name == along and on_path:
        if ":" not in text:
            raise ValueError(
                f"--select {name}={text}: expected a range LOW:HIGH, each curve has points of its "
                f"own along {name}"
            )
        values = dataset[name].values
        if not np.any((values >= low) & (values <= high)):
            raise ValueError(f"--select {name}={text}: no points there, {_available(values)}")
        return Selection(dataset, low, high)
    labels = dataset[name].values if name in dataset.variables else np.arange(dataset.sizes[name])
    dim = str(dataset[name].dims[0]) if name in dataset.variables else name
    if ":" in text:
        if labels.dtype.kind not in "iuf":
            raise ValueError(f"--select {name}={text}: expected {_available(labels)}")
        index = np.flatnonzero((labels >= low) & (labels <= high))
        if not len(index):
            raise ValueError(f"--select {name}={text}: nothing in this range, {_available(labels)}")
    else:
        index = np.concatenate([_positions(name, part.strip(), labels) for part in text.split(",")])
    if dim not in dataset.variables:
        dataset = dataset.assign_coords({dim: np.arange(dataset.sizes[dim])})
    selection = selection._replace(dataset=dataset.isel({dim: index}))
    if name != along:
        return selection
    low, high = (low, high) if ":" in text else (labels[index].min(), labels[index].max())
    return selection._replace(low=float(low), high=float(high))


def _positions(name: str, text: str, labels: np.ndarray) -> np.ndarray:
    """Positions of the labels that equal a text."""
    if labels.dtype.kind in "iufb":
        try:
            wanted = float(text)
        except ValueError:
            raise ValueError(f"--select {name}={text}: expected a number or {_FORMS}") from None
        equal = np.isclose(labels.astype(float), wanted, rtol=_ROUND_OFF, atol=0)
    else:
        equal = labels.astype(str) == text
    if not equal.any():
        raise ValueError(f"--select {name}={text}: no such value, {_available(labels)}")
    return np.flatnonzero(equal)


def _range(name: str, text: str) -> tuple[float, float]:
    try:
        low, high = (float(part) for part in text.split(":"))
        if not low <= high:
            raise ValueError
    except ValueError:
        raise ValueError(
            f"--select {name}={text}: expected two numbers LOW:HIGH in ascending order"
        ) from None
    return low, high


def _available(labels: np.ndarray) -> str:
    """Text on the labels that can be selected."""
    if labels.dtype.kind == "f":
        labels = labels[np.isfinite(labels)]
    if labels.ndim == 1 and len(labels) <= _MOST_LISTED:
        return f"there are {', '.join(map(str, labels.tolist()))}"
    return f"there are {labels.size} from {labels.min()} to {labels.max()}"
