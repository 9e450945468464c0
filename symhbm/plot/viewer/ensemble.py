"""Ensembles as a page holds them: bands of responses, and the largest response of each sample."""

from itertools import islice, product
from typing import Any

import numpy as np
import xarray as xr

from symhbm.ensembles import statistics
from symhbm.numerics import FloatArray
from symhbm.plot.drawing import Scale, parameter_axis
from symhbm.plot.ensemble import draw_bands, envelope
from symhbm.plot.picture import Axis, Panel
from symhbm.plot.viewer.packing import as_json, plain
from symhbm.plot.viewer.sets import label_of, spoken, values_of
from symhbm.results import Description
from symhbm.results.reading import COMPLETE, SAMPLE, curve_status, set_dimensions

_MOST_BANDS = 12
_FEWEST = 3
"""Most bands of a page, and fewest samples of one."""


def samples_of(dataset: xr.Dataset) -> str | None:
    """The dimension of the samples, None where the sets are those of swept values alone."""
    return SAMPLE if dataset.sizes.get(SAMPLE, 0) >= _FEWEST else None


def bands_of(dataset: xr.Dataset, dim: str) -> tuple[list[dict[str, Any]], list[str]]:
    """Bands of the largest response over the samples, one picture for each other set, and notes."""
    bands: list[dict[str, Any]] = []
    notes: list[str] = []
    for position in _others(dataset, dim):
        label = values_of(dataset, position)
        try:
            picture = envelope.picture(dataset.isel(position), scale="log", extremes=False)
            bands.append(as_json(picture.panels[0]) | {"label": label})
        except ValueError as error:
            notes.append(f"Bands of {label or 'the samples'} cannot be shown: {error.args[0]}")
            bands.append({"items": [], "label": label})
    n_sets = int(np.prod([dataset.sizes[d] for d in set_dimensions(dataset) if d != dim]))
    if n_sets > len(bands):
        notes.append(f"Bands are shown of the first {_MOST_BANDS} of {n_sets} sets.")
    return bands, notes


def _others(dataset: xr.Dataset, dim: str) -> list[dict[str, int]]:
    """Positions of the sets that samples are of, as many as a page shows."""
    others = [d for d in set_dimensions(dataset) if d != dim]
    places = product(*(range(dataset.sizes[d]) for d in others))
    return [dict(zip(others, place, strict=True)) for place in islice(places, _MOST_BANDS)]


def stored_statistics(dataset: xr.Dataset) -> dict[str, Any] | None:
    """An archive of `statistics.envelope` or `statistics.amplification`, None for others."""
    bands, spread = [], []
    x = Description(dataset).moving
    if "largest_quantile" in dataset and dataset["largest_quantile"].dims == (x, "quantile"):
        n_used = int(dataset["n_used"]) if "n_used" in dataset else 0
        ends = dataset["largest_minimum"].values, dataset["largest_maximum"].values
        quantiles = dataset["largest_quantile"].transpose("quantile", x).sortby("quantile")
        panel = Panel(parameter_axis(dataset, x), Scale("log").axis("largest response"))
        draw_bands(panel, dataset[x].values, ends, quantiles, f"smallest to largest of {n_used}")
        bands.append(as_json(panel) | {"label": ""})
    for name in ("amplification_of_peaks", "amplification_at_frequency"):
        if f"largest_{name}" in dataset and dataset[f"largest_{name}"].ndim == 1:
            factors = dataset[f"largest_{name}"]
            about = plain(factors.attrs.get("long_name", name))
            spread.append(_spread(dataset, str(factors.dims[0]), factors.values, about, about))
    return {"bands": bands, "spread": spread, "how": ""} if bands or spread else None


def _complete(part: xr.Dataset, dim: str) -> np.ndarray:
    status = curve_status(part)
    assert status is not None
    return np.isin(status.transpose(dim).values.astype(str), [*COMPLETE])


def spread_of(dataset: xr.Dataset, dim: str, tuned: xr.Dataset | None) -> list[dict[str, Any]]:
    """The largest response of each sample, or its amplification, one entry for each other set."""
    entries = []
    for position in _others(dataset, dim):
        part = dataset.isel(position)
        if tuned is None:
            values, what = _largest(part, dim), "largest response of the sample [m]"
        else:
            factors = statistics.amplification(part, tuned)
            values = factors["largest_amplification_of_peaks"].values
            what = "largest response over the largest tuned response"
        entries.append(_spread(part, dim, values, what, values_of(dataset, position)))
    return entries


def _spread(
    part: xr.Dataset, dim: str, values: FloatArray, what: str, label: str
) -> dict[str, Any]:
    """Values of the samples in ascending order, and whose they are."""
    known = np.flatnonzero(np.isfinite(values))
    order = known[np.argsort(values[known], kind="stable")]
    panel = Panel(Axis(what), Axis("share of the samples not above", limits=(0, 1.02)))
    share = np.arange(1, len(order) + 1) / max(1, len(order))
    panel.line(values[order], share, drawstyle="steps-post", marker="o", linewidth=1.5)
    names = [f"{spoken(dim)} {label_of(part, dim, int(k))}" for k in order]
    return as_json(panel, names) | {"n": [len(known), len(values)], "label": label}


def _largest(part: xr.Dataset, dim: str) -> FloatArray:
    """The largest response of each complete sample, over its points and its located peaks."""
    found = np.full(part.sizes[dim], -np.inf)
    for name in ("amplitude", "peak_amplitude"):
        if name in part.variables:
            values = part[name].transpose(dim, ...).values.reshape(len(found), -1)
            found = np.fmax(
                found, np.nanmax(values, axis=1, initial=-np.inf, where=values == values)
            )
    return np.where(np.isfinite(found) & _complete(part, dim), found, np.nan)
