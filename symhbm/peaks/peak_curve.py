"""`peak_curve`: the largest peak over one parameter, with its minima and events."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance, check_mean, check_problem
from symhbm.continuation import SolveError, Status
from symhbm.continuation.between import PeakKind
from symhbm.model import natural_band, warn_of_doubts
from symhbm.numerics import RADIANS, Table, by_harmonic, check
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import Maximum, MaximumKind
from symhbm.peaks.survey import sector_of
from symhbm.peaks.tracking import (
    EnvelopePoint,
    LeadingBranches,
    Parameter,
    SurveyedValue,
    Surveyor,
    UpperEnvelope,
    polished,
)
from symhbm.results import Request, check_band, check_grid, check_index, check_parameter, schema
from symhbm.workers import check_executor

_ROUNDS = 6
"""Largest number of times that minima and exchanges are surveyed and missed branches followed."""


def peak_curve(
    problem: HarmonicBalance,
    parameter: str,
    band: tuple[float, float],
    at: ArrayLike | None = None,
    *,
    frequency: tuple[float, float] | Sequence[tuple[float, float]] | None = None,
    contact: int | None = None,
    dof: int | None = None,
    executor: Executor | None = None,
    throw: bool = False,
    progress: bool = True,
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
        What to solve, with constant normal loads and located switching angles.
    parameter
        The name of the parameter that moves, for example ``"normal_load"``.
    band
        Its first and last value (SI units).
    at : (n,), ascending
        Values at which the peak is wanted; those more than 8 % apart are surveyed. By default the
        result holds the points that were solved for on the way, with all minima and events: as
        many as cubic interpolation of logarithms with the slopes needs for 1e-5 in between.
    frequency
        Band (first, last) of excitation frequencies [Hz], or several that do not overlap; by
        default one that holds all resonances of the structure.
    contact, dof
        The one contact or blade whose parameter moves; by default it is set for all alike.
    executor
        Where surveys are computed; by default in this process.
    throw
        Raise SolveError unless the curve is complete and bounded, instead of returning its status.
    progress
        Show a bar when it takes longer than a few seconds.

    Returns
    -------
    Dataset along the parameter, ascending: ``peak_amplitude`` [m], ``peak_frequency`` [Hz],
    ``peak_kind`` (smooth, corner, edge, unbounded), ``peak_dof``, ``peak_amplitude_slope`` (its
    exact derivative by the parameter, at an event that of one side, which points right below and
    above tell apart), ``peak_residual_norm``, ``peak_coefficient`` and ``surveyed``; along
    ``minimum`` the local minima of the curve and what makes them (smooth, exchange, kink, end);
    along ``event`` where another peak takes the lead or the leading one changes its kind.
    ``status`` tells whether surveys agree, and whether the peak is at an end of the band of
    frequencies or unbounded somewhere.

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
    >>> problem = sh.HarmonicBalance(blade, sh.PointForce())
    >>> curve = sh.peak_curve(problem, "normal_load", (1, 10))
    >>> curve.minimum_normal_load.values.round(6)
    array([3.088579])
    """
    check_problem(problem, whole=True)
    bound = check_parameter(problem, parameter)
    parameter = problem.parameter_name(parameter)
    ends = check_band("band", band, bound, f" [{problem.about(parameter).units}]")
    low, high = sorted(ends)
    grid = check_grid(at, ends)
    index = check_index(problem, parameter, contact, dof)
    check_executor(executor)
    throw, progress = check.flag("throw", throw), check.flag("progress", progress)
    if problem.samples is not None:
        raise ValueError(
            f"samples={problem.samples}: expected a problem with located switching angles; "
            "peaks of friction over samples cannot be followed"
        )
    if not problem.single_valued_over([parameter]):
        laws = problem.many_valued_laws([parameter])
        raise ValueError(
            f"problem: expected contacts that leave responses unique, got {laws}; peaks on "
            "responses that need not be unique are those of frf with over="
        )
    check_mean(problem)
    first, last = (_with_value(problem, parameter, index, value) for value in (low, high))
    bands = _bands(frequency, first, last)
    limits = float(np.min(bands)), float(np.max(bands))
    warn_of_doubts(problem.model, limits, problem.harmonics, moving=[parameter])
    start = last if index is not None else sector_of(last)
    with Surveyor(bands, executor, progress) as surveyor:
        leading = LeadingBranches(Parameter(start, parameter, index, (low, high)), surveyor, grid)
        curve = _Curve(leading)
        rows = curve.rows(grid)
    request = Request(
        name=parameter, band=ends, at=np.array([row.value for row in rows]), index=index
    )
    result = schema.label_peak_curve(
        problem, request, bands, curve.results(rows), curve.status(rows)
    )
    if throw and result["status"].item() != Status.REACHED_END:
        raise SolveError(result["status"].item(), result)
    return result


class _Row:
    """One point of the curve: a maximum with or without derivatives, or an unbounded peak."""

    def __init__(
        self, value: float, maximum: Maximum | None, slope: float, surveyed: SurveyedValue | None
    ):
        self.value, self.maximum, self.slope = value, maximum, slope
        self.pole = None if maximum or surveyed is None else surveyed.survey.unbounded[0]

    def table(self, problem: HarmonicBalance) -> Table:
        """All results of the point."""
        if self.maximum is None:
            unknown = np.full(problem.n_unknowns, np.nan)
            return dict(
                peak_amplitude=np.inf,
                peak_frequency=np.nan if self.pole is None else self.pole.value / RADIANS,
                peak_kind=str(PeakKind.UNBOUNDED),
                peak_dof=np.int32(-1 if self.pole is None else self.pole.dof),
                peak_amplitude_slope=np.nan,
                peak_residual_norm=np.nan,
                peak_coefficient=by_harmonic(problem.basis, problem.everywhere(unknown)),
            )
        maximum = self.maximum
        free = maximum.problem.evaluate(maximum.unknowns, maximum.frequency)
        return dict(
            peak_amplitude=maximum.amplitude,
            peak_frequency=maximum.frequency / RADIANS,
            peak_kind=str(maximum.kind),
            peak_dof=np.int32(maximum.dof),
            peak_amplitude_slope=self.slope,
            peak_residual_norm=free.norm,
            peak_coefficient=by_harmonic(problem.basis, problem.everywhere(maximum.unknowns)),
        )


class _Curve:
    """The upper envelope of the leading branches, verified by surveys."""

    def __init__(self, leading: LeadingBranches):
        self.leading, self.parameter = leading, leading.parameter
        self.envelope = UpperEnvelope(leading.followed, leading.unbounded)
        for _ in range(_ROUNDS):
            if leading.check(self.envelope.values_to_verify):
                break
            self.envelope = UpperEnvelope(leading.followed, leading.unbounded)

    def rows(self, grid: Any) -> list[_Row]:
        """The points at the values asked for, or all points."""
        if grid is not None:
            return [self._at(value) for value in grid.tolist()]
        rows = {
            point.value: self._row(point.value, point.conditions) for point in self.envelope.points
        }
        for surveyed in [*self.leading.surveyed.values()]:
            row = rows.get(surveyed.value)
            higher = row is None or row.maximum is None
            if not higher and row is not None and row.maximum is not None:
                higher = surveyed.survey.height > (1 + 1e-9) * row.maximum.amplitude
            if higher:
                rows[surveyed.value] = self._surveyed(surveyed)
        return [rows[value] for value in sorted(rows)]

    def _row(self, value: float, conditions: Conditions) -> _Row:
        conditions = polished(conditions)
        return _Row(value, conditions.maximum, self.parameter.slope(conditions), None)

    def _at(self, value: float) -> _Row:
        leading = self.leading
        unresolved = any(
            low <= value <= high for low, high in (*leading.unbounded, *leading.unresolved)
        )
        highest = None if unresolved else leading.followed.highest(value)
        if highest is None:
            surveyed = leading.surveyed.get(value) or leading.survey([value])[0]
            return self._surveyed(surveyed)
        return self._row(value, highest[1])

    def _surveyed(self, surveyed: SurveyedValue) -> _Row:
        """The highest maximum of a survey, which need not have derivatives."""
        survey = surveyed.survey
        if survey.unbounded or not survey.maxima:
            return _Row(surveyed.value, None, np.nan, surveyed if survey.unbounded else None)
        highest = survey.maxima[0]
        for candidate in surveyed.candidates:
            if candidate.maximum.amplitude >= (1 - 1e-9) * highest.amplitude:
                return self._row(surveyed.value, candidate)
        return _Row(surveyed.value, highest, np.nan, None)

    def results(self, rows: list[_Row]) -> Table:
        """All results by the names of the dataset."""
        problem = self.parameter.problem
        tables = [row.table(problem) for row in rows]
        results: Table = {name: _stacked([table[name] for table in tables]) for name in tables[0]}
        name, envelope = self.parameter.name, self.envelope
        results |= {
            f"minimum_{name}": _values(envelope.minima),
            "minimum_amplitude": np.array(
                [p.conditions.maximum.amplitude for p in envelope.minima]
            ),
            "minimum_frequency": np.array(
                [p.conditions.maximum.frequency / RADIANS for p in envelope.minima]
            ),
            "minimum_kind": np.array([str(p.kind) for p in envelope.minima], dtype=object),
            f"event_{name}": _values(envelope.events),
            "event_kind": np.array([str(p.kind) for p in envelope.events], dtype=object),
        }
        symmetry = problem.symmetry
        results["surveyed"] = np.array([row.value in self.leading.surveyed for row in rows])
        results["n_sectors"] = np.int32(1 if symmetry is None else symmetry.n_sectors)
        results["n_surveys"] = np.int32(self.leading.surveyor.count)
        return results

    def status(self, rows: list[_Row]) -> str:
        """Status sentences for the user."""
        kinds = {None if row.maximum is None else row.maximum.kind for row in rows}
        sentences: list[str] = []
        if self.leading.incomplete:
            sentences.append(Status.SURVEY_INCOMPLETE)
        if self.leading.unresolved or self.envelope.unresolved:
            sentences.append(Status.PEAK_NOT_FOLLOWED)
        if None in kinds or self.leading.unbounded:
            sentences.append(Status.PEAK_UNBOUNDED)
        if MaximumKind.EDGE in kinds:
            sentences.append(Status.PEAK_AT_EDGE)
        return "; moreover, ".join(map(str, sentences)) or str(Status.REACHED_END)


def _values(points: list[EnvelopePoint]) -> np.ndarray:
    return np.array([point.value for point in points], dtype=float)


def _stacked(values: list) -> np.ndarray:
    return np.array(values, dtype=object if isinstance(values[0], str) else None)


def _with_value(
    problem: HarmonicBalance, parameter: str, index: int | None, value: float
) -> HarmonicBalance:
    values = np.array(problem.parameters[parameter], dtype=float)
    values[... if index is None else index] = value
    return problem.with_parameters(**{parameter: values})


def _bands(frequency: Any, *problems: HarmonicBalance) -> list[tuple[float, float]]:
    """Ascending bands [Hz]."""
    if frequency is None:
        return [natural_band([problem.model for problem in problems])]
    edges = check.array("frequency", frequency, "positive")
    if edges.ndim == 1:
        return [_ascending(check_band("frequency", frequency, "positive", " in Hz"))]
    if edges.ndim != 2 or edges.shape[1] != 2 or not len(edges):
        raise ValueError(
            f"frequency={check.shown(frequency)}: expected a band (first, last) in Hz, or several"
        )
    bands = sorted(
        _ascending(check_band("frequency", band, "positive", " in Hz")) for band in edges
    )
    if any(band[1] >= following[0] for band, following in pairwise(bands)):
        raise ValueError(f"frequency={check.shown(frequency)}: expected bands that do not overlap")
    return bands


def _ascending(band: tuple[float, float]) -> tuple[float, float]:
    low, high = sorted(band)
    return low, high
