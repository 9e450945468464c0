"""Disks assembled from all of their sectors, with contacts and forces, to hold a sector against."""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

import symhbm as sh


class Ring(NamedTuple):
    """A whole disk: its ``model``, ``force``, and ``motions``, which by sector tell its motion.

    ``motions[j]`` (n_dof of a sector, n_dof of the ring) is in the axes of sector j.
    """

    model: sh.Model
    force: Any
    motions: list[Any]


def assembled(disk: sh.Sector, force: Any = None, harmonics: tuple[int, ...] = (1,)) -> Ring:
    """The ring of a disk: unknowns sector by sector, each in the axes of its own."""
    interfaces, n = disk.interfaces, disk.n_sectors
    n_dof, n_kept = disk.n_whole, disk.n_dof
    own = sp.eye_array(n_dof, format="csr")[:, interfaces.others]
    ahead = sp.csr_array((n_dof, n_kept)).tolil()
    ahead[interfaces.right] = (interfaces.rotation[interfaces.left] @ own).tolil()
    motions = []
    for j in range(n):
        here, there = (sp.csr_array(([1.0], ([0], [k])), (1, n)) for k in (j, (j + 1) % n))
        motions.append((sp.kron(here, own) + sp.kron(there, ahead)).tocsr())
    parts = [getattr(disk.structure, f"{name}_matrix") for name in ("mass", "damping", "stiffness")]
    matrices = [sum(t.T @ part @ t for t in motions) for part in parts]
    rows = disk._directions_as_named
    all_rows = [
        rows[:, :n_dof] @ motions[j] + rows[:, n_dof:] @ interfaces.rotation @ motions[(j + 1) % n]
        for j in range(n)
    ]
    contacts = {}
    for group in disk.groups:
        directions = [
            np.vstack([of_sector[group.rows[:, k]].toarray() for of_sector in all_rows])
            for k in range(group.rows.shape[1])
        ]
        values = {name: np.tile(v, n) for name, v in group.values.items()}
        contacts[group.name] = sh.Contacts(group.law, *directions, **values)
    model = sh.Model(*matrices, contacts=contacts)
    return Ring(model, None if force is None else _force(disk, force, motions), motions)


def _force(disk: sh.Sector, force: Any, motions: list[Any]) -> Any:
    """The force on all sectors, wave by wave."""
    parts = force.parts if hasattr(force, "parts") else (force,)
    cosine, sine = {}, {}
    total = sh.forces.StaticLoad(sum(t.T @ force.static(disk.n_whole) for t in motions))
    for part in parts:
        for harmonic, given in (getattr(part, "pattern", None) or {}).items():
            whole = np.zeros(disk.n_whole, dtype=complex)
            dofs = [*given] if isinstance(given, dict) else [*range(len(given))]
            whole[dofs] = [*given.values()] if isinstance(given, dict) else given
            push = sum(
                t.T @ (whole * np.exp(-2j * np.pi * harmonic * part.order * j / disk.n_sectors))
                for j, t in enumerate(motions)
            )
            cosine[harmonic], sine[harmonic] = push.real, -push.imag
            amplitude = part.amplitude
    return sh.forces.HarmonicForce(cosine=cosine, sine=sine, amplitude=amplitude) + total
