"""Fig. 12: tuned and mistuned disk under engine order 3, contact stiffness 1e6 N/m.

All blades of the tuned disk answer alike, with one resonance. Contacts that differ excite the
families of other nodal diameters beside it, from 77 Hz (one diameter) to 317 Hz (six), and split
their resonances in two; that with three diameters, where the contacts slip, stays one plateau.

The percentages of the source are read as half-widths of uniform draws about the nominal values. Its
right half shows an arbitrary set of them; ours shows the disk with the highest peak.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 12.
"""

from concurrent.futures import ProcessPoolExecutor
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.signal import find_peaks

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.claim import Claim
from studies.closed_form import StuckRing
from studies.companions import closed_form_peaks
from studies.landmark import Landmark, Source
from studies.load_curves import decibels
from studies.run import run
from studies.source_axes import draw_blades, in_styles, set_axes

NAME = "fig12_mistuned_disk"
ENGINE_ORDER = 3
NORMAL_LOAD = 10  # N
BAND = (50, 350)  # Hz
N_SAMPLES = 25
SEED = 2013
HALF_WIDTHS: dict[str, Any] = dict(friction_coefficient=0.4, contact_stiffness=0.2, normal_load=0.3)
"""Relative half-widths of the uniform draws of each contact."""
TUNED = -1
"""Label of the tuned disk among the samples."""
ZOOM = (150, 280)  # Hz
TICKS = (50, 350, 50), (-150, -95, 5)
"""Ticks of the source, in Hz and dB."""
DISTINCT = 1.0
"""Height [dB] over the dip beside it from which a peak counts as one of its own."""
OF_BLADES = ("frequency", "amplitude", "amplitude_slope", "amplitude_slope_before")
"""What is drawn of the blades of the worst disk."""
MEAN_AT_FREQUENCY, MEAN_OF_PEAKS = 14.07, 2.234
"""Amplification of the largest blade, mean of 1,000 samples (`studies.many_mistuned_disks`)."""
WORST_OF_25 = 2.87
"""Median of the worst of 25 of them, peak over peak."""
SCATTER = 0.15
"""Standard deviation of these factors over their mean."""


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the disk of Fig. 8 under engine order 3, with 10 N."""
    return fig08.problem(harmonics).with_parameters(
        engine_order=ENGINE_ORDER, normal_load=NORMAL_LOAD
    )


def samples(tuned: sh.HarmonicBalance) -> xr.Dataset:
    """Draw the contacts of mistuned disks."""
    return sh.mistuning.uniform(tuned, N_SAMPLES, seed=SEED, **HALF_WIDTHS)


def of_a_few(n_samples: int) -> float:
    """Relative tolerance of a mean over some samples: three times its standard error."""
    return 3 * SCATTER / np.sqrt(n_samples)


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the responses of the tuned disk, sample -1, and of the mistuned ones.

    Those of the worst disk once more, with the peaks of each blade: between its points the path
    then tells each blade's response.
    """
    tuned = problem()
    drawn = samples(tuned)
    nominal = xr.zeros_like(drawn.isel(sample=[0])).assign_coords(sample=[TUNED])
    for name in drawn:
        nominal[name] = nominal[name] + tuned.parameters[str(name)]
    over = xr.concat([nominal, drawn], "sample", combine_attrs="override")
    with ProcessPoolExecutor() as pool:
        dataset = sh.frf(tuned, BAND, over=over, throw=True, executor=pool, progress=progress)
    worst = sh.datasets.rebuild(dataset.sel(sample=worst_sample(dataset)))
    blades = sh.frf(worst, BAND, peaks="each", throw=True, progress=False)
    found = blades[list(OF_BLADES)].rename(point="worst_point").reset_coords()
    return dataset.assign({f"worst_{name}": found[name].variable for name in OF_BLADES})


def bound(dataset: xr.Dataset) -> xr.DataArray:
    """Largest displacement [m] that any contacts allow under an engine order, one harmonic."""
    n_blades = dataset.sizes["dof"]
    damping = 2 * np.pi * dataset.frequency * dataset.damping.mean()
    return (1 + np.sqrt(n_blades)) / 2 * dataset.force_amplitude / damping


def worst_sample(dataset: xr.Dataset) -> int:
    """The sample with the highest peak."""
    return int(dataset.peak_amplitude.max("peak").idxmax("sample"))


def blades_of_worst(dataset: xr.Dataset) -> xr.Dataset:
    """The responses of the blades of the worst disk, as one curve."""
    return xr.Dataset(
        {name: dataset[f"worst_{name}"].rename(worst_point="point") for name in OF_BLADES},
        attrs=dataset.attrs,
    )


def shades(dataset: xr.Dataset) -> np.ndarray:
    """A colour per blade."""
    return plt.get_cmap("viridis")(np.linspace(0, 0.92, dataset.sizes["dof"]))


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the largest response of every disk, and the worst disk blade by blade."""
    mistuned, tuned = dataset.drop_sel(sample=TUNED), dataset.sel(sample=TUNED)
    worst = worst_sample(dataset)
    with sh.plot.panels(1, 2, size=(11.0, 4.8)) as (figure, (left, right)):
        sh.plot.response(mistuned, ax=left)
        sh.plot.response(tuned, ax=left)
        left.set_title(f"tuned (dashed) and {mistuned.sizes['sample']} mistuned disks", fontsize=10)
        thin, mean = left.lines[0], left.lines[-2]
        left.legend([thin, mean], ["one mistuned disk", "tuned disk"], loc="lower left")
        lines = draw_blades(right, blades_of_worst(dataset), shades(dataset), linewidth=0.9)
        in_styles(lines)
        sh.plot.response(tuned, peaks=False, ax=right)
        right.lines[-1].set_linewidth(1.8)
        right.set_xlim(*ZOOM)
        right.set_ylim(-130, left.get_ylim()[1])
        right.set_ylabel("response of each blade [dB re 1 m]")
        names = [*map(str, range(len(lines))), "tuned"]
        look: Any = dict(loc="outside right center", alignment="left", handlelength=3.2)
        figure.legend([*lines, right.lines[-1]], names, title="blade", **look)
        right.set_title(f"tuned (thick), and each blade of disk {worst}", fontsize=10)
        figure.suptitle("Disk of 13 blades, EO 3, $k_d$ = 1e6 N/m, $F_n$ = 10 N, one harmonic")
    return figure


def draw_on_source_axes(dataset: xr.Dataset) -> Figure:
    """Draw the blades of the tuned disk, and those of the worst one, on the axes of the source."""
    halves = {
        "tuned disk, all blades alike": dataset.sel(sample=TUNED),
        f"mistuned disk {worst_sample(dataset)}": blades_of_worst(dataset),
    }
    with sh.plot.panels(1, 2, size=(12.0, 5.6)) as (figure, axes):
        for ax, (words, curve) in zip(axes, halves.items(), strict=True):
            in_styles(draw_blades(ax, curve, shades(dataset), linewidth=1.0))
            set_axes(ax, *TICKS)
            ax.set_title(words)
        lines = axes[0].lines
        names = [f"{blade}" for blade in range(len(lines))]
        look: Any = dict(loc="outside right center", alignment="left", handlelength=3.2)
        figure.legend(lines, names, title="blade", **look)
        figure.suptitle("Fig. 12: 13 blades, EO 3, $k_d$ = 1e6 N/m, $F_n$ = 10 N, one harmonic")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """The tuned peak, the bound of all responses, and how much mistuning adds to the peak."""
    tuned = dataset.sel(sample=[TUNED])
    beyond = (dataset.amplitude > bound(dataset)).any("dof").sum()
    mistuned = dataset.drop_sel(sample=TUNED).peak_amplitude.max("peak")
    factor = mistuned / float(tuned.peak_amplitude.max())
    return [
        *closed_form_peaks(tuned, "sample"),
        Landmark(
            "responses beyond the bound of any mistuning of contacts",
            int(beyond),
            0,
            "",
            Source.CLOSED_FORM,
            0,
        ),
        Landmark(
            "mean of the highest peak over the tuned one",
            float(factor.mean()),
            MEAN_OF_PEAKS,
            "",
            Source.SAMPLED,
            of_a_few(mistuned.size),
        ),
    ]


def families(dataset: xr.Dataset) -> xr.Dataset:
    """Peaks and levels of every mistuned disk about the resonances of the tuned one, by diameters.

    Each resonance has the part of the band up to the middle of that of the next one. ``count`` has
    the peaks of the largest response that stand out by more than `DISTINCT`, ``level`` [dB re 1 m]
    the largest response.
    """
    natural = natural_frequencies(dataset)
    middles = (natural[1:-1] + natural[2:]) / 2
    dataset = dataset.drop_sel(sample=TUNED)
    samples = dataset.sample.values
    count = np.zeros((len(samples), len(natural) - 1), dtype=int)
    level = np.full(count.shape, np.nan)
    for i in range(len(samples)):
        one = dataset.isel(sample=i)
        frequency = np.append(one.frequency.values, one.peak_frequency.values)
        amplitude = np.append(one.amplitude.max("dof").values, one.peak_amplitude.values)
        known = np.isfinite(frequency) & np.isfinite(amplitude)
        order = np.argsort(frequency[known])
        frequency, height = frequency[known][order], 20 * np.log10(amplitude[known][order])
        tops, _ = find_peaks(height, prominence=DISTINCT)
        family = np.searchsorted(middles, frequency)
        count[i] = np.bincount(family[tops], minlength=len(natural) - 1)
        level[i] = [height[family == n].max() for n in range(len(natural) - 1)]
    coords = {"sample": samples, "diameters": np.arange(1, len(natural))}
    dims = tuple(coords)
    return xr.Dataset({"count": (dims, count), "level": (dims, level)}, coords)


def natural_frequencies(dataset: xr.Dataset) -> np.ndarray:
    """Natural frequencies [Hz] of the tuned disk where no contact slips, by nodal diameters."""
    tuned = dataset.sel(sample=TUNED)
    names = "mass", "damping", "stiffness", "contact_stiffness"
    values = {name: float(tuned[name].mean()) for name in names}
    return StuckRing(n=dataset.sizes["dof"], force=1.0, **values).natural_frequencies()


def plateau_around(one: xr.Dataset, hertz: float, level: float) -> tuple[float, float]:
    """Where the largest response stays within 3 dB of a level [dB re 1 m] around a frequency."""
    frequency, amplitude = sh.plot.curve(one)
    order = np.argsort(frequency)
    frequency, height = frequency[order], decibels(amplitude[order]) - level
    fine = np.linspace(*BAND, 30_001)
    outside = np.interp(fine, frequency, height) < decibels(np.sqrt(0.5))
    low, high = fine[outside & (fine < hertz)].max(), fine[outside & (fine > hertz)].min()
    return float(low), float(high)


def slip_of_families(dataset: xr.Dataset, found: xr.Dataset) -> tuple[float, float]:
    """Share of the period that the contact which slips most does so, where responses are largest.

    The largest of resonances that split, and the least of those of the engine order.
    """
    natural = natural_frequencies(dataset)
    middles = (natural[1:-1] + natural[2:]) / 2
    split, own = [], []
    for sample in found.sample.values:
        one = dataset.sel(sample=sample).dropna("point", subset=["frequency"])
        family = np.searchsorted(middles, one.frequency.values)
        amplitude = one.amplitude.max("dof").values
        slip = 1 - one.stick_fraction.min("contact").values
        for n in found.diameters.values.tolist():
            share = slip[np.argmax(np.where(family == n - 1, amplitude, 0.0))]
            if n == ENGINE_ORDER:
                own.append(share)
            elif int(found["count"].sel(sample=sample, diameters=n)) > 1:
                split.append(share)
    return max(split), min(own)


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of its Fig. 12."""
    found = families(dataset)
    n_disks = found.sizes["sample"]
    others = [n for n in found.diameters.values if n != ENGINE_ORDER]
    excited = (found["count"] >= 1).sum("sample")
    split = (found["count"] >= 2).sum("sample")
    tuned, drawn = dataset.sel(sample=TUNED), worst_sample(dataset)
    levels = found.level.sel(sample=drawn, diameters=[1, 2, ENGINE_ORDER]).values
    natural = float(decibels(tuned.peak_amplitude.max().item()))
    exceeding = (found.level.sel(diameters=[1, 2]) > natural).sum("sample").values
    plateau = plateau_around(dataset.sel(sample=drawn), 220.0, levels[-1])
    flat = plateau_around(tuned, 220.0, natural)
    slipping, third = slip_of_families(dataset, found)

    def counts(table: xr.DataArray) -> str:
        return ", ".join(f"{int(table.sel(diameters=n))} ({n})" for n in others)

    return [
        Claim(
            f"Other modes than that of EO = {ENGINE_ORDER} are excited (EO = 1, 2, 4, 5 and 6)",
            "Fig. 12",
            f"of {n_disks} disks, by nodal diameters, {counts(excited)} have peaks there",
            bool((excited.sel(diameters=others) >= 0.9 * n_disks).all()),
            True,
        ),
        Claim(
            "Peaks flatten around 220 Hz, the third mode",
            "Fig. 12",
            "the disk of our Fig. 12 stays within 3 dB of its third mode from "
            f"{plateau[0]:.0f} to {plateau[1]:.0f} Hz, the tuned one of its peak from "
            f"{flat[0]:.0f} to {flat[1]:.0f} Hz",
            plateau[1] - plateau[0] > 0.1 * 220,
            True,
        ),
        Claim(
            "Splitting is not associated to peak flattening",
            "Fig. 12",
            "where a mode splits in two, the contact that slips most does so for "
            f"{100 * slipping:.0f} % of the period at most, on the plateau of the third for "
            f"{100 * third:.0f} % at least",
            slipping < third,
            True,
        ),
        Claim(
            "Except for the third mode, modes separate in two peaks",
            "Fig. 12",
            f"of {n_disks} disks, by nodal diameters, {counts(split)} have two peaks or more that "
            f"stand out by {DISTINCT:g} dB; the third mode {int(split.sel(diameters=3))}",
            bool((split.sel(diameters=others) > n_disks / 2).all() and split.sel(diameters=3) == 0),
            True,
        ),
        Claim(
            "The first and second modes show higher amplitudes, beyond that of the natural mode",
            "Fig. 12",
            f"in the disk of our Fig. 12 {levels[0]:.1f} and {levels[1]:.1f} dB, its third mode "
            f"{levels[2]:.1f} and the tuned disk {natural:.1f} dB; beyond the tuned one in "
            f"{exceeding[0]} and {exceeding[1]} of {n_disks} disks",
            bool(min(levels[:2]) > max(levels[2], natural)),
            True,
        ),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw, draw_on_source_axes)
