"""Work shared with other processes: who computes it, how far it is, and how workers end.

A killed parent does not tell its workers, which then wait for ever; an interrupt from the keyboard
reaches them all, and each that waits for work would print where it waited.
"""

import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from multiprocessing import parent_process
from types import FrameType
from typing import Any

from tqdm import tqdm

from symhbm.numerics import check

_BAR_DELAY = 2.0
"""Seconds before a progress bar appears."""
_SECONDS = 1.0
"""Between two looks at the parent."""


class _Worker:
    """The state of this process."""

    process: int | None = None
    """Which it is: a forked one begins anew."""
    call: str | None = None
    """The call that the last piece of work was of."""
    busy = False
    stopped: str | None = None
    """The call that was interrupted."""


_worker = _Worker()


def attend() -> None:
    """Have this process end with its parent and wait in silence, if it is a worker of a pool.

    Workers do their work in the main thread of a process that multiprocessing started; any other
    is left alone.
    """
    own = threading.current_thread() is threading.main_thread() and parent_process() is not None
    if not own or _worker.process == os.getpid():
        return
    _worker.process, _worker.busy = os.getpid(), False
    threading.Thread(target=_end_with_parent, args=[os.getppid()], daemon=True).start()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupted)


@contextmanager
def at_work(call: str) -> Iterator[None]:
    """Do a piece of work of a ``call``; raises KeyboardInterrupt once that was interrupted."""
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


def _interrupted(signum: int, frame: FrameType | None) -> None:
    _worker.stopped = _worker.call
    if _worker.busy:
        raise KeyboardInterrupt


def _end_with_parent(process: int) -> None:
    parent = parent_process()
    assert parent is not None
    # Its end of the pipe may be open in other workers; who adopts this one is another process.
    while os.getppid() == process and parent.is_alive():
        parent.join(_SECONDS)
    os._exit(1)


def check_executor(executor: object) -> None:
    """Raise TypeError unless ``executor`` is None or has the face of an Executor."""
    if isinstance(executor, type) or (
        executor is not None and not callable(getattr(executor, "submit", None))
    ):
        raise TypeError(f"executor={check.shown(executor)}: expected a concurrent.futures.Executor")


def warn_of_executor(error: BaseException, results: str) -> None:
    """Warn that an executor failed, and that this process computes the ``results`` it does not."""
    what = "a worker died" if isinstance(error, BrokenExecutor) else "the executor failed"
    why = " ".join([type(error).__name__, *map(str, error.args)])
    warnings.warn(
        f"{what} ({why}); the {results} that the executor does not compute are computed in this "
        "process",
        RuntimeWarning,
        stacklevel=3,
    )


class Workers:
    """Calls shared with an executor; what it does not compute is computed in this process.

    ``results`` names what the calls give, in the warning of an executor that fails.
    """

    def __init__(self, executor: Executor | None, results: str):
        self.executor, self._results = executor, results

    def map(
        self, remote: Callable[..., Any], here: Callable[..., Any], calls: Sequence[tuple]
    ) -> Iterator[Any]:
        """What ``calls`` of ``remote`` give, in their order; in this process, of ``here``."""
        pending = [self._submit(remote, call) for call in calls]
        for call, future in zip(calls, pending, strict=True):
            yield self._result(here, call, future)

    def _submit(self, remote: Callable[..., Any], call: tuple) -> Future | None:
        if self.executor is None:
            return None
        try:
            return self.executor.submit(remote, *call)
        except Exception as error:
            self._give_up(error)
            return None

    def _result(self, here: Callable[..., Any], call: tuple, future: Future | None) -> Any:
        if future is not None:
            try:
                return future.result()
            except (Exception, CancelledError) as error:
                self._give_up(error)
        return here(*call)

    def _give_up(self, error: BaseException) -> None:
        """Go on in this process, and say so once."""
        if self.executor is not None:
            warn_of_executor(error, self._results)
        self.executor = None


def progress_bar(
    unit: str, progress: bool, total: int | None = None, initial: int = 0, what: str | None = None
) -> tqdm:
    """A bar that appears where there is ``progress`` to show for more than a few seconds."""
    return tqdm(
        desc=what,
        total=total,
        initial=initial,
        unit=unit,
        delay=_BAR_DELAY,
        disable=not progress,
        leave=False,
    )
