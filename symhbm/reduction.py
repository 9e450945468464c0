"""What the masters of a large structure feel over a band, from few factorisations.

Motions of the interior at a few frequencies, exact, are a basis for all others between them. It
grows by the frequency whose equations it leaves least balanced, until the structure seen from the
masters is that of direct factorisations at frequencies that gave nothing to the basis.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import eig, eigh, qr

from symhbm.band_function import ComplexArray, PoleSum, at
from symhbm.fourier import FloatArray
from symhbm.interior import Interior

AIM = 1e-11
"""Error of the responses of the masters at which the basis is good enough."""
_CONFIRMED = 4
"""Frequencies in a row at which a basis has to be good enough."""
_MOST = 60
"""Direct factorisations after which a basis that is not good enough is given up."""
_GRID = 48
"""Frequencies per harmonic at which the balance of all equations is looked at."""
_NEW = 1e-8, 1e-13
"""Part of a motion outside of the basis that is new: its effect is quadratic if symmetric."""
_BATCH = 16


class Certificate(NamedTuple):
    """How a condensation was checked.

    ``error``, the largest difference of the responses of the masters to unit forces on them and to
    the excitations, contacts open, from those of direct factorisations of the whole structure,
    each relative to the norm of the response; ``frequencies`` (n,) [Hz], those of the last direct
    factorisations, none of which the basis was made from; ``n_factorisations``, all of them;
    ``n_basis``, the size of the basis.
    """

    error: float
    frequencies: FloatArray
    n_factorisations: int
    n_basis: int


class Reduced(NamedTuple):
    """An interior in the modes of a basis.

    ``whole``, the sum over its poles, ``[Z, G]`` as `Interior.seen`; ``lift`` (n_basis, n_poles),
    from its terms to the basis; ``undamped``, ``Z`` without damping and of symmetric matrices;
    ``held`` (n_basis,), natural frequencies of the interior [rad/s].
    """

    whole: PoleSum
    lift: ComplexArray
    undamped: PoleSum
    held: FloatArray


def reduce(interior: Interior, bands: list[tuple[float, float]]) -> tuple[Reduced, Certificate]:
    """What is seen of an interior over ``bands`` [rad/s], and how good that is.

    ValueError where a motion of the interior has no inertia.
    """
    grid = np.unique(np.concatenate([np.linspace(*band, _GRID) for band in bands]))
    used = np.isin(np.arange(len(grid)), [0, len(grid) // 2, len(grid) - 1])
    basis = np.zeros((len(interior.others), 0))
    for s in grid[used]:
        basis = _extended(basis, interior, interior.solve(s))
    count, errors, checked = int(used.sum()), [], []
    reduced = _reduced(interior, basis)
    doubt = _doubt(interior, basis, reduced, grid)
    while len(errors) < _CONFIRMED and not used.all():
        here = int(np.argmax(np.where(used, -1.0, doubt)))
        s, used[here] = grid[here], True
        motion = interior.solve(s)
        error = _error(reduced.whole(s), interior.seen(s, motion))
        count += 1
        if error > AIM and count < _MOST:
            size = basis.shape[1]
            basis = _extended(basis, interior, motion)
            if basis.shape[1] > size:
                errors, checked = [], []
                reduced = _reduced(interior, basis)
                doubt = _doubt(interior, basis, reduced, grid)
                continue
        errors.append(error)
        checked.append(s / (2 * np.pi))
    found = Certificate(max(errors, default=np.inf), np.array(checked), count, basis.shape[1])
    return reduced, found


def _extended(basis: FloatArray, interior: Interior, motion: ComplexArray) -> FloatArray:
    """An orthonormal basis with the ``motion`` at one more frequency."""
    motion[:, : len(interior.masters)] -= interior.static
    size = np.linalg.norm(motion, axis=0)
    motion /= np.where(size > 0, size, 1.0)
    added = np.hstack([motion.real, motion.imag]) if np.iscomplexobj(motion) else motion
    for _ in range(2):
        added -= basis @ (basis.T @ added)
    q, r, _ = qr(added, mode="economic", pivoting=True, overwrite_a=True)  # type: ignore
    new = np.asarray(q)[:, np.abs(r.diagonal()) > _NEW[not interior.symmetric]]
    # What is small beside the basis is so to round-off only once it is of unit size.
    for _ in range(2):
        new -= basis @ (basis.T @ new)
        new = qr(new, mode="economic", overwrite_a=True)[0]
    return np.hstack([basis, new])


def _reduced(interior: Interior, basis: FloatArray) -> Reduced:
    held, pull, push, inside = interior.projected(basis)
    stiffness, _, mass = inside
    try:
        squares, shapes = eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2)
    except np.linalg.LinAlgError:
        raise ValueError("mass_matrix: expected a positive definite matrix") from None
    stiffness, damping, _ = shapes.T @ inside @ shapes
    if interior.symmetric:
        stiffness = np.diag(stiffness.diagonal())
    # Displacements times natural frequencies, and velocities: nearly skew, so well conditioned.
    natural = np.sqrt(np.abs(stiffness.diagonal()))
    size = len(natural)
    upper = np.hstack([np.zeros((size, size)), np.diag(natural)])
    lower = np.hstack([-stiffness / natural, -damping])
    poles, vectors = eig(np.vstack([upper, lower]))  # type: ignore
    inputs = np.linalg.solve(vectors, np.eye(2 * size)[:, size:])
    lift = shapes @ (vectors[:size] / natural[:, None])
    whole = PoleSum(held.astype(complex), pull @ lift, (inputs @ shapes.T) @ push, poles)
    return Reduced(whole, lift, *_undamped(held[:, :, : len(held[0])], pull, push, squares, shapes))


def _undamped(
    held: FloatArray, pull: FloatArray, push: FloatArray, squares: FloatArray, shapes: FloatArray
) -> tuple[PoleSum, FloatArray]:
    """``Z`` without damping and of symmetric matrices, and natural frequencies of the interior."""
    no_damping = np.array([1.0, 0.0, 1.0])[:, None, None]
    natural = np.sqrt(np.maximum(squares, 0.0))
    share = np.array([1, -1]) / (2j * np.maximum(natural, 1e-300)[:, None])
    poles = 1j * natural[:, None] * [1, -1]
    left = no_damping * ((pull + push[:, :, : pull.shape[1]].transpose(0, 2, 1)) / 2 @ shapes)
    right = left.transpose(0, 2, 1)[:, :, None] * share[:, :, None]
    right = right.reshape(3, 2 * len(natural), len(held[0]))
    polynomial = no_damping * (held + held.transpose(0, 2, 1)) / 2
    whole = PoleSum(polynomial + 0j, np.repeat(left, 2, axis=2) + 0j, right, poles.ravel())
    return whole, natural


def _doubt(interior: Interior, basis: FloatArray, reduced: Reduced, grid: FloatArray) -> FloatArray:
    """How wrong the responses of the masters may be, up to a factor, along a grid [rad/s].

    What is left of all equations under random motions and forces, times how near a resonance is.
    """
    n, whole, lift = len(interior.masters), reduced.whole, reduced.lift
    load = np.random.default_rng(0).normal(size=interior.n_columns)
    sign = np.where(np.arange(len(load)) < n, -1.0, 1.0)
    static = interior.static @ load[:n]
    doubt = []
    for first in range(0, len(grid), _BATCH):
        some = grid[first : first + _BATCH]
        share = [at(whole.right, 1j * s) @ (sign * load) / (1j * s - whole.poles) for s in some]
        modal = lift @ np.array(share).T
        motions = static[:, None] + basis @ modal.real + 1j * (basis @ modal.imag)
        for s, motion in zip(some, motions.T, strict=True):
            rest = interior.imbalance(s, motion, load)
            power = 2 if interior.symmetric else 1
            doubt.append(rest**power * np.linalg.cond(whole(s)[:, :n]))
    return np.array(doubt)


def _error(reduced: ComplexArray, exact: ComplexArray) -> float:
    """Largest relative difference of the responses of the masters."""
    n = len(exact)
    response, reference = (
        np.linalg.solve(m[:, :n], np.hstack([np.eye(n), m[:, n:]])) for m in (reduced, exact)
    )
    size = np.linalg.norm(reference, axis=0)
    error = np.linalg.norm(response - reference, axis=0)
    return float(np.max(error / np.where(size > 0, size, 1.0)))
