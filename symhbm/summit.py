"""Maxima of the response over the frequency, and what holds them: slopes and curvatures.

At a *smooth* summit the slope of the amplitude vanishes, at a *corner* one contact is on its limit,
an *edge* is the end of the band. A contact on the limit of a corner is held in stick, where the
equations are smooth on both sides. Variables are unknowns, frequency and the parameters of a
`SecondOrder`, in this order.
"""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.constraints import ON_LIMIT
from symhbm.extremes import turning_points
from symhbm.fourier import FloatArray
from symhbm.linear import DENSE_LIMIT
from symhbm.peaks import Peak, PeakKind
from symhbm.residual import HarmonicBalance
from symhbm.second_order import SecondOrder, turning_hessian
from symhbm.slopes import TIE

_SIGNS = {"contact_stiffness": 1.0, "friction_coefficient": -1.0, "normal_load": -1.0}
"""Exponents of the parameters in the motion over its limit, ``k_d (y_max - y_min) / (2 g)``."""


class SummitKind(StrEnum):
    """What holds a maximum where it is."""

    SMOOTH = "smooth"
    CORNER = "corner"
    EDGE = "edge"


@dataclass(frozen=True)
class Summit:
    """A maximum of the response of ``dof`` over the frequency, at ``unknowns`` (n_unknowns,) [m].

    ``frequency`` is in rad/s. ``contact`` is the one on its limit at a corner, -1 at others;
    ``together``, further contacts on their limits there, with which there is no derivative but by
    parameters that keep them together. ``slip`` (n_contacts,) are the states held.
    """

    problem: HarmonicBalance
    kind: SummitKind
    dof: int
    unknowns: FloatArray
    frequency: float
    slip: NDArray[np.bool_]
    contact: int = -1
    together: tuple[int, ...] = ()

    @classmethod
    def at_peak(cls, problem: HarmonicBalance, peak: Peak) -> "Summit":
        """The summit at a located peak that is not unbounded."""
        friction = problem.locate(peak.unknowns)
        slip, contact, together = friction.slip.copy(), -1, ()
        if peak.kind == PeakKind.CORNER:
            distance = np.abs(friction.excess)
            on_limit = np.flatnonzero(distance <= max(10 * ON_LIMIT, distance.min()))
            contact, *others = on_limit.tolist()
            together = tuple(others)
            slip[on_limit] = False
        kind = SummitKind(str(peak.kind))
        return cls(problem, kind, peak.dof, peak.unknowns, peak.value, slip, contact, together)

    @classmethod
    def at_edge(
        cls, problem: HarmonicBalance, unknowns: FloatArray, frequency: float, dof: int
    ) -> "Summit":
        """The response of one degree of freedom at an end of the band, ``frequency`` in rad/s."""
        slip = problem.locate(unknowns).slip
        return cls(problem, SummitKind.EDGE, dof, unknowns, frequency, slip)

    @property
    def held(self) -> list[int]:
        """The contacts on their limits."""
        return [j for j in (self.contact, *self.together) if j >= 0]

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

    def limit(self, second_order: SecondOrder, excess_gradient: FloatArray) -> FloatArray:
        """Derivative by all variables of the limit of a corner, or of an edge; else zero.

        ``excess_gradient`` (n_contacts, n_components) is that of `LocatedFriction`.
        """
        row = np.zeros(second_order.n_variables)
        if self.kind == SummitKind.EDGE:
            row[self.problem.n_unknowns] = 1 / self.frequency
        elif self.kind == SummitKind.CORNER:
            gradient = excess_gradient[self.contact]
            row[: self.problem.n_unknowns] = self.problem.expand(self.contact, gradient)
            for place, sign, value in self._limit_parameters(second_order):
                row[place] = sign / value
        return row

    def limit_curvature(self, second_order: SecondOrder) -> Any:
        """Second derivative by all variables of the limit of a corner, dense or sparse by size."""
        problem, contact = self.problem, self.contact
        basis = problem.basis
        motion = problem.relative(self.unknowns)[[contact]]
        points = turning_points(basis, motion)
        lowest = points.lowest[0]
        spread = points.value[0, 0] - points.value[0, lowest]
        angle = points.angle[0, [0, lowest]]
        high, low = basis.values(angle)
        gradient = (high - low) / spread
        bend_high, bend_low = turning_hessian(basis, motion[[0, 0]], angle)
        block = (bend_high - bend_low) / spread - np.outer(gradient, gradient)
        rows = problem.expand(contact, np.eye(len(block)))
        near = np.flatnonzero(rows.any(axis=0))
        parameters = self._limit_parameters(second_order)
        places = np.array([*near, *(place for place, _, _ in parameters)])
        curvature = np.diag([0.0] * len(near) + [-sign / value**2 for _, sign, value in parameters])
        curvature[: len(near), : len(near)] = rows[:, near].T @ block @ rows[:, near]
        return _placed(curvature, places, second_order.n_variables)

    def _limit_parameters(self, second_order: SecondOrder) -> list[tuple[int, float, float]]:
        """Place, exponent and value of the parameters of the limit of a corner."""
        problem, contact, values = self.problem, self.contact, self.problem.parameters
        return [
            (second_order.places[name].start + contact, sign, float(own[contact]))
            for name, sign in _SIGNS.items()
            if name in second_order.places
            for own in (problem.own(name, values[name]),)
        ]


def _placed(block: FloatArray, place: NDArray[np.intp], size: int) -> Any:
    """A square block at some rows and columns of a matrix of zeros, dense or sparse by size."""
    if size <= DENSE_LIMIT:
        matrix = np.zeros((size, size))
        matrix[np.ix_(place, place)] = block
        return matrix
    rows, columns = np.repeat(place, len(place)), np.tile(place, len(place))
    return sp.csr_array((block.ravel(), (rows, columns)), shape=(size, size))
