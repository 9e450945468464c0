"""Mistuned disks of 24 sectors by finite elements, without and with dampers at the platforms.

The sector is that of `studies.open_sector` with twisted blades, with the matrices at 6,470
revolutions per minute, reduced by Craig and Bampton to four modes with the boundary held, eight
motions of the interfaces, the contacts and the tip. So few put the frequencies half a percent too
high, all alike: disks are compared with the tuned one that is reduced in the same way. The
stiffness of each blade deviates by some percent, and the blades of a wave of engine order 18 then
no longer share its energy alike. Dampers of one direction, under a constant load, lower the
largest responses, and about as much those of the tuned disk: disks amplify as before.

An isolated family of modes amplifies by `(1 + sqrt(24)) / 2 = 2.95` at most.

Reference: D. S. Whitehead, Effect of mistuning on the vibration of turbomachine blades induced by
wakes, J. Mech. Eng. Sci. 8 (1966), 15-21.
"""

from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import symhbm as sh
from studies import sampling
from studies.landmark import Landmark, Source
from studies.open_sector import COARSE, RADII, THICKNESS, open_sector
from studies.open_sector_contacts import (
    CONTACT_STIFFNESS,
    DAMPER_SPEED,
    FORCE,
    FRICTION,
    ORDER,
    PLATFORM,
)
from studies.open_sector_modes import TWIST
from studies.run import run

NAME = "open_sector_mistuned"
DAMPING = 4e-7
"""Damping matrix over the stiffness matrix [s]: a ratio of 2.4 per mille."""
LOAD = 40.0  # N
MODES, INTERFACE_MODES = 4, 8
SCATTER = 0.02
"""Standard deviation of the stiffness of blades, relative."""
N_SAMPLES, SEED = 6, 1
BAND = (1890.0, 2010.0)
KINDS = ("without dampers", "with dampers")
SHOWN = 1
"""Number of the disk whose blades are drawn."""
BOUND = (1 + np.sqrt(24)) / 2
SAME = 1e-7
"""Relative difference of a tuned ring from its sector."""


class Disk(NamedTuple):
    """The ``ring`` of reduced sectors, and its tuned ``sector``; ``tips`` by blade."""

    ring: sh.HarmonicBalance
    sector: sh.HarmonicBalance
    tips: list[int]


def disk(kind: str, grid: tuple[int, int, int, int] = COARSE, n_sectors: int = 24) -> Disk:
    """A disk of one of `KINDS`."""
    sector = open_sector(grid, n_sectors, twist=TWIST).damped(DAMPING).at(DAMPER_SPEED)
    tip = f"{sector.near(RADII[2], 0.0, THICKNESS / 2)}:y"
    whole = sector.disk
    if kind == KINDS[1]:
        at = np.arcsin(RADII[1] * np.tan(np.pi / (3 * n_sectors)) / PLATFORM)
        one, other = (sector.near(PLATFORM, side * at, THICKNESS / 2) for side in (1, -1))
        damper = sh.Friction(
            tangential=(f"{one}:x", sh.next_sector(f"{other}:x")),
            contact_stiffness=CONTACT_STIFFNESS,
            friction_coefficient=FRICTION,
            normal_load=LOAD,
        )
        whole = whole.with_contacts(damper=damper)
    radius = np.hypot(*sector.structure.places.coordinates.T[:2])
    blade = np.flatnonzero(radius > RADII[1] + THICKNESS / 6)
    reduced = sh.craig_bampton(
        whole, MODES, BAND, interface_modes=INTERFACE_MODES, places=[tip], blade=blade
    )
    force = sh.forces.EngineOrder(ORDER, pattern={tip: FORCE})
    ring = sh.mistuned_ring(reduced)
    numbers = [j * whole.n_whole + whole.number_of(tip) for j in range(n_sectors)]
    tips = np.flatnonzero(np.isin(ring.kept, numbers)).tolist()
    return Disk(sh.HarmonicBalance(ring, force), sh.HarmonicBalance(reduced, force), tips)


def compute(progress: bool = True) -> xr.Dataset:
    """Responses of the same mistuned disks without and with dampers, and their amplification."""
    options: dict[str, Any] = dict(progress=False, throw=True)
    found = []
    for kind in KINDS:
        ring, sector, tips = disk(kind)
        draws = sh.mistuning.truncated_normal(
            ring, N_SAMPLES, seed=SEED, stiffness_deviation=SCATTER
        )
        tuned = sh.frf(ring, BAND, **options)
        mistuned = sh.frf(ring, BAND, over=draws, **options)
        factors = sh.statistics.amplification(mistuned, tuned)
        one = mistuned.isel(sample=SHOWN)
        table = xr.Dataset(
            {
                "amplification": ("sample", factors.largest_amplification_of_peaks.values),
                "tuned_peak": float(tuned.peak_amplitude.max()),
                "sector_peak": float(sh.frf(sector, BAND, **options).peak_amplitude.max()),
                "swept_frequency": ("point", one.frequency.values),
                "blade_amplitude": (("point", "blade"), one.amplitude.values[:, tips]),
                "tuned_frequency": ("tuned_point", tuned.frequency.values),
                "tuned_amplitude": ("tuned_point", tuned.amplitude.values[:, tips].max(axis=1)),
            }
        )
        # Numbered, so that the shorter one is filled up.
        table["point"], table["tuned_point"] = (
            np.arange(table.sizes[dim]) for dim in ("point", "tuned_point")
        )
        found.append(table)
    dataset = xr.concat(found, xr.DataArray([*KINDS], dims="kind", name="kind"), join="outer")
    for name, (units, long_name) in DESCRIBED.items():
        dataset[name].attrs.update(units=units, long_name=long_name)
    return dataset.assign_attrs(
        title=f"{N_SAMPLES} mistuned disks of 24 sectors by finite elements",
        references="D. S. Whitehead, J. Mech. Eng. Sci. 8 (1966), 15-21",
        seed=SEED,
        symhbm_schema=1,
        symhbm_version=version("symhbm"),
    )


DESCRIBED = {
    "amplification": ("1", "largest response over the largest of the tuned disk"),
    "tuned_peak": ("m", "largest response of the tuned disk"),
    "sector_peak": ("m", "the same by one sector"),
    "swept_frequency": ("Hz", f"excitation frequency of disk {SHOWN}"),
    "blade_amplitude": ("m", "largest displacement of the tips of its blades"),
    "tuned_frequency": ("Hz", "excitation frequency of the tuned disk"),
    "tuned_amplitude": ("m", "largest displacement of its tips"),
    "kind": ("1", "dampers"),
}


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the blades of a disk beside the tuned one, and how much all disks amplify."""
    with sh.plot.panels(1, 3, size=(14.0, 4.6)) as (figure, axes):
        for ax, kind in zip(axes, KINDS, strict=False):
            _draw_blades(ax, dataset.sel(kind=kind), kind)
        axes[1].sharey(axes[0])
        _draw_factors(axes[2], dataset)
        percent = f"{100 * SCATTER:g} %"
        figure.suptitle(
            f"Disks of 24 finite-element sectors, stiffness of blades scattered by {percent}, "
            f"engine order {ORDER}"
        )
    return figure


def _draw_blades(ax: Axes, row: xr.Dataset, kind: str) -> None:
    levels = 1e3 * row.blade_amplitude.values
    lines = ax.plot(row.swept_frequency, levels, color="0.6", linewidth=0.6)
    lines[0].set_label("other blades")
    highest = int(np.nanmax(levels, axis=0).argmax())
    ax.plot(row.swept_frequency, levels[:, highest], color="tab:red", label=f"blade {highest}")
    tuned = 1e3 * row.tuned_amplitude
    ax.plot(row.tuned_frequency, tuned, "--", color="black", label="tuned disk")
    ax.set(xlabel="excitation frequency [Hz]", ylabel="largest displacement of tips [mm]")
    ax.set_title(f"a disk {kind}")
    ax.legend(loc="upper left")


def _draw_factors(ax: Axes, dataset: xr.Dataset) -> None:
    looks = ("tab:orange", "o", "-"), ("tab:blue", "D", "--")
    for kind, (color, marker, style) in zip(KINDS, looks, strict=True):
        values = np.sort(dataset.amplification.sel(kind=kind).values)
        share = np.arange(1, len(values) + 1) / len(values)
        half = float(sampling.of_mean(values))
        label = f"{kind}: mean {values.mean():.2f} \u00b1 {half:.2f} ({sampling.WORDS})"
        ax.step(values, share, where="post", color=color, linestyle=style, linewidth=1.0)
        ax.plot(values, share, marker, color=color, label=label)
    ax.axvline(BOUND, color="0.4", linestyle=":", label="isolated family, at most")
    ax.set(xlabel="amplification", ylabel="share of disks with no more", ylim=(0, 1.04))
    ax.set_title(f"{dataset.sizes['sample']} disks")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15))


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Tuned rings against one sector, and the bound of an isolated family."""
    rows = []
    for kind in KINDS:
        row = dataset.sel(kind=kind)
        found, expected = float(row.tuned_peak), float(row.sector_peak)
        name = f"peak of the tuned ring {kind}, against one sector"
        rows.append(Landmark(name, found, expected, "m", Source.EXACT, SAME))
    linear = float(dataset.amplification.sel(kind=KINDS[0]).max())
    excess = max(linear / BOUND - 1, 0.0) if np.isfinite(linear) else np.nan
    name = "amplification without dampers beyond that of an isolated family"
    rows.append(Landmark(name, excess, 0.0, "", Source.CLOSED_FORM, 0.0))
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
