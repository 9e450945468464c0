"""What laws take and find: motions and named values; events, states, histories, sliders."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Any, Literal, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.records import record
from symhbm.numerics import FloatArray, FourierBasis
from symhbm.numerics.loops import Loop

SMALLEST_MOTION = 1e-150
"""Motion [m] below which there is none: its inverse has no square in double precision."""
LEADING = 0.5
"""Share of a harmonic in the square of a motion from which it leads."""


@record
class Parameter(NamedTuple):
    """A named number of a model, of a contact law or of an excitation.

    ``units`` as datasets have them, UDUNITS; ``symbol`` of pictures, with the ``unit`` there, by
    default its name and units; ``per``, what has one value each, None for one in all; ``bound`` of
    its values, "positive", "non-negative" or "any", and ``followed``, that of a band it is followed
    over; ``designed``, whether designs may vary it; ``deviation``, whether it is one from the
    nominal structure, which draws scatter by their spreads themselves.

    Examples
    --------
    >>> import symhbm as sh
    >>> stiffness = sh.laws.Parameter("N m-1", "stiffness of the stop", "$k_s$", bound="positive")
    >>> stiffness.units, stiffness.bound
    ('N m-1', 'positive')
    """

    units: str
    meaning: str
    symbol: str = ""
    unit: str | None = None
    per: Literal["dof", "contact", "blade"] | None = "contact"
    bound: str = "non-negative"
    followed: str = "non-negative"
    designed: bool = False
    deviation: bool = False

    @property
    def dims(self) -> tuple[str, ...]:
        """Dimensions of one value in a dataset, but of contacts with groups of their own."""
        return () if self.per is None else (self.per,)

    def shown_as(self, name: str) -> tuple[str, str]:
        """Symbol and unit of pictures."""
        return self.symbol or name.replace("_", " "), self.units if self.unit is None else self.unit


Values = dict[str, Any]
"""Values of the parameters of a law by name: arrays (n_contacts,), or symbols of one contact."""


class FixedValues(Values):
    """Values that stay as they are, with a law and what it ``made`` of them at any frequency."""

    made: tuple[Any, Any] = None, None


def symbols_of(law: Any) -> tuple[Any, Any, Values]:
    """A frequency and the values of a law as symbols, these also by their names."""
    values = ca.SX.sym("values", len(law.parameters))
    by_name = dict(zip(law.parameters, ca.vertsplit(values), strict=True))
    return ca.SX.sym("frequency"), values, by_name


class Motions(NamedTuple):
    """Motions over a period of contacts of one law: of several as numbers, of one as symbols.

    Attributes
    ----------
    basis
        The harmonic set, of ``K`` components.
    motion : (n, m K), or (m K) of symbols
        Coefficients of the relative displacements [m], direction by direction.
    frequency
        Angular frequency [rad/s], one or (n,).
    values
        Values of the parameters of the law by name: (n,) each, or symbols.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> from symhbm.model.contacts import Motions
    >>> from symhbm.numerics import FourierBasis
    >>> values = {"cubic_stiffness": np.array([1e8])}
    >>> at = Motions(FourierBasis((1,)), np.array([[1e-3, 0.0]]), 100.0, values)
    >>> sh.laws.CubicSpring().forces(at, sh.laws.CubicSpring().locate(at)).round(6)
    array([[0.075, 0.   ]])
    """

    basis: FourierBasis
    motion: Any
    frequency: Any
    values: Values

    @classmethod
    def symbols(cls, law: Any, basis: FourierBasis) -> tuple[Motions, list[Any]]:
        """A motion of one contact of a law as symbols; these are motion, frequency and values."""
        motion = ca.SX.sym("motion", basis.n_components * len(law.directions))
        frequency, values, by_name = symbols_of(law)
        return cls(basis, motion, frequency, by_name), [motion, frequency, values]

    def of(self, chosen: Any) -> Motions:
        """Those of some contacts."""
        values = {name: value[chosen] for name, value in self.values.items()}
        each = self.frequency[chosen] if np.ndim(self.frequency) else self.frequency
        return self._replace(motion=self.motion[chosen], frequency=each, values=values)

    def once(self, law: Any, make: Callable[[Any, Values], Any]) -> Any:
        """What a law makes of frequency and values, kept where the frequency does not move it."""
        frequency, values = self.frequency, self.values
        if not isinstance(values, FixedValues):
            return make(frequency, values)
        if values.made[0] is not law:
            values.made = law, None if law.margins_move else make(frequency, values)
        return make(frequency, values) if values.made[1] is None else values.made[1]

    def numbers(self, law: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Motions, frequencies (n,) and values (n, p), as functions of a law take them."""
        values = np.array([self.values[name] for name in law.parameters], dtype=float).T
        return self.motion, np.broadcast_to(self.frequency, len(self.motion)), values


class Switch(NamedTuple):
    """What a contact may do within a period or not, and the names of its two events.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.laws.Coulomb().switches[0].begins, sh.laws.Coulomb().switches[0].ends
    ('onset of slip', 'end of slip')
    """

    name: str
    begins: str
    ends: str


class Located(NamedTuple):
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
    >>> from symhbm.model.contacts import Motions
    >>> from symhbm.numerics import FourierBasis
    >>> values = {"contact_stiffness": 1e4, "friction_coefficient": 0.5, "normal_load": 3.0}
    >>> values = {name: np.array([value]) for name, value in values.items()}
    >>> at = Motions(FourierBasis((1,)), np.array([[1e-3, 0.0]]), 100.0, values)
    >>> located = sh.laws.Coulomb().locate(at)
    >>> located.states, located.margins.round(3)
    (array([[ True]]), array([[1.897]]))
    """

    events: FloatArray
    states: NDArray[np.bool_]
    margins: FloatArray
    margins_by_motion: FloatArray
    details: Any = None


class EventLoop(NamedTuple):
    """A loop that locates the events of contacts, one after the other.

    It takes the arrays of a ``basis``, motions (n, m K), ``values`` (n, p) that a law makes of
    frequency and values, and what is held (n,): -1 where the motion decides, else 0 or 1 of the
    first switch. It writes events (n, e), margins (n, q), their derivatives by the motion
    (n, q, m K), and details (n, d). Its result is 0, or what has failed.
    """

    loop: Loop
    basis: FourierBasis
    values: Callable[[Any, Values], FloatArray]
    n_details: int


class ByContact:
    """Details of `Located` that are arrays, of which each has an entry for each contact."""

    def split(self, count: int) -> list[Any]:
        """Those of as many points."""
        parts = [np.split(array, count) for array in vars(self).values()]
        return [type(self)(*each) for each in zip(*parts, strict=True)]


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


class Events(NamedTuple):
    """Instants that move with the motions of contacts, and the slopes of forces that jump there.

    At fixed instants first derivatives of forces are exact. Second derivatives are therefore those
    at fixed instants and a sum over instants: the gradient of the instant times the jump of the
    first derivatives, weighted by `share`.

    Attributes
    ----------
    contact : (k,)
        The contact of each instant.
    gradient : (k, v)
        Derivative of the angle [rad] by the `ContactLaw.event_variables`.
    jump : (k, m, v)
        Derivative of the forces by the variables in front of the instant, less that behind it.
        Where a force remembers a value of an instant: how fast its derivative moves with the angle.
    share : (k, K)
        What a jump of 1 adds to the coefficients of a force per angle: the functions of the basis
        at the instant, times `FourierBasis.norm`. Where the force remembers the instant: the
        coefficients of a force of 1 for as long as it does.
    """

    contact: NDArray[np.intp]
    gradient: FloatArray
    jump: FloatArray
    share: FloatArray

    @classmethod
    def joined(cls, *parts: Events) -> Events:
        """All of several."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))

    def second_derivatives(self, weights: FloatArray) -> FloatArray:
        """What the instants add (n, v, v) to those of forces times ``weights`` (n, m K)."""
        result = np.zeros((len(weights), *[self.gradient.shape[1]] * 2))
        _add(*map(np.ascontiguousarray, (*self, weights)), result)
        return result


class Behaviour(IntEnum):
    """What a contact does within a period: values of ``contact_state``."""

    STICKS, SLIPS, OPENS, NEVER_TOUCHES = range(4)


class History(NamedTuple):
    """One contact over a period, closed: the last point is the first of the next period.

    ``angle`` (n,) [rad]; ``displacement`` (m, n) [m] and ``force`` (m, n) [N] in the directions of
    its law, the normal force whole; ``limit`` (n,) [N], the largest friction force that the normal
    force allows; ``state`` (n,), what it does from each point on. Events are among the points.
    """

    angle: FloatArray
    displacement: FloatArray
    force: FloatArray
    limit: FloatArray
    state: NDArray[np.intp]

    def area(self, directions: list[int]) -> float:
        """Work of the forces in some directions per cycle [J]."""
        pairs = zip(self.force[directions], self.displacement[directions], strict=True)
        return float(sum(np.trapezoid(force, moved) for force, moved in pairs))

    def changes(self, before: tuple[int, ...], after: tuple[int, ...]) -> NDArray[np.intp]:
        """The points at which it goes from one of some states to one of others."""
        came = np.isin(np.roll(self.state[:-1], 1), before)
        return np.flatnonzero(came & np.isin(self.state[:-1], after))


def angles_from(first: float, events: FloatArray, n_angles: int) -> FloatArray:
    """Angles of a period from ``first`` on, its end and the events among them."""
    period = 2 * np.pi
    grid = first + period * np.arange(n_angles + 1) / n_angles
    return np.unique(np.concatenate([grid, first + (events - first) % period]))


@Loop
def _add(contact, gradient, jump, share, weights, result) -> None:
    """Add products of gradients and weighted jumps: their sum is symmetric, each need not be."""
    (n, m, v), size = jump.shape, share.shape[1]
    for e in range(n):
        for d in range(m):
            push = 0.0
            for i in range(size):
                push += weights[contact[e], d * size + i] * share[e, i] / 2
            for a in range(v):
                for b in range(v):
                    part = push * gradient[e, a] * jump[e, d, b]
                    result[contact[e], a, b] += part
                    result[contact[e], b, a] += part


def leading(motion: Any, a: int) -> tuple[Any, Any]:
    """Whether the harmonic of the components ``a`` and ``a + 1`` leads a motion, its square."""
    square = ca.sumsqr(motion[a : a + 2])
    return square > LEADING * ca.sumsqr(motion), square
