"""Amplification factors of mistuned samples, and the worst sample."""

from typing import Literal

import numpy as np
import xarray as xr

from symhbm.ensembles.statistics.population import Population, followed, meant
from symhbm.numerics import check
from symhbm.results import Description
from symhbm.results.reading import COMPLETE

Amplification = Literal["amplification_of_peaks", "amplification_at_frequency"]

_PEAKS = ("peak_amplitude", "peak_dof")


def amplification(dataset: xr.Dataset, tuned: xr.Dataset) -> xr.Dataset:
    """Amplification factors of every sample, of two kinds, over the largest tuned response.

    Parameters
    ----------
    dataset
        Result of the mistuned samples, on a grid or along the path.
    tuned
        Result of the tuned structure over the same band.

    Returns
    -------
    Dataset along the samples, NaN where one failed or is missing, with ``n_used``, ``n_failed`` and
    ``n_missing``. Per degree of freedom, and the largest of all with the prefix ``largest_`` and
    its degree of freedom (-1 where the sample failed) with the prefix ``dof_of_largest_``:

    ``amplification_of_peaks``
        Largest response over the band over the largest tuned one. Its attribute ``source`` tells
        where the responses are from: located peaks, or only points of the grid or the path.
    ``amplification_at_frequency``
        Largest ratio of both responses at the same frequency, over the grid; only of results on
        grids. ``frequency_of_amplification`` is where it occurs.

    Raises
    ------
    TypeError, ValueError
        If ``dataset`` is no ensemble, ``tuned`` is incomplete, or they do not belong together.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     13, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(3))
    >>> draws = sh.mistuning.uniform(disk, 2, seed=1, contact_stiffness=0.2)
    >>> mistuned = sh.frf(problem, (200, 220), at=range(200, 221), over=draws)
    >>> tuned = sh.frf(problem, (200, 220), at=range(200, 221))
    >>> sh.statistics.amplification(mistuned, tuned).largest_amplification_of_peaks.values.round(3)
    array([1.251, 1.187])
    """
    return _amplification(dataset, tuned)


def _amplification(dataset: xr.Dataset, tuned: xr.Dataset, warns: bool = True) -> xr.Dataset:
    ensemble = Population(dataset)
    peak, curve, tuned_source = _tuned(tuned, ensemble)
    along, used = ensemble.along, xr.DataArray(ensemble.used, dims=ensemble.dim)
    kinds = {"amplification_of_peaks": "largest response over the largest tuned response"}
    if curve is not None:
        kinds["amplification_at_frequency"] = f"largest ratio of responses at the same {along}"

    def factors(part: xr.Dataset) -> xr.Dataset:
        result = {"amplification_of_peaks": _largest(part, along) / peak}
        if curve is not None:
            ratio = part["amplitude"] / curve
            result["amplification_at_frequency"] = ratio.max(along, skipna=False)
            result["value"] = dataset[along][ratio.fillna(-np.inf).argmax(along)]
        return xr.Dataset({name: array.reset_coords(drop=True) for name, array in result.items()})

    by_sample = ensemble.by_samples(factors, ("amplitude", *_PEAKS)).where(used)
    result = xr.Dataset()
    for kind, meaning in kinds.items():
        factor, of_all = by_sample[kind], f"{meaning}, of all degrees of freedom"
        blade = factor.fillna(-np.inf).argmax("dof")
        largest = factor.max("dof", skipna=False)
        sources = ("grid", "grid", "grid")
        if kind == "amplification_of_peaks":
            sources = (*_sources(dataset, ensemble.description, along), tuned_source)
        common = {"source": sources[0], "tuned_source": sources[2]}
        result[kind] = factor.assign_attrs(common | meant(meaning))
        common["source"] = sources[1]
        result[f"largest_{kind}"] = largest.assign_attrs(common | meant(of_all))
        attributes = meant(f"degree of freedom of the {of_all}")
        result[f"dof_of_largest_{kind}"] = blade.where(used, -1).assign_attrs(attributes)
        if kind == "amplification_at_frequency":
            value, units = by_sample["value"], dataset[along].attrs["units"]
            attributes = meant(f"{along} of the {meaning}", units)
            result[f"{along}_of_amplification"] = value.assign_attrs(attributes)
            attributes = meant(f"{along} of the {of_all}", units)
            of_blade = value.isel(dof=blade).assign_attrs(attributes)
            result[f"{along}_of_largest_amplification"] = of_blade
    title = "Amplification factors of an ensemble"
    return ensemble.explained(result, title, per_sample=True, warns=warns)


def worst(
    dataset: xr.Dataset, tuned: xr.Dataset, by: Amplification = "amplification_of_peaks"
) -> xr.Dataset:
    """The sample with the largest amplification: its response and parameters.

    Parameters
    ----------
    dataset, tuned
        As in `amplification`.
    by
        The kind of amplification that decides.

    Returns
    -------
    That sample of ``dataset``, which `symhbm.datasets.rebuild` makes its problem of, with the
    variables of `amplification`; ``dof_of_largest_...`` is the blade. ``n_failed`` samples took no
    part.

    Raises
    ------
    TypeError, ValueError, KeyError
        As `amplification`, for an unknown ``by``, and where every sample failed.

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
    >>> tuned = sh.frf(problem, (200, 220), at=range(200, 221))
    >>> sh.statistics.worst(mistuned, tuned).sample.item()
    2
    """
    factors = _amplification(dataset, tuned, warns=False)  # an error says it
    kinds = [str(name) for name in factors if str(name).startswith("amplification_")]
    check.known(by, kinds, "amplification of these results")
    largest = factors[f"largest_{by}"]
    if not factors["n_used"].item():
        n_missing = factors["n_missing"].item()
        raise ValueError(
            f"dataset: expected a sample that is complete, {factors['n_failed'].item()} failed"
            + f", {n_missing} are not computed" * bool(n_missing)
        )
    sample = {largest.dims[0]: int(np.nanargmax(largest.values))}
    new = factors.isel(sample).drop_vars([name for name in factors if name in dataset.variables])
    return dataset.isel(sample).load().assign(new.data_vars)


def _largest(part: xr.Dataset, along: str) -> xr.DataArray:
    """Largest response of each degree of freedom, over its points and its located peaks."""
    # NaN is padding of a path, but a missing response on a grid.
    largest = part["amplitude"].max(along, skipna=along == "point")
    if part.sizes.get("peak") and _located(part):
        of_dof = part["peak_amplitude"].where(part["peak_dof"] == part["dof"])
        largest = xr.apply_ufunc(np.maximum, largest, of_dof.max("peak").fillna(0.0))
    return largest


def _located(dataset: xr.Dataset) -> bool:
    """Whether there are located peaks of what the amplitudes are of."""
    return all(name in dataset for name in _PEAKS) and Description(dataset).peaks_of_amplitude


def _tuned(tuned: xr.Dataset, ensemble: Population) -> tuple[float, xr.DataArray | None, str]:
    """The largest tuned response, the response on a common grid or None, and its source."""
    tuned, description, along = followed(tuned, "tuned")
    if tuned["status"].ndim:
        raise ValueError(f"tuned: expected one response, got one for each {tuned['status'].dims}")
    if tuned["status"].item() not in COMPLETE:
        raise ValueError(f"tuned: expected a complete response: {tuned['status'].item()}")
    dataset, band = ensemble.dataset, description.band
    expected = ensemble.description
    if tuned.sizes["dof"] != dataset.sizes["dof"]:
        raise ValueError(
            f"tuned: expected {dataset.sizes['dof']} degrees of freedom as in the dataset, got "
            f"{tuned.sizes['dof']}"
        )
    if description.moving != expected.moving or (
        band and expected.band and sorted(band) != sorted(expected.band)
    ):
        raise ValueError(
            f"tuned: expected the {expected.moving} and band of the dataset, "
            f"{expected.band}, got {description.moving}, {band}"
        )
    peak = float(_largest(tuned, along).max(skipna=False))
    curve = None
    if along == ensemble.along != "point":
        if not np.array_equal(tuned[along], dataset[along]):
            raise ValueError(f"tuned: expected the grid of the dataset (coordinate {along!r})")
        curve = tuned["amplitude"].max("dof", skipna=False).reset_coords(drop=True).load()
    if not 0 < peak < np.inf or (curve is not None and not np.all(curve > 0)):
        raise ValueError("tuned: expected bounded responses > 0, factors are relative to them")
    return peak, curve, _sources(tuned, description, along)[1]


def _sources(dataset: xr.Dataset, description: Description, along: str) -> tuple[str, str]:
    """Sources of the largest response of each degree of freedom, and of that of all."""
    points = "points of the path" if along == "point" else "grid"
    located = _located(dataset)
    per_dof = located and description.per_dof
    return "located peaks" if per_dof else points, "located peaks" if located else points
