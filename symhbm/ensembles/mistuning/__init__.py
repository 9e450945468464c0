"""Draws of mistuned parameters, labelled, for ``over=``.

Sample ``i`` of a seed is the same however many samples are drawn, but for Latin hypercubes, which
depend on their number. Each parameter has a stream of its own: another one beside it changes
nothing. What was drawn, and how, is in the attribute ``drawn`` (JSON) of every variable, and so in
the archive of the response. Draws of different distributions go together by `xarray.merge`.
"""

from symhbm.ensembles.mistuning.draws import (
    explicit,
    harmonic,
    lognormal,
    pattern,
    truncated_normal,
    uniform,
)

__all__ = ["explicit", "harmonic", "lognormal", "pattern", "truncated_normal", "uniform"]
