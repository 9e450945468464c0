"""Damping as it is known: ratios of modes, shares of mass and stiffness, a loss factor.

Each is given in the place of the damping matrix of a `Model`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from symhbm.model.linear import LowRankSum, lowest_modes
from symhbm.model.records import Record
from symhbm.numerics import DENSE_LIMIT, check

_HELD = (
    "expected a positive semidefinite stiffness, a motion that grows without Coriolis forces has "
    "no frequency and no damping ratio; give a RayleighDamping or a damping matrix, above a "
    "critical speed that of RotatingModel.at(speed) below it for example"
)


class Damping(Record, ABC):
    """Damping that is no matrix yet: it follows from mass and stiffness."""

    loss_factor = 0.0
    """Share of the stiffness that is a loss in every harmonic, whatever the frequency."""

    @property
    def stiffness_share(self) -> float | None:
        """Share of the stiffness in the damping matrix [s], None where it is no share of it."""
        return None

    @abstractmethod
    def matrix(self, mass: Any, stiffness: Any) -> Any:
        """The damping matrix [N s/m] of a structure of sparse ``mass`` and ``stiffness``.

        Sparse (n_dof, n_dof), or a `LowRankSum` of many degrees of freedom. Complex
        Hermitian matrices, those of a sector for one nodal diameter, give one of their kind.
        """

    def of_at_most(self, modes: int) -> Damping:
        """The same of a structure that has no more than so many modes."""
        return self


@dataclass(frozen=True, repr=False)
class ModalDamping(Damping):
    """Damping ratios of modes: ``C = M Phi diag(2 zeta omega) Phi^H M``.

    Parameters
    ----------
    ratio
        ``zeta`` [-], one of all modes or one per mode from the lowest on.
    modes
        Number of modes that are damped, from the lowest on; None damps as many as there are ratios,
        or all modes with one. Others have no damping.

    Raises
    ------
    TypeError, ValueError
        For ratios that are negative, for another number of ratios than modes. Where its matrix is
        asked for, for a stiffness that lets a motion grow, as that of a rotor above a critical
        speed: such a motion has no frequency that a ratio is of.

    Notes
    -----
    A structure of more than 500 degrees of freedom needs ``modes``. Its matrix stays in factors,
    which `condense`, `craig_bampton` and `natural_modes` take. A sector has the modes of each nodal
    diameter damped, ``modes`` of each.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> model = sh.Model(np.eye(2), sh.ModalDamping(0.01), np.diag([1e4, 4e4]))
    >>> model.damping_matrix.diagonal()
    array([2., 4.])
    """

    ratio: ArrayLike
    modes: int | None = None

    def __post_init__(self):
        ratio = check.array("ratio", self.ratio, "non-negative")
        if ratio.ndim > 1 or not ratio.size:
            raise ValueError(f"ratio={check.shown(self.ratio)}: expected one value or one per mode")
        modes = self.modes
        if modes is not None:
            modes = check.integer("modes", modes, minimum=1)
        if ratio.ndim and modes not in (None, len(ratio)):
            raise ValueError(f"modes={modes}: expected {len(ratio)}, one per ratio")
        put = object.__setattr__
        put(self, "ratio", tuple(ratio.tolist()) if ratio.ndim else float(ratio))
        put(self, "modes", len(ratio) if ratio.ndim else modes)

    def __repr__(self) -> str:
        return f"ModalDamping(ratio={check.brief(self.ratio)}, modes={self.modes})"

    def of_at_most(self, modes: int) -> Damping:
        """The same of a structure that has no more than so many modes."""
        if self.modes is None or self.modes <= modes:
            return self
        ratio = self.ratio[:modes] if isinstance(self.ratio, tuple) else self.ratio
        return ModalDamping(ratio, modes)

    def matrix(self, mass: Any, stiffness: Any) -> Any:
        """The damping matrix; ValueError for a large structure without ``modes``."""
        size = mass.shape[0]
        if self.modes is None and size > DENSE_LIMIT:
            raise ValueError(
                f"modes=None: expected the number of damped modes for {size} degrees of freedom, "
                f"as in ModalDamping({self.ratio}, modes=50)"
            )
        squares, shapes = lowest_modes(stiffness, mass, self.modes, f"damping={self!r}: {_HELD}")
        if self.modes is not None and len(squares) < self.modes:
            raise ValueError(
                f"modes={self.modes}: expected at most {len(squares)}, the modes of this structure"
            )
        ratio = np.broadcast_to(self.ratio, len(squares))
        momentum = mass @ shapes
        left = momentum * (2 * ratio * np.sqrt(np.maximum(squares, 0.0)))
        if size <= DENSE_LIMIT:
            return sp.csc_array(left @ momentum.conj().T)
        return LowRankSum(sp.csc_array((size, size)), left, momentum.conj())


@dataclass(frozen=True)
class RayleighDamping(Damping):
    """Damping by shares of mass and stiffness: ``C = mass M + stiffness K``.

    Parameters
    ----------
    mass, stiffness
        Share of the mass [1/s] and of the stiffness [s].

    Raises
    ------
    TypeError, ValueError
        For shares that are negative.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> model = sh.Model(np.eye(2), sh.RayleighDamping(0.5, 1e-5), np.diag([1e4, 4e4]))
    >>> model.damping_matrix.diagonal()
    array([0.6, 0.9])
    """

    mass: float = 0.0
    stiffness: float = 0.0

    @property
    def stiffness_share(self) -> float:
        """Share of the stiffness in the damping matrix [s]."""
        return self.stiffness

    def __post_init__(self):
        for name in ("mass", "stiffness"):
            value = check.scalar(name, getattr(self, name), "non-negative")
            object.__setattr__(self, name, value)

    def matrix(self, mass: Any, stiffness: Any) -> Any:
        """The damping matrix, sparse."""
        return (self.mass * mass + self.stiffness * stiffness).tocsc()


@dataclass(frozen=True)
class StructuralDamping(Damping):
    """Damping by a loss factor: the stiffness is ``K (1 + i loss_factor)`` in every harmonic.

    Of forced responses alone: in time it would answer before it is asked, so motions in time and
    their stability, designs and ``accuracy=`` refuse it.

    Parameters
    ----------
    loss_factor
        ``eta`` [-]; about twice the damping ratio at each resonance.

    Raises
    ------
    TypeError, ValueError
        For a loss factor that is negative.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.Model(
    ...     [[1.0]], sh.StructuralDamping(0.02), [[1e4]], contacts=[(0,)],
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> response = sh.frf(problem, (10, 40), progress=False)
    >>> response.n_peaks.item()
    1
    """

    loss_factor: float

    @property
    def stiffness_share(self) -> float:
        """None of the damping matrix."""
        return 0.0

    def __post_init__(self):
        loss_factor = check.scalar("loss_factor", self.loss_factor, "non-negative")
        object.__setattr__(self, "loss_factor", loss_factor)

    def matrix(self, mass: Any, stiffness: Any) -> Any:
        """The viscous part: nothing."""
        return sp.csc_array(mass.shape)
