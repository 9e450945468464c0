"""Matrices and bands that can hardly be meant: in the wrong order, or in other units.

Nothing here is an error: springs may do work around a cycle, and a band may lie where nothing
resonates. One warning tells what is unusual, with its figures.
"""

import warnings
from collections.abc import Collection, Sequence

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

from symhbm import check
from symhbm.fourier import FloatArray
from symhbm.model import Model

DOUBT = "is this what was meant"
"""How the warning begins."""
_UNSYMMETRIC = 1e-6
"""Difference of two entries of a stiffness matrix, relative to the largest, that is round-off."""
_FAR, _ABOVE = 5.0, 2.0
"""Ratio of frequencies from which a band is far from a resonance, and above the highest one."""
_DENSE = 300
_STEPS = 4


def warn_of_doubts(
    model: Model,
    band: tuple[float, float],
    harmonics: Sequence[int] = (1,),
    *,
    moving: Collection[str] = (),
    depth: int = 3,
) -> None:
    """Emit one warning if matrices or band [Hz] are hardly what was meant.

    Of a band of one frequency it is no matter that it lies below all resonances: responses there
    are static ones. Parameters that are ``moving`` have other values than those of the model.
    ``depth`` is that of the user's call.
    """
    said = [_of_symmetry(model)]
    if not {"mass", "damping", "stiffness"} & {*moving}:
        said.append(_of_damping(model))
    if not {"mass", "stiffness", "contact_stiffness", "cubic_stiffness"} & {*moving}:
        said.append(_of_band(model, band, harmonics))
    said = [doubt for doubt in said if doubt]
    if said:
        warnings.warn(f"{DOUBT}? {'; '.join(said)}", stacklevel=depth)


def _of_symmetry(model: Model) -> str:
    stiffness = model.stiffness_matrix
    difference = abs(stiffness - stiffness.T).tocoo()
    largest = abs(stiffness).max() if stiffness.nnz else 0.0
    if not difference.nnz or difference.max() <= _UNSYMMETRIC * largest:
        return ""
    at = int(np.argmax(difference.data))
    i, j = sorted((int(difference.row[at]), int(difference.col[at])))
    one, other = check.told_apart(stiffness[i, j], stiffness[j, i])
    return (
        f"stiffness_matrix is not symmetric: entry {i, j} is {one}, entry {j, i} is {other}; "
        "springs are symmetric, what is skew belongs into damping_matrix if it is gyroscopic"
    )


def _of_damping(model: Model) -> str:
    """Damping above the critical one at every degree of freedom."""
    mass, damping, stiffness = (
        getattr(model, f"{name}_matrix").diagonal() for name in ("mass", "damping", "stiffness")
    )
    springs = abs(model.directions).T @ model.contact_stiffness
    stiffness = np.where(stiffness > 0, stiffness, springs)
    critical = 2 * np.sqrt(mass * stiffness)
    if np.any(damping <= critical):
        return ""
    least = np.min(damping / np.where(critical > 0, critical, np.nan), initial=np.inf)
    ratio = f"at least {least:.3g} times the critical one" if np.isfinite(least) else "all there is"
    return (
        f"damping is {ratio} at every degree of freedom; matrices come in the order mass, damping, "
        "stiffness"
    )


def _of_band(model: Model, band: tuple[float, float], harmonics: Sequence[int]) -> str:
    if np.any(model.cubic_stiffness):
        return ""  # cubic springs move resonances as far as the motion is large
    low, high = min(band), max(band)
    of_one, reach = low == high, max(_FAR, *harmonics)
    if model.n_dof > _DENSE:
        lower, upper = _bounds(model, high)
        far = upper * _FAR < low or (lower > reach * high and not of_one)
        nearest = upper if upper < low else lower
    else:
        lower, upper = _resonances(model, high)
        if not len(lower):
            return ""
        below, above = upper * _FAR < low, lower > reach * high
        far = bool(np.all(upper * _ABOVE < low)) if not of_one else bool(np.all(below))
        far = far or (bool(np.all(below | above)) and not of_one)
        distance = np.where(upper < low, low / np.maximum(upper, 1e-300), lower / high)
        closest = int(np.argmin(distance))
        nearest = upper[closest] if upper[closest] < low else lower[closest]
    if not far or not np.isfinite(nearest):
        return ""
    side, edge = ("above", low) if nearest < low else ("below", high)
    ratio = edge / nearest if nearest < low else nearest / edge
    what = f"frequency={edge:g} Hz" if of_one else f"the band {low:g} to {high:g} Hz"
    return (
        f"{what} lies {ratio:.3g} times {side} the nearest natural frequency, {nearest:.4g} Hz; "
        "frequencies are in Hz, not in rad/s or rpm, matrices in SI units"
    )


def _matrices(model: Model) -> tuple[sp.csc_array, sp.csc_array, sp.csc_array]:
    """Mass, and symmetric stiffness with all contacts free and with all held by their springs."""
    stiffness = 0.5 * (model.stiffness_matrix + model.stiffness_matrix.T)
    springs = model.directions.T @ sp.diags_array(model.contact_stiffness) @ model.directions
    return model.mass_matrix, stiffness.tocsc(), (stiffness + springs).tocsc()


def _resonances(model: Model, hertz: float) -> tuple[FloatArray, FloatArray]:
    """Between which frequencies [Hz] each mode lies, as contacts slip or stick; none if unknown."""
    mass, *stiffnesses = (matrix.toarray() for matrix in _matrices(model))
    # About a band, so that neither free bodies nor motions without inertia are singular.
    shift = (2 * np.pi * hertz) ** 2
    found = []
    for stiffness in stiffnesses:
        try:
            shares = eigh(mass, stiffness + shift * mass, eigvals_only=True)[::-1]
        except np.linalg.LinAlgError:
            return np.array([]), np.array([])
        with np.errstate(divide="ignore"):
            squares = 1 / np.maximum(shares, 0.0) - shift
        found.append(np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi))
    return found[0], found[1]


def _bounds(model: Model, hertz: float) -> tuple[float, float]:
    """Lowest natural frequency or more, and highest or less [Hz], of a large structure.

    The quotient of Rayleigh after some inverse iterations, and that of single degrees of freedom.
    """
    mass, free, held = _matrices(model)
    inertia = mass.diagonal()
    moving = inertia > 0
    highest = np.max(held.diagonal()[moving] / inertia[moving], initial=0.0)
    try:
        factors = splu((free + (2 * np.pi * hertz) ** 2 * mass).tocsc())
    except RuntimeError:  # SuperLU: exactly singular
        return 0.0, np.inf
    motion = np.random.default_rng(0).uniform(0.5, 1.5, model.n_dof)
    for _ in range(_STEPS):
        motion = factors.solve(mass @ motion)
        motion /= np.abs(motion).max()
    lowest = motion @ (free @ motion) / (motion @ (mass @ motion))
    lowest, highest = (np.sqrt(max(float(square), 0.0)) for square in (lowest, highest))
    return lowest / (2 * np.pi), highest / (2 * np.pi)
