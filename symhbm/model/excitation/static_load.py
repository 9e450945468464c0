"""Loads that do not change with time: weight, the pull of rotation, an assembly force."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from symhbm.model.excitation.excitation import Excitation
from symhbm.model.excitation.values import check_values, spread
from symhbm.numerics import FloatArray, FourierBasis


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
    _of_places: ClassVar = ("values",)

    def __post_init__(self):
        object.__setattr__(self, "values", check_values("values", self.values))

    @property
    def amplitude(self) -> float:  # type: ignore[override]
        """Nothing oscillates."""
        return 0.0

    @property
    def still(self) -> Excitation:
        """All of it."""
        return self

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Nothing, ``(n_dof, n_components)``."""
        return np.zeros((n_dof, basis.n_components))

    def static(self, n_dof: int) -> FloatArray:
        """The load, ``(n_dof,)`` [N]; ValueError if it misfits."""
        return spread("values", self.values, n_dof)
