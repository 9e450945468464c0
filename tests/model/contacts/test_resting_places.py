"""Where the slider of planar friction rests, and when it begins to slip, under a light preload."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.model.contacts import Motions
from symhbm.numerics import FourierBasis

BASIS, LAW = FourierBasis((0, 1)), sh.laws.PlanarFriction()
NEXT_TO_EACH_OTHER = 28, 131, 159, 283
"""Draws of which two instants that ask most of the slider are within a hundredth of a period."""


def drawn(seed):
    """A slow motion past a position while the limit is least: motion (3, K), load and lag.

    All springs are of stiffness 1, so that motions are forces.
    """
    rng = np.random.default_rng(seed)
    swing, turn, lag = rng.uniform(0.5, 2), *rng.uniform(0, 2 * np.pi, 2)
    pull = swing * 10 ** rng.uniform(-3, -0.5)
    load = pull**2 / swing * 10 ** rng.uniform(-2, 0.5)
    phase, bow, late = rng.uniform(0, 2 * np.pi), 5 * pull * 10 ** rng.uniform(-2, 0), lag
    late += 5 * pull / swing * rng.uniform(-1, 1)
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    motion = np.zeros((3, 3))
    motion[:2, 1] = -along * pull * np.sin(lag) + across * bow * np.cos(phase)
    motion[:2, 2] = along * pull * np.cos(lag) + across * bow * np.sin(phase)
    motion[2, 1:] = -swing * np.cos(late), -swing * np.sin(late)
    return motion, load + swing, late


def located(motion, load, held=None):
    """The motion and its events under a load, or with stick imposed."""
    values = dict(contact_stiffness=1.0, normal_stiffness=1.0, friction_coefficient=1.0)
    values = {name: np.ones(1) for name in values} | {"normal_load": np.array([load])}
    at = Motions(BASIS, motion.reshape(1, -1), 1.0, values)
    return at, LAW.locate(at, held)


@pytest.mark.parametrize("seed", [*range(4), *NEXT_TO_EACH_OTHER])
def test_slip_begins_where_the_force_of_stick_reaches_its_limit(seed):
    """That of a slider which rests in the middle, sampled closely: nothing is located here."""
    motion, load, lag = drawn(seed)
    force = LAW.forces(*located(motion, load, np.zeros((1, 3), dtype=bool))).reshape(3, 3)
    close = np.geomspace(1e-6, 0.5, 3000)
    tau = np.concatenate([np.linspace(0, 2 * np.pi, 10_000), lag + close, lag - close])
    functions = BASIS.values(tau)
    limit = load + functions @ motion[2]
    excess = (np.hypot(*(functions @ force[:2].T).T) - limit).max()
    size = 1e-8 * np.abs(motion).sum()
    slips = [located(motion, load + excess + side)[1].states[0, 0] for side in (-size, size)]
    assert slips == [True, False]
