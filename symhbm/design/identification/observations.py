"""What was measured: rows of numbers, the curves that they are on, and what a sensor sees there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
import xarray as xr
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.numerics import RADIANS, FloatArray, check
from symhbm.results.reading import MEASURED

POWERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Powers of ``i harmonic omega`` that make a quantity of displacements."""
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
        power = np.array([POWERS.get(quantity, 0) for quantity in self.quantity[chosen]])
        reach = size * (self.harmonic[chosen] * self.omega[chosen]) ** power
        return np.where(self.form[chosen] == "phase", 1.0, reach)

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


@dataclass(frozen=True)
class Curve:
    """Measurements under one setting of a test: frequencies ``omegas`` [rad/s] in its order.

    ``rows`` are those of each frequency, ``seen`` what the sensor of each row reads of the
    unknowns of the ``problem``: cosine and sine of a harmonic, (2, n_unknowns).
    """

    problem: HarmonicBalance
    setting: dict[str, Any]
    sweep: str
    omegas: FloatArray
    rows: list[NDArray[np.intp]]
    seen: dict[int, FloatArray]

    @property
    def followed(self) -> bool:
        """Whether the response may jump, so that it is followed as the test led it."""
        return not self.problem.single_valued


def curves_of(
    problem: HarmonicBalance, rows: Rows, names: Sequence[str], alike: bool
) -> list[Curve]:
    """The curves of all measurements; ``names`` are parameters that a fit changes.

    ``alike`` tells that it changes them of all sectors together.
    """
    settings = rows.settings(problem)
    for name in dict.fromkeys(name for one in settings for name in one):
        if name in names:
            raise ValueError(
                f"unknown[{name!r}]: expected a parameter that is not given with the data"
            )
    keys = [(*one.items(), rows.sweep[i]) for i, one in enumerate(settings)]
    curves = []
    for key in dict.fromkeys(keys):
        members = np.array([i for i, one in enumerate(keys) if one == key])
        base = problem.with_parameters(**settings[members[0]])
        unique = base.single_valued and not problem.may_fold(names)
        symmetry = base.equal_sectors if alike and unique and base.samples is None else None
        base = base if symmetry is None else base.of_sector(symmetry)
        sweep = str(key[-1])
        omegas = np.unique(rows.omega[members])[:: -1 if sweep == "down" else 1]
        at = [members[rows.omega[members] == omega] for omega in omegas]
        sensors = {
            i: (rows.place[i], rows.quantity[i], int(rows.harmonic[i]), str(rows.units[i]))
            for i in members.tolist()
        }
        read = {sensor: _read(base, *sensor) for sensor in dict.fromkeys(sensors.values())}
        seen = {i: read[sensor] for i, sensor in sensors.items()}
        curves.append(Curve(base, settings[members[0]], sweep, omegas, at, seen))
    return curves


def _read(
    problem: HarmonicBalance, place: str, quantity: str, harmonic: int, units: str
) -> FloatArray:
    """Cosine and sine of a harmonic that a sensor reads of the unknowns, (2, n_unknowns).

    Raises KeyError or ValueError for what the problem does not have.
    """
    model, basis = problem.model, problem.basis
    if harmonic not in problem.harmonics:
        raise ValueError(
            f"harmonic={harmonic}: expected one of those of the problem, {problem.harmonics}"
        )
    at: Any = int(place) if place.isdecimal() else place
    if quantity in POWERS:
        row = model.with_outputs({"sensor": {at: 1.0}}, "m").outputs["sensor"].rows
    else:
        check.known(quantity, model.outputs, "output of the model (quantity)")
        output = model.outputs[quantity]
        if units not in (output.units, "rad"):
            raise ValueError(f"units={units!r}: expected those of {quantity}, {output.units!r}")
        n_rows = output.rows.shape[0]
        if not isinstance(at, int) or at >= n_rows:
            raise ValueError(
                f"place={place!r}: expected a row of {quantity}, from 0 to {n_rows - 1}"
            )
        row = sp.csr_array(output.rows)[[at]]
    parts = np.zeros((2, basis.n_components))
    parts[0, basis.component(harmonic)] = 1.0
    if harmonic:
        parts[1, basis.component(harmonic, sine=True)] = 1.0
    return np.asarray((sp.kron(row, parts) @ problem.layout.expansion).todense())


def readings(
    rows: Rows, at: Iterable[int], parts: FloatArray, sensors: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values (k,) that rows should have, with first (k, 5) and second derivatives (k, 5, 5).

    By cosine and sine of the motion, ``parts`` (k, 2), and gain, phase and delay, ``sensors``
    (k, 3).
    """
    chosen = np.fromiter(at, dtype=int)
    order, omega = rows.harmonic[chosen], rows.omega[chosen]
    power = np.array([POWERS.get(quantity, 0) for quantity in rows.quantity[chosen]])
    gain, phase, delay = sensors.T
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
    for name, parts in values.items():
        which = form == name
        for target, part in zip(result, parts, strict=True):
            target[which] = part[which]
    return result
