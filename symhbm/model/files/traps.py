"""What finite-element programs leave in their matrices: triangles, supports, rows without mass."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import ArpackError, eigsh

from symhbm.model.files.contents import Contents
from symhbm.model.places import DIRECTIONS, Places
from symhbm.numerics import RADIANS

_SUPPORT = 1e35
"""Stiffness of a support, which nothing else has."""
_ASYMMETRY = 1e-6
"""Relative to the largest entry, above which a matrix is not symmetric but for its digits."""
_LOWEST, _HIGHEST = 1e-2, 1e6
"""Band of lowest natural frequencies [Hz] of machines in right units."""
_SOLVED = 20_000
"""Degrees of freedom up to which the lowest natural frequency is solved for."""
_RIGID = 1e-13
"""Square of a natural frequency, relative to the largest one, that is 0 but for round-off."""
Tell = Callable[[str], None]


def completed(contents: Contents, symmetric: bool, tell: Tell) -> Contents:
    """The matrices with both triangles; ValueError for one triangle that nobody declared so."""
    matrices = {}
    for kind, matrix in contents.matrices.items():
        column = np.repeat(
            np.arange(matrix.shape[0], dtype=matrix.indices.dtype), np.diff(matrix.indptr)
        )
        off, above = matrix.indices != column, matrix.indices < column
        beside = sp.csc_array((matrix.data * off, matrix.indices, matrix.indptr), matrix.shape)
        off &= matrix.data != 0
        above = above[off]
        # Rows may be in another order than where one triangle was kept: one entry of each pair.
        alone = bool(above.size) and (
            above.all() or not above.any() or not beside.multiply(beside.T).nnz
        )
        if alone and not (symmetric or contents.triangle):
            raise ValueError(
                f"{kind}: expected the whole matrix, one triangle is there alone; symmetric=True "
                "completes it"
            )
        if alone:
            matrix = sp.csc_array(matrix + beside.T)
            if not contents.triangle:
                tell(f"{kind} completed from a triangle")
        elif kind != "damping":
            difference = abs(matrix - matrix.T)
            share = difference.max() / abs(matrix).max() if difference.nnz else 0.0
            if share > _ASYMMETRY:
                if symmetric:
                    raise ValueError(f"{kind}: expected a symmetric matrix, entries differ")
                tell(f"{kind} is not symmetric, by {share:.1e} of its largest entry")
        matrices[kind] = matrix
    return contents._replace(matrices=matrices)


def without_supports(contents: Contents, tell: Tell) -> Contents:
    """What is left without degrees of freedom that are fixed, by 1e36 or by rows of zeros."""
    mass, stiffness = contents.matrices["mass"], contents.matrices["stiffness"]
    empty, weightless = _zero_rows(stiffness), _zero_rows(mass)
    fixed = np.abs(stiffness.diagonal()) >= _SUPPORT
    for dropped, what in ((fixed, "supports of stiffness 1e36"), (empty & weightless, "zero rows")):
        if dropped.any():
            tell(f"{np.sum(dropped)} {what} dropped{_first(contents, dropped)}")
    dropped = fixed | (empty & weightless)
    if dropped.all():
        raise ValueError("stiffness: expected degrees of freedom that are not fixed")
    for rows, what in (
        (weightless & ~dropped, "degrees of freedom without mass"),
        (empty & ~dropped, "degrees of freedom without stiffness"),
    ):
        if rows.any():
            tell(f"{np.sum(rows)} {what}{_first(contents, rows)}")
    if not dropped.any():
        return contents
    kept = np.flatnonzero(~dropped)
    program = None if contents.places is None else contents.places.program
    if contents.places is not None and program is not None and fixed.any():
        program = replace(program, held=_with_held(contents.places, fixed, program.held))
        contents = contents._replace(places=replace(contents.places, program=program))
    matrices = {k: m[kept][:, kept].tocsc() for k, m in contents.matrices.items()}
    places = None if contents.places is None else contents.places.of(kept)
    return contents._replace(matrices=matrices, places=places)


def _with_held(places: Places, fixed: NDArray[np.bool_], known: Any) -> NDArray[np.int64]:
    """Supports (n, 2), node and direction 0 to 2, with those of the matrices."""
    letters = np.array(DIRECTIONS[:3])
    here = fixed & np.isin(places.direction, letters)
    way = np.searchsorted(letters, places.direction[here])
    others = np.zeros((0, 2), dtype=np.int64) if known is None else known
    return np.unique(np.vstack([others, np.column_stack([places.node[here], way])]), axis=0)


def doubt_units(contents: Contents, units: str, tell: Tell) -> None:
    """Tell of a lowest natural frequency that no machine has.

    That of large structures is not solved for: it is below that of every degree of freedom alone.
    """
    mass, stiffness = contents.matrices["mass"], contents.matrices["stiffness"]
    moving = np.flatnonzero((mass.diagonal() > 0) & (stiffness.diagonal() > 0))
    squares = stiffness.diagonal()[moving] / mass.diagonal()[moving]
    lowest = np.sqrt(squares.min()) / RADIANS if squares.size else np.nan
    if mass.shape[0] <= _SOLVED and squares.size:
        lowest = _lowest_elastic(mass, stiffness, squares.max(), lowest)
    elif lowest > _HIGHEST:
        return  # an upper bound alone
    if lowest < _LOWEST or lowest > _HIGHEST:
        tell(f"lowest natural frequency {lowest:.2g} Hz, is units={units!r} right?")


def _lowest_elastic(mass: Any, stiffness: Any, largest: float, otherwise: float) -> float:
    """The lowest natural frequency [Hz] that is not of a rigid body."""
    shift = -1e-11 * largest  # outside of the spectrum, so that free structures have factors
    n = mass.shape[0]
    try:
        if n <= 50:
            inverse = np.linalg.solve((stiffness - shift * mass).toarray(), mass.toarray())
            inverses = np.sort(np.linalg.eigvals(inverse).real)[::-1]
            with np.errstate(divide="ignore"):
                squares = np.where(inverses > 0, 1 / inverses + shift, np.inf)
        else:
            # Symmetric as machines are; a little skewness of K does not change the magnitude.
            start = np.random.default_rng(0).normal(size=n)
            squares = np.sort(eigsh(stiffness, 7, mass, shift, return_eigenvectors=False, v0=start))
    except (ArpackError, RuntimeError, np.linalg.LinAlgError):
        return otherwise
    elastic = squares[(squares > _RIGID * largest) & np.isfinite(squares)]
    return float(np.sqrt(elastic.min()) / RADIANS) if elastic.size else otherwise


def _zero_rows(matrix: Any) -> NDArray[np.bool_]:
    return np.asarray(abs(matrix).sum(axis=0)).ravel() == 0


def _first(contents: Contents, chosen: NDArray[np.bool_]) -> str:
    """Text that names the first of some degrees of freedom."""
    at = int(np.argmax(chosen))
    name = at if contents.places is None else contents.places.name(at)
    return f" (the first: {name})"
