"""The curves that measurements are on, and what a sensor sees of their solutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance, matrices_in
from symhbm.balance.goals import Goal, Solution
from symhbm.design.identification.observations import POWERS, Rows
from symhbm.numerics import RADIANS, FloatArray, check
from symhbm.response.unforced import free_problem
from symhbm.results import Request


@dataclass(frozen=True)
class Curve:
    """Measurements under one setting of a test: frequencies ``omegas`` [rad/s] in its order.

    ``kind`` is that of its solutions, ``given`` what each is asked for at. ``rows`` are those of
    each, ``seen`` what the sensor of each row reads of the state of a solution: cosine and sine of
    a harmonic, (2, n_state). ``mode`` are the number and the degree of freedom of one.
    """

    problem: HarmonicBalance
    setting: dict[str, Any]
    sweep: str
    kind: str
    given: list[Any]
    omegas: FloatArray
    rows: list[NDArray[np.intp]]
    seen: dict[int, FloatArray]
    mode: tuple[int, int | None] = (0, None)

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
    keys = [(*one.items(), rows.sweep[i], rows.kind(i)) for i, one in enumerate(settings)]
    curves = []
    for key in dict.fromkeys(keys):
        members = np.array([i for i, one in enumerate(keys) if one == key])
        base, (kind, *own), sweep = (
            problem.with_parameters(**settings[members[0]]),
            key[-1],
            key[-2],
        )
        order = members[np.argsort(rows.omega[members], kind="stable")]
        if kind == "response" and sweep == "down":
            order = order[::-1]
        # Values that are measured again are those of one solution.
        given = {i: str(rows.given(i)) for i in order.tolist()}
        at = [
            order[[given[i] == one for i in order.tolist()]]
            for one in dict.fromkeys(given.values())
        ]
        mode = 0, None
        if kind == "response":
            unique = base.single_valued and not base.may_fold(names)
            symmetry = base.equal_sectors if alike and unique and base.samples is None else None
            base = base if symmetry is None else base.of_sector(symmetry)
            sensors = {
                i: (rows.place[i], rows.quantity[i], int(rows.harmonic[i]), str(rows.units[i]))
                for i in members.tolist()
            }
            read = {sensor: _read(base, *sensor) for sensor in dict.fromkeys(sensors.values())}
            seen = {i: read[sensor] for i, sensor in sensors.items()}
        elif kind == "peak":
            base = base.with_peaks_of(SensorAmplitude.of(base, *own))
            places = {"peak_amplitude": (0, 1.0), "peak_frequency": (1, 1 / RADIANS)}
            seen = {i: _entry(2, *places[rows.form[i]]) for i in members.tolist()}
        else:
            base, mode = _free(base, names, alike, *own)
            n = base.n_unknowns
            places = {"mode_frequency": (n, 1 / RADIANS), "mode_damping": (n + 1, 1.0)}
            seen = {i: _entry(n + 2, *places[rows.form[i]]) for i in members.tolist()}
        asked, omegas = [rows.given(one[0]) for one in at], rows.omega[[one[0] for one in at]]
        of_test = settings[members[0]], str(sweep)
        curves.append(Curve(base, *of_test, kind, asked, omegas, at, seen, mode))
    return curves


def _entry(size: int, place: int, factor: float) -> FloatArray:
    """Rows that read one entry of a state, (2, size)."""
    rows = np.zeros((2, size))
    rows[0, place] = factor
    return rows


def _free(
    problem: HarmonicBalance,
    names: Sequence[str],
    alike: bool,
    mode: int,
    place: str,
    nodal_diameter: int | None,
) -> tuple[HarmonicBalance, tuple[int, int | None]]:
    """The problem without a force in the wave of a mode, its number and degree of freedom."""
    for name in names:
        values = np.asarray(problem.parameters[name], dtype=float)
        other = problem.with_parameters(**{name: 1.1 * values})
        if abs(matrices_in(problem, 1).mass_matrix - matrices_in(other, 1).mass_matrix).max() > 0:
            raise ValueError(
                f"unknown[{name!r}]: expected a parameter that does not change the mass matrix, "
                "which the damping of modes is measured by"
            )
    if nodal_diameter is not None and not alike:
        raise ValueError("nodal_diameter: expected unknowns that are alike on all sectors")
    number = problem.model.number_of(at_place(place))
    asked: Any = dict(
        unforced="nonlinear mode", mode=mode, nodal_diameter=nodal_diameter, dof=number
    )
    alone, dof, _ = free_problem(problem, Request("amplitude", (1.0, 1.0), **asked))
    return alone, (mode, dof)


def at_place(place: str) -> Any:
    """The number or the name of a place."""
    return int(place) if place.isdecimal() else place


def _row(problem: HarmonicBalance, place: str, quantity: str, harmonic: int, units: str) -> Any:
    """What a sensor reads of displacements, a sparse row; raises for what there is not."""
    model, at = problem.model, at_place(place)
    if harmonic not in problem.harmonics:
        raise ValueError(
            f"harmonic={harmonic}: expected one of those of the problem, {problem.harmonics}"
        )
    if quantity in POWERS:
        return model.with_outputs({"sensor": {at: 1.0}}, "m").outputs["sensor"].rows
    check.known(quantity, model.outputs, "output of the model (quantity)")
    output = model.outputs[quantity]
    if units not in (output.units, "rad", "Hz"):
        raise ValueError(f"units={units!r}: expected those of {quantity}, {output.units!r}")
    n_rows = output.rows.shape[0]
    if not isinstance(at, int) or at >= n_rows:
        raise ValueError(f"place={place!r}: expected a row of {quantity}, from 0 to {n_rows - 1}")
    return sp.csr_array(output.rows)[[at]]


def _read(
    problem: HarmonicBalance, place: str, quantity: str, harmonic: int, units: str
) -> FloatArray:
    """Cosine and sine of a harmonic that a sensor reads of the unknowns, (2, n_unknowns)."""
    row, basis = _row(problem, place, quantity, harmonic, units), problem.basis
    parts = np.zeros((2, basis.n_components))
    parts[0, basis.component(harmonic)] = 1.0
    if harmonic:
        parts[1, basis.component(harmonic, sine=True)] = 1.0
    return np.asarray((sp.kron(row, parts) @ problem.layout.expansion).todense())


@dataclass(frozen=True, repr=False)
class SensorAmplitude(Goal):
    """Amplitude of a ``harmonic`` of what a sensor reads, ``weights`` of degrees of freedom.

    The reading is the derivative of order ``power`` by the time.
    """

    units: ClassVar[str] = "1"
    meaning: ClassVar[str] = "amplitude of a harmonic of what a sensor reads"
    weights: tuple[tuple[int, float], ...]
    harmonic: int
    power: int

    @classmethod
    def of(cls, problem: HarmonicBalance, sensor: tuple[Any, ...]) -> SensorAmplitude:
        """That of a place, a quantity, a harmonic and units."""
        row = sp.coo_array(_row(problem, *sensor))
        weights = zip(row.coords[1].tolist(), row.data.tolist(), strict=True)
        return cls(tuple(weights), sensor[2], POWERS.get(sensor[1], 0))

    def value(self, at: Solution) -> Any:
        """As of any goal."""
        parts = [
            sum(
                weight * at.coefficients[at.basis.component(self.harmonic, sine), dof]
                for dof, weight in self.weights
            )
            for sine in (False, True)
        ]
        return (self.harmonic * at.frequency) ** self.power * ca.sqrt(parts[0] ** 2 + parts[1] ** 2)
