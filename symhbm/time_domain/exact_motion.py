"""The exact periodic motion with contacts, an independent reference for harmonic balance.

Between events the motion is linear and known to round-off (`symhbm.time_domain.linear_motion`),
events are located to round-off (`symhbm.time_domain.event_march`), and the periodic one is found by
Newton's method with the exact derivative of the period map, or of the map over half a period where
the force is antiperiodic.
"""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status, solve_point
from symhbm.numerics import FloatArray, FourierBasis, check, check_harmonics
from symhbm.time_domain.active_contacts import APART, STICK
from symhbm.time_domain.active_contacts import slip as slip_of
from symhbm.time_domain.cells import Cells
from symhbm.time_domain.event_march import March, march
from symhbm.time_domain.linear_motion import DEGREE, LinearMotion, extremes
from symhbm.time_domain.periodic_orbit import (
    PERIODIC_TOLERANCE,
    energy_scale,
    is_rigid,
    periodic_state,
    state_of,
)

_UNBOUNDED = 1e9
"""Ratio of inertia to exciting force beyond the range of double precision."""


@dataclass(frozen=True, eq=False)
class ExactMotion:
    """Exact periodic motion, ``tau = omega t``.

    Attributes
    ----------
    frequency
        Angular, [rad/s].
    state : (2 n_dof + n_contacts,)
        Displacement, its derivative by ``tau`` [m] and friction forces [N] at ``tau = 0``; with
        planar friction those across follow, (2 n_dof + 2 n_contacts,).
    event_angle : (n_events,)
        Angles where a contact changes its state [rad].
    event_contact : (n_events,)
        The contact.
    event_kind : (n_events,)
        ``"slip"``, ``"stick"`` or ``"apart"``, which begins. A closed contact without
        friction slips if it has a tangential spring, else it sticks.
    event_slip : (n_events,)
        The direction of the slip that begins, 1 or -1, 0 of other kinds.
    amplitude : (n_dof,)
        Largest ``|x|`` over the period [m].
    multipliers : (2 n_dof + n_states,)
        Floquet multipliers of the period, largest first, without the neutral ones; ``n_states``
        counts the contacts with friction that slip or open.
    neutral_contacts : (n_neutral,)
        Contacts with friction that never slip or open: each has one more multiplier, exactly 1, of
        its static force.
    work : float
        Done by the force per period [J].
    friction_loss : (n_contacts,)
        Dissipated by the contacts per period [J], those of smooth laws among them.
    damping_loss : float
        Dissipated by the damping matrix per period [J].
    stick_fraction, open_fraction : (n_contacts,)
        Shares of the period spent sticking and open; the rest is slip.
    mean_normal_force, least_normal_force, largest_normal_force : (n_contacts,)
        Over the period [N], NaN for contacts without a normal direction.
    reversals : (n_contacts,)
        Changes of sign of the relative velocity per period.
    periodicity : float
        Distance of the states a period apart over the size of the motion, in the norm of energy.
    iterations : int
        Steps of Newton's method.
    status
        A sentence.
    """

    frequency: float
    state: FloatArray
    event_angle: FloatArray
    event_contact: np.ndarray
    event_kind: np.ndarray
    event_slip: np.ndarray
    amplitude: FloatArray
    multipliers: np.ndarray
    neutral_contacts: np.ndarray
    work: float
    friction_loss: FloatArray
    damping_loss: float
    stick_fraction: FloatArray
    open_fraction: FloatArray
    mean_normal_force: FloatArray
    least_normal_force: FloatArray
    largest_normal_force: FloatArray
    reversals: np.ndarray
    periodicity: float
    iterations: int
    status: Status
    _linear: LinearMotion = field(repr=False)
    _cells: Cells = field(repr=False)

    @property
    def converged(self) -> bool:
        """Whether the motion is periodic to `PERIODIC_TOLERANCE`."""
        return self.status == Status.SUCCESS

    def at(self, tau: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Displacement [m], velocity [m/s] and friction forces [N] at the angles ``tau`` [rad].

        ``tau`` (...) gives (..., n_dof), (..., n_dof) and (..., n_contacts), with planar friction
        (..., 2 n_contacts), those across last. Raises as `symhbm.numerics.check.array`.
        """
        tau = check.array("tau", tau)
        x, slope, friction = self._cells.evaluate(self._linear, tau.ravel() % (2 * np.pi))
        parts = x, self.frequency * slope, _spread(self._linear, friction)
        dof, _, contact = (part.reshape(*tau.shape, part.shape[1]) for part in parts)
        return dof, parts[1].reshape(dof.shape), contact

    def normal_force(self, tau: ArrayLike) -> FloatArray:
        """Normal forces (..., n_contacts) [N] at the angles ``tau`` (...) [rad].

        NaN for contacts without a normal direction. Raises as `symhbm.numerics.check.array`.
        """
        tau, linear, cells = check.array("tau", tau), self._linear, self._cells
        angle = tau.ravel() % (2 * np.pi)
        x, state = cells.evaluate(linear, angle)[0], cells.state[cells.cell(angle)]
        result = np.tile(np.maximum(linear.load, 0.0), (len(angle), 1))
        presses = linear.presses
        result[:, linear.active[presses]] = linear.normal_force(x, state)[:, presses]
        return result.reshape(*tau.shape, linear.n_contacts)

    @property
    def sprung(self) -> np.ndarray:
        """Which contacts (n_contacts,) have a tangential spring, whatever their limit."""
        return self._linear.sprung

    def states(self, tau: ArrayLike) -> np.ndarray:
        """States (..., n_contacts) at the angles ``tau`` (...) [rad], in words of `event_kind`.

        Raises as `symhbm.numerics.check.array`.
        """
        tau, linear, cells = check.array("tau", tau), self._linear, self._cells
        state = cells.state[cells.cell(tau.ravel() % (2 * np.pi))]
        idle = np.where(linear.sprung, "slip", "stick")
        result = np.tile(np.where(linear.load < 0, "apart", idle), (len(state), 1))
        result[:, linear.active] = _words(linear, state, np.arange(len(linear.active)))
        return result.reshape(*tau.shape, linear.n_contacts)

    def quadrature(self, highest: int) -> tuple[FloatArray, FloatArray, tuple[FloatArray, ...]]:
        """Angles (n,), weights (n,), and displacement, slope and active friction there."""
        return self._cells.quadrature(self._linear, highest)

    def coefficients(self, harmonics: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Fourier coefficients of displacement [m] and friction forces [N].

        Shapes (n_dof, n_components) and (n_contacts, n_components), with planar friction
        (2 n_contacts, n_components), those across last; components as in
        `symhbm.numerics.fourier.FourierBasis`. Raises as `symhbm.numerics.fourier.check_harmonics`.
        """
        basis = FourierBasis(check_harmonics(harmonics))  # type: ignore[arg-type]
        tau, weight, (x, slope, friction) = self.quadrature(basis.highest)
        functions = weight[:, None] * basis.values(tau) * basis.norm
        # By parts: no round-off of a large mean, and less of the fundamental in high harmonics.
        rates = weight[:, None] * basis.values(tau, 1) * basis.norm
        displacement = slope.T @ rates / np.maximum(basis.order, 1) ** 2
        still = basis.order == 0
        displacement[:, still] = x.T @ functions[:, still]
        return displacement, _spread(self._linear, friction).T @ functions


def exact_motion(
    problem: HarmonicBalance, frequency: float, start: ArrayLike | None = None
) -> ExactMotion:
    """Find the exact periodic motion at an angular ``frequency`` [rad/s].

    ``start`` (2 n_dof + n_contacts,) is a state as in `ExactMotion`; by default, and where Newton's
    method fails from it, it comes from the balance of a few harmonics. Contacts are those of the
    model, whatever law the problem computes with. Where they open or their normal load moves there
    may be several motions: the start selects one. A contact that never slips is centred between its
    limits.

    Raises TypeError or ValueError for bad values, other contacts, and a mass matrix that is not
    positive definite; ArithmeticError where contacts change their states without end.
    """
    frequency = check.scalar("frequency", frequency, "positive")
    linear = LinearMotion(problem, frequency)
    starts = _balanced_starts(problem, linear)
    if start is not None:
        start_state = check.array("start", start)
        expected = (2 * linear.n_dof + linear.n_contacts,)
        if start_state.shape != expected:
            raise ValueError(f"start: expected shape {expected}, got {start_state.shape}")
        starts = chain([linear.of_active(start_state)], starts)
    # The march raises for a step that overflows, and the step is shortened.
    with np.errstate(over="ignore", invalid="ignore"):
        state, iterations, status = periodic_state(linear, starts)
    return describe_motion(linear, state, iterations, status)


def _balanced_starts(problem: HarmonicBalance, linear: LinearMotion) -> Iterator[FloatArray]:
    """States (2 n_dof + n_active,) at ``tau = 0`` by harmonic balances, one after the other.

    Contacts that may open have more starts: the linear motions with all of them closed, and apart.
    """
    opens = linear.moves
    for highest in (7, 1):
        harmonics = range(1, highest + 1, 2) if linear.antiperiodic else range(highest + opens)
        harmonics = {1, *harmonics, *linear.orders.tolist()}
        balance = HarmonicBalance(problem.model, problem.excitation, harmonics)
        unknowns = np.zeros(balance.n_unknowns)
        with contextlib.suppress(ArithmeticError):
            unknowns = solve_point(balance, linear.frequency).unknowns
        yield linear.of_active(state_of(balance, unknowns, linear.frequency))
    if opens:
        for state in (STICK, APART):
            yield _linear_state(linear, np.full(len(linear.active), state))


def _linear_state(linear: LinearMotion, of_contact: FloatArray) -> FloatArray:
    """State at ``tau = 0`` of the motion whose contacts stay as they are."""
    omega, stiffness = linear.frequency, linear.stiffness + linear.springs(of_contact)
    force = linear.normal_force(np.zeros(linear.n_dof), of_contact) - linear.offset
    still = linear.static - linear.normal.T @ force
    x, slope = np.linalg.lstsq(stiffness, still, rcond=None)[0], np.zeros(linear.n_dof)
    for k, n in enumerate(linear.orders * omega):
        dynamic = stiffness - n**2 * linear.mass + 1j * n * linear.damping
        wave = linear.cosine[:, k] - 1j * linear.sine[:, k]
        wave = np.linalg.lstsq(dynamic, wave, rcond=None)[0]
        x, slope = x + wave.real, slope - linear.orders[k] * wave.imag
    friction = np.where(of_contact == STICK, linear.contact_stiffness, 0.0) * (
        linear.directions @ x
    )
    return np.concatenate([x, slope, friction])


def _spread(linear: LinearMotion, friction: FloatArray) -> FloatArray:
    """Values of all contacts from those of the active ones (n, n_active), zero for the others.

    Those across follow where there are some.
    """
    result = np.zeros((len(friction), linear.n_tangential, linear.n_contacts))
    shape = len(friction), linear.n_tangential, len(linear.active)
    result[:, :, linear.active] = friction.reshape(shape)
    return result.reshape(len(friction), linear.n_tangential * linear.n_contacts)


def _words(linear: LinearMotion, state: FloatArray, contact: np.ndarray) -> np.ndarray:
    """Words for states of active contacts."""
    slides = (np.abs(state) == 1) | ~(linear.rubs | ~linear.sprung[linear.active])[contact]
    return np.where(state == APART, "apart", np.where(slides, "slip", "stick"))


def _normal_forces(linear: LinearMotion, cells: Cells) -> FloatArray:
    """Mean, least and largest normal forces (3, n_contacts) [N]."""
    result = np.tile(np.maximum(linear.load, 0.0), (3, 1))
    if linear.moves:
        powers = cells.pressure(linear)[:, :, linear.presses]
        high, low = extremes(powers)
        mean = cells.width @ np.einsum("ckn,k->cn", powers, 1 / np.arange(1, DEGREE + 2))
        values = mean / (2 * np.pi), np.maximum(low, 0.0), high
        result[:, linear.active[linear.presses]] = values
    return result


def describe_motion(
    linear: LinearMotion,
    state: FloatArray,
    iterations: int,
    status: Status,
    march: Callable[..., March] = march,
) -> ExactMotion:
    """All results of a motion from its ``state`` (2 n_dof + n_active,) at ``tau = 0``."""
    n, omega, active = linear.n_dof, linear.frequency, linear.active
    run = march(linear, state, 2 * np.pi)
    cells, scale = run.cells, energy_scale(linear)
    (angle, _, begins), contact = run.events.T, run.events[:, 1].astype(int)
    size = np.linalg.norm(scale * state)
    distance = np.linalg.norm(scale * (run.end - state))
    periodicity = float(distance / size) if size else float(distance)
    amplitude = np.max(np.abs(extremes(cells.displacement)), axis=0)
    force = linear.largest_force
    if np.abs(linear.mass @ amplitude).max() * omega**2 > _UNBOUNDED * force > 0:
        status = Status.SYSTEM_SINGULAR
    elif status == Status.SUCCESS and periodicity > 2 * PERIODIC_TOLERANCE:
        status = Status.NO_MOTION
    apart_always = bool(linear.moves and np.all(cells.state == APART))
    if status != Status.SUCCESS and apart_always and is_rigid(linear):
        status = Status.NOT_HELD
    loss, apart = np.zeros(linear.n_contacts), np.where(linear.load < 0, 1.0, 0.0)
    loss[active] = cells.friction_loss(linear)
    slip, words = 1 - apart, _words(linear, cells.state, np.arange(len(active)))
    slip[~linear.sprung] = 0.0
    slip[active] = cells.width @ (words == "slip") / (2 * np.pi)
    apart[active] = cells.width @ (words == "apart") / (2 * np.pi)
    normal_force = _normal_forces(linear, cells)
    work, damping_loss = cells.work(linear)
    return ExactMotion(
        frequency=omega,
        state=np.concatenate([state[: 2 * n], _spread(linear, state[None, 2 * n :]).ravel()]),
        event_angle=angle,
        event_contact=active[contact],
        event_kind=_words(linear, begins, contact),
        event_slip=slip_of(begins).astype(int),
        amplitude=amplitude,
        multipliers=run.multipliers(linear),
        neutral_contacts=active[~run.slipped],
        work=work,
        friction_loss=loss,
        damping_loss=damping_loss,
        stick_fraction=1 - slip - apart,
        open_fraction=apart,
        mean_normal_force=normal_force[0],
        least_normal_force=normal_force[1],
        largest_normal_force=normal_force[2],
        reversals=cells.reversals(linear),
        periodicity=periodicity,
        iterations=iterations,
        status=status,
        _linear=linear,
        _cells=cells,
    )
