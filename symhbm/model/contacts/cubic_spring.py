"""The cubic spring ``f = gamma y^3``, a smooth contact law.

The cube of a motion of highest harmonic ``h`` holds harmonics up to ``3 h``. Sums over more than
``4 h`` samples separate those from the harmonics of the basis, so that they are the exact
Fourier integrals.
"""

import casadi as ca
import numpy as np

from symhbm.numerics import FourierBasis


def cubic_kernel(basis: FourierBasis) -> ca.Function:
    """CasADi function of one cubic spring: Fourier coefficients of its force.

    Inputs: ``coefficients`` (n_components) [m] and ``cubic_stiffness`` [N/m^3]. Outputs: ``force``
    (n_components) [N] and ``magnitude`` (n_components) [N], what round-off of the force scales
    with.
    """
    n_samples = 4 * basis.highest + 1
    synthesis = basis.values(2 * np.pi * np.arange(n_samples) / n_samples)
    analysis = 2 * np.pi / n_samples * (synthesis * basis.norm).T
    y = ca.SX.sym("coefficients", basis.n_components)
    stiffness = ca.SX.sym("cubic_stiffness")
    force = stiffness * ca.mtimes(ca.DM(analysis), ca.mtimes(ca.DM(synthesis), y) ** 3)
    largest = ca.mtimes(ca.DM(np.abs(synthesis)), ca.fabs(y)) ** 3
    magnitude = ca.fabs(stiffness) * ca.mtimes(ca.DM(np.abs(analysis)), largest)
    return ca.Function(
        "cubic_spring",
        [y, stiffness],
        [force, magnitude],
        ["coefficients", "cubic_stiffness"],
        ["force", "magnitude"],
    )
