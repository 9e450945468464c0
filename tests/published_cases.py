"""Cases that others publish, of `data/reference/published_cases.json`, as problems."""

from collections.abc import Iterable, Mapping
from typing import Any

import casadi as ca
import numpy as np

import symhbm as sh
from tests.reference import CASES

TURN = 2 * np.pi


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
