"""Three friction laws and three solvers on the same points: differences and cost.

Located angles are the reference. The form with the switching angles as unknowns (Eqs. 4-11) is
solved by Newton's method, CasADi's rootfinder and IPOPT; sampled friction has an error of its own.
All start from the response at a frequency one per mille lower.
"""

from collections.abc import Callable
from importlib.metadata import version
from time import perf_counter

import numpy as np
import xarray as xr
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
            "symhbm_schema": 2,
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
        found = solve_angles(problem, omega, solver, located, start=start, angles=angles)
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
    """Draw the difference from located angles by method, one line per point."""
    with sh.plot.panels() as (figure, ax):
        sampled = [f"{n} samples" for n in SAMPLES]
        for kind, color, marker in (("blade", "0.6", "o"), ("ring", "black", "s")):
            rows = [c for c in dataset.case.values if str(c).startswith(kind)]
            for i, case in enumerate(rows):
                values = dataset.difference.sel(case=case, law=sampled)
                label = {"blade": "one blade", "ring": "ring of 13"}[kind] if i == 0 else None
                ax.loglog(
                    SAMPLES, values, marker, linestyle="-", color=color, markersize=3, label=label
                )
        steps = np.array(SAMPLES, dtype=float)
        ax.loglog(steps, 20 * steps**-2, "k--", label="order 2")
        ax.set_xticks(SAMPLES, [str(n) for n in SAMPLES], minor=False)
        ax.minorticks_off()
        ax.set_xlabel("samples per period")
        ax.set_ylabel("difference from located angles")
        ax.legend()
        ax.set_title("Error of sampled friction")
    return figure


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
