"""Response curves of many parameter sets, in this process or by an executor."""

import hashlib
import math
import pickle
import queue
import sys
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future
from functools import partial
from typing import Any

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.numerics import Table, watched
from symhbm.numerics.loops import told_of_compiling
from symhbm.response.curve import compute_curve, continuation_problem_of
from symhbm.results import Request, Sweep, runs, tables
from symhbm.workers import Forecast, Reached, at_work, progress_bar, warn_of_executor

_WAITING = 2
"""Pieces of work queued for each worker: none waits for this process."""
_UNKNOWN = 1000
"""Pieces of work queued where the number of workers is not known."""
_PIECE = 0.1
"""Seconds of work in one piece: what is lost where a process is killed."""
_MOST = 100
"""Parameter sets in one piece."""
_SMALL = 2**14
"""Bytes of a problem that are sent with every piece, as that is cheaper than asking again."""
_CACHED = 8
"""Problems that each worker keeps."""

NumberedTables = Sequence[tuple[int, tables.Encoded]]
"""Numbers of parameter sets and their tables."""
Outcome = tables.Encoded | str
"""The table of a curve, or the status that tells why it could not be computed."""


def compute(
    problem: HarmonicBalance,
    sweep: Sweep,
    request: Request,
    blank: Callable[[], Table],
    running: runs.Running,
    done: Collection[int] = (),
) -> Generator[NumberedTables, None, None]:
    """Numbers and tables of all parameter sets but those ``done``, as they are finished.

    Sets that the executor does not compute, because workers die or it is closed, are computed in
    this process. A set whose computation fails has the ``blank`` curve with a status that tells
    why.
    """

    def table(outcome: Outcome) -> tables.Encoded:
        failed = isinstance(outcome, str)
        return tables.encode(tables.failed(blank(), outcome)) if failed else outcome

    def tell() -> None:
        if running.progress is not False:
            print("symhbm: compiling loops, once after installing", file=sys.stderr)

    bar_of_curves = progress_bar("curve", running.progress, sweep.size, len(done))
    with told_of_compiling(tell), bar_of_curves as bar:
        numbers = [number for number in range(sweep.size) if number not in done]
        reached = partial(_reached, bar, problem, request)
        kept = "of disk" if running.archive else "of memory; archive= keeps them on the disk"
        forecast = Forecast(bar, "curve", len(numbers), kept)
        for finished in _outcomes(problem, sweep, request, numbers, running.executor, reached):
            bar.update(len(finished))
            encoded = [(number, table(outcome)) for number, outcome in finished]
            if running.progress is not False:
                forecast([len(data) for _, (_, data) in encoded])
            yield encoded


def _reached(bar: Any, problem: HarmonicBalance, request: Request) -> Reached:
    """What tells on a bar how far the next curve is."""
    if request.amplitudes is not None and request.name != "amplitude":
        return Reached(bar, None)  # cycles are looked for along modes, at each value anew
    of_paths = {"frequency": "Hz", "amplitude": "m"}
    units = of_paths.get(request.name) or problem.model.about(request.name).units
    ends = request.followed(request.band).tolist()
    return Reached(bar, ends, lambda value: float(request.shown([value])[0]), units)


def _outcomes(
    problem: HarmonicBalance,
    sweep: Sweep,
    request: Request,
    numbers: list[int],
    executor: Executor | None,
    reached: Callable[[], Reached],
) -> Iterator[Sequence[tuple[int, Outcome]]]:
    if executor is not None:
        numbers = yield from _Shared(problem, sweep, request, executor).outcomes(numbers)
    finished: list[tuple[int, Outcome]] = []
    start = time.perf_counter()
    for number in numbers:
        try:
            with watched(reached()):
                finished.append((number, _outcome(problem, request, sweep.chosen(number))))
        except BaseException:  # an interrupt does not lose finished sets
            yield finished
            raise
        if time.perf_counter() - start >= _PIECE:
            yield finished
            finished, start = [], time.perf_counter()
    yield finished


class _Shared:
    """Parameter sets computed by an executor, several in one piece of work."""

    def __init__(
        self, problem: HarmonicBalance, sweep: Sweep, request: Request, executor: Executor
    ):
        self._sweep, self._executor = sweep, executor
        self._payload = pickle.dumps((problem, request))
        self._key = hashlib.blake2b(self._payload).hexdigest()
        self._call = uuid.uuid4().hex
        self._n_workers = getattr(executor, "_max_workers", None)
        self._unsent_payloads = self._n_workers or 1
        self._seconds_per_set = math.inf
        self._pending: dict[Future, list[int]] = {}
        self._finished: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._waiting: deque[int] = deque()
        self._uncomputed: list[int] = []
        self._interrupt: KeyboardInterrupt | None = None

    def outcomes(
        self, numbers: list[int]
    ) -> Generator[Sequence[tuple[int, Outcome]], None, list[int]]:
        """Outcomes as they are finished; returns the numbers of the sets not computed."""
        n_workers = self._n_workers
        most = _UNKNOWN if n_workers is None else (1 + _WAITING) * n_workers
        self._waiting.extend(numbers)
        try:
            while True:
                while self._waiting and len(self._pending) < most:
                    size = self._size(len(self._waiting) // most)
                    if not self._submit([self._waiting.popleft() for _ in range(size)]):
                        self._uncomputed += self._waiting
                        self._waiting.clear()
                if not self._pending:
                    return self._uncomputed
                yield self._next()
                if self._interrupt:
                    raise self._interrupt
        finally:
            for future in self._pending:
                future.cancel()

    def _size(self, share: int) -> int:
        """Number of sets in the next piece; ``share`` would fill all pieces evenly."""
        timely = _PIECE / self._seconds_per_set if self._seconds_per_set else _MOST
        return max(1, min(int(timely), share, _MOST))

    def _submit(self, numbers: list[int], send: bool = False) -> bool:
        """Whether the executor takes a piece; ``send`` includes the problem."""
        send = send or self._unsent_payloads > 0 or len(self._payload) <= _SMALL
        payload = self._payload if send else None
        chosen = [self._sweep.chosen(number) for number in numbers]
        try:
            future = self._executor.submit(_work, self._key, payload, chosen, self._call)
        except Exception as error:
            self._lose(numbers, error)
            return False
        self._unsent_payloads -= 1
        self._pending[future] = numbers
        future.add_done_callback(self._finished.put)
        return True

    def _next(self) -> list[tuple[int, Outcome]]:
        """Outcomes since the last call: at least one piece, unless interrupted."""
        futures: list[Future] = []
        try:
            futures.append(self._finished.get())
        except KeyboardInterrupt as interrupt:
            self._interrupt = interrupt
        while not self._finished.empty():
            futures.append(self._finished.get())
        finished: list[tuple[int, Outcome]] = []
        for future in futures:
            numbers = self._pending.pop(future)
            # Errors of a set are returned as its outcome: this is a failure of the executor.
            try:
                result = future.result()
            except KeyboardInterrupt:
                # A new interrupt: the traceback of the worker does not help the user.
                self._interrupt = self._interrupt or KeyboardInterrupt()
                continue
            except (Exception, CancelledError) as error:
                self._lose(numbers, error)
                continue
            if result is None:
                # The worker does not know the problem.
                self._submit(numbers, send=True)
                continue
            self._seconds_per_set, outcomes = result
            finished += zip(numbers, outcomes, strict=False)
            # Sets that the piece had no time for wait again.
            self._waiting.extendleft(reversed(numbers[len(outcomes) :]))
        return finished

    def _lose(self, numbers: list[int], error: BaseException) -> None:
        """Leave a piece to this process, and warn once."""
        if not self._uncomputed:
            warn_of_executor(error, "curves")
        self._uncomputed += numbers


_cache = threading.local()
"""Problems and requests by key; each thread has its own."""


def _work(
    key: str, payload: bytes | None, chosen: list[dict[str, Any]], call: str
) -> tuple[float, list[Outcome]] | None:
    """Seconds per parameter set, and the outcomes of those that a piece has time for.

    None for a problem that this worker does not know. Each worker compiles a problem once, from the
    ``payload``; threads share none. An interrupt ends all pieces of the same ``call``.
    """
    cache = _cache.__dict__
    with at_work(call):
        if key not in cache:
            if payload is None:
                return None
            problem, request = pickle.loads(payload)
            if request.unforced is None:
                continuation_problem_of(request, problem)
            while len(cache) >= _CACHED:
                del cache[next(iter(cache))]
            cache[key] = problem, request
        problem, request = cache[key]
        outcomes: list[Outcome] = []
        start, seconds = time.perf_counter(), 0.0
        while len(outcomes) < len(chosen) and (not outcomes or seconds < _PIECE):
            outcomes.append(_outcome(problem, request, chosen[len(outcomes)]))
            seconds = time.perf_counter() - start
        return seconds / len(outcomes), outcomes


def _outcome(problem: HarmonicBalance, request: Request, chosen: dict[str, Any]) -> Outcome:
    try:
        of_set = problem.with_parameters(**chosen) if chosen else problem
        curve = compute_curve(of_set, request)
        return tables.encode(tables.reduced(curve, request))
    except Exception as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        return f"{Status.COMPUTATION_FAILED} ({why})"
