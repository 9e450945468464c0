"""What the report says beside its comparisons: scope, limits, versions, counts."""

import importlib.metadata
import platform
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from tests.benchmarks.table import machine
from tests.validation.comparison import Comparison, Part, Verdict
from tests.validation.margins import Drawn

TITLE = "Validation of symhbm"
COLUMNS = ("comparison", "source", "allowed", "found", "expected", "difference", "verdict")
PACKAGES = ("casadi", "numpy", "scipy", "xarray", "numba", "netCDF4", "matplotlib", "scikit-fem")
SCOPE = (
    "This report compares what symhbm computes with values that are exact, published, or of other "
    "programs. Every value under 'found' was computed anew by the command above, on the machine "
    "and with the versions above; values under 'expected' are closed forms evaluated beside them, "
    "or data of the folder data/reference, whose page names each source.",
    "Differences are relative to the expected value, or, where that may vanish, to the size that "
    "the comparison names. A row of several values shows the one that differs most. 'FAILED' is a "
    "difference larger than allowed, a value that is missing or is not a number, or a computation "
    "that ended with an error; one of them makes the exit code 1. 'not run' is a comparison whose "
    "program is not installed: it is neither passed nor failed.",
    "Claims of the source, the paper by E. Chatelet, D. Rade and G. Jacquet-Richardet (DINAME "
    "2013, hal-00941429), are weighed: a row passes when the verdict, 'holds' or 'does not hold', "
    "is the one that docs/claims.md states.",
)
NOT_COVERED = (
    "Experiments. No measured response of a real disk is compared; friction coefficients, contact "
    "stiffnesses and loads are input, and what they are worth is the user's to show.",
    "The lines of the figures of the source: only its captions, tick labels and text are known.",
    "Truncation for other structures. That harmonics are left out errs by what is measured here "
    "for these structures only; `accuracy=` and `verify` measure it for another one.",
    "Completeness of branches. Responses that meet none of those followed are not looked for.",
    "Wear, heat, rate-dependent friction, and partial slip within one contact, unless a law of the "
    "user's own holds them.",
    "Speed and memory, which docs/benchmarks.md and docs/guide/scale.md measure, and machines "
    "other than the one above.",
    "Structures read from files of finite-element programs, beyond those of the studies: the tests "
    "of the repository read them.",
)


@dataclass(frozen=True)
class Document:
    """A report: its parts, the figure of all, and under which circumstances they were computed."""

    parts: Sequence[Part]
    margins: Drawn
    command: str
    made: str
    quick: bool

    def count(self, verdict: Verdict) -> int:
        """Number of comparisons of this verdict."""
        return sum(part.count(verdict) for part in self.parts)

    @property
    def failed(self) -> list[tuple[Part, Comparison]]:
        """Comparisons that failed, with the part of each."""
        return [
            (part, row) for part in self.parts for row in part.rows if row.verdict is Verdict.FAILED
        ]

    @property
    def result(self) -> str:
        """The counts, in a sentence."""
        failed, passed, absent = map(self.count, (Verdict.FAILED, Verdict.PASSED, Verdict.MISSING))
        return (
            f"{failed} of {failed + passed} comparisons FAILED, {passed} passed; {absent} more "
            "were not run."
            if failed
            else f"All {passed} comparisons that were run passed; {absent} more were not run."
        )

    @property
    def circumstances(self) -> list[tuple[str, str]]:
        """Names and values for the first page."""
        extent = "quick: some studies, and fewer points of each part" if self.quick else "full"
        return [
            ("result", self.result),
            ("extent", extent),
            ("command", self.command),
            ("date", self.made),
            ("symhbm", f"{importlib.metadata.version('symhbm')}{_commit()}"),
            ("Python", f"{platform.python_version()}, {platform.platform()}"),
            ("packages", ", ".join(map(_version, PACKAGES))),
            ("machine", machine().partition(";")[0]),
            ("CPU time", f"{sum(part.seconds for part in self.parts):.0f} s"),
        ]


def now() -> str:
    """Date and time."""
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")


def command_line() -> str:
    """The command that this is."""
    return " ".join(["python -m tests.validation", *sys.argv[1:]])


def _version(package: str) -> str:
    try:
        return f"{package} {importlib.metadata.version(package)}"
    except importlib.metadata.PackageNotFoundError:
        return f"no {package}"


def _commit() -> str:
    """The commit of a clone, and whether files differ from it."""
    root = Path(__file__).parents[2]

    def git(*given: str) -> str:
        run = subprocess.run(["git", *given], cwd=root, capture_output=True, text=True, check=True)
        return run.stdout.strip()

    try:
        changed = " with changes" if git("status", "--porcelain") else ""
        return f", commit {git('rev-parse', '--short=12', 'HEAD')}{changed}"
    except (OSError, subprocess.CalledProcessError):
        return ", not in a clone"
