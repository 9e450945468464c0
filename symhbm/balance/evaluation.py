"""The equations at one point: what residuals and curves return."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from symhbm.balance.contact_states import ContactStates
from symhbm.numerics import FloatArray


@dataclass(frozen=True)
class Evaluation:
    """The equations at one point: residual and derivatives.

    ``residual`` (n_unknowns,) [N]; ``magnitude``, the largest sum of the absolute force terms of
    one equation [N]; ``jacobian`` by the unknowns [N/m], dense or sparse by size;
    ``by_parameter`` (n_unknowns,), the derivative by the moving parameter, for
    `HarmonicBalance.evaluate` the angular frequency [N s]; ``states``, the events of the
    contacts; ``margins_by_parameter`` (n_switches,), the derivative of the margins of their
    switches by the moving parameter at constant unknowns.
    """

    residual: FloatArray
    magnitude: float
    jacobian: Any
    by_parameter: FloatArray
    states: ContactStates
    margins_by_parameter: FloatArray | float = 0.0

    @cached_property
    def norm(self) -> float:
        """Largest residual relative to the largest sum of absolute force terms."""
        largest = float(np.abs(self.residual).max())
        return largest / self.magnitude if self.magnitude > 0 else largest
