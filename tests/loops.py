"""Loops of contacts, as pictures draw them."""

import numpy as np

from symhbm.model.contacts import Behaviour
from symhbm.plot.contact import contact_of, histories


class Loop:
    """The tangential side of a contact over a period, and the area that it encloses [J]."""

    def __init__(self, history):
        self.angle, self.limit = history.angle, history.limit
        self.displacement, self.force = history.displacement[0], history.force[0]
        self.area = np.trapezoid(self.force, self.displacement)
        self.onset = history.changes((Behaviour.STICKS,), (Behaviour.SLIPS,))
        self.end = history.changes((Behaviour.SLIPS,), (Behaviour.STICKS,))


def loops_of(dataset, contact=0):
    """Loops by their indices along dimensions, those of converged points; the dataset without
    padding, and the dimensions."""
    found = histories(dataset, contact_of(dataset, contact))
    return {at: each and Loop(each) for at, each in found.of.items()}, found.dataset, found.dims
