"""Structures of several kinds: their curves over the work that these cannot do without."""

from collections.abc import Callable

import numpy as np
from scipy.linalg import lu_factor

import symhbm as sh
from symhbm.continuation.correctors.bordered_system import point_system
from symhbm.numerics import Compiled, to_machine_code
from tests.benchmarks.clock import repeated, take_turns
from tests.benchmarks.problems import RING_BAND, SECTOR_BAND, mistuned_sectors, ring, sector
from tests.benchmarks.programs import evaluated_by
from tests.benchmarks.table import Table, ratio, seconds

RUNS = 3
CASES: dict[str, tuple[Callable[[], sh.HarmonicBalance], tuple[float, float]]] = {
    "tuned ring of 13 blades, (1, 3, 5)": (lambda: ring((1, 3, 5), 10), RING_BAND),
    "tuned sector of 4 masses, (1, 3)": (lambda: sector((1, 3)), SECTOR_BAND),
    "tuned sector of 4 masses, (1, 3, 5, 7)": (lambda: sector((1, 3, 5, 7)), SECTOR_BAND),
    "12 mistuned sectors by Craig and Bampton, (1,)": (lambda: mistuned_sectors((1,)), SECTOR_BAND),
    "12 mistuned sectors by Craig and Bampton, (1, 3)": (
        lambda: mistuned_sectors((1, 3)),
        SECTOR_BAND,
    ),
}


def structures() -> list[Table]:
    """Tuned sectors with several harmonics, and rings of sectors that are not alike."""
    header = ["structure and harmonics", "unknowns", "points", "peaks", "events", "linear solves"]
    header += ["curve", "no compiler", "L", "curve / L", "no compiler / L"]
    caption = (
        "**Structures**: a curve over L, the time of one residual with its Jacobian as machine "
        "code, contacts located, and of one factorisation by LAPACK of its size, times the number "
        "of linear solves. Of the sector of masses, whose dynamic stiffness is that of its waves, "
        "L has the contacts alone."
    )
    table = Table(caption, header)
    for case, (build, band) in CASES.items():
        problem = build()

        def curve(machine_code: bool, problem=problem, band=band):
            def run():
                with evaluated_by(machine_code):
                    return sh.frf(problem, band, progress=False)

            return lambda: run

        timed = take_turns({str(by): curve(by) for by in (True, False)}, rounds=RUNS)
        found = timed["True"].result
        symmetry = problem.equal_sectors if int(found.n_sectors) > 1 else None
        solved = problem if symmetry is None else problem.of_sector(symmetry)
        highest = found.isel(point=int(found.amplitude.max("dof").argmax("point")))
        coefficients = highest.coefficient.transpose("dof", "harmonic", "component").values
        unknowns = coefficients[: solved.n_dof].ravel()[: solved.n_unknowns]
        least = least_of(solved, unknowns, 2 * np.pi * float(highest.frequency))
        counts = [int(found[f"n_{name}"]) for name in ("points", "peaks", "events")]
        counts = [solved.n_unknowns, *counts, int(found.linear_solves)]
        times = [timed[by].seconds for by in ("True", "False")]
        ratios = [ratio(time / (least * counts[-1])) for time in times]
        row = [case, *map(str, counts), *map(seconds, times), seconds(least), *ratios]
        table.rows.append(row)
    return [table]


def least_of(
    problem: sh.HarmonicBalance, unknowns: np.ndarray | None = None, omega: float = 1300.0
) -> float:
    """Seconds of one residual with its Jacobian as machine code, and of one factorisation.

    At ``unknowns`` [m], by default random ones, and an angular frequency ``omega`` [rad/s].
    """
    rng, size = np.random.default_rng(0), problem.n_unknowns + 1
    if unknowns is None:
        unknowns = 1e-4 * rng.random(size - 1)
    square = np.eye(size) + rng.random((size, size))
    lapack = repeated(lambda: lu_factor(square, check_finite=False))
    return repeated(_evaluation(problem, unknowns, omega)) + lapack


def _evaluation(problem: sh.HarmonicBalance, unknowns: np.ndarray, omega: float) -> Callable:
    """A call that evaluates residual and Jacobian by machine code, contacts located."""
    equations, arguments = problem.compiled
    if problem.equations.closed and problem.structure is None:
        evaluation = _as_machine_code(point_system(equations))
        evaluation.inputs[0][:] = np.concatenate([np.ravel(array) for array in arguments])
        evaluation.inputs[1][:] = np.append(unknowns, omega)
        evaluation.inputs[-1][:] = 1e-4, omega
        return evaluation.run
    evaluation = _as_machine_code(equations.located_form)
    given = problem.arguments(unknowns, omega).values()
    for array, value in zip(evaluation.inputs, given, strict=True):
        array[:] = np.ravel(value, order="F")

    def run():
        problem.locate(unknowns, omega)
        evaluation.run()

    return run


def _as_machine_code(function) -> Compiled:
    return Compiled((to_machine_code([function]) or (function,))[0])
