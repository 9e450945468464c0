"""Ensembles as a page holds them: bands of responses, and the largest response of each sample."""

from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from symhbm.ensembles import statistics
from symhbm.numerics import FloatArray
from symhbm.plot.curves import picture_of, shown_amplitude
from symhbm.plot.drawing import moving
from symhbm.plot.places import chosen
from symhbm.plot.viewer.layout import Layout
from symhbm.plot.viewer.packing import packed, plain
from symhbm.plot.viewer.sets import label_of, spoken, values_of
from symhbm.results import Description
from symhbm.results.reading import COMPLETE, SAMPLE, set_dimensions

QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)
"""Shares of the samples below the lines of a band."""
N_VALUES = 501
"""Values of the common grid of paths."""
_MOST_BANDS = 12
_FEWEST = 3
"""Most bands of a page, and fewest samples of one."""


def samples_of(dataset: xr.Dataset) -> str | None:
    """The dimension of the samples, None where the sets are those of swept values alone."""
    return SAMPLE if dataset.sizes.get(SAMPLE, 0) >= _FEWEST else None


def bands_of(dataset: xr.Dataset, layout: Layout, dim: str) -> tuple[list[dict], list[str]]:
    """Quantiles of the largest response over the samples, one entry for each other set."""
    others = [d for d in set_dimensions(dataset) if d != dim]
    places = [*product(*(range(dataset.sizes[d]) for d in others))]
    notes = []
    if len(places) > _MOST_BANDS:
        notes.append(f"Bands are shown of the first {_MOST_BANDS} of {len(places)} sets.")
    bands = []
    for place in places[:_MOST_BANDS]:
        position = dict(zip(others, place, strict=True))
        part = dataset.isel(position)
        value, amplitude, folded = _amplitudes(part, layout, dim)
        # A sample with a hole in it is left out as a whole, as in statistics.
        used = np.isfinite(amplitude).all(axis=1) & _complete(part, dim)
        entry = {
            "n": [int(used.sum()), len(used)],
            "label": values_of(dataset, position),
            "value": packed(value),
        }
        if used.any():
            rows = np.quantile(amplitude[used], QUANTILES, axis=0)
            entry["rows"] = [packed(row) for row in rows]
            entry["names"] = [_name(share) for share in QUANTILES]
        if folded:
            entry["folded"] = folded
        bands.append(entry)
    return bands, notes


def _name(share: float) -> str:
    """What the line below which a share of the samples lies is called."""
    return {0.0: "smallest", 0.5: "median", 1.0: "largest"}.get(share, f"{100 * share:g} %")


def stored_statistics(dataset: xr.Dataset) -> dict[str, Any] | None:
    """An archive of `statistics.envelope` or `statistics.amplification`, None for others."""
    bands, spread = [], []
    used, failed = (int(dataset[n]) if n in dataset else 0 for n in ("n_used", "n_failed"))
    x = Description(dataset).moving
    if "largest_quantile" in dataset and dataset["largest_quantile"].dims == (x, "quantile"):
        quantiles = dataset["largest_quantile"].values.T
        ends = dataset["largest_minimum"].values, dataset["largest_maximum"].values
        names = [_name(share) for share in dataset["quantile"].values.tolist()]
        order = np.argsort(dataset["quantile"].values, kind="stable")
        bands.append(
            {
                "n": [used, used + failed],
                "label": "",
                "value": packed(dataset[x].values),
                "rows": [packed(row) for row in (ends[0], *quantiles[order], ends[1])],
                "names": [_name(0.0), *(names[k] for k in order), _name(1.0)],
            }
        )
    for name in ("amplification_of_peaks", "amplification_at_frequency"):
        if f"largest_{name}" in dataset and dataset[f"largest_{name}"].ndim == 1:
            factors = dataset[f"largest_{name}"]
            about = plain(factors.attrs.get("long_name", name))
            dim = str(factors.dims[0])
            spread.append(_spread(dataset, dim, factors.values, about, "") | {"label": about})
    if not bands and not spread:
        return None
    units = plain(dataset[x].attrs.get("units", ""), 40) if x in dataset.variables else ""
    return {"dim": "sample", "x": _axis(x, units), "bands": bands, "spread": spread, "how": ""}


def _axis(title: str, units: str) -> dict[str, str]:
    return {"title": spoken(title), "units": units}


def _complete(part: xr.Dataset, dim: str) -> np.ndarray:
    texts = part["status"].transpose(dim).values.astype(str)
    return np.isin(texts, [*map(str, COMPLETE)])


def _amplitudes(part: xr.Dataset, layout: Layout, dim: str) -> tuple[FloatArray, FloatArray, int]:
    """Values (n,), amplitudes (n_samples, n) [m], NaN where unknown, and how many paths fold."""
    if layout.along != ("point",):
        if part.sizes.get("solution", 1) > 1:
            raise ValueError("there are several solutions at one value")
        part = part.isel(solution=0) if "solution" in part.dims else part
        return (
            part[layout.x].values,
            shown_amplitude(part, chosen(part, None)).transpose(dim, ...).values,
            0,
        )
    every = part[layout.x].values
    ends = Description(part).band or [np.nanmin(every), np.nanmax(every)]
    space = np.geomspace if layout.wide and min(ends) > 0 else np.linspace
    value, folded = space(min(ends), max(ends), N_VALUES), 0
    # Band ends come back without round-off.
    value[[0, -1]] = min(ends), max(ends)
    amplitude = np.full((part.sizes[dim], N_VALUES), np.nan)
    for sample in range(part.sizes[dim]):
        one = part.isel({dim: sample})
        line = picture_of(one, moving(one), chosen(one, None)).line
        if line.is_function:
            amplitude[sample] = line.read(value)
        else:
            folded += 1
    return value, amplitude, folded


def spread_of(dataset: xr.Dataset, dim: str, tuned: xr.Dataset | None) -> list[dict[str, Any]]:
    """The largest response of each sample, or its amplification, one entry for each other set."""
    others = [d for d in set_dimensions(dataset) if d != dim]
    entries = []
    for place in [*product(*(range(dataset.sizes[d]) for d in others))][:_MOST_BANDS]:
        position = dict(zip(others, place, strict=True))
        part = dataset.isel(position)
        if tuned is None:
            values, what, units = _largest(part, dim), "largest response of the sample", "m"
        else:
            factors = statistics.amplification(part, tuned)
            values = factors["largest_amplification_of_peaks"].values
            what, units = "largest response over the largest tuned response", ""
        entry = _spread(part, dim, values, what, units)
        entries.append(entry | {"label": values_of(dataset, position)})
    return entries


def _spread(
    part: xr.Dataset, dim: str, values: FloatArray, what: str, units: str
) -> dict[str, Any]:
    """Values of the samples in ascending order, and whose they are."""
    known = np.flatnonzero(np.isfinite(values))
    order = known[np.argsort(values[known], kind="stable")]
    return {
        "what": what,
        "units": units,
        "n": [len(known), len(values)],
        "value": packed(values[order]),
        "labels": [label_of(part, dim, int(k)) for k in order],
    }


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
