"""Plain numerics: Fourier series, their roots and turning points, linear algebra, CasADi."""

from symhbm.numerics import check
from symhbm.numerics.arrays import (
    DENSE_LIMIT,
    SMALL,
    Factorisation,
    bordered,
    by_size,
    compact,
    full,
    is_full,
    length_of,
    negative_eigenvalues,
    relative_difference,
    saddle,
)
from symhbm.numerics.c_library import to_machine_code
from symhbm.numerics.check import RADIANS, ComplexArray, FloatArray, Table
from symhbm.numerics.compiled import Assembly, Compiled, constant, sparsity_of
from symhbm.numerics.fourier import (
    FourierBasis,
    by_harmonic,
    check_harmonics,
    complete_harmonics,
    larger_set,
    unknowns_of,
)
from symhbm.numerics.refinement import refined
from symhbm.numerics.roots import MACHINE, bracketed_root, monotone_root
from symhbm.numerics.threads import on_one_thread
from symhbm.numerics.turning_points import (
    check_turning,
    largest_displacement,
    turning_hessian,
    turning_points,
)
from symhbm.numerics.watched import Watcher, watched, watching

__all__ = [
    "DENSE_LIMIT",
    "MACHINE",
    "RADIANS",
    "SMALL",
    "Assembly",
    "Compiled",
    "ComplexArray",
    "Factorisation",
    "FloatArray",
    "FourierBasis",
    "Table",
    "Watcher",
    "bordered",
    "bracketed_root",
    "by_harmonic",
    "by_size",
    "check",
    "check_harmonics",
    "check_turning",
    "compact",
    "complete_harmonics",
    "constant",
    "full",
    "is_full",
    "larger_set",
    "largest_displacement",
    "length_of",
    "monotone_root",
    "negative_eigenvalues",
    "on_one_thread",
    "refined",
    "relative_difference",
    "saddle",
    "sparsity_of",
    "to_machine_code",
    "turning_hessian",
    "turning_points",
    "unknowns_of",
    "watched",
    "watching",
]
