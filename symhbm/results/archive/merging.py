"""`merge`: one archive of the parts of a sweep, equal to that of one job."""

import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import xarray as xr

from symhbm.numerics import check
from symhbm.results import parts, schema, tables
from symhbm.results.archive.from_working_file import assemble
from symhbm.results.archive.netcdf import (
    bytes_of,
    check_target,
    finished_part,
    load,
    path_of,
    with_suffix,
)
from symhbm.results.archive.pieces import Piece, opened
from symhbm.results.archive.working_files import SUFFIX, ArchiveError, Store, working_file
from symhbm.results.tables import Encoded
from symhbm.workers import check_progress, progress_bar

_MOST_TOLD = 10
"""Most parts, or ranges, that a message names."""

Paths = Iterable[str | os.PathLike[str]]


def merge(
    archives: Paths,
    path: str | os.PathLike[str] | None = None,
    *,
    overwrite: bool = False,
    unfinished: bool = False,
    progress: bool | None = None,
) -> xr.Dataset:
    """Merge parts of a sweep, each computed with ``part=``, into the result of one job.

    Parameters
    ----------
    archives
        Archives of parts, in any order. Parts may overlap where their values are the same.
    path
        The archive to write; a name without a suffix gets ``.nc``. By default nothing is written.
    overwrite
        Replace a file of that name.
    unfinished
        Take what there is of parts that are being computed or were interrupted, and of earlier
        merged ones with gaps, from their working files.
    progress
        By default, show a bar when it takes longer than a few seconds; True: at once, False: never.

    Returns
    -------
    Dataset that equals that of one job bit by bit, opened lazily from ``path``. The attribute
    ``merged_from`` (JSON) tells of each part its parameter sets, versions, hosts and times. Sets
    that no part has are padding with the status `Status.NOT_STARTED`, and ``<path>.partial`` is
    written in place of the archive: `symhbm.resume` computes them.

    Raises
    ------
    TypeError, ValueError
        If ``archives`` are no paths, or none.
    FileNotFoundError
        If there is no such part.
    FileExistsError
        If there is a file ``path``, or its working file, and ``overwrite`` is False.
    ArchiveError
        If parts are damaged, unfinished, or of different computations or versions, if a parameter
        set differs between two, or the archive cannot be written. Nothing is left behind then.

    Warns
    -----
    RuntimeWarning
        If there are parameter sets that no part has.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem, loads = sh.HarmonicBalance(blade, sh.forces.PointForce()), {"normal_load": [1, 3]}
    >>> for k in (1, 2):
    ...     part = sh.frf(problem, (10, 30), over=loads, archive=f"loads_{k}.nc", part=(k, 2))
    >>> sh.datasets.merge(["loads_1.nc", "loads_2.nc"]).peak_frequency.values.ravel().round(2)
    array([15.92, 19.37])
    """
    summary = merged(
        archives, path, overwrite=overwrite, unfinished=unfinished, progress=progress, keep=True
    )
    if summary.missing:
        check.warn(summary.missing, RuntimeWarning)
    assert summary.dataset is not None
    return summary.dataset


@dataclass
class Merged:
    """What was merged: numbers of parameter sets, and what is ``missing``, in words.

    ``path`` is the archive, or the working file where sets are missing.
    """

    n_sets: int
    n_done: int
    n_parts: int
    n_repeated: int
    missing: str
    path: Path | None = None
    dataset: xr.Dataset | None = None


def merged(
    archives: Paths,
    path: str | os.PathLike[str] | None,
    *,
    overwrite: bool = False,
    unfinished: bool = False,
    progress: bool | None = None,
    keep: bool = False,
) -> Merged:
    """Merge parts as `merge`, and tell how many there are; ``keep`` opens the result, too."""
    sources = _sources(archives)
    overwrite, progress = check.flag("overwrite", overwrite), check_progress(progress)
    unfinished = check.flag("unfinished", unfinished)
    target = None if path is None else _target(path, overwrite, sources)
    place = None if target is None else target.parent
    # Beside the target: what is complete gets its name in one step.
    with TemporaryDirectory(prefix=".symhbm-", dir=place) as folder:
        with Store(Path(folder, f"merged{SUFFIX}")) as store:
            summary = _Merger(store).take(sources, unfinished, progress)
            if target is not None and not summary.missing:
                draft = Path(folder, "merged.nc")
                assemble(store, draft, progress, rest="the parts are as they were")
        if target is None:
            summary.dataset = finished_part(store.path) if keep else None
            return summary
        summary.path = _placed(store.path, target, summary)
    if keep:
        whole = not summary.missing
        summary.dataset = load(target, lazy=True) if whole else finished_part(summary.path)
    return summary


def _sources(archives: Paths) -> list[Path]:
    if isinstance(archives, (str, bytes, os.PathLike)) or not isinstance(archives, Iterable):
        raise TypeError(f"archives={check.shown(archives)}: expected a sequence of paths")
    sources = [path_of(source, "archives") for source in archives]
    if not sources:
        raise ValueError("archives: expected at least one part, got none")
    return sources


def _target(path: str | os.PathLike[str], overwrite: bool, sources: list[Path]) -> Path:
    target = path_of(path)
    if not target.is_dir() and not target.exists():
        target = with_suffix(target)
    check_target(target)
    target = target.absolute()
    for file in (target, working_file(target)):
        if any(file.exists() and source.exists() and file.samefile(source) for source in sources):
            raise ArchiveError(f"path={str(target)!r}: expected another name than that of a part")
        if file.exists() and not overwrite:
            more = "" if file == target else f"; symhbm.resume({str(target)!r}) would finish it"
            raise FileExistsError(
                f"path={str(target)!r}: there is {file.name!r}, overwrite=True replaces it{more}"
            )
    return target


def _placed(draft: Path, target: Path, summary: Merged) -> Path:
    """Give the files their names; the archive, or the working file where sets are missing."""
    working = working_file(target)
    if summary.missing and target.exists():
        raise ArchiveError(
            f"path={str(target)!r}: there is such an archive, it is not replaced by one with gaps "
            f"({summary.missing})"
        )
    if working.exists():
        with Store(working) as old:  # in use by no other process
            old.remove()
    if summary.missing:
        os.replace(draft, working)
        return working
    os.replace(draft.with_suffix(".nc"), target)
    return target


@dataclass
class _Merger:
    """Parameter sets of the whole, collected in a working file."""

    store: Store
    problems: list[str] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    n_repeated: int = 0

    def take(self, sources: list[Path], unfinished: bool, progress: bool | None) -> Merged:
        """Take all parts; ArchiveError that names those that cannot be taken."""
        origins = []
        with progress_bar("part", progress, len(sources), label="merge") as bar:
            for source in sources:
                try:
                    with opened(source, unfinished) as piece:
                        if piece is not None:
                            origins.append(self._take(source, piece))
                except (ArchiveError, FileNotFoundError) as error:
                    if len(sources) == 1:
                        raise
                    self.problems.append(str(error))
                bar.update()
        if self.problems:
            told = "; ".join(self.problems[:_MOST_TOLD])
            more = len(self.problems) - _MOST_TOLD
            told += f"; and {more} more" if more > 0 else ""
            count = f"{len(self.problems)} of {len(sources)} parts cannot be merged"
            raise ArchiveError(f"archives: {count}, nothing was written: {told}")
        if not origins:
            raise ArchiveError("archives: nothing was stored yet in any of the parts")
        self.store.add_sources(origins)
        missing = np.setdiff1d(np.arange(self.store.n_sets), [*self.store.done])
        text = ""
        if missing.size:
            count = f"{len(self.store.done)} of {self.store.n_sets} parameter sets are there"
            text = (
                f"{count}, missing: {parts.ranges(missing, _MOST_TOLD)} of {self._counted_along()}"
            )
        n_done = len(self.store.done)
        return Merged(self.store.n_sets, n_done, len(origins), self.n_repeated, text)

    def _take(self, source: Path, piece: Piece) -> dict:
        if self.store.call is None:
            self._begin(piece)
        names = schema.differences(self.whole, piece.whole)
        expected, found = _versions(self.origin), _versions(piece.origin)
        told = [
            f"{name} ({' and '.join(found[name])}, not {' and '.join(expected[name])})"
            for name in expected
            if found[name] != expected[name]
        ]
        if names or told:
            raise ArchiveError(
                f"path={str(source)!r}: of another computation than {self.names[0]!r}, different "
                f"in {', '.join([*names, *told])}"
            )
        self.names.append(str(source))
        taken: list[int] = []
        for rows in piece.rows():
            new = []
            for number, encoded in rows:
                if number in self.store.done:
                    self._check_same(source, number, encoded)
                    self.n_repeated += 1
                else:
                    new.append((number, encoded))
                    self.owner[number] = len(self.names) - 1
            self.store.add(new, computed=False)
            taken += [number for number, _ in rows]
        return {**piece.origin, "parameter_sets": parts.ranges(sorted(taken))}

    def _begin(self, piece: Piece) -> None:
        self.whole, self.origin = piece.whole, piece.origin
        self.sweep, self.request = schema.recall(piece.whole)
        self.owner = np.full(self.sweep.size, -1, dtype=np.int32)
        self.store.begin(bytes_of(piece.whole), self.sweep.size, piece.blank)

    def _check_same(self, source: Path, number: int, encoded: Encoded) -> None:
        [(_, other)] = self.store.read(number, number)
        key = _difference(tables.decode(*encoded), tables.decode(*other))
        if key is not None:
            index = np.unravel_index(number, self.sweep.shape)
            where = ", ".join(
                f"{dim}={self.whole[dim].values[i] if dim in self.whole.coords else i}"
                for dim, i in zip(self.sweep.dims, index, strict=True)
            )
            raise ArchiveError(
                f"path={str(source)!r}: at {where} its {tables.name_of(key, self.request)} is not "
                f"that of {self.names[self.owner[number]]!r}; one of both is wrong, or the "
                "machines round differently"
            )

    def _counted_along(self) -> str:
        if len(self.sweep.dims) == 1:
            return f"{self.sweep.dims[0]}, counted from 0"
        return f"the product of {', '.join(self.sweep.dims)}, counted from 0, the last one fastest"


def _versions(origin: dict) -> dict[str, list[str]]:
    """Packages whose versions are stored of each process, or of the archive."""
    return {
        f"{name}_version": sorted(
            {session[name] for session in origin["computed"]} | {origin[f"{name}_version"]}
        )
        for name in ("symhbm", "casadi")
    }


def _difference(first: tables.Table, second: tables.Table) -> str | None:
    """Name of an array that differs between two tables of one set, padded or not."""
    layout = tables.common(tables.stored_layout(tables.encode(each)[0]) for each in (first, second))
    one, other = (tables.stack([each], 1, layout) for each in (first, second))
    for key, values in one.items():
        if key in tables.NO_VARIABLES:
            continue
        same = values.tolist() == other[key].tolist()
        if values.dtype.kind != "O":
            same = values.tobytes() == other[key].tobytes()
        if not same:
            return key
    return None
