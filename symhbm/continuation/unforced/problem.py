"""Continuation of periodic motions that no force drives: their frequency is unknown as well.

A free motion may begin at any instant of its period, so that one equation, its phase, is added with
the one unknown. How to use it: derive from `UnforcedProblem`, add to its `balance` what acts beside
it, tell by how many more unknowns and with which `conditions` it is closed, and follow it with
`symhbm.continuation.path.Path`, or with `follow_with`, from any solution; onsets and ends of slip,
openings and folds become events of the path as they do on a frequency response. `LimitCycleProblem`
needs nothing but the balance, `NonlinearModeProblem` adds a damping ratio and an amplitude.

Limit cycles take as much energy from the structure as they give to it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import Evaluation, HarmonicBalance
from symhbm.continuation.problem import ContinuationProblem, ParameterProblem
from symhbm.numerics import FloatArray, bordered, length_of


class Balanced(NamedTuple):
    """The balance at one point, its conditions apart.

    ``evaluation``, with the derivative by the frequency for that by the parameter; ``by_more``, the
    derivatives (n_coefficients,) by each further unknown; ``by_value`` (n_coefficients,), that by
    the moving parameter, and ``margins_by_value`` (n_switches,) those of the margins.
    """

    evaluation: Evaluation
    by_more: tuple[FloatArray, ...]
    by_value: FloatArray
    margins_by_value: FloatArray | float = 0.0


class Condition(NamedTuple):
    """One more equation, linear in the coefficients: ``row @ coefficients = level`` [m].

    ``row`` (n_coefficients,); ``by_value``, the derivative of the level by the moving parameter;
    ``unit`` [m], the length that its residual is relative to.
    """

    row: FloatArray
    level: float
    by_value: float
    unit: float


@dataclass(frozen=True)
class UnforcedEvaluation(Evaluation):
    """An `Evaluation` by all unknowns, with the derivatives of margins by the frequency."""

    margins_by_frequency: FloatArray | float = 0.0


class UnforcedProblem(ContinuationProblem):
    """Free motions over one parameter: unknown are coefficients [m], frequency [rad/s], and more.

    ``phase`` (n_coefficients,) tells when the period begins: where ``phase @ coefficients`` is 0.
    It must not vanish along the motion's own shift in time. ``name`` is the named parameter that
    moves, for all blades or contacts at once or for that at ``index`` alone, None where none does;
    lengths along it are relative to no less than ``smallest``. ``more`` are the units of length of
    the further unknowns; as many `conditions` are added. Motions of frequencies up to ``lowest``
    [rad/s] are not looked for.
    """

    driven = False
    single_valued = False
    more: tuple[float, ...] = ()
    lowest: float = 0.0

    def __init__(
        self,
        problem: HarmonicBalance,
        phase: FloatArray,
        name: str | None = None,
        index: int | None = None,
        smallest: float = 0.0,
    ):
        self.problem = problem
        self.phase = phase
        self._parameter = None if name is None else ParameterProblem(problem, name, np.nan, index)
        self.name = None if self._parameter is None else self._parameter.name
        self.smallest = smallest
        self._margins_move = problem.contacts.margins_move

    def problem_at(self, value: float) -> HarmonicBalance:
        """The problem at a value of the parameter; ArithmeticError where it has none."""
        return self.problem if self._parameter is None else self._parameter.at(value)[0]

    def balance(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None
    ) -> Balanced:
        """The balance at unknowns (n_unknowns,); ``switches`` (n_switches,) imposes states."""
        problem, frequency = self.problem_at(value), self.frequency(unknowns)
        motion = unknowns[: problem.n_unknowns]
        evaluation = problem.evaluate(motion, frequency, switches)
        if self._parameter is None:
            return Balanced(evaluation, (), np.zeros(len(motion)))
        along = self._parameter.along(problem, motion, frequency, evaluation)
        return Balanced(evaluation, (), along.by_parameter, along.margins_by_parameter)

    def conditions(self, unknowns: FloatArray, value: float) -> list[Condition]:
        """Equations beside the balance, the phase first."""
        size = length_of(unknowns[: self.problem.n_unknowns]) or 1.0
        return [Condition(self.phase, 0.0, 0.0, size)]

    @property
    def n_unknowns(self) -> int:
        """Number of coefficients, frequency and further unknowns."""
        return self.problem.n_unknowns + 1 + len(self.more)

    def at(self, value: float) -> tuple[HarmonicBalance, float]:
        """TypeError: the frequency is not known from the parameter, `at_point` tells it."""
        raise TypeError("the frequency of an unforced motion is one of its unknowns")

    def at_point(self, point: FloatArray) -> tuple[HarmonicBalance, float]:
        """The problem and the angular frequency at unknowns and parameter (n_unknowns + 1,)."""
        return self.problem_at(float(point[-1])), self.frequency(point)

    def frequency(self, unknowns: FloatArray) -> float:
        """The angular frequency [rad/s] among unknowns."""
        return float(unknowns[self.problem.n_unknowns])

    def evaluate(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None = None
    ) -> UnforcedEvaluation:
        """Residual and derivatives by all unknowns, the conditions behind the balance."""
        n, frequency = self.problem.n_unknowns, self.frequency(unknowns)
        if not frequency > self.lowest:
            raise ArithmeticError(f"no motion of {frequency:g} rad/s is looked for")
        found = self.balance(unknowns, float(value), switches)
        balance, states = found.evaluation, found.evaluation.states
        jacobian, below = balance.jacobian, np.zeros(0)
        columns = balance.by_parameter, *found.by_more
        residual, by_value = [balance.residual], [found.by_value]
        # Rows in the unit of the balance: one tolerance is that of all equations.
        for column, condition in zip(columns, self.conditions(unknowns, value), strict=True):
            weight = balance.magnitude / condition.unit
            distance = condition.row @ unknowns[:n] - condition.level
            row = np.concatenate([weight * condition.row, np.zeros(len(below) + 1)])
            jacobian = bordered(jacobian, np.concatenate([column, below]), row)
            residual.append(np.array([weight * distance]))
            by_value.append(np.array([-weight * condition.by_value]))
            below = np.zeros(len(below) + 1)
        by_frequency: FloatArray | float = 0.0
        if self._margins_move:
            contacts = self.problem_at(float(value)).contacts
            by_frequency = contacts.margin_slopes(states, frequency)[0]
        return UnforcedEvaluation(
            np.concatenate(residual),
            balance.magnitude,
            jacobian,
            np.concatenate(by_value),
            states,
            found.margins_by_value,
            by_frequency,
        )

    def margin_gradient(self, evaluation: Evaluation, switch: int) -> FloatArray:
        """As of any problem, and by the frequency."""
        assert isinstance(evaluation, UnforcedEvaluation)
        row, shape = super().margin_gradient(evaluation, switch), evaluation.states.margins.shape
        by_frequency = np.broadcast_to(evaluation.margins_by_frequency, shape)
        row[self.problem.n_unknowns] = by_frequency[switch]
        return row

    def margin_rate(self, evaluation: Evaluation, direction: FloatArray) -> FloatArray:
        """As of any problem, and by the frequency."""
        assert isinstance(evaluation, UnforcedEvaluation)
        by_frequency = evaluation.margins_by_frequency * direction[self.problem.n_unknowns]
        return super().margin_rate(evaluation, direction) + by_frequency

    def amplification(self, unknowns: FloatArray, value: float) -> float:
        """0: there is no exciting force."""
        return 0.0

    def scale(self, point: FloatArray) -> FloatArray:
        """As of any problem; the frequency relative to itself, further unknowns to their units."""
        n = self.problem.n_unknowns
        scale = np.empty(len(point))
        scale[:n] = length_of(point[:n]) or 1.0
        scale[n] = abs(point[n]) or 1.0
        scale[n + 1 : -1] = self.more
        scale[-1] = max(abs(point[-1]), self.smallest) or 1.0
        return scale

    def distance(self, point: FloatArray, other: FloatArray, scale: FloatArray) -> float:
        """As of any problem, and along the frequency and further unknowns."""
        n = self.problem.n_unknowns
        ends = np.append(np.arange(n), len(point) - 1)
        of_motion = super().distance(point[ends], other[ends], scale[ends])
        rest = ((point - other) / scale)[n:-1]
        return float(np.hypot(of_motion, length_of(rest)))


def first_harmonic(problem: HarmonicBalance, dof: int) -> FloatArray:
    """Rows (2, n_coefficients) that tell cosine and sine of the first harmonic at ``dof``."""
    rows = np.zeros((2, problem.n_unknowns))
    for row, sine in zip(rows, (False, True), strict=True):
        row[dof * problem.basis.n_components + problem.basis.component(1, sine=sine)] = 1.0
    return rows


class LimitCycleProblem(UnforcedProblem):
    """Limit cycles over one named parameter: coefficients and frequency are unknown.

    ``phase``, ``index`` and ``smallest`` as of `UnforcedProblem`, for example the sine of a
    `first_harmonic`. Cycles are looked for where ``size`` (n_coefficients,) times the coefficients,
    an amplitude [m], is in a band of ``amplitudes``. ``problem`` has no force that oscillates, as
    `symhbm.balance.unforced` gives it.
    """

    peaked = False

    def __init__(
        self,
        problem: HarmonicBalance,
        name: str | None,
        phase: FloatArray,
        index: int | None = None,
        smallest: float = 0.0,
        size: FloatArray | None = None,
        amplitudes: tuple[float, float] = (0.0, np.inf),
    ):
        super().__init__(problem, phase, name, index, smallest)
        self._size, self.amplitudes = size, amplitudes

    def amplitude(self, unknowns: FloatArray) -> float:
        """The amplitude [m] that unknowns tell; 0 where nothing tells it."""
        motion = unknowns[: self.problem.n_unknowns]
        return 0.0 if self._size is None else float(self._size @ motion)

    def balance(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None
    ) -> Balanced:
        """As of any unforced motion; ArithmeticError at other amplitudes."""
        low, high = self.amplitudes
        if not low <= (amplitude := self.amplitude(unknowns)) <= high:
            raise ArithmeticError(f"no cycle of {amplitude:g} m is looked for")
        return super().balance(unknowns, value, switches)
