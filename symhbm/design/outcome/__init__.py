"""What is said of an optimal design: its dataset, status, certificate and derivatives."""

from symhbm.design.outcome.certificate import (
    Comparison,
    certificate,
    compared,
    is_complete,
    status_of,
)
from symhbm.design.outcome.report import (
    checked,
    in_units,
    infeasible,
    labelled,
    report,
    report_of_fresh,
    table_of,
    with_certificate,
)

__all__ = [
    "Comparison",
    "certificate",
    "checked",
    "compared",
    "in_units",
    "infeasible",
    "is_complete",
    "labelled",
    "report",
    "report_of_fresh",
    "status_of",
    "table_of",
    "with_certificate",
]
