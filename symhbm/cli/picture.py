"""Figures of selected parts of a dataset, by kind."""

import inspect
import os
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import xarray as xr

import symhbm as sh
from symhbm.cli.selection import select
from symhbm.model.contacts import ContactLaw
from symhbm.results import Description
from symhbm.results.reading import COMPLETE, INNER, SAMPLE, set_dimensions

_FIRST = (
    *("response", "envelope", "disk", "blades", "nonlinear-modes", "limit-cycles"),
    "flutter-limit",
    "pareto-front",
    *("hysteresis", "normal-force", "states", "stick-map", "contact-map", "model", "phase"),
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
    dataset: xr.Dataset,
    kind: str | None,
    choices: Sequence[str],
    options: dict[str, Any],
    laws: Sequence[ContactLaw] = (),
) -> tuple[str, Any]:
    """Kind and figure of the selected part; by default the kind that suits it.

    ``options`` go to the function that draws. Raises ValueError for an option it does not take.
    """
    selection = select(dataset, choices)
    part = selection.limited(selection.dataset)
    names = {choice.partition("=")[0].strip() for choice in choices} - {*INNER}
    part = part.squeeze([dim for dim in part.dims if dim in names and part.sizes[dim] == 1])
    kind = kind or _natural_kind(part)
    function = getattr(_plot(), kind.replace("-", "_"))
    for name, value in options.items():
        if name not in inspect.signature(function).parameters:
            raise ValueError(f"--{name} {value}: {kind} shows no single {name}")
    if kind == "model":
        return kind, _structure(part, laws)
    return kind, function(_by_blade(part) if kind == "blades" else part, **options)


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


def _by_blade(dataset: xr.Dataset) -> xr.DataArray:
    """Largest displacement of each blade over all points [m], NaN where a curve is incomplete."""
    amplitude = dataset["amplitude"]
    kept = {*set_dimensions(dataset), "dof"}
    largest = amplitude.max([dim for dim in amplitude.dims if dim not in kept])
    complete = dataset["status"].isin([*map(str, COMPLETE)])
    if not largest.where(complete).notnull().any():
        raise _plot().nothing_to_draw(dataset)
    attributes = {"long_name": "largest displacement of all points", "units": "m"}
    return largest.where(complete).assign_attrs(attributes)
