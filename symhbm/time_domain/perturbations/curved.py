"""Small perturbations of a motion beside smooth laws, from event to event of its contacts.

A given motion determines the angles at which its contacts begin to stick and to slip, and the
stiffness of its smooth laws. Acceleration is continuous at all events: of a small
perturbation nothing jumps but the friction force of a contact that begins to slip, which becomes
constant. Between events the power series of the perturbation is summed to round-off, so that the
only error is that of the given motion. Beside forces that are no polynomials of the displacement it
is integrated from break point to break point, to a tolerance of 1e-11.
"""

import math
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.model.contacts import MemorylessLaw, Motions, PolynomialLaw
from symhbm.numerics import FloatArray
from symhbm.time_domain.active_contacts import STICK, ActiveContacts
from symhbm.time_domain.integrated_motion import SmoothForces
from symhbm.time_domain.perturbations.sliders import SLIP, Stretches

_DIGITS = 37.0
"""Digits of a series, as a natural logarithm."""
_GROWTH = 12.0
"""Logarithm of the growth over the disk around a cell, whose radius is three cells."""
_MOST_WORK = 3e8
"""Cells times the cube of the size of the state: a second."""
_TOLERANCE = 1e-11
"""Error of a step of the integrator over the perturbation."""
_BESIDE = 1e-11
"""Distance [rad] from a break point at which the slopes beside it are taken."""
_LEAST_CUBE = 3e4
"""Work of a cell that does not depend on the size of the state."""


def along_curved(
    problem: HarmonicBalance, frequency: float, unknowns: FloatArray, length: float
) -> tuple[FloatArray, FloatArray]:
    """The map of perturbations over a ``length`` [rad] from ``tau = 0``, and the drift there.

    States are displacement, its derivative by ``tau`` and the friction forces of contacts that
    slip, (n_state,). Raises ArithmeticError for a structure too stiff and too large, and for laws
    that are neither smooth nor sliders.
    """
    contacts = ActiveContacts(problem.model, frequency)
    breaks = _breaks(problem, frequency, problem.layout.relative(unknowns))
    found = Stretches.of(problem, contacts, unknowns, length, breaks)
    motion = _Perturbation(problem, frequency, unknowns, contacts, found.slipped)
    size, edges = len(found.kept), found.edges
    if (edges[-1] / motion.longest_cell) * (size**3 + _LEAST_CUBE) > _MOST_WORK:
        raise ArithmeticError("a structure too stiff and too large to follow its oscillations")
    variation, sticks = np.eye(size), found.states[:, found.slipped] == STICK
    for left, right, stick in zip(edges[:-1], edges[1:], sticks, strict=True):
        variation = motion.carry(variation, left, right, stick)
    return variation, found.drift[found.kept]


class _Perturbation:
    """Linear equations, by the angle, of a small perturbation of a given motion.

    ``unknowns`` (n_unknowns,) are the given motion [m]; ``contacts`` that have not ``slipped``
    (n_active,) are springs, the others stick at times. A series converges as on a disk of complex
    angles: by Cauchy's estimate its terms fall by the radius of the disk over the length of the
    cell, from the growth of the motion in the disk.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        frequency: float,
        unknowns: FloatArray,
        contacts: ActiveContacts,
        slipped: NDArray[np.bool_],
    ):
        model, relative = problem.model, problem.layout.relative(unknowns)
        self.n_dof, inertia = model.n_dof, contacts.inertia
        directions = model.directions.toarray()
        stiffness = inertia.stiffness + contacts.springs(np.where(slipped, SLIP, STICK))
        pushed, bent, waves = _stiffening(problem, frequency, relative)

        def accelerations(forces: FloatArray) -> FloatArray:
            return inertia.accelerations(forces) / frequency**2

        self._smooth = SmoothForces(problem, frequency, accelerations)
        self._basis, self._motion = problem.basis, problem.layout.coefficients(unknowns)
        laws: list[Any] = [group.law for group in self._smooth.groups]
        self._integrates = not all(isinstance(law, PolynomialLaw) for law in laws)
        every_stuck = np.full(len(slipped), STICK)
        self.spring, self.bent = contacts.friction_slopes(every_stuck)[slipped], directions[bent]
        self.elastic = accelerations(stiffness)
        self.push = accelerations(contacts.directions[slipped].T)
        self.bend = accelerations(directions[pushed].T)
        self.viscous = frequency * accelerations(inertia.damping)
        self.order = np.arange(waves.shape[1])
        self.waves = np.where(self.order == 0, 1, 2) * waves

        linear = inertia.norm(inertia.stiffness + contacts.springs(every_stuck))
        both = np.concatenate([directions[pushed], self.bent])
        rates = linear, inertia.norm(both.T @ both) / 2, inertia.viscous_rate
        self._set_growth(frequency, *rates)

    def _set_growth(self, frequency: float, linear: float, bent: float, damping: float) -> None:
        """Bound the growth on disks: the generator has the norm of its frequencies."""
        slowest = max((np.sqrt(linear) + damping) / frequency, 1.0)
        self.radius = np.geomspace(0.01, 100, 120) / slowest
        # Disks where waves grow more than that are too large anyway.
        wave = np.exp(np.minimum(np.multiply.outer(self.order, self.radius), 50))
        cubic = bent * (np.abs(self.waves) @ wave).max(axis=0, initial=0.0)
        self.growth = self.radius * (np.sqrt(linear + cubic) + damping) / frequency
        self.longest_cell = float(np.interp(_GROWTH, self.growth, self.radius)) / 3

    def carry(
        self, variation: FloatArray, left: float, right: float, stick: np.ndarray
    ) -> FloatArray:
        """The variation (2 n_dof + n_slipping, n) after an interval without an event."""
        if self._integrates:
            return self._integrated(variation, left, right, stick)
        n_cells = math.ceil((right - left) / self.longest_cell)
        width = (right - left) / n_cells
        for i in range(n_cells):
            variation = self._cell(variation, left + i * width, width, stick)
        return variation

    def _integrated(
        self, variation: FloatArray, left: float, right: float, stick: np.ndarray
    ) -> FloatArray:
        """The variation after an interval without an event, by an integrator."""
        n, spring, push = self.n_dof, self.spring[stick], self.push[:, stick]
        offset = variation[2 * n :][stick] - spring @ variation[:n]
        held, inside = self.elastic + push @ spring, min(_BESIDE, (right - left) / 4)

        def rates(tau: float, state: FloatArray) -> FloatArray:
            x, slope = state.reshape(2, n, -1)
            at = min(max(tau, left + inside), right - inside)
            moved, rate = ((self._motion @ self._basis.values(at, d))[None] for d in (0, 1))
            _, elastic, viscous = self._smooth.at(moved, rate)
            force = (held + elastic[0]) @ x + (self.viscous + viscous[0]) @ slope + push @ offset
            return np.concatenate([slope, -force], axis=None)

        found = scipy.integrate.solve_ivp(
            rates,
            (left, right),
            variation[: 2 * n].ravel(),
            "DOP853",
            t_eval=[right],
            rtol=_TOLERANCE,
            atol=_TOLERANCE * max(np.abs(variation).max(), 1e-3),
        )
        if not found.success:
            raise ArithmeticError("the perturbation cannot be integrated")
        result = np.zeros_like(variation)
        result[: 2 * n] = found.y[:, -1].reshape(2 * n, -1)
        result[2 * n :][stick] = offset + spring @ result[:n]
        return result

    def _cell(
        self, variation: FloatArray, start: float, width: float, stick: np.ndarray
    ) -> FloatArray:
        """The variation after a cell; a contact that slips has no variation of its force."""
        n, spring, push = self.n_dof, self.spring[stick], self.push[:, stick]
        series = self._series_start(variation, width)
        count, columns = len(series), variation.shape[1]
        factorial = np.cumprod(np.maximum(np.arange(count), 1.0))
        law = np.hstack([self.elastic + push @ spring, self.viscous / width]) * -(width**2)
        offset = variation[2 * n :][stick] - spring @ variation[:n]
        stiffening = self._stiffening(start, width, count)
        travel = np.empty((count, len(self.bent), columns))
        # Derivatives times powers of the width.
        for k in range(count - 2):
            series[k + 2] = law @ series[k : k + 2].reshape(2 * n, columns)
            if k == 0:
                series[2] -= width**2 * push @ offset
            if len(self.bent):
                travel[k] = self.bent @ series[k] / factorial[k]
                force = np.einsum("kc,kcm->cm", stiffening[k::-1], travel[: k + 1])
                series[k + 2] -= width**2 * factorial[k] * self.bend @ force
        ends = np.array([1 / factorial, np.arange(count) / factorial / width])
        result = np.zeros_like(variation)
        result[: 2 * n] = (ends @ series.reshape(count, -1)).reshape(2 * n, columns)
        result[2 * n :][stick] = offset + spring @ result[:n]
        return result

    def _series_start(self, variation: FloatArray, width: float) -> FloatArray:
        """Array for all derivatives of the series, (n_terms, n_dof, n), the first two filled in."""
        wide = self.radius > width
        needed = (self.growth[wide] + _DIGITS) / np.log(self.radius[wide] / width)
        series = np.empty((2 + math.ceil(needed.min()), self.n_dof, variation.shape[1]))
        series[0] = variation[: self.n_dof]
        series[1] = width * variation[self.n_dof : 2 * self.n_dof]
        return series

    def _stiffening(self, start: float, width: float, count: int) -> FloatArray:
        """Stiffness of smooth laws as powers of the share of a cell, (count, n_pairs) [N/m]."""
        first = np.exp(1j * self.order * start)
        factor = 1j * width * self.order / np.arange(1, count)[:, None]
        return (np.cumprod(np.vstack([first, factor]), axis=0) @ self.waves.T).real


def _breaks(problem: HarmonicBalance, frequency: float, relative: FloatArray) -> FloatArray:
    """Angles at which the slopes of smooth contacts jump [rad]."""
    result = [np.zeros(0)]
    for group in problem.curved_groups:
        assert isinstance(group.law, MemorylessLaw)
        motion = relative[group.rows.ravel()].reshape(group.n, -1)
        values = group.values
        result += group.law.breaks(Motions(problem.basis, motion, frequency, values))
    return np.concatenate(result)


def _stiffening(
    problem: HarmonicBalance, frequency: float, relative: FloatArray
) -> tuple[np.ndarray, np.ndarray, NDArray[np.complex128]]:
    """Pairs of rows of smooth contacts, and the waves of the stiffness between them along a motion.

    The row that is pushed and the one whose travel pushes, (n_pairs,), and (n_pairs, n_waves)
    [N/m]; of polynomials alone.
    """
    basis, laws = problem.basis, [(group, group.law) for group in problem.curved_groups]
    polynomials = [(group, law) for group, law in laws if isinstance(law, PolynomialLaw)]
    degree = max([1, *(law.degree for _, law in polynomials)])
    # More samples than twice the harmonics of the stiffness.
    count = 2 * (degree - 1) * basis.highest + 1
    at_sample = basis.values(2 * np.pi * np.arange(count) / count)
    pushed, bent = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)]
    waves = [np.zeros((0, count // 2 + 1), dtype=complex)]
    for group, law in polynomials:
        n, m = group.rows.shape
        values = group.values
        instants = relative[group.rows.ravel()] @ at_sample.T
        instants = instants.reshape(n, m, count).transpose(2, 0, 1).reshape(count * n, m)
        along = {name: np.tile(value, count) for name, value in values.items()}
        slope = law.at_instants(instants, 0 * instants, frequency, along).by_displacement
        pairs = slope.reshape(count, n * m * m).T
        waves.append(np.fft.rfft(pairs) / count)
        pushed.append(np.repeat(group.rows, m, axis=1).ravel())
        bent.append(np.tile(group.rows, (1, m)).ravel())
    return np.concatenate(pushed), np.concatenate(bent), np.concatenate(waves)
