"""Contact laws: the force of a contact and its derivatives, from its motion over a period."""

from symhbm.model.contacts.coulomb import ContactState, friction_kernel, slip_limit
from symhbm.model.contacts.coulomb_hysteresis import HysteresisLoop, hysteresis_loops
from symhbm.model.contacts.coulomb_located import locate, on_loop, stick_intervals
from symhbm.model.contacts.coulomb_loops import Loop, loops_near_limit
from symhbm.model.contacts.coulomb_one_harmonic import (
    FREE,
    layout,
    one_harmonic_kernel,
    packed_size,
    unpack,
)
from symhbm.model.contacts.coulomb_sampled import locate_sampled
from symhbm.model.contacts.cubic_spring import cubic_kernel
from symhbm.model.contacts.equivalent_springs import ContactSprings, contact_springs, spring_kernel

__all__ = [
    "FREE",
    "ContactSprings",
    "ContactState",
    "HysteresisLoop",
    "Loop",
    "contact_springs",
    "cubic_kernel",
    "friction_kernel",
    "hysteresis_loops",
    "layout",
    "locate",
    "locate_sampled",
    "loops_near_limit",
    "on_loop",
    "one_harmonic_kernel",
    "packed_size",
    "slip_limit",
    "spring_kernel",
    "stick_intervals",
    "unpack",
]
