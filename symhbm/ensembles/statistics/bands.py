"""Bands of responses: smallest, largest, mean and quantiles over the samples."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from symhbm.ensembles.statistics.population import Population, slices
from symhbm.numerics import FloatArray, check

_HELD = 3 * 2**27
"""Bytes of all samples that are held at a time: archives are read that much faster in few turns."""


def envelope(dataset: xr.Dataset, quantiles: Sequence[float] = (0.05, 0.5, 0.95)) -> xr.Dataset:
    """Smallest, largest and mean amplitude over the samples, and its quantiles, on a grid.

    Parameters
    ----------
    dataset
        Result on a grid (``at=``).
    quantiles
        Probabilities, 0 to 1; between two samples the quantile is interpolated linearly.

    Returns
    -------
    Dataset with ``amplitude_minimum``, ``amplitude_maximum``, ``amplitude_mean`` (frequency, dof)
    [m] and ``amplitude_quantile`` (frequency, dof, quantile) [m], the same of the largest response
    of all degrees of freedom, ``largest_minimum`` and so on, ``n_used`` and ``n_failed``.

    Raises
    ------
    TypeError, ValueError
        If it is no ensemble on a grid, or for bad quantiles.
    """
    ensemble = Population(dataset)
    if not ensemble.on_grid:
        raise ValueError("dataset: expected a result on a grid (at=), got points of paths")
    probabilities = check.array("quantiles", quantiles, "non-negative")
    if probabilities.ndim != 1 or probabilities.size == 0 or np.any(probabilities > 1):
        raise ValueError(f"quantiles={check.shown(quantiles)}: expected values from 0 to 1")
    grid = ensemble.along
    found: dict[str, list[FloatArray]] = {}
    for block in slices(dataset.sizes[grid], 8 * dataset.sizes["dof"] * ensemble.size, _HELD):
        for name, result in _figures(_of_all_samples(ensemble, block), probabilities).items():
            found.setdefault(name, []).append(result)
    variables = {}
    for name, parts in found.items():
        of_what, statistic = name.split("_")
        dims = (grid, "dof") if of_what == "amplitude" else (grid,)
        dims += ("quantile",) * (statistic == "quantile")
        response = "amplitude" if of_what == "amplitude" else "largest amplitude of all blades"
        about = {"units": "m", "long_name": f"{statistic} of the {response} over the samples"}
        variables[name] = (dims, np.concatenate(parts), about)
    about = {"units": "1", "long_name": "share of the samples below"}
    coordinates = {grid: dataset[grid], "dof": dataset["dof"]}
    result = xr.Dataset(variables, coordinates | {"quantile": ("quantile", probabilities, about)})
    return ensemble.explained(result, "Envelope of an ensemble of responses", per_sample=False)


def _of_all_samples(ensemble: Population, on_grid: slice) -> FloatArray:
    """Amplitudes (n, n_dof, n_used) on a part of the grid, read few samples at a time."""
    shape = on_grid.stop - on_grid.start, ensemble.dataset.sizes["dof"]
    result = np.empty((*shape, np.count_nonzero(ensemble.used)))
    dims, done = (ensemble.along, "dof", ensemble.dim), 0
    for block in slices(ensemble.size, 8 * shape[0] * shape[1]):
        place = {ensemble.along: on_grid, ensemble.dim: block}
        part = ensemble.part("amplitude", dims, place)[..., ensemble.used[block]]
        result[..., done : done + part.shape[-1]] = part
        done += part.shape[-1]
    return result


def _figures(values: FloatArray, probabilities: FloatArray) -> dict[str, FloatArray]:
    """Statistics of amplitudes (n, n_dof, n_used), and of the largest of all degrees of freedom."""
    return {
        f"{of_what}_{name}": result
        for of_what, chosen in (("largest", values.max(axis=1)), ("amplitude", values))
        for name, result in _spread(chosen, probabilities).items()
    }


def _spread(values: FloatArray, probabilities: FloatArray) -> dict[str, FloatArray]:
    """Statistics over the last axis; the values are reordered."""
    if values.shape[-1] == 0:
        nothing = np.full(values.shape[:-1], np.nan)
        quantile = np.repeat(nothing[..., None], len(probabilities), axis=-1)
        return dict(minimum=nothing, maximum=nothing, mean=nothing, quantile=quantile)
    least, most, mean = values.min(axis=-1), values.max(axis=-1), values.mean(axis=-1)
    quantile = np.quantile(values, probabilities, axis=-1, overwrite_input=True)
    return dict(minimum=least, maximum=most, mean=mean, quantile=np.moveaxis(quantile, 0, -1))
