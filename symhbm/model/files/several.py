"""Jobs of a program that belong together: matrices at some speeds, and modes of the same sector."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from symhbm.model.cyclic import RotatingModel
from symhbm.model.damping import RayleighDamping, StructuralDamping
from symhbm.model.files.contents import SHARES, Contents
from symhbm.model.matrices import Model
from symhbm.model.mesh import Mesh, Program

_SAME = 1e-9
"""Distance of a node from where another job has it, over the size of the mesh, that is none."""


def joined(paths: Sequence[Path], parts: Sequence[Contents]) -> list[Contents]:
    """The jobs that wrote matrices, each with the modes of another one at its speed.

    Raises ValueError for jobs without any, of different meshes, and of matrices at one speed twice.
    """
    with_matrices = [(p, c) for p, c in zip(paths, parts, strict=True) if c.matrices]
    if not with_matrices:
        raise ValueError(
            f"path: expected matrices, {', '.join(map(str, paths))} wrote none; docs/guide/export "
            "tells how"
        )

    def same_speed(one: Program, other: Program) -> bool:
        return bool(np.isclose(one.speed or 0.0, other.speed or 0.0, rtol=_SAME, atol=0))

    result = []
    for path, contents in with_matrices:
        mesh, program, notes = contents.mesh, contents.program, contents.notes
        for other_path, other in zip(paths, parts, strict=True):
            if other is contents or other.mesh is None or other.program is None:
                continue
            _check_same(path, mesh, other_path, other.mesh)
            told = other.program
            mesh = mesh.with_sets({**other.mesh.sets, **mesh.sets})
            mesh = replace(mesh, surfaces={**other.mesh.surfaces, **mesh.surfaces})
            names = "axis", "n_sectors", "sides"
            more = {n: getattr(told, n) for n in names if getattr(program, n) is None}
            if told.modes is not None and program.modes is None and same_speed(program, told):
                more["modes"] = told.modes
            alone = not any(same_speed(each.program, told) for _, each in with_matrices)
            if told.modes is not None and alone:
                notes += (f"modes of {other_path.name} are at another speed, not compared",)
            program = replace(program, **more)
            if not other.matrices:
                notes += tuple(f"{other_path.name}: {note}" for note in other.notes)
        result.append(contents._replace(mesh=mesh, program=program, notes=notes))
    return sorted(result, key=lambda each: each.program.speed or 0.0)


def _check_same(path: Path, mesh: Mesh, other_path: Path, other: Mesh) -> None:
    """Raise ValueError for two meshes that differ."""
    same = np.array_equal(mesh.node, other.node)
    off = np.abs(mesh.coordinates - other.coordinates).max(axis=1) if same else np.ones(1)
    if off.max() > _SAME * np.abs(mesh.coordinates).max():
        which = f", node {mesh.node[off.argmax()]} is {off.max():.3g} apart" if same else ""
        raise ValueError(f"path: {path} and {other_path} are of different meshes{which}")


def rotating(models: Sequence[Model]) -> RotatingModel:
    """One structure of its matrices at several speeds; ValueError for other degrees of freedom."""
    first = models[0].places
    for model in models[1:]:
        other = model.places
        if not np.array_equal([first.node], [other.node]) or any(
            first.direction != other.direction
        ):
            raise ValueError("path: expected the same degrees of freedom at all speeds")
    lines = [line for model in models for line in model.places.program.account]
    program = replace(first.program, account=tuple(dict.fromkeys(lines)))
    still = models[0]._copy(places=replace(first, program=program))
    stiffness = {m.places.program.speed or 0.0: m.stiffness_matrix for m in models}
    if len(stiffness) < len(models):
        raise ValueError(f"path: expected each speed once, got {len(models)} sets of matrices")
    return RotatingModel(still, stiffness)


def damping_of(materials: Mapping[str, Mapping[str, float]]) -> Any:
    """The rule of damping that all materials have, None where they differ or have none."""
    every = {tuple(each.get(name, 0.0) for name in SHARES) for each in materials.values()}
    mass, stiffness, loss = every.pop() if len(every) == 1 else (0.0, 0.0, 0.0)
    if loss:
        return StructuralDamping(loss)
    return RayleighDamping(mass, stiffness) if mass or stiffness else None
