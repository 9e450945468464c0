"""What presses contacts: a preload or a gap, where they close and open, and the speed of rotation.

``v`` is the normal displacement of a contact, positive where it closes. Its spring carries
``p = N0 + k_n v`` where that is positive, and nothing else. ``N0`` is the preload, or ``-k_n g``
with a gap ``g``.

Along an engine order the angular frequency of the excitation is ``omega = engine_order Omega``, so
that the load ``F_n + centrifugal_load Omega^2`` depends on the frequency. In a structure at one
speed it does not.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.law import ContactLaw, moves, slopes_of
from symhbm.model.contacts.motions import (
    Behaviour,
    ByContact,
    Located,
    Motions,
    Parameter,
    SpringSliders,
    Switch,
    Values,
)
from symhbm.model.contacts.press import SLIPS
from symhbm.numerics import RADIANS, FloatArray, check, turning_points

FRICTION = {
    "contact_stiffness": Parameter(
        "N m-1", "stiffness of the contact", "$k_d$", "N/m", designed=True
    ),
    "friction_coefficient": Parameter("1", "friction coefficient", r"$\mu$", "", designed=True),
}
"""Parameters of a spring and a slider, beside what presses them."""
NORMAL_LOAD = Parameter("N", "normal load of the contact", "$F_n$", "N", designed=True)
LOAD = "centrifugal_load"
LOAD_RECORD = Parameter(
    "kg m",
    "load of the contact over the square of the speed of rotation",
    r"$F_n / \Omega^2$",
    "kg m",
    designed=True,
)


def check_order(engine_order: int | None) -> int | None:
    """An engine order from 1, or None without rotation; raises TypeError or ValueError."""
    return None if engine_order is None else check.integer("engine_order", engine_order, 1)


def of_rotation(law: ContactLaw) -> dict[str, Parameter]:
    """The parameter by which rotation presses a contact, where it does."""
    return {} if law.engine_order is law.speed is None else {LOAD: LOAD_RECORD}


def centrifugal(law: ContactLaw, frequency: Any, values: Values) -> Any:
    """What rotation adds to a load [N] at an angular frequency, of arrays or of symbols."""
    if law.speed is not None:
        return values[LOAD] * (RADIANS * law.speed / 60) ** 2
    return 0 if law.engine_order is None else values[LOAD] * (frequency / law.engine_order) ** 2


def given_by_rotation(centrifugal_load: Any, engine_order: int | None) -> dict[str, Any]:
    """The value of the parameter; ValueError for a load without an engine order or vice versa."""
    if (centrifugal_load is None) != (engine_order is None):
        raise ValueError(
            f"centrifugal_load={check.shown(centrifugal_load)}, engine_order="
            f"{check.shown(engine_order)}: expected both, or neither"
        )
    return {} if engine_order is None else {LOAD: centrifugal_load}


Given = Literal["normal_load", "gap"]
"""What is a parameter and stays as it is where the normal stiffness changes."""
Preload = Literal["balanced", "coupled"]
"""Whether displacements are measured from the equilibrium under the preload, or from without it."""
PRESSED = (
    Switch("open", "onset of opening", "end of opening"),
    Switch("touch", "onset of contact", "end of contact"),
)
"""What a contact that opens and closes may do within a period."""
NORMAL = {
    "open_fraction": ("1", "share of the period that the contact is open"),
    "mean_normal_force": ("N", "normal force in the mean over the period"),
    "least_normal_force": ("N", "smallest normal force over the period, 0 where it opens"),
    "largest_normal_force": ("N", "largest normal force over the period"),
}
"""Units and meaning of what datasets tell of normal forces."""
SLIDER = {"slip_distance": ("m", "path of the slider per cycle while the contact is closed")}
"""The same of friction under such a force."""
_FIGURES = "stick_fraction", *NORMAL, *SLIDER
"""What a contact does over a period, column by column of `Periods`."""
_PHYSICAL = "contact_stiffness", "normal_stiffness", "friction_coefficient"
"""The parameters ``k_t``, ``k_n`` and ``mu``, which not all laws have."""
_TOUCHES = 1e-100
"""Load [N], or less than no gap [m], of a contact that only touches."""


def given_of(normal_load: Any, gap: Any) -> tuple[Given, Any]:
    """Which of both is given, and its value; ValueError for none or both."""
    if (normal_load is None) == (gap is None):
        raise ValueError(
            f"normal_load={check.shown(normal_load)}, gap={check.shown(gap)}: expected one of them"
        )
    return ("gap", gap) if normal_load is None else ("normal_load", normal_load)


@dataclass(frozen=True)
class Periods(ByContact):
    """What contacts do over one period.

    Attributes
    ----------
    figures : (n, 6)
        Shares of it that they stick and are open, the mean, the least and the largest normal force
        [N], and the path of the slider [m].
    margin_slopes : (n, q, 4)
        Derivatives of the margins by ``k_t``, ``k_n``, ``mu`` and ``N0``.
    """

    figures: FloatArray
    margin_slopes: FloatArray

    @classmethod
    def of(cls, details: FloatArray) -> "Periods":
        """Those that a loop wrote, contact by contact and one after the other."""
        n, size = details.shape
        return cls(details[:, :6], details[:, 6:].reshape(n, (size - 6) // 4, 4))


class NormalLaw(ContactLaw):
    """A law with a normal direction, whose load comes from a preload or from a gap.

    ``given`` says which of both is the parameter; ``preload="balanced"`` says that displacements
    are measured from the equilibrium under the preload, ``"coupled"`` that static loads press the
    contact in harmonic 0. With an ``engine_order`` rotation presses the contact, too, by the
    parameter ``centrifugal_load``, see `symhbm.model.contacts.normal`, as it does at a ``speed``
    [1/min]. Raises ValueError for other words.
    """

    odd = False
    friction: ClassVar[Mapping[str, Parameter]] = {}
    """Parameters beside those of the normal side."""

    def __init__(
        self,
        given: Given = "normal_load",
        preload: Preload = "balanced",
        engine_order: int | None = None,
        speed: float | None = None,
    ):
        self.given = check.one_of("given", given, get_args(Given))
        self.preload = check.one_of("preload", preload, get_args(Preload))
        self.engine_order, self.speed = check_order(engine_order), speed

    @property
    def parameters(self) -> Mapping[str, Parameter]:  # type: ignore[override]
        """Its parameters by name: those of friction, the normal stiffness, and what is given."""
        stiffness = Parameter(
            "N m-1", "normal stiffness of the contact", "$k_n$", "N/m", designed=True
        )
        of_load = {"normal_stiffness": stiffness, self.given: _LOADS[self.given]}
        return {**self.friction, **of_load, **of_rotation(self)}

    def load(self, frequency: Any, values: Values) -> Any:
        """``N0`` [N] at an angular frequency [rad/s], of arrays or of symbols; negative: a gap."""
        if self.given == "gap":
            at_rest = -values["normal_stiffness"] * values["gap"]
        else:
            at_rest = values["normal_load"]
        return at_rest + centrifugal(self, frequency, values)

    def balanced_load(self, frequency: Any, values: Values) -> Any:
        """The share of the normal force that the equilibrium holds, as a CasADi expression [N]."""
        if self.preload == "coupled":
            return 0
        return ca.fmax(self.load(frequency, values), 0)

    def balanced_force(self, at: Motions) -> Any:
        """The same as Fourier coefficients."""
        mean = ca.DM((at.basis.order == 0).astype(float))
        return mean * self.balanced_load(at.frequency, at.values)

    def sampled(self, samples: int) -> "NormalLaw":
        """ValueError: such contacts are located, and nothing is marched over samples."""
        raise ValueError(
            f"samples={samples}: expected None, events of {self!r} are located; over samples "
            "contacts that open are known to the first order only"
        )

    def margin_instants(self, at: Motions, switch: int) -> FloatArray:
        """Where the normal load is smallest, or largest."""
        points = turning_points(at.basis, at.motion[:, -at.basis.n_components :])
        opens = self.switches[switch] == PRESSED[0]
        return points.angle[0, [points.lowest[0] if opens else 0]]

    def margin(self, at: Motions, switch: int, functions: list[Any]) -> Any:
        """Of opening and touch: the extremes of the load over its size."""
        push = at.values["normal_stiffness"] * at.motion[-at.basis.n_components :]
        press = self.load(at.frequency, at.values) + ca.dot(functions[0], push)
        sign = -1 if self.switches[switch] == PRESSED[0] else 1
        return sign * press / ca.sqrt(self.size_of_load(at))

    def size_of_load(self, at: Motions) -> Any:
        """The square of what margins compare the load with."""
        push = at.values["normal_stiffness"] * at.motion[-at.basis.n_components :]
        mean = ca.DM((at.basis.order == 0).astype(float))
        load = self.load(at.frequency, at.values) + ca.dot(mean, push)
        return ca.sumsqr((1 - mean) * push) + load**2

    @property
    def margins_move(self) -> bool:
        """Whether the load depends on the frequency."""
        return moves(self, "load")

    def physical(self, frequency: float | FloatArray, values: Values) -> FloatArray:
        """``k_t``, ``k_n``, ``mu`` and ``N0`` of contacts, (n, 4): 0 for those the law has not."""
        result = np.zeros((len(next(iter(values.values()))), 4))
        for column, name in enumerate(_PHYSICAL):
            result[:, column] = values.get(name, 0.0)
        result[:, 3] = self.load(frequency, values)
        return result

    def acts(self, values: Values) -> NDArray[np.bool_]:
        """Those that have a spring which pushes, or one which pulls under a load."""
        stiffness, normal, friction, load = self.physical(1.0, values).T
        return (normal > 0) | ((stiffness * friction > 0) & ((load > 0) | self.margins_move))

    def holds(self, values: Values) -> Any:
        """Which displacements (n, m) hold a structure in the mean: the normal ones, by a spring."""
        presses = np.array([name == "normal" for name in self.directions])
        return presses & (self.physical(1.0, values)[:, 1:2] > 0)

    def largest_force(self, values: Values, size: float, switched: bool) -> FloatArray:
        """The springs', of contacts that slip or open."""
        return self.stiffest(values) * switched * size

    def stiffest(self, values: Values) -> FloatArray:
        """The stiffer spring's."""
        return self.physical(1.0, values)[:, :2].max(axis=1)

    def stuck_stiffness(self, values: Values) -> FloatArray:
        """Each spring's, the tangential one along both directions of a plane."""
        return self.physical(1.0, values)[:, [int(name == "normal") for name in self.directions]]

    def released(self) -> dict[str, float]:
        """Without friction contacts slide freely."""
        return {"friction_coefficient": 0.0} if self.friction else {}

    def closed(self) -> dict[str, float]:
        """They touch, with a load or a gap that is nothing but its sign."""
        return {self.given: -_TOUCHES if self.given == "gap" else _TOUCHES}

    def spring_sliders(self, frequency: float, values: Values) -> SpringSliders:
        """As springs and sliders of two directions, without friction where the law has none."""
        tangential, normal, friction, load = self.physical(frequency, values).T
        balanced = np.maximum(load, 0.0) * (self.preload == "balanced")
        return SpringSliders(tangential, normal, friction, load, balanced)

    def margin_arrays(self, motion: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Where loops write margins (n, q), and their derivatives by motion and `physical`."""
        shape = len(motion), len(self.switches)
        return np.empty(shape), np.empty((*shape, motion.shape[1])), np.empty((*shape, 4))

    def margin_changes(self, at: Motions, change: FloatArray, margins: FloatArray) -> FloatArray:
        """Margins are ratios: of the extremes of loads and walls, over the size of both."""
        size, moving = at.basis.n_components, at.basis.order > 0
        stiffness, normal, friction, load = self.physical(at.frequency, at.values).T
        pull, push = (
            stiffness[:, None] * at.motion[:, :-size],
            normal[:, None] * at.motion[:, -size:],
        )
        loads = np.sum(push[:, moving] ** 2, axis=1) + (load + push[:, ~moving].sum(axis=1)) ** 2
        pushed = normal * change[:, -size:].sum(axis=1)
        pulled = stiffness * change[:, :-size].sum(axis=1) + friction * pushed
        walls = np.sum(pull.reshape(len(pull), -1, size)[:, :, moving] ** 2, axis=(1, 2))
        parts = {"slip": (2.0, pulled, np.sqrt(walls + friction**2 * loads))}
        others = 1.0, pushed, np.sqrt(loads)
        each = [parts.get(switch.name, others) for switch in self.switches]
        largest, moved, sizes = (np.array(part).T for part in zip(*each, strict=True))
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = (largest + np.abs(margins)) * moved / (sizes - moved)
        return np.where(moved < sizes, bound, np.inf)

    def held_states(self, margins: FloatArray, held: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
        """States by margins, that of slip as it is imposed where it has a limit to pass."""
        states = margins > 0
        if held is not None:
            finite = np.isfinite(margins[:, SLIPS])
            states[:, SLIPS] = np.where(finite, held[:, SLIPS], states[:, SLIPS])
        return states

    def margin_slopes(
        self, located: Located, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the margins by the frequency and by the parameters."""
        slopes = located.details.margin_slopes[:, -len(self.switches) :]
        each = slopes[:, :, 3:] * slopes_of(self, "load", frequency, values)[:, None]
        for place, name in enumerate(_PHYSICAL):
            if name in values:
                each[:, :, 1 + [*self.parameters].index(name)] += slopes[:, :, place]
        return each[:, :, 0], each[:, :, 1:].transpose(2, 0, 1)

    def results(self, at: Motions, located: Located) -> dict[str, FloatArray]:
        """State, share of the period that is open and normal forces [N].

        With friction also the share of stick, the path of the slider [m] and energy [J].
        """
        names = [switch.name for switch in self.switches]
        on = dict(zip(names, located.states.T, strict=True))
        state = np.where(on.get("slip", False), Behaviour.SLIPS, Behaviour.STICKS)
        if "open" in on:
            state = np.where(on["open"], Behaviour.OPENS, state)
            state = np.where(on["touch"], state, Behaviour.NEVER_TOUCHES)
        figures = dict(zip(_FIGURES, located.details.figures.T, strict=True))
        if not self.friction:
            return {name: figures[name] for name in NORMAL} | {"contact_state": state}
        return super().results(at, located) | figures | {"contact_state": state}

    def __repr__(self) -> str:
        words = [repr(self.given)] if self.given != "normal_load" else []
        words += [f"preload={self.preload!r}"] if self.preload != "balanced" else []
        words += [f"engine_order={self.engine_order}"] if self.engine_order is not None else []
        words += [f"speed={self.speed:g}"] if self.speed is not None else []
        return f"{type(self).__name__}({', '.join(words)})"


_LOADS = {
    "normal_load": NORMAL_LOAD,
    "gap": Parameter(
        "m", "gap of the contact", "$g$", "m", bound="any", followed="any", designed=True
    ),
}
