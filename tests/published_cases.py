"""Cases that others publish, of `data/reference/published_cases.json`, as problems."""

from collections.abc import Iterable, Mapping
from typing import Any

import casadi as ca
import numpy as np
import scipy.linalg
import xarray as xr

import symhbm as sh
from tests.reference import CASES

TURN = 2 * np.pi


class Size(sh.goals.Goal):
    """Root mean square of a displacement, its mean counted as a harmonic, or one harmonic of it."""

    units, meaning = "m", "size of a displacement"

    def __init__(self, dof: int, harmonic: int = -1):
        self.dof, self.harmonic = dof, harmonic

    def value(self, at: sh.goals.Solution) -> Any:
        """The size as an expression."""
        of_dof, component = at.coefficients[:, self.dof], at.basis.component
        if self.harmonic < 0:
            return ca.norm_2(of_dof) / np.sqrt(2)
        return ca.norm_2(of_dof[[component(self.harmonic), component(self.harmonic, True)]])


def group(element: Mapping[str, Any]) -> Any:
    """A contact of a case: ``w`` gives its displacement ``w @ x``, ``dof`` where that is one."""
    weights = element.get("w", [0.0] * element.get("dof", 0) + [1.0])
    along = {dof: float(weight) for dof, weight in enumerate(weights) if weight}
    kind = element["kind"]
    if kind == "cubic":
        law = sh.laws.CubicSpring()
        return sh.Contacts(law, along, cubic_stiffness=element["stiffness"])
    if kind == "unilateral":
        return sh.Gap(normal=along, normal_stiffness=element["stiffness"], gap=element["gap"])
    if kind == "jenkins":
        slider = dict(contact_stiffness=element["stiffness"], friction_coefficient=1.0)
        return sh.Contacts(sh.laws.Coulomb(), along, normal_load=element["limit"], **slider)
    if kind == "tanh":
        return sh.laws.SmoothLaw(
            lambda y, v, p: p["limit"] * ca.tanh(v / p["eps"]),
            {"limit": (element["limit"], "N"), "eps": (element["eps"], "m s-1")},
            [along],
        )
    raise ValueError(f"kind is {kind!r}; cubic, unilateral, jenkins and tanh are known")


def problem(name: str, harmonics: Iterable[int], **given: Any) -> sh.HarmonicBalance:
    """The balance of a case whose matrices and force stand in the file."""
    model = CASES[name]["model"]
    elements = {f"{e['kind']}_{i}": group(e) for i, e in enumerate(model["elements"])}
    matrices = (np.array(model[one], float) for one in "MCK")
    structure = sh.Model(*matrices, contacts=elements)
    force = {int(h): values for h, values in model.get("force", {}).items()}
    driven = sh.forces.HarmonicForce(cosine=force) if force else None
    return sh.HarmonicBalance(structure, driven, harmonics, **given)


def beam(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness of a case that is a clamped Euler-Bernoulli beam.

    Two degrees of freedom a node, deflection and slope, with the consistent mass of cubic elements.
    """
    given = CASES[name]["model"]
    count, area = given["elements_count"], given["height"] * given["width"]
    length, bending = given["length"] / count, given["E"] * area * given["height"] ** 2 / 12
    lengths = np.diag([1.0, length, 1.0, length])
    inertia = np.array(
        [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]], float
    )
    elastic = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], float)
    inertia *= given["rho"] * area * length / 420
    elastic *= bending / length**3
    mass, stiffness = np.zeros((2, 2 * count + 2, 2 * count + 2))
    for i in range(count):
        nodes = slice(2 * i, 2 * i + 4)
        mass[nodes, nodes] += lengths @ inertia @ lengths
        stiffness[nodes, nodes] += lengths @ elastic @ lengths
    return mass[2:, 2:], stiffness[2:, 2:]


def frequencies(mass: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Natural frequencies [rad/s], ascending."""
    return np.sqrt(scipy.linalg.eigh(stiffness, mass, eigvals_only=True))


def swept(name: str, harmonics: Iterable[int], goal: Any) -> xr.Dataset:
    """The response of a case over its band, with the peaks of a goal."""
    return sh.frf(problem(name, harmonics, peaks_of=goal), band(name), progress=False)


def on_grid(name: str, harmonics: Iterable[int], omega: Iterable[float]) -> xr.Dataset:
    """The response of a case at frequencies [rad/s]."""
    at = [each / TURN for each in omega]
    return sh.frf(problem(name, harmonics), band(name), at=at, progress=False)


def band(name: str) -> tuple[float, float]:
    """The band of a case [Hz], in the direction that is followed."""
    first, last = CASES[name]["sweep"]
    return first / TURN, last / TURN


def peak(found: xr.Dataset) -> tuple[float, float]:
    """The highest peak and its frequency [rad/s]."""
    best = int(np.nanargmax(found.peak_amplitude.values))
    return float(found.peak_amplitude[best]), TURN * float(found.peak_frequency[best])


def events(found: xr.Dataset, *kinds: str) -> np.ndarray:
    """Where events of some kinds are [rad/s], along the path."""
    return TURN * found.event_frequency.values[np.isin(found.event_kind.values, kinds)]


def coefficients(point: xr.Dataset) -> np.ndarray:
    """Those of one solution, (n_dof, n_harmonics, 2)."""
    return point.coefficient.transpose("dof", "harmonic", "component").values


def source(name: str) -> str:
    """Where print comes from: the program, and the commit of its repository."""
    return CASES[name]["source"][0].split(":")[0].removeprefix("github ").split(" (")[0]
