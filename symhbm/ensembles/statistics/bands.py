"""Envelopes of responses: smallest, largest, mean and quantiles over the samples."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from symhbm.ensembles.statistics.population import Population, meant, slices
from symhbm.numerics import FloatArray, check

_MEMORY = 3 * 2**27
"""Bytes of all samples in memory at a time: archives are read faster in few large blocks."""


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
    of all degrees of freedom, ``largest_minimum`` and so on, ``n_used``, ``n_failed`` and
    ``n_missing``.

    Raises
    ------
    TypeError, ValueError
        If it is no ensemble on a grid, or for bad quantiles.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     13, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(3))
    >>> draws = sh.mistuning.uniform(disk, 3, seed=1, contact_stiffness=0.2)
    >>> mistuned = sh.frf(problem, (200, 220), at=range(200, 221), over=draws)
    >>> band = sh.statistics.envelope(mistuned, quantiles=(0.5,))
    >>> band.amplitude_maximum.dims, int(band.n_used)
    (('frequency', 'dof'), 3)
    """
    ensemble = Population(dataset)
    if not ensemble.on_grid:
        raise ValueError("dataset: expected a result on a grid (at=), got points of paths")
    probabilities = check.array("quantiles", quantiles, "non-negative")
    if probabilities.ndim != 1 or probabilities.size == 0 or np.any(probabilities > 1):
        raise ValueError(f"quantiles={check.shown(quantiles)}: expected values from 0 to 1")
    grid = ensemble.along
    found: dict[tuple[str, str], list[FloatArray]] = {}
    for block in slices(dataset.sizes[grid], 8 * dataset.sizes["dof"] * ensemble.size, _MEMORY):
        values = _of_all_samples(ensemble, block)
        for of_what, chosen in (("largest", values.max(axis=1)), ("amplitude", values)):
            for statistic, part in _spread(chosen, probabilities).items():
                found.setdefault((of_what, statistic), []).append(part)
    variables = {}
    for (of_what, statistic), parts in found.items():
        dims = (grid, "dof") if of_what == "amplitude" else (grid,)
        dims += ("quantile",) * (statistic == "quantile")
        response = "amplitude" if of_what == "amplitude" else "largest amplitude of all blades"
        attributes = meant(f"{statistic} of the {response} over the samples", "m")
        variables[f"{of_what}_{statistic}"] = (dims, np.concatenate(parts), attributes)
    shares = "quantile", probabilities, meant("share of the samples below")
    coordinates = {grid: dataset[grid], "dof": dataset["dof"], "quantile": shares}
    result = xr.Dataset(variables, coordinates)
    return ensemble.explained(result, "Envelope of an ensemble of responses", per_sample=False)


def _of_all_samples(ensemble: Population, values: slice) -> FloatArray:
    """Amplitudes (n, n_dof, n_used) at some values of the grid, read few samples at a time."""
    shape = values.stop - values.start, ensemble.dataset.sizes["dof"]
    result = np.empty((*shape, np.count_nonzero(ensemble.used)))
    dims, done = (ensemble.along, "dof", ensemble.dim), 0
    for block in slices(ensemble.size, 8 * shape[0] * shape[1]):
        region = {ensemble.along: values, ensemble.dim: block}
        amplitudes = ensemble.values("amplitude", dims, region)[..., ensemble.used[block]]
        result[..., done : done + amplitudes.shape[-1]] = amplitudes
        done += amplitudes.shape[-1]
    return result


def _spread(values: FloatArray, probabilities: FloatArray) -> dict[str, FloatArray]:
    """Statistics over the last axis; the values are reordered."""
    if values.shape[-1] == 0:
        empty = np.full(values.shape[:-1], np.nan)
        quantile = np.repeat(empty[..., None], len(probabilities), axis=-1)
        return dict(minimum=empty, maximum=empty, mean=empty, quantile=quantile)
    smallest, largest, mean = values.min(axis=-1), values.max(axis=-1), values.mean(axis=-1)
    quantile = np.moveaxis(np.quantile(values, probabilities, axis=-1, overwrite_input=True), 0, -1)
    return dict(minimum=smallest, maximum=largest, mean=mean, quantile=quantile)
