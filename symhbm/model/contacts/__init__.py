"""Contact laws: the force of a contact and its derivatives, from its motion over a period."""

from symhbm.model.contacts.coulomb import (
    Coulomb,
    HysteresisLoop,
    Loop,
    hysteresis_loops,
    located_of,
    loops_near_limit,
    on_loop,
    stick_intervals,
    travel,
)
from symhbm.model.contacts.cubic_spring import CubicSpring
from symhbm.model.contacts.gap import UnilateralSpring
from symhbm.model.contacts.group import Contacts, Group, check_pairs, is_name, named
from symhbm.model.contacts.law import FREE, ContactLaw, Located, Switch, graph_of
from symhbm.model.contacts.parameter import Parameter
from symhbm.model.contacts.planar import PlanarFriction
from symhbm.model.contacts.smooth import SmoothLaw
from symhbm.model.contacts.varying_load import VariableLoadFriction

__all__ = [
    "FREE",
    "ContactLaw",
    "Contacts",
    "Coulomb",
    "CubicSpring",
    "Group",
    "HysteresisLoop",
    "Located",
    "Loop",
    "Parameter",
    "PlanarFriction",
    "SmoothLaw",
    "Switch",
    "UnilateralSpring",
    "VariableLoadFriction",
    "check_pairs",
    "graph_of",
    "hysteresis_loops",
    "is_name",
    "located_of",
    "loops_near_limit",
    "named",
    "on_loop",
    "stick_intervals",
    "travel",
]
