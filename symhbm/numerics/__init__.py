"""Plain numerics: Fourier series, their roots and turning points, linear algebra, CasADi."""

from symhbm.numerics import check
from symhbm.numerics.arrays import RADIANS, ComplexArray, FloatArray, Table, relative_difference
from symhbm.numerics.compiled import Assembly, Compiled, constant, sparsity_of
from symhbm.numerics.fourier import (
    FourierBasis,
    by_harmonic,
    check_harmonics,
    complete_harmonics,
    larger_set,
    unknowns_of,
)
from symhbm.numerics.interpolation import (
    amplitude_between,
    cubic,
    cubic_slope,
    cubic_top,
    first_zero,
)
from symhbm.numerics.linear_algebra import (
    DENSE_LIMIT,
    Factorisation,
    bordered,
    by_size,
    full,
    length_of,
    negative_eigenvalues,
    saddle,
)
from symhbm.numerics.machine_code import to_machine_code
from symhbm.numerics.roots import MACHINE, Motions, monotone_root
from symhbm.numerics.turning_points import (
    Cells,
    TurningPoints,
    largest_displacement,
    points_in_cells,
    turning_cells,
    turning_hessian,
    turning_points,
)

__all__ = [
    "DENSE_LIMIT",
    "MACHINE",
    "RADIANS",
    "Assembly",
    "Cells",
    "Compiled",
    "ComplexArray",
    "Factorisation",
    "FloatArray",
    "FourierBasis",
    "Motions",
    "Table",
    "TurningPoints",
    "amplitude_between",
    "bordered",
    "by_harmonic",
    "by_size",
    "check",
    "check_harmonics",
    "complete_harmonics",
    "constant",
    "cubic",
    "cubic_slope",
    "cubic_top",
    "first_zero",
    "full",
    "larger_set",
    "largest_displacement",
    "length_of",
    "monotone_root",
    "negative_eigenvalues",
    "points_in_cells",
    "relative_difference",
    "saddle",
    "sparsity_of",
    "to_machine_code",
    "turning_cells",
    "turning_hessian",
    "turning_points",
    "unknowns_of",
]
