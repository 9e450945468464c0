"""What stands beside the curves of a figure: peaks with enough harmonics, and full stick."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

import symhbm as sh
from studies.claim import Finding
from studies.closed_form import EXACT_DIGITS, one_blade
from studies.landmark import Landmark, Source, number

ACCURACY = 1e-3
"""Truncation error asked for where one harmonic is compared with enough of them."""
VISIBLE = 0.25
"""Error of an amplitude [dB] up to which one harmonic is said to suffice, for blade and ring."""
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


def stick_at_peak(dataset: xr.Dataset) -> xr.DataArray:
    """Share of the period that the contacts of a tuned structure stick where it responds most."""
    amplitude = dataset.amplitude.max("dof")
    at_most = dataset.stick_fraction.isel(point=amplitude.fillna(0).argmax("point"))
    return at_most.mean("contact")


def stuck_peak(curve: xr.Dataset) -> tuple[float, float]:
    """Amplitude [m] and frequency [Hz] of the peak of one curve where no contact slips."""
    return one_blade(curve, normal_load=ALL_STICK).peak()


def free_peak(curve: xr.Dataset) -> tuple[float, float]:
    """Amplitude [m] and frequency [Hz] of the peak of one curve without contacts."""
    return one_blade(curve, normal_load=0.0).peak()


def full_stick_load(peaks: xr.Dataset) -> xr.DataArray:
    """Normal load [N] that holds all contacts at peaks of a response where nothing slips.

    Its only harmonic is the first. The contacts are those of a ring, or of one blade to the ground.
    """
    moved = peaks.peak_coefficient.sel(harmonic=1)
    if peaks.sizes["dof"] > 1:
        moved = moved - moved.roll(dof=-1, roll_coords=False)
    stretch = np.sqrt((moved**2).sum("component", skipna=False)).rename(dof="contact")
    return (peaks.contact_stiffness * stretch / peaks.friction_coefficient).max("contact")


def closed_form_peaks(
    dataset: xr.Dataset, dim: str, resonances: bool = True, also: str = ""
) -> list[Landmark]:
    """Amplitude and frequency of the largest peak over ``dim``, beside their closed forms.

    ``also`` says in words what else tells these peaks from others.
    """
    top = largest_peak(dataset)
    rows = []
    for value in dataset[dim].values:
        one = top.sel({dim: value})
        amplitude, frequency = one_blade(one).peak()
        found = float(one.peak_amplitude), float(one.peak_frequency)
        label = ", ".join(filter(None, (labelled(dim, value), also)))
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


def one_harmonic(dataset: xr.Dataset, dim: str, fails: tuple = (), also: str = "") -> list[Finding]:
    """Whether one harmonic suffices for the peak over ``dim``, and does not where it ``fails``.

    ``also`` says in words what else tells these peaks from others.
    """
    ratio = one_harmonic_ratio(dataset)
    return [
        of_one_harmonic(
            float(ratio.sel({dim: value})),
            ", ".join(filter(None, (labelled(dim, value), also))),
            value in fails,
        )
        for value in dataset[dim].values
    ]


def one_harmonic_ratio(dataset: xr.Dataset) -> xr.DataArray:
    """Largest peak with one harmonic over that with enough of them."""
    return largest_peak(dataset).peak_amplitude / dataset.accurate_peak_amplitude


def suffices(ratio: float) -> bool:
    """Whether an amplitude with one harmonic, over the true one, is off by less than is visible."""
    return abs(decibels(ratio)) <= VISIBLE


def of_one_harmonic(ratio: float, where: str, fails: bool) -> Finding:
    """Whether one harmonic suffices: ``ratio`` is its peak over that with enough harmonics."""
    verdict = f"errs by more than {VISIBLE:g} dB" if fails else f"is good to {VISIBLE:g} dB"
    return Finding(
        f"One harmonic {verdict} at the peak",
        f"{where}: {round(100 * (ratio - 1), 2) + 0.0:+.2f} %",
        suffices(ratio) is not fails,
    )


def of_wave_amplitude(where: str, level: float, end: float) -> Finding:
    """Which of two amplitudes of the wave keeps a line above the lower end of the source's axis.

    ``level`` [dB re 1 m] is with that of ours, where nothing slips, and ``end`` that of the axis.
    """
    higher = level + decibels(np.sqrt(2))
    return Finding(
        "With waves of amplitude f0 lines leave the axes of the source at their lower end, with "
        "the sqrt(2) f0 of Eq. (12) they would not",
        f"{where}: {level:.1f} dB with f0, {higher:.1f} dB with sqrt(2) f0; the axis ends at "
        f"{end:g} dB",
        level < end < higher,
    )


def decibels(ratio: float) -> float:
    """A ratio of amplitudes, or an amplitude [m], in dB, or dB re 1 m."""
    return 20 * float(np.log10(ratio))


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
