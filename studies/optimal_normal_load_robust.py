"""Design: one normal load for mistuned disks, by mean, tail and worst of their highest peaks.

Stiffness, friction and load of every contact scatter as in Fig. 12, and the load that is designed
is the one about which they do. Designs know a handful of disks; others, which no design has seen,
tell what they are worth. For scale: the best load of the tuned disk, and the 10 N of the source.

From 10 N to any of these loads the peaks fall by 11 dB. Between them the gain is small, and it is
gained on the disks that the design knows: six of them, 3 to 9 % below the load of the tuned disk;
18 others do not tell it from nothing, their statistics are even 0.1 to 1.7 % higher. Whether a
design for mistuned disks is worth more than that of the tuned one, only more disks can tell.
"""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig12_mistuned_disk as fig12
from studies import sampling
from studies.claim import Finding
from studies.closed_form import one_blade
from studies.landmark import Landmark, Source
from studies.run import run

NAME = "optimal_normal_load_robust"
BAND = fig12.BAND
BOUNDS = (1.0, 8.0)
"""Normal loads [N] between which the best ones are sought."""
ROUND_OFF = 1e-9
"""Relative difference of statistics of peaks that are solved for twice."""
SAME = 0.25
"""Relative difference of gains up to which they count as equal."""
N_DESIGN, N_FRESH = 6, 18
STATISTICS = ("mean", "tail", "worst")
TAIL = 1 / 3
"""Share of the disks whose mean peak is the tail."""
DISKS = "disks designed for", "other disks"
PUBLISHED, TUNED = "10 N", "tuned"
"""Designs beside those of the statistics."""


def draws(problem: sh.HarmonicBalance, n_design: int, n_fresh: int) -> tuple[Any, Any]:
    """Draw disks to design for, and others; those of Fig. 12, about the load of the problem."""
    widths = fig12.HALF_WIDTHS
    drawn = sh.mistuning.uniform(problem, n_design + n_fresh, seed=fig12.SEED, **widths)
    return drawn.isel(sample=slice(n_design)), drawn.isel(sample=slice(n_design, None))


def value(statistic: str, peaks: np.ndarray) -> float:
    """Return a statistic of highest peaks [m] of disks."""
    if statistic == "mean":
        return float(np.mean(peaks))
    if statistic == "worst":
        return float(np.max(peaks))
    # The mean over the worst share; a disk at its end counts in part.
    ordered, room = np.sort(peaks)[::-1], TAIL * len(peaks)
    weights = np.clip(room - np.arange(len(peaks)), 0, 1)
    return float(weights @ ordered / room)


def compute(
    progress: bool = True,
    n_design: int = N_DESIGN,
    n_fresh: int = N_FRESH,
    statistics: Sequence[str] = STATISTICS,
    problem: sh.HarmonicBalance | None = None,
) -> xr.Dataset:
    """Find the best load of the tuned disk and of each statistic; then follow all disks at each.

    ``problem`` is the tuned disk, by default that of Fig. 12.
    """
    problem = fig12.problem() if problem is None else problem
    known, fresh = draws(problem, n_design, n_fresh)
    keep = dict(frequency_band=BAND, throw=True, progress=False)
    tuned = sh.minimise_peak(problem, "normal_load", BOUNDS, **keep)  # type: ignore
    with ProcessPoolExecutor() as pool:
        found = [
            sh.minimise_peak(
                problem,
                "normal_load",
                BOUNDS,
                over=known,
                statistic=statistic,  # type: ignore[arg-type]
                tail=TAIL,
                n_starts=1,
                fresh=fresh,
                executor=pool,
                **keep,  # type: ignore[arg-type]
            )
            for statistic in statistics
        ]
        names = [PUBLISHED, TUNED, *statistics]
        loads = [fig12.NORMAL_LOAD, *(float(one.design_value[0]) for one in (tuned, *found))]
        disks = xr.concat([known, fresh], "sample", combine_attrs="override")
        over = disks.assign(
            normal_load=disks.normal_load
            / fig12.NORMAL_LOAD
            * xr.DataArray(loads, {"design": names}, "design")
        )
        responses = sh.frf(
            problem,
            BAND,
            over=over,
            throw=True,
            keep=["amplitude", "peak_frequency", "peak_amplitude", "peak_dof", "peak_kind"],
            executor=pool,
            progress=progress,
        )
    largest = np.maximum(
        responses.peak_amplitude.max("peak"), responses.amplitude.max(["point", "dof"])
    ).transpose("sample", "design")
    row = "statistic"
    added: dict[str, tuple[Any, Any, str, str]] = {
        row: (row, list(statistics), "1", "what is minimised"),
        "design_load": ("design", loads, "N", "normal load about which the contacts scatter"),
        "known": ("sample", np.arange(n_design + n_fresh) < n_design, "1", "designed for"),
        "largest_amplitude": (("sample", "design"), largest.values, "m", "largest response"),
        "minimised": (row, _each(found, "design_amplitude"), "m", "statistic at its optimum"),
        "minimised_fresh": (row, _each(found, "fresh_amplitude"), "m", "the same, other disks"),
        "certificate": (row, [one.certificate.item() for one in found], "1", "certificate"),
    }
    small = responses.drop_dims(["point", "event", "peak"], errors="ignore")
    return small.assign(
        {
            name: (dims, values, {"units": units, "long_name": long_name})
            for name, (dims, values, units, long_name) in added.items()
        }
    )


def _each(found: list[xr.Dataset], name: str) -> np.ndarray:
    return np.array([one[name].item() for one in found])


def statistics(dataset: xr.Dataset) -> xr.DataArray:
    """Statistics [m] of the disks that are designed for and of the others, at every design."""
    known = dataset.known.values.astype(bool)
    amplitude = dataset.largest_amplitude.values
    table = [
        [[value(str(one), column) for column in amplitude[rows].T] for rows in (known, ~known)]
        for one in dataset.statistic.values
    ]
    coords = {
        "statistic": dataset.statistic.values,
        "disks": list(DISKS),
        "design": dataset.design.values,
    }
    return xr.DataArray(table, coords, tuple(coords))


def gains(dataset: xr.Dataset) -> xr.DataArray:
    """How far [%] each statistic is lower at its own design than at that of the tuned disk."""
    table = statistics(dataset)
    own = xr.concat(
        [table.sel(statistic=one, design=one, drop=True) for one in table.statistic.values],
        table.statistic,
    )
    return 100 * (1 - own / table.sel(design=TUNED, drop=True))


def interval(dataset: xr.Dataset, statistic: str, rows: np.ndarray) -> tuple[float, float]:
    """Where the gain [%] of a statistic lies over sets of disks like those of ``rows``."""
    amplitude = dataset.largest_amplitude.isel(sample=rows)
    own, tuned = (amplitude.sel(design=one).values for one in (statistic, TUNED))

    def gain(draw: np.ndarray) -> float:
        return 100 * (1 - value(statistic, own[draw]) / value(statistic, tuned[draw]))

    return sampling.of_statistic(gain, len(own))


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the highest peak of every disk at every design, and what the designs gain."""
    with sh.plot.panels(1, 2, size=(11.0, 5.2), width_ratios=(1.7, 1)) as (figure, (left, right)):
        _draw_disks(dataset, left)
        _draw_gains(dataset, right)
        order = int(dataset.engine_order)
        figure.suptitle(
            f"Mistuned disks of {dataset.sizes['dof']} blades, EO {order}: one normal load for all"
        )
    return figure


def _decibels(amplitude: Any) -> np.ndarray:
    return 20 * np.log10(amplitude)


def _draw_disks(dataset: xr.Dataset, ax: Axes) -> None:
    known = dataset.known.values.astype(bool)
    groups = zip((known, ~known), DISKS, ("tab:blue", "tab:orange"), (-0.16, 0.16), strict=True)
    amplitude, place = dataset.largest_amplitude.values, np.arange(dataset.sizes["design"])
    for rows, name, color, aside in groups:
        few = amplitude[rows]
        spread = np.linspace(-0.08, 0.08, len(few))[:, None] if len(few) > 1 else 0.0
        at = np.broadcast_to(place + aside + spread, few.shape)
        dots = dict(color=color, alpha=0.75, markeredgewidth=0, markersize=5)
        ax.plot(at.ravel(), _decibels(few).ravel(), "o", label=f"{len(few)} {name}", **dots)  # type: ignore
        for statistic, style in zip(("mean", "tail"), ("-", ":"), strict=True):
            for column, where in zip(few.T, place + aside, strict=True):
                level = _decibels(value(statistic, column))
                ax.plot([where - 0.13, where + 0.13], [level, level], style, color="black")
    share = f"mean of the worst {100 * TAIL:.0f} %"
    for name, style in (("mean", "-"), (share, ":")):
        ax.plot([], [], style, color="black", label=name)
    words = {PUBLISHED: "source", TUNED: "tuned disk"}
    ax.set_xticks(
        place,
        [
            f"{words.get(name, name)}\n{load:.3g} N"
            for name, load in zip(dataset.design.values, dataset.design_load.values, strict=True)
        ],
    )
    ax.grid(False, axis="x")
    ax.set_xlabel("what the normal load is chosen for")
    ax.set_ylabel("highest peak of each disk [dB re 1 m]")
    ax.legend(loc="upper right")


def _draw_gains(dataset: xr.Dataset, ax: Axes) -> None:
    found, known = gains(dataset), dataset.known.values.astype(bool)
    place = np.arange(found.sizes["statistic"])
    words = f"{sampling.WORDS}, disks drawn anew"
    looks = ("tab:blue", -0.18, "", known), ("tab:orange", 0.18, "//", ~known)
    for name, (color, aside, hatch, rows) in zip(DISKS, looks, strict=True):
        heights = found.sel(disks=name).values
        ax.bar(place + aside, heights, 0.34, color=color, alpha=0.85, label=name, hatch=hatch)
        ends = np.array([interval(dataset, str(one), rows) for one in found.statistic.values])
        ax.vlines(place + aside, *ends.T, color="black", linewidth=1.1, label=words)
        words = "_"
    ax.axhline(0, color="black", linewidth=0.8)
    ax.margins(y=0.4)
    texts = [
        f"{one}\n" + ", ".join(f"{height:.1f} %" for height in found.sel(statistic=one).values)
        for one in found.statistic.values
    ]
    ax.set_xticks(place, [text.replace("-", "\N{MINUS SIGN}") for text in texts])
    ax.grid(False, axis="x")
    ax.set_xlabel("statistic that is minimised")
    ax.set_ylabel("lower than at the load of the tuned disk [%]")
    ax.legend(loc="upper right")


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Designs beside responses followed anew, beside each other, and on the other disks."""
    table = statistics(dataset)
    # Without samples: the nominal values are those of the tuned disk.
    ring, mu = one_blade(dataset), float(dataset.friction_coefficient_nominal.mean())
    rows = [
        Landmark(
            "best load of the tuned disk",
            float(dataset.design_load.sel(design=TUNED)),
            ring.optimum()[0] / mu,
            "N",
            Source.CLOSED_FORM,
            1e-9,
        )
    ]
    for statistic in dataset.statistic.values:
        one, own = table.sel(statistic=statistic), dataset.sel(statistic=statistic)
        followed = one.sel(design=statistic)
        for disks, found in zip(DISKS, (own.minimised, own.minimised_fresh), strict=True):
            label = f"{statistic} of the {disks} at its load, followed anew"
            again = float(followed.sel(disks=disks))
            rows.append(Landmark(label, float(found), again, "m", Source.EXACT, ROUND_OFF))
        here = one.sel(disks=DISKS[0])
        rows.append(
            Landmark(
                f"loads with a lower {statistic} of the {DISKS[0]} than its own",
                int((here < here.sel(design=statistic) * (1 - ROUND_OFF)).sum()),
                0,
                "",
                Source.EXACT,
                0,
            )
        )
    return rows


def findings(dataset: xr.Dataset) -> list[Finding]:
    """What designs for some disks gain on others."""
    rows = []
    for statistic in dataset.statistic.values:
        gained = gains(dataset).sel(statistic=statistic)
        own, other = (float(gained.sel(disks=disks)) for disks in DISKS)
        rows.append(
            Finding(
                "A design for some mistuned disks gains less on others than on its own",
                f"{statistic}: {own:.1f} % below the load of the tuned disk on its own, "
                f"{other:.1f} % on others",
                other < (1 - SAME) * own,
            )
        )
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
