"""Designs of a front that are kept beside its archive, from which an interrupted call goes on."""

import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from symhbm.design.program import Aim
from symhbm.design.task import Task
from symhbm.numerics import FloatArray
from symhbm.results import with_provenance
from symhbm.results.archive import ArchiveError, load, path_of, save

_CALL = "design_call"
"""Attribute of archives of fronts, and entry of working files: of which call they are."""
_SUFFIX = ".points.npz"


@dataclass
class KeptDesigns:
    """Designs by what they were searched for, in a working file beside an archive, if there is one.

    ``complete`` is the front of an archive that is finished.
    """

    call: str
    target: Path | None = None
    designs: dict[str, FloatArray] = field(default_factory=dict)
    complete: xr.Dataset | None = None

    @classmethod
    def of(cls, archive: str | os.PathLike[str] | None, call: str) -> "KeptDesigns":
        """What is kept for an archive; ArchiveError where it is of another call."""
        if archive is None:
            return cls(call)
        result = cls(call, path_of(archive))
        assert result.target is not None
        if result.target.exists():
            complete = load(result.target)
            _check_call(result.target, complete.attrs.get(_CALL), call)
            result.complete = complete
        elif result.file.exists():
            try:
                with np.load(result.file, allow_pickle=False) as stored:
                    entries = {name: stored[name] for name in stored.files}
            except (OSError, ValueError) as error:
                raise ArchiveError(f"{result.file}: cannot be read ({error})") from error
            _check_call(result.file, str(entries.pop(_CALL, "")), call)
            result.designs = entries
        return result

    @property
    def file(self) -> Path:
        """The working file."""
        assert self.target is not None
        return self.target.with_name(self.target.name + _SUFFIX)

    def get(self, name: str) -> FloatArray | None:
        """The design that was found, None for none."""
        return self.designs.get(name)

    def add(self, name: str, x: FloatArray) -> None:
        """Keep a design; the working file is whole at any time."""
        self.designs[name] = x
        if self.target is None:
            return
        draft = self.file.with_name(self.file.name + ".tmp.npz")
        try:
            np.savez(draft, **{_CALL: np.array(self.call)}, **self.designs)  # type: ignore[arg-type]
            os.replace(draft, self.file)
        except OSError as error:
            raise ArchiveError(f"{self.file}: cannot be written ({error})") from error

    @contextmanager
    def told(self) -> Iterator[None]:
        """A note on KeyboardInterrupt tells what is kept."""
        try:
            yield
        except KeyboardInterrupt as interrupt:
            if self.target is not None:
                interrupt.add_note(
                    f"symhbm: interrupted; {len(self.designs)} designs are kept in {self.file}, "
                    "from which the same call goes on"
                )
            raise

    def finished(self, result: xr.Dataset) -> xr.Dataset:
        """The result, written to the archive, in place of the working file."""
        result = result.assign_attrs({_CALL: self.call})
        if self.target is not None:
            save(result, self.target)
            self.file.unlink(missing_ok=True)
        return result


def _check_call(path: Path, stored: str | None, call: str) -> None:
    if stored != call:
        raise ArchiveError(
            f"{path}: expected the front of this call, it is of another one; give another archive, "
            "or remove it"
        )


def signature(task: Task, aims: Sequence[Aim], n_points: int, n_starts: int | None) -> str:
    """Digest of all that a front depends on."""
    digest = hashlib.sha256()
    for peak in task.peaks:
        parts = with_provenance({}, {}, peak.problem, task.sweep)
        digest.update(str(parts.attributes["problem"]).encode())
        for entry in sorted(
            (parts.variables | parts.coordinates).items(), key=lambda pair: pair[0]
        ):
            digest.update(entry[0].encode())
            digest.update(repr(np.asarray(entry[1][1]).tolist()).encode())
        digest.update(repr((peak.name, peak.bands, peak.dof)).encode())
    for function in (*(aim.logarithm for aim in aims), task.limits.function):
        digest.update(function.serialize().encode())
    limits = [task.limits.low.tolist(), task.limits.high.tolist()]
    others = [aim.name for aim in aims], str(task.statistic), repr(task.variables.groups)
    digest.update(json.dumps([limits, others, n_points, n_starts]).encode())
    return digest.hexdigest()
