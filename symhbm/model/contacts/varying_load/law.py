"""Dry friction whose normal load varies with the motion, up to lift-off.

A contact has a tangential displacement ``u`` and a normal one ``v``, positive where it closes:

    N = max(N0 + k_n v, 0),        T = k_t (u - w),  |T| <= mu N,

where the slider ``w`` moves only while ``|T| = mu N`` and follows ``u`` where the contact is apart.
Both forces are continuous in time, at re-contact too.

References: E. P. Petrov, D. J. Ewins, J. Turbomach. 125 (2003), 364-371; B. D. Yang, M. L. Chu,
C. H. Menq, J. Sound Vib. 210 (1998), 461-481.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.motions import EventLoop, Events, History, Located, Motions, Switch
from symhbm.model.contacts.normal import (
    FRICTION,
    NORMAL,
    PRESSED,
    SLIDER,
    SLIPS,
    NormalLaw,
    Periods,
)
from symhbm.model.contacts.varying_load.batch import estimate, locate, n_details
from symhbm.model.contacts.varying_load.march import history_of
from symhbm.model.contacts.varying_load.moving import moving_events
from symhbm.numerics import FloatArray, FourierBasis, turning_points


@dataclass(frozen=True)
class Marched(Periods):
    """What contacts do over one period, and their pieces.

    Attributes
    ----------
    pieces : (n, most, 6)
        What they do one after the other, see `symhbm.model.contacts.varying_load.march`.
    counts : (n,)
        How many pieces each contact has.
    """

    pieces: FloatArray
    counts: NDArray[np.intp]

    @classmethod
    def of(cls, details: FloatArray) -> "Marched":
        """Those that a loop wrote, contact by contact and one after the other."""
        n, size = details.shape
        slopes, counts = details[:, 6:18].reshape(n, 3, 4), details[:, 18].astype(int)
        return cls(details[:, :6], slopes, details[:, 19:].reshape(n, (size - 19) // 6, 6), counts)


class VariableLoadFriction(NormalLaw):
    """Spring and slider whose normal load varies with the motion, up to lift-off.

    ``given`` names the parameter of the normal side, ``preload`` says from where displacements
    are measured: see `symhbm.Friction`, which makes groups of such contacts.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.laws.VariableLoadFriction("gap").parameters["gap"].units
    'm'
    """

    directions = ("tangential", "normal")
    switches = (Switch("slip", "onset of slip", "end of slip"), *PRESSED)
    drawn_as = "friction"
    variables: ClassVar = NORMAL | SLIDER
    friction = FRICTION

    def n_events(self, basis: FourierBasis) -> int:
        """``A, B, C, E`` and ``b, c, e`` of `symhbm.model.contacts.varying_load.batch`."""
        return 4 * basis.n_components**2 + 3 * basis.n_components

    def force(self, at: Motions, events: Any) -> Any:
        """``T`` and ``N`` less the share of the preload that the equilibrium holds."""
        by_pull, by_press, by_normal, rest = self._linear(at, events)
        u, v = ca.vertsplit(at.motion, at.basis.n_components)
        tangential = ca.mtimes(by_pull, u) + ca.mtimes(by_press, v)
        return ca.vertcat(tangential, ca.mtimes(by_normal, v)) + rest

    def terms(self, at: Motions, travel: Any, events: Any) -> tuple[Any, Any]:
        """Those of the force, which is linear in the motion."""
        *slopes, rest = self._linear(at, events)
        by_pull, by_press, by_normal = map(ca.fabs, slopes)
        u, v = ca.vertsplit(travel, at.basis.n_components)
        tangential = ca.mtimes(by_pull, u) + ca.mtimes(by_press, v)
        return ca.vertcat(tangential, ca.mtimes(by_normal, v)) + ca.fabs(rest), 0

    def _linear(self, at: Motions, events: Any) -> tuple[Any, Any, Any, Any]:
        """Derivatives of ``T`` by ``u`` and ``v`` and of ``N`` by ``v``, and the rest of both."""
        size, values = at.basis.n_components, at.values
        load = self.load(at.frequency, values)
        parts = [events[k * size * size : (k + 1) * size * size] for k in range(4)]
        by_pull, by_anchor, by_wall, by_normal = (ca.reshape(part, size, size) for part in parts)
        anchor, wall, closed = (events[(4 * size + k) * size :][:size] for k in range(3))
        normal, friction = values["normal_stiffness"], values["friction_coefficient"]
        return (
            values["contact_stiffness"] * by_pull,
            -normal * (by_anchor + friction * by_wall),
            normal * by_normal,
            ca.vertcat(-load * (anchor + friction * wall), load * closed - self.balanced_force(at)),
        )

    def locate(self, at: Motions, held: NDArray[np.bool_] | None = None) -> Located:
        """Locate all events; slip alone can be imposed, opening and closing bend no derivative."""
        (events, margins, by_motion, found), _ = self.by_loop(self.event_loop(at.basis), at, held)
        states = self.held_states(margins, held)
        return Located(events, states, margins, by_motion, Marched.of(found))

    def event_loop(self, basis: FourierBasis) -> EventLoop:
        """What locates all events."""
        return EventLoop(locate, basis, self.physical, n_details(basis.highest))

    def margins_within(self, at: Motions, error: FloatArray) -> FloatArray:
        """Margins and what the error does to them, without the force."""
        basis, motion, frequency, values = at
        margins, by_motion, _ = written = self.margin_arrays(motion)
        arrays = map(np.ascontiguousarray, (motion, self.physical(frequency, values)))
        estimate(*basis.arrays[:2], *arrays, *written)
        return margins + error * np.linalg.norm(by_motion, axis=-1)

    def margin_instants(self, at: Motions, switch: int) -> FloatArray:
        """Of slip: where ``low`` is largest and ``high`` smallest."""
        if switch != SLIPS:
            return super().margin_instants(at, switch)
        stiffness, normal, friction, _ = self.physical(at.frequency, at.values)[0]
        u, v = at.motion.reshape(2, -1)
        press = friction * normal * v
        points = turning_points(at.basis, stiffness * u + np.array([-press, press]))
        return points.angle[[0, 1], [0, points.lowest[1]]]

    def margin(self, at: Motions, switch: int, functions: list[Any]) -> Any:
        """Of slip: the largest ``low`` less the smallest ``high``, over their sizes."""
        if switch != SLIPS:
            return super().margin(at, switch, functions)
        u, v = ca.vertsplit(at.motion, at.basis.n_components)
        pull, friction = at.values["contact_stiffness"] * u, at.values["friction_coefficient"]
        load, push = self.load(at.frequency, at.values), at.values["normal_stiffness"] * v
        beyond = ca.dot(functions[0] - functions[1], pull)
        beyond -= friction * (2 * load + ca.dot(functions[0] + functions[1], push))
        moving = ca.DM((at.basis.order > 0).astype(float))
        return beyond / ca.sqrt(ca.sumsqr(moving * pull) + friction**2 * self.size_of_load(at))

    def history(self, at: Motions, n_angles: int) -> list[History]:
        """From the pieces that `locate` finds."""
        periods, physical = self.locate(at).details, self.physical(at.frequency, at.values)
        pieces = [each[:count] for each, count in zip(periods.pieces, periods.counts, strict=True)]
        each = zip(at.motion, physical, pieces, strict=True)
        return [history_of(at.basis, *one, n_angles) for one in each]

    def event_variables(self, at: Motions) -> Any:
        """Motion, ``k_t``, ``k_n``, ``mu`` and ``N0``."""
        _, motion, frequency, values = at
        names = "contact_stiffness", "normal_stiffness", "friction_coefficient"
        return ca.vertcat(motion, *map(values.__getitem__, names), self.load(frequency, values))

    def moving(self, at: Motions, located: Located) -> Events:
        """See `symhbm.model.contacts.varying_load.moving`."""
        periods, size = located.details, at.motion.shape[1]
        most, variables = 2 * int(periods.counts.sum()), size + 4
        written: Any = (
            np.zeros(most, dtype=np.int64),
            np.zeros((most, variables)),
            np.zeros((most, 2, variables)),
            np.zeros((most, size // 2)),
        )
        arrays = map(np.ascontiguousarray, (at.motion, self.physical(at.frequency, at.values)))
        count = moving_events(at.basis.arrays, *arrays, periods.pieces, periods.counts, *written)
        return Events(*(part[:count] for part in written))
