"""What an engine order tells of structures: sectors that move alike, and the speed of rotation.

The speed is ``Omega = omega / order``.
"""

from collections import defaultdict
from functools import partial
from typing import Any

import numpy as np

from symhbm.model.contacts import renumbered
from symhbm.model.excitation import Excitation
from symhbm.model.linear import lagging
from symhbm.model.structure import Structure
from symhbm.model.symmetry import Symmetry
from symhbm.numerics import FloatArray, FourierBasis, check

_ROUND_OFF = 1e-14
"""Of the cosines and sines of a travelling wave, relative to its amplitude."""


def find_symmetry(model: Structure, excitation: Excitation, basis: FourierBasis) -> Symmetry | None:
    """The smallest sector that repeats itself around a structure, None if there is none.

    Degrees of freedom are to be numbered sector by sector. Sectors are equal to the bit. None is
    found without matrices.
    """
    if not model.has_matrices or model.matrix_terms:
        return None
    for n_dof in range(1, model.n_dof // 2 + 1):
        if model.n_dof % n_dof or not _repeats(model, n_dof):
            continue
        n_sectors = model.n_dof // n_dof
        order = _contact_order(model, n_dof, n_sectors)
        if order is None:
            continue
        shapes, static = model.felt_shapes(excitation, basis), model.felt_static(excitation)
        if not np.array_equal(np.roll(static, -n_dof), static):
            continue
        lags = [_lag(shape, n_dof, n_sectors, basis) for shape in shapes.values()]
        if lags[0] is not None and len({*lags}) == 1:
            return Symmetry(n_sectors, n_dof, lags[0], *order)
    return None


def _repeats(model: Structure, step: int) -> bool:
    """Whether the matrices are the same after ``step`` degrees of freedom."""
    moved = np.roll(np.arange(model.n_dof), -step)
    for matrix in (model.mass_matrix, model.damping_matrix, model.stiffness_matrix):
        # The diagonal first: it tells a mistuned structure at no cost.
        diagonal = matrix.diagonal()
        if not np.array_equal(diagonal[moved], diagonal):
            return False
        if model.lumped:
            continue
        if (matrix[moved][:, moved] != matrix).nnz:
            return False
    return True


def _contact_order(
    model: Structure, step: int, n_sectors: int
) -> tuple[tuple[int, ...], tuple[int, ...]] | None:
    """Sector of each contact and its place there, None where contacts do not repeat."""
    if model.n_contacts % n_sectors:
        return None
    values: list[list[Any]] = [[] for _ in model.contacts]
    for group in model.groups:
        of_group = np.array(list(group.values.values())).T.tolist()
        for j, row in zip(group.contacts, of_group, strict=True):
            values[j] += [group.name, *row]
    # Contacts of equal ends, side by side, differ by their values.
    known: dict[tuple, list[int]] = defaultdict(list)
    keys = [(ends, tuple(row)) for ends, row in zip(model.contacts, values, strict=True)]
    for j, key in enumerate(keys):
        known[key].append(j)
    sector = np.full(model.n_contacts, -1)
    place = np.full(model.n_contacts, -1)
    n_places = 0
    for j, (ends, row) in enumerate(keys):
        if sector[j] >= 0:
            continue
        twin = known[ends, row].index(j)
        for i in range(n_sectors):
            moved = renumbered(ends, partial(_further, i * step, model.n_dof))
            alike = known.get((moved, row), [])
            if twin >= len(alike) or sector[alike[twin]] >= 0:
                return None
            sector[alike[twin]], place[alike[twin]] = i, n_places
        n_places += 1
    return tuple(sector.tolist()), tuple(place.tolist())


def _further(step: int, n_dof: int, dof: int) -> int:
    return (dof + step) % n_dof


def _lag(shape: FloatArray, step: int, n_sectors: int, basis: FourierBasis) -> int | None:
    """Turns over the number of sectors by which the force lags from each to the next."""
    level = _ROUND_OFF * np.abs(shape).max(initial=0.0)
    moved = np.roll(shape, -step, axis=0)
    for lag in range(n_sectors):
        if np.all(np.abs(moved - lagging(shape, basis, lag, n_sectors)) <= level):
            return lag
    return None


def speed_order(model: Structure) -> float | None:
    """The engine order along which a structure or its contacts change, None where nothing does.

    ValueError for several.
    """
    orders = {model.engine_order, *(group.law.engine_order for group in model.groups)} - {None}
    if len(orders) > 1:
        raise ValueError(
            f"engine_order: expected one for the structure and its contacts, got {sorted(orders)}"
        )
    return orders.pop() if orders else None


def check_at_one_speed(name: str, structure: Structure) -> None:
    """Raise TypeError for a structure whose matrices change with the speed of rotation."""
    if getattr(structure, "speeds", None) is not None:
        raise TypeError(
            f"{name}: expected matrices that do not change with the speed of rotation; give the "
            "structure at one speed, RotatingModel.at(speed), or a sector of one by its own "
            "at(speed)"
        )


def ends_of(frequency_band: Any, bound: Any) -> tuple[float, float]:
    """The ends of a band [Hz], ascending; ValueError for what is none."""
    edges = check.array("frequency_band", frequency_band, bound)
    if edges.shape != (2,) or edges[0] == edges[1]:
        raise ValueError(
            f"frequency_band={check.shown(frequency_band)}: expected two different values in Hz"
        )
    return float(edges.min()), float(edges.max())


def check_speed(model: Structure, excitation: Excitation) -> None:
    """Raise ValueError unless structure, contacts and excitation turn at one speed."""
    order = speed_order(model)
    if order is None or excitation.speed_ratios <= {float(order)}:
        return
    told = ", ".join(f"{ratio:g}" for ratio in sorted(excitation.speed_ratios))
    raise ValueError(
        f"excitation={excitation!r}: expected one of frequencies {order} times the speed of "
        f"rotation, as engine_order={order} of structure and contacts says; its engine orders over "
        f"their harmonics are {told}"
    )
