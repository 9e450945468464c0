"""Linear outputs of a structure: stresses, sensors, means, as rows over degrees of freedom."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.places import Place, check_place
from symhbm.model.records import Record
from symhbm.numerics import check


@dataclass(frozen=True, eq=False)
class Output(Record):
    """A linear output ``S x``: its name, ``rows`` S (n_rows, n_dof), sparse, and units.

    ``several`` tells that it has a dimension of its own, ``<name>_row``.
    """

    name: str
    rows: Any
    units: str
    several: bool

    @property
    def inner(self) -> tuple[str, ...]:
        """Dimensions of its values in a dataset, after the point."""
        return (f"{self.name}_row",) if self.several else ()

    @property
    def touched(self) -> NDArray[np.intp]:
        """Degrees of freedom that it reads."""
        return np.unique(self.rows.nonzero()[1])

    def of(self, rows: Any) -> Output:
        """The same output of a structure with other degrees of freedom."""
        return replace(self, rows=_tidy(rows))

    def fields(self) -> dict[str, Any]:
        """What makes it again, for readers without its numbers, too."""
        rows: Any = sp.coo_array(self.rows)
        entries = [rows.row.tolist(), rows.col.tolist(), rows.data.tolist()]
        return super().fields() | {"rows": [list(rows.shape), *entries]}

    @classmethod
    def of_fields(cls, **fields: Any) -> Output:
        """The output of its `fields`."""
        shape, row, column, value = fields["rows"]
        rows = sp.coo_array((value, (row, column)), shape=shape)
        return cls(**fields | {"rows": _tidy(rows)})


def outputs_of(
    given: Any, units: Any, n_whole: int, number_of: Callable[[Place], int]
) -> dict[str, Output]:
    """Outputs by name, over ``n_whole`` degrees of freedom.

    Raises TypeError, ValueError or KeyError for what is none, naming it.
    """
    if not isinstance(given, Mapping) or not given:
        raise TypeError(
            f"outputs={check.shown(given)}: expected {{name: weights}}, as in "
            '{"root_stress": {"root:x": 2.1e11}}'
        )
    result = {}
    for name, rows in given.items():
        _check_name(name)
        unit = units.get(name) if isinstance(units, Mapping) else units
        if not isinstance(unit, str):
            raise TypeError(
                f"units={check.shown(units)}: expected text, or one for each output, as in "
                f'{{"{name}": "Pa"}}'
            )
        what = f"outputs[{name!r}]"
        matrix, several = _rows(what, rows, n_whole, number_of)
        if not np.isfinite(matrix.data).all():
            raise ValueError(f"{what}: expected finite weights")
        empty = np.flatnonzero(abs(matrix).sum(axis=1) == 0)
        if empty.size:
            raise ValueError(f"{what}: expected a weight that is not 0 in each row, row {empty[0]}")
        result[name] = Output(name, matrix, unit, several)
    if isinstance(units, Mapping):
        for name in units:
            check.known(name, result, "output with units")
    return result


def _check_name(name: object) -> None:
    if not isinstance(name, str) or not name.isidentifier() or name.startswith("_"):
        raise ValueError(f"outputs: {name!r} is no name, expected letters, digits and underscores")
    if name.startswith(("peak_", "event_", "minimum_", "branch_", "fold_", "design_")):
        raise ValueError(f"outputs: {name!r} begins as results of the library do, expected another")


def _rows(
    what: str, given: Any, n_whole: int, number_of: Callable[[Place], int]
) -> tuple[Any, bool]:
    """Weights as a sparse matrix (n_rows, n_whole), and whether there are several rows."""
    if isinstance(given, Mapping):
        return _tidy(sp.vstack([_row(what, given, n_whole, number_of)])), False
    matrix: Any
    if sp.issparse(given):
        matrix = sp.csr_array(given)
        check.array(f"{what} entries", matrix.data)
    elif isinstance(given, Iterable) and any(isinstance(row, Mapping) for row in given):
        each = [_row(f"{what}[{i}]", row, n_whole, number_of) for i, row in enumerate(given)]
        return _tidy(sp.vstack(each)), True
    else:
        array = check.array(what, given)  # type: ignore[arg-type]
        if array.ndim == 1:
            _check_width(what, array.shape[0], n_whole)
            return _tidy(sp.csr_array(array[None])), False
        if array.ndim != 2:
            raise ValueError(f"{what}: expected one row or a matrix, got shape {array.shape}")
        matrix = sp.csr_array(array)
    _check_width(what, matrix.shape[1], n_whole)
    return _tidy(matrix), True


def _check_width(what: str, width: int, n_whole: int) -> None:
    if width != n_whole:
        raise ValueError(f"{what}: expected {n_whole} weights (one per DOF), got {width}")


def _row(what: str, weights: Any, n_whole: int, number_of: Callable[[Place], int]) -> Any:
    if not isinstance(weights, Mapping) or not weights:
        raise TypeError(f"{what}={check.shown(weights)}: expected {{dof: weight}}")
    row = sp.lil_array((1, n_whole))
    for place, weight in weights.items():
        try:
            number = number_of(check_place(f"{what}, degree of freedom", place))
        except (KeyError, ValueError) as error:
            raise type(error)(f"{what}: {error.args[0]}") from None
        if not 0 <= number < n_whole:
            raise ValueError(f"{what}: expected degrees of freedom 0 to {n_whole - 1}, got {place}")
        row[0, number] += check.scalar(f"{what}[{place!r}]", weight)
    return row


def _tidy(matrix: Any) -> Any:
    """A matrix by rows, float, without stored zeros."""
    result: Any = sp.csr_array(matrix).astype(float)
    result.sum_duplicates()
    result.eliminate_zeros()
    return result
