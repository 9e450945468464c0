"""How a verb runs: where it computes, what it keeps and how it reports; the same for all verbs."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, TypedDict

from symhbm.numerics import check
from symhbm.results.parts import JobPart
from symhbm.workers import check_executor, check_progress


class Reporting(TypedDict, total=False):
    """How a verb tells of its progress and of failures, as `Run`."""

    throw: bool
    progress: bool | None


class Following(Reporting, total=False):
    """How a verb that follows a path runs, as `Run`."""

    max_points: int


class Sharing(Reporting, total=False):
    """How a verb runs whose work an executor may share, as `Run`."""

    executor: Executor | None


class Keeping(Reporting, total=False):
    """How a verb runs whose work a file may keep, as `Run`."""

    archive: str | os.PathLike[str] | None


class Archiving(Sharing, Keeping, total=False):
    """How a verb runs whose work an executor may share and a file may keep, as `Run`."""


class Sweeping(Following, Archiving, total=False):
    """How a verb of many parameter sets runs, as `Run`."""

    part: JobPart | None
    keep: Iterable[str] | None


class Run(Sweeping, total=False):
    """Where a verb computes, what it keeps and how it reports: keywords that verbs share.

    `symhbm.frf` and `symhbm.follow` take all of them; other verbs those that their signatures name.

    Attributes
    ----------
    archive
        NetCDF file to write. Each parameter set is safe in the working file ``<archive>.partial`` a
        tenth of a second after it is finished; the same call, or `symhbm.resume`, goes on after an
        interruption. A finished archive is opened without computing, and a line on stderr says so
        where ``progress`` is shown. The checksum of the whole archive is compared each time.
    executor
        Where parameter sets are computed; by default in this process.
    part
        Compute these parameter sets alone: ``(k, n)``, the k-th of n parts of the longest dimension
        of ``over``, a ``range`` of positions along it, or ``{dimension: range}``. Each job of
        many computes one, with the same ``over``; `symhbm.datasets.merge` makes one result of all.
    keep
        Names of the variables to keep, by default all. Coordinates, parameters, ``status``, counts
        and the variables that tell valid points (``converged``, ``contact_model_valid``,
        ``residual_norm``) are always kept. The attribute ``left_out`` names the others.
    verifiable
        Keep also the variables of the peaks that `symhbm.verify` needs: value, amplitude and
        Fourier coefficients (5 kB for each disk of 13 mistuned blades under one harmonic). By
        default they are kept.
    throw
        Raise SolveError when a result is incomplete, instead of a warning.
    progress
        By default, show a bar when the work takes longer than a few seconds; True: at once, False:
        never.
    max_points
        Largest number of points of one path, by default 5000.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> quiet: sh.Run = dict(progress=False, keep=["amplitude"])
    >>> sorted(sh.frf(problem, (10, 30), at=[15, 20], **quiet).data_vars)[0]
    'amplitude'
    """

    verifiable: bool


@dataclass(frozen=True)
class Running:
    """The values of `Run`, checked."""

    archive: str | os.PathLike[str] | None = None
    executor: Executor | None = None
    part: JobPart | None = None
    keep: Iterable[str] | None = None
    verifiable: bool = True
    throw: bool = False
    progress: bool | None = None
    max_points: int = 5000

    def __post_init__(self) -> None:
        check_executor(self.executor)
        check.flag("verifiable", self.verifiable)
        check.flag("throw", self.throw)
        check_progress(self.progress)
        check.integer("max_points", self.max_points, minimum=2)

    @classmethod
    def of(cls, run: Mapping[str, Any], kind: type = Run) -> Running:
        """The keywords of a call that takes those of a ``kind``; TypeError for any other."""
        verb = sys._getframe(1).f_code
        own = verb.co_varnames[: verb.co_argcount + verb.co_kwonlyargcount]
        shared = sorted(kind.__optional_keys__)  # type: ignore[attr-defined]
        check.keywords(run, [*own, *shared], verb.co_name)
        return cls(**run)
