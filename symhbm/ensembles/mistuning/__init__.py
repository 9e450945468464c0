"""Labelled samples of mistuned parameters, for ``over=``.

Sample ``i`` of a seed is the same however many samples are drawn, but for Latin hypercubes, which
depend on their number. Each parameter has a random stream of its own, which does not depend on the
other parameters drawn. The attribute ``drawn`` (JSON) of every variable tells how it was drawn, in
archives of the response too. `xarray.merge` joins draws of different distributions.
"""

from symhbm.ensembles.mistuning.draws import lognormal, truncated_normal, uniform
from symhbm.ensembles.mistuning.samples import explicit, harmonic, pattern

__all__ = ["explicit", "harmonic", "lognormal", "pattern", "truncated_normal", "uniform"]
