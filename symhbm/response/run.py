"""Datasets of the response curves of all parameter sets, in memory or in an archive."""

import json
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from contextlib import closing, suppress
from functools import cache
from pathlib import Path

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.continuation import SolveError
from symhbm.model.contacts import ContactLaw
from symhbm.numerics import Table, check, on_one_thread
from symhbm.response.curve import blank_curve, prepared
from symhbm.response.ensemble import compute
from symhbm.results import DatasetParts, Request, Sweep, parts, runs, schema, tables
from symhbm.results.archive import (
    SUFFIX,
    ArchiveError,
    Spool,
    Store,
    assemble,
    bytes_of,
    call_of,
    check_target,
    computed_here,
    existing,
    load,
    path_of,
    rebuild,
    working_file,
)
from symhbm.results.reading import COMPLETE
from symhbm.workers import noted

_TOLD = 5
"""Curves of a sweep that a warning names."""


@on_one_thread
def run_sweep(
    problem: HarmonicBalance, sweep: Sweep, request: Request, running: runs.Running
) -> xr.Dataset:
    """Dataset of the curves of all parameter sets, opened lazily where it is an ``archive``.

    Of a ``part`` of the sweep there are its sets alone. A note on KeyboardInterrupt tells which
    results are safe and how to go on.

    Raises KeyError for names to keep that the result does not have, and ArchiveError if the archive
    is of another computation, is in use, or cannot be written.
    """
    part = parts.check_part(running.part, sweep)
    call, blank = schema.describe(problem, sweep, request), _blank(problem, request)
    if part is not None:
        sweep, whole = parts.restricted(sweep, part), call
        call = schema.describe(problem, sweep, request)
        call = parts.call_of_part(call, whole, part, tables.encode(blank()))
    if request.keep is not None:
        call.attributes["left_out"] = json.dumps(_left_out(problem, request, call))
    if running.archive is None:
        with Spool() as spool, noted(lambda: _lost_text(len(spool), sweep.size)):
            for encoded in compute(problem, sweep, request, blank, running):
                spool.add(encoded)
            if part is not None:
                call.attributes[parts.COMPUTED] = json.dumps([computed_here()])
            return schema.label(call, sweep, request, spool.stacked())
    target = _target("archive", running.archive)
    file, call = working_file(target), call.dataset()
    if target.exists():
        complete = _checked_archive(call, target, running.progress)
        if file.exists():
            # The process that wrote it was killed just before it removed the working file.
            with suppress(ArchiveError), Store(file) as store:
                _check_same(call, call_of(store), file)
                store.remove()
        return complete
    call_bytes, encoded_blank = bytes_of(call), tables.encode(blank())
    with Store(file) as store:
        if store.call is None:
            store.begin(call_bytes, sweep.size, encoded_blank)
        _check_same(call, call_of(store), file)
        return _finished(store, target, call, problem, request, blank, running)


def _blank(problem: HarmonicBalance, request: Request) -> Callable[[], Table]:
    """What gives the curve of a request without points: made once, where it is needed."""
    return cache(lambda: tables.reduced(blank_curve(problem, request), request))


def _left_out(problem: HarmonicBalance, request: Request, call: DatasetParts) -> list[str]:
    """Names of results that are not kept; KeyError for names to keep that there are not."""
    whole = blank_curve(problem, request)
    names = [tables.name_of(key, request) for key in whole if key not in tables.NO_VARIABLES]
    allowed = dict.fromkeys([*names, *call.coordinates, *call.variables])
    for name in request.keep or ():
        check.known(name, allowed, "variable to keep")
    kept = {tables.name_of(key, request) for key in tables.reduced(whole, request)}
    return [name for name in names if name not in kept]


def reported(result: xr.Dataset, throw: bool = False) -> xr.Dataset:
    """The result, with a warning, or SolveError, if curves are incomplete."""
    status = result["status"]
    statuses = list(map(str, status.values.ravel()))
    reasons = Counter(status for status in statuses if status not in COMPLETE)
    if not reasons:
        return result
    reason, number = reasons.most_common(1)[0]
    text = f"the curve is incomplete: {reason}"
    if len(statuses) > 1:
        count = "" if len(reasons) == 1 else f", {number} of them"
        text = f"{reasons.total()} of {len(statuses)} curves are incomplete{count}: {reason}"
        text += f" (status has the reason of each; {_incomplete(status)})"
    if throw:
        raise SolveError(text, result)
    check.warn(text, RuntimeWarning)
    return result


def _incomplete(status: xr.DataArray) -> str:
    """Which curves of a sweep are incomplete, the first of them by the values they have."""
    places = np.argwhere(~np.isin(status.values.astype(str), list(COMPLETE)))
    told = []
    for place in places[:_TOLD]:
        at = status[tuple(place)]
        values = {
            dim: at[dim].item() if dim in at.coords else i
            for dim, i in zip(status.dims, place, strict=True)
        }
        told.append(", ".join(f"{dim}={value}" for dim, value in values.items()))
    more = "" if len(told) == len(places) else f"; and {len(places) - len(told)} more"
    return f"they are those of {'; '.join(told)}{more}"


def resume(
    path: str | os.PathLike[str],
    *,
    laws: Iterable[ContactLaw] = (),
    executor: Executor | None = None,
    progress: bool | None = None,
) -> xr.Dataset:
    """Finish an interrupted archive from its working file alone, ``<path>.partial``.

    Parameters
    ----------
    path
        The ``archive`` that `frf` or `follow` was given.
    laws
        Contact laws of your own that it was computed with, as of `rebuild`.
    executor
        Where the remaining parameter sets are computed; by default in this process.
    progress
        By default, show a bar when it takes longer than a few seconds; True: at once, False: never.

    Returns
    -------
    Dataset of the archive, opened lazily, as from the uninterrupted call. A finished archive is
    opened without computing, and a line on stderr says so where ``progress`` is shown.

    Raises
    ------
    FileNotFoundError
        If there is neither an archive nor a working file.
    ArchiveError
        If the archive is in use by another process, cannot be written, or the working file is
        damaged or of a problem that cannot be rebuilt.
    KeyboardInterrupt
        If it is interrupted; a note tells which results are safe and how to go on.

    Warns
    -----
    RuntimeWarning
        If curves are incomplete, with the most common reason.

    Examples
    --------
    An archive that is finished is only opened:

    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> done = sh.frf(problem, (10, 30), over={"normal_load": [1, 3]}, archive="loads.nc")
    >>> sh.resume("loads.nc", progress=False).sizes["normal_load"]
    2
    """
    running = runs.Running(archive=path, executor=executor, progress=progress)
    target = _target("path", path_of(path).with_name(path_of(path).name.removesuffix(SUFFIX)))
    file = working_file(target)
    if not file.exists():
        complete = load(target, lazy=True)
        _say_complete(target, progress)
        return reported(complete)
    with Store(file) as store:
        call = call_of(store)
        problem = rebuild(call, laws)
        sweep, request = schema.recall(call, problem)
        request = prepared(problem, sweep, request, progress)
        blank = _blank(problem, request)
        finished = _finished(store, target, call, problem, request, blank, running)
    return reported(finished)


def _finished(
    store: Store,
    target: Path,
    call: xr.Dataset,
    problem: HarmonicBalance,
    request: Request,
    blank: Callable[[], Table],
    running: runs.Running,
) -> xr.Dataset:
    if target.exists():
        complete = _checked_archive(call, target, running.progress)
        store.remove()
        return complete
    sweep, _ = schema.recall(call)
    _check_names(store, blank())
    with noted(lambda: f"{store.rest}, and so does symhbm.resume({str(target)!r})"):
        curves = compute(problem, sweep, request, blank, running, store.done)
        # Closed at once where the file cannot be written: nothing more is computed.
        with closing(curves):
            for encoded in curves:
                store.add(encoded)
        assemble(store, target, running.progress)
        store.remove()
    return load(target, lazy=True)


def _lost_text(n_done: int, n_sets: int) -> str:
    if n_sets == 1:
        return "nothing is kept of a curve that is not finished"
    return (
        f"{n_done} of {n_sets} parameter sets were computed and are lost; with archive= each is "
        "kept on disk once it is finished"
    )


def _checked_archive(call: xr.Dataset, target: Path, progress: bool | None) -> xr.Dataset:
    """A finished archive; ArchiveError if it is one of another computation."""
    complete = load(target, lazy=True)
    try:
        _check_same(call, complete, target)
    except ArchiveError:
        complete.close()
        raise
    _say_complete(target, progress)
    return complete


def _say_complete(target: Path, progress: bool | None) -> None:
    if progress is not False:
        print(f"symhbm: {str(target)!r} is complete, nothing was computed", file=sys.stderr)


def _check_names(store: Store, blank: Table) -> None:
    """Raise ArchiveError for a working file whose sets hold other variables than this version's."""
    [(_, (layout, _))] = store.read(-1, -1)
    names = {*tables.stored_layout(layout)} ^ blank.keys()
    if names:
        raise ArchiveError(
            f"path={str(store.path)!r}: written by another version of symhbm, whose curves differ "
            f"in {', '.join(sorted(names))}; finish it with that version, or remove it to start "
            "anew"
        )


def _check_same(call: xr.Dataset, other: xr.Dataset, path: Path) -> None:
    """Raise ArchiveError if a file is of another computation, with what differs."""
    names = schema.differences(call, other) if "followed" in other.attrs else ["everything"]
    if names:
        raise ArchiveError(
            f"path={str(path)!r}: of another computation, different in {', '.join(names)}; choose "
            "another archive, or remove this one to start anew"
        )


def _target(name: str, path: str | os.PathLike[str]) -> Path:
    target = path_of(path, name)
    check_target(target, name)
    target = existing(target)
    # Absolute: the working directory of the process may change before the end.
    return target.absolute()
