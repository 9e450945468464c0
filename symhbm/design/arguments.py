"""Arguments of a design, checked: variables, bands, starts and constraints."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
import scipy.sparse as sp

from symhbm.balance import HarmonicBalance
from symhbm.design.cases import Bands
from symhbm.design.variables import DesignVariables, Group, groups_of
from symhbm.numerics import FloatArray, check
from symhbm.results import Sweep

if TYPE_CHECKING:
    from scipy.optimize import LinearConstraint

_DIMENSIONS = ("variable", "start", "descent", "active", "fresh")
"""Dimensions of a design besides those of its cases."""
_FORMS = "'common', 'each', or a sequence of numbers that repeats, for example [0, 1]"


def read_variables(
    problem: HarmonicBalance, parameters: Any, bounds: Any, vary: Any
) -> DesignVariables:
    """The design variables; raises KeyError, TypeError or ValueError for bad arguments."""
    names = [parameters] if isinstance(parameters, str) else parameters
    if not isinstance(names, Sequence) or not names or len(set(names)) != len(names):
        raise TypeError(
            f"parameters={check.shown(parameters)}: expected a name or several different ones"
        )
    for argument, value in (("bounds", bounds), ("vary", vary)):
        unused = [name for name in value if name not in names] if isinstance(value, Mapping) else []
        if unused:
            raise ValueError(
                f"{argument}={check.shown(value)}: expected entries for "
                f"{', '.join(map(str, names))} alone, {unused[0]!r} is not designed"
            )
    allowed = [name for name in problem.parameters if problem.model.about(name).designed]
    groups: list[Group] = []
    given, names = (
        names,
        [problem.parameter_name(name, allowed, "parameter that can be designed") for name in names],
    )
    for said, name in zip(given, names, strict=True):
        where = "bounds" if len(names) == 1 else f"bounds[{said!r}]"
        lower, upper = _pair(where, _entry_of("bounds", bounds, said, len(names)))
        n_entries = np.size(problem.parameters[name])
        if not n_entries:
            raise ValueError(f"parameters={name!r}: expected contacts, the structure has none")
        pattern = _pattern(_entry_of("vary", vary, said, 1), n_entries)
        groups += groups_of(name, pattern, n_entries, lower, upper)
    ratios = {name: np.ones(np.size(problem.parameters[name])) for name in names}
    return DesignVariables(tuple(groups), ratios)


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


def read_bands(frequency: Any, sweep: Sweep) -> list[Bands]:
    """The bands [Hz] of each case: one pair for all, several pairs, or one per case."""
    shape: tuple[int, ...] = ()
    values = frequency
    if set(sweep.dims) & {*getattr(frequency, "dims", ())}:
        values, shape = _aligned(frequency, sweep), sweep.shape
    edges = check.array("frequency", values, "positive")
    if edges.shape == (2,):
        edges = edges[None]
    n_dims = len(shape) + 1 if shape else 2
    if edges.shape[-1:] != (2,) or edges.ndim != n_dims or not edges.size:
        raise _no_bands(frequency)
    if np.any(edges[..., 0] == edges[..., 1]):
        raise ValueError(f"frequency={check.shown(frequency)}: expected bands of some width")
    ordered = np.sort(edges, axis=-1)
    if shape:
        return [((low, high),) for low, high in ordered.reshape(-1, 2).tolist()]
    return [tuple((low, high) for low, high in ordered.tolist())] * sweep.size


def _aligned(frequency: Any, sweep: Sweep) -> Any:
    """A DataArray of pairs in the order of the sweep's dimensions."""
    sizes = dict(zip(sweep.dims, sweep.shape, strict=True))
    pairs = [dim for dim in frequency.dims if dim not in sizes]
    if len(pairs) != 1 or any(frequency.sizes.get(dim) != size for dim, size in sizes.items()):
        raise _no_bands(frequency, f", {sizes}")
    for value in sweep.values.values():
        for dim in sizes:
            labelled = dim in value.coords and dim in frequency.coords
            if labelled and not np.array_equal(value[dim], frequency[dim]):
                raise ValueError(
                    f"frequency: {dim!r} has the labels "
                    f"{check.shown(frequency[dim].values.tolist())}, those of the sweep are "
                    f"{check.shown(value[dim].values.tolist())}"
                )
    return frequency.transpose(*sweep.dims, *pairs)


def _no_bands(frequency: Any, sizes: str = "") -> ValueError:
    return ValueError(
        f"frequency={check.shown(frequency)}: expected two different values (first, last) in Hz, a "
        f"list of such pairs, or a DataArray of pairs over the dimensions of the sweep{sizes}"
    )


def read_start(variables: DesignVariables, start: Any) -> FloatArray | None:
    """Logarithms of the design to start from, None for none."""
    if start is None:
        return None
    values = check.array("start", start, "positive")
    if values.ndim > 1 or (values.ndim == 1 and len(values) != variables.n_variables):
        raise ValueError(
            f"start={check.shown(start)}: expected one value, or one for each of the "
            f"{variables.n_variables} variables, got shape {values.shape}"
        )
    return np.log(np.broadcast_to(values, variables.n_variables))


def read_constraint(variables: DesignVariables, constraint: Any) -> "LinearConstraint | None":
    """A linear constraint on the values of the variables, None for none."""
    if constraint is None:
        return None
    if not isinstance(constraint, scipy.optimize.LinearConstraint):
        raise TypeError(
            f"constraint={check.shown(constraint)}: expected a scipy.optimize.LinearConstraint on "
            "the values of the variables"
        )
    rows: Any = constraint.A
    matrix = np.atleast_2d(rows.toarray() if sp.issparse(rows) else rows).astype(float)
    if matrix.shape[1] != variables.n_variables or not np.all(np.isfinite(matrix)):
        raise ValueError(
            f"constraint: expected a finite matrix with {variables.n_variables} columns, one for "
            f"each variable, got shape {matrix.shape}"
        )
    if not matrix.any(axis=1).all():
        row = int(np.argmin(matrix.any(axis=1)))
        raise ValueError(
            f"constraint: expected rows with an entry other than 0, row {row} has none"
        )
    lower, upper = (
        np.broadcast_to(np.asarray(bound, dtype=float), len(matrix))
        for bound in (constraint.lb, constraint.ub)
    )
    if not np.all((lower < np.inf) & (upper > -np.inf)):
        raise ValueError(
            f"constraint: expected numbers as bounds, -inf below or inf above for none, got "
            f"lb={check.shown(constraint.lb)}, ub={check.shown(constraint.ub)}"
        )
    return scipy.optimize.LinearConstraint(matrix, lower, upper)  # type: ignore


def _entry_of(argument: str, value: Any, name: str, n_names: int) -> Any:
    """The entry of an argument for one parameter."""
    if isinstance(value, Mapping):
        if name not in value:
            raise ValueError(f"{argument}={check.shown(value)}: expected an entry for {name!r}")
        return value[name]
    if n_names > 1:
        raise TypeError(
            f"{argument}={check.shown(value)}: expected a mapping with an entry for each parameter"
        )
    return value


def _pair(where: str, value: Any) -> tuple[float, float]:
    edges = check.array(where, value, "positive")
    if edges.shape != (2,) or edges[0] >= edges[1]:
        raise ValueError(f"{where}={check.shown(value)}: expected two values, lower < upper")
    return float(edges[0]), float(edges[1])


def _pattern(value: Any, n_entries: int) -> Any:
    if isinstance(value, str):
        if value not in ("common", "each"):
            raise ValueError(f"vary={check.shown(value)}: expected {_FORMS}")
        return value
    numbers = check.array("vary", value)
    if numbers.ndim != 1 or not 0 < len(numbers) <= n_entries or np.any(numbers % 1):
        raise ValueError(
            f"vary={check.shown(value)}: expected {_FORMS}, no longer than the {n_entries} values "
            "of the parameter"
        )
    return numbers.astype(int)
