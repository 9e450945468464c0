"""Labelled statistics of ensembles: the responses of many samples of one structure.

They take results of `symhbm.frf` or `symhbm.follow` with one swept dimension, usually ``sample``,
also those opened lazily, which are read in blocks. A sample has failed if its status tells of
anything that is missing, or if one of its points is not converged: it is counted in ``n_failed``
and enters no statistic. Of an ensemble that is not finished, or a part of one, the samples that
are there are used, and ``n_missing`` is the number of the others. Every result is a Dataset that
`symhbm.save` writes and of which `symhbm.datasets.rebuild` makes the nominal problem.
"""

from symhbm.ensembles.statistics.bands import envelope
from symhbm.ensembles.statistics.confidence import convergence, position, samples_needed
from symhbm.ensembles.statistics.extreme_values import extreme_value_fit
from symhbm.ensembles.statistics.factors import amplification, worst
from symhbm.ensembles.statistics.participation import localisation

__all__ = [
    "amplification",
    "convergence",
    "envelope",
    "extreme_value_fit",
    "localisation",
    "position",
    "samples_needed",
    "worst",
]
