"""Labelled datasets from response curves: the names and dimensions of an archive."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import fields
from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.model import PARAMETERS
from symhbm.numerics import Table, check
from symhbm.results.description import Description
from symhbm.results.provenance import Parts, with_provenance
from symhbm.results.request import Request
from symhbm.results.sweep import RESERVED, Sweep
from symhbm.results.tables import name_of
from symhbm.results.variables import SLOPES, VARIABLES, derivative, meaning


def describe(problem: HarmonicBalance, sweep: Sweep, task: Request) -> Parts:
    """Everything but results: what is computed, of what."""
    coordinates: dict[str, tuple] = {}
    if task.at is not None:
        coordinates[task.name] = (task.name, task.at, _attributes(task.name))
    if task.frequency is not None:
        coordinates["frequency"] = ((), task.frequency, _attributes("frequency"))
    return with_provenance({}, coordinates, problem, sweep, task)


def recall(dataset: xr.Dataset) -> tuple[Sweep, Request]:
    """What a dataset says is computed."""
    followed = Description(dataset).request
    task: dict[str, Any] = {
        field.name: followed[field.name] for field in fields(Request) if field.name in followed
    }
    for name in ("band", "keep"):
        task[name] = None if task[name] is None else tuple(task[name])
    task["at"] = dataset[followed["name"]].values if followed["grid"] else None
    values = {}
    for name in Description(dataset).swept:
        value = dataset[name]
        of_result = [label for label in value.coords if label in RESERVED - {*value.dims}]
        values[name] = value.drop_vars(of_result)
    return Sweep.of(values), Request(**task)


def left_out(dataset: xr.Dataset) -> list[str]:
    """Names of results that were computed and not kept."""
    return Description(dataset).left_out


def without(dataset: xr.Dataset, names: Iterable[str]) -> str:
    """Words on what a dataset does not hold, and which of it was computed and not kept."""
    lacking = list(names)
    by_keep = [name for name in lacking if name in left_out(dataset)]
    words = f"without {', '.join(lacking)}"
    if by_keep == lacking:
        return f"{words}, left out by keep="
    return f"{words}; {', '.join(by_keep)} left out by keep=" if by_keep else words


def check_held(dataset: xr.Dataset, *names: str, what: str = "dataset") -> None:
    """Raise KeyError that says why for the first variable a dataset does not hold."""
    for name in names:
        if name in left_out(dataset) and name not in dataset.variables:
            raise KeyError(f"{name!r} was left out by keep=; compute with keep=[..., {name!r}]")
        check.known(name, [str(each) for each in dataset.variables], f"variable of the {what}")


def differences(one: xr.Dataset, other: xr.Dataset) -> list[str]:
    """What tells two computations apart, by name."""
    about, there = (
        Description(dataset).problem
        # The harmonics of an accuracy come with the results; those given are with the request.
        | Description(dataset).request
        | {name: dataset.attrs[name] for name in ("symhbm_schema", "swept")}
        for dataset in (one, other)
    )
    found = [name for name in about | there if about.get(name) != there.get(name)]
    mine, theirs = (
        {str(name) for name in dataset.variables} - {"harmonic", *_results(dataset)}
        for dataset in (one, other)
    )
    found += sorted(mine ^ theirs)
    found += [
        name
        for name in sorted(mine & theirs)
        if not one[name].variable.equals(other[name].variable)
    ]
    return list(dict.fromkeys(found))


def _results(dataset: xr.Dataset) -> list[str]:
    """Names of the results in a dataset."""
    followed = Description(dataset).request
    moving = followed["name"]
    given = {"frequency"} if moving != "frequency" or followed["grid"] else set()
    found = [name for name in VARIABLES if name not in given]
    return [*found, f"event_{moving}", f"peak_{moving}", *([] if followed["grid"] else [moving])]


def label(call: Parts, sweep: Sweep, task: Request, results: Table) -> xr.Dataset:
    """Dataset of response curves, stacked one per parameter set, of what `describe` gives.

    The moving parameter is a coordinate: along ``point``, or a dimension of its own on a grid.
    """
    along = "point" if task.at is None else task.name
    variables: dict[str, tuple] = {}
    for key, stacked in results.items():
        name = name_of(key, task)
        if key == "harmonics" or (key == "value" and task.at is not None):
            continue
        axis = next((axis for axis in ("peak", "event") if key.startswith(f"{axis}_")), along)
        n_axes = stacked.ndim - 1 - len(meaning(name).inner)
        variables[name] = _variable(name, sweep, stacked, (axis, "solution")[:n_axes])
        if name in SLOPES:
            dims, values, about = variables[name]
            about = about | {"units": derivative("amplitude", task.name).units}
            variables[name] = dims, values, about
    harmonics = max(results["harmonics"], key=lambda row: row.max()).tolist()
    problem = json.loads(call.attributes["problem"]) | {"harmonics": harmonics}
    coordinates = dict(call.coordinates)
    if task.at is None:
        coordinates[task.name] = variables.pop(task.name)
    assert call.sizes is not None
    sizes = *call.sizes[:2], tuple(harmonics)
    attributes = call.attributes | {"problem": json.dumps(problem)}
    return Parts(variables | call.variables, coordinates, attributes, sizes).dataset()


def label_point(
    problem: HarmonicBalance,
    frequency: float,
    point: Table,
    status: str,
    accuracy: float | None = None,
) -> xr.Dataset:
    """Dataset of one point; ``frequency`` in Hz."""
    nothing = Sweep({}, (), ())
    variables = {name: _variable(name, nothing, value[None]) for name, value in point.items()}
    variables["status"] = _variable("status", nothing, np.array([status], dtype=object))
    coordinates = {"frequency": ((), frequency, _attributes("frequency"))}
    parts = with_provenance(variables, coordinates, problem, nothing)
    if accuracy is not None:
        parts.attributes["accuracy"] = accuracy
    return parts.dataset()


_CURVE_AXES = ("minimum", "event")


def label_peak_curve(
    problem: HarmonicBalance,
    task: Request,
    bands: Sequence[tuple[float, float]],
    results: Table,
    status: str,
) -> xr.Dataset:
    """Dataset of the largest peak over a parameter, ``task.at`` its values; ``bands`` in Hz.

    Names of ``results`` tell whether they go along the parameter, the minima or the events.
    """
    nothing = Sweep({}, (), ())
    variables: dict[str, tuple] = {}
    for name, value in results.items():
        prefix = name.split("_")[0]
        along = prefix if prefix in _CURVE_AXES else task.name
        axes = () if np.ndim(value) == 0 else (along,)
        variables[name] = _variable(name, nothing, np.asarray(value)[None], axes)
    units = PARAMETERS[task.name].units
    dims, values, about = variables["peak_amplitude_slope"]
    about = about | {"units": "m" if units == "1" else f"m/({units})"}
    variables["peak_amplitude_slope"] = dims, values, about
    variables["status"] = _variable("status", nothing, np.array([status], dtype=object))
    coordinates = {task.name: (task.name, task.at, _attributes(task.name))}
    parts = with_provenance(variables, coordinates, problem, nothing, task)
    followed = json.loads(parts.attributes["followed"]) | {"frequency_bands": list(bands)}
    parts.attributes["followed"] = json.dumps(followed)
    return parts.dataset()


_MOTION_AXES = {
    "angle": "angle",
    "displacement": "angle",
    "velocity": "angle",
    "friction_force": "angle",
    "event_angle": "event",
    "event_kind": "event",
    "event_contact": "event",
    "multiplier_real": "multiplier",
    "multiplier_imag": "multiplier",
}


def label_motion(
    problem: HarmonicBalance,
    frequency: float,
    motion: Table,
    harmonics: tuple[int, ...],
    status: str,
) -> xr.Dataset:
    """Dataset of one motion over its period; ``frequency`` in Hz, coefficients by ``harmonics``."""
    nothing = Sweep({}, (), ())
    variables = {
        name: _variable(
            name, nothing, value[None], (_MOTION_AXES[name],) if name in _MOTION_AXES else ()
        )
        for name, value in motion.items()
    }
    variables["status"] = _variable("status", nothing, np.array([status], dtype=object))
    coordinates = {"frequency": ((), frequency, _attributes("frequency"))}
    coordinates["angle"] = variables.pop("angle")
    parts = with_provenance(variables, coordinates, problem, nothing, harmonics=harmonics)
    return parts.dataset()


def _variable(name: str, sweep: Sweep, values: np.ndarray, axes: tuple[str, ...] = ()) -> tuple:
    """(dims, data, attributes) of a variable whose first axis runs over the parameter sets."""
    data = values.reshape(sweep.shape + values.shape[1:])
    return (*sweep.dims, *axes, *meaning(name).inner), data, _attributes(name)


@lru_cache(maxsize=512)
def _attributes(name: str) -> dict[str, Any]:
    about = meaning(name)
    return {"units": about.units, "long_name": about.long_name, **about.attributes}
