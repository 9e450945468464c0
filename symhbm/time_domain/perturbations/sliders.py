"""Small perturbations of a motion whose contacts are sliders under constant loads.

A given motion determines where its contacts stick and slip. In between a perturbation is a linear
motion without a force, whose matrices do not depend on the frequency: its modes are known once for
each state of the contacts. Acceleration is continuous at all events, so that nothing jumps there
but friction forces, see `symhbm.time_domain.event_march`. The only error is that of the given
motion.
"""

from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.model import Structure
from symhbm.model.contacts import stick_intervals
from symhbm.numerics import FloatArray
from symhbm.time_domain.active_contacts import STICK, ActiveContacts

SLIP = 1.0
"""State of a contact that slips, in either direction: under a constant load they are alike."""
_MOST_WORK = 1e9
"""Stretches times the cube of the size of the state: seconds."""
_KEPT_NUMBERS = 3e7
"""Most numbers in the modes that are kept for the next motion."""
_CONDITION = 1e6
"""Condition of the eigenvectors of a state above which the exponential is taken without them."""
_SMALL = 1e-8
"""Exponents whose ``(exp(z) - 1) / z`` is 1."""
_INSTANT = 1e-13
"""Distance of events [rad] below which they share one instant."""


class _Modes(NamedTuple):
    """Perturbations in one state of the contacts.

    The ``generator`` (2 n_dof, 2 n_dof) [1/s], its eigenvalues and eigenvectors with their inverse,
    whether these are well conditioned, and the derivative of the friction forces by displacement
    (n_active, n_dof).
    """

    generator: FloatArray
    values: NDArray[np.complex128]
    vectors: NDArray[np.complex128]
    inverse: NDArray[np.complex128]
    regular: bool
    friction_slopes: FloatArray


class _Perturbations(ActiveContacts):
    """Linear equations of perturbations in each state of the contacts.

    States are displacement, velocity over the angular frequency ``unit`` [rad/s], which makes both
    one size, and friction forces.
    """

    def __init__(self, model: Structure, frequency: float):
        super().__init__(model, frequency)
        inertia = self.inertia
        self._elastic, self._viscous = inertia.by_stiffness, inertia.accelerations(inertia.damping)
        self._push = inertia.accelerations(self.directions.T)
        stuck = self._stiffness(np.full(len(self.active), STICK))
        self.unit = np.sqrt(np.linalg.norm(stuck, 2))
        self._modes: dict[bytes, _Modes] = {}

    def _stiffness(self, state: FloatArray) -> FloatArray:
        """Acceleration by displacement, (n_dof, n_dof) [1/s^2]."""
        return self._elastic + self._push @ self.friction_slopes(state)

    def modes(self, state: FloatArray) -> _Modes:
        """Those in a ``state`` (n_active,) of the contacts."""
        key = state.tobytes()
        # Held here: another thread may clear what is kept.
        found = self._modes.get(key)
        if found is None:
            # A generator, its eigenvectors and their inverse.
            if len(self._modes) * 5 * (2 * self.n_dof) ** 2 > _KEPT_NUMBERS:
                self._modes.clear()
            n, unit = self.n_dof, self.unit
            parts = [[np.zeros((n, n)), unit * np.eye(n)]]
            parts.append([-self._stiffness(state) / unit, -self._viscous])
            generator = np.block(parts)
            values, vectors = (part.astype(complex) for part in np.linalg.eig(generator))
            regular = bool(np.linalg.cond(vectors) < _CONDITION)
            inverse = np.linalg.inv(vectors).astype(complex) if regular else vectors
            slopes = self.friction_slopes(state)
            found = _Modes(generator, values, vectors, inverse, regular, slopes)
            self._modes[key] = found
        return found

    def maps(self, state: FloatArray, times: FloatArray) -> FloatArray:
        """States after ``times`` (n,) [s] by those before, (n, n_state, n_state)."""
        n, size = self.n_dof, 2 * self.n_dof + len(self.active)
        modes, result = self.modes(state), np.zeros((len(times), size, size))
        free, pushed = _exponentials(modes, times)
        # Friction is that of the springs of this state, and what stays as it was at the start.
        pushed = pushed[:, :, n:] @ (-self._push / self.unit)
        slopes = modes.friction_slopes
        result[:, : 2 * n, : 2 * n], result[:, : 2 * n, 2 * n :] = free, pushed
        result[:, : 2 * n, :n] -= pushed @ slopes
        result[:, 2 * n :] = slopes @ result[:, :n]
        result[:, 2 * n :, :n] -= slopes
        result[:, 2 * n :, 2 * n :] += np.eye(len(self.active))
        return result


def _exponentials(modes: _Modes, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``exp(A t)`` and its integral from 0 on, (n, 2 n_dof, 2 n_dof) each, at times (n,) [s]."""
    if not modes.regular:
        size = len(modes.generator)
        both = np.zeros((2 * size, 2 * size))
        both[:size] = np.hstack([modes.generator, np.eye(size)])
        found = np.array([scipy.linalg.expm(both * time)[:size] for time in times], dtype=float)
        return found[:, :, :size], found[:, :, size:]
    exponents = np.multiply.outer(times, modes.values)
    small = np.abs(exponents) < _SMALL
    integral = np.where(small, 1.0, np.expm1(exponents) / np.where(small, 1.0, exponents))
    parts = np.exp(exponents), times[:, None] * integral
    free, pushed = ((modes.vectors * part[:, None]) @ modes.inverse for part in parts)
    return free.real, pushed.real


@lru_cache(maxsize=8)
def _known(model: Structure) -> dict[bytes, _Perturbations]:
    """Perturbations of a structure by its active contacts, which loads of rotation may change."""
    return {}


class Stretches(NamedTuple):
    """A motion from event to event of its contacts, from ``tau = 0`` on.

    ``slipped`` (n_active,) tells which contacts slip at all; ``edges`` (n + 1,) [rad] are the ends
    of stretches without an event, ``states`` (n, n_active) those of contacts in them. ``drift`` is
    that of displacement, its derivative and friction forces at the start, by ``tau``.
    """

    slipped: NDArray[np.bool_]
    edges: FloatArray
    states: FloatArray
    drift: FloatArray

    @classmethod
    def of(
        cls,
        problem: HarmonicBalance,
        contacts: ActiveContacts,
        unknowns: FloatArray,
        length: float,
        breaks: FloatArray | tuple[()] = (),
    ) -> Self:
        """Those of a solution over a ``length`` [rad], with ``breaks`` [rad] among the ends."""
        relative = problem.layout.relative(unknowns)[contacts.tangential_rows]
        springs = contacts.contact_stiffness, contacts.friction
        contact, begin, end = stick_intervals(problem.basis, relative, *springs)
        every = np.arange(len(contacts.active))
        slipped = np.isin(every, contact)
        events = np.concatenate([begin, end, breaks]) % (2 * np.pi)
        edges = np.unique(np.concatenate([[0.0, length], events[events < length - _INSTANT]]))
        edges = edges[np.concatenate([[True], np.diff(edges) > _INSTANT])]
        middle = (edges[1:] + edges[:-1]) / 2
        inside = (middle[:, None] - begin) % (2 * np.pi) < end - begin
        states = np.where(slipped & ~(inside @ (contact[:, None] == every)), SLIP, STICK)
        coefficients = problem.layout.coefficients(unknowns)
        slope, curvature = (coefficients @ problem.basis.values(0.0, d) for d in (1, 2))
        drift = np.concatenate([slope, curvature, contacts.friction_slopes(states[0]) @ slope])
        return cls(slipped, edges, states, drift)

    @property
    def kept(self) -> NDArray[np.intp]:
        """The entries of states that are displacement, derivative, and forces that may vary."""
        first = len(self.drift) - len(self.slipped)
        return np.concatenate([np.arange(first), first + np.flatnonzero(self.slipped)])


def along_sliders(
    problem: HarmonicBalance, frequency: float, unknowns: FloatArray, length: float
) -> tuple[FloatArray, FloatArray]:
    """The map of perturbations over a ``length`` [rad] from ``tau = 0``, and the drift there.

    States are displacement, its derivative by ``tau`` and the friction forces of contacts that
    slip, (n_state,). Raises ArithmeticError for a structure too large.
    """
    model, n = problem.model, problem.model.n_dof
    contacts = ActiveContacts(model, frequency)
    known, key = _known(model), contacts.active.tobytes()
    if key not in known:
        known[key] = _Perturbations(model, frequency)
    linear = known[key]
    found = Stretches.of(problem, contacts, unknowns, length)
    slipped, edges, states, drift = found
    size = 2 * n + len(contacts.active)
    if len(states) * size**3 > _MOST_WORK:
        raise ArithmeticError("a structure too large to follow its perturbations")
    maps, times = np.empty((len(states), size, size)), np.diff(edges) / frequency
    distinct, which = np.unique(states, axis=0, return_inverse=True)
    for number, state in enumerate(distinct):
        maps[which == number] = linear.maps(state, times[which == number])

    kept = found.kept
    variation = np.eye(size)[:, kept]
    # The friction of contacts that never slip follows the displacement through their springs.
    stuck = np.flatnonzero(~slipped)
    variation[2 * n + stuck, :n] = linear.friction_slopes(np.full(size - 2 * n, STICK))[stuck]
    begins = states != np.vstack([np.full(size - 2 * n, STICK), states[:-1]])
    for k, state in enumerate(states):
        moved = np.flatnonzero(begins[k] & (state != STICK))
        variation[2 * n + moved] = linear.friction_slopes(state)[moved] @ variation[:n]
        variation = maps[k] @ variation
    by_angle = np.ones(size)
    by_angle[n : 2 * n] = linear.unit / frequency
    return (by_angle[:, None] * variation / by_angle[kept])[kept], drift[kept]
