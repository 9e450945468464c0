"""Dry friction in a plane: two tangential directions, one circle, a constant or a variable load.

A contact has the tangential displacements ``u = (u_x, u_y)`` and, where its load varies, the normal
one ``v``, positive where it closes:

    N = max(N0 + k_n v, 0),        T = k_t (u - w),  |T| <= mu N,

where the slider ``w`` moves only while ``|T| = mu N``, and then along ``T``; where the contact is
apart it follows ``u``. The direction of the force while it slips has no closed form: it is
integrated to round-off, and the rest of a period is located.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, ClassVar, Literal, get_args

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.law import change_of_logarithm
from symhbm.model.contacts.motions import (
    EventLoop,
    History,
    Located,
    Motions,
    Parameter,
    Switch,
    Values,
)
from symhbm.model.contacts.normal import (
    FRICTION,
    NORMAL,
    NORMAL_LOAD,
    PRESSED,
    SLIDER,
    SLIPS,
    NormalLaw,
    Periods,
    Preload,
    of_rotation,
)
from symhbm.model.contacts.planar import batch
from symhbm.model.contacts.planar.expansion import resting_bends, slip_margin
from symhbm.model.contacts.planar.history import history_of
from symhbm.model.contacts.planar.moving_events import bends_of
from symhbm.model.contacts.planar.period import FEW, MOST, PER_HARMONIC, TOO_MANY
from symhbm.model.contacts.planar.rest import middle_of
from symhbm.numerics import FloatArray, FourierBasis, check

Given = Literal["normal_load", "gap", "constant"]
"""What is a parameter of a load that varies with the motion, or a load that does not."""


class PlanarFriction(NormalLaw):
    """Spring and slider with two tangential directions and one circle of friction.

    ``given`` names the parameter of a load that varies with the normal displacement; with
    ``"constant"`` there is no normal direction, and the limit is ``mu F_n``. ``preload`` is that of
    `symhbm.laws.VariableLoadFriction`. Raises ValueError for other words.

    Examples
    --------
    A contact that slips around a circle:

    >>> import symhbm as sh
    >>> pad = sh.Contacts(
    ...     sh.laws.PlanarFriction("constant"), [(0,)], [(1,)],
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=2,
    ... )
    >>> body = sh.Model([[1, 0], [0, 1]], [[2, 0], [0, 2]], [[1e4, 0], [0, 1e4]], {"pad": pad})
    >>> problem = sh.HarmonicBalance(body, sh.forces.EngineOrder(1))
    >>> float(sh.solve(problem, 18).slip_distance[0]) > 0
    True
    """

    drawn_as = "friction"
    friction = FRICTION
    variables: ClassVar = NORMAL | SLIDER

    def __init__(
        self,
        given: Given = "normal_load",
        preload: Preload = "balanced",
        engine_order: int | None = None,
        speed: float | None = None,
    ):
        check.one_of("given", given, get_args(Given))
        super().__init__("gap" if given == "gap" else "normal_load", preload, engine_order, speed)
        self.given = given

    @property
    def varies(self) -> bool:
        """Whether the load varies with the motion."""
        return self.given != "constant"

    @property
    def directions(self) -> tuple[str, ...]:  # type: ignore[override]
        """Two of them, and the normal one where the load varies."""
        return ("tangential", "across", *["normal"] * self.varies)

    @property
    def switches(self) -> tuple[Switch, ...]:  # type: ignore[override]
        """Slip, and where the load varies opening and touch."""
        return (Switch("slip", "onset of slip", "end of slip"), *PRESSED * self.varies)

    @property
    def odd(self) -> bool:  # type: ignore[override]
        """Under a constant load alone."""
        return not self.varies

    @property
    def parameters(self) -> Mapping[str, Parameter]:  # type: ignore[override]
        """Its parameters by name."""
        if self.varies:
            return super().parameters
        return {**self.friction, "normal_load": NORMAL_LOAD, **of_rotation(self)}

    def monotone(self, values: Values) -> bool:
        """Under a constant load alone: the force is then one of two potentials."""
        return not self.varies

    def closed(self) -> dict[str, float]:
        """A load that varies touches; a constant one is as it is."""
        return super().closed() if self.varies else {}

    def n_variables(self, basis: FourierBasis) -> tuple[int, int]:
        """Numbers of what both forces are homogeneous in, see `symhbm.model.contacts.press`."""
        size = basis.n_components
        return (3 * size + 1, 1 + size) if self.varies else (2 * size + 1, 0)

    def n_events(self, basis: FourierBasis) -> int:
        """Derivatives of both forces by these variables, and what is left of them."""
        size = basis.n_components
        tangential, normal = self.n_variables(basis)
        return size * (2 * tangential + normal + 2)

    def event_variables(self, at: Motions) -> Any:
        """Those of both forces, one after the other."""
        _, motion, frequency, values = at
        parts = ca.vertsplit(motion, motion.shape[0] // len(self.directions))
        load, friction = self.load(frequency, values), values["friction_coefficient"]
        pull = ca.vertcat(*parts[:2]) * values["contact_stiffness"]
        if not self.varies:
            return ca.vertcat(pull, friction * load)
        push = ca.vertcat(load, values["normal_stiffness"] * parts[2])
        return ca.vertcat(pull, friction * push, push)

    def force(self, at: Motions, events: Any) -> Any:
        """Derivatives times variables: ``T``, and ``N`` less what the equilibrium holds."""
        size, variables = at.basis.n_components, self.event_variables(at)
        tangential, normal = self.n_variables(at.basis)
        first = 2 * size * tangential
        # CasADi stores columns one after the other.
        slopes = ca.reshape(events[:first], tangential, 2 * size).T
        force = ca.mtimes(slopes, variables[:tangential]) + events[-2 * size :]
        if not self.varies:
            return force
        slopes = ca.reshape(events[first : first + normal * size], normal, size).T
        spring = ca.mtimes(slopes[:, 1:], variables[tangential + 1 :])
        # In this order a small motion keeps its digits beside a load that is held.
        held = slopes[:, 0] * variables[tangential] - self.balanced_force(at)
        return ca.vertcat(force, spring + held)

    def locate(self, at: Motions, held: NDArray[np.bool_] | None = None) -> Located:
        """Locate all events; stick alone can be imposed: slip goes on nowhere short of its onset.

        Opening and closing bend no derivative. Raises ArithmeticError where a motion is so large
        that its slip takes too many steps.
        """
        found, failed = self.by_loop(self.event_loop(at.basis), at, held)
        self._check(failed)
        events, margins, by_motion, details = found
        states = self.held_states(margins, held)
        return Located(events, states, margins, by_motion, Periods.of(details))

    def event_loop(self, basis: FourierBasis) -> EventLoop:
        """What locates all events."""
        return EventLoop(batch.locate, basis, self.physical, 6 + 4 * len(self.switches))

    def _check(self, failed: int) -> None:
        if failed:
            raise ArithmeticError(f"{self!r}: no periodic slip was found of a motion")

    def margins_within(self, at: Motions, error: FloatArray) -> FloatArray:
        """Margins and what the error does to them, without the force."""
        basis, motion, frequency, values = at
        margins, by_motion, by_values = self.margin_arrays(motion)
        motion, given = np.ascontiguousarray(motion), self.physical(frequency, values)
        asked, none = np.full(len(motion), float(batch.ASKED)), np.empty((len(motion), 0))
        details = np.empty((len(motion), 6 + by_values[0].size))
        batch.locate(basis.arrays, motion, given, asked, none, margins, by_motion, details)
        return margins + error * np.linalg.norm(by_motion, axis=-1)

    def margin_changes(self, at: Motions, change: FloatArray, margins: FloatArray) -> FloatArray:
        """Of a constant load the margin is the logarithm of a radius over the limit."""
        if self.varies:
            return super().margin_changes(at, change, margins)
        stiffness, _, friction, load = self.physical(at.frequency, at.values).T[:, :, None]
        moved = stiffness * change.sum(axis=1, keepdims=True)
        return change_of_logarithm(moved, friction * load * np.exp(margins))

    def margin_expansion(
        self, at: Motions, switch: int, instants: FloatArray | None = None
    ) -> tuple[float, FloatArray, FloatArray]:
        """Of slip the resting place and the active instants move with the motion."""
        if switch != SLIPS:
            return super().margin_expansion(at, switch, instants)
        basis, (whole,) = at.basis, self._whole(at)
        variables, spread = (np.asarray(part.full()) for part in _variables(self, basis)(whole))
        own = self.n_variables(basis)[0]
        margin, first, second = slip_margin(basis, variables.ravel()[:own], self.varies)
        bend = _bends(self, basis)(whole, np.pad(first, (0, len(variables) - own))).full()
        return margin, first @ spread[:own], spread[:own].T @ second @ spread[:own] + bend

    def moving_events(self, at: Motions, located: Located, weights: FloatArray) -> FloatArray:
        """Of slip, of where it begins and ends, of closing and opening, and of resting places."""
        basis, motion, frequency, values = at
        imposed = np.where(located.states[:, SLIPS], -1, 0)
        motion, given = np.ascontiguousarray(motion), self.physical(frequency, values)
        bends = np.empty((len(motion), *[sum(self.n_variables(basis))] * 2))
        weights = np.ascontiguousarray(weights)
        most, failed = FEW + PER_HARMONIC * basis.highest, TOO_MANY
        while failed == TOO_MANY and most < MOST:
            failed = bends_of(basis.arrays, motion, given, imposed, most, weights, bends)
            most *= 4
        self._check(failed)
        if basis.order[0] > 0:
            return bends
        figures, own = located.details.figures, slice(self.n_variables(basis)[0])
        rests = (figures[:, batch.STICK_SHARE] == 1) & (figures[:, batch.SLIP_DISTANCE] == 0)
        whole = self._whole(at)
        for j in np.flatnonzero(rests):
            variables = np.asarray(_variables(self, basis)(whole[j])[0].full()).ravel()[own]
            # The mean of the force is that of the motion less the resting place.
            mean = -weights[j, [0, basis.n_components]]
            bends[j, own, own] += resting_bends(basis, variables, mean, self.varies)
        return bends

    def _whole(self, at: Motions) -> FloatArray:
        """Motion, frequency and values contact by contact, (n, m K + 1 + p)."""
        return np.column_stack(at.numbers(self))

    @staticmethod
    def middle_of(samples: FloatArray) -> FloatArray:
        """Where a slider rests, (2,), of samples (3, n) of ``x``, ``y`` and ``r`` [N]."""
        return middle_of(samples)

    def history(self, at: Motions, n_angles: int) -> list[History]:
        """From the pieces that `locate` finds."""
        each = zip(at.motion, self.physical(at.frequency, at.values), strict=True)
        return [history_of(at.basis, *one, n_angles) for one in each]


def _symbols(law: PlanarFriction, basis: FourierBasis) -> tuple[Any, Any]:
    """Motion, frequency and values as one vector, and the event variables of them."""
    at, symbols = Motions.symbols(law, basis)
    return ca.vertcat(*symbols), law.event_variables(at)


@lru_cache(maxsize=64)
def _variables(law: PlanarFriction, basis: FourierBasis) -> ca.Function:
    """The event variables and their derivative by motion, frequency and values."""
    whole, variables = _symbols(law, basis)
    return ca.Function("variables", [whole], [variables, ca.jacobian(variables, whole)])


@lru_cache(maxsize=64)
def _bends(law: PlanarFriction, basis: FourierBasis) -> ca.Function:
    """Second derivatives of the event variables times weights."""
    whole, variables = _symbols(law, basis)
    weights = ca.SX.sym("weights", variables.shape[0])
    bend, _ = ca.hessian(ca.dot(weights, variables), whole)
    return ca.Function("bends", [whole, weights], [bend])
