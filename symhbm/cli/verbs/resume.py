"""The command ``symhbm resume``."""

import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import click

import symhbm as sh
from symhbm.cli import terminal
from symhbm.model.contacts import ContactLaw
from symhbm.results.archive import working_file
from symhbm.results.reading import completeness
from symhbm.workers import attend


@click.command()
@terminal.archive_argument
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes that compute; by default one for each core.",
)
@terminal.progress_option
@terminal.law_option
def resume(archive: Path, workers: int | None, progress: bool, laws: list[ContactLaw]) -> None:
    """Finish the interrupted run that should have become ARCHIVE.

    Whatever was complete is kept, the other curves are computed as they would have been. ARCHIVE
    is the name that was asked for, or that of the working file beside it, ARCHIVE.partial. The
    run may be interrupted and resumed again at any time.

    \b
    Examples:
      symhbm resume disk.nc
      symhbm resume disk.nc.partial --workers 4
    """
    target = archive.with_name(terminal.final_name(archive))
    working = working_file(target)
    if not working.exists():
        if not target.exists():
            raise FileNotFoundError(f"{str(target)!r}: no such file, nor {working.name}")
        terminal.say(
            f"{target}: complete, there is nothing to resume, nothing was computed", err=False
        )
        return
    with terminal.opened(working) as dataset:
        complete, waiting, failed = completeness(dataset)
    total = complete + waiting + failed.total()
    count = min(workers or os.cpu_count() or 1, waiting)
    pool = ProcessPoolExecutor(count, initializer=attend) if count > 1 else None
    try:
        with sh.resume(target, laws=laws, executor=pool, progress=progress) as dataset:
            _, left, failed = completeness(dataset)
    except KeyboardInterrupt as interrupt:
        if not hasattr(interrupt, "__notes__"):
            interrupt.add_note(f"symhbm: interrupted; what is complete is kept in {working}")
        raise
    finally:
        if pool is not None:
            pool.shutdown(cancel_futures=True)
    terminal.say(
        f"{total - waiting} of {total} curves were there, {waiting - left} computed, "
        f"{failed.total()} of all are incomplete",
        err=False,
    )
    terminal.say(target, err=False)
