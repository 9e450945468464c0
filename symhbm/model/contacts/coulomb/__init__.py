"""Dry friction with a constant normal load: a spring and a Coulomb slider."""

from symhbm.model.contacts.coulomb.law import Coulomb, PressedCoulomb
from symhbm.model.contacts.coulomb.located import on_loop, stick_intervals
from symhbm.model.contacts.coulomb.state import Loop, loops_near_limit

__all__ = ["Coulomb", "Loop", "PressedCoulomb", "loops_near_limit", "on_loop", "stick_intervals"]
