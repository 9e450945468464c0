"""Selected parts of a dataset, by texts ``NAME=VALUE``: as figures, as comma-separated values."""

import csv
import inspect
import os
from collections.abc import Iterable, Iterator, Sequence
from types import ModuleType
from typing import Any, NamedTuple, TextIO

import numpy as np
import xarray as xr

import symhbm as sh
from symhbm.model.contacts import ContactLaw
from symhbm.numerics import check
from symhbm.results import Description, tables
from symhbm.results.reading import INNER, SAMPLE, moving, printable, rows_of, set_dimensions

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
                nothing = tables.blank(dataset[key].dtype, ()).item()
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


_FIRST = (
    *("response", "bode", "backbone", "envelope", "disk", "blades"),
    *("nonlinear-modes", "limit-cycles", "flutter-limit", "pareto-front"),
    *("hysteresis", "normal-force", "states", "stick-map", "contact-map", "model", "phase"),
    *("nyquist", "phase-portrait", "transmissibility"),
)
"""The order in which kinds are listed; others follow by name."""
_NO_ARCHIVES = {"campbell", "interference"}
"""Pictures of natural frequencies, which no archive holds."""


def kinds() -> list[str]:
    """Names of the pictures of `symhbm.plot`: its functions that draw into axes."""
    offered = {name.replace("_", "-"): getattr(_plot(), name) for name in _plot().__all__}
    names = {
        name
        for name, value in offered.items()
        if inspect.isfunction(value) and "ax" in inspect.signature(value).parameters
    } - _NO_ARCHIVES
    return [name for name in _FIRST if name in names] + sorted(names.difference(_FIRST))


def draw(
    results: xr.Dataset | dict[str, xr.Dataset],
    kind: str | None,
    choices: Sequence[str],
    options: dict[str, Any],
    laws: Sequence[ContactLaw] = (),
) -> tuple[str, Any]:
    """Kind and figure of the selected part; by default the kind that suits it.

    Several results have names. ``options`` go to the function that draws. Raises ValueError for an
    option it does not take, and for several results where it draws one.
    """
    named = isinstance(results, dict)
    every = results if isinstance(results, dict) else {"": results}
    parts = {name: _squeezed(dataset, choices) for name, dataset in every.items()}
    part = next(iter(parts.values()))
    kind = kind or _natural_kind(part)
    function = getattr(_plot(), kind.replace("-", "_"))
    for name, value in options.items():
        if name not in inspect.signature(function).parameters:
            raise ValueError(f"--{name} {value}: {kind} takes no --{name}")
    if named and "label" not in inspect.signature(function).parameters:
        raise ValueError(f"ARCHIVE: {kind} draws one, got {len(parts)} with names")
    if kind == "model":
        return kind, _structure(part, laws)
    return kind, function(parts if named else part, **options)


def _squeezed(dataset: xr.Dataset, choices: Sequence[str]) -> xr.Dataset:
    """The selected part, without the dimensions of which one value is selected."""
    selection = select(dataset, choices)
    part = selection.limited(selection.dataset)
    names = {choice.partition("=")[0].strip() for choice in choices} - {*INNER}
    return part.squeeze([dim for dim in part.dims if dim in names and part.sizes[dim] == 1])


def _plot() -> ModuleType:
    """The module of pictures, imported late: Matplotlib is slow."""
    # Pictures go to files, whatever screen there is.
    os.environ["MPLBACKEND"] = "agg"
    return sh.plot


def _structure(dataset: xr.Dataset, laws: Sequence[ContactLaw]) -> Any:
    """Figure of the structure of one parameter set, and the force on it."""
    several = [str(dim) for dim in set_dimensions(dataset) if dataset.sizes[dim] > 1]
    if several:
        raise ValueError(
            f"--kind model: expected one structure, the archive has several over "
            f"{', '.join(several)}; select one, for example --select {several[0]}="
            f"{dataset[several[0]].values[0] if several[0] in dataset.coords else 0}"
        )
    figure = _plot().model(sh.datasets.rebuild(dataset, laws))
    moves = Description(dataset).moving
    if moves != "frequency":
        ax = figure.axes[0]
        ax.set_title(f"{ax.get_title()}, {moves.replace('_', ' ')} at its nominal value")
    return figure


def _natural_kind(dataset: xr.Dataset) -> str:
    unforced = Description(dataset).unforced
    if unforced is not None:
        return f"{unforced.replace(' ', '-')}{'s' * (unforced != 'flutter limit')}"
    if "front_aim" in dataset.variables:
        return "pareto-front"
    if "friction_force" in dataset.variables:
        return "hysteresis"
    if "followed" not in dataset.attrs:
        return "disk"
    return "envelope" if dataset.sizes.get(SAMPLE, 1) > 1 else "response"


Row = Sequence[Any]


def rows(
    selection: Selection, table: str = "points", variables: Sequence[str] | None = None
) -> Iterator[Row]:
    """Header and rows of a table of a selected part, block by block; a missing number is None.

    ``variables`` and what it raises as of `rows_of`.
    """
    dataset = selection.dataset
    if (selection.low, selection.high) != (-np.inf, np.inf) and table == "sets":
        raise ValueError(f"--table sets: a row is a whole curve, not a part of {moving(dataset)}")
    columns, blocks = rows_of(dataset, table, variables, limited=selection.limited)
    titles = [printable(column.title) for column in columns]
    return _rows(titles, blocks)


def _rows(titles: list[str], blocks: Iterator[list[np.ndarray]]) -> Iterator[Row]:
    yield titles
    for block in blocks:
        values = (
            np.where(np.isnan(column), np.array(None), column).tolist()
            if column.dtype.kind == "f"
            else _cells(column)
            for column in block
        )
        yield from zip(*values, strict=True)


def _cells(column: np.ndarray) -> list[Any]:
    """Values that are no real numbers, texts in one line."""
    cells = column.tolist()
    return [printable(cell) if isinstance(cell, str) else cell for cell in cells]


def write(lines: Iterator[Row], file: TextIO) -> int:
    """Write a table as comma-separated values and return its number of rows."""
    writer = csv.writer(file, lineterminator="\n")
    number = -1
    for line in lines:
        writer.writerow(line)
        number += 1
    return number
