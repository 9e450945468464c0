"""The samples of an ensemble of responses: which are complete, read in blocks, and their origin."""

from collections.abc import Callable, Collection, Hashable, Iterator
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from symhbm.continuation import Status
from symhbm.model import PARAMETERS
from symhbm.numerics import check
from symhbm.results import MATRICES, Description, without
from symhbm.results.archive import check_schema

BLOCK = 2**26
"""Bytes of a variable that are read at a time."""
_ENTRIES = ("row", "column", "value")


def followed(dataset: object, what: str) -> tuple[xr.Dataset, dict[str, Any], str]:
    """A response curve, what it was followed over, and the dimension of its points.

    Raises TypeError and ValueError for anything else.
    """
    if not isinstance(dataset, xr.Dataset):
        raise TypeError(f"{what}={check.shown(dataset)}: expected an xarray Dataset")
    check_schema(dataset, what)
    missing = [name for name in ("amplitude", "status") if name not in dataset.variables]
    if missing:
        raise ValueError(
            f"{what}: expected a result of frf or follow, got one {without(dataset, missing)}"
        )
    task = Description(dataset).request
    dims = dataset["amplitude"].dims
    if "solution" in dims:
        raise ValueError(
            f"{what}: expected one response at each {task['name']}, it has several (dimension "
            "'solution'); select one, for example the first by .isel(solution=0)"
        )
    along = next((name for name in ("point", task["name"]) if name in dims), None)
    if along is None:
        raise ValueError(f"{what}: expected a response curve, got one point")
    return dataset, task, along


def slices(size: int, bytes_of_each: int, most: int = BLOCK) -> Iterator[slice]:
    """Consecutive blocks of a dimension of at most so many bytes, but one item at least."""
    step = max(1, most // max(1, bytes_of_each))
    for start in range(0, size, step):
        yield slice(start, min(start + step, size))


def origin(dataset: xr.Dataset, without: Collection[Hashable]) -> xr.Dataset:
    """The parameters and the problem behind a dataset, those along some dimensions left out."""
    stems = (*PARAMETERS, *(f"{name}_{part}" for name in MATRICES for part in _ENTRIES))
    names = [name for stem in stems for name in (stem, f"{stem}_nominal")]
    chosen = [
        name
        for name in names
        if name in dataset.data_vars and not set(dataset[name].dims) & set(without)
    ]
    return dataset[chosen].reset_coords(drop=True)


class Population:
    """The samples of one dataset.

    ``dim`` is the swept dimension, ``along`` that of the points of each response, ``grid`` the
    name of what moves. Raises TypeError and ValueError unless it has one swept dimension.
    """

    def __init__(self, dataset: object):
        self.dataset, self.task, self.along = followed(dataset, "dataset")
        dims = [str(dim) for dim in self.dataset["status"].dims]
        if len(dims) != 1:
            hint = f"; select of the others, as in .isel({dims[0]}=0)" if dims else ""
            raise ValueError(f"dataset: expected one swept dimension, got {tuple(dims)}{hint}")
        self.dim = dims[0]

    @property
    def size(self) -> int:
        """Number of samples, those that failed included."""
        return self.dataset.sizes[self.dim]

    @property
    def on_grid(self) -> bool:
        """Whether all responses are known at the same values."""
        return self.along != "point"

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Whether each sample is complete, ``(n_samples,)``."""
        used = self.dataset["status"].values == str(Status.REACHED_END)
        if "converged" not in self.dataset:
            return used
        for block in slices(self.size, self.dataset.sizes[self.along]):
            good = self.part("converged", (self.dim, self.along), {self.dim: block}).astype(bool)
            if not self.on_grid:
                n_points = self.dataset["n_points"].isel({self.dim: block}).values
                good |= np.arange(good.shape[1]) >= n_points[:, None]
            used[block] &= good.all(axis=1)
        return used

    def part(self, name: str, dims: tuple[str, ...], place: dict[str, slice]) -> np.ndarray:
        """A part of a variable with its axes in this order, and nothing else, from an archive."""
        # Loaded before it is transposed: archives read lazily do not transpose parts.
        return self.dataset[name].isel(place).load().transpose(*dims).values

    def by_samples(
        self, function: Callable[[xr.Dataset], xr.Dataset], names: tuple[str, ...]
    ) -> xr.Dataset:
        """The results of a function of the named variables, as far as there are, block by block."""
        chosen = self.dataset[[name for name in names if name in self.dataset]]
        each = max(8 * variable.size // self.size for variable in chosen.values())
        parts = [
            function(chosen.isel({self.dim: block}).load()) for block in slices(self.size, each)
        ]
        options: Any = dict(
            data_vars="minimal", coords="minimal", compat="override", join="override"
        )
        return xr.concat(parts, self.dim, **options)

    def explained(self, result: xr.Dataset, title: str, per_sample: bool) -> xr.Dataset:
        """The result with the number of samples, the parameters, the problem and a title."""
        n_used = int(self.used.sum())
        result["n_used"] = ((), n_used, {"units": "1", "long_name": "complete samples"})
        about = {"units": "1", "long_name": "samples that failed, left out"}
        result["n_failed"] = ((), self.size - n_used, about)
        source = origin(self.dataset, () if per_sample else (self.dim,))
        result = result.assign({k: v for k, v in source.data_vars.items() if k not in result.dims})
        if per_sample:
            result["status"] = self.dataset["status"]
        return result.assign_attrs(source.attrs, title=title)
