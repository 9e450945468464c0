"""Loads that do not change with time: weight, the pull of rotation, an assembly force."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from symhbm.model.excitation.excitation import Excitation
from symhbm.model.places import Place, check_place
from symhbm.numerics import FloatArray, FourierBasis, check


@dataclass(frozen=True, repr=False)
class StaticLoad(Excitation):
    """Constant force ``values`` [N]: one value per degree of freedom, or ``{dof: value}``.

    A ``dof`` is a number, or a name in a structure with places, as in ``{"tip:x": 5.0}``. The load
    acts on harmonic 0, which responses need, and ``force_amplitude`` of a sum leaves it as it is,
    as the speed of rotation does along an engine order.
    By itself it does not oscillate and has no named parameter.

    Raises TypeError or ValueError for what is neither, and for values that are not finite.

    Examples
    --------
    A blade that vibrates about the place where 20 N hold it:

    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> force = sh.forces.PointForce(amplitude=2.0) + sh.forces.StaticLoad([20.0])
    >>> point = sh.solve(sh.HarmonicBalance(blade, force, (0, 1)), 19.5)
    >>> point.coefficient.sel(harmonic=0, component="cos").values.round(6)
    array([0.002])
    """

    values: Any

    _fields: ClassVar = {}

    def __post_init__(self):
        given = self.values
        if isinstance(given, Mapping):
            if not given:
                raise ValueError("values={}: expected at least one degree of freedom")
            checked: Any = {
                check_place("degree of freedom of values", dof): check.scalar(
                    f"values[{dof!r}]", value
                )
                for dof, value in given.items()
            }
        else:
            array = np.atleast_1d(check.array("values", given))
            if array.ndim != 1 or not array.size:
                raise ValueError(
                    f"values={check.shown(given)}: expected one value per degree of freedom, or "
                    "{dof: value}"
                )
            checked = tuple(array.tolist())
        object.__setattr__(self, "values", checked)

    @property
    def amplitude(self) -> float:  # type: ignore[override]
        """Nothing oscillates."""
        return 0.0

    def placed(self, number_of: Callable[[Place], int]) -> Self:
        """The same load on numbered degrees of freedom; ValueError for one that is named twice."""
        if not isinstance(self.values, dict) or not any(isinstance(d, str) for d in self.values):
            return self
        values = {number_of(dof): value for dof, value in self.values.items()}
        if len(values) < len(self.values):
            raise ValueError(f"values={check.shown(self.values)}: expected each place once")
        return replace(self, values=values)

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Nothing, ``(n_dof, n_components)``."""
        return np.zeros((n_dof, basis.n_components))

    def static(self, n_dof: int) -> FloatArray:
        """The load, ``(n_dof,)`` [N]; ValueError if it misfits."""
        if isinstance(self.values, dict):
            result, dofs = np.zeros(n_dof), [*self.values]
            for dof in dofs:
                check.integer("degree of freedom of values", dof, 0, n_dof - 1)
            result[dofs] = [*self.values.values()]
            return result
        return one_each("values", self.values, n_dof)


def one_each(name: str, values: tuple[float, ...], n_dof: int) -> FloatArray:
    """Values (n_dof,) of a force; ValueError for another number of them."""
    if len(values) != n_dof:
        raise ValueError(f"{name}: expected {n_dof} values (one per DOF), got {len(values)}")
    return np.asarray(values, dtype=float)
