"""Nonlinear modes: free motions of a given amplitude, or of one amplitude over a parameter.

They start from linear modes of a structure about its rest.

In the extended periodic motion concept negative damping proportional to the mass makes the motion
periodic, see `symhbm.balance.SustainedMotion`; the damping ratio is unknown.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from typing import NamedTuple, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance, SustainedMotion, is_held, matrices_in
from symhbm.continuation.newton import NewtonResult, newton
from symhbm.continuation.path import Path
from symhbm.continuation.start import position_at_rest
from symhbm.continuation.status import Status
from symhbm.continuation.unforced.problem import (
    Balanced,
    Condition,
    UnforcedProblem,
    first_harmonic,
)
from symhbm.model.linear import gyroscopic_part, hermitian, lowest_gyroscopic, lowest_modes
from symhbm.numerics import ComplexArray, FloatArray

NO_DAMPING = 1e-11
"""Damping ratio that is 0 but for round-off."""
_REPEATED = 1e-6
"""Relative distance of natural frequencies below which any mixture of the modes is one."""
_NO_STIFFNESS = 1e-6
"""Natural frequency, over that of a high mode, below which nothing holds the motion."""
_STILL = 1e-6
"""Share of the largest motion below which a degree of freedom does not tell an amplitude."""
_ROUNDS = 20
"""Most times that contacts are linearised, where their forces depend on the frequency."""
_SETTLED = 1e-10
"""Relative change of the frequency at which that is enough."""
_NEARLY_LINEAR = 0.02
"""Distance of a nonlinear mode from the linear one, relative, up to which it is the same mode."""
_SAME = 1e-9
"""Distance of two modes, relative, that is round-off."""
_FEWER = 10.0
"""Factor by which the amplitude is reduced until the mode is nearly linear."""
_MAX_REDUCTIONS = 12


class NonlinearModeProblem(UnforcedProblem):
    """A nonlinear mode over the common logarithm of its amplitude [m].

    Unknown are the coefficients, the angular frequency and the damping ratio. The amplitude is that
    of the first harmonic of the unknown degree of freedom ``dof``, whose motion in it is a cosine.
    """

    peaked = False  # the amplitude is what moves
    more = (1.0,)
    """A damping ratio is as much as the same relative change of the frequency."""

    def __init__(
        self,
        problem: HarmonicBalance,
        dof: int,
        name: str | None = None,
        index: int | None = None,
        smallest: float = 0.0,
    ):
        self.dof = dof
        self._cosine, phase = first_harmonic(problem, dof)
        super().__init__(problem, phase, name, index, smallest)
        self.sustained = SustainedMotion(problem)

    @property
    def damping_place(self) -> int:
        """Number of the damping ratio among the unknowns."""
        return self.problem.n_unknowns + 1

    def damping_ratio(self, unknowns: FloatArray) -> float:
        """The damping ratio among unknowns."""
        return float(unknowns[self.damping_place])

    def amplitude(self, unknowns: FloatArray) -> float:
        """The amplitude [m] that unknowns tell."""
        return float(self._cosine @ unknowns[: self.problem.n_unknowns])

    def modal_amplitude(self, unknowns: FloatArray) -> float:
        """The modal amplitude [kg^1/2 m] of a motion, see `SustainedMotion.modal_amplitude`."""
        return self.sustained.modal_amplitude(unknowns[: self.problem.n_unknowns])

    def balance(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None
    ) -> Balanced:
        """The balance of the motion with the force that sustains it; the amplitude is not in it."""
        free = super().balance(unknowns, value, switches)
        motion, frequency = unknowns[: self.problem.n_unknowns], self.frequency(unknowns)
        at = motion, frequency, self.damping_ratio(unknowns)
        evaluation, by_damping = self.sustained(free.evaluation, *at)
        return free._replace(evaluation=evaluation, by_more=(by_damping,))

    def conditions(self, unknowns: FloatArray, value: float) -> list[Condition]:
        """The phase, and the amplitude of the cosine."""
        amplitude = 10.0**value
        if not 0 < amplitude < np.inf:
            raise ArithmeticError(f"no mode has the amplitude {amplitude:g} m")
        slope = np.log(10.0) * amplitude
        return [
            Condition(self.phase, 0.0, 0.0, amplitude),
            Condition(self._cosine, amplitude, slope, amplitude),
        ]

    def scale(self, point: FloatArray) -> FloatArray:
        """As of any unforced motion; lengths along the parameter in decades of the amplitude."""
        scale = super().scale(point)
        scale[-1] = 1.0
        return scale


class ModeOverParameterProblem(NonlinearModeProblem):
    """A nonlinear mode of a constant ``level`` [m] of its amplitude over one named parameter.

    Unknown are the coefficients, the angular frequency and the damping ratio. ``index`` and
    ``smallest`` as of `UnforcedProblem`. The parameter must not change the mass matrix.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        dof: int,
        name: str,
        level: float,
        index: int | None = None,
        smallest: float = 0.0,
    ):
        super().__init__(problem, dof, name, index, smallest)
        self.level = level

    def with_level(self, level: float) -> Self:
        """The same equations at another amplitude [m]."""
        result = copy(self)
        result.level = level
        return result

    def conditions(self, unknowns: FloatArray, value: float) -> list[Condition]:
        """The phase, and the amplitude of the cosine, which does not change."""
        level = self.level
        return [Condition(self.phase, 0.0, 0.0, level), Condition(self._cosine, level, 0.0, level)]

    def scale(self, point: FloatArray) -> FloatArray:
        """As of any unforced motion, lengths along the parameter relative to its value."""
        return UnforcedProblem.scale(self, point)


class NoModeError(ValueError):
    """A structure has no such mode, or none of which the degree of freedom tells the amplitude."""


class LinearMode(NamedTuple):
    """A mode of small motions: its ``frequency`` [rad/s], ``shape`` (n_dof,) and where it rests.

    The shape is ``a - i b`` of the unknown degrees of freedom, 1 at ``dof``, which tells the
    amplitude; ``rest`` (n_coefficients,) [m] holds the static displacements.
    """

    dof: int
    frequency: float
    shape: ComplexArray
    rest: FloatArray

    def unknowns(self, problem: HarmonicBalance, amplitude: float) -> FloatArray:
        """Coefficients, frequency and no damping ratio of the mode at an amplitude [m]."""
        motion = problem.layout.coefficients(self.rest.copy())
        motion[:, problem.basis.component(1)] += amplitude * self.shape.real
        motion[:, problem.basis.component(1, sine=True)] -= amplitude * self.shape.imag
        return np.concatenate([motion.ravel(), [self.frequency, 0.0]])


def linear_mode(
    problem: HarmonicBalance, mode: int, dof: int | None, numbers: Sequence[int] | None = None
) -> LinearMode:
    """A mode of an unforced problem about its rest, contacts as they are there: stuck, or open.

    ``mode`` counts from the lowest; ``dof`` is the unknown degree of freedom that tells the
    amplitude, None for the one that moves most; ``numbers`` are those that the user gives the
    unknown ones.

    Raises NoModeError for a mode that there is not, that is repeated, that nothing holds, or in
    which that degree of freedom does not move.
    """
    numbers = range(problem.n_dof) if numbers is None else numbers
    frequency, found = 1.0, None
    for _ in range(_ROUNDS):
        rest = position_at_rest(problem, frequency)
        natural, shapes = _modes_about(problem, rest, frequency, mode + 2)
        if mode >= len(natural):
            raise NoModeError(f"mode={mode}: expected a number from 0 to {len(natural) - 1}")
        before, frequency = frequency, float(natural[mode])
        found = natural, shapes, rest
        if not frequency > 0 or abs(frequency - before) <= _SETTLED * frequency:
            break
    assert found is not None
    natural, shapes, rest = found
    if not frequency > _NO_STIFFNESS * _high_frequency(problem):
        raise NoModeError(
            f"mode={mode}: expected a mode that stiffness holds, the frequency of this one is 0"
        )
    near = np.abs(natural - frequency) <= _REPEATED * frequency
    if np.count_nonzero(near) > 1:
        raise NoModeError(f"mode={mode}: {_repeated(problem)}")
    shape = shapes[:, mode]
    size, largest = np.abs(shape), int(np.argmax(np.abs(shape)))
    dof = largest if dof is None else dof
    if size[dof] < _STILL * size[largest]:
        raise NoModeError(
            f"place={numbers[dof]}: expected a degree of freedom that moves in mode {mode}, this "
            f"one does not; {numbers[largest]} moves most"
        )
    return LinearMode(dof, frequency, np.asarray(shape / shape[dof], dtype=complex), rest)


def _repeated(problem: HarmonicBalance) -> str:
    alone = "expected a mode whose frequency no other one has; "
    if problem.model.nodal_diameters is None and problem.symmetry is None:
        return alone + (
            "of a disk of equal sectors two modes of each number of nodal diameters have one "
            "frequency: give nodal_diameter= for the wave of one of them"
        )
    return alone + "two modes of this wave have the same, change the structure a little"


def _modes_about(
    problem: HarmonicBalance, rest: FloatArray, frequency: float, count: int
) -> tuple[FloatArray, ComplexArray]:
    """Lowest natural frequencies [rad/s] and shapes with the contacts as springs at rest."""
    mass, damping, _ = matrices_in(problem, 1)
    gyroscopic = gyroscopic_part(damping)
    stiffness = hermitian(_first_harmonic(problem, rest, frequency)) + frequency**2 * mass
    count = min(count, mass.shape[0])
    if gyroscopic is not None:
        stiffness = stiffness - 1j * frequency * gyroscopic
        return lowest_gyroscopic(stiffness, gyroscopic, mass, count)
    squares, shapes = lowest_modes(stiffness, mass, count)
    return np.sqrt(np.maximum(squares, 0.0)), shapes


def _first_harmonic(problem: HarmonicBalance, rest: FloatArray, frequency: float) -> sp.csc_array:
    """Dynamic stiffness of the first harmonic about rest, for ``a - i b``, contacts included."""
    jacobian = sp.csr_array(problem.evaluate(rest, frequency).jacobian)
    size, basis = problem.basis.n_components, problem.basis
    cosine, sine = (np.arange(problem.n_dof) * size + basis.component(1, s) for s in (False, True))
    rows = jacobian[cosine]
    real, imaginary = rows[:, cosine], rows[:, sine]
    return sp.csc_array(real + 1j * imaginary if abs(imaginary).nnz else real)


def _high_frequency(problem: HarmonicBalance) -> float:
    """An upper natural frequency [rad/s], from the diagonals of the matrices."""
    mass, _, stiffness = matrices_in(problem, 1)
    inertia, held = mass.diagonal().real, np.abs(stiffness.diagonal())
    moving = inertia > 0
    return float(np.sqrt(np.max(held[moving] / inertia[moving], initial=0.0)))


def mode_start(curve: NonlinearModeProblem, linear: LinearMode, amplitude: float) -> NewtonResult:
    """The nonlinear mode at an ``amplitude`` [m] that the linear one becomes.

    Where it is not nearly linear there, it is followed from a smaller amplitude.
    """
    problem, start = curve.problem, amplitude
    result = before = None
    for _ in range(_MAX_REDUCTIONS):
        value = float(np.log10(start))
        guess = linear.unknowns(problem, start)
        if 0 in problem.harmonics and not is_held(problem):
            evaluation = curve.evaluate(guess, value)
            return NewtonResult(guess, evaluation, 0, Status.NOT_HELD)
        before, result = result, newton(partial(curve.evaluate, value=value), guess)
        if result.converged and _distance(curve, result.unknowns, guess) <= _NEARLY_LINEAR:
            break
        if before is not None and _are_similar(curve, before, result):
            break  # other damping than modal, or contacts that just touch: alike at all amplitudes
        start /= _FEWER
    else:
        assert result is not None
        return replace(result, status=Status.NO_MODE)
    if start == amplitude:
        return result
    end = Path(curve, result.unknowns, value, float(np.log10(amplitude))).end()
    if end is None:
        return replace(result, status=Status.NO_MODE)
    return newton(partial(curve.evaluate, value=end.value), end.unknowns)


def _are_similar(curve: NonlinearModeProblem, larger: NewtonResult, result: NewtonResult) -> bool:
    """Whether two motions are the same but for their amplitudes, damped alike."""
    small = result.unknowns
    scaled = np.where(np.arange(len(small)) < curve.problem.n_unknowns, 1 / _FEWER, 1.0)
    distance = _distance(curve, scaled * larger.unknowns, small)
    damping = curve.damping_ratio(larger.unknowns) - curve.damping_ratio(small)
    return larger.converged and result.converged and max(distance, abs(damping)) <= _SAME


def _distance(curve: NonlinearModeProblem, first: FloatArray, second: FloatArray) -> float:
    """Relative distance of two motions, but for their means, or that of their frequencies."""
    problem = curve.problem
    moves = np.tile(problem.basis.order > 0, problem.n_dof)
    motions = [unknowns[: problem.n_unknowns][moves] for unknowns in (first, second)]
    distance = np.linalg.norm(motions[0] - motions[1]) / np.linalg.norm(motions[1])
    detuning = curve.frequency(first) / curve.frequency(second) - 1
    return float(max(distance, abs(detuning)))
