"""Maxima of the response over the frequency, and what holds them: slopes and curvatures.

At a *smooth* summit the slope of the amplitude vanishes, at a *corner* one contact is on its limit,
an *edge* is the end of the band. A contact on the limit of a corner is held in stick, where the
equations are smooth on both sides; the limit may be that of a small loop within its hysteresis, see
`symhbm.model.contacts.coulomb_loops`. Variables are unknowns, frequency and the parameters of a
`SecondOrder`, in this order.
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
    """What holds a maximum where it is."""

    SMOOTH = "smooth"
    CORNER = "corner"
    EDGE = "edge"


@dataclass(frozen=True)
class Maximum:
    """A maximum of the response of ``dof`` over the frequency, at ``unknowns`` (n_unknowns,) [m].

    ``frequency`` is in rad/s. ``contact`` is the one on its limit at a corner, -1 at others;
    ``together``, further contacts on their limits there, with which there is no derivative but by
    parameters that keep them together. ``slip`` (n_contacts,) are the states held. ``loop`` is the
    one on its limit where the contact slips elsewhere.
    """

    problem: HarmonicBalance
    kind: MaximumKind
    dof: int
    unknowns: FloatArray
    frequency: float
    slip: NDArray[np.bool_]
    contact: int = -1
    together: tuple[int, ...] = ()
    loop: Loop | None = None

    @classmethod
    def at_peak(cls, problem: HarmonicBalance, peak: Peak) -> "Maximum":
        """The summit at a located peak that is not unbounded."""
        friction = problem.locate(peak.unknowns)
        slip, contact, together, loop = friction.slip.copy(), -1, (), None
        if peak.kind == PeakKind.CORNER:
            distance = np.abs(friction.slip_margin)
            near = max(10 * ON_LIMIT, distance.min())
            on_limit = np.flatnonzero(distance <= near).tolist()
            loops = _loops(problem, peak.unknowns, slip) if near > 10 * ON_LIMIT else []
            if loops and loops[0][0] < near:
                loop = loops[0][1]
                on_limit = [each.contact for far, each in loops if far <= 10 * ON_LIMIT]
                on_limit = on_limit or [loop.contact]
            else:
                slip[on_limit] = False
            contact, *others = on_limit
            together = tuple(others)
        kind, at = MaximumKind(str(peak.kind)), (peak.unknowns, peak.value)
        return cls(problem, kind, peak.dof, *at, slip, contact, together, loop)

    @classmethod
    def at_edge(
        cls, problem: HarmonicBalance, unknowns: FloatArray, frequency: float, dof: int
    ) -> "Maximum":
        """The response of one degree of freedom at an end of the band, ``frequency`` in rad/s."""
        slip = problem.locate(unknowns).slip
        return cls(problem, MaximumKind.EDGE, dof, unknowns, frequency, slip)

    @property
    def held(self) -> list[int]:
        """The contacts on the limit between stick and slip, not those on that of a loop."""
        on_limit = (self.contact, *self.together) if self.loop is None else ()
        return [j for j in on_limit if j >= 0]

    def evaluate(self, slips: bool = False) -> Evaluation:
        """The equations there, at a corner on the side on which the contact sticks, or ``slips``.

        Both are continued smoothly past the limit.
        """
        problem, at = self.problem, (self.unknowns, self.frequency)
        if self.loop is None:
            states = self.slip.copy()
            states[self.held if slips else []] = True
            return problem.evaluate(*at, states)
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
        return problem.evaluate(*at, self.slip, friction)

    def moved(self, unknowns: FloatArray, frequency: float) -> "Maximum":
        """The same summit elsewhere."""
        loop = self.loop
        if loop is not None:
            motion = self.problem.relative(unknowns)[loop.contact]
            loop = loop.on(self.problem.basis, motion)
        return replace(self, unknowns=unknowns, frequency=frequency, loop=loop)

    @property
    def place(self) -> slice:
        """Where the coefficients of the degree of freedom are among the unknowns."""
        size = self.problem.basis.n_components
        return slice(self.dof * size, (self.dof + 1) * size)

    @property
    def motion(self) -> FloatArray:
        """The coefficients of the degree of freedom, (n_components,) [m]."""
        return self.unknowns[self.place]

    @property
    def amplitude(self) -> float:
        """The response there [m]."""
        return self._top[0]

    @cached_property
    def amplitude_slope(self) -> FloatArray:
        """Derivative of the amplitude by the coefficients of the degree of freedom."""
        values = self.problem.basis.values(self._top[1])
        return np.sign(values @ self.motion) * values

    @cached_property
    def _top(self) -> tuple[float, float]:
        """Largest displacement and its angle, of two opposite ones the positive."""
        points = turning_points(self.problem.basis, self.motion[None])
        size = np.abs(points.value[0])
        at = 0 if size[0] >= (1 - TIE) * size.max() else int(size.argmax())
        return float(size[at]), float(points.angle[0, at])

    def amplitude_curvature(self, size: int) -> Any:
        """Second derivative of the amplitude by ``size`` variables, dense or sparse by size."""
        basis = self.problem.basis
        slope, bend = (basis.values(self._top[1], derivative) for derivative in (1, 2))
        # The angle of the maximum moves with the motion.
        block = np.outer(slope, slope) / abs(bend @ self.motion)
        return _placed(block, np.arange(self.place.start, self.place.stop), size)

    @property
    def slip_margin(self) -> float:
        """How far the contact of a corner is beyond its limit, relatively."""
        return self._limit[0]

    def limit(self, second_order: SecondOrder) -> FloatArray:
        """Derivative by all variables of the limit of a corner, or of an edge; else zero."""
        row = np.zeros(second_order.n_variables)
        if self.kind == MaximumKind.EDGE:
            row[self.problem.n_unknowns] = 1 / self.frequency
        elif self.kind == MaximumKind.CORNER:
            row[: self.problem.n_unknowns] = self.problem.expand(self.contact, self._limit[1])
            for place, sign, value in self._limit_parameters(second_order):
                row[place] = sign / value
        return row

    def limit_curvature(self, second_order: SecondOrder) -> Any:
        """Second derivative by all variables of the limit of a corner, dense or sparse by size."""
        block = self._limit[2]
        rows = self.problem.expand(self.contact, np.eye(len(block)))
        near = np.flatnonzero(rows.any(axis=0))
        parameters = self._limit_parameters(second_order)
        places = np.array([*near, *(place for place, _, _ in parameters)])
        curvature = np.diag([0.0] * len(near) + [-sign / value**2 for _, sign, value in parameters])
        curvature[: len(near), : len(near)] = rows[:, near].T @ block @ rows[:, near]
        return _placed(curvature, places, second_order.n_variables)

    @cached_property
    def _limit(self) -> tuple[float, FloatArray, FloatArray]:
        """The limit of a corner, and its derivatives by the motion of the contact.

        The logarithm of the travel between two turning points over ``2 mu F_n / k_d``; of a loop
        that returns to the same limit, the travel itself.
        """
        problem, contact, loop = self.problem, self.contact, self.loop
        basis, motion = problem.basis, problem.relative(self.unknowns)[[contact]]
        points = turning_points(basis, motion)
        angle = points.angle[0, [0, points.lowest[0]]]
        if loop is not None:
            around = loop.on(basis, motion[0])
            angle = np.array([around.end, around.begin])[:: loop.sides[1]]
        high, low = basis.values(angle)
        spread = float((high - low) @ motion[0])
        gradient = high - low
        bend_high, bend_low = turning_hessian(basis, motion[[0, 0]], angle)
        curvature = bend_high - bend_low
        if loop is not None and loop.returns:
            whole = points.value[0, 0] - points.value[0, points.lowest[0]]
            return spread / whole, gradient / whole, curvature / whole
        size = problem.contact_stiffness[contact] * spread / (2 * problem.slip_limit[contact])
        gradient, curvature = gradient / spread, curvature / spread
        return float(np.log(size)), gradient, curvature - np.outer(gradient, gradient)

    def _limit_parameters(self, second_order: SecondOrder) -> list[tuple[int, float, float]]:
        """Place, exponent and value of the parameters of the limit of a corner."""
        if self.loop is not None and self.loop.returns:
            return []
        problem, contact, values = self.problem, self.contact, self.problem.parameters
        return [
            (
                second_order.places[name].start + contact,
                PARAMETERS[name].in_slip,
                float(own[contact]),
            )
            for name in FRICTION_PARAMETERS
            if name in second_order.places
            for own in (problem.own(name, values[name]),)
        ]


def _loops(
    problem: HarmonicBalance, unknowns: FloatArray, slip: NDArray[np.bool_]
) -> list[tuple[float, Loop]]:
    """The loops of all contacts that slip, those closest to their limits first."""
    motion, stiffness, limit = (
        problem.relative(unknowns),
        problem.contact_stiffness,
        problem.slip_limit,
    )
    sliding = np.flatnonzero(slip & (stiffness > 0) & (limit > 0)).tolist()
    found = [
        loop
        for j in sliding
        for loop in loops_near_limit(problem.basis, motion[j], j, stiffness[j], limit[j])
    ]
    return sorted(found, key=lambda each: each[0])


def _placed(block: FloatArray, place: NDArray[np.intp], size: int) -> Any:
    """A square block at some rows and columns of a matrix of zeros, dense or sparse by size."""
    if size <= DENSE_LIMIT:
        matrix = np.zeros((size, size))
        matrix[np.ix_(place, place)] = block
        return matrix
    rows, columns = np.repeat(place, len(place)), np.tile(place, len(place))
    return sp.csr_array((block.ravel(), (rows, columns)), shape=(size, size))
