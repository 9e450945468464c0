"""What is verified one by one: points, peaks or events of a dataset, and their worst figures."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import xarray as xr

from symhbm.numerics import FloatArray


def not_checked(bound: float | None) -> dict[str, Any]:
    """JSON entries of a figure that was not computed: it does not pass."""
    empty = {"worst": None, "bound": bound, "at": {}, "n_broken": 0}
    return empty | {"broken": bound is not None}


class StoredGroup(ABC):
    """Some of what a dataset stores; an index has one entry per dimension of ``dims``.

    ``kind`` names what is counted, ``prefix`` begins the names of the figures; ``solved`` tells
    where there is something, and ``moving`` what labels it beside the coordinates.
    """

    dataset: xr.Dataset
    kind: str
    prefix: str = ""
    dims: tuple[str, ...]
    solved: np.ndarray
    moving: dict[str, xr.DataArray]

    @property
    @abstractmethod
    def available(self) -> list[str]:
        """Names of the figures that can be computed."""

    @abstractmethod
    def figures(self, index: tuple[int, ...]) -> dict[str, float]:
        """All figures but the exact difference; those not computable are infinite."""

    def worst(self, values: FloatArray, bound: float | None) -> dict[str, Any]:
        """Largest value, the place it is at, and whether it breaks its bound, as JSON entries."""
        entry = not_checked(bound)
        if np.isnan(values).all():
            return entry
        index = np.unravel_index(int(np.nanargmax(values)), values.shape)
        labels = {
            dim: self.dataset[dim].values[i].item() if dim in self.dataset.coords else int(i)
            for dim, i in zip(self.dims, index, strict=True)
        }
        labels |= {name: float(value.values[index]) for name, value in self.moving.items()}
        worst = float(values[index])
        if bound is not None:
            entry["n_broken"] = int(np.sum(values > bound))
            entry["broken"] = worst > bound
        at = {name: _for_json(label) for name, label in labels.items()}
        return entry | {"worst": _for_json(worst), "at": at}


def _for_json(value: Any) -> Any:
    """A value as JSON has it, which has no infinity."""
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value
