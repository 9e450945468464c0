"""Pictures of ensembles: where the responses of many samples lie, and values blade by blade."""

from symhbm.plot.ensemble.blades import blades
from symhbm.plot.ensemble.envelope import draw_bands, envelope

__all__ = ["blades", "draw_bands", "envelope"]
