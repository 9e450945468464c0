"""Linear outputs of a structure."""

from symhbm.model.outputs.output import Output, outputs_of

__all__ = ["Output", "outputs_of"]
