"""A unilateral spring behind a gap or under a preload: the normal side of a contact alone.

    N = max(N0 + k_n v, 0)

with ``v`` positive where it closes, and ``N0`` the preload or ``-k_n g``.
"""

from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.group import Contacts
from symhbm.model.contacts.history import Behaviour, History
from symhbm.model.contacts.law import Located, Values
from symhbm.model.contacts.normal import NORMAL, PRESSED, NormalLaw, Preload, given_of
from symhbm.model.contacts.rotation import given_by_rotation
from symhbm.model.contacts.varying_load import VariableLoadFriction
from symhbm.numerics import FloatArray, FourierBasis

_FRICTION = VariableLoadFriction()


class UnilateralSpring(NormalLaw):
    """A spring that pushes and never pulls, behind a gap or under a preload.

    ``given`` names the parameter, ``preload`` says from where displacements are measured: see
    `symhbm.Gap`, which makes groups of such contacts.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.UnilateralSpring("gap")
    UnilateralSpring('gap')
    """

    directions = ("normal",)
    switches = PRESSED
    variables: ClassVar = NORMAL

    def acts(self, values: Values) -> NDArray[np.bool_]:
        """Those that have a spring."""
        return np.asarray(values["normal_stiffness"]) > 0

    def n_events(self, basis: FourierBasis) -> int:
        """``E`` and ``e`` of `symhbm.model.contacts.varying_load.coefficients`."""
        return basis.n_components**2 + basis.n_components

    def force(
        self, basis: FourierBasis, motion: Any, frequency: Any, values: Values, events: Any
    ) -> Any:
        """``N`` less the share of the preload that the equilibrium holds."""
        size = basis.n_components
        matrix, closed = ca.reshape(events[: size * size], size, size), events[size * size :]
        spring = values["normal_stiffness"] * ca.mtimes(matrix, motion)
        held = ca.DM((basis.order == 0).astype(float)) * self.balanced_load(frequency, values)
        # In this order a small motion keeps its digits beside a load that is held.
        return spring + (self.load(frequency, values) * closed - held)

    def locate(
        self,
        basis: FourierBasis,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
        held: NDArray[np.bool_] | None = None,
    ) -> Located:
        """Where the contact opens and closes; no derivative bends there, so nothing is imposed."""
        size = basis.n_components
        located = _FRICTION.locate(basis, *self._as_friction(motion, frequency, values))
        matrix = located.events[:, 3 * size * size : 4 * size * size]
        events = np.concatenate([matrix, located.events[:, -size:]], axis=1)
        margins, by_motion = located.margins[:, 1:], located.margins_by_motion[:, 1:, size:]
        return Located(events, margins > 0, margins, by_motion, located.details)

    def margins_within(
        self,
        basis: FourierBasis,
        motion: FloatArray,
        error: FloatArray,
        frequency: FloatArray,
        values: Values,
    ) -> FloatArray:
        """Margins and what the error does to them, without the force."""
        same, _, of_friction = self._as_friction(motion, frequency, values)
        padded = np.concatenate([np.zeros((len(error), 1)), error], axis=1)
        return _FRICTION.margins_within(basis, same, padded, frequency, of_friction)[:, 1:]

    def _as_friction(
        self, motion: FloatArray, frequency: float | FloatArray, values: Values
    ) -> tuple[FloatArray, Any, Values]:
        """The same contacts with a slider that neither moves nor pulls."""
        stiffness = np.asarray(values["normal_stiffness"], dtype=float)
        nothing = np.zeros(len(stiffness))
        load = np.broadcast_to(self.load(frequency, values), stiffness.shape)
        of_friction = dict(
            contact_stiffness=nothing,
            friction_coefficient=nothing,
            normal_stiffness=stiffness,
            normal_load=load,
        )
        return np.concatenate([np.zeros_like(motion), motion], axis=1), frequency, of_friction

    def margin_slopes(
        self, located: Located, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the margins by the frequency and by the parameters."""
        by_stiffness, _, by_load = located.details.margin_slopes[:, 1:, -3:].transpose(2, 0, 1)
        each = self.load_slopes(frequency, values)[1].T[:, :, None] * by_load
        each[1 + [*self.parameters].index("normal_stiffness")] += by_stiffness
        return each[0], each[1:]

    def margin_expansion(
        self, basis: FourierBasis, motion: FloatArray, frequency: float, values: Values, switch: int
    ) -> tuple[float, FloatArray, FloatArray]:
        """Margin, gradient and second derivatives, events moving with what they are of."""
        each = {name: np.reshape(value, 1) for name, value in values.items()}
        same, _, of_friction = self._as_friction(motion[None], frequency, each)
        one = {name: float(value[0]) for name, value in of_friction.items()}
        found = _FRICTION.margin_expansion(basis, same[0], frequency, one, 1 + switch)
        margin, gradient, curvature = found
        size, names = len(motion), [*_FRICTION.parameters]
        _, first, second = self.load_slopes(frequency, each)
        n = first.shape[1]
        spread = np.zeros((len(gradient), size + n))
        spread[size : 2 * size, :size] = np.eye(size)
        spread[2 * size + 1 + names.index("normal_load"), size:] = first[0]
        at = 1 + [*self.parameters].index("normal_stiffness")
        spread[2 * size + 1 + names.index("normal_stiffness"), size + at] = 1
        whole = spread.T @ curvature @ spread
        whole[size:, size:] += gradient[2 * size + 1 + names.index("normal_load")] * second[0]
        return margin, gradient @ spread, whole

    def largest_force(self, values: Values, size: float, switched: bool) -> FloatArray:
        """The spring's, of contacts that open."""
        return self.stiffest(values) * switched * size

    def stiffest(self, values: Values) -> FloatArray:
        """The spring's."""
        return np.asarray(values["normal_stiffness"], dtype=float)

    def results(
        self,
        basis: FourierBasis,
        located: Located,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
    ) -> dict[str, FloatArray]:
        """State, open share of the period, and normal forces [N]; the spring dissipates nothing."""
        opens, touches = located.states.T
        state = np.where(opens, Behaviour.OPENS, Behaviour.STICKS)
        of_friction = _FRICTION.period_figures(located.details)
        named = {name: of_friction[name] for name in self.variables}
        return named | dict(contact_state=np.where(touches, state, Behaviour.NEVER_TOUCHES))

    def history(
        self,
        basis: FourierBasis,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
        n_angles: int,
    ) -> list[History]:
        """The normal side of a contact without friction."""
        both = _FRICTION.history(basis, *self._as_friction(motion, frequency, values), n_angles)
        return [
            one._replace(displacement=one.displacement[1:], force=one.force[1:]) for one in both
        ]

    def event_variables(self, motion: Any, frequency: Any, values: Values) -> Any:
        """Motion, ``k_n`` and ``N0``."""
        return ca.vertcat(motion, values["normal_stiffness"], self.load(frequency, values))

    def moving_events(
        self,
        basis: FourierBasis,
        located: Located,
        motion: FloatArray,
        frequency: float,
        values: Values,
        weights: FloatArray,
    ) -> FloatArray:
        """See `symhbm.model.contacts.varying_load.moving_events`."""
        same, _, of_friction = self._as_friction(motion, frequency, values)
        padded = np.concatenate([np.zeros_like(weights), weights], axis=1)
        arguments = located, same, frequency, of_friction, padded
        result, size = _FRICTION.moving_events(basis, *arguments), motion.shape[1]
        kept = np.r_[size : 2 * size, 2 * size + 1, 2 * size + 3]
        return result[:, kept[:, None], kept]


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
    >>> problem = sh.HarmonicBalance(blade, sh.PointForce(amplitude=5.0), (0, 1, 2, 3))
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
