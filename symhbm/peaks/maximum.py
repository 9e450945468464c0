"""Maxima of the response over the frequency and the constraints they satisfy, with derivatives.

At a *smooth* maximum the slope of the amplitude vanishes, at a *corner* one contact is on its slip
limit, an *edge* is the end of the band. The contact on the limit of a corner is held in stick,
where the equations are smooth on both sides; the limit may be that of a small loop within its
hysteresis, see `symhbm.model.contacts.coulomb_loops`. Variables are unknowns, frequency and the
parameters of a `SecondOrder`, in this order.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance import Evaluation, HarmonicBalance, SecondOrder, turning_hessian
from symhbm.continuation.between import TIE, Peak, PeakKind
from symhbm.continuation.correctors import ON_LIMIT
from symhbm.model import FRICTION_PARAMETERS, PARAMETERS
from symhbm.model.contacts import Loop, loops_near_limit, on_loop
from symhbm.numerics import DENSE_LIMIT, FloatArray, turning_points


class MaximumKind(StrEnum):
    """Kinds of maxima."""

    SMOOTH = "smooth"
    CORNER = "corner"
    EDGE = "edge"


@dataclass(frozen=True)
class Maximum:
    """A maximum of the response of ``dof`` over the frequency, at ``unknowns`` (n_unknowns,) [m].

    ``frequency`` is in rad/s. ``contact`` is the one on its slip limit at a corner, -1 elsewhere;
    ``further_contacts`` are on their limits there, too: derivatives then exist only by parameters
    that keep them on the limit together. ``slip`` (n_contacts,) are the contact states. ``loop`` is
    the hysteresis loop on its limit if the contact slips at other angles.
    """

    problem: HarmonicBalance
    kind: MaximumKind
    dof: int
    unknowns: FloatArray
    frequency: float
    slip: NDArray[np.bool_]
    contact: int = -1
    further_contacts: tuple[int, ...] = ()
    loop: Loop | None = None

    @classmethod
    def at_peak(cls, problem: HarmonicBalance, peak: Peak) -> "Maximum":
        """The maximum at a located peak that is not unbounded."""
        friction = problem.locate(peak.unknowns)
        slip, contact, further_contacts, loop = friction.slip.copy(), -1, (), None
        if peak.kind == PeakKind.CORNER:
            distance = np.abs(friction.slip_margin)
            tolerance = max(10 * ON_LIMIT, distance.min())
            on_limit = np.flatnonzero(distance <= tolerance).tolist()
            loops = _loops(problem, peak.unknowns, slip) if tolerance > 10 * ON_LIMIT else []
            if loops and loops[0][0] < tolerance:
                loop = loops[0][1]
                near = [other.contact for margin, other in loops if margin <= 10 * ON_LIMIT]
                on_limit = near or [loop.contact]
            else:
                slip[on_limit] = False
            contact, *others = on_limit
            further_contacts = tuple(others)
        kind, solution = MaximumKind(str(peak.kind)), (peak.unknowns, peak.value)
        return cls(problem, kind, peak.dof, *solution, slip, contact, further_contacts, loop)

    @classmethod
    def at_edge(
        cls, problem: HarmonicBalance, unknowns: FloatArray, frequency: float, dof: int
    ) -> "Maximum":
        """The response of one degree of freedom at an end of the band, ``frequency`` in rad/s."""
        slip = problem.locate(unknowns).slip
        return cls(problem, MaximumKind.EDGE, dof, unknowns, frequency, slip)

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
            states = self.slip.copy()
            states[self.on_limit if slips else []] = True
            return problem.evaluate(*solution, states)
        contact = self.loop.contact
        friction = on_loop(
            problem.locate(self.unknowns, self.slip),
            problem.basis,
            problem.relative(self.unknowns)[contact],
            problem.contact_stiffness[contact],
            problem.slip_limit[contact],
            self.loop,
            slips,
        )
        return problem.evaluate(*solution, self.slip, friction)

    def moved(self, unknowns: FloatArray, frequency: float) -> "Maximum":
        """The same maximum at other unknowns and another frequency."""
        loop = self.loop
        if loop is not None:
            motion = self.problem.relative(unknowns)[loop.contact]
            loop = loop.on(self.problem.basis, motion)
        return replace(self, unknowns=unknowns, frequency=frequency, loop=loop)

    @property
    def dof_slice(self) -> slice:
        """The unknowns that are coefficients of the degree of freedom."""
        size = self.problem.basis.n_components
        return slice(self.dof * size, (self.dof + 1) * size)

    @property
    def motion(self) -> FloatArray:
        """The coefficients of the degree of freedom, (n_components,) [m]."""
        return self.unknowns[self.dof_slice]

    @property
    def amplitude(self) -> float:
        """The amplitude of the degree of freedom [m]."""
        return self._extreme[0]

    @cached_property
    def amplitude_slope(self) -> FloatArray:
        """Derivative of the amplitude by the coefficients of the degree of freedom."""
        values = self.problem.basis.values(self._extreme[1])
        return np.sign(values @ self.motion) * values

    @cached_property
    def _extreme(self) -> tuple[float, float]:
        """Largest displacement and its angle; of two opposite ones the positive."""
        points = turning_points(self.problem.basis, self.motion[None])
        size = np.abs(points.value[0])
        at = 0 if size[0] >= (1 - TIE) * size.max() else int(size.argmax())
        return float(size[at]), float(points.angle[0, at])

    def amplitude_curvature(self, size: int) -> Any:
        """Second derivative of the amplitude by ``size`` variables, dense or sparse by size."""
        basis = self.problem.basis
        slope, bend = (basis.values(self._extreme[1], derivative) for derivative in (1, 2))
        # The angle of the largest displacement varies with the coefficients.
        block = np.outer(slope, slope) / abs(bend @ self.motion)
        return _embedded(block, np.arange(self.dof_slice.start, self.dof_slice.stop), size)

    @property
    def slip_margin(self) -> float:
        """Slip margin of the contact of a corner."""
        return self._limit[0]

    def limit(self, second_order: SecondOrder) -> FloatArray:
        """Derivative of the limit of a corner or an edge by all variables, else zero."""
        row = np.zeros(second_order.n_variables)
        if self.kind == MaximumKind.EDGE:
            row[self.problem.n_unknowns] = 1 / self.frequency
        elif self.kind == MaximumKind.CORNER:
            row[: self.problem.n_unknowns] = self.problem.expand(self.contact, self._limit[1])
            for column, sign, value in self._limit_parameters(second_order):
                row[column] = sign / value
        return row

    def limit_curvature(self, second_order: SecondOrder) -> Any:
        """Second derivative of the limit of a corner by all variables, dense or sparse by size."""
        block = self._limit[2]
        rows = self.problem.expand(self.contact, np.eye(len(block)))
        involved = np.flatnonzero(rows.any(axis=0))
        parameters = self._limit_parameters(second_order)
        columns = np.array([*involved, *(column for column, _, _ in parameters)])
        n, rows = len(involved), rows[:, involved]
        curvature = np.diag([0.0] * n + [-sign / value**2 for _, sign, value in parameters])
        curvature[:n, :n] = rows.T @ block @ rows
        return _embedded(curvature, columns, second_order.n_variables)

    @cached_property
    def _limit(self) -> tuple[float, FloatArray, FloatArray]:
        """The slip margin of the contact of a corner, and its derivatives by the contact's motion.

        It is the logarithm of the travel between two turning points over ``2 mu F_n / k_d``; for a
        loop that returns to the same limit, the travel itself.
        """
        problem, contact, loop = self.problem, self.contact, self.loop
        basis, motion = problem.basis, problem.relative(self.unknowns)[[contact]]
        points = turning_points(basis, motion)
        angle = points.angle[0, [0, points.lowest[0]]]
        if loop is not None:
            moved_loop = loop.on(basis, motion[0])
            angle = np.array([moved_loop.end, moved_loop.begin])[:: loop.sides[1]]
        high, low = basis.values(angle)
        spread = float((high - low) @ motion[0])
        gradient = high - low
        bend_high, bend_low = turning_hessian(basis, motion[[0, 0]], angle)
        curvature = bend_high - bend_low
        if loop is not None and loop.returns:
            full_travel = points.value[0, 0] - points.value[0, points.lowest[0]]
            return spread / full_travel, gradient / full_travel, curvature / full_travel
        ratio = problem.contact_stiffness[contact] * spread / (2 * problem.slip_limit[contact])
        gradient, curvature = gradient / spread, curvature / spread
        return float(np.log(ratio)), gradient, curvature - np.outer(gradient, gradient)

    def _limit_parameters(self, second_order: SecondOrder) -> list[tuple[int, float, float]]:
        """Column, exponent and value of the parameters of the limit of a corner."""
        if self.loop is not None and self.loop.returns:
            return []
        result = []
        for name in FRICTION_PARAMETERS:
            if name in second_order.places:
                column = second_order.places[name].start + self.contact
                value = self.problem.own(name, self.problem.parameters[name])[self.contact]
                result.append((column, PARAMETERS[name].in_slip, float(value)))
        return result


def _loops(
    problem: HarmonicBalance, unknowns: FloatArray, slip: NDArray[np.bool_]
) -> list[tuple[float, Loop]]:
    """The hysteresis loops of all slipping contacts, those closest to their limits first."""
    motion, stiffness = problem.relative(unknowns), problem.contact_stiffness
    limit = problem.slip_limit
    slipping = np.flatnonzero(slip & (stiffness > 0) & (limit > 0)).tolist()
    loops = [
        loop
        for j in slipping
        for loop in loops_near_limit(problem.basis, motion[j], j, stiffness[j], limit[j])
    ]
    return sorted(loops, key=lambda pair: pair[0])


def _embedded(block: FloatArray, index: NDArray[np.intp], size: int) -> Any:
    """A square block at an index of rows and columns of a zero matrix, dense or sparse by size."""
    if size <= DENSE_LIMIT:
        matrix = np.zeros((size, size))
        matrix[np.ix_(index, index)] = block
        return matrix
    rows, columns = np.repeat(index, len(index)), np.tile(index, len(index))
    return sp.csr_array((block.ravel(), (rows, columns)), shape=(size, size))
