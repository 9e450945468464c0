"""Maxima of the response over the frequency and the constraints they satisfy, with derivatives.

At a *smooth* maximum the slope of the amplitude vanishes, at a *corner* one contact is on its slip
limit, an *edge* is the end of the band, a *point* the one frequency that is asked for. The contact
on the limit of a corner is held in stick, where the equations are smooth on both sides; the limit
may be that of a small loop within its hysteresis, see `symhbm.model.contacts.coulomb.state`. In
the place of an amplitude there may be a goal. Variables are unknowns, frequency and the parameters
of a `SecondOrder`, in this order.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance import (
    BalancedGroup,
    ContactStates,
    Evaluation,
    GoalOrder,
    HarmonicBalance,
    SecondOrder,
    ValueOf,
)
from symhbm.continuation.between import TIE, Peak, PeakKind
from symhbm.continuation.correctors import ON_LIMIT
from symhbm.model.contacts import Coulomb, Loop, Motions, loops_near_limit, on_loop
from symhbm.numerics import DENSE_LIMIT, FloatArray, turning_points


class MaximumKind(StrEnum):
    """Kinds of maxima."""

    SMOOTH = "smooth"
    CORNER = "corner"
    EDGE = "edge"
    POINT = "point"


@dataclass(frozen=True)
class Maximum:
    """A maximum of the response of ``dof`` over the frequency, at ``unknowns`` (n_unknowns,) [m].

    Or of the goal of the problem, with ``dof`` -1, in the ``unit`` of one as large as the response.
    ``frequency`` is in rad/s. ``contact`` is the number of the switch that is on its limit at a
    corner, -1 elsewhere; ``further_contacts`` are on their limits there, too: derivatives then
    exist only by parameters that keep them there together. ``switches`` (n_switches,) are the
    contact states. ``loop`` is the hysteresis loop on its limit if the contact slips at other
    angles.
    """

    problem: HarmonicBalance
    kind: MaximumKind
    dof: int
    unknowns: FloatArray
    frequency: float
    switches: NDArray[np.bool_]
    contact: int = -1
    further_contacts: tuple[int, ...] = ()
    loop: Loop | None = None
    unit: float = 1.0

    @classmethod
    def at_peak(cls, problem: HarmonicBalance, peak: Peak) -> "Maximum":
        """The maximum at a located peak that is not unbounded."""
        states = problem.locate(peak.unknowns, peak.value)
        switches, contact, further_contacts, loop = states.switches.copy(), -1, (), None
        if peak.kind == PeakKind.CORNER:
            distance = np.abs(states.margins)
            tolerance = max(10 * ON_LIMIT, distance.min())
            on_limit = np.flatnonzero(distance <= tolerance).tolist()
            loops = (
                _loops(problem, peak.unknowns, peak.value, switches)
                if tolerance > 10 * ON_LIMIT
                else []
            )
            if loops and loops[0][0] < tolerance:
                loop = loops[0][1]
                near = [other.contact for margin, other in loops if margin <= 10 * ON_LIMIT]
                on_limit = near or [loop.contact]
            else:
                switches[on_limit] = False
            contact, *others = on_limit
            further_contacts = tuple(others)
        kind, solution = MaximumKind(str(peak.kind)), (peak.unknowns, peak.value)
        contacts = contact, further_contacts, loop
        return cls(problem, kind, peak.dof, *solution, switches, *contacts)._in_unit()

    @classmethod
    def at_edge(
        cls,
        problem: HarmonicBalance,
        unknowns: FloatArray,
        frequency: float,
        dof: int,
        kind: MaximumKind = MaximumKind.EDGE,
    ) -> "Maximum":
        """The response of one degree of freedom at an end of the band, ``frequency`` in rad/s."""
        switches = problem.locate(unknowns, frequency).switches
        dof = dof if problem.goal is None else -1
        return cls(problem, kind, dof, unknowns, frequency, switches)._in_unit()

    def _in_unit(self) -> "Maximum":
        """Itself in the unit of a goal; ValueError where the goal is negative."""
        if self.problem.goal is None:
            return self
        at_goal = self._at_goal.checked(self.problem.goal, self.frequency)
        size = np.linalg.norm(self.unknowns) or 1.0
        return replace(self, unit=float(at_goal.size / size) or 1.0)

    @property
    def held(self) -> bool:
        """Whether the frequency is given."""
        return self.kind in (MaximumKind.EDGE, MaximumKind.POINT)

    @property
    def on_limit(self) -> list[int]:
        """The contacts on the limit between stick and slip, not those on the limit of a loop."""
        on_limit = (self.contact, *self.further_contacts) if self.loop is None else ()
        return [j for j in on_limit if j >= 0]

    def evaluate(self, slips: bool = False) -> Evaluation:
        """The evaluated balance; at a corner with the contact sticking, or slipping if ``slips``.

        Both sides are continued smoothly past the limit.
        """
        problem, solution = self.problem, (self.unknowns, self.frequency)
        if self.loop is None:
            states = self.switches.copy()
            states[self.on_limit if slips else []] = True
            return problem.evaluate(*solution, states)
        states = problem.locate(self.unknowns, self.frequency, self.switches)
        group, contact, at = self._at_limit
        assert isinstance(group.law, Coulomb)
        sliders = group.law.sliders(self.frequency, at.values)
        stiffness, limit = (float(part[0]) for part in sliders)
        state = on_loop(
            states.groups[group.name].details,
            problem.basis,
            at.motion[0],
            stiffness,
            limit,
            replace(self.loop, contact=contact),
            slips,
        )
        held = {group.name: state.located}
        return problem.evaluate(*solution, self.switches, ContactStates(states.groups | held))

    @property
    def _at_limit(self) -> tuple[BalancedGroup, int, Motions]:
        """Of the contact of a corner: its group, number within, and its motion."""
        problem = self.problem
        group, contact, _ = problem.contacts.switch(self.contact)
        relative = problem.layout.relative(self.unknowns)
        at = problem.contacts.at(group, relative, self.frequency).of([contact])
        return group, contact, at

    def moved(self, unknowns: FloatArray, frequency: float) -> "Maximum":
        """The same maximum at other unknowns and another frequency."""
        loop = self.loop
        if loop is not None:
            group, contact, _ = self.problem.contacts.switch(loop.contact)
            motion = self.problem.contacts.motions(group, self.problem.layout.relative(unknowns))[
                contact
            ]
            loop = loop.on(self.problem.basis, motion)
        return replace(self, unknowns=unknowns, frequency=frequency, loop=loop)

    @cached_property
    def _involved(self) -> tuple[NDArray[np.intp], FloatArray]:
        """Unknowns (n,) that tell what peaks, and its coefficients by them (n_components, n)."""
        size = self.problem.basis.n_components
        if self.problem.peaks_of is None:
            return np.arange(self.dof * size, (self.dof + 1) * size), np.eye(size)
        rows = self.problem.peaking.by_unknowns(self.dof)
        unknowns = np.unique(rows.indices)
        return unknowns, rows[:, unknowns].toarray()

    @property
    def motion(self) -> FloatArray:
        """The coefficients of what peaks, (n_components,)."""
        involved, rows = self._involved
        return rows @ self.unknowns[involved]

    @cached_property
    def _at_goal(self) -> ValueOf:
        goal, solution = self.problem.goal, (self.problem, self.unknowns, self.frequency)
        assert goal is not None
        return ValueOf.at(goal, *solution, self.evaluate().states)

    @property
    def amplitude(self) -> float:
        """The amplitude of the degree of freedom [m], or the goal."""
        return self._extreme[0] if self.problem.goal is None else self._at_goal.value

    @property
    def scale(self) -> float:
        """The amplitude, or goal, of a response of 1."""
        return self.problem.peaking.scale if self.problem.goal is None else self.unit

    @cached_property
    def slope(self) -> FloatArray:
        """Derivative of the amplitude by unknowns and frequency, (n_unknowns + 1,)."""
        if self.problem.goal is not None:
            return self._at_goal.slope
        values = self.problem.basis.values(self._extreme[1])
        involved, rows = self._involved
        result = np.zeros(self.problem.n_unknowns + 1)
        result[involved] = (np.sign(values @ self.motion) * values) @ rows
        return result

    def expansion(
        self, second_order: SecondOrder, evaluation: Evaluation
    ) -> tuple[FloatArray, Any]:
        """First and second derivatives of the amplitude by all variables."""
        size = second_order.n_variables
        if self.problem.goal is not None and self.amplitude > 0:
            order = GoalOrder.of(self.problem.goal, self.problem, second_order)
            return order(self.problem, self.unknowns, self.frequency, evaluation.states)
        gradient = np.zeros(size)
        gradient[: len(self.slope)] = self.slope
        if self.problem.goal is not None:
            return gradient, _embedded(np.zeros((0, 0)), np.arange(0), size)
        return gradient, self._curvature(size)

    @cached_property
    def _extreme(self) -> tuple[float, float]:
        """Largest displacement and its angle; of two opposite ones the positive."""
        points = turning_points(self.problem.basis, self.motion[None])
        size = np.abs(points.value[0])
        at = 0 if size[0] >= (1 - TIE) * size.max() else int(size.argmax())
        return float(size[at]), float(points.angle[0, at])

    def _curvature(self, size: int) -> Any:
        """Second derivative of the amplitude by ``size`` variables, dense or sparse by size."""
        basis = self.problem.basis
        slope, bend = (basis.values(self._extreme[1], derivative) for derivative in (1, 2))
        # The angle of the largest displacement varies with the coefficients.
        block = np.outer(slope, slope) / abs(bend @ self.motion)
        involved, rows = self._involved
        return _embedded(rows.T @ block @ rows, involved, size)

    @property
    def margins(self) -> float:
        """Slip margin of the contact of a corner."""
        return self._limit[0]

    def limit(self, second_order: SecondOrder) -> FloatArray:
        """Derivative of the limit of a corner or an edge by all variables, else zero."""
        row = np.zeros(second_order.n_variables)
        if self.held:
            row[self.problem.n_unknowns] = 1 / self.frequency
        elif self.kind == MaximumKind.CORNER:
            group, contact, at = self._at_limit
            gradient = self._limit[1]
            by_motion, others = np.split(gradient, [at.motion.size])
            row[: self.problem.n_unknowns] = self.problem.contacts.by_unknowns(
                group, contact, by_motion
            )
            columns, places = self._columns(second_order)
            row[columns] = others[places]
        return row

    def limit_curvature(self, second_order: SecondOrder) -> Any:
        """Second derivative of the limit of a corner by all variables, dense or sparse by size."""
        group, contact, at = self._at_limit
        block, size = self._limit[2], at.motion.size
        rows = self.problem.contacts.by_unknowns(group, contact, np.eye(size))
        involved = np.flatnonzero(rows.any(axis=0))
        columns, places = self._columns(second_order)
        spread = np.zeros((len(block), len(involved) + len(columns)))
        spread[:size, : len(involved)] = rows[:, involved]
        spread[size + places, len(involved) + np.arange(len(columns))] = 1.0
        curvature = spread.T @ block @ spread
        return _embedded(curvature, np.concatenate([involved, columns]), second_order.n_variables)

    @cached_property
    def _limit(self) -> tuple[float, FloatArray, FloatArray]:
        """The margin of the contact of a corner, and its derivatives.

        By the contact's motion, the frequency and its values. For a loop that returns to the same
        limit the margin is the travel between its turning points, over the whole one.
        """
        basis, loop = self.problem.basis, self.loop
        group, _, at = self._at_limit
        if loop is None:
            place = self.problem.contacts.switch(self.contact)[2]
            return group.law.margin_expansion(at, place)
        motion = at.motion[0]
        moved_loop = loop.on(basis, motion)
        angle = np.array([moved_loop.end, moved_loop.begin])[:: loop.sides[1]]
        assert isinstance(group.law, Coulomb)
        if not loop.returns:
            return group.law.margin_expansion(at, 0, angle)
        points = turning_points(basis, motion[None])
        whole = points.value[0, 0] - points.value[0, points.lowest[0]]
        n = 1 + len(at.values)
        spread, gradient, curvature = (
            part / whole for part in group.law.travel(basis, motion, angle)
        )
        return spread, np.pad(gradient, (0, n)), np.pad(curvature, (0, n))

    def _columns(self, second_order: SecondOrder) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Columns of frequency and parameters of the contact of a corner, and their places."""
        group, contact, _ = self._at_limit
        columns, places = [self.problem.n_unknowns], [0]
        for i, name in enumerate(group.parameters.values()):
            if name in second_order.places:
                columns.append(second_order.places[name].start + contact)
                places.append(1 + i)
        return np.array(columns), np.array(places)


def _loops(
    problem: HarmonicBalance, unknowns: FloatArray, frequency: float, switches: NDArray[np.bool_]
) -> list[tuple[float, Loop]]:
    """The hysteresis loops of all slipping contacts, those closest to their limits first.

    Their ``contact`` is the number of the switch.
    """
    relative, loops = problem.layout.relative(unknowns), []
    for switch in np.flatnonzero(switches).tolist():
        group, contact, _ = problem.contacts.switch(switch)
        if not isinstance(group.law, Coulomb):
            continue
        spring = group.law.sliders(frequency, problem.contacts.values_of(group))
        stiffness, limit = (float(part[contact]) for part in spring)
        if stiffness > 0 and limit > 0:
            motion = problem.contacts.motions(group, relative)[contact]
            loops += loops_near_limit(problem.basis, motion, switch, stiffness, limit)
    return sorted(loops, key=lambda pair: pair[0])


def _embedded(block: FloatArray, index: NDArray[np.intp], size: int) -> Any:
    """A square block at an index of rows and columns of a zero matrix, dense or sparse by size."""
    if size <= DENSE_LIMIT:
        matrix = np.zeros((size, size))
        matrix[np.ix_(index, index)] = block
        return matrix
    rows, columns = np.repeat(index, len(index)), np.tile(index, len(index))
    return sp.csr_array((block.ravel(), (rows, columns)), shape=(size, size))
