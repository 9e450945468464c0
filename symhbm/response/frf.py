"""`frf` and `follow`: response curves over the frequency or over any other parameter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance, check_mean, check_problem
from symhbm.continuation.angles import check_angles, check_path_angles
from symhbm.model import warn_of_doubts
from symhbm.numerics import check
from symhbm.response.accuracy import check_accuracy
from symhbm.response.curve import prepared
from symhbm.response.run import reported, run_sweep
from symhbm.results import (
    Angles,
    Peaks,
    Request,
    check_axis,
    check_band,
    check_grid,
    check_keep,
    parse,
    parts,
    runs,
)
from symhbm.time_domain import check_stability


def frf(
    problem: HarmonicBalance,
    band: tuple[float, float],
    at: ArrayLike | None = None,
    over: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    accuracy: float | None = None,
    stability: bool | None = None,
    phase_resonances: bool = False,
    angles: Angles | None = None,
    peaks: Peaks = "largest",
    **run: Unpack[runs.Run],
) -> xr.Dataset:
    """Frequency response between two frequencies, with every peak.

    Parameters
    ----------
    problem
        What to solve. Where contacts open, normal loads move, springs are cubic or laws are your
        own, responses need not be unique: islands of them, on no branch from an end of the band,
        are possible, and not looked for. `symhbm.follow` over a parameter leads onto them.
    band
        First and last frequency [Hz]. The response is followed from the first to the
        last, so downwards where the first is the larger.
    at : (n,), ascending
        Frequencies [Hz] of a grid; ``frequency`` then is a dimension. Where cubic springs may make
        several solutions, ``solution`` is another: those on the connected branch from the first
        frequency to the last, which need not be all (`other_branches` follows others). Peaks lie
        between the values of a grid, above its largest amplitude, at ``peak_frequency``. By default
        the result holds the points of the path along ``point``, peaks among them.
    over
        Named parameters to sweep. Each value of a list is set for all blades or contacts alike; the
        list becomes a dimension of its own name. A DataArray may have the dimension ``dof`` or
        ``contact`` (a pattern) and any other, for example ``sample``. Several names give their
        product; names that share a dimension go in pairs.
    accuracy
        Largest error of the displacements by truncation of the harmonics, relative to their
        amplitudes, and of normal forces that vary with the motion, relative to the largest over
        the period (``normal_force_error``). Every point then has the harmonics that this needs,
        those of the problem at least, and its ``highest_harmonic`` and expected
        ``truncation_error``. By default all points have the harmonics of the problem.
    stability
        Add ``growth_rate``, ``stability`` and ``stability_method`` of every response: by Hill's
        method, and where contacts slip by the derivative of the motion over a period. By default
        where there may be several responses, as with cubic springs or contacts that open. Without
        ``at`` changes of stability are located and are points and events of the path, named by the
        multiplier that passes the unit circle: ``"period doubling"`` at -1, ``"Neimark-Sacker"`` a
        complex pair, ``"symmetry breaking"`` at -1 of half a period, ``"change of stability"``
        others; at folds and branch points +1 does.
    phase_resonances
        Locate where the response lags the force by a quarter of its period, in the lowest harmonic
        that is excited, and the lag grows with the frequency: events ``"phase resonance"`` and
        points of the path. The force of all degrees of freedom counts together: it does work alone,
        ``Re(F^H X) = 0``. Not with ``at``.
    angles
        Solve Eqs. (4)-(11) with the switching angles as unknowns beside the Fourier coefficients:
        every point of the path by ``"newton"`` (this package's), CasADi's ``"rootfinder"`` or
        ``"ipopt"``, from a start of its own. This form holds only where slipping contacts do not
        reverse; elsewhere the band has gaps, and ``angles_share`` and ``status`` tell the share
        that was followed. Each point is also checked against located friction. For odd harmonics
        alone; not with ``accuracy``, cubic springs, friction over samples or a condensed structure.
        By default the angles are located.
    peaks
        Peaks of the largest response of all degrees of freedom, or of ``"each"`` of them. Every
        peak that rises by 1 % of the largest response above the valleys beside it is found, and
        most of those that rise by less. Without ``at`` each is also a point of the path.
    **run
        ``part``, ``keep``, ``verifiable``, ``archive``, ``executor``, ``throw``, ``progress`` and
        ``max_points``, as `symhbm.Run` tells.

    Returns
    -------
    Dataset with the variables of `symhbm.results.VARIABLES`, the parameters and the problem; an
    ``archive`` is opened lazily. A parameter set whose computation fails has a ``status`` that
    tells why. Where a path cannot be continued, it begins anew beyond: a point that is not
    ``converged`` stands for what lies in between, and ``at`` is solved there, too.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    ArchiveError
        If the archive is one of another computation, is in use, or cannot be written.
    SolveError
        If a curve is incomplete and ``throw`` is True; its ``result`` is the dataset.
    KeyboardInterrupt
        If it is interrupted; a note tells which results are safe and how to go on.

    Warns
    -----
    RuntimeWarning
        If curves are incomplete, with their number and the most common reason.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> response = sh.frf(problem, (10, 30), over={"normal_load": [1, 3]})
    >>> response.peak_amplitude.sel(normal_load=3).values.round(8)
    array([0.00030849])
    >>> sh.frf(problem, (10, 30), at=[15, 20, 25]).amplitude.sel(frequency=20).values.round(8)
    array([0.00029952])
    """
    check_problem(problem)
    band = check_band("band", band, "positive", " in Hz")
    problem.model.check_frequencies("band", band)
    axis = dict(name="frequency", band=band, at=check_grid(at, band))
    asked = accuracy, stability, phase_resonances, angles, peaks
    return _response(problem, axis, over, runs.Running.of(run), *asked)


def follow(
    problem: HarmonicBalance,
    parameter: str,
    band: tuple[float, float],
    at: ArrayLike | None = None,
    over: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    frequency: float,
    accuracy: float | None = None,
    stability: bool | None = None,
    phase_resonances: bool = False,
    angles: Angles | None = None,
    peaks: Peaks = "largest",
    **run: Unpack[runs.Run],
) -> xr.Dataset:
    """Response at one frequency between two values of any named parameter.

    Parameters
    ----------
    problem
        What to solve.
    parameter
        The name of the parameter that moves, for example ``"normal_load"``, for all contacts or
        blades alike, or with the number of one: ``"normal_load[2]"``.
    band
        Its first and last value (SI units).
    at : (n,), ascending
        Values of a grid; the parameter then is a dimension, and ``solution`` another where cubic
        springs may make several, as in `frf`. Peaks lie between the values.
    over
        Other parameters to sweep, as in `frf`.
    frequency
        The constant excitation frequency [Hz].
    accuracy, stability, phase_resonances, angles, peaks, **run
        As in `frf`; peaks are maxima over the parameter.

    Returns
    -------
    Dataset as that of `frf`, with the parameter in the place of the frequency. ``status`` tells
    where the path ended and why.

    Raises
    ------
    TypeError, ValueError, KeyError, ArchiveError, SolveError, KeyboardInterrupt
        As `frf`.

    Warns
    -----
    RuntimeWarning
        As `frf`.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> loads = sh.follow(problem, "normal_load", (0.1, 100), frequency=19.5)
    >>> loads.event_kind.values, loads.event_normal_load.values.round(6)
    (array(['end of slip'], dtype=object), array([4.009054]))
    """
    check_problem(problem)
    if problem.goal is not None:
        raise ValueError(
            f"problem: expected peaks of displacements or of an output over {parameter}, those of "
            f"{problem.goal!r} are over the frequency; symhbm.peak_curve follows them"
        )
    axis = check_axis(problem, parameter, band, at)
    axis["frequency"] = check.scalar("frequency", frequency, "positive")
    problem.model.check_frequencies("frequency", frequency)
    asked = accuracy, stability, phase_resonances, angles, peaks
    return _response(problem, axis, over, runs.Running.of(run), *asked)


def _response(
    problem: HarmonicBalance,
    axis: dict[str, Any],
    over: Mapping[str, Any] | xr.Dataset | None,
    running: runs.Running,
    accuracy: float | None,
    stability: bool | None,
    phase_resonances: bool,
    angles: Angles | None,
    peaks: Peaks,
) -> xr.Dataset:
    check.one_of("peaks", peaks, ("largest", "each"))
    sweep = parse(problem, over)
    chosen = parts.check_part(running.part, sweep)
    if axis["name"] in sweep.values:
        raise ValueError(f"over: {axis['name']!r} is the parameter that is followed")
    moving = {axis["name"], *sweep.values}
    check_mean(problem, growing=accuracy is not None)
    hertz = axis.get("frequency")
    band = axis["band"] if hertz is None else (hertz, hertz)
    driven = "force_amplitude" in problem.parameters
    warn_of_doubts(problem.model, band, problem.harmonics, moving=moving, driven=driven)
    of_problem = [name for name in moving if name in problem.parameters]
    values = {name: of.values.ravel().tolist() for name, of in sweep.values.items()}
    values[axis["name"]] = [*axis["band"]]
    may_fold = problem.may_fold(of_problem, values.get("damping", ()))
    accuracy = check_accuracy(problem, accuracy)
    if angles is not None:
        check_angles(problem, angles)
        check_path_angles(angles, may_fold, accuracy)
    request = Request(
        **axis,
        per_dof=peaks == "each",
        may_fold=may_fold,
        stability=may_fold if stability is None else check_stability(problem, stability),
        phase_resonances=check.flag("phase_resonances", phase_resonances),
        max_points=running.max_points,
        accuracy=accuracy,
        keep=check_keep(running.keep, running.verifiable, axis["name"], accuracy),
        angles=angles,
    )
    computed = sweep if chosen is None else parts.restricted(sweep, chosen)
    request = prepared(problem, computed, request, running.progress)
    return reported(run_sweep(problem, sweep, request, running), running.throw)
