"""What all kinds of data have in common: measurements on a curve of solutions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance import Evaluation, HarmonicBalance, SecondOrder
from symhbm.design.identification.observations import Rows
from symhbm.numerics import RADIANS, FloatArray, check


@dataclass(frozen=True, eq=False)
class Solved(ABC):
    """A solution that measurements are of, at ``omega`` [rad/s]; sensors read its ``state``.

    ``evaluation`` is the balance there; the state begins with the unknowns.
    """

    problem: HarmonicBalance
    omega: float
    state: FloatArray
    evaluation: Evaluation

    @property
    def motion(self) -> FloatArray:
        """The unknowns [m]."""
        return self.state[: self.problem.n_unknowns]

    @property
    def margins(self) -> FloatArray:
        """Margins of the switches of its contacts, (n_switches,)."""
        return self.evaluation.states.margins

    @abstractmethod
    def move(self, own: FloatArray) -> FloatArray:
        """Derivatives (n_state, n) of the state, parameters moving by ``own`` (n_balanced, n)."""

    @abstractmethod
    def bend(self, pull: FloatArray, own: FloatArray, bends: FloatArray) -> FloatArray:
        """Second derivatives (n, n) of ``pull @ state``, ``own`` bending by (n_balanced, n, n)."""


Nearby = Sequence[tuple[Solved, FloatArray]]
"""Solutions where variables are a little different, and the states that they predict, if known."""


class Reading(NamedTuple):
    """What a row reads of a state: ``seen`` (2, n_state) are cosine and sine of a motion.

    The ``part`` of it (real, imaginary, magnitude or phase), after ``power`` derivatives by the
    time, by a sensor or as it is; ``reach`` is the most that may be read, of a motion of 1 m where
    it is ``of_motion``.
    """

    seen: FloatArray
    part: str
    reach: float
    power: int = 0
    by_sensor: bool = True

    @property
    def of_motion(self) -> bool:
        """Whether it grows with the motion."""
        return self.by_sensor and self.part != "phase"

    @classmethod
    def entry(cls, size: int, place: int, factor: float, reach: float) -> Reading:
        """One entry of a state of some ``size``, times a factor, that no sensor changes."""
        seen = np.zeros((2, size))
        seen[0, place] = factor
        return cls(seen, "real", reach, by_sensor=False)


@dataclass
class Work:
    """What solutions share: derivatives by parameters ``names``, compiled once, and counts."""

    names: tuple[str, ...]
    n_solved: int = 0
    n_iterations: int = 0
    _orders: dict[int, SecondOrder] = field(default_factory=dict)

    def order(self, problem: HarmonicBalance) -> SecondOrder:
        """Second derivatives of all copies of a problem."""
        key = id(problem.equations)
        if key not in self._orders:
            self._orders[key] = SecondOrder(problem, self.names)
        return self._orders[key]


class Members(NamedTuple):
    """The ``numbers`` of rows of one curve, of a ``problem`` under one setting of a test.

    ``names`` are parameters that a fit changes, of all sectors together where ``alike``.
    """

    rows: Rows
    numbers: NDArray[np.intp]
    problem: HarmonicBalance
    setting: dict[str, Any]
    names: Sequence[str]
    alike: bool


@dataclass(frozen=True, eq=False)
class Curve(ABC):
    """Measurements of one kind under one ``setting`` of a test, in the order of the test.

    Each solution is asked for at a ``given`` value and was measured at ``omegas`` [rad/s]; ``rows``
    are those of each, ``read`` what each row reads of it.
    """

    forms: ClassVar[tuple[str, ...]]
    """Forms of measurements that are of this kind."""
    problem: HarmonicBalance
    setting: dict[str, Any]
    sweep: str
    given: list[Any]
    omegas: FloatArray
    rows: list[NDArray[np.intp]]
    read: dict[int, Reading]

    @staticmethod
    @abstractmethod
    def asked(rows: Rows, i: int) -> tuple[Any, Any]:
        """What rows of one curve have in common, and what the solution of a row is asked for at."""

    @classmethod
    @abstractmethod
    def of(cls, members: Members) -> Self:
        """The curve of some rows; raises for what the problem does not have."""

    @abstractmethod
    def solve(self, problem: HarmonicBalance, nearby: Nearby, work: Work) -> list[Any]:
        """The solutions of a problem; ArithmeticError where one is not found."""

    @property
    def followed(self) -> bool:
        """Whether solutions may jump, so that they are followed as the test led them."""
        return False

    @property
    def band(self) -> tuple[float, float] | None:
        """Frequencies [Hz] that the response of a fit is followed over; None for no response."""
        return float(self.omegas.min()) / RADIANS, float(self.omegas.max()) / RADIANS

    @property
    def alone(self) -> dict[str, Any]:
        """What `symhbm.nonlinear_modes` is asked for where a fit is of no response."""
        return {}

    @classmethod
    def _from(cls, members: Members, problem: Any, read: dict[int, Reading], *own: Any) -> Self:
        """The curve with its rows in order; values measured again are those of one solution."""
        rows, numbers = members.rows, members.numbers
        order = numbers[np.argsort(rows.omega[numbers], kind="stable")]
        sweep = str(rows.sweep[numbers[0]])
        if sweep == "down":
            order = order[::-1]
        at: dict[str, list[int]] = {}
        for i in order.tolist():
            at.setdefault(str(cls.asked(rows, i)[1]), []).append(i)
        each = [np.array(one) for one in at.values()]
        first = [one[0] for one in each]
        asked = [cls.asked(rows, i)[1] for i in first]
        return cls(problem, members.setting, sweep, asked, rows.omega[first], each, read, *own)


def at_place(place: str) -> Any:
    """The number or the name of a place."""
    return int(place) if place.isdecimal() else place


class Sensor(NamedTuple):
    """What is read where: a quantity at a place, of a harmonic, in some units."""

    place: str
    quantity: str
    harmonic: int
    units: str

    @classmethod
    def of(cls, rows: Rows, i: int) -> Sensor:
        """That of a row."""
        return cls(rows.place[i], rows.quantity[i], int(rows.harmonic[i]), str(rows.units[i]))

    @property
    def power(self) -> int:
        """Of ``i harmonic omega``, which makes the quantity of what `row` reads."""
        return _POWERS.get(self.quantity, 0)

    def reach(self, rows: Rows, i: int) -> float:
        """What it reads at most of a motion of 1 m."""
        return float((self.harmonic * rows.omega[i]) ** self.power)

    def row(self, problem: HarmonicBalance) -> Any:
        """What it reads of displacements, a sparse row; raises for what there is not."""
        model, at = problem.model, at_place(self.place)
        if self.harmonic not in problem.harmonics:
            raise ValueError(
                f"harmonic={self.harmonic}: expected one of those of the problem, "
                f"{problem.harmonics}"
            )
        if self.quantity in _POWERS:
            model.number_of(at)  # tells of places that are not there
            return model.with_outputs({"sensor": {at: 1.0}}, "m").outputs["sensor"].rows
        check.known(self.quantity, model.outputs, "output of the model (quantity)")
        output = model.outputs[self.quantity]
        if self.units not in (output.units, "rad", "Hz"):
            raise ValueError(
                f"units={self.units!r}: expected those of {self.quantity}, {output.units!r}"
            )
        n_rows = output.rows.shape[0]
        if not isinstance(at, int) or at >= n_rows:
            raise ValueError(
                f"place={self.place!r}: expected a row of {self.quantity}, from 0 to {n_rows - 1}"
            )
        return sp.csr_array(output.rows)[[at]]


_POWERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
