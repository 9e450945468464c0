"""Response of a mistuned ring by brute force: every frequency of a dense grid solved for.

Nothing here follows a path. The equations are written anew, for one harmonic in complex amplitudes
with the describing function of the slider, and solved for many frequencies at once. With constant
normal loads and positive damping the response at each frequency is unique, so any point where the
forces balance is the response.

Peaks are found by the slope of the largest amplitude over blades, by implicit differentiation at
each solution: where it changes from rising to falling between two neighbours of the grid there is
a maximum, which bisection closes in on.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

TWO_PI = 2 * np.pi
BALANCED = 1e-12
"""Largest residual over the largest sum of absolute force terms of one equation."""
SETTLED = 1e-9
"""Last Newton step relative to the response: quadratic convergence leaves round-off after it."""

BATCH = 512
"""Frequencies solved at once: their matrices fit the cache."""
CLOSE = 1e-11
"""Relative distance of the points on both sides of a change, a hundred times round-off."""
TIE = 1e-10
"""Amplitudes this close, relatively, lead together: on a tuned ring round-off tells them apart."""


@dataclass(frozen=True)
class Points:
    """Solutions at frequencies ``hz`` (n,), the first axis of all arrays.

    ``unknowns``; ``level``, the largest amplitude over blades [m]; ``slope``, its derivative by
    the frequency [m/Hz]; ``leader``, the blade it belongs to; ``slip`` (n, n_contacts).
    """

    hz: np.ndarray
    unknowns: np.ndarray
    level: np.ndarray
    slope: np.ndarray
    leader: np.ndarray
    slip: np.ndarray

    def __getitem__(self, index) -> "Points":
        return Points(*(getattr(self, f.name)[index] for f in fields(self)))

    def merged(self, other: "Points") -> "Points":
        """Both sets in the order of frequency, each frequency once."""
        both = _joined([self, other])
        return both[np.unique(both.hz, return_index=True)[1]]


def _joined(parts: list[Points]) -> Points:
    return Points(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Points)))


class Top(NamedTuple):
    """A maximum: place, height, kind and height above the higher of the valleys, relatively."""

    hz: float
    level: float
    kind: str
    prominence: float


class Ring:
    """A ring of blades, contact j between blades j and j + 1, under a unit engine order.

    One harmonic, in complex amplitudes ``x_i = Re(X_i exp(i tau))``: the force of a contact with
    the amplitude ``A`` is its describing function ``D(A)`` times the complex relative amplitude.
    Unknowns ``x`` (n, 2 N), real and imaginary parts in turn, at angular frequencies ``omega``
    (n,), all at once.
    """

    def __init__(self, contact_stiffness, slip_limit, engine_order, mass, damping, stiffness):
        self.stiff = np.asarray(contact_stiffness, dtype=float)
        self.limit = np.asarray(slip_limit, dtype=float)
        self.mass, self.damping, self.stiffness = mass, damping, stiffness
        self.size = len(self.stiff)
        self.lag = TWO_PI * engine_order * np.arange(self.size) / self.size

    def contact(self, amplitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Describing function and its derivative by the amplitude, (n, N) complex."""
        k, g = self.stiff, self.limit
        slips = k * amplitude > g
        a = np.where(slips, amplitude, 1.0)
        r = np.where(slips, g / (k * a), 0.5)
        t = np.arccos(1 - 2 * r)
        cosine = k / np.pi * (t - np.sin(2 * t) / 2)
        sine = -4 * k / np.pi * r * (1 - r)
        by_cosine = -4 * k / np.pi * r * np.sin(t) / a
        by_sine = 4 * k / np.pi * r * (1 - 2 * r) / a
        value = np.where(slips, cosine - 1j * sine, k + 0j)
        return value, np.where(slips, by_cosine - 1j * by_sine, 0.0)

    def balance(self, x: np.ndarray, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual (n, 2 N) and its norm (n,), see `BALANCED`."""
        x, w = x.view(complex), omega[:, None]
        y = x - np.roll(x, -1, axis=1)
        friction = self.contact(np.abs(y))[0] * y
        dynamic = self.stiffness - w**2 * self.mass + 1j * w * self.damping
        residual = dynamic * x + friction - np.roll(friction, 1, axis=1) - np.exp(-1j * self.lag)
        terms = (self.stiffness + w**2 * self.mass + w * self.damping) * np.abs(x)
        terms = terms + np.abs(friction) + np.abs(np.roll(friction, 1, axis=1)) + 1.0
        return residual.view(float), np.abs(residual).max(axis=1) / terms.max(axis=1)

    def jacobian(self, x: np.ndarray, omega: np.ndarray) -> np.ndarray:
        """Derivative of the residual, (n, 2 N, 2 N)."""
        x, w = x.view(complex), omega[:, None]
        y = x - np.roll(x, -1, axis=1)
        amplitude = np.abs(y)
        value, by_amplitude = self.contact(amplitude)
        unit = y / np.where(amplitude > 0, amplitude, 1.0)
        turn = by_amplitude * y
        contacts = np.empty((*y.shape, 2, 2))
        contacts[..., 0, 0] = value.real + turn.real * unit.real
        contacts[..., 0, 1] = -value.imag + turn.real * unit.imag
        contacts[..., 1, 0] = value.imag + turn.imag * unit.real
        contacts[..., 1, 1] = value.real + turn.imag * unit.imag
        own = np.empty((len(x), 1, 2, 2))
        own[..., 0, 0] = own[..., 1, 1] = self.stiffness - w**2 * self.mass
        own[..., 1, 0] = w * self.damping
        own[..., 0, 1] = -own[..., 1, 0]
        return self._assembled(own, contacts)

    def by_omega(self, x: np.ndarray, omega: np.ndarray) -> np.ndarray:
        """Derivative of the residual by the angular frequency, (n, 2 N)."""
        factor = -2 * omega[:, None] * self.mass + 1j * self.damping
        return (factor * x.view(complex)).view(float)

    def largest(self, x: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes of all blades and their derivatives for a ``change`` of x, (n, N) each."""
        x, change = x.view(complex), change.view(complex)
        amplitude = np.abs(x)
        return amplitude, (x.conj() * change).real / amplitude

    def slips(self, x: np.ndarray) -> np.ndarray:
        """Which contacts slip, (n, N)."""
        x = x.view(complex)
        return self.stiff * np.abs(x - np.roll(x, -1, axis=1)) > self.limit

    def solve(self, hz: np.ndarray, start: np.ndarray | None = None) -> Points:
        """Solutions at all frequencies, from ``start`` (n, n_unknowns) or no motion."""
        if start is None:
            # Without motion all contacts stick: the first Newton step is the linear response.
            start = np.zeros((len(hz), 2 * self.size))
        hz, x = np.asarray(hz, dtype=float), start.copy()
        for i in range(0, len(hz), BATCH):
            x[i : i + BATCH] = self._newton(hz[i : i + BATCH], x[i : i + BATCH])
        unsolved = np.isnan(x).any(axis=1)
        assert not unsolved.all()
        while unsolved.any():
            # The one next to a solution first, so that the steps are short.
            away = np.abs(hz[unsolved, None] - hz[~unsolved])
            one, other = np.unravel_index(away.argmin(), away.shape)
            i, near = np.flatnonzero(unsolved)[one], np.flatnonzero(~unsolved)[other]
            x[i] = self._approach(hz[near], x[near], hz[i])
            unsolved[i] = False
        parts = [
            self._describe(hz[i : i + BATCH], x[i : i + BATCH]) for i in range(0, len(hz), BATCH)
        ]
        return _joined(parts)

    def _approach(self, hz: float, x: np.ndarray, target: float) -> np.ndarray:
        """Solution where Newton's method stalled on a corner, in steps from another frequency."""
        step = target - hz
        while hz != target:
            ahead = target if abs(step) >= abs(target - hz) else hz + step
            assert ahead != hz, f"no balance at {target} Hz"
            found = self._newton(np.array([ahead]), x[None])[0]
            if np.isnan(found).any():
                step /= 2
            else:
                hz, x = ahead, found
        return x

    def _newton(self, hz: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Solutions (n, n_unknowns), NaN where the iteration stalls."""
        omega, x = TWO_PI * hz, start.copy()
        todo, settled = np.arange(len(omega)), np.full(len(omega), np.inf)
        for _ in range(40):
            residual, norm = self.balance(x[todo], omega[todo])
            left = (norm > BALANCED) | (settled[todo] > SETTLED)
            todo, residual = todo[left], residual[left]
            if not len(todo):
                break
            trial, w = x[todo], omega[todo]
            step = _solved(self.jacobian(trial, w), -residual)
            merit = np.linalg.norm(residual, axis=1)
            length = np.ones(len(todo))
            short = np.arange(len(todo))
            for _ in range(30):
                after, norm = self.balance(
                    trial[short] + length[short, None] * step[short], w[short]
                )
                fell = np.linalg.norm(after, axis=1) < (1 - 1e-4 * length[short]) * merit[short]
                short = short[~fell & (norm > BALANCED)]
                if not len(short):
                    break
                length[short] /= 2
            x[todo] = trial + length[:, None] * step
            settled[todo] = np.linalg.norm(step, axis=1) / np.linalg.norm(x[todo], axis=1)
        x[todo] = np.nan
        return x

    def _describe(self, hz: np.ndarray, x: np.ndarray) -> Points:
        omega = TWO_PI * hz
        assert np.all(self.balance(x, omega)[1] <= BALANCED)
        change = _solved(self.jacobian(x, omega), -self.by_omega(x, omega))
        level, slope = self.largest(x, change)
        rows, top = np.arange(len(x)), level.max(axis=1)
        leader = (level >= (1 - TIE) * top[:, None]).argmax(axis=1)
        slope = TWO_PI * slope[rows, leader]
        return Points(hz, x, top, slope, leader, self.slips(x))

    def _assembled(self, own: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """Jacobian from that of the blades (n, 1, 2, 2) and of the contacts (n, N, 2, 2)."""
        n, size = len(own), self.size
        matrix = np.zeros((n, size, size, 2, 2))
        here = np.arange(size)
        there = (here + 1) % size
        matrix[:, here, here] += own
        matrix[:, here, here] += contacts
        matrix[:, there, there] += contacts
        matrix[:, here, there] -= contacts
        matrix[:, there, here] -= contacts
        return matrix.transpose(0, 1, 3, 2, 4).reshape(n, 2 * size, 2 * size)


def _solved(jacobian: np.ndarray, right: np.ndarray) -> np.ndarray:
    return np.linalg.solve(jacobian, right[..., None])[..., 0]


def scan(
    ring: Ring,
    band: tuple[float, float],
    spacing: float = 0.005,
    fine: float = 0.0005,
    near: float = 0.05,
) -> Points:
    """Solve on a grid over ``band``, finer near maxima and wherever a maximum may hide.

    The grid is halved from a coarse one, each solution the start of its neighbours'. It is
    ``fine`` within ``near`` of maxima and minima. Wherever a contact changes its state or the lead
    changes between two neighbours, the change is closed in on: the amplitude turns there within
    1e-6 Hz and less, too little for any grid. Between the changes it is smooth.
    """
    first, last = band
    cells = int(np.ceil((last - first) / spacing))
    halvings = max(int(np.log2(cells)) - 8, 0)
    coarse = 2**halvings
    hz = np.linspace(first, last, coarse * int(np.ceil(cells / coarse)) + 1)
    points = ring.solve(hz[::coarse])
    for _ in range(halvings):
        coarse //= 2
        points = _denser(ring, points, hz[coarse :: 2 * coarse])
    points = _fined(ring, points, _changes(points[:-1], points[1:]), fine, hz[1] - hz[0])
    points = _bracketed(ring, points)
    extremes = (points.slope[1:] > 0) != (points.slope[:-1] > 0)
    return _fined(ring, points, extremes, fine, near)


def _changes(left: Points, right: Points) -> np.ndarray:
    return (left.slip != right.slip).any(axis=1) | (left.leader != right.leader)


def _bracketed(ring: Ring, points: Points) -> Points:
    """Points next to every change, on both sides."""
    at = np.flatnonzero(_changes(points[:-1], points[1:]))
    low, high = points[at], points[at + 1]
    while len(low.hz):
        middle = ring.solve(0.5 * (low.hz + high.hz), 0.5 * (low.unknowns + high.unknowns))
        points = points.merged(middle)
        halves = [(low, middle), (middle, high)]
        low, high = (_joined([half[i] for half in halves]) for i in (0, 1))
        open_ = _changes(low, high) & (high.hz - low.hz > CLOSE * high.hz)
        low, high = low[open_], high[open_]
    return points


def _fined(ring: Ring, points: Points, cells: np.ndarray, fine: float, near: float) -> Points:
    """Points every ``fine`` within ``near`` [Hz] of the middles of ``cells`` of the grid."""
    first, last = points.hz[[0, -1]]
    centres = 0.5 * (points.hz[1:] + points.hz[:-1])[cells]
    number = np.arange(1, round((last - first) / fine))
    grid = first + fine * number
    if not len(centres):
        return points
    right = np.minimum(np.searchsorted(centres, grid), len(centres) - 1)
    away = np.minimum(
        np.abs(grid - centres[right]), np.abs(grid - centres[np.maximum(right - 1, 0)])
    )
    return _denser(ring, points, np.setdiff1d(grid[away <= near], points.hz))


def _denser(ring: Ring, points: Points, hz: np.ndarray) -> Points:
    if not len(hz):
        return points
    return points.merged(ring.solve(hz, _between(points, hz)))


def _between(points: Points, hz: np.ndarray) -> np.ndarray:
    """Unknowns interpolated linearly over the frequency."""
    right = np.clip(np.searchsorted(points.hz, hz), 1, len(points.hz) - 1)
    low, high = points.hz[right - 1], points.hz[right]
    share = ((hz - low) / (high - low))[:, None]
    return (1 - share) * points.unknowns[right - 1] + share * points.unknowns[right]


def tops(ring: Ring, points: Points) -> list[Top]:
    """Every maximum strictly inside a scan, closed in on by bisection of the slope."""
    left = np.flatnonzero((points.slope[:-1] > 0) & (points.slope[1:] <= 0))
    if not len(left):
        return []
    low, high = points[left], points[left + 1]
    # From 0.005 Hz to round-off of the frequency.
    for _ in range(40):
        middle = 0.5 * (low.hz + high.hz)
        if np.all((middle == low.hz) | (middle == high.hz)):
            break
        found = ring.solve(middle, 0.5 * (low.unknowns + high.unknowns))
        rises = found.slope > 0
        low = _where(rises, found, low)
        high = _where(rises, high, found)
    best = _where(low.level > high.level, low, high)
    kinds = _kinds(ring, best)
    return [
        Top(float(hz), float(level), kind, _prominence(points, hz, level))
        for hz, level, kind in zip(best.hz, best.level, kinds, strict=True)
    ]


def _where(condition: np.ndarray, one: Points, other: Points) -> Points:
    columns = []
    for f in fields(one):
        a, b = getattr(one, f.name), getattr(other, f.name)
        columns.append(np.where(condition.reshape(-1, *(1,) * (a.ndim - 1)), a, b))
    return Points(*columns)


def _kinds(ring: Ring, at: Points) -> list[str]:
    """By the slopes on both sides, at two distances of which one is a tenth of the other.

    A smooth maximum falls by the square of the distance: its slope shrinks to a tenth. At a corner
    the slope stays, up to a change by the root of the distance next to an onset of slip.
    """
    near, far = (
        [np.abs(ring.solve(at.hz * (1 + side * distance), at.unknowns).slope) for side in (-1, 1)]
        for distance in (1e-9, 1e-8)
    )
    kept = np.array(near) / np.array(far)
    smooth, corner = np.all(kept < 0.2, axis=0), np.all(kept > 0.5, axis=0)
    return [
        "smooth" if is_smooth else "corner" if is_corner else f"unclear, slopes kept {share}"
        for is_smooth, is_corner, share in zip(smooth, corner, kept.T, strict=True)
    ]


def _prominence(points: Points, hz: float, level: float) -> float:
    """Height over the higher of the two valleys beside a maximum, relative to the maximum."""
    valleys = []
    for side in (points.level[points.hz < hz][::-1], points.level[points.hz > hz]):
        above = np.flatnonzero(side > level)
        part = side[: above[0]] if len(above) else side
        valleys.append(part.min() if len(part) else level)
    return float(1 - max(valleys) / level)
