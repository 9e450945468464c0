"""Response curves of many parameter sets, in this process or by an executor."""

import warnings
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, Executor, as_completed

from tqdm import tqdm

from symhbm.branch import Branch, Task, compute_branch
from symhbm.harmonic_sets import HarmonicSets
from symhbm.residual import HarmonicBalance
from symhbm.sweep import Sweep

_BAR_DELAY = 2.0
"""Seconds before a progress bar appears."""
_BATCHES = 32


def compute(
    problem: HarmonicBalance,
    sweep: Sweep,
    executor: Executor | None,
    progress: bool,
    task: Task,
) -> list[Branch]:
    """One response curve per parameter set, in their order, whoever computes them.

    ``executor`` is any `concurrent.futures.Executor`; a worker that dies takes nothing with it but
    its time.
    """
    sets = sweep.sets()
    harmonics = HarmonicSets(problem)
    branches: list[Branch | None] = [None] * len(sets)
    with tqdm(
        total=len(sets), unit="curve", delay=_BAR_DELAY, disable=not progress, leave=False
    ) as bar:
        if executor is not None:
            size = -(-len(sets) // _BATCHES)
            batches = [range(i, min(i + size, len(sets))) for i in range(0, len(sets), size)]
            try:
                futures = {
                    executor.submit(_batch, problem, [sets[i] for i in batch], task): batch
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
                    stacklevel=4,
                )
        for i, branch in enumerate(branches):
            if branch is None:
                branches[i] = compute_branch(problem.with_parameters(**sets[i]), task, harmonics)
                bar.update()
    return [branch for branch in branches if branch is not None]


def _batch(problem: HarmonicBalance, sets: Sequence[dict], task: Task) -> list[Branch]:
    harmonics = HarmonicSets(problem)
    return [compute_branch(problem.with_parameters(**values), task, harmonics) for values in sets]
