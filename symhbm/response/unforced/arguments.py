"""Arguments of verbs on motions that no force drives, checked."""

from collections.abc import Sequence
from typing import Any

from symhbm.balance import HarmonicBalance, check_problem
from symhbm.numerics import check
from symhbm.results import (
    Sweep,
    check_band,
    check_grid,
    check_index,
    check_parameter,
    parse,
)


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


def amplitudes_of(amplitude: Any) -> tuple[float, float]:
    """A band of amplitudes, ascending."""
    band = check_band("amplitude", amplitude, "positive", " [m]")
    if band[0] > band[1]:
        raise ValueError(f"amplitude={check.shown(amplitude)}: expected (smallest, largest) [m]")
    return band


def axis_of(
    problem: HarmonicBalance,
    parameter: str,
    band: Any,
    at: Any,
    contact: Any,
    blade: Any,
    sweep: Sweep,
    wave: int | None,
) -> dict[str, Any]:
    """Fields of the request that tell which parameter moves, and where."""
    bound = check_parameter(problem, parameter)
    name = problem.parameter_name(parameter)
    if name == "force_amplitude":
        raise ValueError(f"parameter={parameter!r}: expected one of the structure, no force acts")
    edges = check_band("band", band, bound, f" [{problem.model.about(name).units}]")
    index = check_index(problem, name, contact, blade)
    if name in sweep.values:
        raise ValueError(f"over: {name!r} is the parameter that is followed")
    if wave is not None and index is not None:
        raise ValueError(
            f"nodal_diameter={wave}: expected None where the parameter of one contact or blade "
            "moves, all sectors move alike in a wave"
        )
    return dict(name=name, band=edges, at=check_grid(at, edges), index=index)


def modes_of(mode: Any) -> int | tuple[int, ...]:
    """A number of a mode, or several different ones."""
    if not isinstance(mode, Sequence) or isinstance(mode, str):
        return check.integer("mode", mode, minimum=0)
    numbers = tuple(check.integer("mode", number, minimum=0) for number in mode)
    if not numbers or len({*numbers}) < len(numbers):
        raise ValueError(f"mode={check.shown(mode)}: expected different numbers of modes")
    return numbers


def wave_of(given: Any) -> int | None:
    """A number of nodal diameters, None for none."""
    return None if given is None else check.integer("nodal_diameter", given)


def first_of(problem: HarmonicBalance, sweep: Sweep) -> HarmonicBalance:
    """The problem of the first parameter set."""
    first = sweep.chosen(0)
    return problem.with_parameters(**first) if first else problem
