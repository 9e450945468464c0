"""Landmarks: what a study must find, and where the expected value comes from."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite

_WRITTEN = {"1": "", "N m-1": "N/m", "N s m-1": "N s/m", "N m-3": "N/m³"}


class Source(StrEnum):
    """Where an expected value comes from."""

    PUBLISHED = "published"
    EXACT = "exact"
    CLOSED_FORM = "closed form"
    OTHER_PROGRAM = "another program of our own"
    CALCULIX = "CalculiX 2.20"
    SAMPLED = "1,000 samples of our own"


@dataclass(frozen=True)
class Landmark:
    """A computed value beside the expected one.

    ``tolerance`` is relative to the expected value, or in its unit where that is 0.
    """

    name: str
    computed: float
    expected: float
    unit: str
    source: Source
    tolerance: float

    @property
    def difference(self) -> float:
        """Difference from the expected value, relative to it unless it is 0."""
        if self.expected == 0:
            return self.computed
        return self.computed / self.expected - 1

    @property
    def met(self) -> bool:
        """Whether the study finds what it must; it does not where a value is NaN."""
        return abs(self.difference) <= self.tolerance

    @property
    def verdict(self) -> str:
        """What the difference means, in words."""
        if self.expected == 0:
            allowed = self._quantity(self.tolerance, 2)
        elif self.tolerance < 1e-4:
            allowed = number(self.tolerance, 2)
        else:
            allowed = f"{number(100 * self.tolerance, 2)} %"
        found, expected = self._quantity(self.computed, 4), self._quantity(self.expected, 4)
        if not self.met:
            return f"DIFFERS: {found}, not {expected} to {allowed}"
        return f"agrees to {allowed}" if self.tolerance else "agrees"

    def _quantity(self, value: float, digits: int) -> str:
        return f"{number(value, digits)} {self.unit}".rstrip()


def unit_of(units: str) -> str:
    """Units of a dataset, as pages write them."""
    return _WRITTEN.get(units, units)


def number(value: float, digits: int = 6) -> str:
    """Return a value without zeros to count: 1e5 and not 100000."""
    if not isfinite(value):
        return f"{value:g}"
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    if value and (abs(value) >= 1e4 or abs(value) < 1e-3):
        short = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        return f"{short}e{int(power)}"
    return f"{value:.{digits}g}"


def unmet(landmarks: Iterable[Landmark]) -> list[str]:
    """Return a line for each landmark that is not met."""
    return [f"{mark.name}: {mark.verdict}" for mark in landmarks if not mark.met]
