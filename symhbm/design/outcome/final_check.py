"""The response at a design, followed once more, beside what the search says of it."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from symhbm.design.cases import NamedPeak
from symhbm.numerics import FloatArray
from symhbm.peaks import COMPLETE
from symhbm.results import Sweep

_SAME = 1e-9
"""Largest relative difference of two surveys of one peak."""


class Comparison(NamedTuple):
    """Stored points and peaks within the bands, and the highest of them over what was said.

    ``complete`` tells that all curves reached the ends of their bands.
    """

    n_points: int
    n_peaks: int
    highest: float
    complete: bool

    @property
    def agrees(self) -> bool:
        """Whether no point and no peak is higher."""
        return self.complete and self.highest <= 1 + _SAME

    @property
    def text(self) -> str:
        """The sentence of a certificate."""
        what = f"of its {self.n_points} stored points and {self.n_peaks} peaks in the band"
        if not self.complete:
            return "The response, followed once more, did not reach the end of the band."
        if self.agrees:
            return f"Checked: the response was followed once more, and none {what} is higher."
        return (
            f"The check failed: the response was followed once more, and one {what} is higher by "
            f"{self.highest - 1:.1e}."
        )


def compared(result: xr.Dataset, sweep: Sweep, peak: NamedPeak, heights: FloatArray) -> Comparison:
    """Stored amplitudes of a response beside the logarithms of the largest (n_cases,) of a peak."""
    counts, highest = [0, 0], 0.0
    for number in range(sweep.size):
        index = np.unravel_index(number, sweep.shape) if sweep.shape else ()
        one = result.isel(dict(zip(sweep.dims, index, strict=True)))
        amplitude = one["amplitude"]
        amplitude = amplitude.max("dof") if peak.dof is None else amplitude.isel(dof=peak.dof)
        if peak.goal is not None:
            amplitude = xr.full_like(amplitude, np.nan)  # of goals peaks alone are stored
        found = [(one["frequency"].values, amplitude.values)]
        if peak.dof is None:  # peaks that are stored are those of the largest response
            found.append((one["peak_frequency"].values, one["peak_amplitude"].values))
        for kind, (frequency, amplitude) in enumerate(found):
            bands = [(frequency >= low) & (frequency <= high) for low, high in peak.bands[number]]
            inside = np.any(bands, axis=0) & ~np.isnan(amplitude)
            counts[kind] += int(inside.sum())
            largest = amplitude[inside].max(initial=0.0)
            highest = max(highest, float(largest / np.exp(heights[number])))
    return Comparison(counts[0], counts[1], highest, is_complete(result))


def is_complete(result: xr.Dataset) -> bool:
    """Whether all curves of responses reached the ends of their bands."""
    return bool(result["status"].isin([*map(str, COMPLETE)]).all())
