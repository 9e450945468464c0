"""Force and margins of one contact with their derivatives, and differences to hold them against."""

import math
from functools import cache

import casadi as ca
import numpy as np

from symhbm.model.contacts import Motions


@cache
def _functions(law, basis):
    """First derivatives of the force, second ones at given events, and those of what moves them."""
    at, (motion, _, values) = Motions.symbols(law, basis)
    at = at._replace(frequency=1.0)
    events, weights = ca.SX.sym("events", law.n_events(basis)), ca.SX.sym("weights", motion.numel())
    force, whole = law.force(at, events), ca.vertcat(motion, values)
    bend = ca.hessian(ca.dot(weights, force), whole)[0]
    spread = ca.jacobian(law.event_variables(at), whole)
    inputs = [motion, values, events]
    return (
        ca.Function("slope", inputs, [ca.densify(ca.jacobian(force, whole))]),
        ca.Function("bend", [*inputs, weights], [ca.densify(bend), ca.densify(spread)]),
    )


class OneContact:
    """A contact of a law at a point, its motion and its values, at 1 rad/s."""

    def __init__(self, law, basis, point, held=None):
        self.law, self.basis, self.size = law, basis, basis.n_components * len(law.directions)
        self.motion, self.values = point[: self.size], point[self.size :]
        self.by_name = {name: self.values[[i]] for i, name in enumerate(law.parameters)}
        self.at = Motions(basis, self.motion[None], 1.0, self.by_name)
        self.located = law.locate(self.at, None if held is None else np.array([held]))

    @property
    def force(self):
        return self.law.forces(self.at, self.located)[0]

    @property
    def margins(self):
        return self.located.margins[0]

    @property
    def figures(self):
        """What datasets tell of it."""
        return figures_of(self.law, self.basis, self.motion, self.by_name)

    @property
    def slope(self):
        """Derivatives of the force by all of the point."""
        slope = _functions(self.law, self.basis)[0]
        return slope(self.motion, self.values, self.located.events[0]).full()

    @property
    def margin_slope(self):
        by_values = self.law.margin_slopes(self.located, 1.0, self.by_name)[1][:, 0].T
        return np.concatenate([self.located.margins_by_motion[0], by_values], axis=1)

    def bend(self, weights):
        """Second derivatives of a weighted force by all of the point."""
        moving = self.law.moving_events(self.at, self.located, weights[None])[0]
        np.testing.assert_allclose(moving, moving.T, rtol=0, atol=1e-12 * np.abs(moving).max())
        bend = _functions(self.law, self.basis)[1]
        frozen, spread = bend(self.motion, self.values, self.located.events[0], weights)
        return frozen.full() + spread.full().T @ moving @ spread.full()


def difference(function, at, direction, step):
    """Derivative along a direction by central differences of eighth order."""
    shares = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    return sum(
        sign * share * function(at + sign * k * step * direction) / step
        for k, share in shares.items()
        for sign in (1, -1)
    )


def values_of(law, stiffness=1.0, normal=1.0, friction=0.5, load=1.5):
    """Values of a law of friction, of one contact."""
    known = dict(
        contact_stiffness=stiffness,
        normal_stiffness=normal,
        friction_coefficient=friction,
        normal_load=load,
        gap=-load / normal if normal else np.nan,
    )
    return {name: np.array([known[name]], dtype=float) for name in law.parameters}


def at_motion(basis, motion, values):
    """One motion, (m, K) or as one row."""
    return Motions(basis, np.ravel(motion)[None], 1.0, values)


def force_of(law, basis, motion, values, held=None):
    """Coefficients direction by direction (m, K), and what was located."""
    at = at_motion(basis, motion, values)
    located = law.locate(at, None if held is None else np.array([held]))
    return law.forces(at, located).reshape(len(law.directions), -1), located


def figures_of(law, basis, motion, values):
    """What datasets tell of a contact."""
    at = at_motion(basis, motion, values)
    results = law.results(at, law.locate(at))
    return {name: float(array[0]) for name, array in results.items()}


def turned_by(basis, angle):
    """What makes coefficients of a motion those of the same from a later angle on, (K, K)."""
    result = np.eye(basis.n_components)
    for n in basis.harmonics:
        if n:
            i, c, s = basis.component(n), np.cos(n * angle), np.sin(n * angle)
            result[i : i + 2, i : i + 2] = [[c, s], [-s, c]]
    return result


def returned(law, basis, motion, values, samples, periods=2):
    """The force by radial return over samples: of first order, but nothing else is in it."""
    given, motion = law.physical(1.0, values)[0], np.reshape(motion, (len(law.directions), -1))
    parts = dict(zip(law.directions, motion, strict=True))
    functions = basis.values(2 * np.pi * np.arange(samples) / samples)
    none = np.zeros(basis.n_components)
    x, y = (given[0] * functions @ parts.get(name, none) for name in ("tangential", "across"))
    press = np.maximum(given[3] + given[1] * functions @ parts.get("normal", none), 0)
    pulls = [*zip(x.tolist(), y.tolist(), (given[2] * press).tolist(), strict=True)]
    at_x, at_y, force = x[0], y[0], []
    for pull_x, pull_y, limit in pulls * periods:
        force_x, force_y = pull_x - at_x, pull_y - at_y
        size = math.hypot(force_x, force_y)
        if size > limit:
            force_x, force_y = force_x * limit / size, force_y * limit / size
            at_x, at_y = pull_x - force_x, pull_y - force_y
        force.append((force_x, force_y))
    whole = np.column_stack([force[-samples:], press])
    analysed = (2 * np.pi / samples * (functions * basis.norm).T @ whole).T
    places = {"tangential": 0, "across": 1, "normal": 2}
    return analysed[[places[name] for name in law.directions]]
