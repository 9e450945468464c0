"""What is asked of a dataset: tables, motions, outputs, other places, the problem behind it."""

from symhbm.peaks import sensitivity
from symhbm.response.disks import sector_response
from symhbm.response.recover import recover
from symhbm.response.unforced import synthesised_response
from symhbm.results.archive import ArchiveError, merge, rebuild
from symhbm.results.reading import (
    at,
    measured,
    measured_functions,
    measured_signal,
    motion,
    output,
    seen_from,
    table,
    trimmed,
)
from symhbm.results.telling import compare

__all__ = [
    "ArchiveError",
    "at",
    "compare",
    "measured",
    "measured_functions",
    "measured_signal",
    "merge",
    "motion",
    "output",
    "rebuild",
    "recover",
    "sector_response",
    "seen_from",
    "sensitivity",
    "synthesised_response",
    "table",
    "trimmed",
]
