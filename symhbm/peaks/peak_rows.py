"""Rows of a peak curve: the largest peak at values of the parameter, as results and a status.

Where responses are not unique, a loop of them may come off the branch as a parameter moves, with a
peak that goes on without a gap: on an island, which no branch that a survey follows reaches. Unique
responses have no islands.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation import Status
from symhbm.continuation.between import Peak, PeakKind
from symhbm.numerics import RADIANS, FloatArray, Table, by_harmonic
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import Maximum, MaximumKind
from symhbm.peaks.tracking import (
    EnvelopePoint,
    LeadingBranches,
    SurveyedValue,
    UpperEnvelope,
    polished,
)

_AGREEMENT = 1e-9
"""Relative difference of a survey and a row that counts as none: peaks are located that well."""
_SAME_HEIGHT = 1e-6
"""Relative difference of heights that is no other branch: where an island comes off, the highest
response falls by far more."""
_BESIDE = 2e-3
"""Distance from a jump of the envelope that is the jump, as surveys beside it verify it."""


@dataclass(frozen=True)
class Islands:
    """Whether the highest peak is on an island at ascending ``values`` (n,), ``there`` (n,)."""

    values: FloatArray
    there: NDArray[np.bool_]

    @classmethod
    def of(cls, leading: LeadingBranches, wanted: list[float]) -> "Islands":
        """Told at all surveyed values, and by halves between two that differ.

        Those end where none wanted lies between and the island begins or ends within `_BESIDE`.
        """
        parameter = leading.parameter
        if parameter.problem.single_valued:
            return cls(np.array([parameter.low]), np.array([False]))
        told = {value: _on_island(leading, at) for value, at in sorted(leading.surveyed.items())}
        for (low, first), (high, last) in pairwise(list(told.items())):
            while first != last:
                inside = [value for value in wanted if low < value < high]
                if not inside and high - low <= _BESIDE * abs(high):
                    break
                middle = inside[len(inside) // 2] if inside else parameter.value(low, high, 0.5)
                told[middle] = _on_island(leading, leading.survey([middle])[0])
                low, high = (middle, high) if told[middle] == first else (low, middle)
        values = sorted(told)
        return cls(np.array(values), np.array([told[value] for value in values]))

    def at(self, values: FloatArray) -> NDArray[np.bool_]:
        """Whether the highest peak is on an island at ``values`` (m,), those wanted."""
        return self.there[np.searchsorted(self.values, values, side="right") - 1]

    def begin_or_end(self, value: float) -> bool:
        """Whether one begins or ends at a value, where the largest response jumps."""
        shores = np.flatnonzero(np.diff(self.there))
        low, high = self.values[shores], self.values[shores + 1]
        return bool(np.any((low * (1 - _BESIDE) <= value) & (value <= high * (1 + _BESIDE))))


def _on_island(leading: LeadingBranches, surveyed: SurveyedValue) -> bool:
    """Whether the followed branches are higher than a survey of the whole band."""
    survey, highest = surveyed.survey, leading.followed.highest(surveyed.value)
    if highest is None or not survey.complete:
        return False
    return highest[1].maximum.amplitude > (1 + _SAME_HEIGHT) * survey.height


class Row(NamedTuple):
    """The largest peak at a value of the parameter: its amplitude [m], frequency [Hz] and others.

    ``slope`` is the derivative of the amplitude by the parameter, NaN where there is none;
    ``unknowns`` (n_unknowns,) [m] the response, NaN where it is unbounded.
    """

    value: float
    amplitude: float
    frequency: float
    kind: str
    dof: int
    slope: float
    residual_norm: float
    unknowns: FloatArray

    @classmethod
    def of(cls, value: float, maximum: Maximum, slope: float) -> "Row":
        """The row of a maximum."""
        unknowns, omega = maximum.unknowns, maximum.frequency
        peak = maximum.amplitude, omega / RADIANS, str(maximum.kind), maximum.dof
        return cls(value, *peak, slope, maximum.problem.evaluate(unknowns, omega).norm, unknowns)

    @classmethod
    def unbounded(cls, value: float, pole: Peak | None, n_unknowns: int) -> "Row":
        """The row where a peak is unbounded, as far as its ``pole`` is known."""
        frequency, dof = (np.nan, -1) if pole is None else (pole.value / RADIANS, pole.dof)
        unknown, kind = np.full(n_unknowns, np.nan), str(PeakKind.UNBOUNDED)
        return cls(value, np.inf, frequency, kind, dof, np.nan, np.nan, unknown)


def rows_of(
    leading: LeadingBranches, envelope: UpperEnvelope, grid: FloatArray | None
) -> list[Row]:
    """The rows at the values asked for, or at all points that were solved for."""
    if grid is not None:
        return [_at(leading, value) for value in grid.tolist()]
    rows = {p.value: _solved(leading, p.value, p.conditions) for p in envelope.points}
    for value, surveyed in leading.surveyed.items():
        row = rows.get(value)
        if row is None or surveyed.survey.height > (1 + _AGREEMENT) * row.amplitude:
            rows[value] = _surveyed(leading, surveyed)
    return [rows[value] for value in sorted(rows)]


def _at(leading: LeadingBranches, value: float) -> Row:
    ranges = *leading.unbounded, *leading.unresolved
    unresolved = any(low <= value <= high for low, high in ranges)
    highest = None if unresolved else leading.followed.highest(value)
    if highest is None:
        return _surveyed(leading, leading.surveyed.get(value) or leading.survey([value])[0])
    return _solved(leading, value, highest[1])


def _solved(leading: LeadingBranches, value: float, conditions: Conditions) -> Row:
    conditions = polished(conditions)
    return Row.of(value, conditions.maximum, leading.parameter.slope(conditions))


def _surveyed(leading: LeadingBranches, surveyed: SurveyedValue) -> Row:
    """The highest maximum of a survey, which need not have derivatives."""
    survey, value = surveyed.survey, surveyed.value
    if survey.unbounded or not survey.maxima:
        pole = survey.unbounded[0] if survey.unbounded else None
        return Row.unbounded(value, pole, leading.parameter.problem.n_unknowns)
    for candidate in surveyed.candidates:
        if candidate.maximum.amplitude >= (1 - _AGREEMENT) * survey.maxima[0].amplitude:
            return _solved(leading, value, candidate)
    return Row.of(value, survey.maxima[0], np.nan)


def results_of(
    leading: LeadingBranches, envelope: UpperEnvelope, rows: list[Row], islands: Islands
) -> Table:
    """All results by the names of the dataset."""
    problem, name = leading.parameter.problem, leading.parameter.name
    responses = [problem.layout.everywhere(row.unknowns) for row in rows]
    minima = [minimum.conditions.maximum for minimum in envelope.minima]
    frequencies = np.array([minimum.frequency for minimum in minima])
    symmetry = problem.symmetry
    return {
        "peak_amplitude": np.array([row.amplitude for row in rows]),
        "peak_frequency": np.array([row.frequency for row in rows]),
        "peak_kind": np.array([row.kind for row in rows], dtype=object),
        "peak_dof": np.array([row.dof for row in rows], dtype=np.int32),
        "peak_amplitude_slope": np.array([row.slope for row in rows]),
        "peak_residual_norm": np.array([row.residual_norm for row in rows]),
        "peak_coefficient": np.array([by_harmonic(problem.basis, x) for x in responses]),
        f"minimum_{name}": _values(envelope.minima),
        "minimum_amplitude": np.array([minimum.amplitude for minimum in minima]),
        "minimum_frequency": frequencies / RADIANS,
        "minimum_kind": _kinds(envelope.minima),
        f"event_{name}": _values(envelope.events),
        "event_kind": _kinds(envelope.events),
        "peak_on_island": islands.at(np.array([row.value for row in rows])),
        "surveyed": np.array([row.value in leading.surveyed for row in rows]),
        "n_sectors": np.int32(1 if symmetry is None else symmetry.n_sectors),
        "n_surveys": np.int32(leading.surveyor.count),
    }


def status_of(
    leading: LeadingBranches, envelope: UpperEnvelope, rows: list[Row], islands: Islands
) -> str:
    """Status sentences for the user."""
    kinds = {row.kind for row in rows}
    missed = [value for value in envelope.unresolved if not islands.begin_or_end(value)]
    said = {
        Status.SURVEY_INCOMPLETE: leading.incomplete,
        Status.PEAK_NOT_FOLLOWED: leading.unresolved or missed,
        Status.PEAK_ON_ISLAND: islands.there.any(),
        Status.PEAK_UNBOUNDED: PeakKind.UNBOUNDED in kinds or leading.unbounded,
        Status.PEAK_AT_EDGE: MaximumKind.EDGE in kinds,
    } | {s: s in leading.statuses for s in (Status.OTHER_SOLUTIONS, Status.BRANCH_POINTS)}
    return "; moreover, ".join(s for s, applies in said.items() if applies) or Status.REACHED_END


def _values(points: list[EnvelopePoint]) -> FloatArray:
    return np.array([point.value for point in points], dtype=float)


def _kinds(points: list[EnvelopePoint]) -> np.ndarray:
    return np.array([str(point.kind) for point in points], dtype=object)
