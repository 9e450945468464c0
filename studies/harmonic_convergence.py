"""How many harmonics are enough: harmonic balance against the exact periodic motion.

The exact amplitudes (data/reference, and `symhbm.periodic_motion` where contacts reverse three
times per half period) are good to 1e-11. The friction force has kinks, so its coefficients fall as
n^-2 and those of the response as n^-4; the sum of the harmonics left out, and with it the error of
a truncated set, falls as n^-3.
"""

import json
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from studies.claim import Finding
from studies.companions import VISIBLE, suffices
from studies.landmark import Landmark, Source
from studies.run import REFERENCE, run

NAME = "harmonic_convergence"
HIGHEST = (1, 3, 5, 7, 9, 11, 15, 21, 31)
SIX_REVERSALS = (62.0, 63.0, 64.5, 66.25)
"""Frequencies [Hz] on the ring at engine order 1 and 10 N."""


def cases() -> list[tuple[str, sh.HarmonicBalance, float, float]]:
    """Return label, problem, frequency [Hz] and exact amplitude [m] of the points that slip."""
    exact = json.loads(REFERENCE.read_text())
    chosen = []
    for point in exact["single_blade_points"]:
        if point["slip_fraction"][0] > 0:
            load, frequency = point["Fn"], point["freq_hz"]
            problem = fig03.problem().with_parameters(normal_load=load)
            label = f"blade, {load:g} N, {frequency:.2f} Hz"
            chosen.append((label, problem, frequency, point["x_max_abs"][0]))
    for curve in exact["ring_EO_1_3_6_Fn100"]:
        order = curve["EO"]
        problem = fig08.problem().with_parameters(engine_order=order)
        for point in curve["points"]:
            label = f"ring, EO {order}, {point['freq_hz']:.2f} Hz"
            chosen.append((label, problem, point["freq_hz"], float(np.max(point["x_max_abs"]))))
    problem = fig08.problem().with_parameters(engine_order=1, normal_load=10)
    for frequency in SIX_REVERSALS:
        motion = sh.periodic_motion(problem, frequency, throw=True)
        reversals = int(motion.reversals.max())
        label = f"ring, EO 1, 10 N, {frequency:.2f} Hz, {reversals} reversals"
        chosen.append((label, problem, frequency, float(motion.amplitude.max())))
    return chosen


def compute(progress: bool = True) -> xr.Dataset:
    """Relative error of the amplitude by point and highest odd harmonic."""
    points = cases()
    error = np.full((len(points), len(HIGHEST)), np.nan)
    for i, (_, problem, frequency, exact) in enumerate(points):
        for j, highest in enumerate(HIGHEST):
            harmonics = range(1, highest + 1, 2)
            truncated = sh.HarmonicBalance(problem.model, problem.excitation, harmonics)
            found = sh.solve(truncated, frequency, throw=True)
            error[i, j] = abs(float(found.amplitude[0]) / exact - 1)
    return xr.Dataset(
        {
            "error": (
                ("case", "highest_harmonic"),
                error,
                {"units": "1", "long_name": "relative error of the largest displacement"},
            )
        },
        {"case": [label for label, *_ in points], "highest_harmonic": list(HIGHEST)},
        {
            "title": "Truncation error of harmonic balance with dry friction",
            "references": "exact amplitudes: data/reference/exact_values.json, periodic_motion",
            "symhbm_schema": 1,
            "symhbm_version": version("symhbm"),
        },
    )


def table(dataset: xr.Dataset) -> str:
    """Return the errors of the points that slip as a Markdown table."""
    heads = [f"1..{int(n)}" if n > 1 else "1" for n in dataset.highest_harmonic]
    lines = ["| point | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    for case in dataset.case.values:
        row = dataset.error.sel(case=case).values
        if row.max() > 1e-12:
            lines.append(f"| {case} | " + " | ".join(f"{value:.1e}" for value in row) + " |")
    return "\n".join(lines)


def _kind(case: str) -> str:
    if case.startswith("blade"):
        return "one blade"
    return "ring, contacts reverse 6 times or more" if "reversals" in case else "ring of 13"


def draw(dataset: xr.Dataset) -> Figure:
    """Draw error over highest harmonic, and the slope of order three."""
    with sh.plot.panels() as (figure, ax):
        highest = dataset.highest_harmonic.values
        for kind, color, marker, aside in (
            ("one blade", "0.6", "o", 0.97),
            ("ring of 13", "black", "s", 1.0),
            ("ring, contacts reverse 6 times or more", "tab:red", "^", 1.03),
        ):
            hollow: Any = dict(markerfacecolor="none")
            rows = [row for row in dataset.error if _kind(str(row.case.values)) == kind]
            rows = [row.values for row in rows if row.max() > 1e-12]
            for i, row in enumerate(rows):
                label = kind if i == 0 else None
                # Beside each other, and not joined: there are no harmonics between.
                at = highest * aside
                ax.loglog(at, row, marker, color=color, markersize=3.5, label=label, **hollow)
        ax.loglog(highest, 0.3 * highest**-3.0, "k--", label="order 3, as kinks of the force make")
        ax.set_xlabel("highest harmonic")
        ax.set_ylabel("relative error of the amplitude")
        ax.set_xticks(highest, [str(n) for n in highest], minor=False)
        ax.minorticks_off()
        ax.legend()
        ax.set_title("Odd harmonics against the exact periodic motion")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """The order at which the error falls."""
    highest = np.log(dataset.highest_harmonic.values)
    # One line through all points: a single one is better or worse by chance.
    slipping = dataset.error.where(
        dataset.error.sel(highest_harmonic=1, drop=True) > 1e-5, drop=True
    )
    slope = np.polyfit(highest, np.log(slipping.values).T, 1)[0]
    return [
        Landmark(
            "power of the highest harmonic with which the error falls, median",
            float(-np.median(slope)),
            3.0,
            "",
            Source.CLOSED_FORM,
            0.2,
        )
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """The largest error of one harmonic, on one blade and on the ring."""
    rows = []
    for kind, words in (("blade", "one blade"), ("ring", "the ring")):
        error = dataset.error.sel(highest_harmonic=1)
        largest = float(error[dataset.case.str.startswith(kind).values].max())
        rows.append(
            Finding(
                f"Beside the peaks, one harmonic errs by more than {VISIBLE:g} dB on {words}",
                f"by {100 * largest:.2g} % at the worst of these points",
                not suffices(1 + largest),
            )
        )
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
