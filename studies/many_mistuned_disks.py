"""A thousand mistuned disks of Fig. 12: how much 25 of them can tell about amplification.

The source draws 25 disks once. Here are 1,000 of them, drawn as in Fig. 12 with the same seed, the
first 25 being those of Figs. 12 and 13; means, quantiles and the distribution of the worst of 25
are what those studies are compared with. It takes some minutes, and is not among the studies of
`python -m studies`: `python -m studies.many_mistuned_disks`.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 13.
"""

from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig12_mistuned_disk as fig12
from studies import fig13_amplification as fig13
from studies import sampling
from studies.landmark import Landmark, Source
from studies.run import run

NAME = "many_mistuned_disks"
N_SAMPLES = 1000
KINDS = {
    "largest_amplification_at_frequency": "at the same frequency",
    "largest_amplification_of_peaks": "peak over peak",
}
OF = 25
"""Number of disks whose worst the source tells."""
QUANTILES = (0.05, 0.5, 0.95)
DIGITS = 5e-3
"""Relative difference to which the values that other studies quote are rounded."""


def compute(progress: bool = True) -> xr.Dataset:
    """Follow all disks, and keep how much the largest blade of each amplifies."""
    problem = fig12.problem()
    drawn = sh.mistuning.uniform(problem, N_SAMPLES, seed=fig12.SEED, **fig12.HALF_WIDTHS)
    options: dict[str, Any] = dict(at=fig13.GRID, throw=True)
    tuned = sh.frf(problem, fig12.BAND, progress=False, **options)
    keep = ["amplitude", "peak_frequency", "peak_amplitude", "peak_dof", "peak_kind"]
    with ProcessPoolExecutor() as pool:
        mistuned = sh.frf(
            problem,
            fig12.BAND,
            over=drawn,
            peaks="each",
            keep=keep,
            executor=pool,
            progress=progress,
            **options,
        )
    factors = sh.statistics.amplification(mistuned, tuned)
    names = [*KINDS, "frequency_of_largest_amplification", *drawn.data_vars]
    return factors[names].assign_attrs(
        mistuned.attrs,
        title=f"Amplification of {N_SAMPLES} mistuned disks",
        seed=fig12.SEED,
        n_samples=N_SAMPLES,
    )


def worst(dataset: xr.Dataset, kind: str) -> xr.Dataset:
    """Distribution of the worst of so many disks as the source has, and where its value lies."""
    return sh.statistics.position(dataset[kind], fig13.PUBLISHED, OF, quantiles=QUANTILES)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw how often a disk amplifies more than a value, and the worst of 25."""
    with sh.plot.panels(1, len(KINDS), size=(11.0, 4.4)) as (figure, axes):
        for ax, (kind, words) in zip(axes, KINDS.items(), strict=True):
            values = np.sort(dataset[kind].values)
            share = np.arange(1, len(values) + 1) / len(values)
            half = sampling.of_share(share, len(values))
            ends = np.clip([share - half, share + half], 0, 1)
            ax.fill_between(values, *ends, color="0.8", linewidth=0, label=sampling.WORDS)
            ax.fill_between(values, *ends**OF, color="tab:orange", alpha=0.3, linewidth=0)
            ax.plot(values, share, color="black", label="one disk")
            ax.plot(values, share**OF, "--", color="tab:orange", label=f"worst of {OF}")
            if kind == next(iter(KINDS)):
                ax.axvline(fig13.PUBLISHED, color="0.4", linestyle="--", label="source")
            ax.set_xlabel(f"largest amplification, {words}")
            ax.set_ylabel("probability of less")
            ax.legend(loc="upper left" if kind == next(iter(KINDS)) else "lower right")
        count = dataset.sizes["sample"]
        figure.suptitle(f"{count} disks with mistuned contacts, EO 3, one harmonic")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """The values that Figs. 12 and 13 quote from here."""
    at_frequency, of_peaks = KINDS
    same, peaks = dataset[at_frequency], dataset[of_peaks]
    quoted = {
        "mean amplification at the same frequency": (same.mean(), fig12.MEAN_AT_FREQUENCY),
        "mean amplification, peak over peak": (peaks.mean(), fig12.MEAN_OF_PEAKS),
        f"median of the worst of {OF}, peak over peak": (
            worst(dataset, of_peaks).worst_quantile.sel(quantile=0.5),
            fig12.WORST_OF_25,
        ),
    }
    quantiles = worst(dataset, at_frequency).worst_quantile
    for share, value in zip(QUANTILES, fig13.WORST_AT_FREQUENCY, strict=True):
        name = f"quantile {share:g} of the worst of {OF}, at the same frequency"
        quoted[name] = quantiles.sel(quantile=share), value
    return [
        Landmark(name, float(found), value, "", Source.SAMPLED, DIGITS)
        for name, (found, value) in quoted.items()
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
