"""What many mistuned disks cost: CPU time, bytes, parts and their merging, statistics, memory."""

import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import symhbm as sh
from tests.benchmarks.clock import cpu, take_turns
from tests.benchmarks.problems import ENSEMBLE_BAND, draws, ring
from tests.benchmarks.programs import evaluated_by
from tests.benchmarks.table import Table, ratio, seconds

KEPT = {
    "everything": {},
    "amplitudes on the path, peaks": dict(keep=["amplitude", "peak_frequency", "peak_amplitude"]),
    "amplitudes at 601 frequencies, peaks": dict(
        keep=["amplitude", "peak_frequency", "peak_amplitude"], at=np.linspace(*ENSEMBLE_BAND, 601)
    ),
    "peaks, verifiable": dict(keep=["peak_frequency", "peak_amplitude", "peak_dof"]),
    "peaks alone": dict(keep=["peak_frequency", "peak_amplitude", "peak_dof"], verifiable=False),
}
"""What is stored of each disk, and how."""
CHEAP = dict(keep=["peak_frequency", "peak_amplitude", "peak_dof"], verifiable=False)
DISKS = (1_000, 100_000, 10_000_000)
FEW, MORE = 4, 12
"""Disks in an archive: the difference of both leaves out what all archives have."""
IN_PART, PARTS = 250, (2, 4, 8)
NARROW = (210.0, 211.0)
"""Band of disks that cost little [Hz], where archives and not responses are measured."""
WHOLE = (1_000, 100_000, 400_000)
ALONE = """
import sys, time
import symhbm as sh
from tests.benchmarks.problems import draws, ring
from tests.benchmarks.scale import CHEAP, NARROW, largest_memory
problem, n = ring((1,), 10), int(sys.argv[1])
over = draws(problem, n)
before, start = largest_memory(), time.process_time()
sh.frf(problem, NARROW, over=over, part=range(8), archive=sys.argv[2], progress=False, **CHEAP)
print(time.process_time() - start, before, largest_memory())
"""


def largest_memory() -> int:
    """The largest memory of this process so far [bytes].

    That of `resource` would be no less than what the process that started this one has.
    """
    status = Path("/proc/self/status").read_text()
    return 1024 * int(status.partition("VmHWM:")[2].split()[0])


class OfWhole(NamedTuple):
    """What a part takes for each disk of the whole, whatever it computes."""

    seconds: float
    """CPU time."""
    stored: float
    """Bytes of its archive."""
    memory: float
    """Bytes."""


class Measured(NamedTuple):
    """What the costs of many disks are made of."""

    compiled: float
    """CPU time of a disk, as machine code [s]."""
    interpreted: float
    kept: dict[str, tuple[float, float]]
    """Bytes of a disk by what is kept, in an archive and in memory."""
    merging: dict[str, float]
    """CPU time of merging by what is kept, for each disk [s]."""
    whole: OfWhole
    statistics: float
    """CPU time of statistics, for each disk [s]."""


def scale() -> list[Table]:
    """Costs of a disk, measured, and of thousands to millions, by multiplication."""
    with tempfile.TemporaryDirectory() as folder:
        disk, compiled, interpreted = _disk()
        kept_table, kept = _kept(Path(folder))
        parts, merging = _merging(Path(folder))
        whole, of_whole = _wholes(Path(folder))
        told, of_statistics = _statistics()
    measured = Measured(compiled, interpreted, kept, merging, of_whole, of_statistics)
    return [disk, kept_table, parts, whole, told, _projected(measured)]


def _disk() -> tuple[Table, float, float]:
    problem, n = ring((1,), 10), 8
    over, options = draws(problem, n), dict(KEPT["amplitudes on the path, peaks"])

    def evaluated(machine_code: bool) -> Callable:
        def run():
            with evaluated_by(machine_code):
                return sh.frf(problem, ENSEMBLE_BAND, over=over, progress=False, **options)

        return lambda: run

    timed = take_turns({"with": evaluated(True), "without": evaluated(False)}, rounds=2)
    each = {name: run.seconds / n for name, run in timed.items()}
    points = float(timed["with"].result.n_points.mean())
    caption = (
        f"**A disk**: 13 mistuned blades, one harmonic, {ENSEMBLE_BAND[0]} to {ENSEMBLE_BAND[1]} "
        f"Hz, {points:.0f} points with their events and peaks; mean of {n} disks, CPU time."
    )
    header = ["with a compiler of C", "without", "without / with"]
    row = [*map(seconds, each.values()), ratio(each["without"] / each["with"])]
    return Table(caption, header, [row]), each["with"], each["without"]


def _kept(folder: Path) -> tuple[Table, dict[str, tuple[float, float]]]:
    problem, bytes_of = ring((1,), 10), {}
    caption = (
        "**Archives**: bytes of each further disk by what is kept, in the file and loaded, and how "
        "many times the CPU time of the cheapest it takes to compute and write."
    )
    table = Table(caption, ["kept", "in the file", "loaded", "CPU time over the least"])
    times = {}
    for number, (name, options) in enumerate(KEPT.items()):
        sizes = []
        for n in (FEW, MORE):
            path = folder / f"kept-{number}-{n}.nc"
            given = dict(over=draws(problem, n), archive=path, progress=False, **options)
            timed = cpu(lambda given=given: sh.frf(problem, ENSEMBLE_BAND, **given).close())
            sizes.append(path.stat().st_size)
        # Loaded, all disks are as wide as the widest: a difference of two widths is no size.
        loaded = sh.load(path).nbytes / MORE
        times[name], bytes_of[name] = timed.seconds, ((sizes[1] - sizes[0]) / (MORE - FEW), loaded)
    for name, (stored, loaded) in bytes_of.items():
        row = [name, size(stored), size(loaded), ratio(times[name] / min(times.values()))]
        table.rows.append(row)
    return table, bytes_of


def _merging(folder: Path) -> tuple[Table, dict[str, float]]:
    problem = ring((1,), 10)
    caption = (
        "**Merging** parts: peaks alone of disks in a narrow band, where archives and not "
        "responses take the time, and everything of disks over the whole band. CPU time."
    )
    table = Table(caption, ["kept", "parts", "disks", "merging", "per part", "per disk"])
    cases = [("peaks alone", NARROW, CHEAP, IN_PART, n_parts) for n_parts in PARTS]
    cases += [("everything", ENSEMBLE_BAND, {}, 10, n_parts) for n_parts in PARTS[:2]]
    measured: dict[str, list[tuple[int, float]]] = {}
    for name, band, options, in_part, n_parts in cases:
        n = in_part * n_parts
        over, paths = draws(problem, n), []
        for k in range(n_parts):
            paths.append(folder / f"{name}-{n_parts}-{k}.nc")
            given = dict(over=over, part=(k + 1, n_parts), archive=paths[-1], progress=False)
            sh.frf(problem, band, **given, **options).close()
        whole = folder / f"{name}-{n_parts}.nc"
        timed = cpu(lambda p=paths, w=whole: sh.datasets.merge(p, w, progress=False).close())
        row = [name, str(n_parts), str(n), seconds(timed.seconds)]
        table.rows.append([*row, *(seconds(timed.seconds / many) for many in (n_parts, n))])
        measured.setdefault(name, []).append((n, timed.seconds))
    each = {name: float(np.polyfit(*np.transpose(of), 1)[0]) for name, of in measured.items()}
    told = ", ".join(f"{seconds(value)} with {name}" for name, value in each.items())
    table.remarks.append(f"Each further disk takes {told}.")
    return table, each


def _wholes(folder: Path) -> tuple[Table, OfWhole]:
    caption = (
        "**A part of a large whole**: 8 disks computed of so many; each part holds the parameters "
        "of all. CPU time, file, and largest memory of a fresh process, before (with the draws of "
        "all) and after."
    )
    table = Table(caption, ["disks of the whole", "CPU time", "file", "memory before", "after"])
    sizes, largest, times = [], [], []
    for n in WHOLE:
        path = folder / f"of-{n}.nc"
        command = [sys.executable, "-W", "ignore", "-c", ALONE, str(n), str(path)]
        run = subprocess.run(command, capture_output=True, text=True, check=True)
        spent, before, after = map(float, run.stdout.split())
        sizes.append(path.stat().st_size)
        memory = [size(value) for value in (before, after)]
        largest.append(after)
        times.append(spent)
        table.rows.append([f"{n:,}", seconds(spent), size(sizes[-1]), *memory])
    # The import of a fresh process hides the memory of few disks.
    each = OfWhole(
        *((of[-1] - of[0]) / (WHOLE[-1] - WHOLE[0]) for of in (times, sizes)),
        (largest[-1] - largest[-2]) / (WHOLE[-1] - WHOLE[-2]),
    )
    table.remarks.append(
        f"For each disk of the whole, whatever it computes, a part grows by {each.stored:.0f} "
        f"bytes and its job by {each.memory:.0f} bytes of memory and {seconds(each.seconds)}."
    )
    return table, each


def _statistics() -> tuple[Table, float]:
    """Amplification, its convergence and the worst of many, from peaks that are copied."""
    problem, header = ring((1,), 10), ["disks", "CPU time", "per disk"]
    options = dict(keep=["amplitude", "peak_amplitude", "peak_frequency", "peak_dof"])
    at = np.linspace(*NARROW, 3)
    tuned = sh.frf(problem, NARROW, at=at, progress=False)
    few = sh.frf(problem, NARROW, at=at, over=draws(problem, 100), progress=False, **options)
    caption = (
        "**Statistics**: `amplification` of 13 blades at three frequencies and `convergence` of "
        "its mean, in memory."
    )
    table, each = Table(caption, header), 0.0
    for n in (1_000, 10_000):
        many = few.isel(sample=np.arange(n) % 100).assign_coords(sample=np.arange(n))

        def run(many=many):
            with warnings.catch_warnings(action="ignore"):  # peaks outside of the narrow band
                factors = sh.statistics.amplification(many, tuned)
                of = "largest_amplification_at_frequency"
                return sh.statistics.convergence(factors, of=of)

        run()
        timed = min(cpu(run).seconds for _ in range(2))
        each = timed / n
        table.rows.append([f"{n:,}", seconds(timed), seconds(each)])
    return table, each


def _projected(measured: Measured) -> Table:
    """Costs of many disks from what one costs."""
    caption = (
        "**Many disks**, by multiplication of what was measured above: CPU time of one core, and "
        "bytes. Parts are as many as hold 1,000 disks each, and at least one."
    )
    header = ["what", *(f"{n:,} disks" for n in DISKS)]
    table, kept = Table(caption, header), measured.kept
    parts = [max(1, n // 1_000) for n in DISKS]

    def add(what: str, values: list[str]) -> None:
        table.rows.append([what, *values])

    add("CPU time, with a compiler", [hours(n * measured.compiled) for n in DISKS])
    add("CPU time, without", [hours(n * measured.interpreted) for n in DISKS])
    for name, (stored, _) in kept.items():
        add(f"archive, {name}", [size(n * stored) for n in DISKS])
    for name, (_, loaded) in kept.items():
        add(f"loaded, {name}", [size(n * loaded) for n in DISKS])
    whole, all_parts = measured.whole, [*zip(DISKS, parts, strict=True)]
    add("parts of 1,000 disks", [f"{n:,}" for n in parts])
    add("memory of each job", [size(n * whole.memory) for n in DISKS])
    add("parameters in each part", [size(n * whole.stored) for n in DISKS])
    add("parameters in all parts", [size(n * whole.stored * k) for n, k in all_parts])
    add("CPU time of all parts for these", [hours(n * whole.seconds * k) for n, k in all_parts])
    for name, value in measured.merging.items():
        add(f"merging, {name}", [hours(n * value) for n in DISKS])
    add("statistics", [hours(n * measured.statistics) for n in DISKS])
    # Ensembles of so many disks, and parts of so many: less than a whole with many parts.
    n, most, in_part = DISKS[-1], DISKS[1], 10_000
    copies = (n // most) * most * (most // in_part)
    table.remarks.append(
        f"{n:,} disks as {n // most} ensembles of {most:,}, each of a seed of its own in parts of "
        f"{in_part:,}, hold {size(copies * whole.stored)} of parameters and spend "
        f"{hours(copies * whole.seconds)} on them; a job takes {size(most * whole.memory)}."
    )
    return table


def size(value: float) -> str:
    """A number of bytes with two or three digits."""
    for unit, one in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if value >= one:
            return f"{value / one:.3g} {unit}"
    return f"{value:.0f} B"


def hours(value: float) -> str:
    """A time that may be long [s]."""
    for unit, one in (("years", 8766 * 3600.0), ("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if value >= 1.5 * one:
            return (
                f"{value / one:.2g} {unit}" if value < 99.5 * one else f"{value / one:,.0f} {unit}"
            )
    return seconds(value)
