"""Error of a response by truncation of its harmonics.

A response is embedded in a larger set of harmonics, where the contact forces leave a residual in
those that it lacks. Newton's method with the larger set tells how far the response moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance, locate_each
from symhbm.continuation import ACCEPTED, ContinuationProblem
from symhbm.continuation.correctors import Hyperplane, corrector_of, unit_parameter
from symhbm.numerics import Factorisation, FloatArray, Table, largest_displacement

SMALLEST = 0.01
"""Share of the largest displacement that errors are relative to at least: some DOFs hardly move."""
_SAFETY = 1.5
"""For the harmonics beyond the larger set: errors were up to 1.43 times the estimate without it."""
_PHASELESS = 0.5
"""Share of the change of all coefficients that counts as error where maxima hardly change."""
_SETTLED = 0.1
"""Ratio of the last Newton step to the whole change at which the change is known well enough."""
_MAX_STEPS = 5
_SAMPLES = 16
"""Samples of normal forces per period of the highest harmonic."""
_BATCH = 400
"""Contacts located at once: few calls, bounded memory."""


class Truncation(NamedTuple):
    """Truncation error of one response.

    ``error`` is the largest relative error of the amplitudes of all degrees of freedom, relative to
    `SMALLEST` of the largest amplitude at least, and of normal forces. ``share`` (n_harmonics,) is
    the change by each harmonic of the larger set, ``solves`` the number of linear solves.
    ``normal`` (n_contacts,) are the errors of normal forces relative to the largest over the
    period, NaN without one; without contacts that have a normal direction it is empty.
    """

    error: float
    share: FloatArray
    solves: int
    normal: FloatArray = np.zeros(0)


NONE = Truncation(0.0, np.zeros(0), 0)


def truncations(
    problems: Sequence[HarmonicBalance],
    larger: Sequence[HarmonicBalance],
    unknowns: Sequence[FloatArray],
    frequencies: Sequence[float],
) -> list[Truncation]:
    """Truncation errors of responses of one structure with equal harmonics.

    ``larger`` are the same problems with more harmonics, ``unknowns`` (n_unknowns,) [m],
    ``frequencies`` in rad/s. An error is infinite where the larger problem was not solved.
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
    result[:, inside] = problem.layout.coefficients(unknowns)
    return result.ravel()


def distance(
    equations: ContinuationProblem, larger: ContinuationProblem, unknowns: FloatArray, value: float
) -> Truncation:
    """Truncation error of a response as its distance from the path with more harmonics.

    The distance is measured in the hyperplane normal to the path of the response: near a fold the
    other path need not reach the value of the response.
    """
    state, corrector = np.append(unknowns, value), corrector_of(larger)
    scale, switches = equations.scale(state), equations.evaluate(unknowns, value).states.switches
    tangent = corrector_of(equations).tangent(state, scale, unit_parameter(len(scale)), switches)
    if tangent is None:
        return Truncation(np.inf, np.zeros(0), 1)
    problem, finer = equations.problem, larger.problem
    start, normal = (
        np.append(embed(problem, finer, vector[:-1]), vector[-1])
        for vector in (state, tangent.direction)
    )
    scale = larger.scale(start)
    states = larger.evaluate(start[:-1], value).states.switches
    corrected = corrector.correct(start, Hyperplane(start, scale, normal), states)
    if corrected is None:
        return Truncation(np.inf, np.zeros(0), corrector.solves + 1)
    frequency = larger.at(value)[1]
    found = _error(finer, frequency, start[:-1], (corrected.point - start)[:-1])
    return found._replace(solves=corrector.solves + 1)


@dataclass
class _Search:
    """Newton's method from a ``start`` (n_unknowns,) [m] to a response of the larger problem."""

    larger: HarmonicBalance
    frequency: float
    start: FloatArray
    change: FloatArray
    solves: int = 0
    running: bool = True
    converged: bool = False

    def advance(self, states) -> None:
        """One Newton step, with the friction of the present response."""
        larger, frequency = self.larger, self.frequency
        evaluation = larger.evaluate(self.start + self.change, frequency, states=states)
        self.running = False
        if self.solves == 0 and evaluation.norm <= ACCEPTED:
            self.converged = True
            return
        step = Factorisation(evaluation.jacobian).solve(-evaluation.residual)
        self.solves += 1
        if step is None:
            return
        self.change = self.change + step
        # Next to an onset of slip the first step can be ten times too short.
        close = np.linalg.norm(step) <= _SETTLED * np.linalg.norm(self.change)
        self.converged = self.solves > 1 and bool(close)
        self.running = not self.converged and self.solves < _MAX_STEPS

    def result(self) -> Truncation:
        """The error, once the search has ended."""
        if not self.converged:
            return Truncation(np.inf, np.zeros(0), self.solves)
        if not self.solves:
            return NONE
        found = _error(self.larger, self.frequency, self.start, self.change)
        return found._replace(solves=self.solves)


def _batch(problems, larger, unknowns, frequencies) -> list[Truncation]:
    starts = [embed(*point) for point in zip(problems, larger, unknowns, strict=True)]
    points = zip(larger, frequencies, starts, strict=True)
    searches = [_Search(*point, change=np.zeros_like(point[-1])) for point in points]
    while running := [search for search in searches if search.running]:
        try:
            motions = [search.start + search.change for search in running]
            omegas = np.array([search.frequency for search in running])
            located = locate_each([search.larger for search in running], motions, omegas)
        except ArithmeticError:
            break  # a step that overflows
        for search, states in zip(running, located, strict=True):
            search.advance(states)
    return [search.result() for search in searches]


def _error(
    larger: HarmonicBalance, frequency: float, start: FloatArray, change: FloatArray
) -> Truncation:
    """Truncation error of a response that changes by ``change``, without linear solves."""
    motions = [larger.layout.coefficients(u) for u in (start, start + change)]
    before, after = (largest_displacement(larger.basis, motion)[0] for motion in motions)
    size = reference(after)
    square = (larger.layout.coefficients(change) / size[:, None]) ** 2
    belongs = larger.basis.order[:, None] == np.array(larger.harmonics)
    of_amplitudes = float(np.max(np.abs(after - before) / size))
    of_coefficients = float(np.sqrt(square.sum(axis=1)).max())
    error, share = max(of_amplitudes, _PHASELESS * of_coefficients), np.sqrt(square @ belongs)
    normal, of_normal = _of_normal_forces(larger, frequency, start, change)
    error = np.fmax(error, np.nanmax(normal, initial=0.0)) if len(normal) else error
    share = np.sqrt(np.concatenate([share**2, of_normal**2 @ belongs])).max(axis=0)
    return Truncation(float(_SAFETY * error), share, 0, _SAFETY * normal)


def _has_normal_forces(problem: HarmonicBalance) -> bool:
    """Whether normal forces of contacts vary with the motion."""
    laws = [(g.law, g.values) for g in problem.model.groups if g.n]
    return any(
        "normal" in law.directions and law.spring_sliders(0.0, values) is not None
        for law, values in laws
    )


def truncation_table(
    problem: HarmonicBalance, errors: Sequence[float], normal: Sequence[FloatArray] = ()
) -> Table:
    """Highest harmonic and truncation error of responses, and errors of their normal forces.

    The latter (n, n_contacts) are NaN where unknown, and left out where no normal force varies.
    """
    table: Table = dict(
        highest_harmonic=np.full(len(errors), problem.basis.highest, dtype=np.int32),
        truncation_error=np.array(errors, dtype=float),
    )
    if _has_normal_forces(problem):
        rows = np.full((len(errors), problem.model.n_contacts), np.nan)
        for row, known in zip(rows, normal, strict=False):
            row[:] = known if len(known) else np.nan
        table["normal_force_error"] = rows
    return table


def _of_normal_forces(
    larger: HarmonicBalance, frequency: float, start: FloatArray, change: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Largest changes of normal forces (n_contacts,) relative to the largest force; coefficients.

    Those of ``k_n v`` (n, n_components) are relative to it too. Both are empty without contacts
    that have a normal direction.
    """
    basis, size = larger.basis, larger.basis.n_components
    tau = 2 * np.pi * np.arange(_SAMPLES * (basis.highest + 1)) / (_SAMPLES * (basis.highest + 1))
    at = basis.values(tau).T
    motions = [larger.layout.relative(unknowns) for unknowns in (start, start + change)]
    result, parts = np.full(larger.n_contacts, np.nan), [np.zeros((0, size))]
    for group in larger.contacts.groups:
        law, values = group.law, larger.contacts.values_of(group)
        sliders = law.spring_sliders(frequency, values) if "normal" in law.directions else None
        if sliders is None:
            continue
        place = slice(law.directions.index("normal") * size, None)
        before, after = (
            sliders.normal_stiffness[:, None]
            * larger.contacts.motions(group, each)[:, place][:, :size]
            for each in motions
        )
        load = sliders.normal_load[:, None]
        forces = [np.maximum(load + part @ at, 0.0) for part in (before, after)]
        largest = np.max(forces, axis=(0, 2))
        largest[largest == 0] = 1.0
        result[group.contacts] = np.abs(forces[1] - forces[0]).max(axis=1) / largest
        parts.append((after - before) / largest[:, None])
    return (result if len(parts) > 1 else result[:0]), np.concatenate(parts)


def reference(amplitude: FloatArray) -> FloatArray:
    """Reference displacements of relative errors, (n_dof,) [m]."""
    largest = amplitude.max()
    return np.maximum(amplitude, SMALLEST * largest) if largest else np.ones_like(amplitude)
