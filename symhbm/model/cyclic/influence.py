"""Aerodynamic forces of a blade and its neighbours, by influence coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.linear import turn
from symhbm.model.records import record
from symhbm.numerics import RADIANS, ComplexArray, FloatArray, check

LARGEST = 1000
"""Most degrees of freedom of a shape: all of them are coupled with each other."""


class Influence:
    """Forces on each blade that follow from the motion of its own and of others around the disk.

    With ``a_j = w^T x_j``, the motion of blade j along a shape, the force on it along that shape is
    ``-sum_k L_k a_(j+k)`` at one frequency: ``L_k = s_k + i omega d_k``, a stiffness ``s_k`` and a
    damping ``d_k`` that hold at all frequencies. In a wave of n nodal diameters they add
    ``sum_k L_k exp(-i k n phi)`` to the dynamic stiffness along the shape.

    Parameters
    ----------
    shape : {place: weight} or (n_dof,)
        ``w``, of one sector: a mode of the blade, or the place of its displacement.
    coefficients : {distance: complex}
        ``L_k`` [N/m] by the number of blades that another one is ahead, 0 for a blade itself.
    frequency
        Frequency [Hz] that the coefficients were computed at.

    Raises
    ------
    TypeError, ValueError
        For what is no shape or no coefficients, and for a frequency that is not positive.

    Examples
    --------
    A disk of 12 blades, whose damping depends on the nodal diameters:

    >>> import symhbm as sh
    >>> blade = sh.Model([[1.0, 0], [0, 0]], [[1.0, 0], [0, 0]], [[3e4, -2e4], [-2e4, 2e4]])
    >>> disk = sh.Sector(blade, left=[0], right=[1], n_sectors=12)
    >>> wind = sh.Influence({0: 1.0}, {-1: 40j, 0: 90j, 1: -30j}, frequency=30)
    >>> moved = disk.with_influences(wind)
    >>> problem = sh.HarmonicBalance(moved, sh.forces.EngineOrder(3, pattern={0: 1.0}))
    >>> sh.frf(problem, (20, 60), progress=False).n_peaks.item()
    1
    """

    def __init__(self, shape: Any, coefficients: Mapping[int, complex], frequency: float):
        self.shape = _shape(shape)
        if not isinstance(coefficients, Mapping) or not coefficients:
            raise TypeError(
                f"coefficients={check.shown(coefficients)}: expected {{distance: complex}}"
            )
        distances = [check.integer("distance of coefficients", k) for k in coefficients]
        values = _complex("coefficients", [*coefficients.values()])
        omega = RADIANS * check.scalar("frequency", frequency, "positive")
        self.distances = np.array(distances, dtype=np.intp)
        self.stiffness: Any = values.real
        self.damping: Any = values.imag / omega
        self._n_waves: int | None = None

    @classmethod
    def by_nodal_diameter(cls, shape: Any, coefficients: Any, frequency: float) -> Self:
        """The same from ``sum_k L_k exp(-i k n phi)`` of the waves n = 0 to N - 1, (N,) [N/m].

        Waves above N / 2 are those of the other sense. ValueError by `symhbm.Sector` where N is
        not its number of sectors.
        """
        waves = _complex("coefficients", coefficients)
        if waves.ndim != 1:
            raise ValueError("coefficients: expected one per nodal diameter, 0 to N - 1")
        influence = cls(shape, dict(enumerate(np.fft.ifft(waves))), frequency)
        influence._n_waves = len(waves)
        return influence

    def along(self, number_of: Any, n_dof: int, n_sectors: int) -> Coupling:
        """The forces by numbers of the ``n_dof`` degrees of freedom of one of ``n_sectors``."""
        if self._n_waves not in (None, n_sectors):
            raise ValueError(
                f"coefficients: expected one for each of the waves 0 to {n_sectors - 1} of "
                f"{n_sectors} sectors, got {self._n_waves}"
            )
        if isinstance(self.shape, dict):
            dofs = [number_of(place) for place in self.shape]
            weights = np.array([*self.shape.values()])
        elif len(self.shape) != n_dof:
            raise ValueError(
                f"shape: expected one weight for each of the {n_dof} degrees of freedom of the "
                f"sector, got {len(self.shape)}; {{place: weight}} tells a few"
            )
        else:
            dofs, weights = np.flatnonzero(self.shape).tolist(), self.shape[self.shape != 0]
        if len(dofs) > LARGEST:
            raise ValueError(
                f"shape: expected at most {LARGEST} degrees of freedom, which become coupled, got "
                f"{len(dofs)}; reduce the sector first, by symhbm.craig_bampton, or tell "
                "the motion of the blade at some places"
            )
        if len({*dofs}) < len(dofs) or max(dofs) >= n_dof or len(dofs) > n_dof:
            raise ValueError(f"shape: expected each of {n_dof} degrees of freedom once at most")
        column = sp.csc_array((weights, (dofs, np.zeros(len(dofs), dtype=int))), (n_dof, 1))
        return Coupling(column, self.distances, self.stiffness, self.damping)


@record
class Coupling(NamedTuple):
    """Forces along a sparse ``column`` (n_dof, 1) by stiffness and damping at each distance."""

    column: Any
    distances: NDArray[np.intp]
    stiffness: FloatArray
    damping: FloatArray

    def in_wave(self, n: int, n_sectors: int) -> tuple[complex, complex]:
        """Damping and stiffness along the column in a wave of ``n`` nodal diameters."""
        lags = np.array([turn(n * k, n_sectors) for k in self.distances.tolist()])
        return complex(self.damping @ lags), complex(self.stiffness @ lags)


def _shape(given: Any) -> dict[Any, float] | FloatArray:
    if isinstance(given, Mapping):
        if not given:
            raise ValueError("shape={}: expected at least one degree of freedom")
        return {place: check.scalar(f"shape[{place!r}]", value) for place, value in given.items()}
    array = check.array("shape", given)
    if array.ndim != 1:
        raise TypeError(f"shape={check.shown(given)}: expected {{place: weight}}, or one per DOF")
    return array


def _complex(name: str, given: Any) -> ComplexArray:
    try:
        values = np.asarray(given, dtype=complex)
    except (TypeError, ValueError):
        raise TypeError(f"{name}={check.shown(given)}: expected complex numbers") from None
    if not np.isfinite(values).all():
        raise ValueError(f"{name}={check.shown(given)}: expected finite numbers")
    return values
