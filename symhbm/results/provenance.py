"""What all datasets have: variables, places, and the problem behind them with its record."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.metadata import version
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from xarray.indexes import PandasIndex

from symhbm.balance import HarmonicBalance
from symhbm.model import Places, Structure
from symhbm.model.cyclic import speed_order
from symhbm.model.excitation import motions_of_base
from symhbm.results.description import check_names
from symhbm.results.problem import NUMBERS, record_of
from symhbm.results.request import Request
from symhbm.results.sweep import Sweep
from symhbm.results.variables import VARIABLES

DRAWN = "drawn"
"""Attribute of a swept parameter that tells how its values were drawn."""
LABELS = ("dof", "contact", "harmonic", "component")
OF_STRUCTURE = "structure_dof"
"""Coordinate of condensed structures: which degrees of freedom are kept."""
LARGEST_OF = "largest_of"
"""Attribute of datasets of condensed structures: the degrees of freedom that maxima are of."""
SPEED_ORDER = "speed_order"
"""Attribute of datasets of what changes with the speed of rotation: frequencies over it."""
SPEEDS = ("speed", "peak_speed", "event_speed", "branch_speed")
OF_LARGEST = {"peak_amplitude", "peak_dof"}
"""Variables that depend on the degrees of freedom kept."""
Sizes = tuple[int, int, tuple[int, ...]]


@dataclass
class DatasetParts:
    """Variables, coordinates and attributes of a dataset, which is slow to make one by one.

    ``variables`` and ``coordinates`` are (dims, values, attributes) or ready-made, by name;
    ``sizes``, the numbers of degrees of freedom and of contacts and the harmonics, where they have
    labels.
    """

    variables: dict[str, Any]
    coordinates: dict[str, Any]
    attributes: dict[str, Any]
    sizes: Sizes | None = None

    @classmethod
    def of(cls, dataset: xr.Dataset) -> "DatasetParts":
        """The parts of a dataset with labels."""
        whole = dataset.variables
        variables = {str(name): whole[name] for name in dataset.data_vars}
        coordinates = {str(name): whole[name] for name in dataset.coords if name not in LABELS}
        sizes = dataset.sizes["dof"], dataset.sizes["contact"], tuple(whole["harmonic"].values)
        return cls(variables, coordinates, dict(dataset.attrs), sizes)

    def dataset(self) -> xr.Dataset:
        """The dataset."""
        parts = self.variables | self.coordinates
        variables = {name: variable_of(part) for name, part in parts.items()}
        labels = xr.Coordinates() if self.sizes is None else _labels(*self.sizes)
        coordinates = [*self.coordinates]
        if SPEED_ORDER in self.attributes:
            speeds = _speeds(variables, speed_orders(variables, self.attributes))
            variables, coordinates = variables | speeds, [*coordinates, *speeds]
        if LARGEST_OF in self.attributes:
            for name in OF_LARGEST & {*variables}:
                variables[name] = _of_kept(variables[name], self.attributes[LARGEST_OF])
        own = {name: variables.pop(name) for name in dict.fromkeys(coordinates)}
        indices = {**labels.xindexes, **_indices(own)}
        whole = xr.Coordinates({**labels.variables, **own}, indices)
        return xr.Dataset(variables, whole, self.attributes)


def speed_orders(variables: Mapping[Any, Any], attributes: Mapping[str, Any]) -> xr.Variable:
    """The frequency over the speed of rotation, one or one per parameter set, NaN where none is."""
    order = xr.Variable((), attributes.get(SPEED_ORDER, np.nan))
    if (nominal := variables.get("engine_order_nominal")) is None:
        return order
    return abs(order * variables["engine_order"] / nominal)


def _speeds(variables: dict[str, Any], orders: xr.Variable) -> dict[str, Any]:
    """The speed of rotation [1/min] beside each frequency, along engine orders."""
    result = {}
    for name in SPEEDS:
        frequency = variables.get(name.replace("speed", "frequency"))
        if frequency is not None:
            speed = 60 / orders * frequency
            dims = (*(dim for dim in orders.dims if dim not in frequency.dims), *frequency.dims)
            result[name] = xr.Variable(dims, speed.transpose(*dims).values, VARIABLES[name].about)
    return result


def _of_kept(variable: Any, kept: str) -> Any:
    """A variable whose long name names the degrees of freedom it was computed from."""
    long_name = str(variable.attrs["long_name"])
    changed = variable.copy(deep=False)
    changed.attrs["long_name"] = long_name if kept in long_name else f"{long_name}, of the {kept}"
    return changed


def variable_of(part: Any) -> Any:
    """A part as an xarray variable, made without xarray's slow search for array packages."""
    if isinstance(part, xr.Variable):
        return part.copy(deep=False)
    dims, values, attributes = part
    return xr.Variable(dims, np.asarray(values), attributes, fastpath=True)


@lru_cache(maxsize=64)
def _labels(n_dof: int, n_contacts: int, harmonics: tuple[int, ...]) -> xr.Coordinates:
    """Coordinates that many datasets share: their indices are slow to make."""
    words = "harmonic of the excitation frequency"
    component = np.array(["cos", "sin"], dtype=object)
    parts: dict[str, tuple] = {
        "dof": ("dof", np.arange(n_dof), _about("degree of freedom")),
        "contact": ("contact", np.arange(n_contacts), _about("contact")),
        "harmonic": ("harmonic", np.array(harmonics), _about(words)),
        "component": ("component", component, {"long_name": "component of the harmonic"}),
    }
    variables = {name: variable_of(part) for name, part in parts.items()}
    return xr.Coordinates(variables, _indices(variables))


def _indices(variables: Mapping[str, xr.Variable]) -> dict[str, PandasIndex]:
    """Indices of the variables that label a dimension.

    Where xarray makes them from arrays it imports dask if there is any.
    """
    labels = {name: of.values for name, of in variables.items() if of.dims == (name,)}
    return {
        name: PandasIndex(pd.Index(values, dtype=values.dtype), name, values.dtype)
        for name, values in labels.items()
    }


_AXES = ("x", "y", "z")


def of_places(model: Structure) -> dict[str, tuple]:
    """Coordinates (dims, values, attributes) of a structure with places, none of one without."""
    places = model.places
    if places is None:
        return {}
    texts = {"direction": "direction of the degree of freedom", "label": "name of the node"}
    parts: dict[str, tuple] = {"node": ("dof", places.node, _about("number of the node"))}
    for name, long_name in texts.items():
        parts[name] = "dof", getattr(places, name).astype(object), {"long_name": long_name}
    if places.coordinates is not None:
        for owner, values in (("dof", places.coordinates), ("contact", model.contact_coordinates)):
            what = "degree of freedom" if owner == "dof" else owner
            for axis, column in zip(_AXES, values.T, strict=True):
                about = _about(f"coordinate {axis} of the {what}", "m")
                parts[f"{owner}_{axis}"] = owner, column, about
    return parts


def places_of(dataset: xr.Dataset) -> Places | None:
    """The places of the degrees of freedom of a dataset, None without."""
    if "node" not in dataset.coords:
        return None
    columns = [f"dof_{axis}" for axis in _AXES]
    known = all(name in dataset.coords for name in columns)
    coordinates = np.column_stack([dataset[name] for name in columns]) if known else None
    direction, label = (dataset[name].values.astype(str) for name in ("direction", "label"))
    return Places(dataset["node"].values, direction, coordinates, label)


def _about(long_name: str, units: str = "1") -> dict[str, Any]:
    return {"long_name": long_name, "units": units}


SCHEMA_VERSION = 1
REFERENCE = (
    "E. Chatelet, D. Rade, G. Jacquet-Richardet, Dynamic Behavior of Cyclic Symmetrical N DOF "
    "System in the Presence of Dry Friction, DINAME 2013, hal-00941429"
)
DISPLACEMENTS = "displacements"
"""Attribute of datasets of what a moving base drives: which displacements they hold."""
SEEN = {"relative": "relative to the moving base", "absolute": "absolute"}
EVALUATED_BY = "equations_evaluated_by"
"""Attribute of curves that tells what evaluates the equations, to the same bits."""
_EVALUATORS = {1: "machine code", 0: "the virtual machine of CasADi"}
LEFT_OUT = "force_left_out"
"""Attribute of motions that no force drives, of a problem with one."""


def _searched(request: Request) -> str:
    """Where limit cycles were looked for, and where not."""
    assert request.amplitudes is not None
    assert request.mode is not None
    modes = ", ".join(map(str, np.atleast_1d(request.mode)))
    low, high = request.amplitudes
    wave = "" if request.nodal_diameter is None else f" of {request.nodal_diameter} nodal diameters"
    at = "" if request.name == "amplitude" else (
        f"; at both ends and in the middle of the band of {request.name} and at its nominal value, "
        "where none is found there between them, and along the branches found"
    )  # fmt: skip
    return (
        f"modes {modes}{wave}, for amplitudes of {low:g} to {high:g} m of the first harmonic at "
        f"degree of freedom {request.dof}, where the damping ratio of the nonlinear mode is 0{at}; "
        "motions that lie on no such mode, and motions of several frequencies, were not looked for"
    )


def with_provenance(
    variables: dict[str, Any],
    coordinates: dict[str, Any],
    problem: HarmonicBalance,
    sweep: Sweep,
    request: Request | None = None,
    harmonics: tuple[int, ...] | None = None,
) -> DatasetParts:
    """Variables and coordinates with the parameters, the problem and the versions behind them.

    ``harmonics`` are those of the coefficients, by default those of the problem.

    Raises ValueError for parameters of contacts that are called as results are.
    """
    check_names(problem)
    variables, coordinates = dict(variables), dict(coordinates)
    for name, value in problem.parameters.items():
        about = problem.records[name]
        attributes = _about(about.meaning, about.units)
        dims = () if np.ndim(value) == 0 else problem.model.dims_of(name)
        if name in sweep.values:
            swept = sweep.values[name]
            drawn = {DRAWN: swept.attrs[DRAWN]} if DRAWN in swept.attrs else {}
            target = coordinates if swept.dims == (name,) else variables
            target[name] = (swept.dims, swept.values, attributes | drawn)
            for label, coordinate in swept.coords.items():
                if label not in (name, *LABELS, *coordinates):
                    labelled = coordinate.assign_attrs(_about(str(label)) | coordinate.attrs)
                    coordinates[str(label)] = (
                        labelled.variable
                    )  # its own coordinate has no attributes
        nominal = name in sweep.values or (request and name == request.name)
        if nominal:
            attributes = _about(f"{about.meaning}, nominal value", about.units)
        stored_name = f"{name}_nominal" if nominal else name
        variables[stored_name] = (dims, np.array(value), attributes)
    coordinates |= of_places(problem.model)
    if problem.model.kept is not None:
        attributes = _about("degree of freedom of the whole structure")
        coordinates[OF_STRUCTURE] = ("dof", problem.model.kept, attributes)
    told, numbers = record_of(problem)
    attributes = _about("numbers of structure and excitation, as the problem lays them out")
    variables[NUMBERS] = (f"{NUMBERS}_entry",), numbers, attributes
    global_attributes = {
        "title": "Forced response of a structure with dry friction by multi-harmonic balance",
        "references": REFERENCE,
        "symhbm_schema": SCHEMA_VERSION,
        "symhbm_version": _version("symhbm"),
        "casadi_version": _version("casadi"),
        "problem": json.dumps(told),
        "swept": json.dumps(list(sweep.values)),
    }
    if request and request.unforced is not None:
        kind = request.unforced.capitalize()
        global_attributes["title"] = f"{kind} of a structure by multi-harmonic balance"
        if request.unforced == "limit cycle":
            global_attributes["searched"] = _searched(request)
        if problem.excitation.amplitude:
            global_attributes[LEFT_OUT] = "what of the force oscillates; static loads act"
    if request:
        global_attributes |= evaluated_by([request.machine_code])
        global_attributes["followed"] = json.dumps(request.to_json(problem.harmonics))
        if request.accuracy is not None:
            global_attributes["accuracy"] = request.accuracy
    model = problem.model
    for motion in motions_of_base(problem.excitation):
        global_attributes[DISPLACEMENTS] = SEEN[motion]
    if (order := speed_order(model)) is not None:
        global_attributes[SPEED_ORDER] = order
    if model.kept is not None:
        between = int(np.count_nonzero(model.kept >= model.n_whole))
        told = f"{model.n_dof - between} degrees of freedom kept of {model.n_whole}"
        beside = f" and {between} displacements of contacts" if between else ""
        global_attributes[LARGEST_OF] = told + beside
    sizes = model.n_dof, model.n_contacts, harmonics or problem.harmonics
    return DatasetParts(variables, coordinates, global_attributes, sizes)


def evaluated_by(by_machine_code: Iterable[int]) -> dict[str, str]:
    """The attribute that says whether machine code evaluated curves: 1, 0 without, -1 for none.

    It may be both, as workers on other machines may have no compiler. Empty for no curves.
    """
    found = {int(each) for each in by_machine_code}
    by = [text for state, text in _EVALUATORS.items() if state in found]
    return {EVALUATED_BY: " and ".join(by)} if by else {}


def states_of(dataset: xr.Dataset) -> list[int]:
    """What evaluated some of its curves, as `evaluated_by` takes it."""
    told = dataset.attrs.get(EVALUATED_BY, "").split(" and ")
    return [state for state, text in _EVALUATORS.items() if text in told]


_version = cache(version)
