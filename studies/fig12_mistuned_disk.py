"""Fig. 12: tuned and mistuned disk under engine order 3, contact stiffness 1e6 N/m.

All blades of the tuned disk answer alike, with one resonance. Contacts that differ split it, and
excite the families of other nodal diameters beside it, from 77 Hz (one diameter) to 317 Hz (six):
25 samples, the worst of them in colour, blade by blade.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 12.
"""

from concurrent.futures import ProcessPoolExecutor
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.companions import closed_form_peaks
from studies.landmark import Landmark, Source
from studies.run import run

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
OF_BLADES = ("frequency", "amplitude", "amplitude_slope", "amplitude_slope_before")
"""What is drawn of the blades of the worst disk."""
MEAN_AT_FREQUENCY, MEAN_OF_PEAKS = 14.31, 2.234
"""Amplification factors of the largest blade, mean of the first 1,000 samples of the seed."""
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
    worst = sh.rebuild(dataset.sel(sample=worst_sample(dataset)))
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


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the largest response of every disk, and the worst disk blade by blade."""
    mistuned, tuned = dataset.drop_sel(sample=TUNED), dataset.sel(sample=TUNED)
    worst = worst_sample(dataset)
    blades = xr.Dataset(
        {name: dataset[f"worst_{name}"].rename(worst_point="point") for name in OF_BLADES},
        attrs=dataset.attrs,
    )
    with plt.rc_context(sh.plot.STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.8), layout="constrained")
        sh.plot.response(mistuned, ax=left)
        sh.plot.response(tuned, ax=left)
        left.set_title(f"tuned (black) and {mistuned.sizes['sample']} mistuned disks", fontsize=10)
        for blade in range(dataset.sizes["dof"]):
            sh.plot.response(blades, dof=blade, peaks=False, ax=right)
        shades = plt.get_cmap("viridis")(np.linspace(0, 0.92, len(right.lines)))
        for line, color in zip(right.lines, shades, strict=True):
            line.set(color=color, linewidth=0.9)
        sh.plot.response(tuned, peaks=False, ax=right)
        right.lines[-1].set_linewidth(1.8)
        right.set_xlim(*ZOOM)
        right.set_ylim(-130, left.get_ylim()[1])
        right.set_ylabel("response of each blade [dB re 1 m]")
        right.set_title(f"tuned (black), and each blade of disk {worst}", fontsize=10)
        figure.suptitle("Disk of 13 blades, EO 3, $k_d$ = 1e6 N/m, $F_n$ = 10 N, one harmonic")
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
            Source.EXACT,
            of_a_few(mistuned.size),
        ),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
