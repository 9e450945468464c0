"""The places of degrees of freedom and contacts in datasets."""

from typing import Any

import numpy as np
import xarray as xr

from symhbm.model import Place, Places, Structure, number_of
from symhbm.numerics import check

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


def check_dof(name: str, place: Place, dataset: xr.Dataset) -> int:
    """The number along ``dof`` of a degree of freedom, given by it or by the name of its place."""
    if isinstance(place, str):
        place = number_of(places_of(dataset), place, dataset.sizes["dof"])
    return check.integer(name, place, 0, dataset.sizes["dof"] - 1)


def _about(long_name: str, units: str = "1") -> dict[str, Any]:
    return {"long_name": long_name, "units": units}
