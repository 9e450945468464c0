"""What stands beside the curves of a figure: peaks with enough harmonics, and full stick."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

import symhbm as sh
from studies.closed_form import EXACT_DIGITS, one_blade
from studies.landmark import Landmark, Source, number

ACCURACY = 1e-3
"""Truncation error asked for where one harmonic is compared with enough of them."""
SUFFICES = 0.01
"""Error of a peak up to which one harmonic is said to suffice."""
ONE_HARMONIC = "One harmonic suffices"
ALL_STICK = 1e9
"""Normal load [N] at which nothing slips in any figure."""


def with_companions(
    dataset: xr.Dataset,
    problem: sh.HarmonicBalance,
    band: tuple[float, float],
    over: Mapping[str, Any],
) -> xr.Dataset:
    """Add the largest peak with enough harmonics, and the normal load of full stick, per curve."""
    enough = largest_peak(
        sh.frf(problem, band, over=over, accuracy=ACCURACY, throw=True, progress=False)
    )
    others = {name: values for name, values in over.items() if name != "normal_load"}
    stuck = problem.with_parameters(normal_load=ALL_STICK)
    held = full_stick_load(
        largest_peak(sh.frf(stuck, band, over=others, throw=True, progress=False))
    )
    about = f"at the largest peak, with a truncation error of {ACCURACY:g}"
    added = {
        "accurate_peak_amplitude": (enough.peak_amplitude, "m", f"displacement {about}"),
        "accurate_peak_frequency": (enough.peak_frequency, "Hz", f"frequency {about}"),
        "accurate_peak_highest_harmonic": (
            enough.peak_highest_harmonic,
            "1",
            f"highest harmonic {about}",
        ),
        "full_stick_normal_load": (held, "N", "normal load from which no contact slips"),
    }
    return dataset.assign(
        {
            name: (values.dims, values.values, {"units": units, "long_name": long_name})
            for name, (values, units, long_name) in added.items()
        }
    )


def largest_peak(dataset: xr.Dataset) -> xr.Dataset:
    """Largest peak of each curve of a result of `symhbm.frf`; ValueError if one has none."""
    peaks = dataset.drop_dims(["point", "event"], errors="ignore")
    return peaks.isel(peak=peaks.peak_amplitude.argmax("peak"))


def full_stick_load(peaks: xr.Dataset) -> xr.DataArray:
    """Normal load [N] that holds all contacts at peaks of a response where nothing slips.

    Its only harmonic is the first. The contacts are those of a ring, or of one blade to the ground.
    """
    moved = peaks.peak_coefficient.sel(harmonic=1)
    if peaks.sizes["dof"] > 1:
        moved = moved - moved.roll(dof=-1, roll_coords=False)
    stretch = np.sqrt((moved**2).sum("component", skipna=False)).rename(dof="contact")
    return (peaks.contact_stiffness * stretch / peaks.friction_coefficient).max("contact")


def closed_form_peaks(dataset: xr.Dataset, dim: str, resonances: bool = True) -> list[Landmark]:
    """Amplitude and frequency of the largest peak over ``dim``, beside their closed forms."""
    top = largest_peak(dataset)
    rows = []
    for value in dataset[dim].values:
        one = top.sel({dim: value})
        amplitude, frequency = one_blade(one).peak()
        found = float(one.peak_amplitude), float(one.peak_frequency)
        label = labelled(dim, value)
        source = Source.CLOSED_FORM
        rows.append(Landmark(f"peak, {label}", found[0], amplitude, "m", source, EXACT_DIGITS))
        if resonances:
            # The top of a parabola: frequencies have half the digits of amplitudes.
            rows.append(Landmark(f"resonance, {label}", found[1], frequency, "Hz", source, 1e-6))
    return rows


def full_stick(dataset: xr.Dataset, dim: str | None = None) -> list[Landmark]:
    """Load of full stick, over ``dim`` where it differs, beside its closed form."""
    rows = []
    for value in [None] if dim is None else dataset[dim].values:
        one = dataset if dim is None else dataset.sel({dim: value})
        load = one_blade(one).largest_contact_force() / float(np.mean(one.friction_coefficient))
        name = "normal load of full stick" + (f", {labelled(dim, value)}" if dim else "")
        found = float(one.full_stick_normal_load)
        rows.append(Landmark(name, found, load, "N", Source.CLOSED_FORM, EXACT_DIGITS))
    return rows


def one_harmonic_suffices(
    dataset: xr.Dataset, dim: str, fails: tuple = (), tolerance: float = SUFFICES
) -> list[Landmark]:
    """Error of the peak with one harmonic over ``dim``; it does not suffice where it ``fails``."""
    ratio = largest_peak(dataset).peak_amplitude / dataset.accurate_peak_amplitude
    return [
        suffices(
            float(ratio.sel({dim: value})) - 1, labelled(dim, value), value in fails, tolerance
        )
        for value in dataset[dim].values
    ]


def suffices(error: float, where: str, fails: bool, tolerance: float = SUFFICES) -> Landmark:
    """Relative error of a peak with one harmonic, and whether the source's claim holds."""
    return Landmark(
        f"error of the peak with one harmonic, {where}",
        100 * error,
        0.0,
        "%",
        Source.CLAIM if fails else Source.PUBLISHED,
        100 * tolerance,
        ONE_HARMONIC,
    )


def labelled(dim: str, value: Any) -> str:
    """A value of a parameter, as ``F_n = 3 N``."""
    symbol, unit = {
        "contact_stiffness": ("k_d", "N/m"),
        "friction_coefficient": ("mu", ""),
        "normal_load": ("F_n", "N"),
        "engine_order": ("EO", ""),
        "sample": ("sample", ""),
    }[dim]
    return f"{symbol} = {number(value)} {unit}".rstrip()


def nodal_diameters(count: int) -> str:
    """A number of nodal diameters in words."""
    return f"{count} nodal diameter{'' if count == 1 else 's'}"
