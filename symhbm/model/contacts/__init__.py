"""Contact laws: the force of a contact and its derivatives, from its motion over a period."""

from symhbm.model.contacts import laws
from symhbm.model.contacts.coulomb import (
    Coulomb,
    Loop,
    loops_near_limit,
    on_loop,
    stick_intervals,
)
from symhbm.model.contacts.directions import (
    Ends,
    Weights,
    check_directions,
    renumbered,
    weights_of,
)
from symhbm.model.contacts.friction import Friction
from symhbm.model.contacts.gap import Gap, UnilateralSpring
from symhbm.model.contacts.group import Contacts, Group, is_name, named
from symhbm.model.contacts.law import FREE, ContactLaw, graph_of
from symhbm.model.contacts.marched import marched
from symhbm.model.contacts.memoryless import MemorylessLaw
from symhbm.model.contacts.motions import (
    Behaviour,
    Events,
    History,
    Located,
    Motions,
    SpringSliders,
    Switch,
)
from symhbm.model.contacts.normal import NormalLaw
from symhbm.model.contacts.parameter import Parameter
from symhbm.model.contacts.planar import PlanarFriction
from symhbm.model.contacts.polynomial import CubicSpring, PolynomialLaw
from symhbm.model.contacts.rotation import PressedCoulomb
from symhbm.model.contacts.smooth import SmoothForce, SmoothLaw
from symhbm.model.contacts.varying_load import VariableLoadFriction

__all__ = [
    "FREE",
    "Behaviour",
    "ContactLaw",
    "Contacts",
    "Coulomb",
    "CubicSpring",
    "Ends",
    "Events",
    "Friction",
    "Gap",
    "Group",
    "History",
    "Located",
    "Loop",
    "MemorylessLaw",
    "Motions",
    "NormalLaw",
    "Parameter",
    "PlanarFriction",
    "PolynomialLaw",
    "PressedCoulomb",
    "SmoothForce",
    "SmoothLaw",
    "SpringSliders",
    "Switch",
    "UnilateralSpring",
    "VariableLoadFriction",
    "Weights",
    "check_directions",
    "graph_of",
    "is_name",
    "laws",
    "loops_near_limit",
    "marched",
    "named",
    "on_loop",
    "renumbered",
    "stick_intervals",
    "weights_of",
]
