"""Harmonic 0: where a structure stands in the mean, what asks for it and what holds it.

The force of a slipping contact does not know the mean of its motion. Where the motion is no mirror
image of itself that force has a mean, which only stiffness balances.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, onenormest, splu

from symhbm.balance.harmonic_balance import HarmonicBalance
from symhbm.model import Structure
from symhbm.numerics import DENSE_LIMIT, complete_harmonics

_SINGULAR = 1e-13
"""Reciprocal condition of a scaled stiffness matrix that lets something move freely."""


def check_mean(problem: HarmonicBalance, growing: bool = False) -> None:
    """Raise ValueError where contacts make a mean force that the harmonics leave out.

    Harmonics that are ``growing`` get those that the force needs, but stay odd.

    With friction that takes a force with even harmonics, counted in units of what all have in
    common: responses are unique, and mirror images of themselves under odd ones. Cubic springs
    break the symmetry of motions by themselves, once even harmonics let them.
    """
    model, harmonics = problem.model, problem.harmonics
    if 0 in harmonics or not model.n_contacts:
        return
    uneven = [repr(group.law) for group in model.groups if group.n and not group.law.odd]
    if uneven:
        raise ValueError(
            f"harmonics={harmonics}: expected 0 and even ones among them, as the force of "
            f"{', '.join(uneven)} is not odd; try harmonics={(*range(max(*harmonics, 2) + 1),)}"
        )
    if growing:
        return
    shapes = model.force_shapes(problem.excitation, problem.basis).values()
    acts = np.any([shape.any(axis=0) for shape in shapes], axis=0)
    exciting = tuple(sorted({*problem.basis.order[acts].astype(int).tolist()}))
    if exciting and 0 in complete_harmonics(exciting, 1):
        why = f"a force of harmonics {exciting}, not odd multiples of one alone,"
    elif 0 in complete_harmonics(harmonics, 1) and model.groups.many_valued():
        why = "a motion of even harmonics"
    else:
        return
    raise ValueError(
        f"harmonics={harmonics}: expected 0 among them, as {why} makes a mean force at the "
        f"contacts; try harmonics={(0, *harmonics)}"
    )


def is_held(problem: HarmonicBalance) -> bool:
    """Whether stiffness or cubic springs determine where the structure stands in the mean."""
    model, rows = problem.model, problem.model.groups.holding_rows
    return model.of_matrices(("is held", *rows.tolist()), lambda: _is_held_by(model, rows))


def _is_held_by(model: Structure, rows: NDArray[np.intp]) -> bool:
    stiffness, springs = model.static_stiffness, model.directions[rows]
    springs = springs / abs(springs).max(axis=1).toarray()[:, None] if springs.nnz else springs
    diagonal = np.abs(stiffness.diagonal())
    # Cubic springs hold with any stiffness: that of the structure, where they are.
    common = float(np.median(diagonal[diagonal > 0])) if diagonal.any() else 1.0
    matrix = stiffness + common * (springs.T @ springs)
    scale = sp.diags_array(np.where(diagonal > 0, diagonal, common) ** -0.5)
    return _reciprocal_condition((scale @ matrix @ scale).tocsc()) > _SINGULAR


def _reciprocal_condition(matrix: Any) -> float:
    if matrix.shape[0] <= DENSE_LIMIT:
        values = np.linalg.svd(matrix.toarray(), compute_uv=False)
        return float(values[-1] / values[0]) if values[0] else 0.0
    try:
        factors = splu(matrix)
    except RuntimeError:  # SuperLU: exactly singular
        return 0.0
    solves = dict(matvec=factors.solve, rmatvec=lambda right: factors.solve(right, trans="T"))
    inverse = LinearOperator(matrix.shape, dtype=float, **solves)  # type: ignore[call-arg]
    return 1 / float(onenormest(inverse) * abs(matrix).sum(axis=0).max())
