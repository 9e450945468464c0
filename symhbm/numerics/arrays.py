"""Types of arrays, and the factor from Hz to rad/s."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]
Table = dict[str, Any]
"""Arrays by the names of a dataset."""

RADIANS = 2 * np.pi
"""Angular frequency [rad/s] of 1 Hz."""


def relative_difference(value: FloatArray, reference: FloatArray) -> float:
    """Largest difference over the largest reference."""
    return float(np.abs(value - reference).max() / (np.abs(reference).max() or 1.0))
