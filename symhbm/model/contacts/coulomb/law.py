"""Dry friction: a spring in series with a Coulomb slider, Eqs. (2)-(8).

The force is ``k_d y`` while the contact sticks, and at most ``g = mu F_n`` in size. With its
switching angles located the coefficients of the force are the closed form of
`symhbm.model.contacts.coulomb.state`.
"""

from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.coulomb import march
from symhbm.model.contacts.coulomb.located import (
    locate,
    n_details,
    one_harmonic_kernel,
    parts_from,
    stick_intervals,
    unpack,
)
from symhbm.model.contacts.coulomb.march import MARGIN, SLIP, range_margins
from symhbm.model.contacts.coulomb.sampled import history_of, locate_sampled
from symhbm.model.contacts.coulomb.state import ContactState, moving_angles
from symhbm.model.contacts.law import ContactLaw, change_of_logarithm, moves, slopes_of
from symhbm.model.contacts.motions import (
    EventLoop,
    Events,
    History,
    Located,
    Motions,
    Sliders,
    Switch,
    Values,
    leading,
)
from symhbm.model.contacts.normal import (
    FRICTION,
    LOAD,
    LOAD_RECORD,
    NORMAL_LOAD,
    centrifugal,
    check_order,
)
from symhbm.numerics import FloatArray, FourierBasis, turning_hessian, turning_points


class Coulomb(ContactLaw):
    """Spring ``k_d`` in series with a slider of limit ``mu F_n``: one direction, constant load.

    The force of `slip_limit` may be another one, of more parameters and of the frequency: derive
    from this class, and name all parameters.

    Examples
    --------
    A damper that centrifugal force presses against its blades:

    >>> import symhbm as sh
    >>> class PressedDamper(sh.laws.Coulomb):
    ...     parameters = sh.laws.Coulomb.parameters | {
    ...         "damper_mass": sh.laws.Parameter("kg", "mass of the damper")
    ...     }
    ...     def slip_limit(self, frequency, values):
    ...         speed = frequency / 3  # of engine order 3
    ...         load = values["normal_load"] + 0.4 * values["damper_mass"] * speed**2
    ...         return values["friction_coefficient"] * load
    >>> group = sh.Contacts(
    ...     PressedDamper(), [(0,)], contact_stiffness=1e4, friction_coefficient=0.5,
    ...     normal_load=0, damper_mass=0.02,
    ... )
    >>> blade = sh.Model([[1]], [[0.5]], [[1e4]], contacts={"damper": group})
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> sh.frf(problem, (10, 30), progress=False).n_peaks.item()
    1
    """

    parameters: ClassVar = {**FRICTION, "normal_load": NORMAL_LOAD}
    switches = (Switch("slip", "onset of slip", "end of slip"),)
    drawn_as = "friction"
    samples: int | None = None
    """Samples of the period that the slider is marched over, None where events are located."""

    def slip_limit(self, frequency: Any, values: Values) -> Any:
        """``g`` [N] at an angular frequency [rad/s], of arrays or of symbols.

        Where it is negative nothing presses the contact any more, and its limit is 0.
        """
        return values["friction_coefficient"] * values["normal_load"]

    def _limit(self, frequency: Any, values: Values) -> Any:
        """The limit as a CasADi expression, 0 at least; its slopes at 0 are those of pressing."""
        limit = self.slip_limit(frequency, values)
        return ca.if_else(limit < 0, 0, limit)

    @property
    def margins_move(self) -> bool:
        """Whether the limit depends on the frequency."""
        return moves(self, "slip_limit")

    def monotone(self, values: Values) -> bool:
        """That responses are unique: with dissipative damping and a load that motion leaves."""
        return True

    def acts(self, values: Values) -> NDArray[np.bool_]:
        """Those that have a spring and a limit, be it at other frequencies."""
        stiffness, limit = self.sliders(1.0, values)
        return (stiffness > 0) & ((limit > 0) | self.margins_move)

    def sampled(self, samples: int) -> "SampledCoulomb":
        """The same over samples of the period."""
        return SampledCoulomb(samples, self)

    def sliders(self, frequency: Any, values: Values) -> Sliders:
        """Stiffness and limit of the contacts."""
        limit = self.slip_limit(frequency, values)
        limit = np.maximum(np.asarray(limit, dtype=float), 0.0)
        return Sliders(np.asarray(values["contact_stiffness"]), limit)

    def n_events(self, basis: FourierBasis) -> int:
        """``A``, ``b``, and the share of the period that a contact sticks which also slips."""
        return basis.n_components**2 + basis.n_components + 1

    def force(self, at: Motions, events: Any) -> Any:
        """``k_d A y + g b``, Eqs. (6)-(8)."""
        basis, motion, frequency, values = at
        matrix, vector, _ = _split(basis, events)
        limit = self._limit(frequency, values)
        return values["contact_stiffness"] * ca.mtimes(matrix, motion) + limit * vector

    def terms(self, at: Motions, travel: Any, events: Any) -> tuple[Any, Any]:
        """Of the force, and of a stretch of stick: ``k_d`` times where it begins and ends.

        Their difference is the force: where a contact slips far, two large terms.
        """
        basis, _, frequency, values = at
        matrix, vector, sticking = (ca.fabs(part) for part in _split(basis, events))
        stiffness, limit = values["contact_stiffness"], self._limit(frequency, values)
        largest = 2 * stiffness * ca.mmax(travel) * sticking
        return stiffness * ca.mtimes(matrix, travel) + limit * vector, largest

    def locate(self, at: Motions, held: NDArray[np.bool_] | None = None) -> Located:
        """Switching angles of the motion, see `symhbm.model.contacts.coulomb.located.locate`."""
        stiffness, limit = at.once(self, self.sliders)
        imposed = None if held is None else held[:, 0]
        return self.find(at.basis, at.motion, stiffness, limit, imposed).located

    def find(self, basis: FourierBasis, *motion: Any) -> ContactState:
        """Events of motions, stiffness, limits and imposed slip, as the law finds them."""
        return locate(basis, *motion)

    def event_loop(self, basis: FourierBasis) -> EventLoop | None:
        """What marches the slider of several harmonics."""
        if basis.highest == 1:
            return None

        def sliders(frequency: float, values: Values) -> FloatArray:
            return np.column_stack(np.broadcast_arrays(*self.sliders(frequency, values)))

        return EventLoop(march.locate, basis.reduced, sliders, n_details(basis.reduced))

    def margin_slopes(
        self, located: Located, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of ``ln(k_d (y_max - y_min) / (2 g))``, which are those of any motion."""
        stiffness, limit = self.sliders(frequency, values)
        limited = np.where(limit > 0, limit, np.inf)
        by_all = -slopes_of(self, "slip_limit", frequency, values) / limited[:, None]
        own = 1 + [*self.parameters].index("contact_stiffness")
        by_all[:, own] += 1 / np.where(stiffness > 0, stiffness, np.inf)
        return by_all[:, :1], by_all.T[1:, :, None]

    def margin_instants(self, at: Motions, switch: int) -> FloatArray:
        """Where the motion is largest and smallest."""
        points = turning_points(at.basis, at.motion)
        return points.angle[0, [0, points.lowest[0]]]

    def margin(self, at: Motions, switch: int, functions: list[Any]) -> Any:
        """The logarithm of the travel between two turning points over ``2 g / k_d``."""
        force = at.values["contact_stiffness"] * ca.dot(functions[0] - functions[1], at.motion)
        return ca.log(force / (2 * self.slip_limit(at.frequency, at.values)))

    @staticmethod
    def travel(
        basis: FourierBasis, motion: FloatArray, angle: FloatArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """Travel of a motion between two turning points [m], its first and second derivatives."""
        high, low = basis.values(angle)
        bend_high, bend_low = turning_hessian(basis, np.stack([motion, motion]), angle)
        return float((high - low) @ motion), high - low, bend_high - bend_low

    def margins_within(self, at: Motions, error: FloatArray) -> FloatArray:
        """The logarithm of half the range of the motion, over samples of it."""
        return range_margins(at.basis, at.motion, error)

    def margin_changes(self, at: Motions, change: FloatArray, margins: FloatArray) -> FloatArray:
        """Half the range moves by no more than the sum of the coefficients does."""
        return change_of_logarithm(change.sum(axis=1, keepdims=True), np.exp(margins))

    def event_graph(self, basis: FourierBasis) -> ca.Function | None:
        """All angles under one harmonic."""
        if basis.highest != 1:
            return None
        (at, symbols), held = Motions.symbols(self, basis), ca.SX.sym("held")
        limit = self._limit(at.frequency, at.values)
        kernel = one_harmonic_kernel(basis.n_components)
        packed = kernel(at.motion, at.values["contact_stiffness"], limit, held)
        events, gradient, figures, _ = ca.vertsplit(packed, parts_from(basis.n_components))
        slope = ca.jacobian(limit, at.frequency)
        if slope.nnz():
            slope = ca.if_else(limit > 0, -slope / ca.if_else(limit > 0, limit, 1), 0)
        outputs = [events, figures[SLIP], figures[MARGIN], gradient.T, slope, packed]
        return ca.Function("events", [*symbols, held], outputs)

    def unpack(self, basis: FourierBasis, parts: list[FloatArray]) -> Located:
        """What `event_graph` gives."""
        events, states, margins, by_motion, packed = parts
        state = unpack(packed, basis.n_components)
        return Located(events, states > 0, margins, by_motion, state)

    def springs(self, at: Motions, events: Any) -> tuple[list[Any], list[Any]]:
        """In the mean over its motion where a harmonic leads it, else for a small one beside it.

        What the other harmonics make a contact do is a force, and no stiffness.
        """
        basis, motion = at.basis, at.motion
        matrix, _, _ = _split(basis, events)
        stiffness, force = at.values["contact_stiffness"], self.force(at, events)
        springs, losses = [], []
        for a in np.flatnonzero(~basis.is_sine & (basis.order > 0)).tolist():
            leads, square = leading(motion, a)
            safe = ca.if_else(leads, square, 1)
            in_phase = ca.dot(force[a : a + 2], motion[a : a + 2]) / safe
            out_of_phase = (force[a] * motion[a + 1] - force[a + 1] * motion[a]) / safe
            beside = stiffness / 2 * (matrix[a, a] + matrix[a + 1, a + 1])
            turned = stiffness / 2 * (matrix[a, a + 1] - matrix[a + 1, a])
            share = ca.if_else(leads, in_phase, beside)
            springs.append(ca.fmin(ca.fmax(share, 0), stiffness))
            losses.append(ca.fmax(ca.if_else(leads, out_of_phase, turned), 0))
        return springs, losses

    def released(self) -> dict[str, float]:
        """Without a spring nothing pulls, whatever the limit is made of."""
        return {"contact_stiffness": 0.0}

    def forces(self, at: Motions, located: Located) -> FloatArray:
        """The closed form of `force`."""
        stiffness, limit = self.sliders(at.frequency, at.values)
        state = located.details
        force = stiffness[:, None] * np.einsum("cij,cj->ci", state.matrix, at.motion)
        return force + limit[:, None] * state.vector

    def results(self, at: Motions, located: Located) -> dict[str, FloatArray]:
        """State, angles, reversals, share of stick, and dissipated energy [J]."""
        state, rubs = located.details, np.asarray(at.values["contact_stiffness"]) > 0
        return super().results(at, located) | dict(
            theta_0=state.theta_0,
            theta_star=state.theta_star,
            stick_fraction=state.stick_fraction,
            contact_state=np.where(rubs, state.slip, -1),
            reversals=state.reversals.astype(int),
        )

    def history(self, at: Motions, n_angles: int) -> list[History]:
        """Of the slider on its own motion, located."""
        sliders = self.sliders(at.frequency, at.values)
        owner, begin, end = stick_intervals(at.basis, at.motion, *sliders)
        return [
            history_of(at.basis, *one, begin[owner == i], end[owner == i], n_angles)
            for i, one in enumerate(zip(at.motion, *sliders, strict=True))
        ]

    def largest_force(self, values: Values, size: float, switched: bool) -> FloatArray:
        """The spring's, of contacts that slip: those that stick are linear."""
        return np.asarray(values["contact_stiffness"]) * switched * size

    def stiffest(self, values: Values) -> FloatArray:
        """The spring's."""
        return np.asarray(values["contact_stiffness"])

    def event_variables(self, at: Motions) -> Any:
        """Motion, ``k_d`` and ``g``."""
        limit = self._limit(at.frequency, at.values)
        return ca.vertcat(at.motion, at.values["contact_stiffness"], limit)

    def moving(self, at: Motions, located: Located) -> Events:
        """See `moving_angles`."""
        slider, slips = self.sliders(at.frequency, at.values), located.states[:, 0]
        return moving_angles(at.basis, at.motion, *slider, slips, located.details)


class PressedCoulomb(Coulomb):
    """Dry friction under ``F_n + centrifugal_load (omega / engine_order)^2``, see `Coulomb`.

    With a ``speed`` [1/min] the load is that of this speed, whatever the frequency.

    Examples
    --------
    >>> import symhbm as sh
    >>> law = sh.Friction(
    ...     tangential=(0,), contact_stiffness=1e4, friction_coefficient=0.5, normal_load=0.0,
    ...     centrifugal_load=0.02, engine_order=3,
    ... ).law
    >>> at_speed = dict(friction_coefficient=0.5, normal_load=1.0, centrifugal_load=0.02)
    >>> law.slip_limit(300.0, at_speed)
    100.5
    """

    parameters: ClassVar = {**Coulomb.parameters, LOAD: LOAD_RECORD}

    def __init__(self, engine_order: int | None = 1, speed: float | None = None):
        self.engine_order, self.speed = check_order(engine_order), speed

    def slip_limit(self, frequency: Any, values: Values) -> Any:
        """``mu`` times the load [N] at an angular frequency [rad/s]."""
        added = centrifugal(self, frequency, values)
        return values["friction_coefficient"] * (values["normal_load"] + added)

    def __repr__(self) -> str:
        at = self.engine_order if self.speed is None else f"speed={self.speed:g}"
        return f"PressedCoulomb({at})"


class SampledCoulomb(Coulomb):
    """The same friction marched over equidistant samples of the period: a cross-check.

    ``of`` is the law that tells the limit.
    """

    def __init__(self, samples: int, of: Coulomb):
        self.samples, self._of = samples, of
        self.parameters = of.parameters  # type: ignore[misc]

    def slip_limit(self, frequency: Any, values: Values) -> Any:
        """That of the law that is sampled."""
        return self._of.slip_limit(frequency, values)

    def find(self, basis: FourierBasis, *motion: Any) -> ContactState:
        """Events by marching, see `symhbm.model.contacts.coulomb.sampled.locate_sampled`."""
        assert self.samples is not None
        return locate_sampled(basis, *motion, samples=self.samples)

    def event_graph(self, basis: FourierBasis) -> None:
        """None: samples are marched step by step."""

    def __repr__(self) -> str:
        return f"{self._of!r} over {self.samples} samples"


def _split(basis: FourierBasis, events: Any) -> tuple[Any, Any, Any]:
    """``A``, ``b``, and the share of stick of a contact that slips, of packed events."""
    size = basis.n_components
    matrix = ca.reshape(events[: size * size], size, size)
    return matrix, events[size * size : size * size + size], events[-1]
