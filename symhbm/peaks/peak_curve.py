"""`peak_curve`: the largest peak over one parameter, with its minima and events.

Where responses are not unique, a loop of them may come off the branch as a parameter moves, with a
peak that goes on without a gap: on an island, which no branch that a survey follows reaches. Unique
responses have no islands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from symhbm.balance import HarmonicBalance, check_mean, check_problem
from symhbm.continuation import SolveError, Status
from symhbm.continuation.between import Peak, PeakKind
from symhbm.model import advise_condensing, warn_of_doubts
from symhbm.model.linear import natural_band
from symhbm.numerics import RADIANS, FloatArray, Table, by_harmonic, check
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import Maximum, MaximumKind
from symhbm.peaks.survey import Surveyor, sector_of
from symhbm.peaks.tracking import (
    EnvelopePoint,
    LeadingBranches,
    Parameter,
    SurveyedValue,
    UpperEnvelope,
    polished,
)
from symhbm.results import Request, check_axis, check_band, runs, schema
from symhbm.workers import unkept

_AGREEMENT = 1e-9
"""Relative difference of a survey and a row that counts as none: peaks are located that well."""
_SAME_HEIGHT = 1e-6
"""Relative difference of heights that is no other branch: where an island comes off, the highest
response falls by far more."""
_BESIDE = 2e-3
"""Distance from a jump of the envelope that is the jump, as surveys beside it verify it."""
_ROUNDS = 6
"""Largest number of times that minima and exchanges are surveyed and missed branches followed."""


@unkept("a curve")
def peak_curve(
    problem: HarmonicBalance,
    parameter: str,
    band: tuple[float, float],
    at: ArrayLike | None = None,
    *,
    frequency_band: float | tuple[float, float] | Sequence[tuple[float, float]] | None = None,
    **run: Unpack[runs.Sharing],
) -> xr.Dataset:
    """Largest peak of the response over a named parameter, with its minima and events.

    Surveys at some values find all peaks (``surveyed`` is True there), exact continuation follows
    those that may lead. Surveys are at most a factor of 3.2 apart with one degree of freedom (or
    one per sector), and 1.25 with several. Where one shows a peak that was not followed and may
    lead close by, both sides are surveyed until two in a row show nothing new or they are 8 %
    apart; minima and exchanges of the lead are surveyed too. A peak that leads only between two
    surveys, and is low or absent at both, is missed: close values in ``at`` make this less likely.

    Parameters
    ----------
    problem
        What to solve, with located events, and what has peaks (``peaks_of``): an output, or a goal
        that is above 0 at all values of ``band``, in the place of displacements. Where responses
        need not be unique, surveys see the branch that starts at the low end of each band, as `frf`
        does. A followed peak may come off it with an island of responses: it is on the curve for as
        long as it is the highest, and ``peak_on_island`` and ``status`` tell, by the surveys on
        both sides. Islands that are apart at all values of ``band`` are not found.
    parameter
        The name of the parameter that moves, for example ``"normal_load"``, for all contacts or
        blades alike, or with the number of one: ``"normal_load[2]"``.
    band
        Its first and last value (SI units).
    at : (n,), ascending
        Values at which the peak is wanted; those more than 8 % apart are surveyed. By default the
        result holds the points that were solved for on the way, with all minima and events: as
        many as cubic interpolation of logarithms with the slopes needs for 1e-5 in between.
    frequency_band
        Band (first, last) of excitation frequencies [Hz], several that do not overlap, or one
        frequency whose response is followed; by default a band that holds all resonances.
    **run
        ``executor`` (of the surveys), ``throw`` (unless the curve is complete and bounded) and
        ``progress``, as `symhbm.Run` tells.

    Returns
    -------
    Dataset along the parameter, ascending: ``peak_amplitude`` [m], ``peak_frequency`` [Hz],
    ``peak_kind`` (smooth, corner, edge, point, unbounded), ``peak_dof``,
    ``peak_amplitude_slope`` (its exact derivative by the parameter, at an event that of one side,
    which points right below and above tell apart), ``peak_residual_norm``, ``peak_coefficient``
    [m], ``surveyed`` and ``peak_on_island`` (whether `frf` from the low end of the band does not
    reach it); along ``minimum`` the local minima of the curve and what makes them (smooth,
    exchange, kink, end); along ``event`` where another peak takes the lead or the leading one
    changes its kind. ``status`` tells whether surveys agree, and whether the peak is at an end of
    the band of frequencies or unbounded somewhere.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    SolveError
        If the curve is incomplete, unbounded or at an edge somewhere and ``throw`` is True; its
        ``result`` is the dataset.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> curve = sh.peak_curve(problem, "normal_load", (1, 10))
    >>> curve.minimum_normal_load.values.round(6)
    array([3.088579])
    """
    check_problem(problem, bends=True)
    advise_condensing(problem.model, problem.n_unknowns, "second derivatives take minutes")
    axis = check_axis(problem, parameter, band, at)
    parameter, grid, index = axis["name"], axis["at"], axis["index"]
    low, high = sorted(axis["band"])
    running = runs.Running.of(run, runs.Sharing)
    if problem.samples is not None:
        raise ValueError(
            f"samples={problem.samples}: expected a problem with located switching angles; "
            "peaks of friction over samples cannot be followed"
        )
    check_mean(problem)
    # Of a copy: what is derived by the parameter of an idle contact takes part from then on.
    moving = Parameter(problem.with_parameters(), parameter, index, low, high)
    first, last = map(moving.at, (low, high))
    bands = _bands(frequency_band, first, last)
    limits = float(np.min(bands)), float(np.max(bands))
    problem.model.check_frequencies("frequency_band", limits)
    warn_of_doubts(problem.model, limits, problem.harmonics, moving=[parameter])
    start = last if index is not None else sector_of(last)
    surveyor = Surveyor(bands, running.executor, running.progress)
    with surveyor:
        leading = LeadingBranches(Parameter(start, parameter, index, low, high), surveyor)
        leading.follow([] if grid is None else grid.tolist())
        envelope = _verified_envelope(leading)
        rows = rows_of(leading, envelope, grid)
        islands = Islands.of(leading, [row.value for row in rows])
    axis["at"] = np.array([row.value for row in rows])
    results = results_of(leading, envelope, rows, islands)
    status = status_of(leading, envelope, rows, islands)
    result = schema.label_over_parameter(
        "peak_amplitude", problem, Request(**axis), results, status, bands
    )
    if running.throw and result["status"].item() != Status.REACHED_END:
        raise SolveError(result["status"].item(), result)
    return result


def _verified_envelope(leading: LeadingBranches) -> UpperEnvelope:
    """The upper envelope, with what surveys at its minima and exchanges show followed too."""
    for _ in range(_ROUNDS):
        envelope = UpperEnvelope.of(leading.followed, leading.unbounded)
        if leading.check(envelope.values_to_verify):
            return envelope
    return UpperEnvelope.of(leading.followed, leading.unbounded)


def _bands(given: Any, *problems: HarmonicBalance) -> list[tuple[float, float]]:
    """Ascending bands [Hz]."""
    if given is None:
        return [natural_band([problem.model for problem in problems])]
    edges = check.array("frequency_band", given, "positive")
    if not edges.ndim:
        return [(float(edges), float(edges))]
    pairs = [given] if edges.ndim == 1 else edges
    if edges.ndim != 1 and (edges.ndim != 2 or edges.shape[1] != 2 or not len(edges)):
        raise ValueError(
            f"frequency_band={check.shown(given)}: expected a band (first, last) in Hz, or several"
        )
    ends = [check_band("frequency_band", pair, "positive", " in Hz") for pair in pairs]
    bands = sorted((min(pair), max(pair)) for pair in ends)
    if any(band[1] >= following[0] for band, following in pairwise(bands)):
        raise ValueError(f"frequency_band={check.shown(given)}: expected bands that do not overlap")
    return bands


@dataclass(frozen=True)
class Islands:
    """Whether the highest peak is on an island at ascending ``values`` (n,), ``there`` (n,)."""

    values: FloatArray
    there: NDArray[np.bool_]

    @classmethod
    def of(cls, leading: LeadingBranches, wanted: list[float]) -> Islands:
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
    def of(cls, value: float, maximum: Maximum, slope: float) -> Row:
        """The row of a maximum."""
        unknowns, omega = maximum.unknowns, maximum.frequency
        peak = maximum.amplitude, omega / RADIANS, str(maximum.kind), maximum.dof
        return cls(value, *peak, slope, maximum.problem.evaluate(unknowns, omega).norm, unknowns)

    @classmethod
    def unbounded(cls, value: float, pole: Peak | None, n_unknowns: int) -> Row:
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
