"""Complex force patterns of one sector of a disk, harmonic by harmonic."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from symhbm.model.excitation.excitation import check_contained
from symhbm.model.excitation.nodal_field import is_labelled, labelled_field
from symhbm.model.places import Place, check_place
from symhbm.numerics import ComplexArray, FloatArray, FourierBasis, check

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
