"""Samples of an ensemble: completeness, reading in blocks, their problem, one number of each."""

from collections.abc import Callable, Collection, Hashable, Iterator
from functools import cached_property
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from symhbm.continuation import Status
from symhbm.numerics import FloatArray, check
from symhbm.results import NUMBERS, SCHEMA_VERSION, Description, check_forced, parts, without
from symhbm.results.archive import check_schema
from symhbm.results.reading import COMPLETE

BLOCK = 2**26
"""Bytes of a variable that are read at a time: bounded memory."""


def followed(dataset: object, argument: str) -> tuple[xr.Dataset, Description, str]:
    """A response curve, its description, and the dimension of its points.

    Raises TypeError and ValueError for anything else.
    """
    dataset = check.instance(argument, dataset, xr.Dataset, "an xarray Dataset")
    check_schema(dataset, argument)
    check_forced(argument, dataset)
    if "curve_status" in dataset.variables:
        dataset = dataset.drop_vars("status", errors="ignore").rename(curve_status="status")
    missing = [name for name in ("amplitude", "status") if name not in dataset.variables]
    if missing:
        raise ValueError(
            f"{argument}: expected a result of frf or follow, got one {without(dataset, missing)}"
        )
    description = Description(dataset)
    moving = description.moving
    if dataset.sizes.get("solution") == 1:
        dataset = dataset.isel(solution=0)
    dims = dataset["amplitude"].dims
    if "solution" in dims:
        raise ValueError(
            f"{argument}: expected one response at each {moving}, it has several (dimension "
            "'solution'); select one, for example the first by .isel(solution=0)"
        )
    along = next((name for name in ("point", moving) if name in dims), None)
    if along is None:
        raise ValueError(f"{argument}: expected a response curve, got one point")
    return dataset, description, along


def slices(size: int, item_bytes: int, most: int = BLOCK) -> Iterator[slice]:
    """Consecutive blocks of a dimension, of at most ``most`` bytes, but one item at least."""
    step = max(1, most // max(1, item_bytes))
    for start in range(0, size, step):
        yield slice(start, min(start + step, size))


def origin(dataset: xr.Dataset, without: Collection[Hashable]) -> xr.Dataset:
    """The parameters and the problem behind a dataset, without those along some dimensions."""
    stems = [*Description(dataset).records, NUMBERS]
    names = [name for stem in stems for name in (stem, f"{stem}_nominal")]
    chosen = [
        name
        for name in names
        if name in dataset.data_vars and not set(dataset[name].dims) & set(without)
    ]
    return dataset[chosen].reset_coords(drop=True)


def meant(long_name: str, units: str = "1") -> dict[str, str]:
    """The attributes of a variable."""
    return {"units": units, "long_name": long_name}


def counted(
    result: xr.Dataset, n_used: int, n_failed: int, n_missing: int, used: str
) -> xr.Dataset:
    """The result with the number of samples; ``used`` tells what was used."""
    failed = ((), n_failed, meant("samples that failed, left out"))
    missing = ((), n_missing, meant("samples of the ensemble that are not there"))
    return result.assign(n_used=((), n_used, meant(used)), n_failed=failed, n_missing=missing)


def missing_samples(dataset: xr.Dataset) -> tuple[NDArray[np.bool_], int]:
    """Which samples are not computed yet, and how many the ensemble has beside this part of it."""
    status = dataset["status"]
    waiting = status.values == str(Status.NOT_STARTED)
    part = parts.part_of(dataset)
    others = 0 if part is None or status.dims != (part.dim,) else part.size - status.size
    return waiting, others


class Population:
    """The samples of one dataset.

    ``dim`` is the swept dimension, ``along`` that of the points of each response. Raises TypeError
    and ValueError unless there is one swept dimension.
    """

    def __init__(self, dataset: object):
        self.dataset, self.description, self.along = followed(dataset, "dataset")
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
        """Whether all responses are at the same values of the moving parameter."""
        return self.along != "point"

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Whether each sample is complete, ``(n_samples,)``."""
        used = np.isin(self.dataset["status"].values.astype(str), [*map(str, COMPLETE)])
        if "converged" not in self.dataset:
            return used
        for block in slices(self.size, self.dataset.sizes[self.along]):
            valid = self.values("converged", (self.dim, self.along), {self.dim: block})
            valid = valid.astype(bool)
            if not self.on_grid:
                n_points = self.dataset["n_points"].isel({self.dim: block}).values
                valid |= np.arange(valid.shape[1]) >= n_points[:, None]
            used[block] &= valid.all(axis=1)
        return used

    def values(self, name: str, dims: tuple[str, ...], region: dict[str, slice]) -> np.ndarray:
        """The values of a variable in a region, with axes in the order of ``dims``."""
        # Loaded before it is transposed: archives read lazily do not transpose parts.
        return self.dataset[name].isel(region).load().transpose(*dims).values

    def by_samples(
        self, function: Callable[[xr.Dataset], xr.Dataset], names: tuple[str, ...]
    ) -> xr.Dataset:
        """The results of a function of the named variables that exist, block by block."""
        chosen = self.dataset[[name for name in names if name in self.dataset]]
        item_bytes = max(8 * variable.size // self.size for variable in chosen.values())
        parts = [
            function(chosen.isel({self.dim: block}).load())
            for block in slices(self.size, item_bytes)
        ]
        options: Any = dict(
            data_vars="minimal", coords="minimal", compat="override", join="override"
        )
        return xr.concat(parts, self.dim, **options)

    def explained(
        self, result: xr.Dataset, title: str, per_sample: bool, warns: bool = True
    ) -> xr.Dataset:
        """The result with the number of samples, the parameters, the problem and a title.

        Where no sample is complete it ``warns``.
        """
        n_used = int(self.used.sum())
        waiting, others = missing_samples(self.dataset)
        n_waiting = int(waiting.sum())
        n_failed = self.size - n_used - n_waiting
        if not n_used and warns:
            check.warn(
                f"{title}: NaN, none of {self.size} samples is complete, as their status says; "
                "symhbm.resume computes those that are waiting, max_points= lets paths go on"
            )
        result = counted(result, n_used, n_failed, n_waiting + others, "complete samples")
        source = origin(self.dataset, () if per_sample else (self.dim,))
        result = result.assign({k: v for k, v in source.data_vars.items() if k not in result.dims})
        if per_sample:
            result["status"] = self.dataset["status"]
        return result.assign_attrs(source.attrs, title=title)


Values = ArrayLike | xr.DataArray | xr.Dataset


class Numbers(NamedTuple):
    """The numbers of the samples that did not fail, in their order, with units and meaning.

    ``n_missing`` samples of the ensemble are not there. ``source`` holds the parameters and the
    problem behind them, as far as they are known.
    """

    values: FloatArray
    n_failed: int
    n_missing: int
    units: str
    meaning: str
    source: xr.Dataset

    def labelled(self, result: xr.Dataset, title: str) -> xr.Dataset:
        """The result with the number of samples, the source and a title."""
        result = counted(result, self.values.size, self.n_failed, self.n_missing, "numbers used")
        versions = {"symhbm_schema": SCHEMA_VERSION, "symhbm_version": version("symhbm")}
        result = result.assign(self.source.data_vars).assign_attrs(versions | self.source.attrs)
        return result.assign_attrs(title=title, of=self.meaning)


def numbers(values: Values, of: str) -> Numbers:
    """Read one number per sample; NaN is a sample that failed, and is counted.

    ``values`` (n_samples,), or a dataset whose variable ``of`` they are. Raises TypeError,
    ValueError and KeyError for anything else, and where all failed.
    """
    source, waiting, n_others = xr.Dataset(), np.array(False), 0
    if isinstance(values, xr.Dataset):
        check_schema(values, "values")
        check.known(of, [str(name) for name in values.data_vars], "variable of the dataset")
        if "status" in values and values["status"].dims == values[of].dims:
            waiting, n_others = missing_samples(values)
        values, source = values[of], origin(values, values[of].dims)
    attributes = values.attrs if isinstance(values, xr.DataArray) else {}
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise TypeError(f"values={check.shown(values)}: expected real numbers")
    if array.ndim != 1:
        raise ValueError(f"values: expected one number per sample, got shape {array.shape}")
    used, n_waiting = array[~np.isnan(array) & ~waiting].astype(float), int(waiting.sum())
    check.array("values", used)
    if used.size == 0:
        why = f"{array.size - n_waiting} did" + f", {n_waiting} are not computed" * bool(n_waiting)
        raise ValueError(f"values: expected a sample that did not fail, {why}")
    units, meaning = str(attributes.get("units", "1")), str(attributes.get("long_name", "values"))
    n_failed = array.size - used.size - n_waiting
    return Numbers(used, n_failed, n_waiting + n_others, units, meaning, source)


def check_confidence(confidence: float) -> float:
    """Return a probability between 0 and 1, both excluded; raise ValueError for any other."""
    confidence = check.scalar("confidence", confidence, "positive")
    if confidence >= 1:
        raise ValueError(f"confidence={confidence:g}: expected a probability below 1")
    return confidence


def check_probabilities(name: str, values: ArrayLike) -> FloatArray:
    """Return probabilities between 0 and 1, both excluded; raise ValueError for any other."""
    array = check.array(name, values, "positive")
    if array.ndim != 1 or array.size == 0 or np.any(array >= 1):
        raise ValueError(f"{name}={check.shown(values)}: expected probabilities between 0 and 1")
    return array


BOUND = ("bound", np.array(["lower", "upper"], dtype=object), {"long_name": "end of the interval"})
"""Coordinate of intervals."""
