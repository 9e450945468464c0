"""Ensembles of mistuned disks: samples of parameters, and statistics of their responses."""

from symhbm.ensembles import mistuning, statistics

__all__ = ["mistuning", "statistics"]
