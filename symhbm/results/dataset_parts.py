"""Variables, coordinates and attributes of a dataset, and what all datasets have."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr

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
        variables = {name: _variable(part) for name, part in parts.items()}
        labels = xr.Coordinates() if self.sizes is None else _labels(*self.sizes)
        coordinates = [*self.coordinates]
        if SPEED_ORDER in self.attributes:
            speeds = _speeds(variables, speed_orders(variables, self.attributes))
            variables, coordinates = variables | speeds, [*coordinates, *speeds]
        if LARGEST_OF in self.attributes:
            for name in OF_LARGEST & {*variables}:
                variables[name] = _of_kept(variables[name], self.attributes[LARGEST_OF])
        return xr.Dataset(variables, labels, self.attributes).set_coords(coordinates)


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
            about = VARIABLES[name]
            attributes = {"units": about.units, "long_name": about.long_name}
            speed = 60 / orders * frequency
            dims = (*(dim for dim in orders.dims if dim not in frequency.dims), *frequency.dims)
            result[name] = xr.Variable(dims, speed.transpose(*dims).values, attributes)
    return result


def _of_kept(variable: Any, kept: str) -> Any:
    """A variable whose long name names the degrees of freedom it was computed from."""
    long_name = str(variable.attrs["long_name"])
    changed = variable.copy(deep=False)
    changed.attrs["long_name"] = long_name if kept in long_name else f"{long_name}, of the {kept}"
    return changed


def _variable(part: Any) -> Any:
    """A part as an xarray variable, made without xarray's slow search for array packages."""
    if isinstance(part, xr.DataArray):
        return part
    if isinstance(part, xr.Variable):
        return part.copy(deep=False)
    dims, values, attributes = part
    return xr.Variable(dims, np.asarray(values), attributes, fastpath=True)


@lru_cache(maxsize=64)
def _labels(n_dof: int, n_contacts: int, harmonics: tuple[int, ...]) -> xr.Coordinates:
    """Coordinates that many datasets share: their indices are slow to make."""
    long_names = {"dof": "degree of freedom", "contact": "contact"}
    long_names["harmonic"] = "harmonic of the excitation frequency"
    values = {"dof": np.arange(n_dof), "contact": np.arange(n_contacts)}
    values["harmonic"] = np.array(harmonics)
    parts = {
        name: (name, values[name], {"long_name": long_name, "units": "1"})
        for name, long_name in long_names.items()
    }
    components = np.array(["cos", "sin"], dtype=object)
    parts["component"] = "component", components, {"long_name": "component of the harmonic"}
    return xr.Coordinates({name: _variable(part) for name, part in parts.items()})
