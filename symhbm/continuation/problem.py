"""Continuation problems: the balance along one moving parameter, and what a solution of it is."""

import math
from abc import ABC, abstractmethod
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import Evaluation, HarmonicBalance
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop

BEYOND = 1e-11
"""Margin beyond which a contact is in the wrong state."""
ROUND_OFF = 1e-15
"""Error of a margin by those of the unknowns, relative to the sum of its terms by each of them."""
WEAKEST = 0.1
"""Smallest share of the response to which the distance of a harmonic is relative."""


class ContinuationProblem(ABC):
    """Solutions of the balance over one parameter.

    ``problem`` holds the values of all other parameters. ``single_valued`` tells that there is one
    solution at each value, so that a path that turns back has failed and has no fold. Lengths along
    the parameter are relative to its value, but to no less than ``smallest``. ``angles`` names the
    solver where the switching angles are unknowns too, None where they are located.
    ``machine_code`` tells whether that evaluates the equations, None where this process has it.
    ``peaked`` tells whether maxima of its amplitudes are looked for. ``driven`` tells that a force
    drives the motion, at a given frequency: resonances may lie between two points, and Newton's
    method finds a solution without a neighbouring one; ``at_rest`` that none does, and that the
    structure is at rest in one place at all values. The first unknowns are the coefficients of
    the motion; where they are not all, the class tells more.
    """

    problem: HarmonicBalance
    single_valued: bool
    smallest: float = 0.0
    angles: str | None = None
    machine_code: bool | None = None
    peaked: bool = True
    driven: bool = True
    at_rest: bool = False

    @property
    def n_unknowns(self) -> int:
        """Number of unknowns."""
        return self.problem.n_unknowns

    @abstractmethod
    def at(self, value: float) -> tuple[HarmonicBalance, float]:
        """The problem and the angular frequency [rad/s] at a value of the parameter."""

    @abstractmethod
    def evaluate(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None = None
    ) -> Evaluation:
        """Residual and derivatives, ``by_parameter`` by the moving parameter."""

    def at_point(self, point: FloatArray) -> tuple[HarmonicBalance, float]:
        """The problem and the angular frequency at unknowns and parameter (n_unknowns + 1,)."""
        return self.at(float(point[-1]))

    def margin_gradient(self, evaluation: Evaluation, switch: int) -> FloatArray:
        """Derivative of the margin of one switch by unknowns and parameter, (n_unknowns + 1,)."""
        states, by_parameter = evaluation.states, evaluation.margins_by_parameter
        row = np.zeros(self.n_unknowns + 1)
        row[: self.problem.n_unknowns] = self.problem.contacts.margin_gradient(states, switch)
        row[-1] = np.broadcast_to(by_parameter, states.margins.shape)[switch]
        return row

    def margin_rate(self, evaluation: Evaluation, direction: FloatArray) -> FloatArray:
        """Derivative of all margins along a direction (n_unknowns + 1,) of the path."""
        motion = direction[: self.problem.n_unknowns]
        rate = self.problem.contacts.margin_rate(evaluation.states, motion)
        return rate + evaluation.margins_by_parameter * direction[-1]

    def amplification(self, unknowns: FloatArray, value: float) -> float:
        """Largest inertia force over the largest exciting force."""
        problem, frequency = self.at(value)
        return problem.amplification(unknowns, frequency)

    def settle(self, guess: FloatArray, switches: NDArray[np.bool_]) -> None:  # noqa: B027
        """Set the unknowns of a guess (n_unknowns + 1,) to 0 that are so in its ``switches``."""

    def scale(self, point: FloatArray) -> FloatArray:
        """Units of length of the unknowns and the parameter at a point, all (n_unknowns + 1,).

        The norm of the response for all its coefficients, the value of the parameter for itself.
        """
        scale = np.empty(len(point))
        _write_scale(point, self.smallest, scale)
        return scale

    def distance(self, point: FloatArray, other: FloatArray, scale: FloatArray) -> float:
        """Scaled distance between two points, weak harmonics relative to their own size.

        All arrays (n_unknowns + 1,).
        """
        return _distance(point, other, scale, self.problem.basis.same_harmonic)


@Loop
def _write_scale(point, smallest: float, scale) -> None:
    """Write the norm of all but the last component for each of them, and the last one."""
    last = len(point) - 1
    square = 0.0
    for i in range(last):
        square += point[i] * point[i]
    scale[:last] = math.sqrt(square) if square > 0 else 1.0
    value = max(abs(point[last]), smallest)
    scale[last] = value if value > 0 else 1.0


@Loop
def _distance(point, other, scale, same_harmonic) -> float:
    """Distance of two points, that of each harmonic relative to its share of the response."""
    size, last = len(same_harmonic), len(point) - 1
    apart, level = np.zeros(size), np.zeros(size)
    for i in range(last):
        between, scaled = (point[i] - other[i]) / scale[i], point[i] / scale[i]
        apart[i % size] += between * between
        level[i % size] += scaled * scaled
    between = (point[last] - other[last]) / scale[last]
    total = between * between
    for k in range(size):
        strength = 0.0
        for m in range(size):
            strength += same_harmonic[k, m] * math.sqrt(level[m])
        strength = min(max(strength, WEAKEST), 1.0)
        total += apart[k] / (strength * strength)
    return math.sqrt(total)


class FrequencyProblem(ContinuationProblem):
    """The response over the angular frequency [rad/s]."""

    def __init__(self, problem: HarmonicBalance):
        self.problem = problem
        self.single_valued = problem.single_valued
        self._margins_move = problem.contacts.margins_move
        still = not problem.excitation.amplitude and problem.model.engine_order is None
        self.at_rest = still and not self._margins_move

    def at(self, value: float) -> tuple[HarmonicBalance, float]:
        """The problem and the angular frequency."""
        return self.problem, value

    def evaluate(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None = None
    ) -> Evaluation:
        """Residual and derivatives at the angular frequency ``value``."""
        evaluation = self.problem.evaluate(unknowns, value, switches)
        if not self._margins_move:
            return evaluation
        by_frequency, _ = self.problem.contacts.margin_slopes(evaluation.states, value)
        return replace(evaluation, margins_by_parameter=by_frequency)


class ParameterProblem(ContinuationProblem):
    """The response over one named parameter at a constant angular ``frequency`` [rad/s].

    The parameter is set for all blades or contacts at once, or for that at ``index`` alone.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        name: str,
        frequency: float,
        index: int | None = None,
        smallest: float = 0.0,
    ):
        self._derivative = problem.derivative(name)
        self.problem = problem
        self.name = name = problem.parameter_name(name)
        self.frequency = frequency
        self.smallest = smallest
        self.single_valued = not problem.may_fold([name])
        self._is_force = name == "force_amplitude"
        nominal = np.asarray(problem.parameters[name], dtype=float)
        chosen = np.ones(nominal.shape) if index is None else np.zeros(nominal.shape)
        if index is not None:
            chosen[index] = 1.0
        self._nominal, self._chosen = nominal, chosen
        # Several computations share each point of a path.
        self.at = lru_cache(maxsize=8)(self.at)  # type: ignore[method-assign]

    def scale(self, point: FloatArray) -> FloatArray:
        """As of any problem, but below the ``smallest`` force relative to the response there."""
        scale = super().scale(point)
        if self._is_force and 0 < abs(point[-1]) < self.smallest:
            scale[:-1] *= self.smallest / abs(point[-1])
        return scale

    def settle(self, guess: FloatArray, switches: NDArray[np.bool_]) -> None:
        """As of any problem: without a force, unless a contact slides on the way to it."""
        problem = self.problem
        if not self._is_force or guess[-1] != 0:
            return
        at_rest = problem.locate(np.zeros(problem.n_unknowns), self.frequency).switches
        if (switches & ~at_rest).any():
            return
        # A static load still displaces.
        moves = problem.basis.order > 0 if problem.loaded else problem.basis.order >= 0
        guess[:-1][np.tile(moves, problem.n_dof)] = 0.0

    def with_value(self, value: float) -> HarmonicBalance:
        """The problem with the parameter at ``value``; ValueError where that is not allowed."""
        values = np.where(self._chosen > 0, value, self._nominal)
        return self.problem.with_parameters(**{self.name: values})

    def at(self, value: float) -> tuple[HarmonicBalance, float]:
        """The problem with the parameter at ``value``, and the constant frequency."""
        try:
            return self.with_value(value), self.frequency
        except ValueError as error:
            # An iteration that leaves the allowed values has failed.
            raise ArithmeticError(str(error)) from error

    def chosen(self, problem: HarmonicBalance) -> FloatArray:
        """1 for each blade or contact balanced in a problem whose parameter moves, 0 for others."""
        return problem.own(self.name, self._chosen)

    def evaluate(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None = None
    ) -> Evaluation:
        """Residual and derivatives at the ``value`` of the parameter."""
        problem, frequency = self.at(float(value))
        evaluation = problem.evaluate(unknowns, frequency, switches)
        return self.along(problem, unknowns, frequency, evaluation)

    def along(
        self, problem: HarmonicBalance, motion: FloatArray, frequency: float, evaluation: Evaluation
    ) -> Evaluation:
        """An evaluation of ``problem``, one `at` a value, with derivatives by the parameter.

        ``motion`` (n_coefficients,) [m] and ``frequency`` [rad/s] are those that it is of.
        """
        inputs = problem.arguments(motion, frequency, states=evaluation.states)
        by_entry = self._derivative(**inputs)["jacobian"].sparse()
        chosen = self.chosen(problem)
        margins_by_parameter: FloatArray | float = 0.0
        if self.name in problem.model.groups.owners:
            by_value = problem.contacts.margin_slopes(evaluation.states, frequency)[1][self.name]
            margins_by_parameter = by_value @ chosen
        return replace(
            evaluation,
            by_parameter=by_entry @ np.atleast_1d(chosen),
            margins_by_parameter=margins_by_parameter,
        )


class Corrected(NamedTuple):
    """A solution of the equations and a constraint.

    ``point`` (n_unknowns + 1,), the unknowns [m] and the parameter; ``direction``
    (n_unknowns + 1,), the unit tangent of the curve in scaled variables, along the gradient of
    the constraint; ``sign``, that of ``det [J; direction^T]`` up to a factor constant along the
    curve. ``error`` is the scaled distance from the guess; ``margins`` (n_switches,) the
    margins of the switches and ``rate`` (n_switches,) their derivatives along the direction;
    ``crosses`` tells whether one is beyond the limit of its held state;
    ``amplification`` is the largest inertia force over the largest exciting one;
    ``resonances_below`` counts the resonances below each harmonic of the frequency, None where they
    were not counted; ``springs`` are those of the contacts in this motion where they are known, as
    of `BalancedContacts.springs`.
    """

    point: FloatArray
    direction: FloatArray
    sign: int
    residual_norm: float
    amplification: float
    error: float
    margins: FloatArray
    rate: FloatArray
    crosses: bool
    resonances_below: tuple[int, ...] | None
    springs: FloatArray | None = None

    def oriented(self, sign: int) -> "Corrected":
        """The same point with the tangent that has this ``sign``."""
        if self.sign == sign:
            return self
        return self._replace(direction=-self.direction, sign=-self.sign, rate=-self.rate)
