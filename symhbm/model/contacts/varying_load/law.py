"""Dry friction whose normal load varies with the motion, up to lift-off.

A contact has a tangential displacement ``u`` and a normal one ``v``, positive where it closes:

    N = max(N0 + k_n v, 0),        T = k_t (u - w),  |T| <= mu N,

where the slider ``w`` moves only while ``|T| = mu N`` and follows ``u`` where the contact is apart.
Both forces are continuous in time, at re-contact too.

References: E. P. Petrov, D. J. Ewins, J. Turbomach. 125 (2003), 364-371; B. D. Yang, M. L. Chu,
C. H. Menq, J. Sound Vib. 210 (1998), 461-481.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.history import Behaviour, History
from symhbm.model.contacts.law import Located, Switch, Values
from symhbm.model.contacts.normal import NORMAL, PRESSED, NormalLaw
from symhbm.model.contacts.parameter import Parameter
from symhbm.model.contacts.varying_load.batch import (
    LARGEST,
    LEAST,
    MEAN,
    OPEN,
    OPEN_SHARE,
    SLIP,
    SLIP_DISTANCE,
    STICK_SHARE,
    TOUCH,
    estimate,
    locate,
    most_pieces,
)
from symhbm.model.contacts.varying_load.history import history_of
from symhbm.model.contacts.varying_load.moving_events import moving_events
from symhbm.numerics import Compiled, FloatArray, FourierBasis


@dataclass(frozen=True)
class Periods:
    """What contacts do over one period.

    Attributes
    ----------
    pieces : (n, most, 6)
        What they do one after the other, see `symhbm.model.contacts.varying_load.march`.
    counts : (n,)
        How many pieces each contact has.
    turning : (n, 4, 2)
        Value and angle of the largest ``low``, the smallest ``high``, the smallest and the
        largest ``p``.
    figures : (n, 6)
        As of `symhbm.model.contacts.varying_load.batch`.
    margin_slopes : (n, 3, 2 K + 4)
        Derivatives of the margins by motion, ``k_t``, ``k_n``, ``mu`` and ``N0``.
    """

    pieces: FloatArray
    counts: NDArray[np.intp]
    turning: FloatArray
    figures: FloatArray
    margin_slopes: FloatArray

    def split(self, count: int) -> list["Periods"]:
        """Those of as many points."""
        parts = [np.split(array, count) for array in vars(self).values()]
        return [Periods(*each) for each in zip(*parts, strict=True)]


class VariableLoadFriction(NormalLaw):
    """Spring and slider whose normal load varies with the motion, up to lift-off.

    ``given`` names the parameter of the normal side, ``preload`` says from where displacements
    are measured: see `symhbm.Friction`, which makes groups of such contacts.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.VariableLoadFriction("gap").parameters["gap"].units
    'm'
    """

    directions = ("tangential", "normal")
    switches = (Switch("slip", "onset of slip", "end of slip"), *PRESSED)
    drawn_as = "friction"
    variables: ClassVar = NORMAL | {
        "slip_distance": ("m", "path of the slider per cycle while the contact is closed")
    }
    friction: ClassVar = {
        "contact_stiffness": Parameter(
            "N m-1", "stiffness of the contact", "$k_d$", "N/m", designed=True
        ),
        "friction_coefficient": Parameter("1", "friction coefficient", r"$\mu$", "", designed=True),
    }

    def acts(self, values: Values) -> NDArray[np.bool_]:
        """Those that have a spring which pushes, or one which pulls under a load."""
        pulls = np.asarray(values["contact_stiffness"]) * values["friction_coefficient"] > 0
        pressed = np.asarray(self.load(1.0, values)) > 0
        pushes = np.asarray(values["normal_stiffness"]) > 0
        return pushes | (pulls & (pressed | self.margins_move))

    def n_events(self, basis: FourierBasis) -> int:
        """``A, B, C, E`` and ``b, c, e`` of `symhbm.model.contacts.varying_load.coefficients`."""
        return 4 * basis.n_components**2 + 3 * basis.n_components

    def force(
        self, basis: FourierBasis, motion: Any, frequency: Any, values: Values, events: Any
    ) -> Any:
        """``T`` and ``N`` less the share of the preload that the equilibrium holds."""
        by_pull, by_press, by_normal, rest = self._linear(basis, frequency, values, events)
        u, v = ca.vertsplit(motion, basis.n_components)
        tangential = ca.mtimes(by_pull, u) + ca.mtimes(by_press, v)
        return ca.vertcat(tangential, ca.mtimes(by_normal, v)) + rest

    def terms(
        self,
        basis: FourierBasis,
        motion: Any,
        travel: Any,
        frequency: Any,
        values: Values,
        events: Any,
    ) -> tuple[Any, Any]:
        """Those of the force, which is linear in the motion."""
        *slopes, rest = self._linear(basis, frequency, values, events)
        by_pull, by_press, by_normal = map(ca.fabs, slopes)
        u, v = ca.vertsplit(travel, basis.n_components)
        tangential = ca.mtimes(by_pull, u) + ca.mtimes(by_press, v)
        return ca.vertcat(tangential, ca.mtimes(by_normal, v)) + ca.fabs(rest), 0

    def _linear(
        self, basis: FourierBasis, frequency: Any, values: Values, events: Any
    ) -> tuple[Any, Any, Any, Any]:
        """Derivatives of ``T`` by ``u`` and ``v`` and of ``N`` by ``v``, and what else they are."""
        size, load = basis.n_components, self.load(frequency, values)
        parts = [events[k * size * size : (k + 1) * size * size] for k in range(4)]
        by_pull, by_anchor, by_wall, by_normal = (ca.reshape(part, size, size) for part in parts)
        anchor, wall, closed = (events[(4 * size + k) * size :][:size] for k in range(3))
        normal, friction = values["normal_stiffness"], values["friction_coefficient"]
        held = ca.DM((basis.order == 0).astype(float)) * self.balanced_load(frequency, values)
        return (
            values["contact_stiffness"] * by_pull,
            -normal * (by_anchor + friction * by_wall),
            normal * by_normal,
            ca.vertcat(-load * (anchor + friction * wall), load * closed - held),
        )

    def locate(
        self,
        basis: FourierBasis,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
        held: NDArray[np.bool_] | None = None,
    ) -> Located:
        """Locate all events; slip alone can be imposed, opening and closing bend no derivative."""
        n, size = len(motion), basis.n_components
        given = self.physical(frequency, values)
        imposed = _NONE if held is None else held[:, SLIP].astype(int)
        events, margins = np.empty((n, self.n_events(basis))), np.empty((n, 3))
        slopes, figures = np.empty((n, 3, 2 * size + 4)), np.empty((n, 6))
        pieces = np.zeros((n, most_pieces(basis.highest), 6))
        counts, turning = np.empty(n, dtype=int), np.empty((n, 4, 2))
        motion = np.ascontiguousarray(motion)
        written = events, margins, slopes, figures, pieces, counts, turning
        locate(*basis.arrays, motion, given, imposed, *written)
        states = margins > 0
        if held is not None:
            finite = np.isfinite(margins[:, SLIP])
            states[:, SLIP] = np.where(finite, held[:, SLIP], states[:, SLIP])
        by_motion = slopes[:, :, : 2 * size]
        details = Periods(pieces, counts, turning, figures, slopes)
        return Located(events, states, margins, by_motion, details)

    def margins_within(
        self,
        basis: FourierBasis,
        motion: FloatArray,
        error: FloatArray,
        frequency: FloatArray,
        values: Values,
    ) -> FloatArray:
        """Margins and what the error does to them, without the force."""
        margins = np.empty((len(motion), 3))
        slopes = np.empty((len(motion), 3, motion.shape[1] + 4))
        arrays = map(np.ascontiguousarray, (motion, self.physical(frequency, values)))
        estimate(*basis.arrays[:2], *arrays, margins, slopes)
        return margins + error * np.linalg.norm(slopes[:, :, :-4], axis=-1)

    def physical(self, frequency: float | FloatArray, values: Values) -> FloatArray:
        """``k_t``, ``k_n``, ``mu`` and ``N0`` of contacts, (n, 4)."""
        names = "contact_stiffness", "normal_stiffness", "friction_coefficient"
        result = np.empty((len(values[names[0]]), 4))
        for column, name in enumerate(names):
            result[:, column] = values[name]
        result[:, 3] = self.load(frequency, values)
        return result

    def by_parameters(
        self, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """``k_t, k_n, mu, N0`` by frequency and values: (n, 4), (n, 4, 1 + p), (n, 1 + p, 1 + p).

        The last are second derivatives of ``N0``, the only ones that are not 0.
        """
        _, first, second = self.load_slopes(frequency, values)
        slopes = np.zeros((len(first), 4, first.shape[1]))
        names = [*self.parameters]
        slopes[:, 0, 1 + names.index("contact_stiffness")] = 1
        slopes[:, 1, 1 + names.index("normal_stiffness")] = 1
        slopes[:, 2, 1 + names.index("friction_coefficient")] = 1
        slopes[:, 3] = first
        return self.physical(frequency, values), slopes, second

    def margin_slopes(
        self, located: Located, frequency: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the margins by the frequency and by the parameters."""
        _, slopes, _ = self.by_parameters(frequency, values)
        each = np.einsum("cqz,czp->cqp", located.details.margin_slopes[:, :, -4:], slopes)
        return each[:, :, 0], each[:, :, 1:].transpose(2, 0, 1)

    def margin_expansion(
        self, basis: FourierBasis, motion: FloatArray, frequency: float, values: Values, switch: int
    ) -> tuple[float, FloatArray, FloatArray]:
        """Margin, gradient and second derivatives, events moving with what they are of."""
        each = {name: np.reshape(value, 1) for name, value in values.items()}
        located = self.locate(basis, motion[None], frequency, each)
        given, slopes, second = self.by_parameters(frequency, each)
        turning, size = located.details.turning[0], 2 * basis.n_components
        walls = (0, 1) if switch == SLIP else (1 + switch,)
        angles = turning[list(walls), 1]
        functions = [basis.values(angle, d) for angle in angles for d in range(3)]
        margin, first, curvature = _expansion(basis, switch)(motion, given[0], *functions)
        curvature = curvature.reshape(len(first), -1)
        spread = np.zeros((size + 4, size + slopes.shape[2]))
        spread[:size, :size], spread[size:, size:] = np.eye(size), slopes[0]
        whole = spread.T @ curvature @ spread
        whole[size:, size:] += first[-1] * second[0]
        return float(margin[0]), first @ spread, whole

    def largest_force(self, values: Values, size: float, switched: bool) -> FloatArray:
        """The springs', of contacts that slip or open."""
        return self.stiffest(values) * switched * size

    def stiffest(self, values: Values) -> FloatArray:
        """The stiffer spring's."""
        return np.maximum(values["contact_stiffness"], values["normal_stiffness"]).astype(float)

    def stuck_stiffness(self, values: Values) -> FloatArray:
        """Each spring's."""
        names = "contact_stiffness", "normal_stiffness"
        return np.stack([np.asarray(values[name], dtype=float) for name in names], axis=1)

    def released(self) -> dict[str, float]:
        """Without friction contacts slide freely."""
        return {"friction_coefficient": 0.0}

    def results(
        self,
        basis: FourierBasis,
        located: Located,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
    ) -> dict[str, FloatArray]:
        """State, shares of the period, normal forces [N], path of the slider [m], energy [J]."""
        state = np.where(located.states[:, SLIP], Behaviour.SLIPS, Behaviour.STICKS)
        state = np.where(located.states[:, OPEN], Behaviour.OPENS, state)
        state = np.where(located.states[:, TOUCH], state, Behaviour.NEVER_TOUCHES)
        return super().results(basis, located, motion, frequency, values) | dict(
            **self.period_figures(located.details), contact_state=state
        )

    def period_figures(self, periods: Periods) -> dict[str, FloatArray]:
        """Shares of the period, normal forces [N] and path of the slider [m], (n,) each."""
        columns = dict(
            stick_fraction=STICK_SHARE,
            open_fraction=OPEN_SHARE,
            mean_normal_force=MEAN,
            least_normal_force=LEAST,
            largest_normal_force=LARGEST,
            slip_distance=SLIP_DISTANCE,
        )
        return {name: periods.figures[:, column] for name, column in columns.items()}

    def history(
        self,
        basis: FourierBasis,
        motion: FloatArray,
        frequency: float | FloatArray,
        values: Values,
        n_angles: int,
    ) -> list[History]:
        """From the pieces that `locate` finds."""
        periods = self.locate(basis, motion, frequency, values).details
        given, counts = self.physical(frequency, values), periods.counts.tolist()
        return [
            history_of(basis, motion[j], given[j], periods.pieces[j, :count], n_angles)
            for j, count in enumerate(counts)
        ]

    def event_variables(self, motion: Any, frequency: Any, values: Values) -> Any:
        """Motion, ``k_t``, ``k_n``, ``mu`` and ``N0``."""
        names = "contact_stiffness", "normal_stiffness", "friction_coefficient"
        return ca.vertcat(motion, *map(values.__getitem__, names), self.load(frequency, values))

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
        n, size = len(motion), motion.shape[1] + 4
        result, periods = np.zeros((n, size, size)), located.details
        arrays = map(np.ascontiguousarray, (motion, self.physical(frequency, values)))
        parts = periods.pieces, periods.counts, np.ascontiguousarray(weights), result
        moving_events(*basis.arrays, *arrays, *parts)
        return result


_NONE = np.empty(0, dtype=int)
"""Of contacts whose motions decide whether they slip."""


@lru_cache(maxsize=64)
def _expansion(basis: FourierBasis, switch: int) -> Compiled:
    """Margin of a switch to second order by motion, ``k_t``, ``k_n``, ``mu`` and ``N0``.

    Inputs: motion, these, and for each turning point the functions of the basis there and their
    first two derivatives by the angle.
    """
    size = basis.n_components
    motion, given = ca.SX.sym("motion", 2 * size), ca.SX.sym("given", 4)
    variables, (stiffness, normal, friction, load) = ca.vertcat(motion, given), ca.vertsplit(given)
    moving, mean = ca.DM((basis.order > 0).astype(float)), ca.DM((basis.order == 0).astype(float))
    u, v = motion[:size], motion[size:]
    press = normal**2 * ca.sumsqr(moving * v) + (load + normal * ca.dot(mean, v)) ** 2
    square, signs = press, (0, 1 if switch == TOUCH else -1)
    if switch == SLIP:
        square = stiffness**2 * ca.sumsqr(moving * u) + friction**2 * press
    inputs, value, moved = [motion, given], ca.SX(0), ca.SX(0)
    for k in range(2 if switch == SLIP else 1):
        functions = [ca.SX.sym(f"functions_{k}_{d}", size) for d in range(3)]
        pull, push = (1 - 2 * k, -friction) if switch == SLIP else signs
        parts = [
            pull * stiffness * ca.dot(row, u)
            + push * (normal * ca.dot(row, v) + (load if d == 0 else 0))
            for d, row in enumerate(functions)
        ]
        rate = ca.jacobian(parts[1], variables)
        bend = ca.if_else(parts[2] == 0, 1, parts[2])
        value, moved = value + parts[0], moved - rate.T @ rate / bend
        inputs += functions
    margin = value / ca.sqrt(square)
    curvature, gradient = ca.hessian(margin, variables)
    whole = ca.densify(curvature + moved / ca.sqrt(square))
    outputs = [margin, ca.densify(gradient), ca.vec(whole)]
    return Compiled(ca.Function("expansion", inputs, outputs))
