"""The front door to the largest peak over one parameter: the load that makes it lowest, and why."""

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
from symhbm.model import PARAMETERS, natural_band, warn_of_doubts
from symhbm.numerics import RADIANS, Table, by_harmonic, check
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import Maximum, MaximumKind
from symhbm.peaks.survey import sector_of
from symhbm.peaks.tracking import (
    LeadingBranches,
    Parameter,
    Place,
    SurveyedValue,
    Surveyor,
    UpperEnvelope,
    polished,
)
from symhbm.results import Request, check_band, check_grid, check_index, check_parameter, schema
from symhbm.workers import check_executor


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
    apart; minima and exchanges of the lead are surveyed too. What leads only between two surveys,
    and is low or gone at both, is not seen: values close to each other in ``at`` prove more.

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
    ends = check_band("band", band, bound, f" [{PARAMETERS[parameter].units}]")
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
    if not problem.single_valued or parameter == "cubic_stiffness":
        raise ValueError(
            "cubic_stiffness: expected a problem without cubic springs; their peaks lie on "
            "responses that need not be unique, frf with over= gives them"
        )
    check_mean(problem)
    first, last = (_set(problem, parameter, index, value) for value in (low, high))
    bands = _bands(frequency, first, last)
    hull = float(np.min(bands)), float(np.max(bands))
    warn_of_doubts(problem.model, hull, problem.harmonics, moving=[parameter])
    start = last if index is not None else sector_of(last)
    with Surveyor(bands, executor, progress) as surveyor:
        ridge = LeadingBranches(Parameter(start, parameter, index, (low, high)), surveyor, grid)
        curve = _Curve(ridge)
        rows = curve.rows(grid)
    task = Request(name=parameter, band=ends, at=np.array([row.value for row in rows]), index=index)
    result = schema.label_peak_curve(problem, task, bands, curve.results(rows), curve.status(rows))
    if throw and result["status"].item() != Status.REACHED_END:
        raise SolveError(result["status"].item(), result)
    return result


_ROUNDS = 6
"""How often minima and exchanges are verified, what was overlooked there being followed."""


class _Row:
    """One point of the curve: a maximum with derivatives, without, or one that is unbounded."""

    def __init__(
        self, value: float, summit: Maximum | None, slope: float, scene: SurveyedValue | None
    ):
        self.value, self.summit, self.slope = value, summit, slope
        self.pole = None if summit or scene is None else scene.landscape.unbounded[0]

    def table(self, problem: HarmonicBalance) -> Table:
        """All results of the point."""
        if self.summit is None:
            nothing = np.full(problem.n_unknowns, np.nan)
            return dict(
                peak_amplitude=np.inf,
                peak_frequency=np.nan if self.pole is None else self.pole.value / RADIANS,
                peak_kind=str(PeakKind.UNBOUNDED),
                peak_dof=np.int32(-1 if self.pole is None else self.pole.dof),
                peak_amplitude_slope=np.nan,
                peak_residual_norm=np.nan,
                peak_coefficient=by_harmonic(problem.basis, problem.everywhere(nothing)),
            )
        summit = self.summit
        free = summit.problem.evaluate(summit.unknowns, summit.frequency)
        return dict(
            peak_amplitude=summit.amplitude,
            peak_frequency=summit.frequency / RADIANS,
            peak_kind=str(summit.kind),
            peak_dof=np.int32(summit.dof),
            peak_amplitude_slope=self.slope,
            peak_residual_norm=free.norm,
            peak_coefficient=by_harmonic(problem.basis, problem.everywhere(summit.unknowns)),
        )


class _Curve:
    def __init__(self, ridge: LeadingBranches):
        self.ridge, self.parameter = ridge, ridge.parameter
        self.crest = UpperEnvelope(ridge.pool, ridge.unbounded)
        for _ in range(_ROUNDS):
            if ridge.check(self.crest.doubtful):
                break
            self.crest = UpperEnvelope(ridge.pool, ridge.unbounded)

    def rows(self, grid: Any) -> list[_Row]:
        """The points at the values asked for, or all."""
        if grid is not None:
            return [self._at(value) for value in grid.tolist()]
        rows = {place.value: self._row(place.value, place.found) for place in self.crest.points}
        for scene in [*self.ridge.scenes.values()]:
            known = rows.get(scene.value)
            higher = known is None or known.summit is None
            if not higher and known is not None and known.summit is not None:
                higher = scene.landscape.height > (1 + 1e-9) * known.summit.amplitude
            if higher:
                rows[scene.value] = self._surveyed(scene)
        return [rows[value] for value in sorted(rows)]

    def _row(self, value: float, found: Conditions) -> _Row:
        found = polished(found)
        return _Row(value, found.summit, self.parameter.slope(found), None)

    def _at(self, value: float) -> _Row:
        ridge = self.ridge
        unsure = any(low <= value <= high for low, high in (*ridge.unbounded, *ridge.gaps))
        found = None if unsure else ridge.pool.highest(value)
        if found is None:
            scene = ridge.scenes.get(value) or ridge.survey([value])[0]
            return self._surveyed(scene)
        return self._row(value, found[1])

    def _surveyed(self, scene: SurveyedValue) -> _Row:
        """What a survey found, which need not have derivatives."""
        landscape = scene.landscape
        if landscape.unbounded or not landscape.summits:
            return _Row(scene.value, None, np.nan, scene if landscape.unbounded else None)
        top = landscape.summits[0]
        for contender in scene.contenders:
            if contender.summit.amplitude >= (1 - 1e-9) * top.amplitude:
                return self._row(scene.value, contender)
        return _Row(scene.value, top, np.nan, None)

    def results(self, rows: list[_Row]) -> Table:
        """All results by the names of the dataset."""
        problem = self.parameter.problem
        tables = [row.table(problem) for row in rows]
        found: Table = {name: _stacked([table[name] for table in tables]) for name in tables[0]}
        name, crest = self.parameter.name, self.crest
        found |= {
            f"minimum_{name}": _values(crest.minima),
            "minimum_amplitude": np.array([p.found.summit.amplitude for p in crest.minima]),
            "minimum_frequency": np.array(
                [p.found.summit.frequency / RADIANS for p in crest.minima]
            ),
            "minimum_kind": np.array([str(p.what) for p in crest.minima], dtype=object),
            f"event_{name}": _values(crest.events),
            "event_kind": np.array([str(p.what) for p in crest.events], dtype=object),
        }
        symmetry = problem.symmetry
        found["surveyed"] = np.array([row.value in self.ridge.scenes for row in rows])
        found["n_sectors"] = np.int32(1 if symmetry is None else symmetry.n_sectors)
        found["n_surveys"] = np.int32(self.ridge.surveyor.count)
        return found

    def status(self, rows: list[_Row]) -> str:
        """Sentences on all that the user should know."""
        kinds = {None if row.summit is None else row.summit.kind for row in rows}
        found: list[str] = []
        if self.ridge.incomplete:
            found.append(Status.SURVEY_INCOMPLETE)
        if self.ridge.gaps or self.crest.unclear:
            found.append(Status.PEAK_NOT_FOLLOWED)
        if None in kinds or self.ridge.unbounded:
            found.append(Status.PEAK_UNBOUNDED)
        if MaximumKind.EDGE in kinds:
            found.append(Status.PEAK_AT_EDGE)
        return "; moreover, ".join(map(str, found)) or str(Status.REACHED_END)


def _values(places: list[Place]) -> np.ndarray:
    return np.array([place.value for place in places], dtype=float)


def _stacked(values: list) -> np.ndarray:
    return np.array(values, dtype=object if isinstance(values[0], str) else None)


def _set(
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
    if any(one[1] >= other[0] for one, other in pairwise(bands)):
        raise ValueError(f"frequency={check.shown(frequency)}: expected bands that do not overlap")
    return bands


def _ascending(band: tuple[float, float]) -> tuple[float, float]:
    low, high = sorted(band)
    return low, high
