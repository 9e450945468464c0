"""Response curves of many parameter sets, in this process or by an executor."""

import hashlib
import math
import pickle
import queue
import threading
import time
import uuid
from collections import deque
from collections.abc import Collection, Generator, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future
from dataclasses import replace
from typing import Any

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.response.curve import compute_curve, curve_of
from symhbm.results import CurveTable, Encoded, Request, Sweep, encode, flat, reduced
from symhbm.workers import at_work, progress_bar, warn_of_executor

_WAITING = 2
"""Pieces of work that wait for each worker."""
_UNKNOWN = 1000
"""Pieces of work that wait where the number of workers is not known."""
_PIECE = 0.1
"""Seconds of work that are handed over at once: what is lost where a process is killed."""
_MOST = 100
"""Parameter sets that are sent at once."""
_SMALL = 2**14
"""Bytes of a problem that are sent with each piece of work, whoever knows it."""
_KNOWN = 8
"""Problems that each worker keeps."""

Found = Sequence[tuple[int, Encoded]]
"""Numbers of parameter sets and their tables."""
Outcome = Encoded | str
"""The table of a curve, or why there is none."""


def compute(
    problem: HarmonicBalance,
    sweep: Sweep,
    task: Request,
    blank: CurveTable,
    executor: Executor | None = None,
    progress: bool = True,
    done: Collection[int] = (),
) -> Generator[Found, None, None]:
    """Number and table of each parameter set but those ``done``, as they are finished.

    ``executor`` is any `concurrent.futures.Executor`; what it does not compute, as workers die or
    it is closed, is computed in this process. A set whose computation fails has the ``blank`` curve
    with a status that says so.
    """
    with progress_bar("curve", progress, sweep.size, len(done)) as bar:
        numbers = [number for number in range(sweep.size) if number not in done]
        for found in _outcomes(problem, sweep, task, numbers, executor):
            bar.update(len(found))
            yield [(number, _table(blank, outcome)) for number, outcome in found]


def _table(blank: CurveTable, outcome: Outcome) -> Encoded:
    failed = isinstance(outcome, str)
    return encode(flat(replace(blank, status=outcome))) if failed else outcome


def _outcomes(
    problem: HarmonicBalance,
    sweep: Sweep,
    task: Request,
    numbers: list[int],
    executor: Executor | None,
) -> Iterator[Sequence[tuple[int, Outcome]]]:
    if executor is not None:
        numbers = yield from _Shared(problem, sweep, task, executor).outcomes(numbers)
    found: list[tuple[int, Outcome]] = []
    start = time.perf_counter()
    for number in numbers:
        try:
            found.append((number, _outcome(problem, task, sweep.chosen(number))))
        except BaseException:  # an interrupt: what is finished is not lost
            yield found
            raise
        if time.perf_counter() - start >= _PIECE:
            yield found
            found, start = [], time.perf_counter()
    yield found


class _Shared:
    """What an executor computes, in pieces of several parameter sets."""

    def __init__(self, problem: HarmonicBalance, sweep: Sweep, task: Request, executor: Executor):
        self._sweep, self._executor = sweep, executor
        self._payload = pickle.dumps((problem, task))
        self._key = hashlib.blake2b(self._payload).hexdigest()
        self._call = uuid.uuid4().hex
        self._workers = getattr(executor, "_max_workers", None)
        self._to_send = self._workers or 1
        self._seconds = math.inf
        self._pending: dict[Future, list[int]] = {}
        self._finished: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._waiting: deque[int] = deque()
        self._left: list[int] = []
        self._interrupt: KeyboardInterrupt | None = None

    def outcomes(
        self, numbers: list[int]
    ) -> Generator[Sequence[tuple[int, Outcome]], None, list[int]]:
        """What is finished, as it comes; returns the numbers of the sets that are not computed."""
        most = _UNKNOWN if self._workers is None else (1 + _WAITING) * self._workers
        self._waiting.extend(numbers)
        try:
            while True:
                while self._waiting and len(self._pending) < most:
                    size = self._size(len(self._waiting) // most)
                    if not self._submit([self._waiting.popleft() for _ in range(size)]):
                        self._left += self._waiting
                        self._waiting.clear()
                if not self._pending:
                    return self._left
                yield self._next()
                if self._interrupt:
                    raise self._interrupt
        finally:
            for future in self._pending:
                future.cancel()

    def _size(self, share: int) -> int:
        """Sets of the next piece, of which ``share`` leave as many to every other."""
        wanted = _PIECE / self._seconds if self._seconds else _MOST
        return max(1, min(int(wanted), share, _MOST))

    def _submit(self, numbers: list[int], send: bool = False) -> bool:
        """Whether the executor takes a piece; with the problem, or where a worker knows it."""
        send = send or self._to_send > 0 or len(self._payload) <= _SMALL
        payload = self._payload if send else None
        chosen = [self._sweep.chosen(number) for number in numbers]
        try:
            future = self._executor.submit(_work, self._key, payload, chosen, self._call)
        except Exception as error:
            self._lose(numbers, error)
            return False
        self._to_send -= 1
        self._pending[future] = numbers
        future.add_done_callback(self._finished.put)
        return True

    def _next(self) -> list[tuple[int, Outcome]]:
        """All that has come since the last time, at least one piece but for an interrupt."""
        futures: list[Future] = []
        try:
            futures.append(self._finished.get())
        except KeyboardInterrupt as interrupt:
            self._interrupt = interrupt
        while not self._finished.empty():
            futures.append(self._finished.get())
        found: list[tuple[int, Outcome]] = []
        for future in futures:
            numbers = self._pending.pop(future)
            # Whatever a set itself raises is returned: this is the executor's own failure.
            try:
                result = future.result()
            except KeyboardInterrupt:
                # Where it was in the worker tells the user nothing.
                self._interrupt = self._interrupt or KeyboardInterrupt()
                continue
            except (Exception, CancelledError) as error:
                self._lose(numbers, error)
                continue
            if result is None:
                # The worker does not know the problem.
                self._submit(numbers, send=True)
                continue
            self._seconds, outcomes = result
            found += zip(numbers, outcomes, strict=False)
            # Sets that take longer than those before come again.
            self._waiting.extendleft(reversed(numbers[len(outcomes) :]))
        return found

    def _lose(self, numbers: list[int], error: BaseException) -> None:
        """Leave a piece to this process, and say so once."""
        if not self._left:
            warn_of_executor(error, "curves")
        self._left += numbers


_own = threading.local()


def _work(
    key: str, payload: bytes | None, chosen: list[dict[str, Any]], call: str
) -> tuple[float, list[Outcome]] | None:
    """Seconds per parameter set, and what came of those that a piece of work has time for.

    None for a problem that is not known here.
    Each worker compiles a problem once, from the ``payload``; threads share none. ``call`` names
    what is not gone on with after an interrupt.
    """
    with at_work(call):
        return _worked(key, payload, chosen)


def _worked(
    key: str, payload: bytes | None, chosen: list[dict[str, Any]]
) -> tuple[float, list[Outcome]] | None:
    known = _own.__dict__
    if key not in known:
        if payload is None:
            return None
        problem, task = pickle.loads(payload)
        curve_of(task, problem)
        while len(known) >= _KNOWN:
            del known[next(iter(known))]
        known[key] = problem, task
    problem, task = known[key]
    outcomes: list[Outcome] = []
    start, seconds = time.perf_counter(), 0.0
    while len(outcomes) < len(chosen) and (not outcomes or seconds < _PIECE):
        outcomes.append(_outcome(problem, task, chosen[len(outcomes)]))
        seconds = time.perf_counter() - start
    return seconds / len(outcomes), outcomes


def _outcome(problem: HarmonicBalance, task: Request, chosen: dict[str, Any]) -> Outcome:
    try:
        branch = compute_curve(problem.with_parameters(**chosen), task)
        return encode(flat(reduced(branch, task)))
    except Exception as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        return f"{Status.COMPUTATION_FAILED} ({why})"
