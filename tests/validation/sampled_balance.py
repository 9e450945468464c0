"""Forced balances of published cases over samples of the period: no path, and no events.

The laws are those of `tests.alternating`, and Newton's method starts from a motion.
"""

import numpy as np

from tests.alternating import Law, polynomial, slider, stop
from tests.reference import CASES

_LONGEST = 0.3
"""Longest step of Newton's method, of any coefficient."""


def centred(stiffness: float, limit: float) -> Law:
    """A slider as `slider`, whose static force is amid its extremes where it never slips.

    `slider` starts at rest without a force; where it only sticks in the end, what is left depends
    on that.
    """
    from_rest = slider(stiffness, limit)

    def law(y, shapes):
        ((motion,), (high,), (low,)) = y, y.argmax(axis=1), y.argmin(axis=1)
        if stiffness * (motion[high] - motion[low]) >= 2 * limit:
            return from_rest(y, shapes)
        middle = (motion[high] + motion[low]) / 2
        moves = shapes - (shapes[:, [high]] + shapes[:, [low]]) / 2
        return stiffness * (y - middle), stiffness * moves[None]

    return law


class SampledBalance:
    """Balance of a case in all harmonics up to a ``highest``; sliders ``from_rest`` or centred."""

    def __init__(self, name: str, highest: int, samples: int, from_rest: bool = False):
        model = CASES[name]["model"]
        self.mass, self.damping, self.stiffness = (np.array(model[one], float) for one in "MCK")
        self.laws = [(np.array(e["w"], float), _law(e, from_rest)) for e in model["elements"]]
        components = [(n, s) for n in range(highest + 1) for s in ((0, 1) if n else (0,))]
        angle = 2 * np.pi * np.arange(samples) / samples
        self.shapes = np.array([(np.sin if s else np.cos)(n * angle) for n, s in components])
        scale = np.array([2 if n else 1 for n, _ in components]) / samples
        self.averages = scale[:, None] * self.shapes
        self.rate = np.zeros((len(components),) * 2)
        for k, (n, sine) in enumerate(components):
            if n:
                self.rate[k, k - 1 if sine else k + 1] = -n if sine else n
        self.force = np.zeros((len(self.mass), len(components)))
        self.force[:, 1] = model["force"]["1"]

    def equations(self, x: np.ndarray, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Residual (n,) and Jacobian (n, n) of coefficients, dof by dof."""
        linear = np.kron(self.stiffness, np.eye(len(self.rate)))
        linear = linear + omega * np.kron(self.damping, self.rate)
        jacobian = linear + omega**2 * np.kron(self.mass, self.rate @ self.rate)
        residual = jacobian @ x - self.force.ravel()
        for way, law in self.laws:
            motion = way @ x.reshape(self.force.shape) @ self.shapes
            (force,), (slope,) = law(motion[None], self.shapes)
            residual = residual + np.outer(way, self.averages @ force).ravel()
            jacobian = jacobian + np.kron(np.outer(way, way), self.averages @ slope.T)
        return residual, jacobian

    def near(self, x: np.ndarray, omega: float) -> np.ndarray:
        """The solution (n,) that Newton's method reaches from one; NaN where it reaches none."""
        for _ in range(40):
            step = np.linalg.solve(*self.equations(x, omega)[::-1])
            x = x - step * min(1.0, _LONGEST / np.abs(step).max())
            if np.abs(step).max() < 1e-12:
                return x
        return np.full_like(x, np.nan)


def _law(element: dict, from_rest: bool) -> Law:
    if element["kind"] == "cubic":
        return polynomial(0.0, element["stiffness"])
    if element["kind"] == "unilateral":
        return stop(element["stiffness"], element["gap"])
    return (slider if from_rest else centred)(element["stiffness"], element["limit"])
