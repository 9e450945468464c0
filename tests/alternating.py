"""Free motions by alternating between frequency and time over samples: no path and no events.

The same equations as those of nonlinear modes, harmonic balance of
``M x'' + (C - 2 D omega M) x' + K x + d f(d x) = 0``, solved by Newton's method from many random
starts at once. What it finds depends on no neighbouring solution.
"""

from collections.abc import Callable, Sequence

import numpy as np

Law = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Force (B, N) of displacements (B, N), and its slope (B, c, N) by the coefficients of shapes."""


def polynomial(square: float, cube: float) -> Law:
    return lambda y, shapes: (
        square * y**2 + cube * y**3,
        (2 * square * y + 3 * cube * y**2)[:, None] * shapes,
    )


def stop(stiffness: float, gap: float) -> Law:
    return lambda y, shapes: (
        stiffness * np.maximum(y - gap, 0),
        stiffness * (y > gap)[:, None] * shapes,
    )


def slider(stiffness: float, limit: float) -> Law:
    """A spring in series with a slider, marched over two periods."""

    def law(y, shapes):
        n, force, slope = y.shape[1], np.empty(y.shape), np.empty((len(y), *shapes.shape))
        place, moves = np.zeros(len(y)), np.zeros((len(y), len(shapes)))
        for i in [*range(n)] * 2:
            spring = stiffness * (y[:, i] - place)
            slips = np.abs(spring) > limit
            place = np.where(slips, y[:, i] - np.sign(spring) * limit / stiffness, place)
            moves = np.where(slips[:, None], shapes[:, i], moves)
            force[:, i] = stiffness * (y[:, i] - place)
            slope[:, :, i] = stiffness * (shapes[:, i] - moves)
        return force, slope

    return law


class FreeMotions:
    """Free motions of a structure with one law of force along one degree of freedom ``at``."""

    def __init__(
        self, mass, damping, stiffness, at: int, law: Law, harmonics: Sequence[int], samples: int
    ):
        self.n, self.law, self.direction = len(mass), law, np.eye(len(mass))[at]
        components = [(n, sine) for n in harmonics for sine in ((False, True) if n else (False,))]
        self.first, self.c = components.index((1, False)), len(components)
        angle = 2 * np.pi * np.arange(samples) / samples
        self.shapes = np.array([(np.sin if s else np.cos)(n * angle) for n, s in components])
        scale = np.array([2 if n else 1 for n, _ in components]) / samples
        self.averages = scale[:, None] * self.shapes
        rate = np.zeros((self.c, self.c))
        for k, (n, sine) in enumerate(components):
            if n:
                rate[k, k - 1 if sine else k + 1] = -n if sine else n
        self.stiffness = np.kron(stiffness, np.eye(self.c))
        self.damping, self.momentum = (np.kron(m, rate) for m in (damping, mass))
        self.inertia = np.kron(mass, rate @ rate)

    def equations(self, unknowns, amplitude: float, dof: int):
        """Residuals (B, n) and Jacobians (B, n, n): of coefficients, frequency, damping ratio."""
        size = self.n * self.c
        x, omega, ratio = unknowns[:, :size], unknowns[:, size, None], unknowns[:, size + 1, None]
        terms = [x @ m.T for m in (self.stiffness, self.damping, self.inertia, self.momentum)]
        y = np.einsum("d,bdc->bc", self.direction, x.reshape(-1, self.n, self.c)) @ self.shapes
        force, slope = self.law(y, self.shapes)
        residual, jacobian = np.zeros((len(x), size + 2)), np.zeros((len(x), size + 2, size + 2))
        linear = terms[0] + omega * terms[1] + omega**2 * (terms[2] - 2 * ratio * terms[3])
        contact = np.einsum("d,bc->bdc", self.direction, force @ self.averages.T)
        residual[:, :size] = linear + contact.reshape(-1, size)
        w, d = omega[:, :, None], ratio[:, :, None]
        of_law = np.einsum("kn,bcn->bkc", self.averages, slope)
        both = np.outer(self.direction, self.direction)
        jacobian[:, :size, :size] = (
            self.stiffness + w * self.damping + w**2 * (self.inertia - 2 * d * self.momentum)
        ) + np.einsum("de,bkc->bdkec", both, of_law).reshape(-1, size, size)
        jacobian[:, :size, size] = terms[1] + 2 * omega * (terms[2] - 2 * ratio * terms[3])
        jacobian[:, :size, size + 1] = -2 * omega**2 * terms[3]
        cosine, unit = dof * self.c + self.first, np.abs(self.stiffness).max()
        residual[:, size] = unit * (x[:, cosine] - amplitude)
        residual[:, size + 1] = unit * x[:, cosine + 1]
        jacobian[:, size, cosine] = jacobian[:, size + 1, cosine + 1] = unit
        return residual, jacobian

    def starts(self, amplitude: float, dof: int, frequencies: tuple[float, float], number: int):
        """Random starts: harmonics and degrees of freedom of sizes from small to large ones."""
        rng, size = np.random.default_rng(0), self.n * self.c
        unknowns = np.zeros((number, size + 2))
        spread = 10 ** rng.uniform(-2, 1, (number, size))
        unknowns[:, :size] = amplitude * rng.uniform(-1, 1, (number, size)) * spread
        cosine = dof * self.c + self.first
        unknowns[:, cosine], unknowns[:, cosine + 1] = amplitude, 0.0
        unknowns[:, size] = rng.uniform(*frequencies, number)
        return unknowns

    def found(self, amplitude: float, dof: int, starts, steps: int = 50) -> np.ndarray:
        """Coefficients, frequency and damping ratio of all different motions, by the frequency."""
        u, size = starts.copy(), self.n * self.c
        scale = np.concatenate([np.full(size, amplitude), [starts[:, size].mean(), 1e-2]])
        for _ in range(steps):
            residual, jacobian = self.equations(u, amplitude, dof)
            jacobian = jacobian * scale + 1e-14 * np.abs(jacobian).max() * np.eye(size + 2)
            step = np.linalg.solve(jacobian, -residual[..., None])[..., 0]
            largest = np.maximum(np.abs(u[:, :size]).max(1) / amplitude, 1.0)
            share = 0.7 * largest / np.maximum(np.abs(step[:, :size]).max(1), 1e-300)
            share = np.minimum(share, 0.1 / np.maximum(np.abs(step[:, size]), 1e-300))
            u = u + np.minimum(share, 1.0)[:, None] * step * scale
            u = u[np.isfinite(u).all(1) & (np.abs(u) < 1e5).all(1)]
        residual, _ = self.equations(u, amplitude, dof)
        unit = np.abs(self.stiffness).max() * amplitude
        u = u[(np.abs(residual).max(1) < 1e-9 * unit) & (u[:, size] > 0)]
        different: list[np.ndarray] = []
        for motion in u[np.argsort(u[:, size])]:
            if all(np.abs((motion - known) / scale).max() > 1e-6 for known in different):
                different.append(motion)
        return np.array(different).reshape(-1, size + 2)
