"""Cases and their bands, aims of the user and the named peaks they depend on, checked."""

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from symhbm.balance import HarmonicBalance, check_problem
from symhbm.balance.goals import Goal
from symhbm.design.arguments.designed import (
    DesignSymbols,
    Named,
    called,
    column_of,
    without_symbols_of_its_own,
)
from symhbm.design.cases import Bands, NamedPeak
from symhbm.design.program import Aim
from symhbm.design.variables import DesignVariables
from symhbm.numerics import check
from symhbm.results import Sweep

_KEYS = ("frequency", "dof", "problem", "goal")
_TRIED = 1e-4
"""Amplitude [m] at which functions are tried before anything is computed."""
_DIMENSIONS = ("variable", "start", "descent", "active", "fresh", "named_peak", "front", "aim")
"""Dimensions of a design besides those of its cases."""


def check_ratios(
    problem: HarmonicBalance, variables: DesignVariables, sweep: Sweep, argument: str = "over"
) -> None:
    """Raise ValueError where designed parameters are swept and have no nominal proportions."""
    for name in variables.names:
        if name in sweep.values and np.any(np.asarray(problem.parameters[name]) <= 0):
            raise ValueError(
                f"{argument}[{name!r}]: expected positive nominal values of {name} in the problem, "
                "as the values swept are taken relative to them where it is designed"
            )
        if name in sweep.values and np.any(sweep.values[name].values <= 0):
            raise ValueError(
                f"{argument}[{name!r}]: expected positive values of a designed parameter"
            )


def check_forces(problem: HarmonicBalance, sweep: Sweep) -> None:
    """Raise ValueError where a case has no force: its response is zero at every design."""
    named = problem.parameters | sweep.values
    if not np.all(np.asarray(named.get("force_amplitude", 1.0))):
        raise ValueError("force_amplitude=0: expected a force, there is no response to design")


def check_dimensions(sweep: Sweep) -> None:
    """Raise ValueError where cases have a dimension or a coordinate named as one of the result."""
    for name, value in sweep.values.items():
        for dim in (*value.dims, *value.coords):
            if dim in _DIMENSIONS:
                raise ValueError(
                    f"over[{name!r}]: expected a name of your own, {dim!r} is the result's"
                )


def read_bands(frequency: Any, sweep: Sweep, argument: str = "frequency_band") -> list[Bands]:
    """The bands [Hz] of each case: one pair for all, several pairs, or one per case.

    A number stands for the band of that frequency alone, without width.
    """
    shape: tuple[int, ...] = ()
    values = frequency
    if set(sweep.dims) & {*getattr(frequency, "dims", ())}:
        values, shape = _aligned(frequency, sweep, argument), sweep.shape
    edges = check.array(argument, values, "positive")
    if edges.shape == shape:
        return [((at, at),) for at in np.broadcast_to(edges, sweep.shape).ravel().tolist()]
    if edges.shape == (2,):
        edges = edges[None]
    n_dims = len(shape) + 1 if shape else 2
    if edges.shape[-1:] != (2,) or edges.ndim != n_dims or not edges.size:
        raise _no_bands(argument, frequency)
    if np.any(edges[..., 0] == edges[..., 1]):
        raise ValueError(f"{argument}={check.shown(frequency)}: expected bands of some width")
    ordered = np.sort(edges, axis=-1)
    if shape:
        return [((low, high),) for low, high in ordered.reshape(-1, 2).tolist()]
    return [tuple((low, high) for low, high in ordered.tolist())] * sweep.size


def _aligned(frequency: Any, sweep: Sweep, argument: str) -> Any:
    """A DataArray of pairs in the order of the sweep's dimensions."""
    sizes = dict(zip(sweep.dims, sweep.shape, strict=True))
    pairs = [dim for dim in frequency.dims if dim not in sizes]
    if len(pairs) > 1 or any(frequency.sizes.get(dim) != size for dim, size in sizes.items()):
        raise _no_bands(argument, frequency, f", {sizes}")
    for value in sweep.values.values():
        for dim in sizes:
            labelled = dim in value.coords and dim in frequency.coords
            if labelled and not np.array_equal(value[dim], frequency[dim]):
                raise ValueError(
                    f"{argument}: {dim!r} has the labels "
                    f"{check.shown(frequency[dim].values.tolist())}, those of the sweep are "
                    f"{check.shown(value[dim].values.tolist())}"
                )
    return frequency.transpose(*sweep.dims, *pairs)


def _no_bands(argument: str, frequency: Any, sizes: str = "") -> ValueError:
    return ValueError(
        f"{argument}={check.shown(frequency)}: expected two different values (first, last) in Hz, "
        f"a list of such pairs, one frequency, or a DataArray of pairs or of frequencies over the "
        f"dimensions of the sweep{sizes}"
    )


def read_peaks(
    problem: HarmonicBalance,
    peaks: Any,
    variables: DesignVariables,
    bands: Sequence[Bands],
    sweep: Sweep,
) -> list[NamedPeak]:
    """The named peaks; ``bands`` are those of peaks that have none of their own."""
    if peaks is None:
        return [NamedPeak("largest", problem, bands)]
    if not isinstance(peaks, Mapping) or not peaks:
        raise TypeError(
            f"peaks={check.shown(peaks)}: expected a mapping of names to what they are of, for "
            'example {"first": {"frequency": (5, 60)}, "tip": {"dof": 3}}'
        )
    result = []
    for name, given in peaks.items():
        where = f"peaks[{name!r}]"
        if not isinstance(name, str) or not isinstance(given, Mapping):
            raise TypeError(
                f"{where}={check.shown(given)}: expected a name, and a mapping with any of "
                f"{', '.join(_KEYS)}"
            )
        for key in given:
            if key not in _KEYS:
                raise ValueError(f"{where}: expected any of {', '.join(_KEYS)}, got {key!r}")
        own = given.get("problem", problem)
        if own is not problem:
            _check_problem(f"{where}['problem']", own, problem, variables, sweep)
        own_bands = bands
        if "frequency" in given:
            own_bands = read_bands(given["frequency"], sweep, f"{where}['frequency']")
        dof = given.get("dof")
        if dof is not None:
            try:
                dof = own.model.number_of(dof)
            except (KeyError, TypeError, ValueError) as error:
                raise type(error)(f"{where}['dof']: {error.args[0]}") from None
        if "goal" in given:
            own = _with_goal(where, own, given["goal"], dof)
        result.append(NamedPeak(name, own, own_bands, dof))
    return result


def _with_goal(where: str, problem: HarmonicBalance, goal: Any, dof: int | None) -> HarmonicBalance:
    """The problem with the peaks of a goal."""
    words = "one of symhbm.goals, for example symhbm.goals.Dissipation()"
    check.instance(f"{where}['goal']", goal, Goal, words)
    if dof is not None:
        raise ValueError(f"{where}: expected a dof or a goal, got both")
    try:
        return problem.with_peaks_of(goal)
    except (KeyError, TypeError, ValueError) as error:
        words = error.args[0].removeprefix("peaks_of: ")
        raise type(error)(f"{where}['goal']: {words}") from None


def _check_problem(
    where: str, own: Any, problem: HarmonicBalance, variables: DesignVariables, sweep: Sweep
) -> None:
    check.instance(where, own, HarmonicBalance, "a HarmonicBalance")
    check_problem(own, bends=True)
    if own.samples is not None:
        raise ValueError(f"{where}: expected located switching angles, got friction over samples")
    for name in (*variables.names, *sweep.values):
        sizes = [np.size(one.parameters.get(name, ())) for one in (problem, own)]
        if sizes[0] != sizes[1]:
            raise ValueError(
                f"{where}: expected {sizes[0]} values of {name}, as the problem has, got {sizes[1]}"
            )


def read_aim(
    name: str,
    function: Any,
    peaks: Sequence[str],
    problem: HarmonicBalance,
    variables: DesignVariables,
) -> Aim:
    """The aim of a function of peaks and parameters; TypeError or ValueError for bad ones."""
    if not callable(function):
        raise TypeError(
            f"{name}={check.shown(function)}: expected a function of peaks and parameters, for "
            'example lambda peaks, parameters: peaks["largest"]'
        )
    symbols = DesignSymbols.of(problem, variables)
    logarithms = ca.SX.sym("peaks", len(peaks))
    named = dict(zip(peaks, ca.vertsplit(ca.exp(logarithms)), strict=True))
    found = called(name, function, Named(named, "peak"), symbols.parameters)
    expression, _ = symbols.numbers(column_of(name, found))
    if expression.numel() != 1:
        raise ValueError(
            f"{name}: expected one expression, got one of shape {expression.shape}; parameters "
            "have a value for each blade or contact, parameters[...][0] is the first"
        )
    without_symbols_of_its_own(name, expression, logarithms, symbols.values)
    if expression.is_constant():
        raise ValueError(
            f"{name}: expected an expression of peaks or of parameters that are "
            f"designed, got {check.shown(expression)}, which no design changes"
        )
    expression, inputs = symbols.by_logarithms(expression), [logarithms, symbols.x]
    if not any(any(ca.which_depends(expression, one, 1, True)) for one in inputs):
        raise ValueError(
            f"{name}: expected an expression of peaks or of parameters that are designed, which "
            f"are {', '.join(variables.names)}"
        )
    tried = ca.Function("tried", inputs, [expression])
    ends = variables.lower, (variables.lower + variables.upper) / 2, variables.upper
    numbers = [float(tried(np.full(len(peaks), np.log(_TRIED)), x)) for x in ends]
    if np.all(np.isnan(numbers)):
        raise ValueError(
            f"{name}: expected a positive number, got nan in the middle of the bounds and at both "
            f"ends, with peaks of {_TRIED:g} m"
        )
    return Aim(name, ca.Function("aim", inputs, [ca.log(expression)]), tuple(peaks))
