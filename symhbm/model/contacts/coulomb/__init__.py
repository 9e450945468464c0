"""Dry friction with a constant normal load: a spring and a Coulomb slider."""

from symhbm.model.contacts.coulomb.law import Coulomb, PressedCoulomb, SampledCoulomb
from symhbm.model.contacts.coulomb.located import locate, on_loop, stick_intervals
from symhbm.model.contacts.coulomb.state import ContactState, Loop, loops_near_limit, slip_limit

__all__ = [
    "ContactState",
    "Coulomb",
    "Loop",
    "PressedCoulomb",
    "SampledCoulomb",
    "locate",
    "loops_near_limit",
    "on_loop",
    "slip_limit",
    "stick_intervals",
]
