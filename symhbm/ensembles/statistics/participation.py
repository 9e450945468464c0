"""Localisation of the responses of an ensemble on few blades."""

import numpy as np
import xarray as xr

from symhbm.ensembles.statistics.population import Population, meant
from symhbm.numerics import FloatArray
from symhbm.results.reading import largest_of, motions_of


def localisation(dataset: xr.Dataset) -> xr.Dataset:
    """Inverse participation ratio of the amplitudes: the localisation of the response.

    ``sum(a**4) / sum(a**2)**2`` of the amplitudes ``a`` of all degrees of freedom: 1/n_dof where
    they are alike, 1 where only one moves.

    Parameters
    ----------
    dataset
        Result on a grid or along the path.

    Returns
    -------
    Dataset with ``localisation_at_peak`` along the samples, at the largest response over the band
    (at its located peak where there is one), NaN where a sample failed; on a grid also
    ``localisation`` (sample, frequency); ``n_used``, ``n_failed`` and ``n_missing``.

    Raises
    ------
    TypeError, ValueError
        If it is no ensemble.

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
    >>> sh.statistics.localisation(mistuned).localisation_at_peak.values.round(2)
    array([0.09, 0.08, 0.09])
    """
    ensemble = Population(dataset)
    used = xr.DataArray(ensemble.used, dims=ensemble.dim)
    located = ensemble.description.peaks_of_amplitude

    def ratios(part: xr.Dataset) -> xr.Dataset:
        amplitude = part["amplitude"]
        at_peak = amplitude.isel({ensemble.along: _argmax(amplitude.max("dof"), ensemble.along)})
        at_peak = at_peak.transpose(ensemble.dim, "dof")
        if part.sizes.get("peak") and "peak_coefficient" in part and located:
            highest = part.isel(peak=_argmax(part["peak_amplitude"], "peak"))
            higher = (highest["peak_amplitude"] >= at_peak.max("dof")).values
            at_peak.values[higher] = _amplitudes(highest["peak_coefficient"][higher])
        result = {"localisation_at_peak": _participation(at_peak)}
        if ensemble.on_grid:
            result["localisation"] = _participation(amplitude)
        return xr.Dataset({name: array.reset_coords(drop=True) for name, array in result.items()})

    names = ("amplitude", "peak_amplitude", "peak_coefficient")
    result = ensemble.by_samples(ratios, names).where(used)
    meaning = "inverse participation ratio of the amplitudes"
    result["localisation_at_peak"].attrs = meant(f"{meaning} at the peak")
    if ensemble.on_grid:
        result["localisation"].attrs = meant(meaning)
        result = result.assign_coords({ensemble.along: dataset[ensemble.along]})
    return ensemble.explained(result, "Localisation of an ensemble of responses", per_sample=True)


def _participation(amplitude: xr.DataArray) -> xr.DataArray:
    # Relative to the largest: fourth powers of small numbers underflow.
    share = amplitude / amplitude.max("dof", skipna=False)
    return (share**4).sum("dof", skipna=False) / (share**2).sum("dof", skipna=False) ** 2


def _argmax(values: xr.DataArray, dim: str) -> xr.DataArray:
    return values.fillna(-np.inf).argmax(dim)


def _amplitudes(coefficient: xr.DataArray) -> FloatArray:
    """Amplitudes (n_samples, n_dof) of motions; NaN at unbounded peaks, which have none."""
    coefficient = coefficient.transpose(..., "dof", "harmonic", "component")
    return largest_of(*motions_of(coefficient))
