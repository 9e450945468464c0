"""What the user designs, read and checked: variables, bands, starts and constraints."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.optimize import LinearConstraint

from symhbm import check
from symhbm.design.cases import Bands
from symhbm.design.space import Group, Space, groups_of
from symhbm.fourier import FloatArray
from symhbm.model import BLADE_PARAMETERS, FRICTION_PARAMETERS
from symhbm.residual import HarmonicBalance
from symhbm.sweep import Sweep

DESIGNABLE = (*FRICTION_PARAMETERS, *BLADE_PARAMETERS)
_FORMS = "'common', 'each', or a sequence of numbers that repeats, for example [0, 1]"


def read_space(problem: HarmonicBalance, parameters: Any, bounds: Any, vary: Any) -> Space:
    """The design variables; raises KeyError, TypeError or ValueError for what cannot be one."""
    names = [parameters] if isinstance(parameters, str) else parameters
    if not isinstance(names, Sequence) or not names or len(set(names)) != len(names):
        raise TypeError(
            f"parameters={check.shown(parameters)}: expected a name or several different ones"
        )
    allowed = [name for name in DESIGNABLE if name in problem.parameters]
    groups: list[Group] = []
    for name in names:
        check.known(name, dict.fromkeys(allowed), "parameter that can be designed")
        where = "bounds" if len(names) == 1 else f"bounds[{name!r}]"
        lower, upper = _pair(where, _own("bounds", bounds, name, len(names)))
        n_entries = np.size(problem.parameters[name])
        pattern = _pattern(_own("vary", vary, name, 1), n_entries)
        groups += groups_of(name, pattern, n_entries, lower, upper)
    ratios = {name: np.ones(np.size(problem.parameters[name])) for name in names}
    return Space(tuple(groups), ratios)


def check_ratios(problem: HarmonicBalance, space: Space, sweep: Sweep) -> None:
    """Raise ValueError where designed parameters are swept and have no nominal proportions."""
    for name in space.names:
        if name in sweep.values and np.any(np.asarray(problem.parameters[name]) <= 0):
            raise ValueError(
                f"over[{name!r}]: expected positive nominal values of {name} in the problem, as "
                "the values swept are taken relative to them where it is designed"
            )
        if name in sweep.values and np.any(sweep.values[name].values <= 0):
            raise ValueError(f"over[{name!r}]: expected positive values of a designed parameter")


def read_bands(frequency: Any, n_cases: int, shape: tuple[int, ...]) -> list[Bands]:
    """The bands [Hz] of each case: one pair for all, several pairs, or one per case."""
    edges = check.array("frequency", frequency, "positive")
    if edges.shape == (2,):
        edges = edges[None]
    allowed = [2, len(shape) + 1]
    if edges.shape[-1] != 2 or edges.ndim not in allowed or not edges.size:
        raise ValueError(
            f"frequency={check.shown(frequency)}: expected two different values (first, last) in "
            "Hz, a list of such pairs, or a DataArray of pairs over the dimensions of the sweep"
        )
    if np.any(edges[..., 0] == edges[..., 1]):
        raise ValueError(f"frequency={check.shown(frequency)}: expected bands of some width")
    ordered = np.sort(edges, axis=-1)
    per_case = hasattr(frequency, "dims")
    if per_case and edges.shape != (*shape, 2):
        raise ValueError(
            f"frequency={check.shown(frequency)}: expected the shape {(*shape, 2)}, that of the "
            f"sweep and a pair, got {edges.shape}"
        )
    if per_case:
        return [((low, high),) for low, high in ordered.reshape(-1, 2).tolist()]
    return [tuple((low, high) for low, high in ordered.tolist())] * n_cases


def read_start(space: Space, start: Any) -> FloatArray | None:
    """Logarithms of the design to start from, None for none."""
    if start is None:
        return None
    values = check.array("start", start, "positive")
    if values.ndim > 1 or (values.ndim == 1 and len(values) != space.n_variables):
        raise ValueError(
            f"start={check.shown(start)}: expected one value, or one for each of the "
            f"{space.n_variables} variables, got shape {values.shape}"
        )
    return np.log(np.broadcast_to(values, space.n_variables))


def read_constraint(space: Space, constraint: Any) -> LinearConstraint | None:
    """A linear constraint on the values of the variables, None for none."""
    if constraint is None:
        return None
    if not isinstance(constraint, LinearConstraint):
        raise TypeError(
            f"constraint={check.shown(constraint)}: expected a scipy.optimize.LinearConstraint on "
            "the values of the variables"
        )
    matrix = np.atleast_2d(np.asarray(constraint.A, dtype=float))
    if matrix.shape[1] != space.n_variables or not np.all(np.isfinite(matrix)):
        raise ValueError(
            f"constraint: expected a finite matrix with {space.n_variables} columns, one for each "
            f"variable, got shape {matrix.shape}"
        )
    return constraint


def _own(what: str, given: Any, name: str, n_names: int) -> Any:
    """The part of one parameter."""
    if isinstance(given, Mapping):
        if name not in given:
            raise ValueError(f"{what}={check.shown(given)}: expected an entry for {name!r}")
        return given[name]
    if n_names > 1:
        raise TypeError(
            f"{what}={check.shown(given)}: expected a mapping with an entry for each parameter"
        )
    return given


def _pair(where: str, given: Any) -> tuple[float, float]:
    edges = check.array(where, given, "positive")
    if edges.shape != (2,) or edges[0] >= edges[1]:
        raise ValueError(f"{where}={check.shown(given)}: expected two values, lower < upper")
    return float(edges[0]), float(edges[1])


def _pattern(given: Any, n_entries: int) -> Any:
    if isinstance(given, str):
        if given not in ("common", "each"):
            raise ValueError(f"vary={check.shown(given)}: expected {_FORMS}")
        return given
    numbers = check.array("vary", given)
    if numbers.ndim != 1 or not 0 < len(numbers) <= n_entries or np.any(numbers % 1):
        raise ValueError(
            f"vary={check.shown(given)}: expected {_FORMS}, no longer than the {n_entries} values "
            "of the parameter"
        )
    return numbers.astype(int)
