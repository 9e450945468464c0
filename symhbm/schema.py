"""Labelled datasets from response curves: the names and dimensions of an archive."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from symhbm.branch import Branch, Task
from symhbm.names import meaning
from symhbm.point import Table
from symhbm.provenance import with_provenance
from symhbm.residual import HarmonicBalance
from symhbm.sweep import Sweep


def label(
    problem: HarmonicBalance, sweep: Sweep, branches: Sequence[Branch], task: Task
) -> xr.Dataset:
    """Dataset of response curves, one per parameter set.

    The moving parameter is a coordinate: along ``point``, or a dimension of its own on a grid.
    """
    name = task.name
    harmonics = max((branch.harmonics for branch in branches), key=len)
    along = "point" if task.at is None else name
    own_name = {"value": name, "event_value": f"event_{name}", "peak_value": f"peak_{name}"}
    variables: dict[str, tuple] = {}
    for table, axis in (("points", along), ("peaks", "peak"), ("events", "event")):
        for key in getattr(branches[0], table):
            arrays = [getattr(branch, table)[key] for branch in branches]
            if key.endswith("coefficient"):
                arrays = [_widened(array, len(harmonics)) for array in arrays]
            stacked = _stack(arrays)
            by_solution = table == "points" and key not in ("value", "n_solutions")
            axes = (
                (axis, "solution")
                if by_solution and task.may_fold and task.at is not None
                else (axis,)
            )
            variables[own_name.get(key, key)] = _variable(
                own_name.get(key, key), sweep, stacked, axes
            )
    for key in branches[0].counts:
        variables[key] = _variable(key, sweep, np.array([b.counts[key] for b in branches]))
    status = np.array([b.status for b in branches], dtype=object)
    variables["status"] = _variable("status", sweep, status)
    if task.at is not None:
        variables[name] = (name, task.at, variables[name][2])
    coordinates = _coordinates(problem, harmonics) | {name: variables.pop(name)}
    if task.frequency is not None:
        coordinates["frequency"] = ((), task.frequency, _attributes("frequency"))
    dataset = xr.Dataset(variables, coordinates)
    return with_provenance(dataset, problem, sweep, task, harmonics)


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
    coordinates: dict[str, tuple] = _coordinates(problem, problem.harmonics)
    coordinates["frequency"] = ((), frequency, _attributes("frequency"))
    dataset = with_provenance(xr.Dataset(variables, coordinates), problem, nothing)
    return dataset if accuracy is None else dataset.assign_attrs(accuracy=accuracy)


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
    coordinates: dict[str, tuple] = _coordinates(problem, harmonics)
    coordinates["frequency"] = ((), frequency, _attributes("frequency"))
    coordinates["angle"] = variables.pop("angle")
    return with_provenance(xr.Dataset(variables, coordinates), problem, nothing)


def _variable(name: str, sweep: Sweep, values: np.ndarray, axes: tuple[str, ...] = ()) -> tuple:
    """(dims, data, attributes) of a variable whose first axis runs over the parameter sets."""
    data = values.reshape(sweep.shape + values.shape[1:])
    return (*sweep.dims, *axes, *meaning(name).inner), data, _attributes(name)


def _attributes(name: str) -> dict[str, Any]:
    about = meaning(name)
    return {"units": about.units, "long_name": about.long_name, **about.attributes}


def _stack(arrays: list[np.ndarray]) -> np.ndarray:
    """Stack ragged arrays, padded at the end with NaN, -1, False or an empty string."""
    kind = arrays[0].dtype.kind
    fill: Any = {"f": np.nan, "i": -1, "b": False, "O": ""}[kind]
    shape = tuple(max(sizes) for sizes in zip(*(array.shape for array in arrays), strict=True))
    result = np.full((len(arrays), *shape), fill, dtype=arrays[0].dtype)
    for row, array in zip(result, arrays, strict=True):
        row[tuple(slice(size) for size in array.shape)] = array
    return result


def _widened(array: np.ndarray, n_harmonics: int) -> np.ndarray:
    """Coefficients (..., harmonic, component) of more harmonics: 0, or as unknown as the others."""
    missing = n_harmonics - array.shape[-2]
    nothing = np.where(np.isnan(array[..., :1, :]), np.nan, 0.0)
    return np.concatenate([array, *[nothing] * missing], axis=-2)


def _coordinates(problem: HarmonicBalance, harmonics: tuple[int, ...]) -> dict[str, tuple]:
    model = problem.model
    return {
        "dof": ("dof", np.arange(model.n_dof), {"long_name": "degree of freedom", "units": "1"}),
        "contact": ("contact", np.arange(model.n_contacts), {"long_name": "contact", "units": "1"}),
        "harmonic": (
            "harmonic",
            np.array(harmonics),
            {"long_name": "harmonic of the excitation frequency", "units": "1"},
        ),
        "component": (
            "component",
            np.array(["cos", "sin"], dtype=object),
            {"long_name": "component of the harmonic"},
        ),
    }
