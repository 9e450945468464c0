"""Periodic forces: at a point, the travelling wave of an engine order, or any harmonic pattern."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from symhbm.model.excitation.excitation import Excitation, check_contained
from symhbm.model.excitation.static_load import one_each
from symhbm.numerics import FloatArray, FourierBasis, check, check_harmonics


@dataclass(frozen=True)
class PointForce(Excitation):
    """Force ``amplitude cos(harmonic omega t + phase)`` on one degree of freedom [N, rad]."""

    dof: int = 0
    amplitude: float = 1.0
    phase: float = 0.0
    harmonic: int = 1

    def __post_init__(self):
        put = object.__setattr__
        put(self, "dof", check.integer("dof", self.dof, 0))
        put(self, "amplitude", check.scalar("amplitude", self.amplitude))
        put(self, "phase", check.scalar("phase", self.phase))
        put(self, "harmonic", check.integer("harmonic", self.harmonic, 1))

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if out of range."""
        check_contained(self.harmonic, basis)
        check.integer("dof", self.dof, 0, n_dof - 1)
        shape = np.zeros((n_dof, basis.n_components))
        shape[self.dof, basis.component(self.harmonic)] = np.cos(self.phase)
        shape[self.dof, basis.component(self.harmonic, sine=True)] = -np.sin(self.phase)
        return shape


@dataclass(frozen=True)
class EngineOrder(Excitation):
    """Travelling wave ``amplitude cos(harmonic omega t - 2 pi order i / N)`` on blade i, Eq. (12).

    This is how the source's Eq. (12) is read. As printed it has no time, and its cosine and sine
    add up to an amplitude of ``sqrt(2) f0``; as forces in phase they would move tuned blades
    differently.

    ``blades`` lists the degrees of freedom of the N blades in their order around the disk; by
    default all degrees of freedom. Orders ``order`` and ``order + N`` are the same force.
    """

    order: int
    amplitude: float = 1.0
    blades: Sequence[int] | None = None
    harmonic: int = 1

    _fields: ClassVar = {"force_amplitude": "amplitude", "engine_order": "order"}

    def __post_init__(self):
        put = object.__setattr__
        put(self, "order", check.integer("engine_order", self.order))
        put(self, "amplitude", check.scalar("amplitude", self.amplitude))
        put(self, "harmonic", check.integer("harmonic", self.harmonic, 1))
        if self.blades is not None:
            if isinstance(self.blades, str) or not isinstance(self.blades, Iterable):
                raise TypeError(f"blades={check.shown(self.blades)}: expected a sequence of DOFs")
            blades = tuple(check.integer("blades", dof, 0) for dof in self.blades)
            if not blades or len(set(blades)) != len(blades):
                raise ValueError(f"blades={check.shown(self.blades)}: expected distinct DOFs")
            put(self, "blades", blades)

    @property
    def speed_ratios(self) -> frozenset[float]:
        """``order / harmonic``; none of order 0, which does not tell how fast it turns."""
        return frozenset({abs(self.order) / self.harmonic} if self.order else ())

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if out of range."""
        check_contained(self.harmonic, basis)
        blades = list(range(n_dof)) if self.blades is None else list(self.blades)
        check.integer("blades", max(blades), 0, n_dof - 1)
        # Reduced in integers first, so that aliased orders give the same force to the bit.
        count = len(blades)
        turns = (self.order % count * np.arange(count)) % count / count
        shape = np.zeros((n_dof, basis.n_components))
        shape[blades, basis.component(self.harmonic)] = np.cos(2 * np.pi * turns)
        shape[blades, basis.component(self.harmonic, sine=True)] = np.sin(2 * np.pi * turns)
        return shape


@dataclass(frozen=True)
class HarmonicForce(Excitation):
    """Any force: ``amplitude sum_n cosine[n] cos(n omega t) + sine[n] sin(n omega t)``.

    ``cosine`` and ``sine`` map a harmonic to one coefficient per degree of freedom, dimensionless
    where ``amplitude`` is in N. ``amplitude cosine[0]`` does not oscillate: it becomes the ``mean``
    [N], one value per degree of freedom, which stays as it is when ``force_amplitude`` changes.

    Examples
    --------
    Unit force on the first of two degrees of freedom, and a tenth of it at the third harmonic:

    >>> import symhbm as sh
    >>> force = sh.HarmonicForce(cosine={1: [1, 0]}, sine={3: [0.1, 0]}, amplitude=2.0)
    """

    cosine: Mapping[int, ArrayLike] = field(default_factory=dict)
    sine: Mapping[int, ArrayLike] = field(default_factory=dict)
    amplitude: float = 1.0
    mean: ArrayLike | None = None

    def __post_init__(self):
        put = object.__setattr__
        put(self, "amplitude", check.scalar("amplitude", self.amplitude))
        for name in ("cosine", "sine"):
            given = getattr(self, name)
            if not isinstance(given, Mapping):
                raise TypeError(f"{name}={check.shown(given)}: expected a mapping from harmonics")
            table = {}
            for harmonic, values in given.items():
                harmonic = check.integer(f"harmonic of {name}", harmonic, int(name == "sine"))
                row = np.atleast_1d(check.array(f"{name}[{harmonic}]", values))
                if row.ndim != 1:
                    raise ValueError(
                        f"{name}[{harmonic}]={check.shown(values)}: expected one value per DOF"
                    )
                table[harmonic] = tuple(row.tolist())
            put(self, name, table)
        if not self.cosine and not self.sine and self.mean is None:
            raise ValueError("cosine={}, sine={}: expected at least one harmonic")
        check_harmonics({*self.cosine, *self.sine, 1})
        mean = self.mean
        if 0 in self.cosine:
            if mean is not None:
                raise ValueError(f"mean={check.shown(mean)}: expected None beside cosine[0]")
            # The table is this force's own.
            mean = self.amplitude * np.array(self.cosine.pop(0))  # type: ignore[attr-defined]
        if mean is not None:
            put(self, "mean", tuple(np.atleast_1d(check.array("mean", mean)).tolist()))

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if they misfit."""
        shape = np.zeros((n_dof, basis.n_components))
        for name, table in (("cosine", self.cosine), ("sine", self.sine)):
            for harmonic, row in table.items():
                check_contained(harmonic, basis)
                values = one_each(f"{name}[{harmonic}]", row, n_dof)  # type: ignore[arg-type]
                shape[:, basis.component(harmonic, name == "sine")] = values
        return shape

    def static(self, n_dof: int) -> FloatArray:
        """The mean, ``(n_dof,)`` [N]; ValueError if it misfits."""
        if self.mean is None:
            return super().static(n_dof)
        return one_each("mean", self.mean, n_dof)  # type: ignore[arg-type]
