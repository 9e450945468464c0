"""The equations along one moving parameter: what continuation follows."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from symhbm import check
from symhbm.fourier import FloatArray
from symhbm.residual import Evaluation, HarmonicBalance


class Curve(Protocol):
    """Solutions of the balance over one parameter.

    ``single_valued`` tells that there is one solution at each value, so that a path that turns
    back is a failure and not a fold.
    """

    problem: HarmonicBalance
    single_valued: bool

    def evaluate(
        self, unknowns: FloatArray, value: float, slip: NDArray[np.bool_] | None = None
    ) -> Evaluation:
        """Residual and derivatives, ``by_parameter`` by the moving parameter."""
        ...

    def amplification(self, unknowns: FloatArray, value: float) -> float:
        """Largest inertia force over the largest exciting force."""
        ...


class FrequencyCurve:
    """The response over the angular frequency [rad/s].

    With constant normal loads and dissipative damping, friction responses are unique.
    """

    single_valued = True

    def __init__(self, problem: HarmonicBalance):
        self.problem = problem

    def evaluate(
        self, unknowns: FloatArray, value: float, slip: NDArray[np.bool_] | None = None
    ) -> Evaluation:
        """Residual and derivatives at the angular frequency ``value``."""
        return self.problem.evaluate(unknowns, value, slip)

    def amplification(self, unknowns: FloatArray, value: float) -> float:
        """Largest inertia force over the largest exciting force."""
        return self.problem.amplification(unknowns, value)


class ParameterCurve:
    """The response over one named parameter, set for all blades or contacts at once.

    ``frequency`` is the constant angular frequency [rad/s].
    """

    single_valued = True

    def __init__(self, problem: HarmonicBalance, name: str, frequency: float):
        check.known(name, problem.parameters)
        self.problem = problem
        self.name = name
        self.frequency = frequency
        self._derivative = problem.derivative(name)

    def evaluate(
        self, unknowns: FloatArray, value: float, slip: NDArray[np.bool_] | None = None
    ) -> Evaluation:
        """Residual and derivatives at the ``value`` of the parameter."""
        problem = self.problem.with_parameters(**{self.name: value})
        evaluation = problem.evaluate(unknowns, self.frequency, slip)
        inputs = problem.arguments(unknowns, self.frequency, slip)
        by_value = np.asarray(self._derivative(**inputs)["jacobian"].full()).sum(axis=1)
        return Evaluation(
            evaluation.residual,
            evaluation.magnitude,
            evaluation.jacobian,
            by_value,
            evaluation.friction,
        )

    def amplification(self, unknowns: FloatArray, value: float) -> float:
        """Largest inertia force over the largest exciting force."""
        problem = self.problem.with_parameters(**{self.name: value})
        return problem.amplification(unknowns, self.frequency)
