"""What a process of a pool does beside its work: it ends with its parent, and stops in silence.

A killed parent does not tell its workers, which then wait for ever; an interrupt from the keyboard
reaches them all, and each that waits for work would print where it waited.
"""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import parent_process
from types import FrameType

from symhbm.numerics import check

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
