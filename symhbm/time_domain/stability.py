"""Stability of responses: by Hill's method with smooth laws, else by the monodromy matrix.

A small perturbation of a response is ``exp(lambda t)`` times a motion of its period. Its balance in
the harmonics of the response is ``(J + lambda D + lambda^2 M) p = 0``, whose matrix at
``lambda = 0`` is the Jacobian of Eq. (9): stability changes exactly at folds. Where contacts slip
this holds for slow perturbations alone; the monodromy matrix has the others too.
"""

from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance import Evaluation, HarmonicBalance
from symhbm.model import MANY, Structure, advise_condensing
from symhbm.model.condensation import LARGEST_MODAL
from symhbm.model.contacts import MemorylessLaw
from symhbm.numerics import FloatArray, check
from symhbm.time_domain.perturbations import (
    multipliers,
    multipliers_of_part,
    period_map,
    repeats,
)

_HILL, _BALANCED, _EXACT = range(3)
"""Numbers of ``stability_method``."""
NEUTRAL = 1e-9
"""Growth over the frequency that counts as zero: at a fold, or without damping."""
_TIE = 0.01
"""Difference of imaginary parts, over the frequency, that truncation causes."""
_REAL = 0.1
"""Imaginary part of a multiplier, over its modulus, that truncation causes."""


def check_stability(problem: HarmonicBalance, stability: object) -> bool:
    """Whether stability is asked for; ValueError for a structure whose stability is unknown."""
    wanted = check.flag("stability", stability)
    model = problem.model
    if wanted and not model.has_matrices:
        _check_condensed(model)
    if wanted:
        advise_condensing(
            problem.model, problem.n_unknowns, "stability is not computed", ", stability=True"
        )
    return wanted


def _check_condensed(model: Structure) -> None:
    """Raise ValueError for a structure without matrices whose perturbations are not known."""
    changes = model.nodal_diameters is not None or model.engine_order is not None
    if changes or model.loss_factor:
        raise ValueError(f"stability=True: {model.WITHOUT_MATRICES}")
    if model.kept is None:
        raise ValueError(
            "stability=True: expected False for a structure without matrices; responses of "
            "friction under constant loads with damping are stable, for other contacts describe it "
            "by a Model"
        )
    if model.modal is None:
        raise ValueError(
            f"stability=True: expected False for a structure condensed with more than "
            f"{LARGEST_MODAL} degrees of freedom and modes inside; condense it over a narrower "
            "band, or reduce it by symhbm.craig_bampton"
        )
    if not model.modal.between:
        raise ValueError(
            "stability=True: expected False for a structure that is exact at its harmonics alone, "
            "perturbations oscillate between them; condense it with stability=True"
        )


class Growth(NamedTuple):
    """What becomes of small perturbations.

    ``exponent`` is the Floquet exponent of the largest real part [1/s]. ``doubling`` is the product
    of ``1 + mu`` over all multipliers, which is zero where one is -1; of those of half a period, or
    of another part, after which perturbations meet the same. ``method`` numbers what they are of:
    Hill's method, the balanced motion or the exact motion that follows from its state.
    """

    exponent: complex = complex(np.nan)
    doubling: float = np.nan
    method: int = -1

    @property
    def rate(self) -> float:
        """The growth rate [1/s]."""
        return self.exponent.real


def growth(
    problem: HarmonicBalance, frequency: float, evaluation: Evaluation, unknowns: FloatArray
) -> Growth:
    """What becomes of small perturbations of a solution; ``frequency`` in rad/s.

    ``unknowns`` (n_unknowns,) [m] and ``evaluation`` belong together. NaN for structures too large
    or too stiff, without a mass matrix that can be inverted, and with contacts that are neither
    smooth nor sliders.

    A condensed structure has the exponents of its matrices with the modes inside, whose condensed
    stiffness is the sum over poles itself: what Hill's method asks of perturbations,
    ``Z(lambda + i n omega)``, made linear without loss. They are those of the whole structure for
    perturbations that oscillate below the highest harmonic of the band, as it was condensed for
    stability; NaN where it was not.
    """
    whole = _in_matrices(problem)
    if problem.n_unknowns > MANY or whole is None:
        return Growth()
    if not all(isinstance(group.law, MemorylessLaw) for group in problem.curved_groups):
        return Growth()
    try:
        jacobian = _jacobian(problem, evaluation, frequency)
        slides = _slides(problem, evaluation, frequency)
        unknowns = _of_whole(problem, unknowns, frequency)
        if slides or whole.n_unknowns > MANY:
            of_part, parts = multipliers_of_part(whole, frequency, unknowns)
            values = of_part**parts
            # The determinant of what is condensed has the sign of that of all.
            if _agrees(jacobian, values):
                largest = max(np.abs(values[0]), np.finfo(float).tiny)
                exponent = complex(np.log(largest), np.angle(values[0]))
                exponent *= frequency / (2 * np.pi)
                method = _EXACT if whole.loads_move else _BALANCED
                return Growth(exponent, _product(of_part), method)
            if whole.n_unknowns > MANY:
                return Growth()
        if whole is not problem:
            evaluation = whole.evaluate(unknowns, frequency, states=evaluation.states)
            jacobian = _jacobian(whole, evaluation, frequency)
        return _by_hill(whole, frequency, jacobian, _damping(whole, frequency, unknowns))
    except (ArithmeticError, np.linalg.LinAlgError):
        return Growth()


def multiplier_at(
    problem: HarmonicBalance, frequency: float, unknowns: FloatArray, exponent: complex
) -> complex:
    """The multiplier of the period that belongs to a Floquet exponent.

    Of Hill's method the imaginary part suffers from truncation; the monodromy matrix is real, and
    tells a pair from a negative number. Without that one, numbers near the real axis are real.
    """
    nearby = complex(np.exp(2 * np.pi * exponent / frequency))
    whole = _in_matrices(problem)
    try:
        if whole is not None:
            values = multipliers(whole, frequency, _of_whole(problem, unknowns, frequency))
            pairs = np.array([values, values.conj()])
            return complex(pairs.ravel()[np.argmin(np.abs(pairs - nearby))])
    except (ArithmeticError, np.linalg.LinAlgError):
        pass
    return complex(nearby.real) if abs(nearby.imag) < _REAL * abs(nearby) else nearby


def _in_matrices(problem: HarmonicBalance) -> HarmonicBalance | None:
    """The problem by matrices whose perturbations are known between its harmonics, or None."""
    modal = problem.model.modal
    between = problem.model.has_matrices or (modal is not None and modal.between)
    return problem.in_modes if between else None


def _of_whole(problem: HarmonicBalance, unknowns: FloatArray, frequency: float) -> FloatArray:
    """The unknowns of the problem by matrices."""
    if problem.structure is None:
        return unknowns
    return problem.structure.with_modes(unknowns, frequency, problem.excitation.amplitude)


def cycle_growth(
    problem: HarmonicBalance, frequency: float, unknowns: FloatArray, phase: FloatArray
) -> Growth:
    """What becomes of small perturbations of a cycle, but of a shift in time.

    ``unknowns`` (n_unknowns,) [m] and ``frequency`` [rad/s] are a motion of a problem without a
    force, ``phase`` (n_unknowns,) the row that tells when its period begins. Of one sector of a
    ring all other sectors are disturbed as well, by waves of any nodal diameters. NaN for
    structures as of `growth`, with planar friction, and where few harmonics disagree with the
    multipliers on which side of a fold the cycle is.
    """
    whole = problem.whole
    if not whole.model.has_matrices or whole.n_unknowns > MANY or whole.planar_groups:
        return Growth()
    try:
        found = period_map(whole, frequency, problem.layout.everywhere(unknowns).ravel())
        values = found.across()
        if whole is problem and not _agrees_on_folds(problem, frequency, unknowns, phase, values):
            return Growth()
    except (ArithmeticError, np.linalg.LinAlgError):
        return Growth()
    largest = max(float(np.abs(values).max(initial=0.0)), np.finfo(float).tiny)
    rate = float(found.repeats * np.log(largest) * frequency / (2 * np.pi))
    return Growth(complex(rate), method=_EXACT if whole.loads_move else _BALANCED)


def _agrees_on_folds(
    problem: HarmonicBalance,
    frequency: float,
    unknowns: FloatArray,
    phase: FloatArray,
    values: NDArray[np.complex128],
) -> bool:
    """Whether eigenvalues of a cycle and its balance agree on folds, as of `_agrees`.

    ``w`` and ``v``, the velocity, being the null vectors of the Jacobian, the determinant of
    perturbations begins with ``lambda w^T D v``, and the derivative of the balance by the frequency
    is ``D v`` as well: the determinant with that column and the row of the phase has the opposite
    sign, times that of ``phase @ v``.
    """
    evaluation = problem.evaluate(unknowns, frequency)
    matrix = np.zeros((len(unknowns) + 1,) * 2)
    matrix[:-1, :-1] = _jacobian(problem, evaluation, frequency)
    matrix[:-1, -1], matrix[-1, :-1] = evaluation.by_parameter, phase
    coefficients = problem.layout.coefficients(unknowns)
    velocity = (coefficients @ problem.basis.derivative_matrix.T).ravel()
    # Rows and columns of one size: those of the balance are forces.
    size = np.linalg.norm(matrix, axis=1)
    matrix /= size[:, None]
    matrix /= np.linalg.norm(matrix, axis=0)
    sign = -np.linalg.slogdet(matrix)[0] * np.sign(phase @ velocity)
    beyond = np.count_nonzero((values.imag == 0) & (values.real > 1))
    return bool((beyond % 2 == 0) == (sign > 0))


def _agrees(jacobian: FloatArray, values: NDArray[np.complex128]) -> bool:
    """Whether multipliers and balance agree on folds, which few harmonics keep apart.

    At each fold one real multiplier passes one, and the determinant passes zero: at a fold of the
    balance its sign is round-off.
    """
    sizes = np.linalg.svd(jacobian, compute_uv=False)
    if sizes[-1] <= NEUTRAL * sizes[0]:
        return False
    beyond = np.count_nonzero((values.imag == 0) & (values.real > 1))
    return bool((beyond % 2 == 0) == (np.linalg.slogdet(jacobian)[0] > 0))


def _jacobian(problem: HarmonicBalance, evaluation: Evaluation, frequency: float) -> FloatArray:
    """Dense derivative of Eq. (9) by the unknowns, at given static forces of sticking contacts.

    Eq. (9) centres the undetermined force of a contact that never slips; perturbations do not
    change it.
    """
    jacobian = evaluation.jacobian
    matrix = jacobian.toarray() if sp.issparse(jacobian) else np.array(jacobian)
    directions = problem.model.directions.toarray()
    unit = np.eye(problem.basis.n_components)
    for group in problem.groups if problem.basis.order[0] == 0 else ():
        sliders = group.law.sliders(frequency, problem.contacts.values_of(group))
        if sliders is None:
            continue
        located = evaluation.states.groups[group.name]
        for j in np.flatnonzero(~located.states[:, 0]):
            direction = directions[group.rows[j, 0]]
            spring = sliders.stiffness[j] * np.outer(direction, direction)
            matrix += np.kron(spring, unit - located.details.matrix[j])
    return matrix


def _damping(problem: HarmonicBalance, frequency: float, unknowns: FloatArray) -> FloatArray:
    """What contacts add to the matrix of ``lambda``, (n_unknowns, n_unknowns) [N s/m]."""
    relative = problem.layout.relative(unknowns)
    result = np.zeros((problem.n_unknowns, problem.n_unknowns))
    for group in problem.contacts.groups:
        if isinstance(group.law, MemorylessLaw):
            each = group.law.damping(problem.contacts.at(group, relative, frequency))
            spread = problem.equations.spreads(group)[0]
            result += spread.T @ scipy.linalg.block_diag(*each) @ spread
    return result


def _by_hill(
    problem: HarmonicBalance, frequency: float, jacobian: FloatArray, of_contacts: FloatArray
) -> Growth:
    model, basis = problem.model, problem.basis
    identity = np.eye(basis.n_components)
    mass, damping = model.mass_matrix.toarray(), model.damping_matrix.toarray()
    inertia = np.kron(mass, identity)
    first = 2 * frequency * np.kron(mass, basis.derivative_matrix) + np.kron(damping, identity)
    first += of_contacts
    size = problem.n_unknowns
    # In units of the frequency, so that both halves of the companion matrix are of one size.
    left = np.zeros((2 * size, 2 * size))
    left[:size, size:] = np.eye(size)
    right = np.hstack([jacobian / frequency**2, first / frequency])
    left[size:] = -np.linalg.solve(inertia, right)
    exponents = np.linalg.eigvals(left)
    # Copies of an exponent differ by harmonics; those far from zero suffer from truncation.
    # With odd harmonics alone two exponents may be equally near.
    distance = np.abs(exponents.imag)
    near = distance <= np.partition(distance, 2 * model.n_dof - 1)[2 * model.n_dof - 1] + _TIE
    leading = frequency * exponents[near][np.argmax(exponents[near].real)]
    return Growth(complex(leading), _doubling(problem, exponents.astype(complex)), _HILL)


def _doubling(problem: HarmonicBalance, exponents: NDArray[np.complex128]) -> float:
    """The product of `Growth`, NaN where truncation leaves open which exponents are copies."""
    parts = repeats(problem.harmonics, odd=True)
    # At the edges of the band those of one edge are copies of those of the other.
    low, high = _TIE - parts / 2, _TIE + parts / 2
    distinct = exponents[(exponents.imag > low) & (exponents.imag <= high)]
    if len(distinct) != 2 * problem.model.n_dof:
        return np.nan
    with np.errstate(over="ignore", invalid="ignore"):
        return _product(np.exp(2 * np.pi / parts * distinct))


def _product(values: NDArray[np.complex128]) -> float:
    """The product of ``1 + values``, NaN where it is too large."""
    with np.errstate(over="ignore", invalid="ignore"):
        product = float(np.prod(1 + values).real)
    return product if np.isfinite(product) else np.nan


def verdict(rate: float, frequency: float) -> int:
    """1 for stable, 0 for unstable, -1 for unknown."""
    if np.isnan(rate) or abs(rate) <= NEUTRAL * frequency:
        return -1
    return int(rate < 0)


def _slides(problem: HarmonicBalance, evaluation: Evaluation, frequency: float) -> bool:
    if problem.loads_move:
        return True
    slides = np.zeros(problem.n_contacts, dtype=bool)
    slides[problem.contacts.of_switches[evaluation.states.switches]] = True
    contact, _, stiffness, limit = problem.contacts.sliders(frequency)
    return bool(np.any(slides[contact] & (stiffness > 0) & (limit > 0)))
