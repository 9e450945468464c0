"""Natural modes of mass and stiffness matrices, of structures by nodal diameter, and their band."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import eig, eigh
from scipy.sparse.linalg import LinearOperator, eigs, eigsh, splu

from symhbm.model.linear.low_rank import LowRankSum, definite, factorised
from symhbm.numerics import DENSE_LIMIT, RADIANS, ComplexArray, FloatArray, check

_BELOW = 1e-9
"""Where modes are looked for, below zero, as a share of the square of a high natural frequency."""
_ROUND_OFF = 1e-12
"""Share of a damping matrix that is no Coriolis force."""
_GROWS = 1e-9
"""Imaginary part of an inverse frequency, over the largest one, that is no round-off."""
_MOST = 0.5
"""Share of all modes from which on all of them are computed at once."""


class NearModes(NamedTuple):
    """All modes of a structure with its contacts as springs, ascending, arrays (n_modes,).

    ``detuning``, the natural less the exciting frequency [rad/s]; ``width``, half that of the
    resonance [rad/s]; ``near``, whether a mode is near enough for both to be of it; ``shapes``
    (n_dof, n_near), the motions of those that are, of unit mass.
    """

    detuning: FloatArray
    width: FloatArray
    near: NDArray[np.bool_]
    shapes: FloatArray


class Matrices(NamedTuple):
    """Mass, damping and stiffness matrices of a structure, sparse (n_dof, n_dof)."""

    mass_matrix: Any
    damping_matrix: Any
    stiffness_matrix: Any

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom."""
        return int(self.mass_matrix.shape[0])


def lowest_modes(
    stiffness: Any, mass: Any, count: int | None = None, growing: str | None = None
) -> tuple[FloatArray, NDArray]:
    """The ``count`` lowest modes, all by default: squares of frequencies, shapes of unit mass.

    Ascending, (n_modes,) [rad^2/s^2] and (n_dof, n_modes) [kg^-1/2]. ``stiffness`` and ``mass`` are
    sparse, real symmetric or complex Hermitian. Degrees of freedom without mass follow the others;
    there are fewer modes with them.

    ValueError where some motion has neither mass nor stiffness, or if the modes are not found;
    with the text ``growing`` also where a square is negative, but for round-off.
    """
    size = mass.shape[0]
    stiffness = hermitian(stiffness)
    below = _below(stiffness, mass)
    try:
        if size <= DENSE_LIMIT or count is None or count > _MOST * size:
            squares, shapes = all_modes(stiffness.toarray(), mass.toarray())
            held = bool(squares.min(initial=0.0) >= below)
        else:
            squares, shapes, held = _some(sp.csc_array(stiffness), sp.csc_array(mass), count, below)
    except (np.linalg.LinAlgError, RuntimeError) as error:
        raise ValueError(
            "mass_matrix: expected one that gives every motion without stiffness some inertia; its "
            f"modes cannot be computed ({error})"
        ) from error
    if growing is not None and not held:
        raise ValueError(f"{growing}; a square is {squares.min():.6g} rad^2/s^2")
    order = np.argsort(squares)[:count]
    return squares[order], shapes[:, order]


def gyroscopic_part(damping: Any) -> Any:
    """What of a damping matrix takes no power, None where that is round-off.

    Factors of low rank are those of modes, which all take power.
    """
    if isinstance(damping, LowRankSum):
        damping = damping.sparse
    skew = (damping - damping.conj().T) / 2
    return skew if abs(skew).max() > _ROUND_OFF * abs(damping).max() else None


def lowest_gyroscopic(
    stiffness: Any, gyroscopic: Any, mass: Any, count: int
) -> tuple[FloatArray, NDArray]:
    """The lowest modes of ``K + i omega G - omega^2 M``, ``G`` skew-Hermitian: frequencies, shapes.

    Ascending, (count,) [rad/s] and (n_dof, count), complex, of unit mass. With ``psi = omega x``
    they are those of a Hermitian pair, ``omega [[-i G, M], [M, 0]] z = [[K, 0], [0, M]] z``. A
    stiffness that is not positive definite, as spin softening leaves it above a critical speed, has
    modes where Coriolis forces hold it.

    ValueError where they do not, and for a mass that is not positive definite.
    """
    size = mass.shape[0]
    stiffness, zero = hermitian(stiffness), sp.csc_array(mass.shape)
    left = sp.block_array([[-1j * gyroscopic, mass], [mass, zero]], format="csc")
    right = sp.block_array([[stiffness, None], [None, mass]], format="csc").astype(complex)
    try:
        if 2 * size <= DENSE_LIMIT or count > _MOST * size:
            try:
                inverse, both = eigh(left.toarray(), right.toarray())
            except np.linalg.LinAlgError:
                inverse, both = _held(*eig(left.toarray(), right.toarray()))  # type: ignore
        else:
            start = np.random.default_rng(0).normal(size=2 * size).astype(complex)
            if definite(stiffness) is not None:
                solve: Any = LinearOperator(right.shape, matvec=splu(right).solve, dtype=complex)  # type: ignore
                inverse, both = eigsh(left, count, right, which="LA", Minv=solve, v0=start)
            else:
                inverse, both = _some_held(left, right, count, start)
    except (np.linalg.LinAlgError, RuntimeError) as error:
        raise ValueError(
            "stiffness_matrix, mass_matrix: expected positive definite ones, or Coriolis "
            f"forces that hold the motion; its modes cannot be computed ({error})"
        ) from error
    order = np.argsort(-inverse)[: min(count, np.count_nonzero(inverse > 0))]
    shapes = both[:size, order]
    inertia = np.sum(shapes.conj() * (mass @ shapes), axis=0).real
    return 1 / inverse[order], shapes / np.sqrt(inertia)


def _some_held(left: Any, right: Any, count: int, start: NDArray) -> tuple[FloatArray, NDArray]:
    """As `_held`, ``count`` positive ones: Lanczos needs a definite pair, Arnoldi none."""
    solve = splu(right).solve
    operator: Any = LinearOperator(right.shape, matvec=lambda z: solve(left @ z), dtype=complex)  # type: ignore
    # Those of both signs come by their size.
    wanted, most = 2 * count, len(start) - 2
    while True:
        wanted = min(wanted, most)
        inverse, both = _held(*eigs(operator, wanted, which="LM", v0=start))
        if wanted == most or np.count_nonzero(inverse > 0) >= count:
            return inverse, both
        wanted *= 2


def _held(inverse: NDArray, both: NDArray) -> tuple[FloatArray, NDArray]:
    """Inverse frequencies and vectors of a pair of an indefinite stiffness.

    LinAlgError where a motion grows.
    """
    if np.abs(np.imag(inverse)).max() > _GROWS * np.abs(inverse).max():
        raise np.linalg.LinAlgError("a motion grows, the stiffness is not positive definite")
    return np.real(inverse), both


def hermitian(matrix: Any) -> Any:
    """The part of a matrix that is Hermitian."""
    return (matrix + matrix.conj().T) / 2


def all_modes(stiffness: NDArray, mass: NDArray) -> tuple[FloatArray, NDArray]:
    """As `lowest_modes`, of arrays; LinAlgError, a ValueError, as it does."""
    moving = np.real(mass.diagonal()) > 0
    if moving.all():
        squares, shapes = eigh(stiffness, mass)
        return squares, shapes
    still = ~moving
    # Static condensation: what has no mass is where the forces on it vanish.
    follows = -np.linalg.solve(stiffness[np.ix_(still, still)], stiffness[np.ix_(still, moving)])
    condensed = stiffness[np.ix_(moving, moving)] + stiffness[np.ix_(moving, still)] @ follows
    squares, own = eigh(hermitian(condensed), mass[np.ix_(moving, moving)])
    shapes = np.empty((len(mass), own.shape[1]), dtype=own.dtype)
    shapes[moving], shapes[still] = own, follows @ own
    return squares, shapes


def _below(stiffness: Any, mass: Any) -> float:
    """A square of a frequency below zero by more than round-off."""
    inertia = mass.diagonal().real
    moving = inertia > 0
    highest = np.abs(stiffness.diagonal()[moving]) / inertia[moving]
    return -_BELOW * float(np.max(highest, initial=0.0))


def _some(stiffness: Any, mass: Any, count: int, shift: float) -> tuple[FloatArray, NDArray, bool]:
    """Modes next to a shift, and whether there are none below it."""
    shifted = (stiffness - shift * mass).tocsc()
    held = definite(shifted)
    # SciPy keeps the operator of a complex pair in a circle of references, until Python looks for
    # those: without the factors, which are gigabytes over many speeds.
    factors = [factorised(shifted) if held is None else held]
    dtype = shifted.dtype
    inverse: Any = LinearOperator(shifted.shape, lambda x: factors[0].solve(x), dtype=dtype)  # type: ignore
    start = np.random.default_rng(0).normal(size=mass.shape[0]).astype(dtype)
    try:
        squares, shapes = eigsh(stiffness, count, mass, sigma=shift, OPinv=inverse, v0=start)
    finally:
        factors.clear()
    # Where many are close, those found are orthogonal to round-off of the iteration only.
    small = [shapes.conj().T @ (matrix @ shapes) for matrix in (stiffness, mass)]
    squares, turned = eigh(*map(hermitian, small))
    return squares, shapes @ turned, held is not None


_GROWING = (
    "stiffness_matrix: expected a positive semidefinite one, or Coriolis forces that hold the "
    "motion; one grows, and has no natural frequency"
)


def natural_modes_of(
    structure: Any, nodal_diameter: int | None, count: int, stuck: bool = False
) -> tuple[FloatArray, ComplexArray]:
    """The lowest natural frequencies (count,) [Hz], ascending, and modes (n_whole, count).

    Modes are of unit mass, of one sector where it is one. Contacts are open, or ``stuck``. What of
    the damping matrix takes no power, Coriolis forces, counts. Raises ValueError where some motion
    has neither mass nor stiffness, or grows.
    """
    mass, damping, stiffness = structure.matrices(nodal_diameter)
    if stuck:
        directions = structure.directions_of(nodal_diameter)
        springs = sp.diags_array(structure.groups.stuck_springs)
        stiffness = stiffness + directions.conj().T @ springs @ directions
    gyroscopic = gyroscopic_part(damping)
    if gyroscopic is None:
        squares, shapes = lowest_modes(stiffness, mass, count, _GROWING)
        natural = np.sqrt(np.maximum(squares, 0.0))
    else:
        natural, shapes = lowest_gyroscopic(stiffness, gyroscopic, mass, count)
    return natural / RADIANS, structure.expanded(shapes, nodal_diameter)


_LOW, _HIGH = 0.2, 1.2
"""Ends of a band over the natural frequencies nearest to them."""
_ZERO = 1e-6
"""Share of the highest natural frequency below which one is that of a free motion."""
_LOWEST = 12
"""Natural frequencies of a large structure that are looked at: more than it has free motions."""


def natural_band(models: Sequence[Any]) -> tuple[float, float]:
    """Band [Hz] from below all natural frequencies without contacts to above all with them stuck.

    ``models`` are of one structure with different parameters, the band holds the resonances of all.
    A condensed one has the band that it was condensed for.
    Raises ValueError for a structure without a natural frequency, or with a motion without inertia.
    """
    if models[0].frequency is not None:
        return models[0].frequency
    if models[0].n_dof > DENSE_LIMIT:
        check.warn(
            f"frequency=None: a band that holds all of more than {models[0].n_dof:,} resonances "
            "takes long to follow; give a band in Hz, and condense the structure for it by "
            "symhbm.condense"
        )
    lowest, highest = zip(*map(_extremes, models), strict=True)
    return float(_LOW * min(lowest)), float(_HIGH * max(highest))


def _extremes(model: Any) -> tuple[float, float]:
    """Lowest natural frequency that is not zero and highest one [Hz]."""
    directions = model.directions
    springs = directions.T @ sp.diags_array(model.groups.stiffest_springs) @ directions
    stuck = model.stiffness_matrix + springs
    try:
        free = _squares(model.stiffness_matrix, model.mass_matrix)
        held = _squares(stuck, model.mass_matrix)
    except (np.linalg.LinAlgError, RuntimeError) as error:
        raise ValueError(
            "frequency=None: expected a structure whose mass matrix is positive definite and whose "
            f"natural frequencies can be computed ({error}); give a band in Hz"
        ) from error
    highest = held.max()
    moving = np.concatenate([free, held])
    moving = moving[moving > _ZERO**2 * highest]
    if highest <= 0 or not moving.size:
        raise ValueError(
            "frequency=None: expected a structure with a natural frequency above zero, "
            "this one has no stiffness; give a band in Hz"
        )
    return np.sqrt(float(moving.min())) / (2 * np.pi), np.sqrt(float(highest)) / (2 * np.pi)


def _squares(stiffness: Any, mass: Any) -> np.ndarray:
    """Squares of natural angular frequencies: all, or the lowest and the highest of many."""
    stiffness = 0.5 * (stiffness + stiffness.T)
    if mass.shape[0] <= DENSE_LIMIT:
        return eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)
    stiffness, mass = stiffness.tocsc(), mass.tocsc()
    highest = np.max(eigsh(stiffness, 1, mass, which="LM", return_eigenvectors=False))
    # A little below zero the shifted matrix is regular, free motions or not.
    shift = -1e-9 * highest
    low = eigsh(stiffness, _LOWEST, mass, sigma=shift, which="LM", return_eigenvectors=False)
    return np.append(low, highest)


def weighted(columns: NDArray, factors: NDArray) -> NDArray:
    """Columns (n, m) times their factors (m,), or times a matrix (m, m) that couples them."""
    return columns * factors if factors.ndim == 1 else columns @ factors
