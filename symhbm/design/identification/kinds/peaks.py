"""Peaks of what a sensor reads over the frequency: their frequencies and heights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np
import scipy.sparse as sp

from symhbm.balance import HarmonicBalance
from symhbm.balance.goals import Goal, Solution
from symhbm.design.identification.kinds.curve import (
    Curve,
    Members,
    Nearby,
    Reading,
    Sensor,
    Solved,
    Work,
)
from symhbm.design.identification.observations import Rows
from symhbm.numerics import RADIANS, FloatArray
from symhbm.peaks import Conditions, MaximumKind, survey
from symhbm.peaks.tracking import advanced, verified

_BESIDE = 0.1
"""How far beside peaks, relative, the response is followed."""


@dataclass(frozen=True, eq=False)
class Peak(Solved):
    """The highest peak of a goal over the frequency; its state is its height and frequency."""

    conditions: Conditions

    @classmethod
    def of(cls, conditions: Conditions) -> Peak:
        """That of a solved maximum."""
        at = conditions.maximum
        state = np.array([at.amplitude, at.frequency])
        return cls(at.problem, at.frequency, state, conditions.evaluation, conditions)

    @property
    def motion(self) -> FloatArray:
        """As of any solution."""
        return self.conditions.maximum.unknowns

    @property
    def margins(self) -> FloatArray:
        """As of any solution; a corner is where a contact is on its limit, and moves with it."""
        margins = self.evaluation.states.margins.copy()
        margins[self.conditions.maximum.on_limit] = np.inf
        return margins

    def move(self, own: FloatArray) -> FloatArray:
        """As of any solution."""
        return np.array([self.conditions.gradient, self.conditions.frequency_gradient]) @ own

    def bend(self, pull: FloatArray, own: FloatArray, bends: FloatArray) -> FloatArray:
        """As of any solution."""
        of = self.conditions
        second = pull[0] * of.hessian
        if pull[1]:
            second = second + pull[1] * of.frequency_hessian
        first = pull @ np.array([of.gradient, of.frequency_gradient])
        return own.T @ second @ own + np.tensordot(first, bends, 1)


@dataclass(frozen=True, eq=False)
class PeakCurve(Curve):
    """Peaks of one sensor, each the highest in a band [Hz]."""

    forms = "peak_frequency", "peak_amplitude"

    @staticmethod
    def asked(rows: Rows, i: int) -> tuple[Sensor, tuple[float, float]]:
        """Those of a sensor are of one curve, in bands [Hz]."""
        band = float(rows.lowest[i]), float(rows.highest[i])
        return Sensor.of(rows, i)._replace(units=""), band

    @classmethod
    def of(cls, members: Members) -> PeakCurve:
        """As of any kind."""
        rows, problem, read = members.rows, members.problem, {}
        sensors = {i: Sensor.of(rows, i) for i in members.numbers.tolist()}
        for i, sensor in sensors.items():
            read[i] = Reading.entry(2, 1, 1 / RADIANS, float(rows.frequency[i]))
            if rows.form[i] == "peak_amplitude":
                read[i] = Reading(np.diag([1.0, 0.0]), "magnitude", sensor.reach(rows, i))
        *_, goal = (SensorAmplitude.of(problem, one) for one in dict.fromkeys(sensors.values()))
        return cls._from(members, problem.with_peaks_of(goal), read)

    @property
    def band(self) -> tuple[float, float]:
        """Frequencies [Hz] about all peaks."""
        ends = (1 - _BESIDE) * self.omegas.min(), (1 + _BESIDE) * self.omegas.max()
        return float(ends[0] / RADIANS), float(ends[1] / RADIANS)

    def solve(self, problem: HarmonicBalance, nearby: Nearby, work: Work) -> list[Peak]:
        """As of any kind."""
        work.n_solved += len(self.given)
        before = [one for one, _ in nearby] or [None] * len(self.given)
        return [_peak(problem, *one, work) for one in zip(self.given, before, strict=True)]


def _peak(
    problem: HarmonicBalance, band: tuple[float, float], near: Solved | None, work: Work
) -> Peak:
    """The highest peak in a ``band`` [Hz], or the one that a peak ``near`` becomes."""
    if isinstance(near, Peak):
        step = advanced(near.conditions, problem)
        if step is not None and band[0] <= step[0].maximum.frequency / RADIANS <= band[1]:
            return Peak.of(step[0])
    surveyed = survey(problem, [band])
    # A response that is highest at an end of the band has no peak there.
    maxima = [one for one in surveyed.maxima if one.kind != MaximumKind.EDGE]
    if np.isfinite(surveyed.height) and maxima:
        solved = verified(work.order(problem), maxima[0])
        if solved is not None:
            return Peak.of(solved)
    raise ArithmeticError(f"no peak was found from {band[0]:g} to {band[1]:g} Hz")


@dataclass(frozen=True, repr=False)
class SensorAmplitude(Goal):
    """Amplitude of a ``harmonic`` of what a sensor reads, ``weights`` of degrees of freedom.

    The reading is the derivative of order ``power`` by the time.
    """

    units: ClassVar[str] = "1"
    meaning: ClassVar[str] = "amplitude of a harmonic of what a sensor reads"
    weights: tuple[tuple[int, float], ...]
    harmonic: int
    power: int

    @classmethod
    def of(cls, problem: HarmonicBalance, sensor: Sensor) -> SensorAmplitude:
        """That of a sensor."""
        row = sp.coo_array(sensor.row(problem))
        weights = zip(row.coords[1].tolist(), row.data.tolist(), strict=True)
        return cls(tuple(weights), sensor.harmonic, sensor.power)

    def value(self, at: Solution) -> Any:
        """As of any goal."""
        parts = [
            sum(
                weight * at.coefficients[at.basis.component(self.harmonic, sine), dof]
                for dof, weight in self.weights
            )
            for sine in (False, True)
        ]
        return (self.harmonic * at.frequency) ** self.power * ca.sqrt(parts[0] ** 2 + parts[1] ** 2)
