"""The front doors: one point, and the frequency response over parameter sets."""

import warnings
from collections.abc import Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, as_completed
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from tqdm import tqdm

from symhbm import check, schema
from symhbm.branch import RADIANS, Branch, compute_branch, describe
from symhbm.fourier import FloatArray
from symhbm.residual import HarmonicBalance
from symhbm.start import solve_point
from symhbm.status import SolveError, Status
from symhbm.sweep import Sweep, parse

_BAR_DELAY = 2.0
"""Seconds before a progress bar appears."""
_BATCHES = 32


def solve(problem: HarmonicBalance, frequency: float, *, throw: bool = False) -> xr.Dataset:
    """Solve Eq. (9) at one ``frequency`` [Hz], from nothing.

    Returns a dataset without a ``point`` dimension; where nothing converged, ``converged`` is
    False, the values are NaN and ``status`` says why.

    Raises
    ------
    TypeError, ValueError
        If the frequency is not positive and finite.
    SolveError
        If nothing converged and ``throw`` is True.
    """
    _check_problem(problem)
    frequency = check.scalar("frequency", frequency, "positive")
    found = solve_point(problem, RADIANS * frequency)
    point = describe(problem, found.unknowns, frequency)
    status = found.status
    if found.converged and not point["converged"]:
        status = Status.NO_CONVERGENCE
    point |= {"iterations": np.int32(found.iterations)}
    result = schema.label_point(problem, point, str(status))
    if throw and status != Status.SUCCESS:
        raise SolveError(f"frequency={frequency:g} Hz: {status}", result)
    return result


def frf(
    problem: HarmonicBalance,
    frequency: tuple[float, float],
    at: ArrayLike | None = None,
    over: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    executor: Executor | None = None,
    throw: bool = False,
    progress: bool = True,
    max_points: int = 5000,
) -> xr.Dataset:
    """Frequency response between two frequencies, with every peak of the largest response.

    Parameters
    ----------
    problem
        What to solve.
    frequency
        First and last frequency of the band [Hz].
    at : (n,), ascending
        Frequencies [Hz] at which the response is wanted; ``frequency`` then is a dimension. By
        default the result holds the points of the path along ``point``.
    over
        Named parameters to sweep. A list is set for every blade or contact in turn and becomes a
        dimension of its own name; a DataArray may have the dimension ``dof`` or ``contact`` (a
        pattern) and any other, for example ``sample``. Several names give their product, names
        that share a dimension go in pairs.
    executor
        Where parameter sets are computed; by default in this process.
    throw
        Raise SolveError when a curve is incomplete instead of returning its status.
    progress
        Show a bar when the sweep takes longer than a few seconds.
    max_points
        Largest number of points of one path.

    Returns
    -------
    Dataset with the variables of `symhbm.schema.VARIABLES`, the parameters and the problem.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    SolveError
        If a curve is incomplete and ``throw`` is True; its ``result`` is the dataset.
    """
    _check_problem(problem)
    band = _check_band(frequency)
    grid = None if at is None else _check_grid(at, band)
    max_points = check.integer("max_points", max_points, minimum=2)
    if isinstance(executor, type) or (
        executor is not None and not callable(getattr(executor, "submit", None))
    ):
        raise TypeError(f"executor={check.shown(executor)}: expected a concurrent.futures.Executor")
    sweep = parse(problem, over)
    branches = _compute(problem, sweep, executor, progress, (band, grid, max_points))
    result = schema.label(problem, sweep, branches, "point" if grid is None else "frequency")
    bad = [branch.status for branch in branches if branch.status != Status.REACHED_END]
    if throw and bad:
        raise SolveError(f"{len(bad)} of {len(branches)} curves: {bad[0]}", result)
    return result


def _compute(
    problem: HarmonicBalance,
    sweep: Sweep,
    executor: Executor | None,
    progress: bool,
    arguments: tuple,
) -> list[Branch]:
    sets = sweep.sets()
    branches: list[Branch | None] = [None] * len(sets)
    with tqdm(
        total=len(sets), unit="curve", delay=_BAR_DELAY, disable=not progress, leave=False
    ) as bar:
        if executor is not None:
            size = -(-len(sets) // _BATCHES)
            batches = [range(i, min(i + size, len(sets))) for i in range(0, len(sets), size)]
            try:
                futures = {
                    executor.submit(_batch, problem, [sets[i] for i in batch], arguments): batch
                    for batch in batches
                }
                for future in as_completed(futures):
                    for i, branch in zip(futures[future], future.result(), strict=True):
                        branches[i] = branch
                        bar.update()
            except BrokenExecutor as error:
                warnings.warn(
                    f"a worker died ({error}); the remaining curves are computed in this process",
                    RuntimeWarning,
                    stacklevel=3,
                )
        for i, branch in enumerate(branches):
            if branch is None:
                branches[i] = _batch(problem, [sets[i]], arguments)[0]
                bar.update()
    return [branch for branch in branches if branch is not None]


def _batch(problem: HarmonicBalance, sets: Sequence[dict], arguments: tuple) -> list[Branch]:
    return [compute_branch(problem.with_parameters(**values), *arguments) for values in sets]


def _check_problem(problem: object) -> None:
    if not isinstance(problem, HarmonicBalance):
        raise TypeError(f"problem={check.shown(problem)}: expected a HarmonicBalance")


def _check_band(frequency: Any) -> tuple[float, float]:
    edges = check.array("frequency", frequency, "positive")
    if edges.shape != (2,) or edges[0] >= edges[1]:
        raise ValueError(
            f"frequency={check.shown(frequency)}: expected two frequencies (first, last) in Hz, "
            "0 < first < last"
        )
    return float(edges[0]), float(edges[1])


def _check_grid(at: ArrayLike, band: tuple[float, float]) -> FloatArray:
    grid = check.array("at", at, "positive")
    if grid.ndim != 1 or grid.size == 0 or np.any(np.diff(grid) <= 0):
        raise ValueError(f"at={check.shown(at)}: expected strictly ascending frequencies in Hz")
    if grid[0] < band[0] or grid[-1] > band[1]:
        raise ValueError(
            f"at={check.shown(at)}: expected frequencies within the band "
            f"{band[0]:g} to {band[1]:g} Hz, got {grid[0]:g} to {grid[-1]:g} Hz"
        )
    return grid
