"""`nonlinear_modes`: the modes of a structure whose contacts rub and open, over the amplitude."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from typing import Any

import xarray as xr
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance, check_problem
from symhbm.model import Place
from symhbm.numerics import check
from symhbm.response.run import reported, run
from symhbm.response.unforced import with_dof
from symhbm.results import Request, check_band, check_grid, check_keep, parse
from symhbm.workers import check_executor, check_progress


def nonlinear_modes(
    problem: HarmonicBalance,
    mode: int = 0,
    amplitude: tuple[float, float] = (1e-6, 1e-2),
    dof: Place | None = 0,
    at: ArrayLike | None = None,
    over: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    nodal_diameter: int | None = None,
    keep: Iterable[str] | None = None,
    archive: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    throw: bool = False,
    progress: bool | None = None,
    max_points: int = 5000,
) -> xr.Dataset:
    """Frequency and damping ratio of one mode over its amplitude, with contacts that rub and open.

    Parameters
    ----------
    problem
        What vibrates. Its force does not drive the modes: what of it oscillates is left out, static
        loads stay. It may have none, ``HarmonicBalance(model, harmonics=(1, 3, 5))``.
    mode
        Number of the mode from the lowest, 0 first, of small motions about the rest: contacts that
        are closed there stick.
    amplitude
        Smallest and largest amplitude [m]: that of the first harmonic at ``dof``.
    dof
        The degree of freedom that tells the amplitude, by its number or by its name as ``"tip:y"``;
        None for the one that moves most in the linear mode of the first parameter set.
    at : (n,), ascending
        Amplitudes [m] of a grid; ``amplitude`` then is a dimension, and ``solution`` another: where
        the amplitude turns back along the mode, there are several. By default the result holds the
        points of the path along ``point``.
    over
        Named parameters to sweep, as in `symhbm.frf`.
    nodal_diameter
        Of a disk of equal sectors, numbered one after the other, the mode of the wave in which each
        sector lags the one before by ``2 pi nodal_diameter / N``; negative ones go the other way.
        One sector is solved. Of a `symhbm.Sector` it is by default the engine order of its force.
    keep, archive, executor, throw, progress, max_points
        As in `symhbm.frf`.

    Returns
    -------
    Dataset with ``frequency`` [Hz] and ``damping_ratio`` over ``amplitude`` [m], beside them
    ``modal_amplitude`` [kg^1/2 m], the root of ``X^H M X`` summed over the harmonics above 0,
    ``coefficient``, ``largest_displacement`` (dof) and what contacts do, as in `symhbm.frf`. Events
    are those of contacts, ``fold`` where the amplitude turns back, and ``damping turns`` where the
    damping ratio has a maximum or a minimum.

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
    >>> modes = sh.nonlinear_modes(problem, amplitude=(1e-5, 1e-2), progress=False)
    >>> modes.event_kind.values, modes.event_amplitude.values.round(6)
    (array(['onset of slip', 'damping turns'], dtype=object), array([0.00015 , 0.000391]))
    >>> modes.damping_ratio.max().values.round(4)
    np.float64(0.1138)
    """
    check_problem(problem)
    check_executor(executor)
    throw, progress = check.flag("throw", throw), check_progress(progress)
    band = check_band("amplitude", amplitude, "positive", " [m]")
    if band[0] > band[1]:
        raise ValueError(f"amplitude={check.shown(amplitude)}: expected (smallest, largest) [m]")
    if problem.samples is not None:
        raise ValueError(f"samples={problem.samples}: expected a problem with located angles")
    if 1 not in problem.harmonics:
        raise ValueError(
            f"harmonics={problem.harmonics}: expected 1 among them, its amplitude is that of modes"
        )
    sweep = parse(problem, over)
    request = Request(
        name="amplitude",
        band=band,
        at=check_grid(at, band),
        may_fold=True,
        max_points=check.integer("max_points", max_points, minimum=2),
        keep=check_keep(keep, False, "amplitude", None),
        unforced="nonlinear mode",
        mode=check.integer("mode", mode, minimum=0),
        nodal_diameter=None
        if nodal_diameter is None
        else check.integer("nodal_diameter", nodal_diameter),
        dof=None if dof is None else problem.model.number_of(dof),
    )
    first = sweep.chosen(0)
    request = with_dof(problem.with_parameters(**first) if first else problem, request)
    return reported(run(problem, sweep, request, archive, executor, progress), throw)
