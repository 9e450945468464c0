"""Parameter sets of a sweep: names, dimensions and values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance
from symhbm.model import PARAMETERS, is_pattern
from symhbm.numerics import FloatArray, check
from symhbm.results.variables import OF_PLACES, OWN_DIMENSIONS, VARIABLES

RESERVED = {*OWN_DIMENSIONS, *OF_PLACES, *VARIABLES, *PARAMETERS}


@dataclass(frozen=True)
class Factors:
    """Factors of a parameter whose values differ between blades or contacts, see `scale`."""

    factors: FloatArray
    dim: str | None

    def values(self, problem: HarmonicBalance, name: str) -> xr.DataArray:
        """Values of a parameter along the factors, which are labels."""
        dim = self.dim or f"{name}_factor"
        nominal = xr.DataArray(problem.parameters[name], dims=problem.model.dims_of(name))
        words = {"long_name": f"factor of the {problem.records[name].meaning}", "units": "1"}
        labels = xr.Variable(dim, self.factors, words)
        return xr.DataArray(labels, {dim: labels}) * nominal


def scale(factors: ArrayLike, dim: str | None = None) -> Factors:
    """Factors of a parameter to sweep, for ``over``: its values by contact or blade stay in ratio.

    Parameters
    ----------
    factors : (n,)
        What the values of the problem are multiplied by.
    dim
        What results call the dimension, by default ``"<parameter>_factor"``. Parameters that share
        one are scaled together.

    Raises
    ------
    TypeError, ValueError
        For what are no finite numbers along one dimension.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     3, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=[8, 10, 12],
    ... )
    >>> problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(1))
    >>> loads = sh.frf(problem, (10, 40), over={"normal_load": sh.scale([0.5, 1, 2])})
    >>> loads.normal_load.sel(normal_load_factor=2).values
    array([16., 20., 24.])
    """
    values = check.array("factors", factors)
    if values.ndim != 1 or not values.size:
        raise ValueError(f"factors={check.shown(factors)}: expected a sequence of numbers")
    return Factors(values, None if dim is None else check.text("dim", dim))


@dataclass(frozen=True)
class Sweep:
    """Swept parameters: ``values`` by name, all broadcast over ``dims`` of the given ``shape``."""

    values: dict[str, xr.DataArray]
    dims: tuple[str, ...]
    shape: tuple[int, ...]

    @classmethod
    def of(cls, values: dict[str, xr.DataArray]) -> Sweep:
        """The sweep over all dimensions of values but those of patterns, in their order."""
        sizes = {
            str(dim): size
            for value in values.values()
            for dim, size in value.sizes.items()
            if not is_pattern(dim)
        }
        return cls(values, tuple(sizes), tuple(sizes.values()))

    @property
    def size(self) -> int:
        """Number of parameter sets."""
        return math.prod(self.shape)

    def chosen(self, number: int) -> dict[str, np.ndarray]:
        """The values of one parameter set, by its number among the flattened dimensions."""
        index = dict(zip(self.dims, np.unravel_index(number, self.shape), strict=True))
        return {
            name: value.values[tuple(index[str(dim)] for dim in value.dims if dim in index)]
            for name, value in self.values.items()
        }


def parse(
    problem: HarmonicBalance, over: Mapping[str, Any] | xr.Dataset | None, argument: str = "over"
) -> Sweep:
    """Read ``over``: a list becomes a dimension of its own name, names that share one go in pairs.

    Messages call it ``argument``. The extreme values are applied to the problem, so bad ones raise
    here and not in a worker.

    Raises
    ------
    TypeError
        If ``over`` is no mapping.
    KeyError
        If a name is no parameter of the problem.
    ValueError
        If a value is out of range, a list is empty, or dimensions do not fit.
    """
    if over is None:
        return Sweep({}, (), ())
    check.instance(argument, over, Mapping, "a mapping of parameters or a Dataset")
    values: dict[str, xr.DataArray] = {}
    for name, value in over.items():
        own = problem.parameter_name(str(name))
        values[own] = _array(problem, own, value, argument)
    sizes: dict[str, int] = {}
    labels: dict[str, np.ndarray] = {}
    for name, value in values.items():
        for dim in (str(d) for d in value.dims if not is_pattern(d)):
            size = value.sizes[dim]
            if sizes.setdefault(dim, size) != size:
                raise ValueError(
                    f"{argument}[{name!r}]: dimension {dim!r} has {size} values, "
                    f"elsewhere it has {sizes[dim]}"
                )
            label = value[dim].values if dim in value.coords else labels.get(dim)
            if label is not None and not np.array_equal(labels.setdefault(dim, label), label):
                raise ValueError(
                    f"{argument}[{name!r}]: {dim!r} has the labels {check.shown(label.tolist())}, "
                    f"elsewhere {check.shown(labels[dim].tolist())}"
                )
            if dim in problem.records and dim not in values:
                raise ValueError(
                    f"{argument}[{name!r}]: expected a name of your own for a dimension, "
                    f"{dim!r} is a parameter that is not swept"
                )
    for name, value in values.items():
        for chosen in _extremes(value):
            problem.with_parameters(**{name: chosen})
    return Sweep.of(values)


def _extremes(value: xr.DataArray) -> list[np.ndarray]:
    """Values of one parameter that break a bound if any does: bounds are on single entries."""
    pattern = [size for dim, size in value.sizes.items() if is_pattern(dim)]
    rows = value.values.reshape(-1, *pattern)
    if value.dtype.kind == "i":
        return list(np.unique(rows, axis=0))
    flat = rows.reshape(len(rows), -1)
    return [rows[flat.min(axis=1).argmin()], rows[flat.max(axis=1).argmax()]]


def _array(problem: HarmonicBalance, name: str, value: Any, argument: str) -> xr.DataArray:
    where = f"{argument}[{name!r}]"
    if isinstance(value, Factors):
        value = value.values(problem, name)
    if not isinstance(value, xr.DataArray):
        values = check.array(where, value)
        if values.ndim > 1:
            raise ValueError(
                f"{where}: expected a number, a list or a DataArray, got shape {values.shape}; "
                "name the dimensions, for example DataArray(values, dims=('sample', 'contact'))"
            )
        dims = (name,) if values.ndim else ()
        coords = {name: _natural(problem, name, values, where)} if values.ndim else {}
        value = xr.DataArray(values, dims=dims, coords=coords)
    check.array(where, value.values)
    value = value.copy(data=_natural(problem, name, value.values, where))
    pattern = problem.model.dims_of(name)
    for dim in (*value.dims, *value.coords):
        own = is_pattern(dim) or dim in PARAMETERS
        if dim in RESERVED and not own:
            raise ValueError(f"{where}: expected a name of your own, {dim!r} is the result's")
        if dim in value.coords and dim not in value.dims and dim in problem.records:
            raise ValueError(
                f"{where}: expected a coordinate name of your own, {dim!r} is a parameter"
            )
    for dim in value.dims:
        if value.sizes[dim] == 0:
            raise ValueError(f"{where}: expected at least one value along {dim!r}, got none")
        if not is_pattern(dim):
            continue
        if dim not in pattern:
            raise ValueError(f"{where}: {name} has no value per {dim}")
        size = np.size(problem.parameters[name])
        if value.sizes[dim] != size:
            raise ValueError(
                f"{where}: expected {size} values along {dim!r}, got {value.sizes[dim]}"
            )
        if dim in value.coords and not np.array_equal(value[dim], np.arange(value.sizes[dim])):
            raise ValueError(
                f"{where}: expected the labels 0 to {value.sizes[dim] - 1} along {dim!r}, "
                f"got {check.shown(value[dim].values.tolist())}"
            )
    return value.transpose(..., *(dim for dim in value.dims if is_pattern(dim)))


def _natural(problem: HarmonicBalance, name: str, values: np.ndarray, where: str) -> np.ndarray:
    """Integers for an integer parameter, floats for all others."""
    if isinstance(problem.parameters[name], int):
        if np.any(values != np.round(values)):
            raise ValueError(f"{where}={check.shown(values.tolist())}: expected integers")
        return values.astype(np.int64)
    return np.asarray(values, dtype=float)
