"""What is better condensed: large structures that few contacts touch."""

import scipy.sparse as sp

from symhbm.model.structure import Structure
from symhbm.numerics import check

LARGE = 100_000
"""Entries of a stiffness matrix from which compiling it takes longer (5 s) than condensing it."""
MANY = 400
"""Unknowns from which second derivatives and stability take minutes, or are not computed."""
_FEW = 4
"""Degrees of freedom for each one that contacts touch, from which condensing is worth it."""


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
