"""Ensembles of disks: random mistuning drawn, and statistics of the results."""

from symhbm.ensembles import mistuning, statistics

__all__ = [
    "mistuning",
    "statistics",
]
