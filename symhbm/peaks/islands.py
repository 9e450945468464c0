"""Where the highest peak that was followed lies on an island: on no branch that a survey reaches.

Where responses are not unique, a loop of them may come off the branch as a parameter moves, with a
peak that goes on without a gap. Unique responses have no islands.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from symhbm.numerics import FloatArray
from symhbm.peaks.tracking import LeadingBranches, SurveyedValue

_SAME = 1e-6
"""Relative difference of heights that is no other branch: where an island comes off, the highest
response falls by far more."""
_BESIDE = 2e-3
"""Distance from a jump of the envelope that is the jump, as surveys beside it verify it."""


@dataclass(frozen=True)
class Islands:
    """Whether the highest peak is on an island at ascending ``values`` (n,), ``there`` (n,)."""

    values: FloatArray
    there: NDArray[np.bool_]

    @classmethod
    def of(cls, leading: LeadingBranches, wanted: list[float]) -> "Islands":
        """Told at all surveyed values, and by halves between two that differ.

        Those end where none wanted lies between and the island begins or ends within `_BESIDE`.
        """
        parameter = leading.parameter
        if parameter.problem.single_valued:
            return cls(np.array([parameter.low]), np.array([False]))
        told = {value: _on_island(leading, at) for value, at in sorted(leading.surveyed.items())}
        for (low, first), (high, last) in pairwise(list(told.items())):
            while first != last:
                inside = [value for value in wanted if low < value < high]
                if not inside and high - low <= _BESIDE * abs(high):
                    break
                middle = inside[len(inside) // 2] if inside else parameter.value(low, high, 0.5)
                told[middle] = _on_island(leading, leading.survey([middle])[0])
                low, high = (middle, high) if told[middle] == first else (low, middle)
        values = sorted(told)
        return cls(np.array(values), np.array([told[value] for value in values]))

    def at(self, values: FloatArray) -> NDArray[np.bool_]:
        """Whether the highest peak is on an island at ``values`` (m,), those wanted."""
        return self.there[np.searchsorted(self.values, values, side="right") - 1]

    def begin_or_end(self, value: float) -> bool:
        """Whether one begins or ends at a value, where the largest response jumps."""
        shores = np.flatnonzero(np.diff(self.there))
        low, high = self.values[shores], self.values[shores + 1]
        return bool(np.any((low * (1 - _BESIDE) <= value) & (value <= high * (1 + _BESIDE))))


def _on_island(leading: LeadingBranches, surveyed: SurveyedValue) -> bool:
    """Whether the followed branches are higher than a survey of the whole band."""
    survey, highest = surveyed.survey, leading.followed.highest(surveyed.value)
    if highest is None or not survey.complete:
        return False
    return highest[1].maximum.amplitude > (1 + _SAME) * survey.height
