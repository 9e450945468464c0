"""Complex forces over degrees of freedom, or over nodes and directions, as of a pressure field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

from symhbm.model.excitation.excitation import Excitation
from symhbm.model.excitation.pattern import (
    acting,
    check_pattern,
    placed_pattern,
    shape_of,
)
from symhbm.model.places import Place
from symhbm.numerics import FloatArray, FourierBasis, check


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
