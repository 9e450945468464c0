"""Three friction laws and three solvers on the same points: differences and cost.

Located angles are the reference. The form with the switching angles as unknowns (Eqs. 4-11) is
solved by Newton's method, CasADi's rootfinder and IPOPT; sampled friction has an error of its own.
All start from the response at a frequency one per mille lower.
"""

from collections.abc import Callable
from importlib.metadata import version
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from studies.landmark import Landmark, Source
from studies.run import run
from symhbm.continuation import Status, newton, solve_point
from symhbm.continuation.angles import AngleStatus, solve_angles

NAME = "laws_and_solvers"
SOLVERS = ("newton", "rootfinder", "ipopt")
SAMPLES = (64, 256, 1024, 4096)
SHIFT = 1e-3
REPEATS = 3
AGREEMENT = 1e-9
"""Relative difference of laws that are exact; all are solved to about 1e-12."""
_ROUND_OFF = 1e-16
OUTCOMES = {
    str(AngleStatus.DOES_NOT_APPLY): "does not apply",
    str(AngleStatus.NO_CONVERGENCE): "not converged",
    str(Status.NO_CONVERGENCE): "not converged",
}


def cases() -> list[tuple[str, sh.HarmonicBalance, float]]:
    """Return label, problem and frequency [Hz] of the points."""
    chosen = []
    for harmonics in ((1,), (1, 3), (1, 3, 5)):
        text = ",".join(map(str, harmonics))
        blade, ring = fig03.problem(harmonics), fig08.problem(harmonics)
        for load, frequency in ((1, 15.0), (3, 19.5)):
            problem = blade.with_parameters(normal_load=load)
            chosen.append((f"blade, {load} N, {frequency} Hz, ({text})", problem, frequency))
        for order, load, frequency in ((3, 100, 211.4), (1, 100, 77.0), (1, 10, 66.25)):
            problem = ring.with_parameters(engine_order=order, normal_load=load)
            label = f"ring, EO {order}, {load} N, {frequency} Hz, ({text})"
            chosen.append((label, problem, frequency))
    return chosen


def compute(progress: bool = True) -> xr.Dataset:
    """Difference from the located response, iterations, time and status by case and law."""
    points = cases()
    laws = ["located", *(f"angles, {s}" for s in SOLVERS), *(f"{n} samples" for n in SAMPLES)]
    shape = len(points), len(laws)
    difference, seconds = np.full(shape, np.nan), np.full(shape, np.nan)
    stated = np.full(shape, np.nan)
    iterations, status = np.full(shape, -1), np.full(shape, "", dtype=object)
    for i, (_, problem, frequency) in enumerate(points):
        omega = 2 * np.pi * frequency
        located = solve_point(problem, omega).unknowns
        near = solve_point(problem, omega * (1 - SHIFT)).unknowns
        runs = [_newton(problem, near, omega)]
        angles = sh.SwitchingAngles(problem)
        for solver in SOLVERS:
            runs.append(_angles(problem, angles, solver, near, located, omega))
        for n in SAMPLES:
            sampled = sh.HarmonicBalance(problem.model, problem.excitation, problem.harmonics, n)
            runs.append(_newton(sampled, near, omega))
            stated[i, laws.index(f"{n} samples")] = float(
                sh.solve(sampled, frequency).sampling_error
            )
        for j, attempt in enumerate(runs):
            found, iterations[i, j], status[i, j], seconds[i, j] = _timed(attempt)
            difference[i, j] = np.linalg.norm(found - located) / np.linalg.norm(located)
    dims = ("case", "law")
    about = "from the response with located angles, relative to it"
    return xr.Dataset(
        {
            "difference": (dims, difference, {"units": "1", "long_name": f"difference {about}"}),
            "sampling_error": (dims, stated, {"units": "1", "long_name": "stated sampling error"}),
            "iterations": (dims, iterations, {"units": "1", "long_name": "iterations"}),
            "seconds": (dims, seconds, {"units": "s", "long_name": "time of one solution"}),
            "status": (dims, status, {"units": "1", "long_name": "outcome"}),
        },
        {"case": [label for label, *_ in points], "law": laws},
        {
            "title": "Three friction laws and three solvers on the same points",
            "references": "E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013, hal-00941429",
            "symhbm_schema": 1,
            "symhbm_version": version("symhbm"),
        },
    )


Outcome = tuple[np.ndarray, int, str]


def _newton(problem: sh.HarmonicBalance, near: np.ndarray, omega: float) -> Callable[[], Outcome]:
    def attempt() -> Outcome:
        found = newton(lambda unknowns: problem.evaluate(unknowns, omega), near)
        return found.unknowns, found.iterations, str(found.status)

    return attempt


def _angles(problem, angles, solver, near, located, omega) -> Callable[[], Outcome]:
    start = angles.start(problem, near)[0]

    def attempt() -> Outcome:
        found = solve_angles(problem, omega, solver, located, start=start)
        return found.unknowns, found.iterations, str(found.status)

    return attempt


def _timed(attempt: Callable[[], Outcome]) -> tuple[np.ndarray, int, str, float]:
    outcome = attempt()
    times = []
    for _ in range(REPEATS):
        start = perf_counter()
        attempt()
        times.append(perf_counter() - start)
    return *outcome, min(times)


def table(dataset: xr.Dataset) -> str:
    """Return difference, and time over that of located angles in brackets, as a Markdown table."""
    laws = [str(name) for name in dataset.law.values]
    lines = ["| point | " + " | ".join(laws[1:]) + " |", "|---" * len(laws) + "|"]
    for case in dataset.case.values:
        row = dataset.sel(case=case)
        ratio = (row.seconds / row.seconds.sel(law="located")).values
        cells = []
        columns = row.difference.values[1:], ratio[1:], row.status.values[1:]
        for difference, cost, word in zip(*columns, strict=True):
            cells.append(f"{difference:.0e} ({cost:.1f})" if word == "success" else OUTCOMES[word])
        lines.append(f"| {case} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the error of sampled friction, the difference of solvers, and what each costs."""
    with sh.plot.panels(1, 3, size=(14.0, 4.8), width_ratios=(1.1, 1, 1.5)) as (figure, axes):
        _draw_samples(axes[0], dataset)
        _draw_solvers(axes[1], dataset)
        _draw_cost(axes[2], dataset)
        figure.suptitle(f"{dataset.sizes['case']} points, by the law of friction and the solver")
    return figure


def _kinds(dataset: xr.Dataset) -> list[tuple[str, dict[str, Any], float, xr.Dataset]]:
    """Words, looks, a shift to the side and points of the blade and of the ring."""
    rows = []
    for kind, words, aside, look in (
        ("blade", "one blade", -0.13, dict(marker="o", color="0.55")),
        ("ring", "ring of 13", 0.13, dict(marker="s", color="black", markerfacecolor="none")),
    ):
        points = dataset.sel(case=dataset.case.str.startswith(kind))
        rows.append((words, look | dict(linestyle="", markersize=4.5), aside, points))
    return rows


def _draw_samples(ax: Axes, dataset: xr.Dataset) -> None:
    steps = np.array(SAMPLES, dtype=float)
    for words, look, aside, rows in _kinds(dataset):
        for i, row in enumerate(rows.difference.sel(law=[f"{n} samples" for n in SAMPLES]).values):
            at = steps * (1 + 0.4 * aside)
            ax.loglog(at, row, label=words if i == 0 else None, **look)
    ax.loglog(steps, 20 * steps**-2, "k--", label="order 2")
    ax.set_xticks(SAMPLES, [str(n) for n in SAMPLES], minor=False)
    ax.minorticks_off()
    ax.set(xlabel="samples per period", ylabel="difference from located angles")
    ax.set_title("error of sampled friction")
    ax.legend(loc="lower left")


def _draw_solvers(ax: Axes, dataset: xr.Dataset) -> None:
    """Differences of angles as unknowns, and how many points have none."""
    for _, look, aside, rows in _kinds(dataset):
        for j, solver in enumerate(SOLVERS):
            one = rows.sel(law=f"angles, {solver}")
            found = one.difference.values[one.status.values == str(Status.SUCCESS)]
            ax.semilogy(np.full(len(found), j + aside), np.maximum(found, _ROUND_OFF), **look)
    for j, solver in enumerate(SOLVERS):
        status = dataset.status.sel(law=f"angles, {solver}").values
        words = [OUTCOMES[str(one)] for one in status if str(one) != str(Status.SUCCESS)]
        text = "\n".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words))
        ax.text(j, 0.99, text, transform=ax.get_xaxis_transform(), ha="center", va="top", size=8)
    ax.axhline(AGREEMENT, color="0.4", linestyle="--", linewidth=1)
    ax.text(-0.45, 1.3 * AGREEMENT, "agreement that is asked for", size=8)
    ax.set_ylim(_ROUND_OFF / 2, 30 * AGREEMENT)
    ax.set_xticks(range(len(SOLVERS)), SOLVERS)
    ax.set_xlim(-0.5, len(SOLVERS) - 0.5)
    ax.grid(False, axis="x")
    ax.set(ylabel="difference from located angles")
    ax.set_title("angles as unknowns, by solver")


def _draw_cost(ax: Axes, dataset: xr.Dataset) -> None:
    """Time of one solution over that with located angles, and the median of the points."""
    ratio = dataset.seconds / dataset.seconds.sel(law="located")
    ratio = ratio.where(dataset.status == str(Status.SUCCESS)).isel(law=slice(1, None))
    laws = ratio.law.values
    for words, look, aside, rows in _kinds(dataset):
        own = ratio.sel(case=rows.case)
        for j, law in enumerate(laws):
            label = words if j == 0 else None
            values = own.sel(law=law).values
            ax.semilogy(np.full(len(values), j + aside), values, label=label, **look)
    median = ratio.median("case").values
    line: Any = dict(linestyle="", marker="_", markersize=30, markeredgewidth=2, color="#d55e00")
    ax.plot(range(len(laws)), median, **line)
    ax.plot([], [], label="median of the points", **line | dict(markersize=12))
    for j, value in enumerate(median):
        ax.annotate(f"{value:.2g}", (j + 0.38, value), fontsize=8, color="#a04000", va="center")
    ax.axhline(1.0, color="0.4", linestyle="--", linewidth=1)
    ax.set_xticks(range(len(laws)), [str(law).replace(" ", "\n") for law in laws])
    ax.set_xlim(-0.5, len(laws) - 0.3)
    ax.grid(False, axis="x")
    ax.set_ylabel("time over that with located angles")
    ax.set_title("cost of one solution")
    ax.set_ylim(0.45, None)
    ax.legend(loc="lower center", ncols=3)


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Agreement of the exact laws, and the order of the sampled one."""
    rows = []
    for solver in SOLVERS:
        one = dataset.sel(law=f"angles, {solver}")
        solved = one.difference.where(one.status == str(Status.SUCCESS), drop=True)
        name = f"difference from located angles, angles as unknowns by {solver}, largest"
        rows.append(Landmark(name, float(solved.max()), 0.0, "", Source.EXACT, AGREEMENT))
    coarse, fine = (f"{n} samples" for n in (SAMPLES[0], SAMPLES[-1]))
    fall = dataset.difference.sel(law=coarse) / dataset.difference.sel(law=fine)
    order = np.log(float(fall.median())) / np.log(SAMPLES[-1] / SAMPLES[0])
    name = "power of the number of samples with which their error falls, median"
    # A factor of 3 over all samples.
    rows.append(Landmark(name, float(order), 2.0, "", Source.CLOSED_FORM, 0.13))
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
