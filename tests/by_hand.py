"""Responses of one harmonic by hand: describing functions and Newton's method, all in numpy.

Nothing here comes from the package. Responses of friction with damping are unique, so that a
solution at a frequency is the response, however it was found.
"""

import numpy as np

_STEPS = 200
_CONVERGED = 1e-11


class Structure:
    """``M x'' + C x' + K x`` and friction elements along the rows of ``directions``.

    Arrays as of the equation of motion; ``stiffness`` and ``limit`` (n_contacts,) of the elements;
    ``force`` (n_dof,) complex, the real part of ``force exp(i omega t)``.
    """

    def __init__(self, mass, damping, elastic, directions, stiffness, limit, force):
        self.mass, self.damping, self.elastic = map(np.asarray, (mass, damping, elastic))
        self.directions = np.asarray(directions, dtype=float)
        self.stiffness = np.asarray(stiffness, dtype=float)
        self.limit = np.asarray(limit, dtype=float)
        self.force = np.asarray(force, dtype=complex)

    def _balance(self, omega, x):
        """Residual (n, n_dof), complex, and its derivative by real and imaginary parts."""
        k, g, w = self.stiffness, self.limit, self.directions
        y = x @ w.T
        size = np.abs(y)
        slides = k * size > g
        a = np.where(slides, size, g / k * 2)
        angle = np.arccos(1 - 2 * g / (k * a))
        elastic = k * a / np.pi * (angle - np.sin(2 * angle) / 2)
        lost = 4 * g / np.pi * (1 - g / (k * a))
        by_a = k / np.pi * (angle - np.sin(2 * angle) / 2)
        by_a = by_a - k * a / np.pi * (1 - np.cos(2 * angle)) * 2 * g / (k * a**2 * np.sin(angle))
        radial = np.where(slides, by_a + 1j * 4 * g**2 / (np.pi * k * a**2), k)
        across = np.where(slides, (elastic + 1j * lost) / a, k + 0j)
        turn = np.where(size > 0, y / np.where(size > 0, size, 1), 1)
        dynamic = (
            self.elastic
            - omega[:, None, None] ** 2 * self.mass
            + 1j * omega[:, None, None] * self.damping
        )
        residual = np.einsum("fij,fj->fi", dynamic, x) + (across * y) @ w - self.force
        # Of the motion dy: along y by ``radial``, square to it by ``across``.
        columns = []
        for unit in (1.0, 1j):
            local = np.conj(turn) * unit
            change = turn * (radial * local.real + across * 1j * local.imag)
            columns.append(unit * dynamic + np.einsum("ci,fc,cj->fij", w, change, w))
        top, bottom = (
            np.concatenate([part(c) for c in columns], axis=2) for part in (np.real, np.imag)
        )
        return residual, np.concatenate([top, bottom], axis=1)

    def responses(self, omega):
        """Complex amplitudes (n, n_dof) at frequencies [rad/s]; all of them converged."""
        omega = np.asarray(omega, dtype=float)
        n = len(self.force)
        x = np.zeros((len(omega), n), dtype=complex)
        residual, jacobian = self._balance(omega, x)
        goal = _CONVERGED * np.abs(self.force).max()
        for _ in range(_STEPS):
            right = -np.concatenate([residual.real, residual.imag], axis=1)
            step = np.linalg.solve(jacobian, right[..., None])[..., 0]
            step = step[:, :n] + 1j * step[:, n:]
            norm, share = np.linalg.norm(residual, axis=1), np.ones(len(omega))
            before = x
            for _ in range(25):
                x = before + share[:, None] * step
                residual, jacobian = self._balance(omega, x)
                worse = np.linalg.norm(residual, axis=1) > (1 - 1e-4 * share) * norm
                worse &= norm > goal
                if not worse.any():
                    break
                share = np.where(worse, share / 2, share)
            if np.linalg.norm(residual, axis=1).max() <= goal:
                return x
        raise AssertionError("the responses by hand have not converged")

    def highest(self, low, high, count=300):
        """The largest amplitude of any degree of freedom in a band [Hz], and its frequency [Hz]."""
        grid = np.linspace(low, high, count)
        level = np.abs(self.responses(2 * np.pi * grid)).max(axis=1)
        best = float(level.max()), float(grid[np.argmax(level)])
        inside = np.flatnonzero((level[1:-1] >= level[:-2]) & (level[1:-1] >= level[2:])) + 1
        for i in inside[level[inside] > 0.8 * level.max()]:
            centre, width = grid[i], grid[1] - grid[0]
            for _ in range(9):
                near = np.linspace(centre - width, centre + width, 21)
                top = np.abs(self.responses(2 * np.pi * near)).max(axis=1)
                centre, width = near[np.argmax(top)], width / 8
                best = max(best, (float(top.max()), float(centre)))
        return best
