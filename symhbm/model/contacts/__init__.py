"""Contact laws: the force of a contact and its derivatives, from its motion over a period."""

from symhbm.model.contacts import laws
from symhbm.model.contacts.coulomb import Coulomb, Loop, loops_near_limit, on_loop, stick_intervals
from symhbm.model.contacts.friction import Friction
from symhbm.model.contacts.gap import Gap, UnilateralSpring
from symhbm.model.contacts.group import Contacts, Ends, Group, Weights, renumbered, weights_of
from symhbm.model.contacts.groups import ContactGroups, SliderContacts
from symhbm.model.contacts.law import FREE, ContactLaw, graph_of
from symhbm.model.contacts.marched import marched
from symhbm.model.contacts.memoryless import CubicSpring, MemorylessLaw, PolynomialLaw
from symhbm.model.contacts.motions import (
    Behaviour,
    EventLoop,
    Events,
    FixedValues,
    History,
    Located,
    Motions,
    Parameter,
    SpringSliders,
    Switch,
)
from symhbm.model.contacts.normal import NormalLaw
from symhbm.model.contacts.planar import PlanarFriction
from symhbm.model.contacts.smooth import SmoothForce, SmoothLaw
from symhbm.model.contacts.varying_load import VariableLoadFriction

__all__ = [
    "FREE",
    "Behaviour",
    "ContactGroups",
    "ContactLaw",
    "Contacts",
    "Coulomb",
    "CubicSpring",
    "Ends",
    "EventLoop",
    "Events",
    "FixedValues",
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
    "SliderContacts",
    "SmoothForce",
    "SmoothLaw",
    "SpringSliders",
    "Switch",
    "UnilateralSpring",
    "VariableLoadFriction",
    "Weights",
    "graph_of",
    "laws",
    "loops_near_limit",
    "marched",
    "on_loop",
    "renumbered",
    "stick_intervals",
    "weights_of",
]
