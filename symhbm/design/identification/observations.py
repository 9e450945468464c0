"""What was measured, rows of numbers, and what sensors read of motions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import casadi as ca
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.numerics import RADIANS, Compiled, FloatArray, check
from symhbm.results.reading import MEASURED

KNOWN = "measured_at_"
"""Beginning of the names of parameters that were set in the test."""


@dataclass(frozen=True)
class Rows:
    """Measurements in a ``table`` of columns (n_rows,); ``known`` are the parameters set in tests.

    ``kept`` are the rows that are fitted.
    """

    table: dict[str, np.ndarray]
    known: tuple[str, ...]

    @classmethod
    def of(cls, data: Any) -> Rows:
        """The rows of a dataset of measurements or of several; raises for anything else."""
        several = data if isinstance(data, (list, tuple)) else [data]
        for one in several:
            if not isinstance(one, xr.Dataset) or MEASURED not in one.variables:
                raise TypeError(
                    f"data={check.shown(one)}: expected a dataset of symhbm.datasets.measured, or "
                    "several in a list"
                )
        if not several:
            raise ValueError("data: expected at least one dataset of measurements, got none")
        names = [str(name) for one in several for name in one.variables]
        columns = [n for n in dict.fromkeys(names) if n.startswith("measured_")]
        table = {}
        for name in columns:
            parts = [
                one[name].values if name in one else np.full(one.sizes["measurement"], np.nan)
                for one in several
            ]
            table[name] = np.concatenate(parts)
        known = tuple(n.removeprefix(KNOWN) for n in columns if n.startswith(KNOWN))
        rows = cls(table, known)
        if not rows.kept.any():
            raise ValueError("data: expected values that are not left out, all of them are")
        return rows

    def __getattr__(self, name: str) -> Any:
        try:
            return self.table[f"measured_{name}"]
        except KeyError:
            raise AttributeError(name) from None

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.value)

    @cached_property
    def kept(self) -> NDArray[np.bool_]:
        """Which rows are fitted, (n_rows,)."""
        return self.left_out == 0

    @cached_property
    def omega(self) -> FloatArray:
        """Angular frequencies [rad/s]."""
        return RADIANS * self.frequency

    @property
    def sensors(self) -> list[str]:
        """The different places."""
        return list(dict.fromkeys(self.place.tolist()))

    @cached_property
    def has_noise(self) -> bool:
        """Whether standard deviations are known; ValueError where some are and some are not."""
        known = np.isfinite(self.deviation[self.kept])
        if known.any() != known.all():
            raise ValueError("deviation: expected one of all measurements or of none, some have it")
        if not known.any() and len({*self.units[self.kept]}) > 1:
            raise ValueError(
                "deviation: expected standard deviations, as measurements of several units "
                f"({', '.join(sorted({*self.units[self.kept]}))}) have none in common"
            )
        return bool(known.all())

    @cached_property
    def scales(self) -> FloatArray:
        """What residuals are over, (n_rows,): standard deviations, or the size of all values."""
        if self.has_noise:
            return np.where(np.isfinite(self.deviation), self.deviation, 1.0)
        size = float(np.sqrt(np.mean(self.value[self.kept] ** 2)))
        return np.full(self.n, size or 1.0)

    def settings(self, problem: HarmonicBalance) -> list[dict[str, Any]]:
        """Parameters that were set in the test, row by row; raises for what is none."""
        columns = {}
        for said in self.known:
            name = problem.parameter_name(said)
            nominal, values = problem.parameters[name], self.table[KNOWN + said]
            if isinstance(nominal, int):
                usual: Any = nominal
                columns[name] = [int(v) if np.isfinite(v) else usual for v in values]
                continue
            columns[name] = [float(v) if np.isfinite(v) else None for v in values]
        return [
            {n: column[i] for n, column in columns.items() if column[i] is not None}
            for i in range(self.n)
        ]


_FORMS = ("real", "imaginary", "magnitude", "phase")


@cache
def _reading() -> Compiled:
    """All forms of a reading with derivatives, by cosine, sine, gain, phase and delay (5,)."""
    by, turning, power = ca.SX.sym("by", 5), ca.SX.sym("turning"), ca.SX.sym("power")
    cosine, sine, gain, phase, delay = ca.vertsplit(by)
    turned, size = phase - turning * delay + power * ca.pi / 2, gain * turning**power
    # The reading is (cosine - i sine) size exp(i turned).
    real = size * (cosine * ca.cos(turned) + sine * ca.sin(turned))
    imaginary = size * (cosine * ca.sin(turned) - sine * ca.cos(turned))
    magnitude = size * ca.sqrt(cosine**2 + sine**2)
    forms = ca.vertcat(real, imaginary, magnitude, ca.atan2(imaginary, real))
    slopes = ca.jacobian(forms, by)
    # Transposed: CasADi stores columns one after the other.
    outputs = [forms, slopes.T, ca.jacobian(ca.vec(slopes.T), by).T]
    return Compiled(ca.Function("reading", [by, turning, power], [*map(ca.densify, outputs)]))


def readings(
    parts: FloatArray, sensors: FloatArray, turning: FloatArray, power: FloatArray, form: np.ndarray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values (n_rows,) that rows should have, with first (.., 5) and second derivatives (.., 5, 5).

    By cosine and sine of the motion, ``parts`` (n_rows, 2), and gain, phase and delay, ``sensors``
    (n_rows, 3); ``turning`` [rad/s] is the angular frequency of its harmonic, ``power`` how many
    derivatives by the time are read. A motion of 0 has neither a phase nor a slope of its
    magnitude: they are 0.
    """
    n, every = len(parts), np.arange(len(parts))
    by = np.column_stack([parts, sensors])
    found = _reading().at_points(n, by, turning[:, None], power[:, None])
    which = np.array([_FORMS.index(one) for one in form.tolist()])
    shapes = (n, 4), (n, 4, 5), (n, 4, 5, 5)
    values, first, second = (
        np.nan_to_num(part.reshape(shape)[every, which])
        for part, shape in zip(found, shapes, strict=True)
    )
    return values, first, second
