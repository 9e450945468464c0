"""The problem behind a dataset: its parameters, matrices and description, and the way back."""

import json
from dataclasses import asdict, dataclass
from functools import cache, lru_cache
from importlib.metadata import version
from typing import Any

import numpy as np
import scipy.sparse as sp
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.model import (
    BLADE_PARAMETERS,
    CONTACT_PARAMETERS,
    FRICTION_PARAMETERS,
    PARAMETERS,
    EngineOrder,
    HarmonicForce,
    Model,
    PointForce,
    dims_of,
)
from symhbm.results.description import Description
from symhbm.results.request import Request
from symhbm.results.sweep import Sweep

SCHEMA_VERSION = 2
REFERENCE = (
    "E. Chatelet, D. Rade, G. Jacquet-Richardet, Dynamic Behavior of Cyclic Symmetrical N DOF "
    "System in the Presence of Dry Friction, DINAME 2013, hal-00941429"
)
DRAWN = "drawn"
"""Attribute of a swept parameter that tells how its values were drawn."""
LABELS = ("dof", "contact", "harmonic", "component")
OF_STRUCTURE = "structure_dof"
"""Coordinate of condensed structures: which degrees of freedom are kept."""
LARGEST_OF = "largest_of"
"""Attribute of datasets of condensed structures: among what responses are largest."""
OF_LARGEST = {"peak_amplitude", "peak_dof"}
"""Variables that depend on what is kept."""
Sizes = tuple[int, int, tuple[int, ...]]
MATRICES = ("mass_matrix", "damping_matrix", "stiffness_matrix")
_EXCITATIONS = {kind.__name__: kind for kind in (PointForce, EngineOrder, HarmonicForce)}


@dataclass
class Parts:
    """What a dataset is made of: one that grows part by part is slow to make.

    ``variables`` and ``coordinates`` are (dims, values, attributes) or ready-made, by name;
    ``sizes``, the numbers of degrees of freedom and of contacts and the harmonics, where they have
    labels.
    """

    variables: dict[str, Any]
    coordinates: dict[str, Any]
    attributes: dict[str, Any]
    sizes: Sizes | None = None

    @classmethod
    def of(cls, dataset: xr.Dataset) -> "Parts":
        """The parts of a dataset with labels."""
        whole = dataset.variables
        variables = {str(name): whole[name] for name in dataset.data_vars}
        own = [str(name) for name in dataset.coords if name not in LABELS]
        sizes = dataset.sizes["dof"], dataset.sizes["contact"], tuple(whole["harmonic"].values)
        return cls(variables, {name: whole[name] for name in own}, dict(dataset.attrs), sizes)

    def dataset(self) -> xr.Dataset:
        """The dataset."""
        parts = self.variables | self.coordinates
        made = {name: _variable(part) for name, part in parts.items()}
        labels = None if self.sizes is None else _labels(*self.sizes)
        if LARGEST_OF in self.attributes:
            for name in OF_LARGEST & {*made}:
                made[name] = _of_kept(made[name], self.attributes[LARGEST_OF])
        return xr.Dataset(made, labels, self.attributes).set_coords([*self.coordinates])


def _of_kept(variable: Any, kept: str) -> Any:
    """A variable whose long name tells that only what is kept was looked at."""
    about = str(variable.attrs["long_name"])
    changed = variable.copy(deep=False)
    changed.attrs["long_name"] = about if kept in about else f"{about}, of the {kept}"
    return changed


def _variable(part: Any) -> Any:
    """A part as xarray holds it, made without a look at packages that might hold its numbers."""
    if isinstance(part, (xr.Variable, xr.DataArray)):
        return part
    dims, values, attributes = part
    return xr.Variable(dims, np.asarray(values), attributes, fastpath=True)


@lru_cache(maxsize=64)
def _labels(n_dof: int, n_contacts: int, harmonics: tuple[int, ...]) -> xr.Coordinates:
    """Coordinates that many datasets have: their indices are slow to make."""
    number = {"dof": "degree of freedom", "contact": "contact"}
    number["harmonic"] = "harmonic of the excitation frequency"
    values = {"dof": np.arange(n_dof), "contact": np.arange(n_contacts)}
    values["harmonic"] = np.array(harmonics)
    labels = {
        name: _variable((name, values[name], {"long_name": about, "units": "1"}))
        for name, about in number.items()
    }
    parts = np.array(["cos", "sin"], dtype=object)
    about = {"long_name": "component of the harmonic"}
    labels["component"] = _variable(("component", parts, about))
    return xr.Coordinates(labels)


def with_provenance(
    variables: dict[str, Any],
    coordinates: dict[str, Any],
    problem: HarmonicBalance,
    sweep: Sweep,
    followed: Request | None = None,
    harmonics: tuple[int, ...] | None = None,
) -> Parts:
    """Variables and coordinates, the parameters, the problem and where the numbers come from.

    ``harmonics`` are those of the coefficients, by default those of the problem.
    """
    variables, coordinates = dict(variables), dict(coordinates)
    for name, value in problem.parameters.items():
        units, long_name = PARAMETERS[name][:2]
        attributes = {"units": units, "long_name": long_name}
        dims = () if np.ndim(value) == 0 else dims_of(name)
        target = name
        if name in sweep.values:
            swept = sweep.values[name]
            drawn = {DRAWN: swept.attrs[DRAWN]} if DRAWN in swept.attrs else {}
            holder = coordinates if swept.dims == (name,) else variables
            holder[name] = (swept.dims, swept.values, attributes | drawn)
            for label, coordinate in swept.coords.items():
                if label not in (name, *LABELS, *coordinates):
                    about = {"long_name": str(label), "units": "1"} | coordinate.attrs
                    coordinates[str(label)] = coordinate.assign_attrs(about)
        if name in sweep.values or (followed and name == followed.name):
            target = f"{name}_nominal"
            attributes = attributes | {"long_name": f"{long_name}, nominal value"}
        variables[target] = (dims, np.array(value), attributes)
    if problem.model.kept is not None:
        about = {"long_name": "degree of freedom of the whole structure", "units": "1"}
        coordinates[OF_STRUCTURE] = ("dof", problem.model.kept, about)
    elif problem.model.has_matrices and not problem.model.lumped:
        for name in MATRICES:
            variables |= _sparse(name, getattr(problem.model, name))
    about_all = {
        "title": "Forced response of a structure with dry friction by multi-harmonic balance",
        "references": REFERENCE,
        "symhbm_schema": SCHEMA_VERSION,
        "symhbm_version": _version("symhbm"),
        "casadi_version": _version("casadi"),
        "problem": json.dumps(_description(problem)),
        "swept": json.dumps(list(sweep.values)),
    }
    if followed:
        description = asdict(followed) | {
            "peaks": "each" if followed.each else "largest",
            "grid": followed.at is not None,
            "harmonics": problem.harmonics,
        }
        del description["at"]
        about_all["followed"] = json.dumps(description)
        if followed.accuracy is not None:
            about_all["accuracy"] = followed.accuracy
    model = problem.model
    if model.kept is not None:
        about_all[LARGEST_OF] = f"{model.n_dof} degrees of freedom kept of {model.n_whole}"
    sizes = model.n_dof, model.n_contacts, harmonics or problem.harmonics
    return Parts(variables, coordinates, about_all, sizes)


@cache
def _version(package: str) -> str:
    return version(package)


def _sparse(name: str, matrix: Any) -> dict[str, tuple]:
    columns = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
    entry = (f"{name}_entry",)
    units = PARAMETERS[name.removesuffix("_matrix")].units
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
    return problem.model.description() | {
        "harmonics": list(problem.harmonics),
        "samples": problem.samples,
        "n_dof": problem.model.n_dof,
        "contacts": [list(dofs) for dofs in problem.model.contacts],
        "lumped": problem.model.lumped,
        "excitation": {"type": type(excitation).__name__, **vars(excitation)},
    }


def describe_problem(dataset: xr.Dataset) -> HarmonicBalance:
    """Build the problem that a dataset describes.

    A swept or followed parameter has its nominal value, unless the dataset was reduced to one of
    its values.
    """
    about = Description(dataset)
    description = about.problem
    excitation = dict(description["excitation"])
    kind = _EXCITATIONS[excitation.pop("type")]
    for name in ("cosine", "sine"):
        if name in excitation:
            excitation[name] = {int(n): row for n, row in excitation[name].items()}
    moving = about.moving
    varied = [*about.swept, *([moving] if moving != "frequency" else [])]
    # Cubic springs came with the second schema.
    names = CONTACT_PARAMETERS if dataset.attrs["symhbm_schema"] > 1 else FRICTION_PARAMETERS
    nominal = {name: _nominal(dataset, name, varied) for name in names}
    lumped = description["lumped"]
    if lumped:
        matrices = [_identity(description["n_dof"])] * 3
    else:
        matrices = [_matrix(dataset, name, description["n_dof"]) for name in MATRICES]
    model = Model(*matrices, contacts=description["contacts"], lumped=lumped, **nominal)
    of_blades = {name: _nominal(dataset, name, varied) for name in BLADE_PARAMETERS if lumped}
    problem = HarmonicBalance(
        model.with_parameters(**of_blades),
        kind(**excitation),
        description["harmonics"],
        description.get("samples"),
    )
    chosen = {
        name: dataset[name].values
        for name in about.swept
        if name in dataset.variables and set(dataset[name].dims) <= {"dof", "contact"}
    }
    if moving != "frequency" and moving in dataset.variables and dataset[moving].ndim == 0:
        index = about.request["index"]
        values = np.array(problem.parameters[moving], dtype=float)
        values[... if index is None else index] = dataset[moving].values
        chosen[moving] = values
    return problem.with_parameters(**chosen)


def _nominal(dataset: xr.Dataset, name: str, varied: list[str]) -> np.ndarray:
    return dataset[f"{name}_nominal" if name in varied else name].values


def _identity(size: int) -> Any:
    return sp.eye_array(size, format="csc")


def _matrix(dataset: xr.Dataset, name: str, size: int) -> Any:
    row, column, value = (dataset[f"{name}_{part}"].values for part in ("row", "column", "value"))
    return sp.csc_array((value, (row, column)), shape=(size, size))
