"""Arguments of verbs on motions that no force drives, checked."""

from collections.abc import Sequence
from typing import Any

from symhbm.balance import HarmonicBalance, check_problem
from symhbm.model import Place
from symhbm.numerics import check
from symhbm.response.unforced.curve import with_dof
from symhbm.results import Request, Sweep, check_axis, check_band, check_keep, parse, runs


def checked(problem: HarmonicBalance, over: Any) -> Sweep:
    """The sweep of a call; raises for a problem whose modes are not known."""
    check_problem(problem)
    if problem.samples is not None:
        raise ValueError(f"samples={problem.samples}: expected a problem with located angles")
    if 1 not in problem.harmonics:
        raise ValueError(
            f"harmonics={problem.harmonics}: expected 1 among them, its amplitude is that of modes"
        )
    return parse(problem, over)


def amplitudes_of(amplitudes: Any, name: str = "amplitudes") -> tuple[float, float]:
    """A band of amplitudes, ascending."""
    band = check_band(name, amplitudes, "positive", " [m]")
    if band[0] > band[1]:
        raise ValueError(f"{name}={check.shown(amplitudes)}: expected (smallest, largest) [m]")
    return band


def axis_of(
    problem: HarmonicBalance, parameter: str, band: Any, at: Any, sweep: Sweep, nodal_diameter: Any
) -> dict[str, Any]:
    """Fields of the request that tell which parameter moves, and where."""
    axis = check_axis(problem, parameter, band, at)
    name, index = axis["name"], axis["index"]
    if name == "force_amplitude":
        raise ValueError(f"parameter={parameter!r}: expected one of the structure, no force acts")
    if name in sweep.values:
        raise ValueError(f"over: {name!r} is the parameter that is followed")
    if nodal_diameter is not None and index is not None:
        raise ValueError(
            f"nodal_diameter={check.shown(nodal_diameter)}: expected None where the parameter of "
            "one contact or blade moves, all sectors move alike in a wave"
        )
    return axis


def _modes_of(mode: Any) -> int | tuple[int, ...]:
    """A number of a mode, or several different ones."""
    if not isinstance(mode, Sequence) or isinstance(mode, str):
        return check.integer("mode", mode, minimum=0)
    numbers = tuple(check.integer("mode", number, minimum=0) for number in mode)
    if not numbers or len({*numbers}) < len(numbers):
        raise ValueError(f"mode={check.shown(mode)}: expected different numbers of modes")
    return numbers


def request_of(
    problem: HarmonicBalance,
    sweep: Sweep,
    running: runs.Running,
    axis: dict[str, Any],
    unforced: str,
    mode: Any,
    place: Place | None,
    nodal_diameter: Any,
    **own: Any,
) -> Request:
    """The request with what moves along an ``axis``, its place that of the first parameter set.

    Raises for bad arguments, and as `mode_problem`.
    """
    several = unforced == "limit cycle"
    wave = None if nodal_diameter is None else check.integer("nodal_diameter", nodal_diameter)
    request = Request(
        **axis,
        **own,
        may_fold=True,
        max_points=running.max_points,
        keep=check_keep(running.keep, False, axis["name"], None),
        unforced=unforced,
        mode=_modes_of(mode) if several else check.integer("mode", mode, minimum=0),
        nodal_diameter=wave,
        dof=None if place is None else problem.model.number_of(place),
    )
    first = sweep.chosen(0)
    return with_dof(problem.with_parameters(**first) if first else problem, request)
