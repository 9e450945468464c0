"""Contact laws, and what a law of your own is made of: what `Contacts` takes."""

from symhbm.model.contacts.coulomb import Coulomb
from symhbm.model.contacts.gap import UnilateralSpring
from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.memoryless import CubicSpring, PolynomialLaw
from symhbm.model.contacts.motions import Located, Parameter, Switch
from symhbm.model.contacts.planar import PlanarFriction
from symhbm.model.contacts.smooth import SmoothLaw
from symhbm.model.contacts.varying_load import VariableLoadFriction

__all__ = [
    "ContactLaw",
    "Coulomb",
    "CubicSpring",
    "Located",
    "Parameter",
    "PlanarFriction",
    "PolynomialLaw",
    "SmoothLaw",
    "Switch",
    "UnilateralSpring",
    "VariableLoadFriction",
]
