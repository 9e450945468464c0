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
        """Told at all surveyed values, and between two that differ by halves of those wanted."""
        if leading.parameter.problem.single_valued:
            return cls(np.array([leading.parameter.low]), np.array([False]))
        told = {value: _on_island(leading, at) for value, at in sorted(leading.surveyed.items())}
        for (low, first), (high, last) in pairwise(list(told.items())):
            inside = [value for value in wanted if low < value < high]
            while inside and first != last:
                middle = len(inside) // 2
                value = inside[middle]
                told[value] = _on_island(leading, leading.survey([value])[0])
                inside = inside[middle + 1 :] if told[value] == first else inside[:middle]
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
