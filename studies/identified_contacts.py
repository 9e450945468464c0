"""Contacts identified from responses at five levels of the force with 2 % of noise.

The blade of Fig. 3 and the tuned disk of 13 blades of the paper are swept at five levels of the
force; each real and imaginary part that a sensor on the first blade reads has a noise of 2 % of the
response. Load and stiffness of the contacts and the damping are found again from values that are
two or three times too large or too small, with errors and with intervals by profile likelihood. The
lowest level sticks, and tells the stiffness; higher ones slip, and tell the load.
"""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import symhbm as sh
from studies.landmark import Landmark, Source, unit_of
from studies.run import run

NAME = "identified_contacts"
NOISE, SEED = 0.02, 2013
UNKNOWN = ("normal_load", "contact_stiffness", "damping")
WRONG = (2.5, 0.5, 0.4)
"""Values that the fits start from, over the true ones."""
BLADE: dict[str, float] = dict(normal_load=3.0, contact_stiffness=1e4, damping=0.5)
RING: dict[str, float] = dict(normal_load=10.0, contact_stiffness=1e6, damping=0.5)
BLADE_LEVELS, BLADE_BAND = (0.2, 0.6, 1.0, 1.5, 2.5), (13.0, 25.0)  # N, Hz
RING_LEVELS, RING_BAND = (0.02, 0.05, 0.1, 0.2, 0.5), (209.0, 213.0)
N_FREQUENCIES, N_BLADES, ORDER = 25, 13, 3
SURE = 4.0
"""Standard errors within which an estimate is the true value."""


def blade() -> sh.HarmonicBalance:
    """The blade of Fig. 3 with three harmonics."""
    model = sh.single_blade(mass=1, stiffness=1e4, friction_coefficient=0.5, **BLADE)
    return sh.HarmonicBalance(model, sh.forces.PointForce(), (1, 3, 5))


def ring() -> sh.HarmonicBalance:
    """The tuned disk of the paper under an engine order, with three harmonics."""
    model = sh.bladed_disk(N_BLADES, mass=1, stiffness=1e4, friction_coefficient=0.5, **RING)
    return sh.HarmonicBalance(model, sh.forces.EngineOrder(ORDER), (1, 3, 5))


def test_of(problem: sh.HarmonicBalance, levels: Any, band: Any, seed: int) -> xr.Dataset:
    """What a sensor on the first blade reads, with noise."""
    at = np.linspace(band[0], band[1], N_FREQUENCIES)
    over = {"force_amplitude": [*levels]}
    response = sh.frf(problem, band, at=at, over=over, progress=False, throw=True)
    first = response.coefficient.sel(dof=0, harmonic=1)
    cosine, sine = first.transpose("component", "force_amplitude", "frequency").values
    exact = cosine - 1j * sine
    deviation = NOISE * abs(exact)
    real, imaginary = np.random.default_rng(seed).standard_normal((2, *exact.shape))
    noisy = exact + deviation * (real + 1j * imaginary)
    known: Any = dict(force_amplitude=np.reshape(levels, (-1, 1)))
    return sh.datasets.measured(at, noisy, units="m", deviation=deviation, **known)


def fit(problem: sh.HarmonicBalance, data: xr.Dataset, true: dict[str, float]) -> xr.Dataset:
    """The parameters that a test tells, from wrong ones."""
    wrong = {name: factor * true[name] for name, factor in zip(UNKNOWN, WRONG, strict=True)}
    start = problem.with_parameters(**wrong)
    return sh.identify(start, data, UNKNOWN, predict=True, throw=True, progress=False)


def compute(progress: bool = True) -> xr.Dataset:
    """The fit of the blade, with what that of the disk says beside it."""
    of_blade = fit(blade(), test_of(blade(), BLADE_LEVELS, BLADE_BAND, SEED), BLADE)
    of_ring = fit(ring(), test_of(ring(), RING_LEVELS, RING_BAND, SEED + 1), RING)
    added = {}
    for name in ("estimate", "standard_error", "profile_interval", "curve_chi_square"):
        value = of_ring[name]
        about = value.attrs | {"long_name": f"{value.attrs['long_name']}, of the disk"}
        added[f"ring_{name}"] = (value.dims, value.values, about)
    return of_blade.assign(added)


def draw(dataset: xr.Dataset) -> Figure:
    """The measured points on the computed curves, and all estimates with their intervals."""
    with sh.plot.panels(2, 1, size=(6.5, 6.5)) as (figure, axes):
        sh.plot.response(dataset, ax=axes[0])
        intervals(axes[1], dataset)
    return figure


def intervals(ax: Axes, dataset: xr.Dataset) -> None:
    """Estimates over true values, with intervals by profile likelihood."""
    names = dataset["unknown"].values.tolist()
    for shift, prefix, true, mark in ((-0.1, "", BLADE, "o"), (0.1, "ring_", RING, "s")):
        values = np.array([true[name] for name in names])
        ends = 100 * (dataset[f"{prefix}profile_interval"].values / values[:, None] - 1)
        centre = 100 * (dataset[f"{prefix}estimate"].values / values - 1)
        ax.errorbar(
            np.arange(len(names)) + shift,
            centre,
            np.abs(ends.T - centre),
            marker=mark,
            linestyle="",
            capsize=3,
            color="black",
            markerfacecolor="white",
            label="disk of 13 blades" if prefix else "blade",
        )
    ax.axhline(0, color="black", linewidth=0.6)
    ax.set_yscale("symlog", linthresh=0.1)
    ax.margins(y=0.15)
    ax.set_xticks(range(len(names)), [name.replace("_", " ") for name in names])
    ax.set_ylabel("estimate less true value [%]")
    ax.legend()


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """All estimates within four standard errors of the true values, residuals that are noise."""
    found = []
    for prefix, what, true in (("", "blade", BLADE), ("ring_", "disk", RING)):
        for number, name in enumerate(dataset["unknown"].values.tolist()):
            estimate = float(dataset[f"{prefix}estimate"][number])
            error = float(dataset[f"{prefix}standard_error"][number])
            units = unit_of(dataset["unknown_units"].values[number])
            sure = SURE * error / true[name]
            words = f"{name.replace('_', ' ')} of the {what}"
            found.append(Landmark(words, estimate, true[name], units, Source.EXACT, sure))
        size = float(dataset["curve_size"].sum())
        square = float(dataset[f"{prefix}curve_chi_square"].sum()) / (size - len(UNKNOWN))
        allowed = float(SURE * np.sqrt(2 / size))
        words = f"mean square of the residuals of the {what}, in variances"
        found.append(Landmark(words, square, 1.0, "", Source.EXACT, allowed))
    return found


if __name__ == "__main__":
    run(NAME, compute, draw)
