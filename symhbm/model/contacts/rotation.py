"""Loads of contacts that grow with the square of the speed of rotation.

Along an engine order the angular frequency of the excitation is ``omega = engine_order Omega``,
so that the load ``F_n + centrifugal_load Omega^2`` depends on the frequency. In a structure at one
speed it does not.
"""

from typing import Any, ClassVar

from symhbm.model.contacts.coulomb import Coulomb
from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.motions import Values
from symhbm.model.contacts.parameter import Parameter
from symhbm.numerics import RADIANS, check

LOAD = "centrifugal_load"
_RECORD = Parameter(
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
    return {} if law.engine_order is law.speed is None else {LOAD: _RECORD}


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

    parameters: ClassVar = {**Coulomb.parameters, LOAD: _RECORD}

    def __init__(self, engine_order: int | None = 1, speed: float | None = None):
        self.engine_order, self.speed = check_order(engine_order), speed

    def slip_limit(self, frequency: Any, values: Values) -> Any:
        """``mu`` times the load [N] at an angular frequency [rad/s]."""
        added = centrifugal(self, frequency, values)
        return values["friction_coefficient"] * (values["normal_load"] + added)

    def __repr__(self) -> str:
        at = self.engine_order if self.speed is None else f"speed={self.speed:g}"
        return f"PressedCoulomb({at})"
