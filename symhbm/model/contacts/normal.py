"""What presses contacts: a preload or a gap, where they close and open, and the speed of rotation.

``v`` is the normal displacement of a contact, positive where it closes. Its spring carries
``p = N0 + k_n v`` where that is positive, and nothing else. ``N0`` is the preload, or ``-k_n g``
with a gap ``g``.

Along an engine order the angular frequency of the excitation is ``omega = engine_order Omega``, so
that the load ``F_n + centrifugal_load Omega^2`` depends on the frequency. In a structure at one
speed it does not.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, ClassVar, Literal, NamedTuple, get_args

import casadi as ca
import numpy as np

from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.motions import Motions, Parameter, SpringSliders, Switch, Values
from symhbm.numerics import RADIANS, Compiled, FloatArray, check, turning_points

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
_TOUCHES = 1e-100
"""Load [N], or less than no gap [m], of a contact that only touches."""


def given_of(normal_load: Any, gap: Any) -> tuple[Given, Any]:
    """Which of both is given, and its value; ValueError for none or both."""
    if (normal_load is None) == (gap is None):
        raise ValueError(
            f"normal_load={check.shown(normal_load)}, gap={check.shown(gap)}: expected one of them"
        )
    return ("gap", gap) if normal_load is None else ("normal_load", normal_load)


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
        return _load_slopes(self, 1).moves

    def monotone(self, values: Values) -> bool:
        """False: contacts that open make folds, and so may friction with a load that varies."""
        return False

    def holds(self, values: Values) -> Any:
        """Which displacements (n, m) hold a structure in the mean: the normal ones, by a spring."""
        stiffness = np.asarray(values["normal_stiffness"])
        held = np.zeros((len(stiffness), len(self.directions)), dtype=bool)
        held[:, self.directions.index("normal")] = stiffness > 0
        return held

    def closed(self) -> dict[str, float]:
        """They touch, with a load or a gap that is nothing but its sign."""
        return {self.given: -_TOUCHES if self.given == "gap" else _TOUCHES}

    def spring_sliders(self, frequency: float, values: Values) -> SpringSliders:
        """As springs and sliders of two directions, without friction where the law has none."""
        stiffness = np.asarray(values["normal_stiffness"], dtype=float)
        load = np.broadcast_to(np.asarray(self.load(frequency, values), float), stiffness.shape)
        tangential, friction = (
            np.asarray(values[name], dtype=float) if name in values else np.zeros_like(stiffness)
            for name in ("contact_stiffness", "friction_coefficient")
        )
        balanced = np.maximum(load, 0.0) * (self.preload == "balanced")
        return SpringSliders(tangential, stiffness, friction, load, balanced)

    def by_parameters(
        self, slopes: FloatArray, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives by frequency (n, q) and by values (p, n, q).

        From ``slopes`` (n, q, 4): those by ``k_t``, ``k_n``, ``mu`` and ``N0``.
        """
        each = slopes[:, :, 3:] * self.load_slopes(frequency, values)[:, None]
        names = "contact_stiffness", "normal_stiffness", "friction_coefficient"
        for place, name in enumerate(names):
            if name in values:
                each[:, :, 1 + [*self.parameters].index(name)] += slopes[:, :, place]
        return each[:, :, 0], each[:, :, 1:].transpose(2, 0, 1)

    def load_slopes(self, frequency: float, values: Values) -> FloatArray:
        """Derivatives of ``N0`` by frequency and values, (n, 1 + p)."""
        array = np.array([np.asarray(values[name], dtype=float) for name in self.parameters])
        n = array.shape[1]
        return _load_slopes(self, n)(np.full(n, frequency), array)

    def __repr__(self) -> str:
        words = [repr(self.given)] if self.given != "normal_load" else []
        words += [f"preload={self.preload!r}"] if self.preload != "balanced" else []
        words += [f"engine_order={self.engine_order}"] if self.engine_order is not None else []
        words += [f"speed={self.speed:g}"] if self.speed is not None else []
        return f"{type(self).__name__}({', '.join(words)})"


_LOADS = {
    "normal_load": Parameter("N", "normal load of the contact", "$F_n$", "N", designed=True),
    "gap": Parameter(
        "m", "gap of the contact", "$g$", "m", bound="any", followed="any", designed=True
    ),
}


class _Slopes(NamedTuple):
    """Compiled derivatives of the loads of ``n`` contacts; whether the frequency moves them."""

    compiled: Compiled
    moves: bool
    n: int

    def __call__(self, frequency: FloatArray, values: FloatArray) -> FloatArray:
        (slopes,) = self.compiled(frequency, values.T.ravel())
        return slopes.reshape(self.n, -1)


@lru_cache(maxsize=64)
def _load_slopes(law: NormalLaw, n: int) -> _Slopes:
    frequency, values = ca.SX.sym("frequency"), ca.SX.sym("values", len(law.parameters))
    by_name = dict(zip(law.parameters, ca.vertsplit(values), strict=True))
    load = ca.SX(law.load(frequency, by_name))
    slopes = ca.densify(ca.jacobian(load, ca.vertcat(frequency, values)))
    function = ca.Function("load_slopes", [frequency, values], [slopes])
    return _Slopes(Compiled(function.map(n)), bool(ca.jacobian(load, frequency).nnz()), n)
