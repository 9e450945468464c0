"""Figs. 3 and 8 with the switching angles as unknowns: the same curves by the source's own form.

Eqs. (9)-(11) are followed by continuation with the Fourier coefficients and both angles of every
contact as unknowns, each point solved by Newton's method, CasADi's rootfinder or IPOPT, from a
start of its own and through the onset and the end of slip. Located friction is the reference.

The form holds while no contact reverses while it slips. So it does all over Figs. 3 and 8; for the
ring under engine order 1 at a lighter load it does where the thin line is drawn.
"""

import warnings
from importlib.metadata import version
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from studies.landmark import Landmark, Source
from studies.run import run

NAME = "switching_angles"
LAWS = ("located", "newton", "rootfinder", "ipopt")
HARMONICS = ((1,), (1, 3, 5))
LOADS = tuple(fig03.NORMAL_LOADS)
ENGINE_ORDERS = tuple(fig08.ENGINE_ORDERS)
PARTLY = (10.0,)
"""Normal loads [N] of the ring under engine order 1 at which contacts reverse while they slip."""
PART_OF_BAND = (40, 100)  # Hz
N_FREQUENCIES = 101
AGREEMENT = 1e-9
"""Relative difference of laws that are exact; all are solved to about 1e-12."""


def cases() -> list[tuple[str, sh.HarmonicBalance, tuple[float, float]]]:
    """Return label, problem and band [Hz] of the curves; those of Figs. 3 and 8 begin so."""
    chosen = []
    for harmonics in HARMONICS:
        text = f"({','.join(map(str, harmonics))})"
        blade, ring = fig03.problem(harmonics), fig08.problem(harmonics)
        for load in LOADS:
            problem = blade.with_parameters(normal_load=load)
            chosen.append((f"Fig. 3, {load:g} N, {text}", problem, fig03.BAND))
        for order in ENGINE_ORDERS:
            problem = ring.with_parameters(engine_order=order)
            chosen.append((f"Fig. 8, EO {order}, {text}", problem, fig08.BAND))
        for load in PARTLY if len(harmonics) > 1 else ():
            problem = ring.with_parameters(normal_load=load)
            chosen.append((f"ring, EO 1, {load:g} N, {text}", problem, PART_OF_BAND))
    return chosen


def compute(progress: bool = True) -> xr.Dataset:
    """Differences from located friction, cost, and share of the band by curve and law."""
    curves = cases()
    shape = len(curves), len(LAWS)
    numbers = {
        name: np.full(shape, np.nan)
        for name in ("difference", "peak_difference", "event_difference", "share", "seconds")
    }
    solves, amplitude = np.full(shape, -1), np.full((*shape, N_FREQUENCIES), np.nan)
    frequency = np.array([np.linspace(*band, N_FREQUENCIES) for _, _, band in curves])
    status = np.full(shape, "", dtype=object)
    for i, (_, problem, band) in enumerate(curves):
        located = _curve(problem, band, frequency[i], "located")
        for j, law in enumerate(LAWS):
            found = located if law == "located" else _curve(problem, band, frequency[i], law)
            for name in ("share", "seconds"):
                numbers[name][i, j] = found[name]
            solves[i, j], status[i, j] = found["solves"], found["status"]
            amplitude[i, j] = found["grid"].amplitude.max("dof")
            for name in ("difference", "peak_difference", "event_difference"):
                numbers[name][i, j] = _differences(found, located)[name]
    dims = ("case", "law")
    about = {
        "difference": "largest difference of the coefficients, relative",
        "peak_difference": "largest difference of a peak or its frequency, relative",
        "event_difference": "largest difference of the frequency of an event, relative",
        "share": "share of the band that was followed",
    }
    variables: dict[str, Any] = {
        name: (dims, numbers[name], {"units": "1", "long_name": text})
        for name, text in about.items()
    }
    seconds = {"units": "s", "long_name": "time of the whole curve, peaks and events included"}
    variables["seconds"] = (dims, numbers["seconds"], seconds)
    variables["linear_solves"] = (dims, solves, {"units": "1", "long_name": "linear solves"})
    variables["status"] = (dims, status, {"units": "1", "long_name": "how the curve ended"})
    largest = {"units": "m", "long_name": "largest response"}
    variables["amplitude"] = ((*dims, "place"), amplitude, largest)
    hertz = {"units": "Hz", "long_name": "excitation frequency"}
    return xr.Dataset(
        variables,
        {
            "case": [label for label, *_ in curves],
            "law": list(LAWS),
            "frequency": (("case", "place"), frequency, hertz),
        },
        {
            "title": "Figs. 3 and 8 with the switching angles as unknowns",
            "references": "E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013, hal-00941429",
            "symhbm_schema": 1,
            "symhbm_version": version("symhbm"),
        },
    )


def _curve(problem: sh.HarmonicBalance, band: Any, grid: np.ndarray, law: str) -> dict[str, Any]:
    """A curve by one law with its cost, and the same on a grid."""
    options: dict[str, Any] = dict(progress=False) | ({} if law == "located" else {"angles": law})
    with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
        sh.frf(problem, band, max_points=2, **options)  # compiled before it is timed
        start = perf_counter()
        path = sh.frf(problem, band, **options)
        seconds = perf_counter() - start
        on_grid = sh.frf(problem, band, at=grid, **options)
    return {
        "path": path,
        "grid": on_grid,
        "seconds": seconds,
        "solves": int(path.linear_solves),
        "status": str(path.status.values),
        "share": float(path.angles_share) if "angles_share" in path else 1.0,
    }


def _differences(found: dict[str, Any], located: dict[str, Any]) -> dict[str, float]:
    """Largest relative differences; NaN of peaks and events where their numbers differ."""
    one, other = found["grid"].coefficient, located["grid"].coefficient
    inner = ["dof", "harmonic", "component"]
    difference = np.sqrt(((one - other) ** 2).sum(inner, skipna=False) / (other**2).sum(inner))
    result = {"difference": float(difference.max())}
    for name, variables in {
        "peak_difference": ("peak_frequency", "peak_amplitude"),
        "event_difference": ("event_frequency",),
    }.items():
        pairs = [(found["path"][v].values, located["path"][v].values) for v in variables]
        alike = all(a.shape == b.shape for a, b in pairs)
        each = [np.abs(a / b - 1).max(initial=0.0) for a, b in pairs] if alike else [np.nan]
        result[name] = float(np.max(each))
    return result


def table(dataset: xr.Dataset) -> str:
    """Return share of the band, difference, and time over that of located angles, as Markdown."""
    lines = ["| curve | share | " + " | ".join(LAWS[1:]) + " |", "|---" * (len(LAWS) + 1) + "|"]
    for case in dataset.case.values:
        row = dataset.sel(case=case)
        ratio = row.seconds / row.seconds.sel(law="located")
        cells = [
            f"{float(row.difference.sel(law=law)):.0e} ({float(ratio.sel(law=law)):.1f})"
            for law in LAWS[1:]
        ]
        share = float(row.share.sel(law=list(LAWS[1:])).min())
        lines.append(f"| {case} | {100 * share:.1f} % | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the curves of Fig. 3 by both forms, one where it applies in parts, and the cost."""
    last = f"({','.join(map(str, HARMONICS[-1]))})"
    names = [str(name) for name in dataset.case.values]
    blades = [name for name in names if name.startswith("Fig. 3") and name.endswith(last)]
    partly = [name for name in names if name.startswith("ring") and name.endswith(last)]
    with sh.plot.panels(1, 3, size=(10.0, 3.6)) as (figure, axes):
        for ax, shown, title in (
            (axes[0], blades, f"Fig. 3, harmonics {last}"),
            (axes[1], partly, f"Ring, engine order 1, {last}"),
        ):
            for k, name in enumerate(shown):
                row = dataset.sel(case=name)
                labels = ("located", "angles as unknowns") if k == 0 else (None, None)
                located, angles = (row.amplitude.sel(law=law) for law in ("located", "newton"))
                ax.semilogy(row.frequency, located, color="0.6", lw=2.5, label=labels[0])
                ax.semilogy(row.frequency, angles, color="black", lw=0.8, label=labels[1])
            ax.set_xlabel("excitation frequency [Hz]")
            ax.set_title(title)
        axes[0].set_ylabel("amplitude [m]")
        axes[1].legend(handles=axes[0].get_lines()[:2], loc="lower center")
        whole = dataset.sel(case=[name for name in names if name.startswith("Fig.")])
        ratio = whole.seconds / whole.seconds.sel(law="located")
        for j, law in enumerate(LAWS[1:]):
            values = ratio.sel(law=law).values
            axes[2].plot(np.full(len(values), j), values, "o", color="0.5", markersize=3)
            axes[2].plot(j, np.median(values), "_", color="black", markersize=22)
        axes[2].set_xticks(range(len(LAWS) - 1), LAWS[1:])
        axes[2].set_xlim(-0.5, len(LAWS) - 1.5)
        axes[2].set_ylim(bottom=0)
        axes[2].set_ylabel("time over that of located angles")
        axes[2].set_title("Cost, Figs. 3 and 8")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Agreement with located friction, and the share of the bands of Figs. 3 and 8."""
    figures = dataset.sel(case=dataset.case.str.startswith("Fig."))
    rows = []
    for law in LAWS[1:]:
        one, paper = dataset.sel(law=law), figures.sel(law=law)
        for name, what, among in (
            ("difference", "difference from located angles", one),
            ("peak_difference", "difference of peaks, Figs. 3 and 8", paper),
            ("event_difference", "difference of events, Figs. 3 and 8", paper),
        ):
            value = float(among[name].max(skipna=name == "difference"))
            title = f"{what}, angles as unknowns by {law}, largest"
            rows.append(Landmark(title, value, 0.0, "", Source.EXACT, AGREEMENT))
        share = float(paper.share.min())
        title = f"share of the bands of Figs. 3 and 8 followed by {law}"
        rows.append(Landmark(title, share, 1.0, "", Source.EXACT, 0.0))
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
