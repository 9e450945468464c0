"""Work shared with an executor, progress of long work, and the end of worker processes.

Workers of a killed parent would wait for ever; an interrupt from the keyboard reaches all of them,
and those that wait for work would print a traceback.
"""

import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from multiprocessing import parent_process
from types import FrameType
from typing import Any

from symhbm.numerics import Watcher, check

_REACHED = 0.5
_LINES_APART = 30.0
"""Seconds between two words on how far work has come, beside a bar and in lines."""
_BAR_DELAY = 2.0
"""Seconds before a progress bar appears."""
_LONG, _LARGE = 60.0, 1e9
"""Seconds and bytes of all work from which on a forecast is worth a line."""
_SECONDS = 1.0
"""Between two checks that the parent is alive."""


class _Worker:
    """The state of this process."""

    process: int | None = None
    """Its id when it attended: a forked process has another, and attends again."""
    call: str | None = None
    """The call that the last piece of work belongs to."""
    busy = False
    stopped: str | None = None
    """The call that was interrupted."""


_worker = _Worker()


def attend() -> None:
    """Make this process end with its parent and wait silently, if it is a worker of a pool.

    Workers compute in the main thread of a process that multiprocessing started; other processes
    are left as they are.
    """
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or parent_process() is None or _worker.process == os.getpid():
        return
    _worker.process, _worker.busy = os.getpid(), False
    threading.Thread(target=_end_with_parent, args=[os.getppid()], daemon=True).start()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupted)


@contextmanager
def at_work(call: str) -> Iterator[None]:
    """Context of a piece of work of a ``call``; KeyboardInterrupt once that was interrupted."""
    attend()
    if _worker.process != os.getpid():
        yield
        return
    _worker.call, _worker.busy = call, True
    try:
        if _worker.stopped == call:
            raise KeyboardInterrupt
        yield
    finally:
        _worker.busy = False


@contextmanager
def noted(rest: Callable[[], str]) -> Iterator[None]:
    """Note on KeyboardInterrupt what the outermost call keeps; a script that ends says it alone."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        interrupt.__notes__ = [f"symhbm: interrupted; {rest()}"]
        if sys.excepthook is sys.__excepthook__:
            sys.excepthook = _notes_alone
        raise


@contextmanager
def unkept(what: str) -> Iterator[None]:
    """`noted` for a verb that keeps nothing of ``what`` it is asked for until that is finished."""
    with noted(lambda: f"nothing is kept of {what} that is not finished"):
        yield


def _notes_alone(kind: type[BaseException], error: BaseException, trace: Any) -> None:
    """Print an uncaught exception; of a noted interrupt its notes, as no line of it is wrong."""
    if kind is KeyboardInterrupt and getattr(error, "__notes__", None):
        print(*error.__notes__, sep="\n", file=sys.stderr)
    else:
        sys.__excepthook__(kind, error, trace)


def _interrupted(signum: int, frame: FrameType | None) -> None:
    _worker.stopped = _worker.call
    if _worker.busy:
        raise KeyboardInterrupt


def _end_with_parent(process: int) -> None:
    parent = parent_process()
    assert parent is not None
    # Other workers may keep the parent's end of the pipe open, but an orphan has another parent.
    while os.getppid() == process and parent.is_alive():
        parent.join(_SECONDS)
    os._exit(1)


def check_executor(executor: object) -> None:
    """Raise TypeError unless ``executor`` is None or has the method ``submit``."""
    submits = callable(getattr(executor, "submit", None)) and not isinstance(executor, type)
    if executor is not None and not submits:
        raise TypeError(f"executor={check.shown(executor)}: expected a concurrent.futures.Executor")


def warn_of_executor(error: BaseException, results: str) -> None:
    """Warn that an executor failed and that this process computes the remaining ``results``."""
    failure = "a worker died" if isinstance(error, BrokenExecutor) else "the executor failed"
    why = " ".join([type(error).__name__, *map(str, error.args)])
    warnings.warn(
        f"{failure} ({why}); the {results} that the executor does not compute are computed in this "
        "process",
        RuntimeWarning,
        stacklevel=3,
    )


class Workers:
    """Calls shared with an executor; those that it does not compute run in this process.

    ``results`` names the values of the calls in the warning of an executor that fails.
    """

    def __init__(self, executor: Executor | None, results: str):
        self.executor, self._results = executor, results

    def map(
        self, remote: Callable[..., Any], local: Callable[..., Any], calls: Sequence[tuple]
    ) -> Iterator[Any]:
        """Values of ``remote`` for all ``calls``, in order; in this process, of ``local``."""
        pending = [self._submit(remote, call) for call in calls]
        for call, future in zip(calls, pending, strict=True):
            yield self._result(local, call, future)

    def _submit(self, remote: Callable[..., Any], call: tuple) -> Future | None:
        if self.executor is None:
            return None
        try:
            return self.executor.submit(remote, *call)
        except Exception as error:
            self._give_up(error)
            return None

    def _result(self, local: Callable[..., Any], call: tuple, future: Future | None) -> Any:
        if future is not None:
            try:
                return future.result()
            except (Exception, CancelledError) as error:
                self._give_up(error)
        return local(*call)

    def _give_up(self, error: BaseException) -> None:
        """Go on in this process, and warn once."""
        if self.executor is not None:
            warn_of_executor(error, self._results)
        self.executor = None


def check_progress(progress: object) -> bool | None:
    """Return ``progress``; TypeError unless it is True, False or None."""
    return None if progress is None else check.flag("progress", progress)


def progress_bar(
    unit: str,
    progress: bool | None,
    total: int | None = None,
    initial: int = 0,
    label: str | None = None,
) -> Any:
    """A bar of pieces of work that appears after a few seconds; at once and to stay for True.

    Notebooks that can have a widget. Where the output is a file or a pipe, lines are in its place.
    """
    delay = 0.0 if progress else _BAR_DELAY
    in_notebook = "ipykernel" in type(sys.stderr).__module__
    if progress is not False and sys.stderr and not (in_notebook or sys.stderr.isatty()):
        return _Lines(unit, delay, total, initial, label)
    with warnings.catch_warnings():
        # Without widgets the bar is of text, which needs no advice.
        warnings.simplefilter("ignore")
        from tqdm.auto import tqdm
    # What is done of an unknown amount reads "surveys: 4 [00:02, 1.9survey/s]".
    unknown = total is None
    return tqdm(
        desc=label or (f"{unit}s" if unknown else None),
        bar_format="{desc}: {n_fmt} [{elapsed}, {rate_fmt}{postfix}]" if unknown else None,
        total=total,
        initial=initial,
        unit=unit,
        delay=delay,
        disable=progress is False,
        leave=bool(progress),
    )


class Reached(Watcher):
    """How far one piece of work has come, beside the bar of all pieces.

    A path goes between ``ends``, the values that ``shown`` says in ``units``; None where it goes
    along something else.
    """

    def __init__(
        self,
        bar: Any,
        ends: Sequence[float] | None,
        shown: Callable[[float], float] = float,
        units: str = "",
    ):
        self._bar, self._ends, self._shown, self._units = bar, ends, shown, units
        self._stage = ""
        self._begin = 0.0, 0.0
        self._told = time.monotonic() + _BAR_DELAY - _REACHED

    def reached(self, value: float, n_maxima: Callable[[], int]) -> None:
        """Tell where a path is."""
        if self._ends is None:
            return
        first, last = self._ends

        def text() -> str:
            band = f"of {self._shown(first):g} to {self._shown(last):g} {self._units}".rstrip()
            maxima = n_maxima()
            peaks = f", {maxima} peak{'' if maxima == 1 else 's'}" if maxima else ""
            return f"{self._shown(value):.6g} {band}{peaks}"

        self._tell("path", text, (value - first) / (last - first))

    def done(self, number: int, total: int | None, what: str) -> None:
        """Tell how much of what follows a path is done."""
        of = f" of {total}" if total else ""
        self._tell(what, lambda: f"{what}: {number}{of}", number / total if total else 0.0)

    def _tell(self, stage: str, text: Callable[[], str], share: float) -> None:
        """Tell, if it is time to, and how long the rest of this stage takes at the pace so far."""
        now = time.monotonic()
        if stage != self._stage:
            self._stage, self._begin = stage, (now, share)
        if now - self._told < _REACHED:
            return
        self._told, told = now, text()
        start, before = self._begin
        if before < share < 1:
            told += f", about {span((now - start) * (1 - share) / (share - before))} left"
        self._bar.set_postfix_str(told)


def amount(n_bytes: float) -> str:
    """Size of a file or of memory in words."""
    for unit, factor in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if n_bytes >= factor:
            return f"{n_bytes / factor:.3g} {unit}"
    return f"{n_bytes} bytes"


def span(seconds: float) -> str:
    """A time in a unit that makes its number short."""
    for size, unit in ((86400, "days"), (3600, "h"), (60, "min")):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.0f} s"


class Forecast:
    """How long many pieces of work take and how large their results are, told once if it is much.

    ``rest`` is how many there are to be done, ``kept`` where results are.
    """

    def __init__(self, bar: Any, unit: str, rest: int, kept: str):
        self._bar, self._unit, self._rest, self._kept = bar, unit, rest, kept
        self._start, self._done, self._bytes = time.monotonic(), 0, 0
        self._told = False

    def __call__(self, sizes: Sequence[int]) -> None:
        """Tell, from the sizes [bytes] of results that are done."""
        self._done += len(sizes)
        self._bytes += sum(sizes)
        seconds = time.monotonic() - self._start
        if self._told or not 0 < self._done < self._rest or seconds < _BAR_DELAY:
            return
        self._told, share = True, self._done / self._rest
        if seconds / share >= _LONG or self._bytes / share >= _LARGE:
            needs = f"{span(seconds / share)} and {amount(self._bytes / share)} {self._kept}"
            self._bar.write(f"symhbm: {self._rest} {self._unit}s take about {needs}")


class _Lines:
    """A line on stderr for each tenth of the work; for each doubling where its size is unknown."""

    def __init__(self, unit: str, delay: float, total: int | None, initial: int, label: str | None):
        self._unit, self._total, self._label = unit, total, f"{label}, " if label else ""
        self._start = time.monotonic()
        self._delay, self._done, self._initial = delay, initial, initial
        self._told = self._step
        self._last = self._start

    def __enter__(self) -> "_Lines":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def _step(self) -> int:
        """Tenths that are done, or how often it has doubled."""
        if self._total:
            return 10 * self._done // self._total
        return self._done.bit_length()

    def update(self, n: int = 1) -> None:
        """Count ``n`` more pieces of work as done."""
        self._done += n
        seconds = time.monotonic() - self._start
        if self._step == self._told or seconds < self._delay:
            return
        self._told = self._step
        text = f"{self._done} {self._unit}{'' if self._done == 1 else 's'}"
        if self._total:
            text = f"{100 * self._done // self._total} %, {self._done} of {self._total}"
            text += f" {self._unit}{'' if self._total == 1 else 's'}"
        text += f" after {seconds:.0f} s"
        if self._total and self._done < self._total:
            rest = (self._total - self._done) / (self._done - self._initial)
            text += f", about {span(rest * seconds)} left"
        self.write(f"symhbm: {self._label}{text}")

    def write(self, text: str) -> None:
        """Say a line."""
        print(text, file=sys.stderr, flush=True)

    def set_postfix_str(self, text: str) -> None:
        """Tell how far a long piece of work has come."""
        now = time.monotonic()
        if now - self._last >= _LINES_APART:
            self._last = now
            seconds = f"after {now - self._start:.0f} s"
            self.write(f"symhbm: {self._label}{text}, {seconds}")

    def close(self) -> None:
        """Nothing is left to tell."""
