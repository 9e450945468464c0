"""Labelled datasets from response curves, points and motions: the layout of an archive."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.model import PARAMETERS
from symhbm.numerics import Table, check
from symhbm.results.description import Description, records_of, records_of_problem
from symhbm.results.parts import PART
from symhbm.results.provenance import OF_STRUCTURE, DatasetParts, evaluated_by, with_provenance
from symhbm.results.request import Request
from symhbm.results.sweep import RESERVED, Sweep
from symhbm.results.tables import NO_VARIABLES, name_of
from symhbm.results.variables import (
    OF_UNFORCED,
    SLOPES,
    VARIABLES,
    Records,
    Variable,
    derivative,
    meaning,
)

_NO_SWEEP = Sweep({}, (), ())
_PREFIXES = ("minimum", "event", "multiplier")
"""Axes of curves of peaks and of motions that are prefixes of their variables."""


def describe(problem: HarmonicBalance, sweep: Sweep, request: Request) -> DatasetParts:
    """Parts of a dataset without results: the problem, the sweep and the request."""
    coordinates: dict[str, tuple] = {}
    if request.at is not None:
        about = _attributes(request.name, records_of_problem(problem) | _own(request))
        coordinates[request.name] = request.name, request.at, about
    if request.frequency is not None:
        coordinates["frequency"] = ((), request.frequency, _attributes("frequency"))
    if request.amplitude is not None:
        about = _attributes("amplitude", _own(request))
        coordinates["amplitude"] = ((), request.amplitude, about)
    return with_provenance({}, coordinates, problem, sweep, request)


def _own(request: Request) -> dict[str, Variable]:
    """Variables that mean something else where no force acts."""
    return OF_UNFORCED.get(request.unforced or "", {})


def recall(dataset: xr.Dataset, rebuilt: HarmonicBalance | None = None) -> tuple[Sweep, Request]:
    """The sweep and the request that a dataset was computed from.

    Of a ``rebuilt`` problem with its number of the degree of freedom that tells amplitudes: one
    that keeps some of a structure may number them anew.
    """
    description = Description(dataset)
    at = dataset[description.moving].values if description.on_grid else None
    values = {}
    for name in description.swept:
        value = dataset[name]
        of_result = [label for label in value.coords if label in RESERVED - {*value.dims}]
        values[name] = value.drop_vars(of_result)
    request = Request.of(description.request, at)
    if rebuilt is not None and request.dof is not None and OF_STRUCTURE in dataset.variables:
        kept = dataset[OF_STRUCTURE].values.tolist()
        if request.dof in kept:
            place, anew = kept.index(request.dof), rebuilt.model.kept
            request = replace(request, dof=place if anew is None else int(anew[place]))
    return Sweep.of(values), request


def without(dataset: xr.Dataset, names: Iterable[str]) -> str:
    """Text that names missing variables, and those of them that were computed and not kept."""
    lacking = list(names)
    by_keep = [name for name in lacking if name in Description(dataset).left_out]
    words = f"without {', '.join(lacking)}"
    if by_keep == lacking:
        return f"{words}, left out by keep="
    return f"{words}; {', '.join(by_keep)} left out by keep=" if by_keep else words


def check_dataset(name: str, value: object, unforced: bool = False) -> None:
    """Raise a TypeError that names the argument unless it is a dataset.

    ValueError for one of motions that no force drives, unless they are wanted, too.
    """
    value = check.instance(name, value, xr.Dataset, "an xarray Dataset")
    if not unforced:
        check_forced(name, value)


def check_forced(name: str, dataset: xr.Dataset) -> None:
    """Raise ValueError for a dataset of motions that no force drives."""
    kind = Description(dataset).unforced
    if kind is not None:
        raise ValueError(
            f"{name}: expected responses to a force, as of frf or follow, got those of a {kind}"
        )


def check_present(dataset: xr.Dataset, *names: str, container: str = "dataset") -> None:
    """Raise KeyError for the first variable a dataset does not hold, with the reason."""
    for name in names:
        if name in Description(dataset).left_out and name not in dataset.variables:
            raise KeyError(f"{name!r} was left out by keep=; compute with keep=[..., {name!r}]")
        check.known(name, [str(held) for held in dataset.variables], f"variable of the {container}")


def differences(first: xr.Dataset, second: xr.Dataset) -> list[str]:
    """Names of the settings and inputs in which two computations differ."""
    settings, others = (
        {n: told for n, told in Description(dataset).problem.items() if n != "digest"}
        # Results with an accuracy have more harmonics; those given are with the request.
        | Description(dataset).request
        | {name: dataset.attrs.get(name) for name in ("symhbm_schema", "swept", PART)}
        for dataset in (first, second)
    )
    names = [name for name in settings | others if settings.get(name) != others.get(name)]
    inputs, other_inputs = (
        {str(name) for name in dataset.variables} - {"harmonic", *_results(dataset)}
        for dataset in (first, second)
    )
    names += sorted(inputs ^ other_inputs)
    names += [
        name
        for name in sorted(inputs & other_inputs)
        if not first[name].variable.equals(second[name].variable)
    ]
    return list(dict.fromkeys(names))


def _results(dataset: xr.Dataset) -> list[str]:
    """Names of the results in a dataset."""
    description = Description(dataset)
    moving, on_grid = description.moving, description.on_grid
    inputs = {"frequency"} if moving != "frequency" or on_grid else set()
    if description.unforced is not None:
        inputs = {moving} if on_grid else set()
    of_laws = [name for name, of in description.records.items() if isinstance(of, Variable)]
    results = [name for name in (*VARIABLES, *of_laws) if name not in inputs]
    of_moving = [f"{prefix}_{moving}" for prefix in ("event", "peak", "fold")]
    own = [f"event_{name}" for name in OF_UNFORCED.get(description.unforced or "", ())]
    return [*results, *of_moving, *own, *([] if on_grid else [moving])]


def label(call: DatasetParts, sweep: Sweep, request: Request, results: Table) -> xr.Dataset:
    """Dataset of response curves, stacked one per parameter set, from the parts of `describe`.

    The moving parameter is a coordinate: along ``point``, or a dimension of its own on a grid.
    """
    along = "point" if request.at is None else request.name
    problem, attributes = json.loads(call.attributes["problem"]), call.attributes
    records = records_of(problem) | _own(request)
    slope = {"units": derivative("amplitude", request.name, records).units}
    variables: dict[str, tuple] = {}
    for key, stacked in results.items():
        name = name_of(key, request)
        if key in NO_VARIABLES or (key == "value" and request.at is not None):
            continue
        prefix = key.partition("_")[0]
        axis = prefix if prefix in ("peak", "event") else along
        inner, about = meaning(name, records).inner, _attributes(name, records)
        if name in SLOPES:
            about |= slope
        axes = (axis, "solution")[: stacked.ndim - 1 - len(inner)]
        values = stacked.reshape(sweep.shape + stacked.shape[1:])
        variables[name] = (*sweep.dims, *axes, *inner), values, about
    harmonics = max(results["harmonics"], key=lambda row: row.max()).tolist()
    if harmonics != problem["harmonics"]:
        attributes = attributes | {"problem": json.dumps(problem | {"harmonics": harmonics})}
    attributes = attributes | evaluated_by(results.get("by_machine_code", ()))
    coordinates = dict(call.coordinates)
    if request.at is None:
        coordinates[request.name] = variables.pop(request.name)
    assert call.sizes is not None
    sizes = *call.sizes[:2], tuple(harmonics)
    return DatasetParts(variables | call.variables, coordinates, attributes, sizes).dataset()


def label_point(
    problem: HarmonicBalance,
    frequency: float,
    point: Table,
    status: str,
    accuracy: float | None = None,
    harmonics: tuple[int, ...] | None = None,
) -> xr.Dataset:
    """Dataset of one point, or of one motion along ``angle``; ``frequency`` in Hz.

    ``harmonics`` are those of the coefficients, by default those of the problem.
    """
    variables = _of_one_set(point, status, "angle", records_of_problem(problem))
    coordinates = {"frequency": ((), frequency, _attributes("frequency"))}
    if "angle" in variables:
        coordinates["angle"] = variables.pop("angle")
    parts = with_provenance(variables, coordinates, problem, _NO_SWEEP, harmonics=harmonics)
    if accuracy is not None:
        parts.attributes["accuracy"] = accuracy
    return parts.dataset()


def label_static(problem: HarmonicBalance, states: Table, status: str) -> xr.Dataset:
    """Dataset of states of rest, along ``solution``."""
    variables = _of_one_set(states, status, "solution", records_of_problem(problem))
    return with_provenance(variables, {}, problem, _NO_SWEEP).dataset()


def label_over_parameter(
    name: str,
    problem: HarmonicBalance,
    request: Request,
    results: Table,
    status: str,
    bands: Sequence[tuple[float, float]] | None = None,
    disturbances: Sequence[float] | None = None,
) -> xr.Dataset:
    """Dataset of what has a ``name`` and a slope over a parameter, ``request.at`` its values.

    Peaks, of ``bands`` in Hz, or flutter limits, of ``disturbances`` [m].
    """
    records = records_of_problem(problem)
    variables = _of_one_set(results, status, request.name, records)
    units, own = problem.records[request.name].units, variables[name][2]["units"]
    attributes = variables[f"{name}_slope"][2]
    attributes["units"] = own if units == "1" else f"{own}/({units})"
    about = _attributes(request.name, records)
    coordinates = {request.name: (request.name, request.at, about)}
    if disturbances is not None:
        about = _attributes("disturbance")
        coordinates["disturbance"] = "disturbance", np.array(disturbances), about
    parts = with_provenance(variables, coordinates, problem, _NO_SWEEP, request)
    if bands is not None:
        followed = json.loads(parts.attributes["followed"]) | {"frequency_bands": list(bands)}
        parts.attributes["followed"] = json.dumps(followed)
    return parts.dataset()


def _of_one_set(results: Table, status: str, axis: str, records: Records) -> dict[str, tuple]:
    """(dims, values, attributes) of the results of one parameter set, its status among them.

    What has one dimension more than its meaning is along the axis that its prefix tells, else
    along ``axis``.
    """
    variables = {}
    for name, value in (results | {"status": np.array(status, dtype=object)}).items():
        prefix, inner = name.split("_")[0], meaning(name, records).inner
        along = (prefix if prefix in _PREFIXES else axis,)
        dims = along * (np.ndim(value) - len(inner)) + inner
        variables[name] = dims, np.asarray(value), _attributes(name, records)
    return variables


def _attributes(name: str, records: Records = PARAMETERS) -> dict[str, Any]:
    return meaning(name, records).about
