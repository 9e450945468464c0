"""Measured points beside computed curves, and what to measure next."""

from symhbm.plot.measurements.experiment import next_measurements
from symhbm.plot.measurements.points import (
    check_measured,
    draw_measured,
    draw_modes,
    measured_points,
    mode_points,
    place_of,
)

__all__ = [
    "check_measured",
    "draw_measured",
    "draw_modes",
    "measured_points",
    "mode_points",
    "next_measurements",
    "place_of",
]
