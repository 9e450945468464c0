"""Maxima of one response as functions of the design: values and exact derivatives.

The logarithm of an amplitude over the logarithms of the design variables is close to linear over
decades, as amplitudes go with powers of loads and stiffnesses.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.design import tolerances
from symhbm.design.variables import DesignVariables
from symhbm.numerics import RADIANS, FloatArray
from symhbm.peaks import Conditions, Maximum, MaximumKind, Survey, sector_of, survey
from symhbm.peaks.tracking import advanced, retrack

_NOTHING = 1e-300
"""What a goal of 0 counts as, which has no logarithm."""


@dataclass(frozen=True)
class FollowedMaximum:
    """One maximum of a response: ``value``, the logarithm of its amplitude, and derivatives.

    ``gradient`` (n_variables,), ``hessian`` (n_variables, n_variables), by the variables of a
    `DesignVariables`; ``maximum`` and ``multipliers``, from which it is followed.
    """

    value: float
    gradient: FloatArray
    hessian: FloatArray
    maximum: Maximum
    multipliers: FloatArray

    @property
    def amplitude(self) -> float:
        """The response there [m]."""
        return float(amplitudes(self.value))


@dataclass(frozen=True)
class Maxima:
    """Contenders of one response at one design: the maxima that may become the largest.

    ``contenders`` are in descending order; ``height`` is the logarithm of the largest response,
    infinite where it is unbounded or unknown; ``surveyed`` tells that the whole band was followed,
    and then ``n_peaks`` is its number of peaks; ``reason`` tells why the height is infinite, and
    ``failed`` that it is because the band could not be followed.
    """

    contenders: list[FollowedMaximum]
    height: float
    surveyed: bool
    n_peaks: int = 0
    reason: str = ""
    failed: bool = False

    @classmethod
    def of_failure(cls, reason: str) -> "Maxima":
        """Nothing known, for a ``reason``."""
        return cls([], np.inf, True, 0, reason, True)


class Response:
    """The maxima of one case of a design: a parameter set, in ``bands`` [Hz].

    Those of one ``dof``, or of all.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        variables: DesignVariables,
        bands: Sequence[tuple[float, float]],
        compiled: dict[int, SecondOrder] | None = None,
        dof: int | None = None,
    ):
        self.variables, self.bands, self.dof = variables, bands, dof
        # Sectors that are alike at a design of different variables are alike at every design.
        whole = variables.problem(problem, variables.apart)
        self._problem = sector_of(whole) if dof is None else whole
        shared = {} if compiled is None else compiled
        key = id(self._problem.compiled[0].residual)
        if key not in shared:
            shared[key] = SecondOrder(self._problem, variables.names)
        self._second_order = shared[key]

    @property
    def unique(self) -> bool:
        """Whether there is one response at every frequency."""
        return self._problem.single_valued

    def at(self, x: FloatArray) -> HarmonicBalance:
        """The problem that is solved at a design (n_variables,)."""
        return self.variables.problem(self._problem, x)

    def survey(self, x: FloatArray) -> Maxima:
        """All contenders over the whole bands."""
        surveyed = survey(self.at(x), self.bands, dof=self.dof)
        # A band that was not followed to its end may hold a higher maximum.
        top = surveyed.height if surveyed.complete else np.inf
        n_peaks = sum(maximum.kind != MaximumKind.EDGE for maximum in surveyed.maxima)
        n_peaks += top == 0  # all along: it is no resonance outside that is highest at an end
        if not np.isfinite(top):
            failed = not surveyed.unbounded
            return Maxima([], np.inf, True, n_peaks, _why(surveyed), failed)
        least = tolerances.CONTENDER * top
        # Beside resonances the ends of bands rise and fall against each other by large factors.
        beside = surveyed.maxima[0].kind == MaximumKind.EDGE
        ends = {s.frequency: s for s in reversed(surveyed.maxima) if s.kind == MaximumKind.EDGE}
        kept = {id(s) for s in ends.values()} if beside else set()
        maxima = [s for s in surveyed.maxima if s.amplitude >= least or id(s) in kept]
        maxima = maxima[: tolerances.MOST]
        contenders = [self._followed(Conditions.of(self._second_order, s)) for s in maxima]
        return Maxima(contenders, _logarithm(top), True, n_peaks)

    def follow(self, x: FloatArray, before: FloatArray, maxima: Maxima) -> Maxima | None:
        """The same maxima at another design, from ``before``; None where a survey is needed.

        Of few contenders, those that end between the designs are left out: the survey at the end of
        a descent finds what replaces them.
        """
        problem, previous_problem = self.at(x), self.at(before)
        few = len(maxima.contenders) <= tolerances.FEW
        followed = []
        for contender in maxima.contenders:
            maximum = replace(contender.maximum, problem=previous_problem)
            conditions = Conditions.of(self._second_order, maximum, contender.multipliers)
            step = advanced(conditions, problem)
            if step is None and not few:
                return None
            moved = step[0] if step else retrack(conditions, problem)
            if moved is not None and not self._inside(moved.maximum):
                return None  # The end of the band takes the place of a peak that left it.
            if moved is not None:
                followed.append(self._followed(moved))
        followed.sort(key=lambda contender: -contender.value)
        return Maxima(followed, followed[0].value, False) if followed else None

    def _inside(self, maximum: Maximum) -> bool:
        frequency = maximum.frequency / RADIANS
        return maximum.held or any(low <= frequency <= high for low, high in self.bands)

    def _followed(self, conditions: Conditions) -> FollowedMaximum:
        maximum = conditions.maximum
        entries = self.variables.derivative(maximum.problem, self._second_order.places)
        slope = entries.T @ conditions.gradient
        bend = entries.T @ conditions.hessian @ entries + np.diag(slope)
        amplitude = max(maximum.amplitude, _NOTHING)
        gradient = slope / amplitude
        hessian = bend / amplitude - np.outer(gradient, gradient)
        # Maxima are sent between processes, without the problem.
        detached = replace(maximum, problem=None)
        value = _logarithm(amplitude)
        return FollowedMaximum(value, gradient, hessian, detached, conditions.multipliers)


def amplitudes(heights: Any) -> FloatArray:
    """The amplitudes, goals or aims of their logarithms."""
    return np.where(np.asarray(heights) <= np.log(2 * _NOTHING), 0.0, np.exp(heights))


def _logarithm(amplitude: float) -> float:
    return float(np.log(max(amplitude, _NOTHING)))


def _why(surveyed: Survey) -> str:
    if surveyed.unbounded:
        peak = surveyed.unbounded[0]
        return f"unbounded at {peak.value / (2 * np.pi):.6g} Hz"
    return str(surveyed.status)
