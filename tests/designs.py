"""Problems of the design tests, small enough to be solved many times."""

import re
import warnings
from contextlib import contextmanager

import symhbm as sh

BAND = (5.0, 40.0)
"""Frequencies [Hz] that hold the resonances of the blade, stuck at 22.5 and free at 15.9."""
BOUNDS = (0.05, 500.0)
"""Normal loads [N] from nearly free to stuck: 1 to 10000 times what one blade needs at least."""
BEST_LOAD = 3.088578873912
BEST_AMPLITUDE = 3.082288527639e-4
BEST_FREQUENCY = 19.496559186804
"""Optimum of the blade with one harmonic, N, m and Hz, from its closed form."""


def blade(harmonics=(1,), force=1.0, **parameters):
    """One blade with a friction damper to the ground."""
    values = dict(mass=1.0, stiffness=1e4, damping=0.5)
    values |= dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=10.0)
    model = sh.single_blade(**(values | parameters))
    return sh.HarmonicBalance(model, sh.PointForce(amplitude=force), harmonics)


def ring(n_blades=13, contact_stiffness=1e6, engine_order=3, harmonics=(1,), **parameters):
    """A ring of blades under an engine order."""
    values = dict(mass=1.0, stiffness=1e4, damping=0.5, contact_stiffness=contact_stiffness)
    values |= dict(friction_coefficient=0.5, normal_load=10.0)
    model = sh.bladed_disk(n_blades, **(values | parameters))
    return sh.HarmonicBalance(model, sh.EngineOrder(engine_order, amplitude=1.0), harmonics)


def design(problem, parameters="normal_load", bounds=BOUNDS, frequency=BAND, over=None, **options):
    """The design from few starts, silent."""
    options = dict(n_starts=1, progress=False) | options
    with any_status():
        return sh.minimise_peak(problem, parameters, bounds, frequency, over, **options)


@contextmanager
def any_status():
    """Without the warnings of designs, which are their statuses."""
    with warnings.catch_warnings():
        for status in sh.Status:
            warnings.filterwarnings("ignore", re.escape(str(status)))
        yield
