"""What was measured, rows of numbers, and what sensors read of motions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.numerics import RADIANS, FloatArray, check
from symhbm.results.reading import MEASURED

POWERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Powers of ``i harmonic omega`` that make a quantity of displacements."""
OF_PEAKS, OF_MODES = ("peak_frequency", "peak_amplitude"), ("mode_frequency", "mode_damping")
"""Forms of what peaks, and nonlinear modes, are told by."""
_BY_ITSELF = "peak_frequency", *OF_MODES
"""Forms that no sensor changes."""
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

    def reach(self, chosen: NDArray[np.intp], size: float) -> FloatArray:
        """What sensors read of a motion [m] as large as ``size``, of phases one radian."""
        turning = self.harmonic[chosen] * self.omega[chosen]
        reach = size * turning ** self.powers(chosen, ("peak_frequency", *OF_MODES))
        reach[np.isin(self.form[chosen], ("phase", "mode_damping"))] = 1.0
        of_frequency = np.isin(self.form[chosen], ("peak_frequency", "mode_frequency"))
        return np.where(of_frequency, self.frequency[chosen], reach)

    def powers(self, chosen: NDArray[np.intp], but: Sequence[str]) -> NDArray[np.intp]:
        """Powers of the frequency that make what is read of displacements, 0 of some forms."""
        powers = np.array([POWERS.get(quantity, 0) for quantity in self.quantity[chosen]])
        return np.where(np.isin(self.form[chosen], but), 0, powers)

    def kind(self, i: int) -> tuple[Any, ...]:
        """What a row is of: a response, the peaks of a sensor, or a mode and its amplitudes."""
        if self.form[i] in OF_PEAKS:
            sensor = self.place[i], self.quantity[i], int(self.harmonic[i]), str(self.units[i])
            return "peak", sensor
        if self.form[i] not in OF_MODES:
            return ("response",)
        nodal_diameter = self.nodal_diameter[i]
        wave = None if np.isnan(nodal_diameter) else int(nodal_diameter)
        return "mode", int(self.mode[i]), self.place[i], wave

    def given(self, i: int) -> Any:
        """What a solution is asked for at: a frequency [rad/s], a band [Hz], or an amplitude."""
        if self.form[i] in OF_PEAKS:
            return float(self.lowest[i]), float(self.highest[i])
        return float(self.amplitude[i] if self.form[i] in OF_MODES else self.omega[i])

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


def readings(
    rows: Rows, at: Iterable[int], parts: FloatArray, sensors: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values (k,) that rows should have, with first (k, 5) and second derivatives (k, 5, 5).

    By cosine and sine of the motion, ``parts`` (k, 2), and gain, phase and delay, ``sensors``
    (k, 3).
    """
    chosen = np.fromiter(at, dtype=int)
    order, omega = rows.harmonic[chosen], rows.omega[chosen]
    power = rows.powers(chosen, (*OF_PEAKS, *OF_MODES))
    itself = np.isin(rows.form[chosen], _BY_ITSELF)
    gain, phase, delay = np.where(itself[:, None], [1.0, 0.0, 0.0], sensors).T
    turned = (1j * order * omega) ** power * np.exp(1j * (phase - order * omega * delay))
    motion = (parts[:, 0] - 1j * parts[:, 1]) * turned
    # The reading is gain times motion; each rate is a factor of it or of the turned unit.
    rates = np.stack([1j * np.ones(len(gain)), -1j * order * omega], axis=1)
    first = np.zeros((len(gain), 5), complex)
    first[:, 0], first[:, 1], first[:, 2] = gain * turned, -1j * gain * turned, motion
    whole = gain * motion
    first[:, 3:] = whole[:, None] * rates
    second = np.zeros((len(gain), 5, 5), complex)
    for i in (0, 1, 2):
        second[:, i, 3:] = first[:, i, None] * rates
        second[:, 3:, i] = second[:, i, 3:]
    for i, by_part in enumerate((turned, -1j * turned)):
        second[:, i, 2] = second[:, 2, i] = by_part
    second[:, 3:, 3:] = whole[:, None, None] * rates[:, :, None] * rates[:, None, :]
    first[itself, 2:], second[itself] = 0.0, 0.0
    return _of_form(rows.form[chosen], whole, first, second)


def _of_form(
    form: np.ndarray, whole: Any, first: Any, second: Any
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Real part, imaginary part, magnitude or phase of complex readings, with derivatives."""
    safe = np.where(whole == 0, 1.0, whole)
    size = np.abs(safe)
    relative = first / safe[:, None]
    of_log = second / safe[:, None, None] - relative[:, :, None] * relative[:, None, :]
    # The logarithm of a reading has the logarithm of its size and its phase as parts.
    growth = relative.real
    of_size = size[:, None, None] * (of_log.real + growth[:, :, None] * growth[:, None, :])
    values = {
        "real": (whole.real, first.real, second.real),
        "imaginary": (whole.imag, first.imag, second.imag),
        "magnitude": (np.abs(whole), size[:, None] * growth, of_size),
        "phase": (np.angle(whole), relative.imag, of_log.imag),
    }
    result = tuple(np.zeros_like(part) for part in values["real"])
    of_forms = dict.fromkeys(_BY_ITSELF, "real") | {"peak_amplitude": "magnitude"}
    named = np.array([of_forms.get(one, one) for one in form])
    for name, parts in values.items():
        which = named == name
        for target, part in zip(result, parts, strict=True):
            target[which] = part[which]
    return result
