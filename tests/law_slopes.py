"""Force and margins of one contact with their derivatives, and differences to hold them against."""

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
        return {n: float(v[0]) for n, v in self.law.results(self.at, self.located).items()}

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
