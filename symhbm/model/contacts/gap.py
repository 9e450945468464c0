"""A unilateral spring behind a gap or under a preload: the normal side of a contact alone.

    N = max(N0 + k_n v, 0)

with ``v`` positive where it closes, and ``N0`` the preload or ``-k_n g``.
"""

from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.group import Contacts
from symhbm.model.contacts.motions import EventLoop, Events, History, Located, Motions
from symhbm.model.contacts.normal import (
    NORMAL,
    PRESSED,
    NormalLaw,
    Preload,
    given_by_rotation,
    given_of,
)
from symhbm.model.contacts.varying_load import (
    Marched,
    VariableLoadFriction,
    locate_normal,
    n_details,
)
from symhbm.numerics import FloatArray, FourierBasis

_FRICTION = VariableLoadFriction()


class UnilateralSpring(NormalLaw):
    """A spring that pushes and never pulls, behind a gap or under a preload.

    ``given`` names the parameter, ``preload`` says from where displacements are measured: see
    `symhbm.Gap`, which makes groups of such contacts.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.laws.UnilateralSpring("gap")
    UnilateralSpring('gap')
    """

    directions = ("normal",)
    switches = PRESSED
    variables: ClassVar = NORMAL

    def n_events(self, basis: FourierBasis) -> int:
        """``E`` and ``e`` of `symhbm.model.contacts.varying_load.batch`."""
        return basis.n_components**2 + basis.n_components

    def force(self, at: Motions, events: Any) -> Any:
        """``N`` less the share of the preload that the equilibrium holds."""
        basis, motion, frequency, values = at
        size = basis.n_components
        matrix, closed = ca.reshape(events[: size * size], size, size), events[size * size :]
        spring = values["normal_stiffness"] * ca.mtimes(matrix, motion)
        # In this order a small motion keeps its digits beside a load that is held.
        held = self.balanced_force(at)
        return spring + (self.load(frequency, values) * closed - held)

    def locate(self, at: Motions, held: NDArray[np.bool_] | None = None) -> Located:
        """Where the contact opens and closes; no derivative bends there, so nothing is imposed."""
        (events, margins, by_motion, found), _ = self.by_loop(self.event_loop(at.basis), at, held)
        return Located(events, margins > 0, margins, by_motion, Marched.of(found))

    def event_loop(self, basis: FourierBasis) -> EventLoop:
        """What locates them."""
        return EventLoop(locate_normal, basis, self.physical, n_details(basis.highest))

    def margins_within(self, at: Motions, error: FloatArray) -> FloatArray:
        """Margins and what the error does to them, without the force."""
        padded = np.concatenate([np.zeros((len(error), 1)), error], axis=1)
        return _FRICTION.margins_within(self._as_friction(at), padded)[:, 1:]

    def _as_friction(self, at: Motions) -> Motions:
        """The same contacts with a slider that neither moves nor pulls."""
        names = "contact_stiffness", "normal_stiffness", "friction_coefficient", "normal_load"
        values = dict(zip(names, self.physical(at.frequency, at.values).T, strict=True))
        both = np.concatenate([np.zeros_like(at.motion), at.motion], axis=1)
        return at._replace(motion=both, values=values)

    def history(self, at: Motions, n_angles: int) -> list[History]:
        """The normal side of a contact without friction."""
        both = _FRICTION.history(self._as_friction(at), n_angles)
        return [
            one._replace(displacement=one.displacement[1:], force=one.force[1:]) for one in both
        ]

    def event_variables(self, at: Motions) -> Any:
        """Motion, ``k_n`` and ``N0``."""
        _, motion, frequency, values = at
        return ca.vertcat(motion, values["normal_stiffness"], self.load(frequency, values))

    def moving(self, at: Motions, located: Located) -> Events:
        """Those of friction that change the normal force."""
        size, events = at.motion.shape[1], _FRICTION.moving(self._as_friction(at), located)
        kept = np.r_[size : 2 * size, 2 * size + 1, 2 * size + 3]
        return events._replace(gradient=events.gradient[:, kept], jump=events.jump[:, 1:, kept])


class Gap(Contacts):
    """Stops: springs that push and never pull, behind a gap or under a preload.

    ``N = max(N0 + k_n v, 0)``, with ``v`` positive where the contact closes.

    Parameters
    ----------
    normal
        Where contacts act, see `symhbm.Contacts`.
    normal_stiffness
        ``k_n`` [N/m], one value or one per contact.
    gap, normal_load
        The gap [m], with ``N0 = -k_n gap``, or the preload ``N0`` [N]. The one that is given is the
        parameter: it stays as it is where the normal stiffness changes.
    preload, centrifugal_load, engine_order
        As of `symhbm.Friction`.

    Raises
    ------
    TypeError, ValueError
        As `symhbm.Contacts`, and for neither or both of ``gap`` and ``normal_load``.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.Model(
    ...     [[1.0]], [[2.0]], [[1e4]],
    ...     contacts={"stop": sh.Gap(normal=(0,), normal_stiffness=2e4, gap=1e-3)},
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=5.0), (0, 1, 2, 3))
    >>> sh.frf(problem, (10, 25), progress=False).event_kind.values[0]
    'onset of contact'
    """

    def __init__(
        self,
        *,
        normal: Any,
        normal_stiffness: Any,
        gap: Any = None,
        normal_load: Any = None,
        preload: Preload = "balanced",
        centrifugal_load: Any = None,
        engine_order: int | None = None,
    ):
        given, load = given_of(normal_load, gap)
        law = UnilateralSpring(given, preload, engine_order)
        values = {given: load} | given_by_rotation(centrifugal_load, engine_order)
        super().__init__(law, normal=normal, normal_stiffness=normal_stiffness, **values)
