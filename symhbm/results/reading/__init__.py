"""Datasets for those who read them: tables, motions, parts without padding, blocks."""

from symhbm.results.description import amplitude_of, largest_of, motions_of
from symhbm.results.reading.measured import MEASURED, measured
from symhbm.results.reading.motions import HISTORIES, MOTIONS, motion
from symhbm.results.reading.recorded import measured_functions, measured_signal
from symhbm.results.reading.rows import KINDS, rows_of, table
from symhbm.results.reading.selection import (
    ALIKE,
    CHOSEN,
    COMPLETE,
    INNER,
    SAMPLE,
    At,
    at,
    blocks,
    completeness,
    curve_status,
    is_inner,
    largest,
    moving,
    printable,
    read,
    set_dimensions,
    trimmed,
    with_curve_status,
)
from symhbm.results.reading.views import output, seen_from

__all__ = [
    "ALIKE",
    "CHOSEN",
    "COMPLETE",
    "HISTORIES",
    "INNER",
    "KINDS",
    "MEASURED",
    "MOTIONS",
    "SAMPLE",
    "At",
    "amplitude_of",
    "at",
    "blocks",
    "completeness",
    "curve_status",
    "is_inner",
    "largest",
    "largest_of",
    "measured",
    "measured_functions",
    "measured_signal",
    "motion",
    "motions_of",
    "moving",
    "output",
    "printable",
    "read",
    "rows_of",
    "seen_from",
    "set_dimensions",
    "table",
    "trimmed",
    "with_curve_status",
]
