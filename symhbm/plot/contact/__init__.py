"""Pictures of contacts: loops, normal forces, and what they do over the band."""

from symhbm.plot.contact.histories import contact_of, histories
from symhbm.plot.contact.interface import contact_map
from symhbm.plot.contact.loops import hysteresis, normal_force
from symhbm.plot.contact.states import states
from symhbm.plot.contact.stick_map import stick_map

__all__ = [
    "contact_map",
    "contact_of",
    "histories",
    "hysteresis",
    "normal_force",
    "states",
    "stick_map",
]
