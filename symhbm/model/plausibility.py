"""Matrices and bands that can hardly be meant: in the wrong order, or in other units.

Nothing here is an error: springs may do work around a cycle, and a band may lie where nothing
resonates. One warning tells what is unusual, with its figures. Another one tells what is better
condensed: large structures that few contacts touch.
"""

from collections.abc import Collection, Sequence
from weakref import WeakKeyDictionary

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

from symhbm.model.structure import Structure
from symhbm.numerics import FloatArray, check

DOUBT = "is this what was meant"
"""How the warning begins."""
_UNSYMMETRIC = 1e-6
"""Difference of two entries of a stiffness matrix, relative to the largest, that is round-off."""
_FAR, _ABOVE, _ALONE = 5.0, 2.0, 20.0
"""Ratio of frequencies from which a band is far from resonances, a band is above all of them, and
one frequency is."""
_DENSE = 300
_STEPS = 4
_LAST: WeakKeyDictionary[Structure, tuple[tuple, str]] = WeakKeyDictionary()
"""Of each structure the last call and what was said: modes take longer than a point."""
LARGE = 100_000
"""Entries of a stiffness matrix from which compiling it takes longer (5 s) than condensing it."""
MANY = 400
"""Unknowns from which second derivatives and stability take minutes, or are not computed."""
_FEW = 4
"""Degrees of freedom for each one that contacts touch, from which condensing is worth it."""


def warn_of_doubts(
    model: Structure,
    band: tuple[float, float],
    harmonics: Sequence[int] = (1,),
    *,
    moving: Collection[str] = (),
    driven: bool = True,
) -> None:
    """Emit one warning if matrices or band [Hz] are hardly what was meant.

    Of a band of one frequency it is no matter that it lies below all resonances: responses there
    are static ones. A problem is ``driven`` by a force that oscillates. Parameters that are
    ``moving`` have other values than those of the model.
    Nothing is said of a structure without matrices.
    """
    if not model.has_matrices:
        return
    call = band, tuple(harmonics), frozenset(moving), driven
    known, said = _LAST.get(model, (None, ""))
    if known != call:
        said = _doubts(model, *call)
        _LAST[model] = call, said
    if said:
        check.warn(f"{DOUBT}? {said}")


def _doubts(
    model: Structure,
    band: tuple[float, float],
    harmonics: Sequence[int],
    moving: Collection[str],
    driven: bool,
) -> str:
    """All doubts, an empty text without any."""
    if not driven:
        return "no force oscillates; HarmonicBalance(model, excitation) takes one"
    springs = model.groups.stuck_springs
    said = [_of_symmetry(model), _of_effect(model, moving), _of_harmonics(model, harmonics)]
    # Above a critical speed Coriolis forces hold what spin softening leaves without stiffness.
    softened = bool(np.any(model.stiffness_matrix.diagonal() < 0))
    if not softened and not {"mass", "damping", "stiffness"} & {*moving}:
        said.append(_of_damping(model, springs))
    stiff = {"mass", "stiffness", "contact_stiffness", "cubic_stiffness"}
    if not softened and not stiff & {*moving}:
        said.append(_of_band(model, springs, band, harmonics))
    return "; ".join(doubt for doubt in said if doubt)


def _of_symmetry(model: Structure) -> str:
    if model.lumped:
        return ""  # a diagonal
    stiffness = model.stiffness_matrix - model.stiffness_of_air
    difference = abs(stiffness - stiffness.T).tocoo()
    largest = abs(stiffness).max() if stiffness.nnz else 0.0
    if not difference.nnz or difference.max() <= _UNSYMMETRIC * largest:
        return ""
    at = int(np.argmax(difference.data))
    i, j = sorted((int(difference.row[at]), int(difference.col[at])))
    one, other = check.told_apart(stiffness[i, j], stiffness[j, i])
    return (
        f"stiffness_matrix is not symmetric: entry {i, j} is {one}, entry {j, i} is {other}; "
        "springs are symmetric unless they do work around a cycle, and what is gyroscopic belongs "
        "into damping_matrix"
    )


def _of_effect(model: Structure, moving: Collection[str]) -> str:
    """A parameter that moves and does nothing, as another one of its law is 0 all the time."""
    idle, nothing = [], []
    for group in model.groups:
        values = group.values
        moves = {own: name for own, name in group.parameters.items() if name in moving}
        if moves and not group.law.acts(values | dict.fromkeys(moves, np.ones(group.n))).any():
            idle += moves.values()
            fixed = {own: name for own, name in group.parameters.items() if own not in moves}
            nothing += [name for own, name in fixed.items() if not values[own].any()]
    if not (nothing and idle and model.n_contacts):
        return ""
    has, are = ("has" if len(idle) == 1 else "have"), ("is" if len(nothing) == 1 else "are")
    return (
        f"{' and '.join(idle)} {has} no effect, as {' and '.join(nothing)} {are} 0 at every contact"
    )


def _of_harmonics(model: Structure, harmonics: Sequence[int]) -> str:
    """Harmonics that contacts make and the set leaves out between its own."""
    divisor = int(np.gcd.reduce([n for n in harmonics if n > 0]))
    complete = (*range(0, max(harmonics) + 1, divisor),)
    left_out = sorted({*complete} - {*harmonics})
    if model.groups.odd or not left_out:
        return ""
    return (
        f"contacts that open or whose force is not odd make harmonics {left_out}, which "
        f"harmonics={(*harmonics,)} leaves out; the whole set is {complete}"
    )


def _of_damping(model: Structure, springs: FloatArray) -> str:
    """Damping above the critical one at every degree of freedom."""
    mass, damping, stiffness = (
        getattr(model, f"{name}_matrix").diagonal() for name in ("mass", "damping", "stiffness")
    )
    stiffness = np.where(stiffness > 0, stiffness, model.directions.power(2).T @ springs)
    critical = 2 * np.sqrt(mass * stiffness)
    if np.any(damping <= critical):
        return ""
    least = np.min(damping / np.where(critical > 0, critical, np.nan), initial=np.inf)
    ratio = f"at least {least:.3g} times the critical one" if np.isfinite(least) else "all there is"
    return (
        f"damping is {ratio} at every degree of freedom; matrices come in the order mass, damping, "
        "stiffness"
    )


def _of_band(
    model: Structure, springs: FloatArray, band: tuple[float, float], harmonics: Sequence[int]
) -> str:
    if not model.groups.bounded:
        return ""  # such contacts move resonances as far as the motion is large
    low, high = min(band), max(band)
    of_one, reach = low == high, max(_FAR, *harmonics)
    if of_one and low <= _ALONE * _highest(model, springs):
        return ""
    if model.n_dof > _DENSE:
        lower, upper = np.array([_lowest(model, high)]), np.array([_highest(model, springs)])
        beyond = upper * _FAR < low  # the highest one is not known well
    else:
        lower, upper = _resonances(model, springs, high)
        beyond = upper * _ABOVE < low
    below, above = upper * _FAR < low, lower > reach * high
    alone = upper * _ALONE < low
    far = alone.all() if of_one else (below | above).all() or beyond.all()
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


def _resonances(
    model: Structure, springs: FloatArray, hertz: float
) -> tuple[FloatArray, FloatArray]:
    """Between which frequencies [Hz] each mode lies, as contacts slip or stick."""
    mass, free = model.mass_matrix.toarray(), model.stiffness_matrix.toarray()
    free = 0.5 * (free + free.T)
    directions = model.directions.toarray()
    held = free + (directions.T * springs) @ directions
    # About a band, so that neither free bodies nor motions without inertia are singular.
    shift = (2 * np.pi * hertz) ** 2
    found = []
    for stiffness in (free, held):
        try:
            shares = eigh(mass, stiffness + shift * mass, eigvals_only=True)[::-1]
        except np.linalg.LinAlgError:  # an indefinite stiffness: anything may resonate
            return np.zeros(model.n_dof), np.full(model.n_dof, np.inf)
        tiny = np.finfo(float).tiny
        squares = np.where(shares > tiny, 1 / np.maximum(shares, tiny) - shift, np.inf)
        found.append(np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi))
    return found[0], found[1]


def _highest(model: Structure, springs: FloatArray) -> float:
    """The highest natural frequency [Hz] or less: that of a single degree of freedom."""
    inertia = model.mass_matrix.diagonal()
    stiffness = model.stiffness_matrix.diagonal() + model.directions.power(2).T @ springs
    moving = inertia > 0
    if not moving.all():
        return np.inf
    return float(np.sqrt(np.max(stiffness / inertia)) / (2 * np.pi))


def _lowest(model: Structure, hertz: float) -> float:
    """The lowest natural frequency [Hz] or more: the quotient of Rayleigh of inverse iterations."""
    mass = model.mass_matrix
    stiffness = 0.5 * (model.stiffness_matrix + model.stiffness_matrix.T)
    try:
        factors = splu((stiffness + (2 * np.pi * hertz) ** 2 * mass).tocsc())
    except RuntimeError:  # SuperLU: exactly singular
        return 0.0
    motion = np.random.default_rng(0).uniform(0.5, 1.5, model.n_dof)
    for _ in range(_STEPS):
        motion = factors.solve(mass @ motion)
        motion /= np.abs(motion).max()
    square = motion @ (stiffness @ motion) / (motion @ (mass @ motion))
    return float(np.sqrt(max(square, 0.0)) / (2 * np.pi))


def check_size(model: Structure) -> None:
    """Say of a large structure with few contacts that it is better condensed.

    TypeError for one whose damping is of low rank: there is no matrix to compile.
    """
    if not sp.issparse(model.damping_matrix):
        raise TypeError(
            f"model: expected one with damping as a sparse matrix, the modal damping of "
            f"{model.n_dof:,} degrees of freedom is full; use symhbm.condense or "
            "symhbm.craig_bampton of the model"
        )
    entries = int(model.stiffness_matrix.nnz)
    if entries <= LARGE or not _has_few_contacts(model):
        return
    check.warn(
        f"a structure of {model.n_dof:,} degrees of freedom, of which contacts touch "
        f"{len(model.touched)}, "
        f"and {entries:,} entries of its stiffness matrix: it takes about {entries / 2e4:.0f} s to "
        "compile, and every point some factorisations of all its equations; symhbm.condense(model, "
        "excitation, frequency_band, harmonics, places=...) gives the same responses of what "
        "contacts touch and of these places, and each point in milliseconds"
    )


def _has_few_contacts(model: Structure) -> bool:
    return _FEW * len(model.touched) <= model.n_dof


def advise_condensing(model: Structure, n_unknowns: int, what: str, option: str = "") -> None:
    """Say of a problem of many unknowns ``what`` a condensed structure is better for."""
    if not model.has_matrices or n_unknowns <= MANY or not _has_few_contacts(model):
        return
    check.warn(
        f"{what} for {n_unknowns:,} unknowns; those of the {len(model.touched)} degrees of "
        f"freedom that contacts touch are enough: symhbm.condense(model, excitation, "
        f"frequency_band, harmonics, places=...{option})"
    )
