"""This library by itself: steps, ensembles, growth with the size, starting."""

import os
import subprocess
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from scipy.linalg import lu_factor

import symhbm as sh
from tests.benchmarks.clock import cpu, repeated, take_turns
from tests.benchmarks.problems import (
    BLADE_BAND,
    ENSEMBLE_BAND,
    RING_BAND,
    blade,
    draws,
    mistuned,
    ring,
)
from tests.benchmarks.programs import MissingError, evaluated_by, optional
from tests.benchmarks.structures import least_of
from tests.benchmarks.table import Table, ratio, seconds

N_SAMPLES, N_SHARED = 16, 64
"""Rings in one process, and in two: few would leave one of them waiting at the end."""
SIZES = (13, 50, 200, 1000, 2000)
GROWTH_BAND, GROWTH_POINTS = (204.0, 280.0), 30
"""Band over which sizes are compared [Hz], and points after which each curve is left."""
RUNS = 3
FRESH = """
import time
start = time.process_time()
import symhbm as sh
imported = time.process_time()
blade = sh.single_blade(
    mass=1, stiffness=1e4, damping=0.5, contact_stiffness=1e4, friction_coefficient=0.5,
    normal_load=3,
)
sh.frf(sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=100.0)), (10, 30))
print(imported - start, time.process_time() - imported)
"""


def step() -> list[Table]:
    """Time of a point over that of the work it cannot do without."""
    header = ["curve", "points", "time per point", "evaluation", "LAPACK", "point / both"]
    caption = (
        "**A step** of the continuation, peaks and events included, over one residual with its "
        "Jacobian and one factorisation by LAPACK of the same size: as this library evaluates "
        "them, and in brackets as the compiled loop does (256 samples)."
    )
    table = Table(caption, header)
    cases = {
        "blade, 3 N": (blade(3), BLADE_BAND),
        "ring, 10 N": (ring((1,), 10), RING_BAND),
        "mistuned ring, 10 N": (mistuned(13), ENSEMBLE_BAND),
    }
    for case, (problem, band) in cases.items():
        timed = _curve(problem, band)
        point = timed.seconds / int(timed.result.n_points)
        found = timed.result.isel(point=timed.result.sizes["point"] // 2)
        unknowns = found.coefficient.transpose("dof", "harmonic", "component").values.ravel()
        omega = 2 * np.pi * float(found.frequency)
        evaluation = repeated(lambda p=problem, u=unknowns, w=omega: p.evaluate(u, w))
        square = np.eye(len(unknowns) + 1) + np.random.default_rng(0).random(
            (len(unknowns) + 1,) * 2
        )
        lapack = repeated(lambda a=square: lu_factor(a, check_finite=False))
        row = [case, str(int(timed.result.n_points)), seconds(point)]
        both, inner = ratio(point / (evaluation + lapack)), seconds(evaluation)
        try:
            marched = optional("aft").evaluation(problem, 256, unknowns, omega)
            compiled = repeated(marched)
            both += f" ({ratio(point / (compiled + lapack))})"
            inner += f" ({seconds(compiled)})"
        except MissingError as error:
            table.remarks.append(str(error))
        table.rows.append([*row, inner, seconds(lapack), both])
    return [table]


def ensemble() -> list[Table]:
    """Mistuned frequency responses per second of one core."""

    def evaluated(machine_code: bool):
        def run():
            with evaluated_by(machine_code):
                return _ensemble()

        return lambda: run

    names = {"machine code": True, "the virtual machine of CasADi": False}
    programs = {name: evaluated(machine_code) for name, machine_code in names.items()}
    timed = take_turns(programs, rounds=RUNS)
    least = least_of(mistuned(13))
    header = ["equations by", "curves per second and core", "curve / L"]
    header += ["points", "peaks", "events", "linear solves", "complete"]
    caption = (
        f"**Ensemble** of {N_SAMPLES} mistuned rings of 13 blades, 50 to 350 Hz, one harmonic, in "
        "one process; means per curve. L is the time of one residual with its Jacobian as machine "
        f"code and of one factorisation by LAPACK of its size, {seconds(least)}, times the number "
        "of linear solves."
    )
    table = Table(caption, header)
    for name, run in timed.items():
        found, curve = run.result, run.seconds / N_SAMPLES
        complete = int(np.sum(found.status == sh.Status.REACHED_END))
        counts = ("n_points", "n_peaks", "n_events", "linear_solves")
        means = [float(found[count].mean()) for count in counts]
        row = [name, f"{1 / curve:.2f}", ratio(curve / (least * means[-1]))]
        shown = [f"{mean:.1f}" for mean in means]
        table.rows.append([*row, *shown, f"{complete} of {N_SAMPLES}"])
    return [table]


def processes() -> list[Table]:
    """A larger ensemble by one and by two processes: on the wall clock, and what they work."""
    wall: dict[int, list[float]] = {1: [], 2: []}
    work: dict[int, float] = {}
    pools = {workers: ProcessPoolExecutor(workers) for workers in wall}
    try:
        for turn in range(3):
            for workers, pool in pools.items():
                start = time.perf_counter()
                _ensemble(pool, N_SHARED)
                if turn:  # the first starts the processes, which compile the equations
                    wall[workers].append(time.perf_counter() - start)
    finally:
        for workers, pool in pools.items():
            before = _cpu_of_children()
            pool.shutdown()
            work[workers] = _cpu_of_children() - before
    one, two = (min(times) for times in wall.values())
    caption = (
        f"**Processes**: an ensemble of {N_SHARED} through `executor=`. Wall clock with warm "
        "processes, which on a machine that others use says less than the CPU time that all "
        "processes took for three of these ensembles, their start included."
    )
    header = ["one process", "two processes", "speed-up", "CPU time of one", "of two", "two / one"]
    row = [seconds(one), seconds(two), ratio(one / two)]
    row += [seconds(work[1]), seconds(work[2]), ratio(work[2] / work[1])]
    return [Table(caption, header, [row])]


def _cpu_of_children() -> float:
    """CPU seconds of all processes that this one has started and seen end."""
    times = os.times()
    return times.children_user + times.children_system


def growth() -> list[Table]:
    """Time per point over the number of blades."""
    caption = (
        f"**Growth**: mistuned rings, one harmonic, the first {GROWTH_POINTS} points from "
        f"{GROWTH_BAND[0]:g} Hz on, with all events and peaks between them."
    )
    header = ["blades", "up to", "events", "peaks", "linear solves", "curve", "per point"]
    table = Table(caption, [*header, "per solve"])
    measured = []
    for size in SIZES:
        given = dict(keep=["amplitude"], max_points=GROWTH_POINTS)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="the curve is incomplete")  # as it is meant
            timed = _curve(mistuned(size), GROWTH_BAND, **given)
        names = ("n_points", "n_events", "n_peaks", "linear_solves")
        points, events, peaks, solves = (int(timed.result[name]) for name in names)
        each = timed.seconds / points, timed.seconds / solves
        measured.append((size, *each))
        last = float(timed.result.frequency.max())
        counts = [f"{last:.4g} Hz", str(events), str(peaks), str(solves)]
        times = [seconds(value) for value in (timed.seconds, *each)]
        table.rows.append([str(size), *counts, *times])
    logarithms = np.log(measured)
    per_point, per_solve = np.polyfit(logarithms[:, 0], logarithms[:, 1:], 1)[0]
    table.remarks.append(
        f"Exponents over the number of blades: {per_point:.2f} per point, {per_solve:.2f} per "
        "linear solve."
    )
    return [table]


def start() -> list[Table]:
    """Import and first solution in fresh processes, and building many harmonics."""
    # With the bytecode that an installation has, which the first run writes.
    given = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    options = dict(capture_output=True, text=True, check=True, env=given)
    runs = [subprocess.run([sys.executable, "-c", FRESH], **options) for _ in range(RUNS)]
    imported, solved = np.min([np.array(run.stdout.split(), float) for run in runs], axis=0)
    built = min(cpu(lambda: ring(tuple(range(1, 32)), 10)).seconds for _ in range(RUNS))
    header = ["import symhbm", "first problem and curve", "ring with harmonics 1 to 31 built"]
    row = [seconds(value) for value in (imported, solved, built)]
    return [Table("**Start** in a fresh process, CPU time.", header, [row])]


def _curve(problem: sh.HarmonicBalance, band: tuple[float, float], **options):
    """The curve of the whole structure, timed."""

    def run():
        return sh.frf(problem.with_by_sector(False), band, progress=False, **options)

    return take_turns({"curve": lambda: run}, rounds=3)["curve"]


def _ensemble(executor: ProcessPoolExecutor | None = None, n_samples: int = N_SAMPLES):
    problem = ring((1,), 10)
    keep = ["amplitude", "peak_frequency", "peak_amplitude"]
    over = draws(problem, n_samples)
    return sh.frf(problem, ENSEMBLE_BAND, over=over, keep=keep, executor=executor, progress=False)
