"""The protocol of contact laws: what a law tells, and everything else asks.

A contact acts on ``m`` relative displacements, its ``directions``. Their Fourier coefficients are
its motion, direction by direction: a row of ``m K`` numbers, ``K`` those of one. Its force has as
many, and acts on the structure as the motion is measured.

What changes within a period, the *events* (where a contact begins to slip, where it opens), is
located from the motion with numbers. The force at given events is symbols: a CasADi expression,
whose derivatives by motion, frequency and parameters are exact where the force is continuous in
time. A *switch* is what a contact may do within a period or not, slip for example. Its margin is a
smooth function, positive when the motion asks for it; paths locate where margins pass zero.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from inspect import signature
from typing import Any, ClassVar, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.history import History
from symhbm.model.contacts.parameter import Parameter
from symhbm.model.records import Record
from symhbm.numerics import Compiled, FloatArray, FourierBasis

_ANY_FORCE = 1e200
"""Force [N] that is larger than any."""
Values = dict[str, Any]
"""Values of the parameters of a law by name: arrays (n_contacts,), or symbols of one contact."""


class Switch(NamedTuple):
    """What a contact may do within a period or not, and the names of its two events.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.Coulomb().switches[0].begins, sh.Coulomb().switches[0].ends
    ('onset of slip', 'end of slip')
    """

    name: str
    begins: str
    ends: str


@dataclass(frozen=True)
class Located:
    """The events of ``n`` contacts of one law over one period.

    Attributes
    ----------
    events : (n, e)
        What `ContactLaw.force` takes of them.
    states : (n, q)
        Whether each switch is on.
    margins : (n, q)
        Positive when the motion asks for it, infinite where there is nothing to pass.
    margins_by_motion : (n, q, m K)
        Their derivatives by the motion.
    details
        What the law wants to know of them again: something with a method ``split(count)`` into
        those of as many points, or None.

    Examples
    --------
    Of a contact that moves by 1 mm under one harmonic, and slips then:

    >>> import numpy as np
    >>> import symhbm as sh
    >>> from symhbm.numerics import FourierBasis
    >>> values = {"contact_stiffness": 1e4, "friction_coefficient": 0.5, "normal_load": 3.0}
    >>> values = {name: np.array([value]) for name, value in values.items()}
    >>> motion = np.array([[1e-3, 0.0]])
    >>> located = sh.Coulomb().locate(FourierBasis((1,)), motion, 100.0, values)
    >>> located.states, located.margins.round(3)
    (array([[ True]]), array([[1.897]]))
    """

    events: FloatArray
    states: NDArray[np.bool_]
    margins: FloatArray
    margins_by_motion: FloatArray
    details: Any = None


class Sliders(NamedTuple):
    """Contacts that are a spring in series with a slider, (n,) each.

    Their ``stiffness`` [N/m] and ``limit`` [N].
    """

    stiffness: FloatArray
    limit: FloatArray


class SpringSliders(NamedTuple):
    """Contacts between springs in both directions and a slider pressed by one, (n,) each.

    Of the relative displacements ``u`` and ``v``, which closes where it is positive, with
    ``p = N0 + k_n v``: the normal force is ``N = max(p, 0)`` and the friction force
    ``T = k_t u - q``, ``|T| <= mu N``, where ``q`` moves as little as that takes. On the structure
    act ``T`` against ``u`` and ``N`` less ``offset`` against ``v``.

    Attributes
    ----------
    tangential_stiffness, normal_stiffness
        ``k_t`` and ``k_n`` [N/m], 0 for a spring that is none.
    friction_coefficient
        ``mu``.
    normal_load
        ``N0`` [N], negative for a gap.
    offset
        Normal force [N] that is balanced where displacements are measured from.
    """

    tangential_stiffness: FloatArray
    normal_stiffness: FloatArray
    friction_coefficient: FloatArray
    normal_load: FloatArray
    offset: FloatArray


class ContactLaw(Record, ABC):
    """A contact law; one of your own derives from this class.

    A law holds no values: a group of contacts does, see `symhbm.Contacts`. Laws of one class and
    the same attributes are equal.

    Examples
    --------
    A spring that stiffens with the sum of the squares of two displacements:

    >>> import casadi as ca
    >>> import symhbm as sh
    >>> class Stop(sh.PolynomialLaw):
    ...     directions = ("tangential", "normal")
    ...     parameters = {"stop_stiffness": sh.Parameter("N m-3", "stiffness of the stop")}
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
    """What a contact may do within a period or not."""
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

    @abstractmethod
    def force(
        self, basis: FourierBasis, motion: Any, frequency: Any, values: Values, events: Any
    ) -> Any:
        """Coefficients of the force of one contact (m K) [N], as a CasADi expression.

        ``motion`` (m K) [m]; ``frequency`` in rad/s; ``values``, one each; ``events`` (e) as
        located.
        """

    def slope(
        self, basis: FourierBasis, motion: Any, frequency: Any, values: Values, force: Any
    ) -> Any:
        """Derivative of the `force` by the motion at given events (m K, m K) [N/m]."""
        return ca.jacobian(force, motion)

    def terms(
        self,
        basis: FourierBasis,
        motion: Any,
        travel: Any,
        frequency: Any,
        values: Values,
        events: Any,
    ) -> tuple[Any, Any]:
        """Sizes of the terms of the force, that its round-off scales with: (m K) and one [N].

        ``travel`` (m K) [m] bounds the displacements of both ends. The second is the largest of
        terms whose difference is the force.
        """
        force = self.force(basis, motion, frequency, values, events)
        slope = self.slope(basis, motion, frequency, values, force)
        return ca.fabs(slope) @ travel + ca.fabs(force - slope @ motion), 0

    def n_events(self, basis: FourierBasis) -> int:
        """Numbers ``e`` that tell the events of one contact."""
        return 0

    def locate(
        self,
        basis: FourierBasis,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
        held: NDArray[np.bool_] | None = None,
    ) -> Located:
        """Locate the events of motions (n, m K) [m]; without switches there are none.

        ``frequency`` in rad/s, one or (n,); ``held`` (n, q) imposes states, for continuation past
        a limit: the force is then the smooth continuation of that of the state.
        """
        if self.switches or self.n_events(basis):
            raise NotImplementedError(f"{type(self).__name__}: expected a method locate")
        n, size = motion.shape
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

    def margin_expansion(
        self, basis: FourierBasis, motion: FloatArray, frequency: float, values: Values, switch: int
    ) -> tuple[float, FloatArray, FloatArray]:
        """Margin of one contact, its gradient (v,) and its second derivatives (v, v).

        By motion (m K), frequency and the values of the parameters, in this order.
        """
        raise NotImplementedError(f"{type(self).__name__}: expected a method margin_expansion")

    def margins_within(
        self,
        basis: FourierBasis,
        motion: FloatArray,
        error: FloatArray,
        frequency: FloatArray,
        values: Values,
    ) -> FloatArray:
        """Margins (n, q) of motions that are known up to an ``error`` (n, q) [m] of their size.

        The error has the sign that makes the margin most doubtful. Paths ask between their points
        whether a margin may pass zero there; what an estimate is off at the points it is corrected
        by, so that it may leave out what hardly changes from point to point.
        """
        located = self.locate(basis, motion, frequency, values)
        return located.margins + error * np.linalg.norm(located.margins_by_motion, axis=-1)

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

    def springs(
        self, basis: FourierBasis, motion: Any, frequency: Any, values: Values, events: Any
    ) -> tuple[list[Any], list[Any]]:
        """Stiffness and loss (m, m) [N/m] of one contact in each harmonic above 0.

        What the modes of a structure feel of it: here, of a small motion beside its own.
        """
        force = self.force(basis, motion, frequency, values, events)
        slope, size = ca.jacobian(force, motion), basis.n_components
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

        It tells which narrow resonances may matter; a large one costs a look at more of them.
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

    def event_variables(self, motion: Any, frequency: Any, values: Values) -> Any:
        """What the events of one contact move with, as a CasADi expression (v).

        Second derivatives need it, with `moving_events`, of laws that have events; None without.
        """
        return None

    def moving_events(
        self,
        basis: FourierBasis,
        located: Located,
        motion: FloatArray,
        frequency: float,
        values: Values,
        weights: FloatArray,
    ) -> FloatArray:
        """Second derivatives (n, v, v) of weighted forces by the motion of their events alone.

        By the `event_variables`; ``weights`` (n, m K) are those of the force's coefficients.
        """
        raise NotImplementedError(f"{type(self).__name__}: expected a method moving_events")

    def released(self) -> dict[str, float]:
        """Values of parameters with which contacts slide freely, empty where there are none."""
        return {}

    def closed(self) -> dict[str, float]:
        """Values of parameters with which contacts touch where nothing moves, under no force."""
        return {}

    def sampling_errors(self, located: Located) -> FloatArray:
        """Bounds (n, m K) [N] of the error of the force's coefficients by its samples."""
        raise NotImplementedError(f"{type(self).__name__}: expected a method sampling_errors")

    def forces(
        self,
        basis: FourierBasis,
        located: Located,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
    ) -> FloatArray:
        """Coefficients of the forces of contacts (n, m K) [N]; arguments as of `locate`."""
        given = np.array([values[name] for name in self.parameters]).T.ravel()
        at = np.broadcast_to(frequency, len(motion))
        nothing = np.zeros(motion.size)
        data = motion.ravel(), nothing, at, given, located.events.ravel()
        return _forces(self, basis, len(motion))(*data)[0].reshape(motion.shape)

    def results(
        self,
        basis: FourierBasis,
        located: Located,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
    ) -> dict[str, FloatArray]:
        """What datasets store of contacts, (n,) each: here, the energy they dissipate [J].

        Other names are those of `symhbm.results.VARIABLES` with the dimension contact, and of
        `variables`.
        """
        force = self.forces(basis, located, motion, frequency, values)
        shape = (len(motion), -1, basis.n_components)
        # Work of the force over a period: the integral of f dy.
        velocity = motion.reshape(shape) @ basis.derivative_matrix.T / basis.norm
        work = np.einsum("cri,cri->cr", force.reshape(shape), velocity)
        return {"dissipation": work.sum(axis=1)}

    def history(
        self,
        basis: FourierBasis,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
        n_angles: int,
    ) -> list[History] | None:
        """What contacts do over a period, as it is drawn; None for a law that does not tell.

        ``n_angles`` points beside the events; the other arguments as of `locate`.
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
        size = basis.n_components * len(law.directions)
        motion, travel = ca.SX.sym("motion", size), ca.SX.sym("travel", size)
        frequency, values = ca.SX.sym("frequency"), ca.SX.sym("values", len(law.parameters))
        events = ca.SX.sym("events", law.n_events(basis))
        by_name = dict(zip(law.parameters, ca.vertsplit(values), strict=True))
        force = law.force(basis, motion, frequency, by_name, events)
        sizes = law.terms(basis, motion, travel, frequency, by_name, events)
        slope = law.slope(basis, motion, frequency, by_name, force)
        inputs = [motion, travel, frequency, values, events]
        # Sizes of terms and derivatives have operations of the force again.
        outputs = ca.cse([ca.densify(force), *map(ca.SX, sizes), slope])
        self.force = ca.Function("contact_force", inputs, outputs)
        stiffness, loss = law.springs(basis, motion, frequency, by_name, events)
        parts = [ca.densify(ca.vertcat(*map(ca.vec, part))) for part in (stiffness, loss)]
        self.springs = ca.Function("springs", [motion, frequency, values, events], parts)
        self.events = law.event_graph(basis)


@lru_cache(maxsize=64)
def _forces(law: ContactLaw, basis: FourierBasis, n_contacts: int) -> Compiled:
    return Compiled(graph_of(law, basis).force.map(n_contacts))


@lru_cache(maxsize=64)
def graph_of(law: ContactLaw, basis: FourierBasis) -> Graph:
    """The functions of one contact."""
    return Graph(law, basis)
