"""Structures without a force of which others state numbers or closed forms."""

import casadi as ca
import numpy as np
from scipy.special import ellipk

import symhbm as sh

ONE_BLADE = dict(
    mass=1, stiffness=1e4, contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3
)
"""Blade on a Jenkins element, without its damping; kg, N/m, N."""


def two_masses(highest: int) -> sh.HarmonicBalance:
    """Example 05 of NLvib: masses [kg], springs [N/m], friction force [N], a velocity [m/s]."""
    rubs = sh.laws.SmoothLaw(
        lambda y, v, p: p["limit"] * ca.tanh(v / p["reference_velocity"]),
        {"limit": (5.0, "N"), "reference_velocity": (0.05, "m s-1")},
        [(0,)],
    )
    stiffness = [[40.0, -40.0], [-40.0, 640.0]]
    model = sh.Model(np.diag([0.02, 1.0]), np.zeros((2, 2)), stiffness, contacts={"rubs": rubs})
    return sh.HarmonicBalance(model, harmonics=range(1, highest + 1, 2))


def van_der_pol() -> sh.Model:
    """One mass in air that drives small motions and damps large ones."""
    air = sh.laws.SmoothLaw(
        lambda y, v, p: (p["b"] * y**2 + p["c"]) * v,
        {"b": (1.0, "N s m-3"), "c": (-1.0, "N s m-1")},
        [(0,)],
    )
    return sh.Model([[1.0]], [[0.0]], [[1.0]], contacts={"air": air})


def duffing_problem(cubic: float) -> sh.HarmonicBalance:
    """One mass of 1 kg on a spring of 1 N/m and a cubic one."""
    spring = sh.Model([[1.0]], [[0.0]], [[1.0]], contacts=[(0,)], cubic_stiffness=cubic)
    return sh.HarmonicBalance(spring, harmonics=range(1, 16, 2))


def duffing(stiffness: float, cubic: float, amplitude: np.ndarray) -> np.ndarray:
    """Angular frequency of ``x'' + k x + g x^3 = 0`` at its largest displacement, in closed form.

    For example I. Kovacic, M. J. Brennan, The Duffing Equation, Wiley 2011, by the complete
    elliptic integral of the first kind.
    """
    square = stiffness + cubic * amplitude**2
    return np.pi * np.sqrt(square) / (2 * ellipk(cubic * amplitude**2 / (2 * square)))


def blisk_sector() -> sh.Sector:
    """Disk, lower and upper mass of a blade, and the disk of the next sector."""
    stiffness = np.zeros((4, 4))
    for i, j, k in ((0, None, 6e5), (0, 1, 1e6), (1, 2, 2e6), (0, 3, 5e7)):
        way = np.zeros(4)
        way[i] = 1
        if j is not None:
            way[j] = -1
        stiffness += k * np.outer(way, way)
    mass = np.diag([1.2, 0.35, 0.25, 0])
    return sh.Sector(sh.Model(mass, 0 * mass, stiffness), left=[0], right=[3], n_sectors=24)
