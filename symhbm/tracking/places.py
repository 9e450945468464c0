"""Points of the curve of the largest peak, its minima and events: what each is."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from symhbm.peak_conditions import Conditions
from symhbm.summit import SummitKind


class Low(StrEnum):
    """What makes a minimum of the curve."""

    SMOOTH = "smooth"
    EXCHANGE = "exchange"
    KINK = "kink"
    END = "end"


class Turn(StrEnum):
    """What happens at an event of the curve."""

    EXCHANGE = "exchange of the dominant peak"
    STICK = "full stick"
    KIND = "change of kind"
    ONSET = "onset of slip at the peak"
    RELEASE = "end of slip at the peak"
    BAND = "peak crosses the end of the band"
    POLE = "peak becomes unbounded"


@dataclass(frozen=True)
class Place:
    """A point of the curve: the maximum that leads there and what it is."""

    value: float
    found: Conditions
    what: str = ""


def turn(before: Conditions, after: Conditions) -> Turn:
    """What happens at a joint of a branch."""
    one, other = before.summit, after.summit
    if other.kind == SummitKind.SMOOTH and not other.slip.any() and one.slip.any():
        return Turn.STICK
    if one.kind != other.kind:
        return Turn.KIND
    slips = np.count_nonzero(other.slip) - np.count_nonzero(one.slip)
    if slips:
        return Turn.ONSET if slips > 0 else Turn.RELEASE
    return Turn.KIND
