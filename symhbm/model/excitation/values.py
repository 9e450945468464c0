"""What forces give by degree of freedom: one value each, by number or by name, or as a field."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symhbm.model.places import Place, check_place
from symhbm.numerics import ComplexArray, FloatArray, FourierBasis, check

Values = dict[Any, Any] | tuple[Any, ...]
"""By degree of freedom, or one each."""
Pattern = dict[int, Values]
"""Complex amplitudes by harmonic."""


def complex_array(name: str, given: ArrayLike, what: str) -> ComplexArray:
    """Complex numbers; TypeError that tells ``what`` was expected for anything else."""
    try:
        return np.asarray(given, dtype=complex)
    except (TypeError, ValueError):
        raise TypeError(f"{name}={check.shown(given)}: expected {what}") from None


def complex_number(name: str, given: Any) -> complex:
    """One finite complex number; TypeError or ValueError for anything else."""
    return complex(_finite(name, given, 0, "a complex number"))


def _finite(name: str, given: Any, n_dimensions: int, what: str) -> ComplexArray:
    values = complex_array(name, given, what)
    if values.ndim != n_dimensions:
        raise TypeError(f"{name}={check.shown(given)}: expected {what}")
    if not np.isfinite(values).all():
        raise ValueError(f"{name}={check.shown(given)}: expected finite numbers")
    return values


def nodal_field(
    node: ArrayLike, values: ArrayLike, directions: Sequence[str] = ("x", "y", "z")
) -> dict[str, complex]:
    """Forces at nodes as `FieldForce` and the ``pattern`` of `EngineOrder` take them.

    Parameters
    ----------
    node : (n,)
        Numbers of nodes, as the places of the structure have them.
    values : (n, n_directions)
        Complex force of each node along each direction [N].
    directions
        What the columns are, as the places call them.

    Raises
    ------
    TypeError, ValueError
        For arrays that do not fit, numbers that are not finite, and a node that comes twice.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.forces.nodal_field([7, 9], [[1.0, 0.0], [0.5j, 2.0]], directions=("x", "y"))["9:x"]
    0.5j
    """
    numbers = np.atleast_1d(check.array("node", node))
    array = complex_array("values", values, "complex numbers")
    if isinstance(directions, str) or not all(isinstance(name, str) for name in directions):
        raise TypeError(f"directions={check.shown(directions)}: expected a sequence of texts")
    if numbers.ndim != 1 or np.any(numbers != np.round(numbers)):
        raise ValueError(f"node={check.shown(node)}: expected one integer per node")
    if array.shape != (numbers.size, len(directions)):
        raise ValueError(
            f"values: expected shape {(numbers.size, len(directions))}, a row per node and a "
            f"column per direction, got {array.shape}"
        )
    if not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise ValueError(
            f"values[{row}, {column}]={array[row, column]}: expected finite numbers (node "
            f"{int(numbers[row])}, direction {directions[column]!r})"
        )
    if len({*numbers.tolist()}) < numbers.size:
        raise ValueError(f"node={check.shown(node)}: expected each node once")
    return {
        f"{int(number)}:{direction}": complex(value)
        for number, row in zip(numbers, array, strict=True)
        for direction, value in zip(directions, row, strict=True)
    }


def is_labelled(given: Any) -> bool:
    """Whether something is an array with labels, as of xarray."""
    return hasattr(given, "dims") and hasattr(given, "coords")


def labelled_field(name: str, given: Any) -> Mapping[str, complex]:
    """Forces by place of an array with the dimensions node and direction; ValueError for others."""
    dims = given.dims
    if {*dims} != {"node", "direction"}:
        raise ValueError(
            f"{name}: expected the dimensions node and direction of a labelled field, got "
            f"{tuple(dims)}"
        )
    for dim in dims:
        if dim not in given.coords:
            raise ValueError(f"{name}: expected coordinates along {dim!r} of a labelled field")
    rows = given.transpose("node", "direction")
    directions = [str(text) for text in given.coords["direction"].values]
    return nodal_field(given.coords["node"].values, rows.values, directions)


def check_values(name: str, given: Any, number: Callable[[str, Any], Any] = check.scalar) -> Values:
    """Real values by degree of freedom, or one each; TypeError or ValueError for what is neither.

    ``number`` checks one that goes with a name.
    """
    if isinstance(given, Mapping):
        if not given:
            raise ValueError(f"{name}={{}}: expected at least one degree of freedom")
        return {
            check_place(f"degree of freedom of {name}", dof): number(f"{name}[{dof!r}]", value)
            for dof, value in given.items()
        }
    row = np.atleast_1d(check.array(name, given))
    if row.ndim != 1 or not row.size:
        raise ValueError(
            f"{name}={check.shown(given)}: expected one value per degree of freedom, or "
            "{dof: value}"
        )
    return tuple(row.tolist())


def check_pattern(given: Any) -> Pattern:
    """A pattern by harmonics; TypeError or ValueError for what is none."""
    by_harmonic = isinstance(given, Mapping) and any(
        isinstance(value, Mapping) or is_labelled(value) or np.ndim(value)
        for value in given.values()
    )
    if not by_harmonic:
        return {1: _complex_values("pattern", given)}
    return {
        check.integer("harmonic of pattern", harmonic, 1): _complex_values(
            f"pattern[{harmonic}]", value
        )
        for harmonic, value in given.items()
    }


def _complex_values(name: str, given: Any) -> Values:
    given = labelled_field(name, given) if is_labelled(given) else given
    if isinstance(given, Mapping):
        return check_values(name, given, complex_number)
    return tuple(_finite(name, given, 1, "{dof: number} or one per DOF").tolist())


def numbered(name: str, given: Any, number_of: Callable[[Place], int]) -> Any:
    """What a force gives by degree of freedom, with numbers for their names.

    ValueError for one that is named twice.
    """
    if isinstance(given, str):
        return number_of(given)
    if isinstance(given, tuple) and any(isinstance(place, str) for place in given):
        return tuple(map(number_of, given))
    if not isinstance(given, dict):
        return given
    if any(isinstance(values, (dict, tuple)) for values in given.values()):
        return {key: numbered(f"{name}[{key}]", values, number_of) for key, values in given.items()}
    if not any(isinstance(place, str) for place in given):
        return given
    placed: dict[int, Any] = {}
    for place, value in given.items():
        try:
            number = number_of(place)
        except (KeyError, ValueError) as error:
            raise type(error)(f"{name}: {error.args[0]}") from None
        if number in placed:
            raise ValueError(f"{name}: expected each place once, {place!r} is there twice")
        placed[number] = value
    return placed


def scaled(values: Values, factor: float) -> Values:
    """Values times a factor."""
    if isinstance(values, dict):
        return {dof: factor * value for dof, value in values.items()}
    return tuple(factor * value for value in values)


def spread(name: str, values: Values, n_dof: int) -> Any:
    """Values (n_dof,), 0 where none is given; ValueError if they misfit."""
    if not isinstance(values, dict):
        if len(values) != n_dof:
            raise ValueError(f"{name}: expected {n_dof} values (one per DOF), got {len(values)}")
        return np.array(values)
    dofs = [check.integer(f"degree of freedom of {name}", dof, 0, n_dof - 1) for dof in values]
    numbers = np.array([*values.values()])
    result = np.zeros(n_dof, numbers.dtype)
    result[dofs] = numbers
    return result


def check_contained(harmonic: int, basis: FourierBasis) -> None:
    """Raise ValueError for a harmonic of a force that a set leaves out."""
    if harmonic not in basis.harmonics:
        raise ValueError(
            f"harmonics={basis.harmonics}: the excitation acts on harmonic {harmonic}, "
            "which must be in the set"
        )


def shape_of(pattern: Mapping[int, Any], n_dof: int, basis: FourierBasis) -> FloatArray:
    """Coefficients (n_dof, n_components) of ``Re(p_h exp(i h omega t))``; ValueError on misfits."""
    shape = np.zeros((n_dof, basis.n_components))
    for harmonic, given in pattern.items():
        check_contained(harmonic, basis)
        values = spread("pattern", given, n_dof)
        shape[:, basis.component(harmonic)] = values.real
        shape[:, basis.component(harmonic, sine=True)] -= values.imag
    return shape


def acting(pattern: Pattern) -> Pattern:
    """A pattern without amplitudes of 0, but for one that tells its harmonic."""
    result: Pattern = {}
    for harmonic, given in pattern.items():
        each = [*(given.items() if isinstance(given, dict) else enumerate(given))]
        result[harmonic] = dict([(dof, p) for dof, p in each if p] or each[:1])
    return result
