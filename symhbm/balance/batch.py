"""The equations at several points at once, of one problem or of several of one structure."""

from collections.abc import Sequence

import numpy as np

from symhbm.balance.harmonic_balance import HarmonicBalance
from symhbm.model.contacts import ContactState
from symhbm.numerics import FloatArray


def locate_each(
    problems: Sequence[HarmonicBalance], unknowns: Sequence[FloatArray]
) -> list[ContactState]:
    """Events of all contacts at the unknowns of several problems of one structure, at once."""
    return _locate_all(problems, np.array(unknowns)).split(len(problems))


def check_each(
    problems: Sequence[HarmonicBalance], unknowns: FloatArray, frequencies: FloatArray
) -> tuple[FloatArray, ContactState]:
    """Norms (n_points,) of the equations, and the events of all contacts point by point.

    ``unknowns`` (n_points, n_unknowns) of problems of one structure; ``frequencies``
    (n_points,) in rad/s.
    """
    first = problems[0]
    each = zip(problems, unknowns, frequencies.tolist(), strict=True)
    if first.in_closed_form and first.structure is None:
        compiled = first.compiled[0]
        found = [compiled.packed(x, omega, problem.compiled[1]) for problem, x, omega in each]
        residual, magnitude, _, _, events = zip(*found, strict=True)
        largest, force = np.abs(residual).max(axis=1), np.concatenate(magnitude)
        norm = largest / np.where(force > 0, force, 1.0)
        return norm, compiled.unpack(np.concatenate(events))
    located = _locate_all(problems, unknowns)
    found = zip(each, located.split(len(problems)), strict=True)
    norm = [problem.evaluate(x, at, friction=own).norm for (problem, x, at), own in found]
    return np.array(norm), located


def _locate_all(problems: Sequence[HarmonicBalance], unknowns: FloatArray) -> ContactState:
    """The same as one batch, point by point; ``unknowns`` (n_points, n_unknowns)."""
    first = problems[0]
    relative = first.relative(unknowns).reshape(-1, first.basis.n_components)
    stiffness = np.concatenate([problem.contact_stiffness for problem in problems])
    limit = np.concatenate([problem.slip_limit for problem in problems])
    return first.locate_motions(relative, stiffness, limit)
