"""Design: the normal load that flattens the peak of one blade, by optimisation and in closed form.

Too little load lets the blade swing, too much holds the contact: between them lies one load whose
peak is the lowest of all. It is minimised here with exact derivatives, without any list of loads,
and stands beside a closed form: with one harmonic, at the best load, the angle at which the contact
starts to slip and the frequency of the peak obey `tan(theta) = -2 m omega / c`.

Without any other damping the contact slips for half of the period, `mu F_n = pi f0 / 2`, and the
peak is `pi f0 / k_d` at `omega^2 = (k + k_d / 2) / m`. Light damping changes all three in
proportion: the picture on the right shows how far they are off.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies.closed_form import OneBlade, one_blade
from studies.companions import full_stick, full_stick_load, largest_peak
from studies.landmark import Landmark, Source
from studies.run import run

NAME = "optimal_normal_load_single_blade"
SETS = ((1,), (1, 3, 5))
"""Harmonics; the first set has a closed form."""
BAND = fig03.BAND
BOUNDS = (0.1, 1000)
"""Normal loads [N] between which the best one is sought and the peaks are drawn."""
OTHER_LOADS = (1, 10, 500)
"""Normal loads [N] whose responses are drawn beside that of the best one."""
N_LOADS = 41
NEAR = np.linspace(0.8, 1.2, 9)
"""Loads over the best one, at which the peaks of every set of harmonics are computed too."""
DAMPINGS = tuple(0.5**n for n in range(1, 7))
"""Towards no damping [N s/m]."""
KNOWN = {
    "normal_load": 3.088578873912,
    "amplitude": 3.082288527639e-4,
    "frequency": 19.496559186804,
}
"""The best load [N], and its peak [m] and resonance [Hz], to the digits that were known before."""
LIMIT = ("slip limit mu F_n", "amplitude", "frequency")
ACCURACY = 1e-4
"""Truncation error asked for where a peak is compared with that of enough harmonics."""
ROUND_OFF = 1e-12
"""Relative difference of peaks that are solved for twice."""
STUCK = 1e9
"""Normal load [N] at which nothing slips."""


def optimum(problem: sh.HarmonicBalance) -> xr.Dataset:
    """Return the lowest peak over the normal load, with its response."""
    return sh.minimise_peak(problem, "normal_load", BOUNDS, BAND, throw=True, progress=False)


def compute(
    progress: bool = True,
    sets: tuple[tuple[int, ...], ...] = SETS,
    n_loads: int = N_LOADS,
    dampings: tuple[float, ...] = DAMPINGS,
) -> xr.Dataset:
    """Find the best load of every set of ``harmonics``, peaks over loads, and towards no damping.

    ``sets`` are sets of harmonics, the first of them the first harmonic alone.
    """
    found = [optimum(fig03.problem(harmonics)) for harmonics in sets]
    best = np.array([float(one.design_value[0]) for one in found])
    loads = np.geomspace(*BOUNDS, n_loads)
    scanned = _peaks(fig03.problem(), loads)
    near = [_peaks(fig03.problem(h), NEAR * load) for h, load in zip(sets, best, strict=True)]
    accurate = _peaks(fig03.problem(), best, accuracy=ACCURACY)
    light = [optimum(fig03.problem().with_parameters(damping=c)) for c in dampings]
    held = fig03.problem().with_parameters(normal_load=STUCK)
    stick = full_stick_load(largest_peak(sh.frf(held, BAND, throw=True, progress=False)))
    over = {"normal_load": sorted([best[0], *OTHER_LOADS])}
    curves = sh.frf(fig03.problem(), BAND, over=over, throw=True, progress=progress)
    row, lighter, scan = "highest_harmonic", "light", "scan"
    added: dict[str, tuple[Any, Any, str, str]] = {
        row: (row, [max(harmonics) for harmonics in sets], "1", "highest harmonic"),
        "optimal_normal_load": (row, best, "N", "normal load of the lowest peak"),
        "optimal_amplitude": (row, _each(found, "design_amplitude"), "m", "the lowest peak"),
        "optimal_frequency": (row, _each(found, "active_frequency"), "Hz", "its frequency"),
        "optimal_certificate": (row, [one.certificate.item() for one in found], "1", "certificate"),
        "accurate_amplitude": (row, accurate, "m", "peak with enough harmonics at this load"),
        "normal_load_by_damping": (
            (),
            float(found[0].design_value_by_damping[0]),
            "m s-1",
            "derivative of the best load by the damping",
        ),
        "scan_normal_load": (scan, loads, "N", "normal load of the contact"),
        "scan_peak_amplitude": (scan, scanned, "m", "displacement at the largest peak"),
        "near_peak_amplitude": ((row, "near"), near, "m", "the same about the best load"),
        "light_damping": (lighter, list(dampings), "N s m-1", "viscous damping of the blade"),
        "light_normal_load": (lighter, _each(light, "design_value"), "N", "best load"),
        "light_amplitude": (lighter, _each(light, "design_amplitude"), "m", "the lowest peak"),
        "light_frequency": (lighter, _each(light, "active_frequency"), "Hz", "its frequency"),
        "full_stick_normal_load": ((), float(stick), "N", "normal load from which nothing slips"),
    }
    return curves.assign(
        {
            name: (dims, values, {"units": units, "long_name": long_name})
            for name, (dims, values, units, long_name) in added.items()
        }
    )


def _peaks(problem: sh.HarmonicBalance, loads: np.ndarray, **options: Any) -> np.ndarray:
    """Largest peak [m] at each normal load [N]."""
    over = {"normal_load": loads}
    found = sh.frf(problem, BAND, over=over, throw=True, progress=False, **options)
    return largest_peak(found).peak_amplitude.values


def _each(found: list[xr.Dataset], name: str) -> np.ndarray:
    return np.array([one[name].values.flat[0] for one in found])


def blade(dataset: xr.Dataset) -> OneBlade:
    """Return the blade of the study for closed forms, at one of the loads."""
    return one_blade(dataset.isel(normal_load=0))


def distances(dataset: xr.Dataset) -> np.ndarray:
    """Relative distances (damping, 3) of slip limit, amplitude and frequency to no damping."""
    limit = replace(blade(dataset), damping=0.0).optimum()
    slip = float(dataset.friction_coefficient.mean()) * dataset.light_normal_load.values
    found = (slip, dataset.light_amplitude.values, dataset.light_frequency.values)
    return np.column_stack([one / none - 1 for one, none in zip(found, limit, strict=True)])


def orders(dataset: xr.Dataset) -> np.ndarray:
    """Powers (3,) of the damping with which the distances vanish: of the two lightest ones."""
    far, near = np.abs(distances(dataset)[-2:])
    c = dataset.light_damping.values
    return np.log(far / near) / np.log(c[-2] / c[-1])


def slopes(dataset: xr.Dataset) -> np.ndarray:
    """Distances (3,) over the damping where there is none, extrapolated from the two lightest."""
    c = dataset.light_damping.values
    far, near = distances(dataset)[-2:] / c[-2:, None]
    return near + (near - far) * c[-1] / (c[-2] - c[-1])


def draw(dataset: xr.Dataset) -> Figure:
    """Draw peaks over loads, the responses, and the distances to no damping."""
    with sh.plot.panels(1, 3, size=(14.0, 4.8), width_ratios=(1.25, 1.1, 0.9)) as (
        figure,
        (left, middle, right),
    ):
        _draw_peaks(dataset, left)
        _draw_responses(dataset, middle)
        _draw_distances(dataset, right)
        figure.suptitle("One blade, friction damper to the ground: the load of the lowest peak")
    return figure


def _decibels(amplitude: Any) -> np.ndarray:
    return 20 * np.log10(amplitude)


def _draw_peaks(dataset: xr.Dataset, ax: Axes) -> None:
    closed, mu = blade(dataset), float(dataset.friction_coefficient.mean())
    loads = np.geomspace(*BOUNDS, 400)
    level = [replace(closed, slip_limit=mu * load).peak()[0] for load in loads]
    ax.semilogx(loads, _decibels(level), color="0.6", linewidth=2.4, label="closed form")
    scanned = dataset.scan_normal_load.values, _decibels(dataset.scan_peak_amplitude)
    ax.semilogx(*scanned, "k.", markersize=4, label="followed, one harmonic")
    for (highest, one), marker, color in zip(
        _rows(dataset), ("o", "D"), ("tab:red", "tab:blue"), strict=False
    ):
        best, lowest = float(one.optimal_normal_load), float(one.optimal_amplitude)
        name = "one harmonic" if highest == 1 else f"harmonics up to {highest}"
        label = f"minimised, {name}: {best:.4g} N, {_decibels(lowest):.3f} dB"
        look = dict(color=color, markeredgecolor="black", markersize=8 - 0.6 * highest)
        ax.plot(best, _decibels(lowest), marker, label=label, linestyle="", **look)  # type: ignore
    stick = float(dataset.full_stick_normal_load)
    ax.axvline(stick, color="0.4", linewidth=0.9, linestyle=(0, (1, 2)))
    ax.annotate(
        f"no slip from {stick:.0f} N on",
        (stick, float(_decibels(dataset.optimal_amplitude.min()))),
        (4, 0),
        textcoords="offset points",
        rotation=90,
        fontsize=9,
    )
    ax.set_xlabel("normal load $F_n$ [N]")
    ax.set_ylabel("largest peak [dB re 1 m]")
    # Room for the legend above the curve.
    ax.set_ylim(None, -20)
    ax.legend(loc="upper left")
    ax.set_title("peak over the normal load", fontsize=10)


def _draw_responses(dataset: xr.Dataset, ax: Axes) -> None:
    sh.plot.response(dataset, ax=ax)
    best = float(dataset.optimal_normal_load[0])
    legend: Any = ax.get_legend()
    loads = dataset.normal_load.values
    labels = [f"$F_n$ = {load:.4g} N" + (" (best)" if load == best else "") for load in loads]
    ax.set_ylim(None, -20)
    ax.legend(legend.legend_handles, labels, loc="upper left", handlelength=2.8)
    ax.set_title("response, one harmonic; circles: peaks", fontsize=10)


def _draw_distances(dataset: xr.Dataset, ax: Axes) -> None:
    c, found = dataset.light_damping.values, np.abs(distances(dataset))
    closed = np.abs(blade(dataset).slopes())
    drawn = np.array([c.min() / 1.5, c.max() * 1.5])
    for name, column, slope, marker in zip(LIMIT, found.T, closed, "os^", strict=True):
        symbol = name.replace("mu F_n", r"$\mu F_n$")
        (line,) = ax.loglog(c, column, marker, label=symbol, markersize=6)
        ax.loglog(drawn, slope * drawn, color=line.get_color(), linewidth=0.9, zorder=1)
    ax.set_xticks(c[::2], [f"{value:.3g}" for value in c[::2]])
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("damping $c$ [N s/m]")
    ax.set_ylabel("relative distance to no damping")
    ax.legend(loc="lower right")
    ax.set_title("towards no damping; lines: first order", fontsize=10)


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """The optimum beside what is known of it, and its approach to that without damping."""
    closed, mu = blade(dataset), float(dataset.friction_coefficient.mean())
    limit, amplitude, frequency = closed.optimum()
    one = dataset.isel(highest_harmonic=0)
    load = float(one.optimal_normal_load)
    found = load, float(one.optimal_amplitude), float(one.optimal_frequency)
    lower = (dataset.near_peak_amplitude < dataset.optimal_amplitude * (1 - ROUND_OFF)).sum()
    lower += (dataset.scan_peak_amplitude < found[1] * (1 - ROUND_OFF)).sum()
    names = "best normal load", "its peak", "its resonance"
    units = "N", "m", "Hz"
    change = 1e-4 * closed.damping
    more, less = (
        replace(closed, damping=closed.damping + step).optimum()[0] / mu
        for step in (change, -change)
    )
    return [
        *[
            Landmark(f"{name}, known digits", value, known, unit, Source.EXACT, tolerance)
            for name, value, known, unit, tolerance in zip(
                names, found, KNOWN.values(), units, (1e-8, 1e-10, 1e-10), strict=True
            )
        ],
        *[
            Landmark(name, value, exact, unit, Source.CLOSED_FORM, 1e-10)
            for name, value, exact, unit in zip(
                names, found, (limit / mu, amplitude, frequency), units, strict=True
            )
        ],
        # Central differences of a step of 1e-4: their error is of its square.
        Landmark(
            "derivative of the best normal load by the damping",
            float(dataset.normal_load_by_damping),
            (more - less) / (2 * change),
            "m/s",
            Source.CLOSED_FORM,
            1e-6,
        ),
        Landmark(
            "normal loads with a lower peak, of those followed beside the best ones",
            int(lower),
            0,
            "",
            Source.EXACT,
            0,
        ),
        *[
            Landmark(
                f"the lowest peak, harmonics up to {highest}, beside that with enough at its load",
                float(row.optimal_amplitude),
                float(row.accurate_amplitude),
                "m",
                Source.EXACT,
                # Fewer harmonics than up to 5 miss up to a thousandth.
                1e-3 if highest < 5 else ACCURACY,
            )
            for highest, row in _rows(dataset)
        ],
        *[
            Landmark(f"order of the {name} in the damping", order, 1, "", Source.CLOSED_FORM, 0.01)
            for name, order in zip(LIMIT, orders(dataset).tolist(), strict=True)
        ],
        # Two terms of a series at dampings a thousandth of what the contact adds.
        *[
            Landmark(
                f"relative change of the {name} by the damping, at none",
                slope,
                exact,
                "m/(N s)",
                Source.CLOSED_FORM,
                1e-4,
            )
            for name, slope, exact in zip(
                LIMIT, slopes(dataset).tolist(), closed.slopes(), strict=True
            )
        ],
        *full_stick(dataset),
    ]


def _rows(dataset: xr.Dataset) -> list[tuple[int, xr.Dataset]]:
    """Highest harmonic of each set, and what was found with it."""
    highest = dataset.highest_harmonic.values
    return [(int(one), dataset.sel(highest_harmonic=one)) for one in highest]


if __name__ == "__main__":
    run(NAME, compute, draw)
