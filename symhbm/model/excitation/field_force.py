"""Complex forces of a field, as of a pressure: over places, or of one sector of a disk.

A field over nodes and directions makes forces over named degrees of freedom; a pattern of one
sector goes around the disk harmonic by harmonic.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from symhbm.model.excitation.excitation import Excitation, check_contained
from symhbm.model.places import Place, check_place
from symhbm.numerics import ComplexArray, FloatArray, FourierBasis, check


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
    try:
        array = np.asarray(values, dtype=complex)
    except (TypeError, ValueError):
        raise TypeError(f"values={check.shown(values)}: expected complex numbers") from None
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


Pattern = dict[int, dict[Any, complex] | tuple[complex, ...]]
"""By harmonic: amplitudes by degree of freedom, or one each."""


def check_pattern(given: Any) -> Pattern:
    """A pattern by harmonics; TypeError or ValueError for what is none."""
    by_harmonic = isinstance(given, Mapping) and any(
        isinstance(value, Mapping) or is_labelled(value) or np.ndim(value)
        for value in given.values()
    )
    if not by_harmonic:
        return {1: _one("pattern", given)}
    return {
        check.integer("harmonic of pattern", harmonic, 1): _one(f"pattern[{harmonic}]", value)
        for harmonic, value in given.items()
    }


def _one(name: str, given: Any) -> Any:
    if is_labelled(given):
        given = labelled_field(name, given)
    if isinstance(given, Mapping):
        if not given:
            raise ValueError(f"{name}={{}}: expected at least one degree of freedom")
        return {
            check_place(f"{name}, degree of freedom", dof): complex(
                _numbers(f"{name}[{dof!r}]", value, 0)
            )
            for dof, value in given.items()
        }
    return tuple(_numbers(name, given, 1).tolist())


def _numbers(name: str, given: Any, n_dimensions: int) -> ComplexArray:
    try:
        values = np.asarray(given, dtype=complex)
    except (TypeError, ValueError):
        values = np.zeros((0, 0, 0), dtype=complex)
    if values.ndim != n_dimensions:
        what = "a complex number" if n_dimensions == 0 else "{dof: number} or one per DOF"
        raise TypeError(f"{name}={check.shown(given)}: expected {what}")
    if not np.isfinite(values).all():
        raise ValueError(f"{name}={check.shown(given)}: expected finite numbers")
    return values


def placed_pattern(pattern: Pattern, number_of: Callable[[Place], int]) -> Pattern:
    """The same pattern on numbered degrees of freedom."""
    return {
        harmonic: placed_values("pattern", given, number_of) if isinstance(given, dict) else given
        for harmonic, given in pattern.items()
    }


def placed_values(
    name: str, values: dict[Any, Any], number_of: Callable[[Place], int]
) -> dict[int, Any]:
    """Values by number; ValueError for a degree of freedom that is named twice."""
    placed = {}
    for place, value in values.items():
        try:
            number = number_of(place)
        except (KeyError, ValueError) as error:
            raise type(error)(f"{name}: {error.args[0]}") from None
        if number in placed:
            raise ValueError(f"{name}: expected each degree of freedom once, {place!r} is twice")
        placed[number] = value
    return placed


def shape_of(pattern: Pattern, n_dof: int, basis: FourierBasis) -> FloatArray:
    """Coefficients (n_dof, n_components) of a pattern; ValueError if it misfits."""
    shape = np.zeros((n_dof, basis.n_components))
    for harmonic, given in pattern.items():
        check_contained(harmonic, basis)
        if isinstance(given, dict):
            dofs, values = [*given], np.array([*given.values()])
            for dof in dofs:
                check.integer("pattern, degree of freedom", dof, 0, n_dof - 1)
        else:
            dofs, values = [*range(len(given))], np.array(given)
            if len(given) != n_dof:
                raise ValueError(
                    f"pattern: expected {n_dof} values (one per DOF), got {len(given)}"
                )
        shape[dofs, basis.component(harmonic)] = np.real(values)
        shape[dofs, basis.component(harmonic, sine=True)] = -np.imag(values)
    return shape


def acting(pattern: Pattern) -> Pattern:
    """A pattern without amplitudes of 0, but for one that tells its harmonic."""
    result: Pattern = {}
    for harmonic, given in pattern.items():
        each = [*(given.items() if isinstance(given, dict) else enumerate(given))]
        result[harmonic] = dict([(dof, p) for dof, p in each if p] or each[:1])
    return result


@dataclass(frozen=True, repr=False)
class FieldForce(Excitation):
    """Force ``amplitude Re(p_h exp(i h omega t))``, complex ``p_h`` over degrees of freedom.

    ``pattern`` is an array (n_dof,), ``{dof: p}`` by numbers or names, or a field over nodes and
    directions, see `nodal_field`, also as an xarray DataArray with these two dimensions. Such are
    of harmonic 1; ``{harmonic: such}`` tells others. On a reduced or condensed structure degrees of
    freedom are those of the whole one.

    Raises TypeError or ValueError for what is none of these and for numbers that are not finite;
    a problem raises for a length that is not n_dof and for unknown places.

    Examples
    --------
    >>> import symhbm as sh
    >>> force = sh.forces.FieldForce([1.0, 0.5j], amplitude=3.0)
    >>> named = sh.forces.FieldForce({1: {"tip:x": 1.0}, 2: {"tip:x": 0.1j, "root:y": 0.2}})
    """

    pattern: Any
    amplitude: float = 1.0

    def __post_init__(self):
        object.__setattr__(self, "amplitude", check.scalar("amplitude", self.amplitude))
        object.__setattr__(self, "pattern", check_pattern(self.pattern))

    def placed(self, number_of: Callable[[Place], int]) -> Self:
        """The same force on numbered degrees of freedom."""
        return replace(self, pattern=placed_pattern(self.pattern, number_of))

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if they misfit."""
        return shape_of(self.pattern, n_dof, basis)

    def fields(self) -> dict[str, Any]:
        """What makes it again, of the pattern what acts."""
        return super().fields() | {"pattern": acting(self.pattern)}
