"""`nonlinear_modes` and `limit_cycles`: motions without a force, whose contacts rub and open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Unpack

import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance
from symhbm.model import Place
from symhbm.numerics import check
from symhbm.response.run import reported, run_sweep
from symhbm.response.unforced import amplitudes_of, axis_of, checked, request_of
from symhbm.results import check_grid, runs
from symhbm.time_domain import check_stability


def nonlinear_modes(
    problem: HarmonicBalance,
    parameter: str = "amplitude",
    band: tuple[float, float] | None = None,
    at: ArrayLike | None = None,
    over: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    mode: int = 0,
    amplitude: float | None = None,
    place: Place | None = 0,
    nodal_diameter: int | None = None,
    **run: Unpack[runs.Sweeping],
) -> xr.Dataset:
    """Frequency and damping ratio of one mode over its amplitude, with contacts that rub and open.

    Parameters
    ----------
    problem
        What vibrates. Its force does not drive the modes: what of it oscillates is left out, static
        loads stay. It may have none, ``HarmonicBalance(model, harmonics=(1, 3, 5))``.
    parameter, band
        What moves between two values. By default the amplitude [m], that of the first harmonic at
        ``place``, from 1e-6 m to 1e-2 m; or a named parameter (SI units) at one ``amplitude``, for
        example ``"normal_load", (0.1, 10)``, or ``"normal_load[2]"`` of one contact or blade. It
        may be any that does not change the mass matrix.
    at : (n,), ascending
        Amplitudes [m], or values of the parameter, of a grid, which then is a dimension, and
        ``solution`` another: where the mode turns back along it, there are several. By default the
        result holds the points of the path along ``point``.
    over
        Named parameters to sweep, as in `symhbm.frf`.
    mode
        Number of the mode from the lowest, 0 first, of small motions about the rest: contacts that
        are closed there stick. Over a parameter it is that at the first value.
    amplitude
        The amplitude [m] where a parameter moves.
    place
        The degree of freedom that tells the amplitude, by its number or by its name as ``"tip:y"``;
        None for the one that moves most in the linear mode of the first parameter set.
    nodal_diameter
        Of a disk of equal sectors, numbered one after the other, the mode of the wave in which each
        sector lags the one before by ``2 pi nodal_diameter / N``; negative ones go the other way.
        One sector is solved. Of a `symhbm.Sector` it is by default the engine order of its force.
    **run
        ``part``, ``keep``, ``archive``, ``executor``, ``throw``, ``progress`` and ``max_points``,
        as `symhbm.Run` tells.

    Returns
    -------
    Dataset with ``frequency`` [Hz] and ``damping_ratio`` over ``amplitude`` [m], beside them
    ``modal_amplitude`` [kg^1/2 m], the root of ``X^H M X`` summed over the harmonics above 0, of
    one sector where the structure is a `symhbm.Sector` (that of the disk is root N times as large),
    ``coefficient`` [m], ``largest_displacement`` (dof) [m] and what contacts do, as in
    `symhbm.frf`. Events are those of contacts, ``fold`` where what moves turns back, and
    ``damping turns`` where the damping ratio has a maximum or a minimum.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed: a structure without a mass
        matrix, a mode that is repeated, a degree of freedom that does not move in it.
    ArchiveError, SolveError, KeyboardInterrupt
        As `symhbm.frf`.

    Warns
    -----
    RuntimeWarning
        If curves are incomplete, with their number and the most common reason.

    Notes
    -----
    The extended periodic motion concept: ``M x'' + (C - 2 D omega M) x' + K x + f(x) = 0`` has a
    periodic motion at every amplitude, with the damping ratio D that balances what it dissipates.
    That of small motions is the modal damping ratio of the linear mode. Under strong damping near
    other modes forced responses differ from it; `symhbm.peak_curve` gives their peaks.
    Reference: M. Krack, Computers and Structures 154 (2015), 59-71.

    Examples
    --------
    A blade whose contact lets go at 0.15 mm, and damps it by up to 11 % then:

    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> modes = sh.nonlinear_modes(problem, band=(1e-5, 1e-2), progress=False)
    >>> modes.event_kind.values, modes.event_amplitude.values.round(6)
    (array(['onset of slip', 'damping turns'], dtype=object), array([0.00015 , 0.000391]))
    >>> modes.damping_ratio.max().values.round(4)
    np.float64(0.1138)

    The normal load that damps vibrations of 0.3 mm most:

    >>> loads = sh.nonlinear_modes(
    ...     problem, "normal_load", (0.1, 10), amplitude=3e-4, progress=False
    ... )
    >>> best = loads.isel(event=loads.event_kind == "damping turns")
    >>> best.event_normal_load.values.round(4), best.event_damping_ratio.values.round(4)
    (array([2.3039]), array([0.1138]))
    """
    running, sweep = runs.Running.of(run, runs.Sweeping), checked(problem, over)
    axis: dict[str, Any]
    if parameter == "amplitude":
        if amplitude is not None:
            raise ValueError(f"amplitude={check.shown(amplitude)}: expected None where it moves")
        edges = amplitudes_of((1e-6, 1e-2) if band is None else band, "band")
        axis = dict(name="amplitude", band=edges, at=check_grid(at, edges), index=None)
    else:
        axis = axis_of(problem, parameter, band, at, sweep, nodal_diameter)
        if amplitude is None:
            raise ValueError(f"amplitude=None: expected that of vibrations while {parameter} moves")
        axis["amplitude"] = check.scalar("amplitude", amplitude, "positive")
    own = "nonlinear mode", mode, place, nodal_diameter
    request = request_of(problem, sweep, running, axis, *own)
    return reported(run_sweep(problem, sweep, request, running), running.throw)


def limit_cycles(
    problem: HarmonicBalance,
    parameter: str | None = None,
    band: tuple[float, float] | None = None,
    at: ArrayLike | None = None,
    over: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    mode: int | Sequence[int] = 0,
    amplitudes: tuple[float, float] = (1e-6, 1.0),
    place: Place | None = None,
    nodal_diameter: int | None = None,
    stability: bool | None = None,
    **run: Unpack[runs.Sweeping],
) -> xr.Dataset:
    """Self-excited periodic motions: negative damping drives them, contacts and damping hold them.

    Parameters
    ----------
    problem
        What vibrates, with damping or the air of `symhbm.Influence` that gives it energy. A force
        takes no part: what of it oscillates is left out, static loads stay. It may have none,
        ``HarmonicBalance(model, harmonics=(1, 3, 5))``.
    parameter, band
        A named parameter that moves between two values (SI units), for example
        ``"damping", (-30, 0)``, or ``"normal_load[2]"`` of one contact or blade: all branches of
        cycles that are found are followed over it. By default the cycles are those of the problem's
        own parameters.
    at : (n,), ascending
        Values of a grid of the parameter, which then is a dimension, and ``solution`` another:
        there may be several cycles or none. By default the result holds points along ``point``.
    over
        Named parameters to sweep, as in `symhbm.frf`.
    mode
        Number of the mode whose cycles are looked for, from the lowest, 0 first, or several.
    amplitudes
        Smallest and largest amplitude [m] that they are looked for at: that of the first harmonic
        at ``place``. A branch that leaves it ends there.
    place
        The degree of freedom that tells the amplitude, by its number or by its name as ``"tip:y"``;
        by default the one that moves most in the first of these modes.
    nodal_diameter
        Of a disk of equal sectors the wave of the cycles, as in `symhbm.nonlinear_modes`.
    stability
        Add ``growth_rate`` and ``stability`` by Floquet multipliers from event to event of the
        contacts, without that of a shift in time. By default it is told of cycles at the problem's
        own parameters, of structures with matrices. Of a wave around a ring all its blades are
        disturbed.
    **run
        ``part``, ``keep``, ``archive``, ``executor``, ``throw``, ``progress`` and ``max_points``,
        as `symhbm.Run` tells.

    Returns
    -------
    Dataset with ``frequency`` [Hz] and ``amplitude`` [m], of the first harmonic, of each cycle,
    ``coefficient`` [m], ``largest_displacement`` (dof) [m] and what contacts do, as in
    `symhbm.frf`. The attribute ``searched`` tells where cycles were looked for. At the problem's
    own parameters points are cycles, the smallest first; there may be none. Over a parameter
    ``cycle_branch`` numbers connected branches, events are those of contacts and ``fold``, where
    two cycles meet, and ``fold_<parameter>`` is the value at the one beyond which no cycle was
    found: contacts do not hold there what damping drives. NaN where no fold is the last one.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed, as
        `symhbm.nonlinear_modes`.
    ArchiveError, SolveError, KeyboardInterrupt
        As `symhbm.frf`.

    Warns
    -----
    RuntimeWarning
        If curves are incomplete, with their number and the most common reason: over a parameter
        also if no cycle was found.

    Notes
    -----
    A cycle is a nonlinear mode of damping ratio 0, so that each mode is followed over the amplitude
    until its damping ratio changes its sign. Motions of several waves or frequencies at once are
    not periodic and not found.

    Examples
    --------
    A blade in an air flow that feeds it. Friction holds it at 0.15 mm; pushed beyond 38 mm it is
    lost:

    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=-0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> cycles = sh.limit_cycles(problem, progress=False)
    >>> cycles.amplitude.values.round(6), cycles.stability.values
    (array([0.000151, 0.038041]), array([1, 0], dtype=int8))
    >>> over = sh.limit_cycles(problem, "damping", (-30, 0), progress=False)
    >>> over.fold_damping.values.round(3)  # beyond it friction cannot hold the blade
    np.float64(-26.317)
    """
    running, sweep = runs.Running.of(run, runs.Sweeping), checked(problem, over)
    amplitudes = amplitudes_of(amplitudes)
    axis: dict[str, Any] = dict(name="amplitude", band=amplitudes, at=None, index=None)
    if parameter is not None:
        axis = axis_of(problem, parameter, band, at, sweep, nodal_diameter)
    elif not (band is at is None):
        raise ValueError("parameter=None: expected the name of one where band or at is given")
    if stability is None:
        stability = parameter is None and problem.model.has_matrices
    own = "limit cycle", mode, place, nodal_diameter
    more = dict(stability=check_stability(problem, stability), amplitudes=amplitudes)
    request = request_of(problem, sweep, running, axis, *own, **more)
    return reported(run_sweep(problem, sweep, request, running), running.throw)
