"""Designs and fits that were found, kept in a file from which the same call goes on."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.numerics import FloatArray
from symhbm.results import Sweep, with_provenance
from symhbm.results.archive import ArchiveError, load, path_of, save

_CALL = "design_call"
"""Attribute of archives, and entry of working files: of which call they are."""
_SUFFIX = ".points.npz"


@dataclass
class KeptDesigns:
    """Designs by the question they answer, in a working file next to an archive, if there is one.

    ``complete`` is the result of an archive that is finished.
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

    def kept(self) -> str:
        """What an interrupt leaves, in words."""
        if self.target is None:
            return "nothing is kept of designs that are not finished; with archive= those found are"
        count = len(self.designs)
        what = "design is" if count == 1 else "designs are"
        return f"{count} {what} kept in {self.file}, from which the same call goes on"

    def finished(self, result: xr.Dataset) -> xr.Dataset:
        """The result, written to the archive, in place of the working file."""
        result = result.assign_attrs({_CALL: self.call})
        if self.target is not None:
            save(result, self.target)
            self.file.unlink(missing_ok=True)
        return result


def told_of(problem: HarmonicBalance, sweep: Sweep) -> list[Any]:
    """All that a problem under a sweep is, for the digest of a call."""
    parts = with_provenance({}, {}, problem, sweep)
    entries = sorted((parts.variables | parts.coordinates).items())
    values = [(name, np.asarray(entry[1]).tolist()) for name, entry in entries]
    return [str(parts.attributes["problem"]), repr(values)]


def _check_call(path: Path, stored: str | None, call: str) -> None:
    if stored != call:
        raise ArchiveError(
            f"{path}: expected the result of this call, it is of another one; give another "
            "archive, or remove it"
        )
