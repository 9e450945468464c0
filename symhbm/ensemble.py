"""Response curves of many parameter sets, in this process or by an executor."""

import pickle
import queue
import threading
import warnings
from collections.abc import Collection, Generator, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from dataclasses import replace
from functools import lru_cache
from typing import Any

from tqdm import tqdm

from symhbm.branch import Branch, Task, compute_branch
from symhbm.harmonic_sets import HarmonicSets
from symhbm.residual import HarmonicBalance
from symhbm.status import Status
from symhbm.sweep import Sweep
from symhbm.tables import reduced

_BAR_DELAY = 2.0
"""Seconds before a progress bar appears."""
_WAITING = 2
"""Parameter sets that wait for each worker."""
_UNKNOWN = 1000
"""Parameter sets that wait where the number of workers is not known."""

Outcome = tuple[int, Branch | str]
"""Number of a parameter set and its curve, or why there is none."""


def compute(
    problem: HarmonicBalance,
    sweep: Sweep,
    task: Task,
    blank: Branch,
    executor: Executor | None = None,
    progress: bool = True,
    done: Collection[int] = (),
) -> Generator[tuple[int, Branch], None, None]:
    """Number and curve of each parameter set but those ``done``, in the order they are finished.

    ``executor`` is any `concurrent.futures.Executor`; what it does not compute, as workers die or
    it is closed, is computed in this process. A set whose computation fails has the ``blank`` curve
    with a status that says so.
    """
    with tqdm(
        total=sweep.size,
        initial=len(done),
        unit="curve",
        delay=_BAR_DELAY,
        disable=not progress,
        leave=False,
    ) as bar:
        numbers = (number for number in range(sweep.size) if number not in done)
        for number, found in _outcomes(problem, sweep, task, numbers, executor):
            bar.update()
            yield number, replace(blank, status=found) if isinstance(found, str) else found


def _outcomes(
    problem: HarmonicBalance,
    sweep: Sweep,
    task: Task,
    numbers: Iterator[int],
    executor: Executor | None,
) -> Iterator[Outcome]:
    left: Iterator[int] | list[int] = numbers
    if executor is not None:
        left = yield from _shared(problem, sweep, task, numbers, executor)
    sets = HarmonicSets(problem)
    for number in left:
        yield number, _branch(problem, task, sets, sweep.chosen(number))


def _shared(
    problem: HarmonicBalance,
    sweep: Sweep,
    task: Task,
    numbers: Iterator[int],
    executor: Executor,
) -> Generator[Outcome, None, list[int]]:
    """What an executor computes; returns the numbers of the sets that it does not."""
    workers = getattr(executor, "_max_workers", None)
    most = _UNKNOWN if workers is None else (1 + _WAITING) * workers
    payload = pickle.dumps((problem, task))
    pending: dict[Future, int] = {}
    finished: queue.SimpleQueue[Future] = queue.SimpleQueue()
    left: list[int] = []
    try:
        while True:
            while len(pending) < most and (number := next(numbers, None)) is not None:
                try:
                    future = executor.submit(_work, payload, sweep.chosen(number))
                except Exception as error:
                    _warn(error, left)
                    left += [number, *numbers]
                    break
                pending[future] = number
                future.add_done_callback(finished.put)
            if not pending:
                return left
            future = finished.get()
            number = pending.pop(future)
            # Whatever a set itself raises is returned: this is the executor's own failure.
            try:
                found = future.result()
            except (Exception, CancelledError) as error:
                _warn(error, left)
                left.append(number)
            else:
                yield number, found
    finally:
        for future in pending:
            future.cancel()


def _warn(error: BaseException, left: list[int]) -> None:
    """Say once that an executor failed."""
    if not left:
        what = "a worker died" if isinstance(error, BrokenExecutor) else "the executor failed"
        warnings.warn(
            f"{what} ({' '.join([type(error).__name__, *map(str, error.args)])}); the curves that "
            "the executor does not compute are computed in this process",
            RuntimeWarning,
            stacklevel=2,
        )


def _work(payload: bytes, chosen: dict[str, Any]) -> Branch | str:
    return _branch(*_unpacked(payload, threading.get_ident()), chosen)


@lru_cache(maxsize=32)
def _unpacked(payload: bytes, thread: int) -> tuple[HarmonicBalance, Task, HarmonicSets]:
    """Problem, task and harmonic sets, compiled once by each worker; threads share none."""
    problem, task = pickle.loads(payload)
    task.curve(problem)
    return problem, task, HarmonicSets(problem)


def _branch(
    problem: HarmonicBalance, task: Task, sets: HarmonicSets, chosen: dict[str, Any]
) -> Branch | str:
    """The curve of one parameter set, or why there is none."""
    try:
        branch = compute_branch(problem.with_parameters(**chosen), task, sets)
        return reduced(branch, task)
    except Exception as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        return f"{Status.COMPUTATION_FAILED} ({why})"
