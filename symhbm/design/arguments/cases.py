"""Cases of a design, checked: sweeps, forces and bands."""

from typing import Any

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.design.cases import Bands
from symhbm.design.variables import DesignVariables
from symhbm.numerics import check
from symhbm.results import Sweep

_DIMENSIONS = ("variable", "start", "descent", "active", "fresh", "named_peak", "front", "aim")
"""Dimensions of a design besides those of its cases."""


def check_ratios(
    problem: HarmonicBalance, variables: DesignVariables, sweep: Sweep, argument: str = "over"
) -> None:
    """Raise ValueError where designed parameters are swept and have no nominal proportions."""
    for name in variables.names:
        if name in sweep.values and np.any(np.asarray(problem.parameters[name]) <= 0):
            raise ValueError(
                f"{argument}[{name!r}]: expected positive nominal values of {name} in the problem, "
                "as the values swept are taken relative to them where it is designed"
            )
        if name in sweep.values and np.any(sweep.values[name].values <= 0):
            raise ValueError(
                f"{argument}[{name!r}]: expected positive values of a designed parameter"
            )


def check_forces(problem: HarmonicBalance, sweep: Sweep) -> None:
    """Raise ValueError where a case has no force: its response is zero at every design."""
    named = problem.parameters | sweep.values
    if not np.all(np.asarray(named.get("force_amplitude", 1.0))):
        raise ValueError("force_amplitude=0: expected a force, there is no response to design")


def check_dimensions(sweep: Sweep) -> None:
    """Raise ValueError where cases have a dimension or a coordinate named as one of the result."""
    for name, value in sweep.values.items():
        for dim in (*value.dims, *value.coords):
            if dim in _DIMENSIONS:
                raise ValueError(
                    f"over[{name!r}]: expected a name of your own, {dim!r} is the result's"
                )


def read_bands(frequency: Any, sweep: Sweep, argument: str = "frequency_band") -> list[Bands]:
    """The bands [Hz] of each case: one pair for all, several pairs, or one per case.

    A number stands for the band of that frequency alone, without width.
    """
    shape: tuple[int, ...] = ()
    values = frequency
    if set(sweep.dims) & {*getattr(frequency, "dims", ())}:
        values, shape = _aligned(frequency, sweep, argument), sweep.shape
    edges = check.array(argument, values, "positive")
    if edges.shape == shape:
        return [((at, at),) for at in np.broadcast_to(edges, sweep.shape).ravel().tolist()]
    if edges.shape == (2,):
        edges = edges[None]
    n_dims = len(shape) + 1 if shape else 2
    if edges.shape[-1:] != (2,) or edges.ndim != n_dims or not edges.size:
        raise _no_bands(argument, frequency)
    if np.any(edges[..., 0] == edges[..., 1]):
        raise ValueError(f"{argument}={check.shown(frequency)}: expected bands of some width")
    ordered = np.sort(edges, axis=-1)
    if shape:
        return [((low, high),) for low, high in ordered.reshape(-1, 2).tolist()]
    return [tuple((low, high) for low, high in ordered.tolist())] * sweep.size


def _aligned(frequency: Any, sweep: Sweep, argument: str) -> Any:
    """A DataArray of pairs in the order of the sweep's dimensions."""
    sizes = dict(zip(sweep.dims, sweep.shape, strict=True))
    pairs = [dim for dim in frequency.dims if dim not in sizes]
    if len(pairs) > 1 or any(frequency.sizes.get(dim) != size for dim, size in sizes.items()):
        raise _no_bands(argument, frequency, f", {sizes}")
    for value in sweep.values.values():
        for dim in sizes:
            labelled = dim in value.coords and dim in frequency.coords
            if labelled and not np.array_equal(value[dim], frequency[dim]):
                raise ValueError(
                    f"{argument}: {dim!r} has the labels "
                    f"{check.shown(frequency[dim].values.tolist())}, those of the sweep are "
                    f"{check.shown(value[dim].values.tolist())}"
                )
    return frequency.transpose(*sweep.dims, *pairs)


def _no_bands(argument: str, frequency: Any, sizes: str = "") -> ValueError:
    return ValueError(
        f"{argument}={check.shown(frequency)}: expected two different values (first, last) in Hz, "
        f"a list of such pairs, one frequency, or a DataArray of pairs or of frequencies over the "
        f"dimensions of the sweep{sizes}"
    )
