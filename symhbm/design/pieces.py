"""The maxima of one response as functions of the design: values and exact derivatives.

The logarithm of an amplitude over the logarithms of the design variables is close to linear over
decades, as amplitudes go with powers of loads and stiffnesses.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.design.space import Space
from symhbm.numerics import FloatArray
from symhbm.peaks import Conditions, Maximum, MaximumKind, Survey, sector_of, survey
from symhbm.peaks.tracking import advanced, retrack

CONTENDER = 0.7
"""Share of the largest response from which a maximum is a piece: it may be the largest next."""
_FEW = 3
"""Pieces that are worth following through changes of state: a survey finds many at once."""
_MOST = 60
"""Largest number of pieces of one response."""


@dataclass(frozen=True)
class FollowedMaximum:
    """One maximum of a response: ``value``, the logarithm of its amplitude, and derivatives.

    ``gradient`` (n_variables,), ``hessian`` (n_variables, n_variables), by the variables of a
    `Space`; ``summit`` and ``multipliers``, to follow it from.
    """

    value: float
    gradient: FloatArray
    hessian: FloatArray
    summit: Maximum
    multipliers: FloatArray

    @property
    def amplitude(self) -> float:
        """The response there [m]."""
        return float(np.exp(self.value))


@dataclass(frozen=True)
class Maxima:
    """The largest maxima of one response at one design, the highest first.

    ``height`` is the logarithm of the largest response, infinite where it is unbounded or unknown;
    ``surveyed`` tells that the whole band was looked at, and then ``n_peaks``, how many peaks it
    holds; ``reason``, why the height is infinite.
    """

    pieces: list[FollowedMaximum]
    height: float
    surveyed: bool
    n_peaks: int = 0
    reason: str = ""


class Response:
    """The maxima of one case of a design: a parameter set, in ``bands`` [Hz]."""

    def __init__(
        self,
        problem: HarmonicBalance,
        space: Space,
        bands: Sequence[tuple[float, float]],
        compiled: dict[int, SecondOrder] | None = None,
    ):
        self.space = space
        self.bands = bands
        # Sectors that are alike where no variables are stay alike at every design.
        self._problem = sector_of(space.problem(problem, space.apart))
        shared = {} if compiled is None else compiled
        key = id(self._problem.residual)
        if key not in shared:
            shared[key] = SecondOrder(self._problem, space.names)
        self._second_order = shared[key]

    @property
    def n_sectors(self) -> int:
        """Number of sectors that move alike."""
        symmetry = self._problem.symmetry
        return 1 if symmetry is None else symmetry.n_sectors

    @property
    def unique(self) -> bool:
        """Whether there is one response at every frequency."""
        return self._problem.single_valued

    def at(self, x: FloatArray) -> HarmonicBalance:
        """The problem that is solved at a design (n_variables,)."""
        return self.space.problem(self._problem, x)

    def survey(self, x: FloatArray) -> Maxima:
        """All large maxima over the whole of the bands."""
        found = survey(self.at(x), self.bands)
        # What a band that was not followed to its end hides may be higher.
        top = found.height if found.complete else np.inf
        n_peaks = sum(summit.kind != MaximumKind.EDGE for summit in found.maxima)
        if not np.isfinite(top):
            return Maxima([], np.inf, True, n_peaks, _why(found))
        summits = [s for s in found.maxima if s.amplitude >= CONTENDER * top][:_MOST]
        pieces = [self._piece(Conditions(self._second_order, s)) for s in summits]
        return Maxima(pieces, float(np.log(top)), True, n_peaks)

    def follow(self, x: FloatArray, before: FloatArray, pieces: Maxima) -> Maxima | None:
        """The same maxima at another design, from ``before``; None where a survey tells sooner.

        Of a few, those that end on the way are left out: the survey at the end of a descent tells
        what takes their place.
        """
        problem, known = self.at(x), self.at(before)
        few = len(pieces.pieces) <= _FEW
        found = []
        for piece in pieces.pieces:
            summit = replace(piece.summit, problem=known)
            here = Conditions(self._second_order, summit, piece.multipliers)
            step = advanced(here, problem)
            if step is None and not few:
                return None
            there = step[0] if step else retrack(self._second_order, here, problem)
            if there is not None:
                found.append(self._piece(there))
        found.sort(key=lambda piece: -piece.value)
        return Maxima(found, found[0].value, False) if found else None

    def _piece(self, conditions: Conditions) -> FollowedMaximum:
        summit = conditions.maximum
        entries = self.space.derivative(summit.problem, self._second_order.places)
        slope = entries.T @ conditions.gradient
        bend = entries.T @ conditions.hessian @ entries + np.diag(slope)
        amplitude = summit.amplitude
        gradient = slope / amplitude
        hessian = bend / amplitude - np.outer(gradient, gradient)
        # Pieces travel between processes, without the problem.
        place = replace(summit, problem=None)
        value = float(np.log(amplitude))
        return FollowedMaximum(value, gradient, hessian, place, conditions.multipliers)


def _why(found: Survey) -> str:
    if found.unbounded:
        peak = found.unbounded[0]
        return f"unbounded at {peak.value / (2 * np.pi):.6g} Hz"
    return str(found.status)
