"""What the harmonics left out of a response would change.

A response is embedded in a larger set, where the forces of its contacts leave a residual in the
harmonics that it lacks. Newton's method on that set tells how far the response moves.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance, locate_each
from symhbm.continuation import ACCEPTED, ContinuationProblem
from symhbm.continuation.correctors import Corrector, Hyperplane, unit_parameter
from symhbm.numerics import Factorisation, FloatArray, largest_displacement

SMALLEST = 0.01
"""Share of the largest displacement that the error of a still degree of freedom is relative to."""
_SAFETY = 1.5
"""For the harmonics beyond the larger set: errors were up to 1.43 times the estimate without it."""
_PHASELESS = 0.5
"""Share of the change of all coefficients that counts where maxima happen to stay what they are."""
_SETTLED = 0.1
"""Last step over all of them at which the response in the larger set is known well enough."""
_MAX_STEPS = 5
_BATCH = 400
"""Contacts located at once."""


class Truncation(NamedTuple):
    """The error that the harmonics left out make in one response.

    ``error``, of the displacement of each degree of freedom relative to its own (to no less than
    `SMALLEST` of the largest), the largest of all; ``share``, what each harmonic of the larger set
    adds; ``solves``, the linear solves spent.
    """

    error: float
    share: FloatArray
    solves: int


NONE = Truncation(0.0, np.zeros(0), 0)


def truncations(
    problems: Sequence[HarmonicBalance],
    larger: Sequence[HarmonicBalance],
    unknowns: Sequence[FloatArray],
    frequencies: Sequence[float],
) -> list[Truncation]:
    """Errors of responses by the harmonics that they lack; of one structure, all of one length.

    ``larger`` are the same problems with more harmonics, ``unknowns`` (n_unknowns,) [m],
    ``frequencies`` in rad/s. An error is infinite where the response of the larger problem was not
    found.
    """
    n_contacts = larger[0].n_contacts if larger else 0
    size = max(1, _BATCH // max(1, n_contacts))
    result: list[Truncation] = []
    for i in range(0, len(problems), size):
        batch = slice(i, i + size)
        result += _batch(problems[batch], larger[batch], unknowns[batch], frequencies[batch])
    return result


def embed(problem: HarmonicBalance, larger: HarmonicBalance, unknowns: FloatArray) -> FloatArray:
    """Unknowns of a problem among those of one with more harmonics."""
    inside = np.isin(larger.basis.order, problem.basis.order)
    result = np.zeros((larger.n_dof, larger.basis.n_components))
    result[:, inside] = problem.coefficients(unknowns)
    return result.ravel()


def distance(
    curve: ContinuationProblem, larger: ContinuationProblem, unknowns: FloatArray, value: float
) -> Truncation:
    """Error of a response as its distance from the curve with more harmonics, square to its own.

    At a fold that curve need not reach the value of the response.
    """
    state, corrector = np.append(unknowns, value), Corrector(larger)
    scale, slip = curve.scale(state), curve.evaluate(unknowns, value).friction.slip
    along = Corrector(curve).tangent(state, scale, unit_parameter(len(scale)), slip)
    if along is None:
        return Truncation(np.inf, np.zeros(0), 1)
    problem, finer = curve.problem, larger.problem
    start, normal = (
        np.append(embed(problem, finer, each[:-1]), each[-1]) for each in (state, along.direction)
    )
    scale = larger.scale(start)
    states = larger.evaluate(start[:-1], value).friction.slip
    found = corrector.correct(start, scale, Hyperplane(start, scale, normal), states)
    if found is None:
        return Truncation(np.inf, np.zeros(0), corrector.solves + 1)
    error, share = _error(finer, start[:-1], (found.point - start)[:-1])
    return Truncation(error, share, corrector.solves + 1)


class _Search:
    """Newton's method from one response to that of the larger problem."""

    def __init__(
        self,
        problem: HarmonicBalance,
        larger: HarmonicBalance,
        unknowns: FloatArray,
        frequency: float,
    ):
        self.problem, self.larger = problem, larger
        self.unknowns, self.frequency = unknowns, frequency
        self.start = embed(problem, larger, unknowns)
        self.change = np.zeros_like(self.start)
        self.solves = 0
        self.going = True
        self.found = False

    def advance(self, friction) -> None:
        """One step, with the events of the contacts at the present response."""
        larger, frequency = self.larger, self.frequency
        evaluation = larger.evaluate(self.start + self.change, frequency, friction=friction)
        self.going = False
        if self.solves == 0 and evaluation.norm <= ACCEPTED:
            self.found = True
            return
        step = Factorisation(evaluation.jacobian).solve(-evaluation.residual)
        self.solves += 1
        if step is None:
            return
        self.change = self.change + step
        # Next to an onset of slip one step can be ten times too short.
        close = np.linalg.norm(step) <= _SETTLED * np.linalg.norm(self.change)
        self.found = self.solves > 1 and bool(close)
        self.going = not self.found and self.solves < _MAX_STEPS

    def result(self) -> Truncation:
        """The error, once the search has ended."""
        if not self.found:
            return Truncation(np.inf, np.zeros(0), self.solves)
        if not self.solves:
            return NONE
        error, share = _error(self.larger, self.start, self.change)
        return Truncation(error, share, self.solves)


def _batch(problems, larger, unknowns, frequencies) -> list[Truncation]:
    searches = [
        _Search(*each) for each in zip(problems, larger, unknowns, frequencies, strict=True)
    ]
    while going := [search for search in searches if search.going]:
        try:
            motions = [search.start + search.change for search in going]
            located = locate_each([search.larger for search in going], motions)
        except ArithmeticError:
            break  # a step that overshoots all numbers
        for search, friction in zip(going, located, strict=True):
            search.advance(friction)
    return [search.result() for search in searches]


def _error(
    larger: HarmonicBalance, start: FloatArray, change: FloatArray
) -> tuple[float, FloatArray]:
    """Relative error of a response that changes so, and what each harmonic adds to it."""
    motions = [larger.coefficients(u) for u in (start, start + change)]
    before, after = (largest_displacement(larger.basis, motion)[0] for motion in motions)
    level = reference(after)
    square = (larger.coefficients(change) / level[:, None]) ** 2
    belongs = larger.basis.order[:, None] == np.array(larger.harmonics)
    error = max(
        float(np.max(np.abs(after - before) / level)),
        _PHASELESS * float(np.sqrt(square.sum(axis=1)).max()),
    )
    return _SAFETY * error, np.sqrt(square @ belongs).max(axis=0)


def reference(amplitude: FloatArray) -> FloatArray:
    """What errors of displacements are relative to, (n_dof,) [m]."""
    largest = amplitude.max()
    return np.maximum(amplitude, SMALLEST * largest) if largest else np.ones_like(amplitude)
