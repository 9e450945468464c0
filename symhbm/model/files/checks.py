"""What files tell of a structure, beside each other: an account in lines, and doubts among them."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.model.cyclic import turn_about
from symhbm.model.files.contents import LOOK, SHARES, Units, units_of
from symhbm.model.files.geometry import Sides, find_sides, twins
from symhbm.model.matrices import Model
from symhbm.model.mesh import Mesh, Modes, Program, Weights
from symhbm.model.places import Places
from symhbm.numerics import RADIANS, FloatArray

_METALS = (1500.0, 23000.0), (3e10, 5e11)
"""Densities [kg/m^3] and moduli [N/m^2] of metals that machines are made of."""
_USUAL = "m-kg-s", "mm-t-s", "mm-kg-ms", "mm-kg-s", "in-lbf-s", "mm-g-ms", "cm-g-s"
"""Units of length, mass and time that decks have."""
_SIZES = 5e-3, 50.0
"""Largest coordinate [m] of machines."""
_WAYS = "x", "y", "z"
_TOUCHING = "left_touching", "right_touching"
"""Sets of nodes that touch the next sector and are not of its sides."""
_DIGIT = 1e-5
"""Last one of six, relative to the first, with which programs write shapes."""
_SAME = 1e-4
"""Difference of two frequencies, relative, that different digits do not make."""
_RIGID = 1e-2
"""Frequency, over the highest one of the program, below which differences are relative to it."""
_HEAVIER = 1e-2
"""Difference of a node's mass, over the largest one, that quadratures of a curved element make."""
_FITS = 1e-2
"""Share of the motion of a side that a wave leaves, from which on it is no such wave."""


def found_units(program: Program | None) -> str | None:
    """The units in which all materials are metals, SI where they are in it; None without any."""
    materials = {} if program is None else program.materials or {}
    told = [m for m in materials.values() if {"density", "modulus"} <= {*m}]
    fits = [name for name in _USUAL if told and all(_is_metal(m, units_of(name)) for m in told)]
    return fits[0] if fits else None


def _is_metal(material: dict[str, float], units: Units) -> bool:
    density = material["density"] * units.mass / units.length**3
    modulus = material["modulus"] * units.mass / units.length / units.time**2
    (least, most), (soft, stiff) = _METALS
    return least < density < most and soft < modulus < stiff


def accounted(model: Model, notes: Iterable[str]) -> tuple[Model, list[str]]:
    """The model with its sides as sets and an account of it all, and doubts."""
    places, account = model.places, list[str]()
    mesh, program = places.mesh, places.program
    account.append(f"{program.name}: {len(mesh.node)} nodes, {model.n_dof} degrees of freedom")
    account += notes
    free = _free(places)
    weights = _weigh(model, free, account)
    if weights is not None:
        program = replace(program, mass=weights.mass, moment=weights.moment)
    _measure(mesh, program, weights, account)
    sides, touching = _sides(mesh, program, free, account)
    if sides is not None:
        mesh = mesh.with_sets({"left": sides.left, "right": sides.right} | touching | mesh.sets)
        program = replace(program, axis=sides.axis, n_sectors=sides.n_sectors)
    for name, nodes in mesh.names.items():
        here = np.isin(nodes, places.nodes).sum()
        if not len(nodes):
            account.append(f"{LOOK}set {name} is empty")
        elif here < len(nodes):
            account.append(f"set {name}: {here} of {len(nodes)} nodes are free")
    supports = np.asarray([] if program.held is None else program.held, dtype=int).reshape(-1, 2)
    loose = free[mesh.at(supports[:, 0]), supports[:, 1]]
    if loose.any():
        node, way = supports[loose][0].tolist()
        account.append(
            f"{LOOK}{loose.sum()} directions of supports are free in the matrices (the first: "
            f"{node}:{_WAYS[way]})"
        )
    if program.modes is not None:
        modes = _compare(model, sides, program.modes, account)
        program = replace(program, modes=modes._replace(shape=None))
    program = replace(program, account=tuple(account))
    doubts = [line.removeprefix(LOOK) for line in account if line.startswith(LOOK)]
    return model._copy(places=replace(places, mesh=mesh, program=program)), doubts


def _free(places: Places) -> NDArray[np.bool_]:
    """Whether each node of the mesh is free along x, y and z, (n_nodes, 3)."""
    free = np.zeros((len(places.mesh.node), 3), dtype=bool)
    for way, letter in enumerate(_WAYS):
        free[places.mesh.at(places.node[places.direction == letter]), way] = True
    return free


def _measure(mesh: Mesh, program: Program, weights: Weights | None, account: list[str]) -> None:
    """Doubt sizes, materials that no machine has, and elements that are not joined."""
    size = np.abs(mesh.coordinates).max()
    if not _SIZES[0] < size < _SIZES[1]:
        account.append(f"{LOOK}the mesh reaches {size:.3g} m from 0, are units= right?")
    materials = program.materials or {}
    if len({tuple(m.get(share, 0.0) for share in SHARES) for m in materials.values()}) > 1:
        account.append(f"{LOOK}materials damp differently, no damping is read; damping= gives it")
    for name, material in materials.items():
        text = f"{name}: "
        if {"density", "modulus"} <= {*material}:
            text += f"density {material['density']:.5g} kg/m^3, modulus "
            text += f"{material['modulus']:.5g} N/m^2"
            if not _is_metal(material, units_of("m-kg-s")):
                account.append(f"{LOOK}{text}, which no metal has, are units= right?")
                continue
        if weights is not None:
            own = [
                weights.elements[kind][each == name]
                for kind, each in mesh.materials.items()
                if kind in weights.elements
            ]
            heavy = np.concatenate([*own, np.zeros(0)])
            text += f"; {len(heavy)} elements of {heavy.sum():.6g} kg"
        account.append(text.replace(": ; ", ": "))
    if hanging := mesh.n_hanging:
        account.append(
            f"{LOOK}linear and quadratic elements meet at {hanging} faces, whose nodes amid edges "
            "are free of the linear ones"
        )


def _weigh(model: Model, free: NDArray[np.bool_], account: list[str]) -> Weights | None:
    """Masses of the mesh, its centre, and its nodes' masses beside those of the mass matrix."""
    places = model.places
    mesh = places.mesh
    along = np.flatnonzero(places.direction == "x")
    rows = (model.mass_matrix @ (places.direction == "x").astype(float))[along]
    materials = (places.program.materials or {}).items()
    density = mesh.of_materials({n: m["density"] for n, m in materials if "density" in m})
    unknown = sum(int(np.isnan(each).sum()) for each in density.values())
    if unknown and any((names != "").any() for names in mesh.materials.values()):
        account.append(
            f"{LOOK}{unknown} elements have no section or no density, masses are unknown"
        )
    if unknown or not density:
        account.append(f"mass of the free nodes {rows.sum():.6g} kg")
        return None
    weights = mesh.weighed(density)
    whole = weights.mass.sum()
    centre = ", ".join(f"{x:.6g}" for x in weights.moment.sum(axis=0) / whole)
    account.append(f"mass {whole:.6g} kg, centre at {centre} m")
    at = mesh.at(places.node[along])
    expected = weights.mass[at]
    inner = np.ones(len(mesh.node), dtype=bool)
    for block in mesh.elements.values():
        # Beside supports a row lacks what the matrix has no column for.
        nodes = mesh.at(block)
        inner[nodes[~free[nodes, 0].all(axis=1)]] = False
    if model.mass_matrix.nnz <= model.n_dof:  # lumped: its nodes share elements in other ways
        inner[:] = False
        if free.all() and abs(rows.sum() - whole) > _HEAVIER * whole:
            account.append(
                f"{LOOK}the mass matrix has {rows.sum():.6g} kg, elements {whole:.6g} kg"
            )
    off = np.where(inner[at], np.abs(rows - expected), 0.0)
    if off.max(initial=0.0) > _HEAVIER * np.abs(expected).max():
        j = int(off.argmax())
        account.append(
            f"{LOOK}the mass matrix is of another mesh or density, or of more elements: node "
            f"{places.node[along][j]} has {rows[j]:.6g} kg, the mesh gives it {expected[j]:.6g} kg"
        )
    return weights


def _sides(
    mesh: Mesh, program: Program, free: NDArray[np.bool_], account: list[str]
) -> tuple[Sides | None, dict[str, NDArray[np.int64]]]:
    """The sides of a sector by their names, or by geometry, and sets of what else touches."""
    touching: dict[str, NDArray[np.int64]] = {}
    found = find_sides(mesh, program.axis, program.n_sectors)
    known = {name.lower(): name for name in mesh.names}
    named = program.sides or [known[side] for side in ("left", "right") if side in known]
    axis, n_sectors = found[:2] if found else (program.axis, program.n_sectors)
    if len(named) == 2 and axis is not None and n_sectors is not None:
        nodes = [mesh.names[name] for name in named]
        ahead = twins(mesh, axis, n_sectors, *nodes)
        back = twins(mesh, axis, n_sectors, *nodes[::-1])
        best, names = (ahead, named) if len(ahead.left) >= len(back.left) else (back, named[::-1])
        if program.sides is None and best is back:
            account.append(
                f"{LOOK}sides are exchanged: {named[1]} should be {named[0]} turned by "
                f"{360 / n_sectors:g} degrees about {axis}, it is turned back"
            )
        if len(best.left) < max(map(len, nodes)):
            account.append(
                f"{LOOK}sides {named[0]} and {named[1]} do not match: {len(best.left)} of "
                f"{' and '.join(str(len(each)) for each in nodes)} nodes are "
                f"{360 / n_sectors:g} degrees about {axis} apart"
            )
        account.append(f"left is {names[0]}, right is {names[1]}")
        if found is not None:
            more = ~np.isin(found.left, best.left) & free[mesh.at(found.left)].any(axis=1)
            touching = dict(zip(_TOUCHING, (found.left[more], found.right[more]), strict=True))
            account.append(
                f"{more.sum()} free nodes touch the next sector beside {names[0]}, contacts or a "
                f"crack: sets {' and '.join(_TOUCHING)}"
            ) if more.any() else touching.clear()
        found = best
    elif found is not None:
        account.append(
            f"{LOOK}nobody names the sides; left and right are all nodes that touch the next "
            "sector, those of shrouds that rub, too"
        )
    if found is None or len(found.left) == 0:
        account.append("no sector of a disk: no two sides found")
        return None, {}
    account.append(
        f"sector of {found.n_sectors}, {360 / found.n_sectors:g} degrees about {found.axis}: "
        f"{len(found.left)} pairs of nodes, {found.gap:.2g} m apart at most"
    )
    uneven = (free[mesh.at(found.left)] != free[mesh.at(found.right)]).any(axis=1)
    if uneven.any():
        account.append(
            f"{LOOK}{uneven.sum()} pairs of the sides are not free alike (the first: "
            f"{found.left[uneven][0]} and {found.right[uneven][0]}): supports or equations of one "
            "side"
        )
    return found, touching


def _compare(model: Model, sides: Sides | None, modes: Modes, account: list[str]) -> Modes:
    """Modes of the program in these matrices, and in the sense of nodal diameters here."""
    if modes.shape is None or not np.isin(model.places.direction, _WAYS).all():
        account.append(f"{len(modes.frequency)} frequencies of the program are not compared")
        return modes
    places = model.places
    mesh = places.mesh
    at = mesh.at(places.node), np.searchsorted(_WAYS, places.direction)
    motion = modes.shape[:, *at].T
    elastic = np.einsum("ij,ij->j", motion.conj(), model.stiffness_matrix @ motion).real
    heavy = np.einsum("ij,ij->j", motion.conj(), model.mass_matrix @ motion).real
    frequency = np.sqrt(np.maximum(elastic / heavy, 0)) / RADIANS
    if modes.nodal_diameter is not None and sides is not None:
        modes = modes._replace(nodal_diameter=_signed(mesh, sides, modes, account))
    # Of rigid bodies both have round-off, which is of the squares, and shapes are rounded.
    rounded = model.stiffness_matrix.diagonal() @ _rounded(motion) / heavy / RADIANS**2
    least = np.maximum((_RIGID * modes.frequency.max()) ** 2, rounded / (2 * _SAME))
    apart = np.abs(frequency**2 - modes.frequency**2)
    off = apart / (2 * np.maximum(modes.frequency**2, least))
    for wave in [None] if modes.nodal_diameter is None else np.unique(modes.nodal_diameter):
        chosen = slice(None) if wave is None else modes.nodal_diameter == wave
        text = "modes" if wave is None else f"{wave} nodal diameters"
        own = ", ".join(f"{f:.7g}" for f in modes.frequency[chosen][:3])
        same = f"its shapes have the same here to {off[chosen].max():.0e}"
        account.append(f"{text}: {own} Hz by the program, {same}")
    if off.max() > _SAME:
        j = int(off.argmax())
        account.append(
            f"{LOOK}the program's mode of {modes.frequency[j]:.6g} Hz has {frequency[j]:.6g} Hz "
            "in these matrices: another speed, mesh, material or support"
        )
    return modes


def _rounded(motion: Any) -> FloatArray:
    """Mean square error of numbers that six digits leave, twice to be sure."""
    parts = np.abs(np.array([motion.real, motion.imag]))
    first = 10.0 ** np.floor(np.log10(np.where(parts > 0, parts, 1.0)))
    return np.sum(np.where(parts > 0, _DIGIT * first, 0.0) ** 2, axis=0) / 6


def _signed(mesh: Mesh, sides: Sides, modes: Modes, account: list[str]) -> NDArray[np.int64]:
    """Nodal diameters in the sense here, by how the right side of each mode lags its left one."""
    turned = turn_about(sides.axis, 2 * np.pi / sides.n_sectors)
    left = modes.shape[:, mesh.at(sides.left)] @ turned.T
    right = modes.shape[:, mesh.at(sides.right)]
    waves = np.asarray(modes.nodal_diameter)
    lag = np.exp(-2j * np.pi * waves / sides.n_sectors)[:, None, None]
    size = np.linalg.norm(right, axis=(1, 2))

    def left_over(factor: NDArray) -> FloatArray:
        return np.linalg.norm(right - factor * left, axis=(1, 2)) / np.where(size, size, 1.0)

    same, other = left_over(lag), left_over(lag.conj())
    astray = np.minimum(same, other) > _FITS
    if astray.any():
        j = int(astray.argmax())
        account.append(
            f"{LOOK}the program's mode of {modes.frequency[j]:.6g} Hz is no wave of {waves[j]} "
            f"nodal diameters, of neither sense ({min(same[j], other[j]):.1%} of the side is left)"
        )
    turning = (2 * waves) % sides.n_sectors != 0
    back = turning & (other < same)
    if back.any():
        which = "all" if back[turning].all() else f"{back.sum()} of {turning.sum()}"
        account.append(
            f"{LOOK}nodal diameters of {which} modes of the program are of the other sense: its n "
            "is -n here, for engine orders and for symhbm.Sector"
        )
    elif turning.any():
        account.append("nodal diameters of the program are of the sense here")
    return np.where(back, -waves, waves)
