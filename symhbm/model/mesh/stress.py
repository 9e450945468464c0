"""Stresses of an isotropic material at nodes of a mesh, as rows over degrees of freedom."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from symhbm.numerics import check

_WAYS = "x", "y", "z"
COMPONENTS = "xx", "yy", "zz", "xy", "yz", "zx"


def stress_rows(
    mesh: Any, nodes: ArrayLike, dof_of: NDArray[np.intp], n_dof: int, elastic: tuple[float, float]
) -> dict[str, Any]:
    """Rows (n_nodes, n_dof) of each component, of a modulus and Poisson's ratio.

    ``dof_of`` (all nodes of the mesh, 3) is -1 where the displacement is 0, -2 where nobody knows
    it: ValueError where stresses need those.
    """
    modulus, poisson = elastic
    shear = modulus / (2 * (1 + poisson))
    along = mesh.gradients(nodes)
    needed = np.unique(along[0].indices)
    unknown = np.argwhere(dof_of[needed] < -1)
    if unknown.size:
        node, way = mesh.node[needed[unknown[0, 0]]], _WAYS[unknown[0, 1]]
        raise ValueError(
            f"nodes: stresses need {node}:{way}, which is no degree of freedom here, and nobody "
            "told that it is held; held= names supports"
        )
    inside = [np.flatnonzero(dof_of[:, way] >= 0) for way in range(3)]
    motion = [
        sp.csr_array((np.ones(len(at)), (at, dof_of[at, way])), shape=(len(mesh.node), n_dof))
        for way, at in enumerate(inside)
    ]
    stretch = [along[way] @ motion[way] for way in range(3)]
    even = 2 * shear * poisson / (1 - 2 * poisson) * (stretch[0] + stretch[1] + stretch[2])
    result = {}
    for name in COMPONENTS:
        i, j = map(_WAYS.index, name)
        rows = shear * (along[i] @ motion[j] + along[j] @ motion[i])
        result[name] = sp.csr_array(rows + even if i == j else rows)
    return result


def elastic_of(
    mesh: Any, nodes: ArrayLike, materials: dict[str, Any], own: tuple[Any, Any]
) -> tuple[float, float]:
    """Modulus and Poisson's ratio that are given, or those of the elements at some nodes.

    Of all materials, where the mesh does not tell which element has which. ValueError where
    materials do not tell them, or differ.
    """
    here = mesh.materials_at(nodes)
    materials = {n: each for n, each in materials.items() if n in here or "" in here}
    result = []
    for name, given in zip(("modulus", "poisson"), own, strict=True):
        told = {material: values.get(name) for material, values in materials.items()}
        if given is None and (len({*told.values()}) != 1 or None in told.values()):
            known = ", ".join(
                f"{material} has {'none' if value is None else value}"
                for material, value in told.items()
            )
            raise ValueError(
                f"{name}: expected that of the elements at these nodes, as their materials do not "
                f"tell the same ({known or 'no material is known'})"
            )
        result.append(check.scalar(name, given if given is not None else next(iter(told.values()))))
    if not (result[0] > 0 and -1 < result[1] < 0.5):
        raise ValueError(
            f"modulus={result[0]:g}, poisson={result[1]:g}: expected a positive modulus, and a "
            "ratio between -1 and 0.5"
        )
    return result[0], result[1]
