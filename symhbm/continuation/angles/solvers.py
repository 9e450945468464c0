"""Solvers of Eqs. (4)-(11) with the switching angles as unknowns, and what they are asked for."""

from typing import Any

import casadi as ca
import numpy as np

from symhbm.balance import HarmonicBalance, SwitchingAngles, check_odd, friction_of
from symhbm.numerics import FloatArray, check

_ROOTFINDER = {"abstol": 1e-15, "abstolStep": 1e-12, "max_iter": 60, "error_on_fail": False}
"""The residual is asked to be below round-off, so that the length of the last step decides."""
_IPOPT: dict[str, Any] = {
    "print_time": False,
    "calc_lam_p": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-13,
    "ipopt.acceptable_iter": 0,
    "ipopt.max_iter": 100,
    "ipopt.nlp_scaling_method": "none",
    # Without an objective the barrier has no purpose, and rho may be near its bounds.
    "ipopt.mu_init": 1e-13,
    "ipopt.bound_push": 1e-9,
    "ipopt.bound_frac": 1e-9,
    "ipopt.bound_relax_factor": 0.0,
}
_NO_WARNINGS = {"show_eval_warnings": False}


def check_angles(problem: HarmonicBalance, solver: str) -> None:
    """Raise ValueError unless there is such a solver and the form can be written for a problem."""
    if not isinstance(solver, str) or solver not in _SOLVERS:
        raise ValueError(f"angles={check.shown(solver)}: expected one of {', '.join(_SOLVERS)}")
    if not problem.model.has_matrices:
        raise ValueError(
            f"angles={solver!r}: expected None for a condensed structure, whose linear part is no "
            "CasADi function; use the attribute structure of its model"
        )
    if problem.samples is not None:
        raise ValueError(
            f"problem: samples={problem.samples}, expected None: a sampled law has no angles"
        )
    friction_of(problem)
    check_odd(problem.basis.harmonics)


def check_path_angles(solver: str, may_fold: bool, accuracy: float | None) -> None:
    """Raise ValueError for options that a path with angles as unknowns does not have."""
    if accuracy is not None:
        raise ValueError(
            f"angles={solver!r}: expected None with accuracy={accuracy:g}, which adds harmonics "
            "from located friction; leave accuracy out, or use located angles"
        )
    if may_fold:
        raise ValueError(
            f"angles={solver!r}: expected None with cubic springs, which may make several "
            "responses; use located angles"
        )


def two_angles(
    angles: SwitchingAngles, unknowns: FloatArray, slip
) -> tuple[FloatArray, FloatArray]:
    """``theta_0`` and ``theta_star`` [rad], NaN where a contact does not slip."""
    _, theta_0, rho = angles.split(unknowns)
    stick = 2 * np.arcsin(np.sqrt(np.clip(rho, 0.0, 1.0)))
    return np.where(slip, theta_0, np.nan), np.where(slip, theta_0 + stick, np.nan)


def row_scales(
    problem: HarmonicBalance, coefficients: FloatArray, rho: FloatArray, slips: Any, force: float
) -> FloatArray:
    """Magnitudes of the equations: a ``force`` of the balance, and those of each contact."""
    _, rows, stiffness, _ = problem.contacts.sliders()
    spring = stiffness * np.abs(problem.layout.relative(coefficients)[rows]).sum(axis=1)
    # In gross slip the forces of Eq. (11) are small. Relative to them the equation loses digits,
    # relative to the spring force theta_star does: their geometric mean suits both.
    of_contacts = np.where(slips, spring, 1.0), np.where(slips, spring * np.sqrt(rho), 1.0)
    return np.concatenate([np.full(len(coefficients), force), *of_contacts])


def casadi_solver(solver: str, program: dict[str, ca.SX]) -> ca.Function:
    """CasADi's solver of a name, for a program by CasADi's names of its parts."""
    if solver == "rootfinder":
        return ca.rootfinder("angles", "newton", program, _ROOTFINDER | _NO_WARNINGS)
    return ca.nlpsol("angles", "ipopt", program | {"f": ca.SX(0)}, _IPOPT | _NO_WARNINGS)


_SOLVERS = ("newton", "rootfinder", "ipopt")
