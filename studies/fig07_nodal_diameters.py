"""Fig. 7: nodal-diameter patterns of the tuned 13-blade disk under engine orders 0, 1, 2 and 4.

The displacements of the blades at their resonance, at the instant when blade 0 moves most: engine
order n is a pattern of n nodal diameters. It travels around the disk; all blades reach the same
amplitude, each n / 13 of a period after the one before. Red lines are the nodal diameters, where
the wave through the blades is zero.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 7.
"""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.optimize import brentq

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.claim import Claim
from studies.companions import closed_form_peaks, labelled, largest_peak
from studies.landmark import Landmark, Source
from studies.run import run

NAME = "fig07_nodal_diameters"
ENGINE_ORDERS = [0, 1, 2, 4]
HIGHEST_ORDERS = [6, 7]
"""The highest number of nodal diameters of 13 blades, and the order that the source ends at."""
BAND = (10, 350)  # Hz
REACH = 1.36
"""Length of half a nodal diameter, where blades at rest have a radius of 1."""
NODAL_LINE: Any = dict(color="red", linewidth=1.6, zorder=5)
ROUND_OFF = 1e-9
"""Relative difference of blades that move alike: light damping costs digits."""


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response of the disk of Fig. 8 at every engine order, and peaks of the highest."""
    over = {"engine_order": ENGINE_ORDERS}
    dataset = sh.frf(fig08.problem(), BAND, over=over, throw=True, progress=progress)
    over = {"engine_order": HIGHEST_ORDERS}
    highest = sh.frf(fig08.problem(), BAND, over=over, throw=True, progress=False)
    top, shapes = largest_peak(highest), snapshot(highest)
    counts = [counted(shapes.sel(engine_order=order).values) for order in HIGHEST_ORDERS]
    added = {
        "highest_order_peak_amplitude": (
            top.peak_amplitude.values,
            "m",
            "displacement at the peak",
        ),
        "highest_order_peak_frequency": (top.peak_frequency.values, "Hz", "frequency of the peak"),
        "highest_order_diameters": (counts, "1", "nodal diameters of the shape at the peak"),
    }
    return dataset.assign_coords(highest_order=HIGHEST_ORDERS).assign(
        {
            name: ("highest_order", values, {"units": units, "long_name": long_name})
            for name, (values, units, long_name) in added.items()
        }
    )


def turning(dataset: xr.Dataset) -> xr.DataArray:
    """Complex displacements [m] by blade at the largest peak, of which the real part moves."""
    parts = largest_peak(dataset).peak_coefficient.sel(harmonic=1)
    return parts.sel(component="cos") - 1j * parts.sel(component="sin")


def snapshot(dataset: xr.Dataset) -> xr.DataArray:
    """Displacements [m] by blade at the largest peak, at the instant when blade 0 moves most."""
    moved = turning(dataset)
    first = moved.isel(dof=0)
    return (moved * np.conj(first) / np.abs(first)).real


def nodal_angles(displacement: np.ndarray) -> np.ndarray:
    """Angles [rad] at which the wave through the blades is zero; blade i is at ``2 pi i / N``."""
    n = len(displacement)
    waves = np.fft.rfft(displacement) / n

    def wave(angle: float | np.ndarray) -> Any:
        turns = np.exp(1j * np.multiply.outer(angle, np.arange(len(waves))))
        return (turns @ (waves * np.where(np.arange(len(waves)) > 0, 2, 1))).real

    ends = 2 * np.pi * (np.arange(40 * n + 1) + 0.5) / (40 * n)
    values = wave(ends)
    crossed = np.flatnonzero(values[:-1] * values[1:] < 0)
    return np.array([brentq(wave, ends[i], ends[i + 1]) for i in crossed])


def counted(displacement: np.ndarray) -> int:
    """The number of diameters on which the wave through the blades is zero."""
    return len(nodal_angles(displacement)) // 2


def draw(dataset: xr.Dataset) -> Figure:
    """Draw a disk per engine order, with its nodal diameters."""
    with sh.plot.panels(2, 2, size=(9.6, 8.6)) as (figure, axes):
        for ax, order in zip(axes.flat, ENGINE_ORDERS, strict=True):
            one = dataset.sel(engine_order=order)
            instant = -float(np.angle(turning(one).isel(dof=0)))
            sh.plot.disk(one, angle=instant, ax=ax)
            for angle in nodal_angles(snapshot(one).values):
                # The disk has its first blade on top and counts clockwise.
                ax.plot([0, REACH * np.sin(angle)], [0, REACH * np.cos(angle)], **NODAL_LINE)
            ax.set_title(f"EO {order}: {ax.get_title()}", fontsize=9)
        figure.suptitle(
            "Fig. 7: tuned disk of 13 blades at resonance, when blade 0 moves most; red: nodal "
            "diameters"
        )
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Nodal diameters, equal amplitudes, equal lags, and the peaks."""
    shapes = snapshot(dataset)
    waves = turning(dataset)
    n = dataset.sizes["dof"]
    rows = []
    for order in dataset.engine_order.values:
        label = labelled("engine_order", order)
        moved = waves.sel(engine_order=order).values
        size = np.abs(moved)
        lag = np.angle(moved / np.roll(moved, -1)) % (2 * np.pi)
        found = counted(shapes.sel(engine_order=order).values)
        rows += [
            Landmark(f"nodal diameters, {label}", found, int(order), "", Source.PUBLISHED, 0.0),
            Landmark(
                f"spread of the amplitudes of the blades, {label}",
                float(np.ptp(size) / size.max()),
                0.0,
                "",
                Source.EXACT,
                ROUND_OFF,
            ),
            Landmark(
                f"largest error of the lag between neighbours, {label}",
                float(np.abs((lag - 2 * np.pi * order / n + np.pi) % (2 * np.pi) - np.pi).max()),
                0.0,
                "rad",
                Source.EXACT,
                ROUND_OFF,
            ),
        ]
    return rows + closed_form_peaks(dataset, "engine_order")


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of its Fig. 7."""
    shapes = snapshot(dataset)
    orders = dataset.engine_order.values
    counts = [counted(shapes.sel(engine_order=order).values) for order in orders]
    amplitude = dataset.highest_order_peak_amplitude.values
    frequency = dataset.highest_order_peak_frequency.values
    diameters = dataset.highest_order_diameters.values
    return [
        Claim(
            "EO = 0 moves all blades together, EO = 1 has one nodal diameter, higher values of EO "
            "have EO diameters",
            "Fig. 7",
            ", ".join(f"EO {order}: {n}" for order, n in zip(orders, counts, strict=True)),
            counts == orders.tolist(),
            True,
        ),
        Claim(
            "Vibrations have EO diameters until EO = (N + 1) / 2 is reached (up to 7 with 13 "
            "blades)",
            "section on engine orders",
            f"EO 7 has {diameters[1]} nodal diameters and the peak of EO 6, travelling the other "
            f"way: {amplitude[1]:.6g} and {amplitude[0]:.6g} m at {frequency[1]:.3f} and "
            f"{frequency[0]:.3f} Hz",
            bool(diameters[1] == HIGHEST_ORDERS[1]),
            False,
        ),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
