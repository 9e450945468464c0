"""Condensed stiffness of a large structure over a band, from few factorisations.

Exact motions of the interior at a few frequencies are a basis for all others between them. It is
extended at the frequency of the largest residual, until the condensed stiffness agrees with direct
factorisations at frequencies that are not in the basis.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, eig, eigh, eigvals, eigvalsh, qr, solve_triangular

from symhbm.model.condensation.partition import Interior, adjoint
from symhbm.model.condensation.pole_residue import ModalMatrices, PoleSum, at, joined_blocks
from symhbm.model.linear import hermitian
from symhbm.model.records import record
from symhbm.numerics import ComplexArray, FloatArray
from symhbm.workers import progress_bar

AIM = 1e-11
"""Largest error of the responses of the masters."""
_CONFIRMED = 4
"""Successive frequencies at which a basis has to reach `AIM`."""
MOST = 60
"""Most direct factorisations."""
_GRID = 48
"""Frequencies per harmonic at which the residual of all equations is evaluated."""
_NEAR_RESONANCE = 1e-6
"""Relative distance of evaluations from a resonance: an undamped response is infinite there."""
_NEW = 1e-8, 1e-13
"""Share of a motion outside of the basis that is kept: its effect is quadratic if symmetric."""
_BATCH = 16
"""Motions whose residuals are evaluated at once: little memory."""


@record
class Certificate(NamedTuple):
    """Errors of a condensation, measured at single frequencies.

    ``error``, the largest difference of the linear responses of the masters, to unit forces on them
    and to the excitations, contacts open and contacts stuck, from those of direct factorisations of
    the whole structure, each relative to the norm of the response; ``friction_bound``, which holds
    for every response with friction, see `condense`; ``frequencies`` (n,) [Hz], those of the last
    direct factorisations, none of which the basis was made from; ``n_factorisations``, all of them;
    ``n_basis``, the size of the basis.
    """

    error: float
    friction_bound: float
    frequencies: FloatArray
    n_factorisations: int
    n_basis: int


class Reduced(NamedTuple):
    """An interior in the modes of a basis.

    ``whole``, the sum over its poles, ``[Z, G]`` as `Interior.solve`; ``lift`` (n_basis, n_poles),
    from its terms to the basis; ``undamped``, ``Z`` without damping and of symmetric matrices;
    ``fixed_frequencies`` (n_basis,), natural frequencies of the interior [rad/s]; ``modal``, the
    same by matrices, None where they are large.
    """

    whole: PoleSum
    lift: ComplexArray
    undamped: PoleSum
    fixed_frequencies: FloatArray
    modal: ModalMatrices | None = None


def reduce(
    interior: Interior,
    bands: list[tuple[float, float]],
    springs: NDArray,
    progress: bool | None = False,
) -> tuple[Reduced, Certificate]:
    """Condensed stiffness of an interior over ``bands`` [rad/s], and its certificate.

    ``springs`` (n_masters, n_masters) are the stiffness of stuck contacts.

    ValueError where a motion of the interior has no inertia.
    """
    states = np.zeros_like(springs), springs
    grid = np.unique(np.concatenate([np.linspace(*band, _GRID) for band in bands]))
    used = list(grid[[0, len(grid) // 2, len(grid) - 1]])
    basis = np.zeros((len(interior.others), 0), dtype=interior.dtype)
    bar = progress_bar("factorisation", progress)
    for s in used:
        basis = _extended(basis, interior, interior.solve(s, only_motion=True)[0], s)
        bar.update()
    view = _View(interior, basis, bands, grid, states)
    count, errors, bounds, checked = len(used), [], [], []
    while len(checked) < _CONFIRMED:
        # The last one is where round-off of the condensed stiffness is amplified most.
        worst = view.error_estimate if len(checked) < _CONFIRMED - 1 else view.amplification
        s = view.grid[np.argmax(np.where(np.isin(view.grid, used), -1.0, worst))]
        used.append(s)
        motion, exact = interior.solve(s)
        bar.update()
        approximate = view.reduced.whole(s)
        error = max(_error(approximate, exact, state) for state in states)
        count += 1
        if error > AIM and count < MOST:
            size = basis.shape[1]
            basis = _extended(basis, interior, motion, s)
            if basis.shape[1] > size:
                view = _View(interior, basis, bands, grid, states)
                errors, bounds, checked = [], [], []
                continue
        errors.append(error)
        if s < 0:  # the conjugate is the condensed stiffness of the wave of the other sense
            approximate, exact = approximate.conj(), exact.conj()
        bounds.append(_friction_bound(approximate, exact))
        checked.append(abs(s) / (2 * np.pi))
    bar.close()
    certificate = Certificate(max(errors), max(bounds), np.array(checked), count, basis.shape[1])
    return view.reduced, certificate


class _View:
    """The condensed stiffness by a basis, and estimates of its error over the frequency.

    ``grid`` (n,) [rad/s] are frequencies, resonances among them; ``error_estimate`` (n,) are errors
    of the responses of the masters, up to a factor; ``amplification`` (n,), see `_growth`.
    """

    def __init__(
        self,
        interior: Interior,
        basis: NDArray,
        bands: list[tuple[float, float]],
        grid: FloatArray,
        states: tuple[NDArray, NDArray],
    ):
        blocks = interior.projected(basis)
        self.reduced = _reduced(interior, blocks)
        resonances = [_resonances(blocks, state, bands) for state in states]
        self.grid = np.unique(np.concatenate([grid, *resonances]))
        self.amplification = _growth(self.reduced, self.grid, states)
        self.error_estimate = self.amplification * _error_estimates(
            interior, basis, self.reduced, self.grid
        )


def _resonances(
    blocks: list[NDArray], springs: NDArray, bands: list[tuple[float, float]]
) -> FloatArray:
    """Angular frequencies next to the resonances of the masters with ``springs`` on them.

    Where there are many, a limited number is spread over all within the ``bands``.
    """
    stiffness, _, mass = joined_blocks(*blocks)
    n = len(springs)
    stiffness[:n, :n] += springs
    try:
        squares = eigvalsh(hermitian(stiffness), hermitian(mass))
    except np.linalg.LinAlgError:  # masters without inertia
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = np.asarray(eigvals(stiffness, mass))
    natural = np.real(np.sqrt(np.asarray(squares, dtype=complex)))
    natural = np.concatenate([natural, -natural])
    within = [natural[(low < natural) & (natural < high)] for low, high in bands]
    inside_bands = np.unique(np.concatenate(within)) * (1 + _NEAR_RESONANCE)
    chosen = np.linspace(0, len(inside_bands) - 1, min(len(inside_bands), _GRID))
    return inside_bands[chosen.astype(int)]


def _extended(basis: NDArray, interior: Interior, motion: NDArray, s: float) -> NDArray:
    """An orthonormal basis with the ``motion`` at one more frequency.

    Of a wave also with that at ``-s``, which is the motion of the adjoint equations, as the
    conjugate of a motion is of real ones.
    """
    motions = [motion]
    if np.iscomplexobj(basis) and interior.damped:
        motions.append(interior.solve(-s, only_motion=True)[0])
    for each in motions:
        each[:, : len(interior.masters)] -= interior.static
    motion = motion if len(motions) == 1 else np.hstack(motions)
    motion = motion.astype(complex if np.iscomplexobj(motion) else float)
    size = np.linalg.norm(motion, axis=0)
    motion /= np.where(size > 0, size, 1.0)
    splits = np.iscomplexobj(motion) and not np.iscomplexobj(basis)
    added = np.hstack([np.real(motion), np.imag(motion)]) if splits else motion
    transposed = adjoint(basis)
    for _ in range(2):
        added -= basis @ (transposed @ added)
    q, r, _ = qr(added, mode="economic", pivoting=True, overwrite_a=True)  # type: ignore
    new = np.asarray(q)[:, np.abs(r.diagonal()) > _NEW[not interior.symmetric]]
    # A vector of unit size is orthogonal to the basis to round-off only after a second projection.
    for _ in range(2):
        new -= basis @ (transposed @ new)
        new = qr(new, mode="economic", overwrite_a=True)[0]
    return np.hstack([basis, new])


def _reduced(interior: Interior, blocks: list[NDArray]) -> Reduced:
    masters, pull, push, inside = blocks
    n = len(masters[0])
    stiffness, _, mass = inside
    try:
        squares, shapes = eigh(hermitian(stiffness), hermitian(mass))
    except np.linalg.LinAlgError:
        raise ValueError("mass_matrix: expected a positive definite matrix") from None
    stiffness, damping, mass = adjoint(shapes) @ inside @ shapes
    if interior.symmetric:
        stiffness = np.diag(stiffness.diagonal())
    undamped = _undamped(masters[:, :, :n], pull, push, squares, shapes)
    if interior.lossy != 1:
        stiffness = interior.lossy * stiffness
        masters, pull, push = (part.astype(complex) for part in (masters, pull, push))
        for part in (masters, pull, push):
            part[0, :, : n if part is not pull else None] *= interior.lossy
    # Displacements times natural frequencies, and velocities: nearly skew, so well conditioned.
    natural = np.sqrt(np.abs(np.real(stiffness.diagonal())))
    size = len(natural)
    upper = np.hstack([np.zeros((size, size)), np.diag(natural)])
    lower = np.hstack([-stiffness / natural, -damping])
    poles, vectors = eig(np.vstack([upper, lower]))  # type: ignore
    inputs = np.linalg.solve(vectors, np.eye(2 * size)[:, size:])
    lift = shapes @ (vectors[:size] / natural[:, None])
    right = np.asarray((inputs @ adjoint(shapes)) @ push, dtype=complex)
    whole = PoleSum(masters.astype(complex), pull @ lift, right, poles)
    inside = np.array([stiffness, damping, mass])
    modal = ModalMatrices.of(masters, pull @ shapes, adjoint(shapes) @ push, inside)
    return Reduced(whole, lift, *undamped, modal)


def _undamped(
    masters: NDArray, pull: NDArray, push: NDArray, squares: FloatArray, shapes: NDArray
) -> tuple[PoleSum, FloatArray]:
    """``Z`` without damping and of symmetric matrices, and natural frequencies of the interior."""
    no_damping = np.array([1.0, 0.0, 1.0])[:, None, None]
    natural = np.sqrt(np.maximum(squares, 0.0))
    share = np.array([1, -1]) / (2j * np.maximum(natural, 1e-300)[:, None])
    poles = 1j * natural[:, None] * [1, -1]
    left = no_damping * ((pull + adjoint(push[:, :, : pull.shape[1]])) / 2 @ shapes)
    right = adjoint(left)[:, :, None] * share[:, :, None]
    right = right.reshape(3, 2 * len(natural), len(masters[0]))
    polynomial = no_damping * (masters + adjoint(masters)) / 2
    whole = PoleSum(polynomial + 0j, np.repeat(left, 2, axis=2) + 0j, right, poles.ravel())
    return whole, natural


def _growth(reduced: Reduced, grid: FloatArray, states: Sequence[NDArray]) -> FloatArray:
    """Amplification of errors of the condensed stiffness in responses of the masters, on a grid.

    The largest of all states of springs and all loads; terms that cancel count in full.
    """
    n = len(states[0])
    growths = []
    for s in grid:
        matrix, terms = reduced.whole(s), reduced.whole.terms(s)
        growth = []
        for state in states:
            receptance = np.linalg.inv(matrix[:, :n] + state)
            response = np.hstack([receptance, receptance @ matrix[:, n:]])
            load = terms[:, :n] @ np.abs(response)
            load[:, n:] += terms[:, n:]
            error = np.linalg.norm(np.abs(receptance) @ load, axis=0)
            size = np.linalg.norm(response, axis=0)
            growth.append(np.max(error / np.where(size > 0, size, np.inf)))
        growths.append(max(growth))
    return np.array(growths)


def _error_estimates(
    interior: Interior, basis: NDArray, reduced: Reduced, grid: FloatArray
) -> FloatArray:
    """Errors of the condensed stiffness, up to a factor, on a grid [rad/s].

    They are residuals of all equations under random motions and forces.
    """
    n, whole, lift = len(interior.masters), reduced.whole, reduced.lift
    load = np.random.default_rng(0).normal(size=interior.n_columns)
    sign = np.where(np.arange(len(load)) < n, -1.0, 1.0)
    static = (interior.static @ load[:n]).astype(interior.dtype)
    residuals = []
    for first in range(0, len(grid), _BATCH):
        some = grid[first : first + _BATCH]
        share = [at(whole.right, 1j * s) @ (sign * load) / (1j * s - whole.poles) for s in some]
        modal = lift @ np.array(share).T
        if np.iscomplexobj(basis):
            motions = static[:, None] + basis @ modal
        else:
            motions = static[:, None] + basis @ modal.real + 1j * (basis @ modal.imag)
        residuals += interior.residual(some, motions, load).tolist()
    # The error of a symmetric condensed stiffness is quadratic in the residual.
    return np.array(residuals) ** (2 if interior.symmetric else 1)


def _error(reduced: ComplexArray, exact: Any, springs: NDArray) -> float:
    """Largest relative difference of the responses of the masters with ``springs`` on them."""
    n = len(exact)
    load = np.hstack([np.eye(n), reduced[:, n:]])
    response = np.linalg.solve(reduced[:, :n] + springs, load)
    # In the precision of ``exact``: large forces of stiff surroundings cancel.
    load = np.hstack([np.eye(n), exact[:, n:]])
    rest = load - (exact[:, :n] + springs) @ response
    stiffness = exact[:, :n].astype(complex) + springs
    error = np.linalg.norm(np.linalg.solve(stiffness, rest.astype(complex)), axis=0)
    size = np.linalg.norm(response, axis=0)
    return float(np.max(error / np.where(size > 0, size, 1.0)))


def _friction_bound(reduced: ComplexArray, exact: Any) -> float:
    """Largest difference of responses with friction, see `condense`, infinite without damping."""
    n = len(exact)
    stiffness = exact[:, :n].astype(complex)
    try:
        root = cholesky((stiffness - stiffness.conj().T) / 2j, lower=True)
    except np.linalg.LinAlgError:
        return np.inf
    rest = solve_triangular(root, (exact - reduced).astype(complex), lower=True)
    stiffness_error = solve_triangular(root, rest[:, :n].conj().T, lower=True)
    responses = root.conj().T @ np.linalg.solve(stiffness, exact[:, n:].astype(complex))
    sizes = np.linalg.norm(responses, axis=0)
    forced = np.linalg.norm(rest[:, n:], axis=0) / np.where(sizes > 0, sizes, 1.0)
    return float(max(np.linalg.norm(stiffness_error, 2), forced.max(initial=0.0)))
