"""Damping ratios of one mode over its amplitude and over a parameter, with both derivatives."""

from functools import partial
from typing import NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Branch, newton
from symhbm.continuation.unforced import (
    ModeOverParameterProblem,
    NonlinearModeProblem,
    follow_mode,
    linear_mode,
)
from symhbm.numerics import RADIANS, Factorisation, FloatArray
from symhbm.response.unforced import mode_problem
from symhbm.results import Request


class SurfacePoint(NamedTuple):
    """A nonlinear mode at a ``value`` of the parameter and an ``amplitude`` [m].

    ``by_value`` is the derivative of its damping ratio by the parameter, ``by_amplitude`` that by
    the natural logarithm of the amplitude; ``frequency`` in Hz.
    """

    value: float
    amplitude: float
    damping_ratio: float
    frequency: float
    by_value: float
    by_amplitude: float
    residual_norm: float
    unknowns: FloatArray


class ModeSurface:
    """One nonlinear mode of a problem over its amplitude and over one parameter.

    ``request`` asks for that mode along the parameter at some amplitude. Raises as `mode_problem`.
    """

    def __init__(self, problem: HarmonicBalance, request: Request):
        curve, self._linear = mode_problem(problem, request)
        assert isinstance(curve, ModeOverParameterProblem)
        self.curve, self.request = curve, request

    def over_amplitude(self, value: float, amplitudes: tuple[float, float]) -> Branch:
        """The mode at a value of the parameter, followed over amplitudes [m] from the linear one.

        Raises ValueError or ArithmeticError where there is no such mode.
        """
        problem, mode = self.curve.problem_at(value), self.request.mode
        assert isinstance(mode, int)
        linear = linear_mode(problem, mode, self._linear.dof)
        low, high = np.log10(amplitudes).tolist()
        curve = NonlinearModeProblem(problem, linear.dof)
        return follow_mode(curve, linear, (low, high), self.request.max_points)

    def at(self, value: float, amplitude: float, near: FloatArray) -> SurfacePoint:
        """The mode there by Newton's method from the unknowns of one ``near``.

        ArithmeticError where it finds none, or no slopes.
        """
        curve = self.curve.with_level(amplitude)
        result = newton(partial(curve.evaluate, value=value), near)
        factors, place = Factorisation(result.evaluation.jacobian), curve.damping_place
        by_size = np.zeros(curve.n_unknowns)
        by_size[-1] = result.evaluation.magnitude  # the amplitude is in the last condition alone
        slopes = [factors.solve(part) for part in (-result.evaluation.by_parameter, by_size)]
        by_value, by_amplitude = (np.nan if s is None else float(s[place]) for s in slopes)
        if not result.converged or not np.isfinite([by_value, by_amplitude]).all():
            raise ArithmeticError(f"no mode was found at an amplitude of {amplitude:g} m")
        return SurfacePoint(
            value,
            amplitude,
            curve.damping_ratio(result.unknowns),
            curve.frequency(result.unknowns) / RADIANS,
            by_value,
            by_amplitude,
            result.evaluation.norm,
            result.unknowns,
        )
