"""Labelled datasets from response curves, with the problem they came from, and back."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

import numpy as np
import scipy.sparse as sp
import xarray as xr

import symhbm.excitation as excitations
from symhbm.branch import Branch
from symhbm.model import BLADE_PARAMETERS, CONTACT_PARAMETERS, Model
from symhbm.names import PARAMETERS, VARIABLES
from symhbm.residual import HarmonicBalance
from symhbm.sweep import Sweep

SCHEMA_VERSION = 1
REFERENCE = (
    "E. Chatelet, D. Rade, G. Jacquet-Richardet, Dynamic Behavior of Cyclic Symmetrical N DOF "
    "System in the Presence of Dry Friction, DINAME 2013, hal-00941429"
)
MATRICES = ("mass_matrix", "damping_matrix", "stiffness_matrix")


def label(
    problem: HarmonicBalance, sweep: Sweep, branches: Sequence[Branch], along: str
) -> xr.Dataset:
    """Dataset of response curves, one per parameter set; ``along`` is point or frequency."""
    variables: dict[str, tuple] = {}
    for table, axis in (("points", along), ("peaks", "peak"), ("events", "event")):
        for name in getattr(branches[0], table):
            stacked = _stack([getattr(branch, table)[name] for branch in branches])
            variables[name] = _variable(name, sweep, stacked, (axis,))
    for name in branches[0].counts:
        variables[name] = _variable(name, sweep, np.array([b.counts[name] for b in branches]))
    status = np.array([b.status for b in branches], dtype=object)
    variables["status"] = _variable("status", sweep, status)
    if along == "frequency":
        grid = branches[0].points["frequency"]
        variables["frequency"] = ("frequency", grid, variables["frequency"][2])
    coordinates = _coordinates(problem) | {"frequency": variables.pop("frequency")}
    return _with_provenance(xr.Dataset(variables, coordinates), problem, sweep)


def label_point(problem: HarmonicBalance, point: dict[str, np.ndarray], status: str) -> xr.Dataset:
    """Dataset of one point."""
    nothing = Sweep({}, (), ())
    variables = {name: _variable(name, nothing, value[None]) for name, value in point.items()}
    variables["status"] = _variable("status", nothing, np.array([status], dtype=object))
    coordinates = _coordinates(problem) | {"frequency": variables.pop("frequency")}
    return _with_provenance(xr.Dataset(variables, coordinates), problem, nothing)


def _variable(name: str, sweep: Sweep, values: np.ndarray, axis: tuple[str, ...] = ()) -> tuple:
    """(dims, data, attributes) of a variable whose first axis runs over the parameter sets."""
    meaning = VARIABLES[name]
    data = values.reshape(sweep.shape + values.shape[1:])
    attributes = {"units": meaning.units, "long_name": meaning.long_name, **meaning.attributes}
    return (*sweep.dims, *axis, *meaning.inner), data, attributes


def _stack(arrays: list[np.ndarray]) -> np.ndarray:
    """Stack ragged arrays, padded at the end with NaN, -1, False or an empty string."""
    kind = arrays[0].dtype.kind
    fill: Any = {"f": np.nan, "i": -1, "b": False, "O": ""}[kind]
    length = max(len(array) for array in arrays)
    result = np.full((len(arrays), length, *arrays[0].shape[1:]), fill, dtype=arrays[0].dtype)
    for row, array in zip(result, arrays, strict=True):
        row[: len(array)] = array
    return result


def _coordinates(problem: HarmonicBalance) -> dict[str, tuple]:
    model = problem.model
    return {
        "dof": ("dof", np.arange(model.n_dof), {"long_name": "degree of freedom", "units": "1"}),
        "contact": ("contact", np.arange(model.n_contacts), {"long_name": "contact", "units": "1"}),
        "harmonic": (
            "harmonic",
            np.array(problem.harmonics),
            {"long_name": "harmonic of the excitation frequency", "units": "1"},
        ),
        "component": (
            "component",
            np.array(["cos", "sin"], dtype=object),
            {"long_name": "component of the harmonic"},
        ),
    }


def _with_provenance(dataset: xr.Dataset, problem: HarmonicBalance, sweep: Sweep) -> xr.Dataset:
    for name, value in problem.parameters.items():
        units, long_name = PARAMETERS[name]
        attributes = {"units": units, "long_name": long_name}
        dims = () if np.ndim(value) == 0 else _parameter_dims(name)
        target = name
        if name in sweep.values:
            swept = sweep.values[name]
            dataset[name] = (swept.dims, swept.values, attributes)
            for label, coordinate in swept.coords.items():
                if label not in (name, *dataset.coords):
                    about = {"long_name": str(label), "units": "1"} | coordinate.attrs
                    dataset = dataset.assign_coords({label: coordinate.assign_attrs(about)})
            target = f"{name}_nominal"
            attributes = attributes | {"long_name": f"{long_name}, nominal value"}
        dataset[target] = (dims, np.array(value), attributes)
    if not problem.model.lumped:
        for name in MATRICES:
            dataset = dataset.assign(_sparse(name, getattr(problem.model, name)))
    dataset.attrs = {
        "title": "Forced response of a structure with dry friction by multi-harmonic balance",
        "references": REFERENCE,
        "symhbm_schema": SCHEMA_VERSION,
        "symhbm_version": version("symhbm"),
        "casadi_version": version("casadi"),
        "problem": json.dumps(_description(problem)),
        "swept": json.dumps(list(sweep.values)),
    }
    return dataset


def _parameter_dims(name: str) -> tuple[str, ...]:
    if name in BLADE_PARAMETERS:
        return ("dof",)
    return ("contact",) if name in CONTACT_PARAMETERS else ()


def _sparse(name: str, matrix: Any) -> dict[str, tuple]:
    columns = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
    entry = (f"{name}_entry",)
    units = PARAMETERS[name.removesuffix("_matrix")][0]
    about = name.replace("_", " ")
    return {
        f"{name}_row": (
            entry,
            matrix.indices.astype(np.int64),
            {"long_name": f"{about}, row", "units": "1"},
        ),
        f"{name}_column": (entry, columns, {"long_name": f"{about}, column", "units": "1"}),
        f"{name}_value": (
            entry,
            matrix.data,
            {"long_name": f"{about}, stored entries", "units": units},
        ),
    }


def _description(problem: HarmonicBalance) -> dict[str, Any]:
    excitation = problem.excitation
    return {
        "harmonics": list(problem.harmonics),
        "n_dof": problem.model.n_dof,
        "contacts": [list(dofs) for dofs in problem.model.contacts],
        "lumped": problem.model.lumped,
        "excitation": {"type": type(excitation).__name__, **asdict(excitation)},  # type: ignore
    }


def describe_problem(dataset: xr.Dataset) -> HarmonicBalance:
    """Build the problem that a dataset describes.

    A swept parameter has its nominal value, unless the dataset was reduced to one of its values.
    """
    description = json.loads(dataset.attrs["problem"])
    excitation = dict(description["excitation"])
    kind = getattr(excitations, excitation.pop("type"))
    for name in ("cosine", "sine"):
        if name in excitation:
            excitation[name] = {int(n): row for n, row in excitation[name].items()}
    swept = json.loads(dataset.attrs["swept"])
    nominal = {name: _nominal(dataset, name, swept) for name in CONTACT_PARAMETERS}
    if description["lumped"]:
        nominal |= {name: _nominal(dataset, name, swept) for name in BLADE_PARAMETERS}
        matrices = [_identity(description["n_dof"])] * 3
    else:
        matrices = [_matrix(dataset, name, description["n_dof"]) for name in MATRICES]
    model = Model(*matrices, contacts=description["contacts"], lumped=description["lumped"])
    problem = HarmonicBalance(
        model.with_parameters(**nominal), kind(**excitation), description["harmonics"]
    )
    chosen = {
        name: dataset[name].values
        for name in swept
        if name in dataset.variables and set(dataset[name].dims) <= {"dof", "contact"}
    }
    return problem.with_parameters(**chosen)


def _nominal(dataset: xr.Dataset, name: str, swept: list[str]) -> np.ndarray:
    return dataset[f"{name}_nominal" if name in swept else name].values


def _identity(size: int) -> Any:
    return sp.eye_array(size, format="csc")


def _matrix(dataset: xr.Dataset, name: str, size: int) -> Any:
    row, column, value = (dataset[f"{name}_{part}"].values for part in ("row", "column", "value"))
    return sp.csc_array((value, (row, column)), shape=(size, size))
