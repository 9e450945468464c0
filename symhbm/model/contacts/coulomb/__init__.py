"""Dry friction with a constant normal load: a spring and a Coulomb slider."""

from symhbm.model.contacts.coulomb.law import Coulomb, SampledCoulomb, leading
from symhbm.model.contacts.coulomb.located import locate, on_loop, stick_intervals
from symhbm.model.contacts.coulomb.loops import Loop, loops_near_limit
from symhbm.model.contacts.coulomb.state import ContactState, slip_limit

__all__ = [
    "ContactState",
    "Coulomb",
    "Loop",
    "SampledCoulomb",
    "leading",
    "locate",
    "loops_near_limit",
    "on_loop",
    "slip_limit",
    "stick_intervals",
]
