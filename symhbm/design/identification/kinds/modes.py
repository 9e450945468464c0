"""Free motions of given amplitudes: frequencies and damping of modes, linear and nonlinear."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from symhbm.balance import HarmonicBalance, matrices_in
from symhbm.continuation import newton
from symhbm.continuation.unforced import NonlinearModeProblem, linear_mode, mode_start
from symhbm.design.identification.kinds.curve import Curve, Members, Nearby, Reading, Work, at_place
from symhbm.design.identification.kinds.responses import Response
from symhbm.design.identification.observations import Rows
from symhbm.numerics import RADIANS, FloatArray
from symhbm.response.unforced import free_problem
from symhbm.results import Request

_SMALL = 1e-6
"""Amplitude of a linear mode over where the structure rests, or in m where it rests at 0."""
_NEAR = 0.05
"""Change of a frequency from the predicted one, relative, of what may be another mode."""


@dataclass(frozen=True, eq=False)
class Mode(Response):
    """A nonlinear mode, whose state are coefficients, frequency [rad/s] and damping ratio."""

    curve: NonlinearModeProblem

    def _of_frequency(self, move: FloatArray) -> FloatArray:
        n = self.problem.n_unknowns
        return move[n : n + 1]

    def _added(self, weights: FloatArray, move: FloatArray) -> Any:
        ratio = self.curve.damping_ratio(self.state)
        return -self.curve.sustained.bend(weights, self.motion, self.omega, ratio, move)


@dataclass(frozen=True, eq=False)
class ModeCurve(Curve):
    """One mode over its amplitude [m] at a place, NaN of small motions.

    ``which`` is its number, the place and the nodal diameters, ``dof`` the degree of freedom among
    those balanced.
    """

    forms = "mode_frequency", "mode_damping"
    which: tuple[int, Any, int | None]
    dof: int | None

    @staticmethod
    def asked(rows: Rows, i: int) -> tuple[tuple[int, Any, int | None], float]:
        """Those of a mode are of one curve, of amplitudes [m]."""
        waves = None if np.isnan(rows.nodal_diameter[i]) else int(rows.nodal_diameter[i])
        return (int(rows.mode[i]), at_place(rows.place[i]), waves), float(rows.amplitude[i])

    @classmethod
    def of(cls, members: Members) -> ModeCurve:
        """As of any kind."""
        problem, rows = members.problem, members.rows
        for name in members.names:
            values = np.asarray(problem.parameters[name], dtype=float)
            both = problem, problem.with_parameters(**{name: 1.1 * values})
            mass, other = (matrices_in(one, 1).mass_matrix for one in both)
            if abs(mass - other).max() > 0:
                raise ValueError(
                    f"unknown[{name!r}]: expected a parameter that does not change the mass "
                    "matrix, which the damping of modes is measured by"
                )
        which, _ = cls.asked(rows, members.numbers[0])
        mode, place, waves = which
        if waves is not None and not members.alike:
            raise ValueError("nodal_diameter: expected unknowns that are alike on all sectors")
        asked: Any = dict(unforced="nonlinear mode", mode=mode, nodal_diameter=waves)
        asked["dof"] = problem.model.number_of(place)
        free, dof, _ = free_problem(problem, Request("amplitude", (1.0, 1.0), **asked))
        n, read = free.n_unknowns, {}
        for i in members.numbers.tolist():
            frequency = n, 1 / RADIANS, float(rows.frequency[i])
            read[i] = Reading.entry(
                n + 2, *(frequency if rows.form[i] == "mode_frequency" else (n + 1, 1.0, 1.0))
            )
        return cls._from(members, free, read, which, dof)

    @property
    def band(self) -> None:
        """None: nothing is driven."""
        return None

    @property
    def alone(self) -> dict[str, Any]:
        """The mode over its amplitude, a little beyond all measured ones."""
        known = np.array(self.given)[np.isfinite(self.given)]
        band = (known.min() / 2, 2 * known.max()) if known.size else None
        mode, place, waves = self.which
        return dict(band=band, mode=mode, place=place, nodal_diameter=waves)

    def solve(self, problem: HarmonicBalance, nearby: Nearby, work: Work) -> list[Mode]:
        """As of any kind."""
        solved = list[Mode]()
        for k, amplitude in enumerate(self.given):
            work.n_solved += 1
            predicted = nearby[k][1] if nearby else None
            if not nearby and solved and np.isfinite(amplitude):
                # Motions of all amplitudes are nearly alike.
                before = solved[-1].state
                ratio = amplitude / self.given[k - 1]
                predicted = np.append(ratio * before[:-2], before[-2:])
            solved.append(self._mode(problem, amplitude, predicted, work))
        return solved

    def _mode(
        self, problem: HarmonicBalance, amplitude: float, predicted: FloatArray | None, work: Work
    ) -> Mode:
        """The mode of an amplitude, from a predicted state where that leads to the same mode."""
        linear = linear_mode(problem, self.which[0], self.dof)
        curve = NonlinearModeProblem(problem, linear.dof)
        if np.isnan(amplitude):
            amplitude = _SMALL * (float(np.abs(linear.rest).max()) or 1.0)
        at, result = partial(curve.evaluate, value=float(np.log10(amplitude))), None
        if predicted is not None:
            result = newton(at, predicted)
            if abs(curve.frequency(result.unknowns) / curve.frequency(predicted) - 1) > _NEAR:
                result = None
        if result is None or not result.converged:
            result = mode_start(curve, linear, amplitude)
        if not result.converged:
            raise ArithmeticError(f"no mode was found at an amplitude of {amplitude:g} m")
        state = result.unknowns
        own = result.evaluation, work.order(problem), curve
        return Mode(problem, curve.frequency(state), state, *own)
