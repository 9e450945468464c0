"""`maximise_damping`: the value of a parameter that damps a mode most at one amplitude."""

from __future__ import annotations

import warnings
from contextlib import suppress
from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.design.flutter.limits import ModeSurface
from symhbm.design.flutter.optimum import OptimumKind, best_on_path
from symhbm.design.flutter.report import Answer
from symhbm.model import Place
from symhbm.numerics import unknowns_of
from symhbm.response import nonlinear_modes
from symhbm.results import recall, runs
from symhbm.workers import unkept


@unkept("a design")
def maximise_damping(
    problem: HarmonicBalance,
    parameter: str,
    bounds: tuple[float, float],
    amplitude: float,
    *,
    mode: int = 0,
    place: Place | None = 0,
    nodal_diameter: int | None = None,
    **run: Unpack[runs.Following],
) -> xr.Dataset:
    """The value of a parameter that damps vibrations of one amplitude most, with a certificate.

    Parameters
    ----------
    problem
        What vibrates; a force takes no part, as in `symhbm.nonlinear_modes`.
    parameter, bounds
        The named parameter to choose, for example ``"normal_load"`` or ``"normal_load[2]"``, that
        of one contact or blade, and its lower and upper value.
    amplitude
        Amplitude [m] of the vibration: that of the first harmonic at ``place``.
    mode, place, nodal_diameter
        As in `symhbm.nonlinear_modes`: which mode, and the place of its amplitude.
    **run
        ``throw``, ``progress`` and ``max_points``, as `symhbm.Run` tells; ``throw`` where there is
        no best value.

    Returns
    -------
    Dataset as that of `symhbm.nonlinear_modes` over the parameter, with ``design_value`` along
    ``variable`` and ``design_damping_ratio``. Where a range of values is as good, it is
    ``design_from`` to ``design_to``, and ``design_value`` is NaN. All maxima and ends of the band
    along ``candidate``; an independent scan along ``scan``; ``status`` and the
    ``certificate``: sentences on what is proved and what is not.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    SolveError
        If there is no best value and ``throw`` is True; its ``result`` is the dataset.

    Notes
    -----
    The damping ratio D is that of the extended periodic motion concept, see
    `symhbm.nonlinear_modes`. Reference: M. Krack, Computers and Structures 154 (2015), 59-71.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> best = sh.maximise_damping(problem, "normal_load", (0.1, 10), 3e-4, progress=False)
    >>> best.design_value.values.round(6), best.design_damping_ratio.values.round(6)
    (array([2.303898]), np.float64(0.113793))
    """
    given: Any = dict(mode=mode, place=place, nodal_diameter=nodal_diameter, amplitude=amplitude)
    running = runs.Running.of(run, runs.Following)
    given |= dict(progress=running.progress, max_points=running.max_points)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # the status of the design tells it
        found = nonlinear_modes(problem, parameter, bounds, **given)
        if not _complete(found):
            # A path may begin just where a contact begins to slip, or where the mode is not found.
            back = nonlinear_modes(problem, parameter, (bounds[1], bounds[0]), **given)
            found = back if _complete(back) else found
    request = recall(found)[1]
    surface, optimum = ModeSurface(problem, request), best_on_path(found, request.name)
    level, point = float(found["amplitude"]), None
    if optimum is not None and optimum.best.kind != OptimumKind.RANGE:
        place = int(np.argmax(found["damping_ratio"].values))
        with suppress(ArithmeticError):
            point = surface.at(optimum.best.value, level, _unknowns(surface, found, place))
    answer = Answer(problem, surface, optimum, point, np.array([level]), _complete(found))
    return answer.added_to(
        found,
        f"the damping ratio at an amplitude of {level:g} m",
        f"the mode was followed over {request.name} from {request.band[0]:g} to "
        f"{request.band[1]:g}" + ("" if answer.complete else ", but not to the end"),
        Status.DAMPING_SURPASSED,
        running.throw,
    )


def _complete(found: xr.Dataset) -> bool:
    return str(found["status"].item()) == Status.REACHED_END


def _unknowns(surface: ModeSurface, found: xr.Dataset, place: int) -> Any:
    """All unknowns of the mode at a point of its path."""
    one, basis = found.isel(point=place), surface.curve.problem.basis
    coefficient = one["coefficient"].values[: surface.curve.problem.n_dof]
    own = [2 * np.pi * one["frequency"].item(), one["damping_ratio"].item()]
    return np.append(unknowns_of(basis, basis.harmonics, coefficient), own)
