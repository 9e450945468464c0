"""A backbone made by twenty sliders, fitted by one, two and four.

A blade on twenty sliders in parallel, of equal stiffness and of limits from 0.01 N to 1 N, is a
joint in which slip spreads slowly: its frequency falls and its damping rises over two and a half
decades of the amplitude. A phase-resonant test tells frequency and damping at 31 amplitudes, with a
noise of 0.02 Hz and of 0.002 in the damping ratio. Models of one, two and four sliders, whose loads
and stiffnesses are unknown, are fitted to it. One number says how far each goes: the root mean
square of what is left, in standard deviations of the noise, which would be 1 for the true model.
"""

import warnings
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies.landmark import Landmark, Source
from studies.run import run

NAME = "identified_backbone"
MASS, STIFFNESS, DAMPING = 1.0, 1e4, 2.0
TOTAL = 1e4
"""Stiffness of all sliders together [N/m]."""
LIMITS = np.geomspace(0.01, 1.0, 20)
"""Forces at which the twenty slide [N]."""
AMPLITUDES = np.geomspace(1e-5, 1e-2, 31)
NOISE, SEED = (0.02, 0.002), 2026
"""Standard deviations of frequencies [Hz] and of damping ratios."""
SLIDERS = (1, 2, 4)
GUESS = (0.05, 0.5)
"""Limits of the sliders that fits begin with, from the first to the last [N]."""


def joint(limits: Any, stiffness: float) -> sh.HarmonicBalance:
    """A blade on sliders of some limits [N], each of one stiffness [N/m], with two harmonics."""
    limits = np.atleast_1d(limits)
    sliders: Any = dict(contact_stiffness=stiffness, friction_coefficient=1.0, normal_load=limits)
    model = sh.Model([[MASS]], [[DAMPING]], [[STIFFNESS]], contacts=[(0,)] * len(limits), **sliders)
    return sh.HarmonicBalance(model, harmonics=(1, 3))


def exact() -> np.ndarray:
    """Frequencies [Hz] and damping ratios of the twenty sliders, (n_amplitudes, 2)."""
    twenty, band = joint(LIMITS, TOTAL / len(LIMITS)), (0.5 * AMPLITUDES[0], 2 * AMPLITUDES[-1])
    modes = sh.nonlinear_modes(twenty, band=band, at=AMPLITUDES, progress=False, throw=True)
    first = modes.isel(solution=0)
    return np.column_stack([first["frequency"].values, first["damping_ratio"].values])


def test_of(backbone: np.ndarray) -> xr.Dataset:
    """What a phase-resonant test tells of a backbone, with noise."""
    noise = np.random.default_rng(SEED).standard_normal(backbone.shape)
    frequency, damping = (backbone + NOISE * noise).T
    options: Any = dict(units="m", form="mode", amplitude=AMPLITUDES)
    deviations: Any = dict(frequency_deviation=NOISE[0], deviation=NOISE[1])
    return sh.datasets.measured(frequency, damping, **options, **deviations)


def fit(data: xr.Dataset, count: int) -> xr.Dataset:
    """The fit of some sliders in parallel."""
    start = joint(np.geomspace(*GUESS, count), TOTAL / count)
    each: Any = {name: {"vary": "each"} for name in ("normal_load", "contact_stiffness")}
    given: Any = dict(n_starts=1, profiles=False, progress=False)
    with warnings.catch_warnings():  # fewer sliders leave more than noise, the study says how much
        warnings.filterwarnings("ignore", ".*times the noise that was given.*", RuntimeWarning)
        return sh.identify(start, data, each, **given)


def compute(progress: bool = True) -> xr.Dataset:
    """The fit of four sliders, with what one and two compute beside it."""
    true = exact()
    data = test_of(true)
    fits = [fit(data, count) for count in SLIDERS]
    found = [one["computed_value"].values for one in fits]
    errors = [np.abs(one.reshape(-1, 2) - true).max(axis=0) for one in found]
    size = data.sizes["measurement"]
    left = [
        np.sqrt(float(one["curve_chi_square"].sum()) / (size - one.sizes["unknown"]))
        for one in fits
    ]
    totals = [[float(_each(one, name).sum()) for one in fits] for name in ("normal", "contact")]
    table = {
        "fitted_value": (("sliders", "measurement"), np.array(found), "1", "computed by a fit"),
        "true_value": ("measurement", true.ravel(), "1", "value without noise"),
        "left": ("sliders", np.array(left), "1", "residuals over the noise"),
        "frequency_error": ("sliders", np.array(errors)[:, 0], "Hz", "largest error"),
        "damping_error": ("sliders", np.array(errors)[:, 1], "1", "largest error"),
        "total_limit": ("sliders", np.array(totals[0]), "N", "sum of all limits"),
        "total_stiffness": ("sliders", np.array(totals[1]), "N/m", "sum of all stiffnesses"),
    }
    variables: Any = {
        name: (dims, values, {"units": units, "long_name": words})
        for name, (dims, values, units, words) in table.items()
    }
    return fits[-1].assign(variables).assign_coords(sliders=("sliders", [*SLIDERS]))


def _each(one: xr.Dataset, beginning: str) -> np.ndarray:
    """Estimates of the unknowns whose names begin so."""
    chosen = [str(name).startswith(beginning) for name in one["unknown"].values]
    return one["estimate"].values[np.array(chosen)]


def draw(dataset: xr.Dataset) -> Figure:
    """Frequency and damping ratio over the amplitude: measured, and computed by each fit."""
    amplitude = dataset["measured_amplitude"].values[::2]
    with sh.plot.panels(2, 1, size=(6.5, 6.0)) as (figure, axes):
        for panel, ax in enumerate(axes):
            measured = dataset["measured_value"].values[panel::2]
            look: Any = dict(marker="o", markersize=3.5, markerfacecolor="none", linestyle="")
            ax.semilogx(amplitude, measured, color="black", label="measured", **look)
            for one, style in zip(dataset["sliders"].values, (":", "--", "-"), strict=True):
                chosen = dataset.sel(sliders=one)
                values = chosen["fitted_value"].values[panel::2]
                words = f"{one} slider{'s' if one > 1 else ''}, {chosen['left'].item():.2g} times"
                ax.semilogx(amplitude, values, linestyle=style, label=f"{words} the noise left")
        axes[0].set_ylabel("frequency [Hz]")
        axes[1].set_ylabel("damping ratio")
        axes[1].set_xlabel("amplitude [m]")
        axes[1].set_ylim(0.0)
        axes[0].legend()
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """What four sliders have in sum, noise that is what it should be, ever better fits."""
    four = dataset.sel(sliders=SLIDERS[-1])
    noise = dataset["measured_value"].values - dataset["true_value"].values
    square = float(np.mean((noise.reshape(-1, 2) / NOISE) ** 2))
    left = dataset["left"].values
    found = [
        ("stiffness of four sliders together", four["total_stiffness"], TOTAL, "N/m", 0.02),
        ("limit of four sliders together", four["total_limit"], LIMITS.sum(), "N", 0.05),
        ("mean square of the noise in variances", square, 1.0, "", 0.6),
        ("number of fits that leave less than the one before", np.sum(np.diff(left) < 0), 2, "", 0),
    ]
    return [
        Landmark(words, float(value), float(expected), units, Source.EXACT, tolerance)
        for words, value, expected, units, tolerance in found
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
