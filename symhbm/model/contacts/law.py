"""The protocol of contact laws: what a law tells, and everything else asks.

A contact acts on ``m`` relative displacements, its ``directions``. Their Fourier coefficients are
its motion, direction by direction: a row of ``m K`` numbers, ``K`` those of one. Its force has as
many, and acts on the structure as the motion is measured.

What changes within a period, the *events* (where a contact begins to slip, where it opens), is
located from the motion with numbers. The force at given events is symbols: a CasADi expression,
whose derivatives by motion, frequency and parameters are exact where the force is continuous in
time. A *switch* is one behaviour that a contact shows within a period or not, slip for example. Its
margin is a smooth function, positive when the motion asks for it; paths locate where margins pass
zero.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from functools import lru_cache
from inspect import signature
from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.motions import (
    EventLoop,
    Events,
    History,
    Located,
    Motions,
    Parameter,
    Sliders,
    SpringSliders,
    Switch,
    Values,
    symbols_of,
)
from symhbm.model.records import Record
from symhbm.numerics import Compiled, FloatArray, FourierBasis

_SECOND = "second derivatives of its force need it"
_ANY_FORCE = 1e200
"""Force [N] that is larger than any."""


class ContactLaw(Record, ABC):
    """A contact law; one of your own derives from this class.

    A law holds no values: a group of contacts does, see `symhbm.Contacts`. Laws of one class and
    the same attributes are equal.

    Examples
    --------
    A spring that stiffens with the sum of the squares of two displacements:

    >>> import casadi as ca
    >>> import symhbm as sh
    >>> class Stop(sh.laws.PolynomialLaw):
    ...     directions = ("tangential", "normal")
    ...     parameters = {"stop_stiffness": sh.laws.Parameter("N m-3", "stiffness of the stop")}
    ...     degree = 3
    ...     def force_at(self, displacement, frequency, values):
    ...         return values["stop_stiffness"] * ca.sumsqr(displacement) * displacement
    >>> model = sh.Model(
    ...     [[1, 0], [0, 1]], [[0.5, 0], [0, 0.5]], [[2e4, 0], [0, 3e4]],
    ...     contacts={"stop": sh.Contacts(Stop(), [(0,)], [(1,)], stop_stiffness=1e9)},
    ... )
    >>> model.parameters["stop_stiffness"]
    array([1.e+09])
    """

    directions: ClassVar[tuple[str, ...]] = ("tangential",)
    """Names of the relative displacements of a contact."""
    parameters: ClassVar[Mapping[str, Parameter]]
    """Its parameters by name."""
    variables: ClassVar[Mapping[str, tuple[str, str]]] = {}
    """Units and meaning of what `results` tells beside the variables of all datasets."""
    switches: ClassVar[tuple[Switch, ...]] = ()
    """Behaviours that a contact shows within a period or not."""
    drawn_as: ClassVar[str] = "contact"
    """The element of `symhbm.plot.model`: friction, cubic or contact."""
    odd: ClassVar[bool] = True
    """Whether the opposite motion has the opposite force, so that odd harmonics may do."""
    engine_order: int | None = None
    """Engine order along which rotation moves the force with the frequency, None without."""
    speed: float | None = None
    """Speed of rotation [1/min] that the force is of, None where it is of none alone."""
    sums_samples: ClassVar[bool] = False
    """Whether coefficients of the force are sums over samples, see `sampling_errors`."""

    def check(self) -> None:
        """Raise ValueError where what the law tells of itself is not true of its force."""

    @property
    def margins_move(self) -> bool:
        """Whether margins depend on the frequency at a given motion."""
        return False

    def monotone(self, values: Values) -> bool:
        """Whether contacts with these values leave responses unique."""
        return False

    def holds(self, values: Values) -> NDArray[np.bool_]:
        """Which contacts (n,) determine where a structure stands in the mean, whatever slips.

        Or which of their displacements (n, m).
        """
        return np.zeros(len(next(iter(values.values()))), dtype=bool)

    def at(self, speed: float) -> ContactLaw:
        """The law at one speed of rotation [1/min], itself where rotation does not move it."""
        if self.engine_order is None:
            return self
        if "speed" not in signature(type(self)).parameters:
            raise TypeError(
                f"{type(self).__name__}: expected an argument speed, or a method at(speed): the "
                "structure is at one speed of rotation"
            )
        other = copy(self)
        other.engine_order, other.speed = None, speed
        return other

    def sampled(self, samples: int) -> ContactLaw:
        """The law marched over samples of the period, itself where nothing needs marching."""
        return self

    def acts(self, values: Values) -> NDArray[np.bool_]:
        """Which contacts (n,) do anything at all with these values."""
        return np.ones(len(next(iter(values.values()))), dtype=bool)

    def event_loop(self, basis: FourierBasis) -> EventLoop | None:
        """The loop that `locate` runs, None where there is more to do than a loop does."""
        return None

    def by_loop(
        self, events: EventLoop, at: Motions, held: NDArray[np.bool_] | None
    ) -> tuple[tuple[FloatArray, ...], int]:
        """Events, margins, their derivatives and details as a loop writes them, and its result."""
        motion, basis = np.ascontiguousarray(at.motion), at.basis
        n, size, q = *motion.shape, len(self.switches)
        imposed = np.full(n, FREE) if held is None else held[:, 0].astype(float)
        shapes = (n, self.n_events(basis)), (n, q), (n, q, size), (n, events.n_details)
        written = tuple(map(np.zeros, shapes))
        values = at.once(self, events.values)
        return written, events.loop(events.basis.arrays, motion, values, imposed, *written)

    @abstractmethod
    def force(self, at: Motions, events: Any) -> Any:
        """Coefficients of the force of one contact (m K) [N], as a CasADi expression.

        Of symbols ``at``, and of ``events`` (e) as located.
        """

    def slope(self, at: Motions, force: Any) -> Any:
        """Derivative of the `force` by the motion at given events (m K, m K) [N/m]."""
        return ca.jacobian(force, at.motion)

    def terms(self, at: Motions, travel: Any, events: Any) -> tuple[Any, Any]:
        """Sizes of the terms of the force, that its round-off scales with: (m K) and one [N].

        ``travel`` (m K) [m] bounds the displacements of both ends. The second is the largest of
        terms whose difference is the force.
        """
        force = self.force(at, events)
        slope = self.slope(at, force)
        return ca.fabs(slope) @ travel + ca.fabs(force - slope @ at.motion), 0

    def n_events(self, basis: FourierBasis) -> int:
        """Numbers ``e`` that tell the events of one contact."""
        return 0

    def locate(self, at: Motions, held: NDArray[np.bool_] | None = None) -> Located:
        """Locate the events of motions; without switches there are none.

        ``held`` (n, q) imposes states, for continuation past a limit: the force is then the smooth
        continuation of that of the state.
        """
        if self.switches or self.n_events(at.basis):
            raise NotImplementedError(f"{type(self).__name__}: expected a method locate")
        n, size = at.motion.shape
        none = np.zeros((n, 0))
        return Located(none, none.astype(bool), none, np.zeros((n, 0, size)))

    def margin_slopes(
        self, located: Located, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of margins at the motions of the events ``located``.

        By frequency (n, q) and by values (p, n, q).
        """
        if self.switches:
            raise NotImplementedError(f"{type(self).__name__}: expected a method margin_slopes")
        shape = len(next(iter(values.values()))), 0
        return np.zeros(shape), np.zeros((len(self.parameters), *shape))

    def margin(self, at: Motions, switch: int, functions: list[Any]) -> Any:
        """Margin of a switch of one contact, as a CasADi expression.

        ``functions`` (K) are those of the basis at each of the `margin_instants`, symbols,
        too.
        """
        raise NotImplementedError(f"{self!r}: expected a method margin, {_SECOND}")

    def margin_instants(self, at: Motions, switch: int) -> FloatArray:
        """Angles (a,) [rad] that the margin of the one contact of ``at`` is stationary in."""
        raise NotImplementedError(f"{self!r}: expected a method margin_instants, {_SECOND}")

    def margin_expansion(
        self, at: Motions, switch: int, instants: FloatArray | None = None
    ) -> tuple[float, FloatArray, FloatArray]:
        """Margin of the one contact of ``at``, its gradient (v,) and second derivatives (v, v).

        By motion (m K), frequency and the values of the parameters, in this order; of other
        ``instants`` where they are given.
        """
        instants = self.margin_instants(at, switch) if instants is None else instants
        expansion = _expansion(self, at.basis, switch, len(instants))
        whole = np.concatenate(at.numbers(self), axis=None)
        margin, gradient, second, mixed, bend = expansion(whole, instants)
        size = len(gradient)
        second, mixed = second.reshape(size, size), mixed.reshape(-1, size)
        # The instants move with the motion, the margin does not with them.
        moved = mixed / np.where(bend == 0, np.inf, bend)[:, None]
        return float(margin[0]), gradient, second - moved.T @ mixed

    def margins_within(self, at: Motions, error: FloatArray) -> FloatArray:
        """Bounds (n, q) of the margins if the size of each motion is off by ``error`` (n, q) [m].

        Positive errors raise margins, negative ones lower them. Paths ask between two of their
        points whether a margin may pass zero, and correct the bounds by the margins at both: a
        bound may leave out whatever hardly changes from point to point.
        """
        located = self.locate(at)
        return located.margins + error * np.linalg.norm(located.margins_by_motion, axis=-1)

    def margin_changes(self, at: Motions, change: FloatArray, margins: FloatArray) -> FloatArray:
        """Bounds (n, q) of how far ``margins`` of `margins_within` (n, q) move with the motion.

        Its coefficients move by no more than ``change`` (n, m K) [m]. Infinite where no bound is
        known: paths then ask for margins all along.
        """
        return np.full(margins.shape, np.inf)

    def event_graph(self, basis: FourierBasis) -> ca.Function | None:
        """CasADi function of one contact from its motion to its events, where they are closed.

        Inputs: motion (m K), frequency, values (p), held (q), which is `FREE` where the motion
        decides. Outputs: events (e), states (q), margins (q), margins_by_motion (q, m K),
        margins_by_frequency (q) and details. None where events are located step by step.
        """
        return None

    def unpack(self, basis: FourierBasis, parts: list[FloatArray]) -> Located:
        """What `event_graph` gives but the slopes by frequency, (n, ...) each."""
        events, states, margins, by_motion, _ = parts
        return Located(events, states > 0, margins, by_motion)

    def springs(self, at: Motions, events: Any) -> tuple[list[Any], list[Any]]:
        """Stiffness and loss (m, m) [N/m] of one contact in each harmonic above 0.

        What the modes of a structure feel of it: here, of a small motion beside its own.
        """
        slope = ca.jacobian(self.force(at, events), at.motion)
        basis, size = at.basis, at.basis.n_components
        stiffness, loss = [], []
        for a in np.flatnonzero(~basis.is_sine & (basis.order > 0)).tolist():
            cosine = [i * size + a for i in range(len(self.directions))]
            sine = [i + 1 for i in cosine]
            in_phase = (slope[cosine, cosine] + slope[sine, sine]) / 2
            turned = (slope[cosine, sine] - slope[sine, cosine]) / 2
            stiffness.append((in_phase + in_phase.T) / 2)
            loss.append((turned + turned.T) / 2)
        return stiffness, loss

    def largest_force(self, values: Values, size: float, switched: bool) -> FloatArray:
        """Bound (n,) [N] of what motions up to a ``size`` [m] make contacts do in any harmonic.

        A search for narrow resonances leaves out those that such a force cannot excite: a bound
        that is too large costs time, one that is too small may lose a resonance.
        """
        return np.full(len(next(iter(values.values()))), _ANY_FORCE)

    def stiffest(self, values: Values) -> FloatArray:
        """Largest stiffness (n,) [N/m] that contacts may have, infinite without bound."""
        return np.full(len(next(iter(values.values()))), np.inf)

    def stuck_stiffness(self, values: Values) -> FloatArray:
        """Stiffness (n, n_directions) [N/m] along each direction of contacts that stay as they are.

        They neither slip nor open, and gaps are closed. Infinite where it has no bound.
        """
        return np.repeat(self.stiffest(values)[:, None], len(self.directions), axis=1)

    def event_variables(self, at: Motions) -> Any:
        """The variables of one contact that its events move with, as a CasADi expression (v).

        By default the motion, the frequency and the values of the parameters, in this order.
        """
        return ca.vertcat(at.motion, at.frequency, *(at.values[name] for name in self.parameters))

    def moving(self, at: Motions, located: Located) -> Events:
        """The instants that move with the `event_variables`: second derivatives need them."""
        raise NotImplementedError(f"{self!r}: expected a method moving, {_SECOND}")

    def moving_events(self, at: Motions, located: Located, weights: FloatArray) -> FloatArray:
        """Second derivatives (n, v, v) of weighted forces by the motion of their events alone.

        By the `event_variables`; ``weights`` (n, m K) are those of the force's coefficients.
        """
        return self.moving(at, located).second_derivatives(weights)

    def released(self) -> dict[str, float]:
        """Values of parameters with which contacts slide freely, empty where there are none."""
        return {}

    def closed(self) -> dict[str, float]:
        """Values of parameters with which contacts touch where nothing moves, under no force."""
        return {}

    def sampling_errors(self, located: Located) -> FloatArray:
        """Bounds (n, m K) [N] of the error of the force's coefficients by its samples."""
        raise NotImplementedError(f"{type(self).__name__}: expected a method sampling_errors")

    def forces(self, at: Motions, located: Located) -> FloatArray:
        """Coefficients of the forces of contacts (n, m K) [N]."""
        motion, frequency, values = at.numbers(self)
        data = motion.ravel(), np.zeros(motion.size), frequency, values.ravel()
        forces = _forces(self, at.basis, len(motion))(*data, located.events.ravel())[0]
        return forces.reshape(motion.shape)

    def results(self, at: Motions, located: Located) -> dict[str, FloatArray]:
        """What datasets store of contacts, (n,) each: here, the energy they dissipate [J].

        Other names are those of `symhbm.results.VARIABLES` with the dimension contact, and of
        `variables`.
        """
        basis, shape = at.basis, (len(at.motion), -1, at.basis.n_components)
        # Work of the force over a period: the integral of f dy.
        velocity = at.motion.reshape(shape) @ basis.derivative_matrix.T / basis.norm
        work = np.einsum("cri,cri->cr", self.forces(at, located).reshape(shape), velocity)
        return {"dissipation": work.sum(axis=1)}

    def history(self, at: Motions, n_angles: int) -> list[History] | None:
        """What contacts do over a period, as it is drawn; None for a law that does not tell.

        At ``n_angles`` points beside the events.
        """
        return None

    def sliders(self, frequency: Any, values: Values) -> Sliders | None:
        """Contacts as springs in series with sliders, None where they are something else."""
        return None

    def spring_sliders(self, frequency: Any, values: Values) -> SpringSliders | None:
        """Contacts as `symhbm.model.contacts.SpringSliders`, None where they are something else.

        Motions of such contacts are linear between their events, and so known in time. Directions
        called "tangential" and "normal" are those of ``u`` and ``v``; with one called "across" the
        friction force is a vector, and its slip is integrated in time.
        """
        sliders = self.sliders(frequency, values)
        if sliders is None:
            return None
        none = np.zeros_like(sliders.limit)
        return SpringSliders(sliders.stiffness, none, none + 1, sliders.limit, none)

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash(type(self))

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"


FREE = -1.0
"""State imposed on a switch that is in the one its motion asks for; 0 is off, 1 on."""


class Graph:
    """The CasADi functions of one contact of a law for one harmonic set, built once.

    ``force``: motion, travel, frequency, values and events to force, magnitude (m K), the largest
    of terms that cancel, and the derivative of the force by the motion. ``springs``: motion,
    frequency, values and events to stiffness and loss, (m^2) by harmonic above 0. ``events``: as
    `ContactLaw.event_graph`.
    """

    def __init__(self, law: ContactLaw, basis: FourierBasis):
        at, symbols = Motions.symbols(law, basis)
        travel = ca.SX.sym("travel", at.motion.shape[0])
        events = ca.SX.sym("events", law.n_events(basis))
        force, sizes = law.force(at, events), law.terms(at, travel, events)
        slope = law.slope(at, force)
        inputs = [symbols[0], travel, *symbols[1:], events]
        # Sizes of terms and derivatives have operations of the force again.
        outputs = ca.cse([ca.densify(force), *map(ca.SX, sizes), slope])
        self.force = ca.Function("contact_force", inputs, outputs)
        parts = [ca.densify(ca.vertcat(*map(ca.vec, part))) for part in law.springs(at, events)]
        self.springs = ca.Function("springs", [*symbols, events], parts)
        self.events = law.event_graph(basis)


@lru_cache(maxsize=64)
def _forces(law: ContactLaw, basis: FourierBasis, n_contacts: int) -> Compiled:
    return Compiled(graph_of(law, basis).force.map(n_contacts))


@lru_cache(maxsize=64)
def _expansion(law: ContactLaw, basis: FourierBasis, switch: int, n_instants: int) -> Compiled:
    """Margin and its derivatives by all variables of a contact and by instants, at instants."""
    at, symbols = Motions.symbols(law, basis)
    whole, angles = ca.vertcat(*symbols), ca.SX.sym("angles", n_instants)
    functions = [functions_at(basis, angle) for angle in ca.vertsplit(angles)]
    margin = law.margin(at, switch, functions)
    second, gradient = ca.hessian(margin, whole)
    by_angles = ca.jacobian(margin, angles)
    bends = [ca.jacobian(by_angles[i], angles[i]) for i in range(n_instants)]
    outputs = [margin, gradient, ca.vec(second), ca.vec(ca.jacobian(by_angles, whole).T)]
    outputs = [ca.densify(part) for part in (*outputs, ca.vertcat(*bends))]
    return Compiled(ca.Function("expansion", [whole, angles], outputs))


@lru_cache(maxsize=64)
def _slopes(law: ContactLaw, method: str, n_contacts: int) -> tuple[Compiled, bool]:
    frequency, values, by_name = symbols_of(law)
    result = ca.SX(getattr(law, method)(frequency, by_name))
    slopes = ca.densify(ca.jacobian(result, ca.vertcat(frequency, values)))
    function = ca.Function("slopes", [frequency, values], [slopes])
    return Compiled(function.map(n_contacts)), bool(ca.jacobian(result, frequency).nnz())


def moves(law: ContactLaw, method: str) -> bool:
    """Whether what a ``method`` of a law gives depends on the frequency."""
    return _slopes(law, method, 1)[1]


def slopes_of(law: ContactLaw, method: str, frequency: float, values: Values) -> FloatArray:
    """Derivatives of what a ``method`` of a law gives by frequency and values, (n, 1 + p)."""
    array = np.array([values[name] for name in law.parameters], dtype=float)
    n = array.shape[1]
    (slopes,) = _slopes(law, method, n)[0](np.full(n, frequency), array.T.ravel())
    return slopes.reshape(n, -1)


def change_of_logarithm(change: FloatArray, value: FloatArray) -> FloatArray:
    """Bound of how far the logarithm of a value moves with the value."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(change < value, -np.log1p(-change / value), np.inf)


def functions_at(basis: FourierBasis, angle: Any) -> Any:
    """The functions (K) of a basis at an angle [rad], as a CasADi expression."""
    order = zip(basis.order.tolist(), basis.is_sine.tolist(), strict=True)
    return ca.vertcat(*(ca.sin(h * angle) if sine else ca.cos(h * angle) for h, sine in order))


@lru_cache(maxsize=64)
def graph_of(law: ContactLaw, basis: FourierBasis) -> Graph:
    """The functions of one contact."""
    return Graph(law, basis)
