"""`flutter_limit` and `maximise_flutter_limit`: how much negative damping contacts hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.design.flutter.limits import FlutterLimits, ModeSurface, Row
from symhbm.design.flutter.optimum import OptimumKind, best_limit
from symhbm.design.flutter.report import Answer
from symhbm.model import Place
from symhbm.numerics import Table, check
from symhbm.response import reported
from symhbm.response.unforced import amplitudes_of, axis_of, checked, request_of
from symhbm.results import Request, runs, schema
from symhbm.workers import unkept

_SCANNED = 61
"""Amplitudes at which the damping ratios of an independent scan are solved for."""


@unkept("a limit")
def flutter_limit(
    problem: HarmonicBalance,
    parameter: str,
    band: tuple[float, float],
    at: ArrayLike | None = None,
    *,
    amplitudes: tuple[float, float] = (1e-6, 1e-2),
    disturbance: float | Sequence[float] | None = None,
    mode: int = 0,
    place: Place | None = 0,
    nodal_diameter: int | None = None,
    **run: Unpack[runs.Following],
) -> xr.Dataset:
    """Largest negative damping under which contacts hold disturbances, over a parameter.

    Parameters
    ----------
    problem
        What vibrates; a force takes no part, as in `symhbm.nonlinear_modes`.
    parameter, band
        A named parameter that moves between two values (SI units), for example
        ``"normal_load", (0.1, 10)``, or ``"normal_load[2]"`` of one contact or blade.
    at : (n,), ascending
        Values of the parameter; by default so many that lines between them tell the limits.
    amplitudes
        Smallest amplitude [m], and the largest one that is allowed: that of the first harmonic at
        ``place``.
    disturbance : (n,), ascending
        Amplitudes [m] of disturbances, by default the smallest amplitude.
    mode, place, nodal_diameter
        As in `symhbm.nonlinear_modes`.
    **run
        ``throw`` (where a limit is missing), ``progress`` and ``max_points``, as `symhbm.Run`
        tells.

    Returns
    -------
    Dataset along the parameter and ``disturbance`` [m], with ``flutter_limit``, its derivative by
    the parameter ``flutter_limit_slope``, ``limit_amplitude`` [m] and ``limit_frequency`` [Hz] of
    the limit cycle that there is under so much negative damping, and ``limit_kind``: ``fold``
    where two limit cycles meet, ``corner`` where they do at a contact that begins to slip or to
    open, ``disturbance`` or ``largest amplitude`` where the limit is at that end. ``limit_status``
    tells why a limit is NaN.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    SolveError
        If a limit is missing and ``throw`` is True; its ``result`` is the dataset.

    Warns
    -----
    RuntimeWarning
        If limits are missing.

    Notes
    -----
    Air that feeds the vibration with a force ``2 d omega M x'`` is a damping ratio ``-d``. With
    ``D(A)`` the damping ratio of the nonlinear mode at the amplitude A, without that air,
    vibrations grow where ``D(A) < d`` and shrink where it is larger. A disturbance ``a`` stays
    below the amplitude ``b`` as long as ``d`` is below the flutter limit, ``max D(A) over a <= A <=
    b``. That holds where vibrations grow slowly and one mode tells them; the limit cycle at the
    limit is exact. Reference: M. Krack, Computers and Structures 154 (2015), 59-71.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> limit = sh.flutter_limit(
    ...     problem, "normal_load", (1, 9), at=[1, 3, 9],
    ...     amplitudes=(1e-6, 4e-4), disturbance=[1e-6, 2e-4], progress=False,
    ... )
    >>> limit.flutter_limit.values.round(4)
    array([[0.1138, 0.1031],
           [0.1138, 0.1138],
           [0.0018, 0.0018]])
    """
    running = runs.Running.of(run, runs.Following)
    given = disturbance, running, mode, place, nodal_diameter
    limits, request = _limits(problem, parameter, band, at, amplitudes, *given)
    band = request.band
    if request.at is None:
        rows = limits.sample(band)
    else:
        rows = [limits.row(value) for value in request.at.tolist()]
    return reported(_dataset(problem, request, limits, rows), running.throw)


@unkept("a design")
def maximise_flutter_limit(
    problem: HarmonicBalance,
    parameter: str,
    bounds: tuple[float, float],
    amplitudes: tuple[float, float] = (1e-6, 1e-2),
    *,
    mode: int = 0,
    place: Place | None = 0,
    nodal_diameter: int | None = None,
    **run: Unpack[runs.Following],
) -> xr.Dataset:
    """The value of a parameter with which contacts hold the most negative damping.

    Parameters
    ----------
    problem
        What vibrates; a force takes no part, as in `symhbm.nonlinear_modes`.
    parameter, bounds
        The named parameter to choose, for example ``"normal_load"`` or ``"normal_load[2]"``, that
        of one contact or blade, and its lower and upper value.
    amplitudes
        The amplitude [m] of the disturbance, and the largest amplitude that is allowed, as of
        `symhbm.flutter_limit`.
    mode, place, nodal_diameter, **run
        As in `symhbm.flutter_limit`; ``throw`` where there is no best value.

    Returns
    -------
    Dataset as that of `symhbm.flutter_limit`, with the variables of a design as that of
    `symhbm.maximise_damping`. Where the limit does not depend on the parameter, ``design_value`` is
    NaN, ``design_from`` and ``design_to`` tell the range, and ``status`` says so.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    SolveError
        If there is no best value and ``throw`` is True; its ``result`` is the dataset.

    Examples
    --------
    Two dampers, one of which has a load of 3 N. The other one's decides how much they hold:

    >>> import symhbm as sh
    >>> dampers = sh.Friction(
    ...     tangential=((0,), (0,)), contact_stiffness=[1e4, 4e3],
    ...     friction_coefficient=0.5, normal_load=[3.0, 3.0],
    ... )
    >>> blade = sh.Model([[1.0]], [[0.5]], [[1e4]], contacts={"dampers": dampers})
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3))
    >>> best = sh.maximise_flutter_limit(
    ...     problem, "normal_load[1]", (0.1, 10), progress=False
    ... )
    >>> best.design_value.values.round(4), best.design_damping_ratio.values.round(4)
    (array([1.2]), np.float64(0.1445))
    """
    running = runs.Running.of(run, runs.Following)
    given = None, running, mode, place, nodal_diameter
    limits, request = _limits(problem, parameter, bounds, None, amplitudes, *given)
    optimum = best_limit(limits, request.band)
    rows = sorted(limits.rows.values(), key=lambda row: row.value)
    result = _dataset(problem, request, limits, rows)
    missing = [row for row in rows if not row.limits]
    point = None
    if optimum is not None and optimum.best.kind != OptimumKind.RANGE:
        best = limits.row(optimum.best.value).limits[0]
        point = best.point._replace(by_value=best.slope)
    low, high = limits.amplitudes
    scanned = np.geomspace(low, high, _SCANNED)
    return Answer(problem, limits.surface, optimum, point, scanned, not missing).added_to(
        result,
        f"the largest negative damping ratio under which a disturbance of {low:g} m stays below "
        f"{high:g} m",
        f"the mode was followed over these amplitudes at {len(rows) - len(missing)} values of "
        f"{request.name} from {rows[0].value:g} to {rows[-1].value:g}",
        Status.DAMPING_NOT_FOLLOWED,
        running.throw,
    )


def _limits(
    problem: HarmonicBalance,
    parameter: str,
    band: Any,
    at: Any,
    amplitudes: Any,
    disturbance: Any,
    running: runs.Running,
    mode: Any,
    place: Any,
    nodal_diameter: Any,
) -> tuple[FlutterLimits, Request]:
    """What computes the limits, and the request that asks for them; raises for bad arguments."""
    sweep = checked(problem, None)
    amplitudes = amplitudes_of(amplitudes)
    disturbances = (
        (amplitudes[0],) if disturbance is None else _disturbances(disturbance, amplitudes)
    )
    axis = axis_of(problem, parameter, band, at, sweep, nodal_diameter)
    axis["amplitude"] = amplitudes[1]
    own = "nonlinear mode", mode, place, nodal_diameter
    request = request_of(problem, sweep, running, axis, *own)
    limits = FlutterLimits(
        ModeSurface(problem, request), amplitudes, disturbances, running.progress
    )
    return limits, replace(request, unforced="flutter limit", amplitude=None, amplitudes=amplitudes)


def _disturbances(given: Any, amplitudes: tuple[float, float]) -> tuple[float, ...]:
    """Amplitudes of disturbances within those that the mode is followed over."""
    values = np.atleast_1d(check.array("disturbance", given, "positive"))
    low, high = amplitudes
    ascending = values.ndim == 1 and values.size > 0 and bool(np.all(np.diff(values) > 0))
    if not ascending or values[0] < low or values[-1] > high:
        raise ValueError(
            f"disturbance={check.shown(given)}: expected ascending amplitudes from {low:g} to "
            f"{high:g} m, those of amplitudes="
        )
    return tuple(values.tolist())


def _dataset(
    problem: HarmonicBalance, request: Request, limits: FlutterLimits, rows: Sequence[Row]
) -> xr.Dataset:
    """The dataset of the limits at some values."""
    shape = len(rows), len(limits.disturbances)
    numbers = "flutter_limit", "flutter_limit_slope", "limit_amplitude", "limit_frequency"
    results: Table = {name: np.full(shape, np.nan) for name in numbers}
    results["limit_kind"] = np.full(shape, "", dtype=object)
    for i, row in enumerate(rows):
        for k, limit in enumerate(row.limits):
            point = limit.point
            told = limit.damping_ratio, limit.slope, point.amplitude, point.frequency
            for name, value in zip(numbers, told, strict=True):
                results[name][i, k] = value
            results["limit_kind"][i, k] = str(limit.kind)
    results["limit_status"] = np.array([str(row.status) for row in rows], dtype=object)
    complete = all(row.limits for row in rows)
    status = Status.REACHED_END if complete else Status.LIMIT_MISSING
    at = np.array([row.value for row in rows])
    request, name = replace(request, at=at), "flutter_limit"
    return schema.label_over_parameter(
        name, problem, request, results, status, disturbances=limits.disturbances
    )
