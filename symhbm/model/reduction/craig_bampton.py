"""`craig_bampton`: structures and sectors reduced to a few degrees of freedom, with matrices."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.contacts import Contacts
from symhbm.model.cyclic import Blade, Sector
from symhbm.model.linear import lowest_modes, natural_modes_of
from symhbm.model.matrices import Model
from symhbm.model.outputs import Output
from symhbm.model.places import check_whole, next_sector, own_numbers
from symhbm.model.reduction.reduced_model import (
    Component,
    ReducedModel,
    by_rows,
    certified,
    chosen_rows,
    follow,
    projected,
    waves_near,
)
from symhbm.model.sectors import check_at_one_speed, ends_of
from symhbm.numerics import FloatArray, check

_NOTHING = 1e-12
"""Weight of a displacement that is round-off."""
_ALIKE = 1e-6
"""Relative difference of frequencies of modes whose shapes nothing tells apart."""
_WAVES = 9
"""Most nodal diameters whose modes tell the motion of interfaces."""

_NOTHING_TOUCHED = "places=(): expected at least one for a structure without contacts"


def craig_bampton(
    structure: Model | Sector,
    modes: int,
    frequency_band: tuple[float, float],
    *,
    interface_modes: int | None = None,
    places: Iterable[Any] = (),
    blade: Iterable[Any] | None = None,
    blade_modes: int = 0,
) -> Any:
    """Reduce a structure by Craig and Bampton: constraint modes, and modes with the boundary held.

    What contacts touch, ``places`` and the interfaces of a sector are the boundary, and stay.
    Unlike one that is condensed, the result has matrices: motions in time, stability, designs and
    mistuned disks are for it. It is not exact; its ``certificate`` tells how far.

    Parameters
    ----------
    structure
        A `Model` with its contacts, or a `Sector` with its.
    modes
        Number of modes with the boundary held, from the lowest on.
    frequency_band
        Band [Hz] that the certificate is of. Harmonics reach beyond that of the excitation: a band
        to its highest frequency times the highest harmonic covers them.
    interface_modes
        Motions that the interfaces of a sector keep beside what contacts touch on them, those that
        the lowest modes of all nodal diameters share most; None keeps all.
    places
        Degrees of freedom to keep, blade tips for example.
    blade
        Degrees of freedom of the blade of a sector, but those of its root, that deviations of
        `mistuned_ring` are of; None for the whole sector.
    blade_modes
        Number of modes of the blade alone, held at its root, from the lowest on: each of their
        frequencies deviates by itself in a `mistuned_ring`. ``blade.frequencies`` of the
        result are theirs.

    Returns
    -------
    A `Model` or a `Sector` on the boundary and, in place of each mode, on one more degree of
    freedom: all coordinates are displacements of places of the structure, ``kept`` tells of which.
    Forces are those of the whole structure. ``certificate`` of it, of a sector that of its
    ``structure``, is a `ReductionCertificate`.

    Raises
    ------
    TypeError, ValueError
        For bad arguments, for a structure that moves freely once its boundary is held or is reduced
        already, and for more modes than there are.

    Notes
    -----
    The error of natural frequencies falls slowly with the number of modes; that of relative
    displacements of contacts is that of the static motion that modes leave out. `condense` is
    exact, and better wherever matrices are not needed.

    Examples
    --------
    A chain of 200 masses with a contact to the ground at its end:

    >>> import scipy.sparse as sp
    >>> import symhbm as sh
    >>> M = sp.eye_array(200)
    >>> K = 1e4 * (2 * M - sp.eye_array(200, k=1) - sp.eye_array(200, k=-1))
    >>> chain = sh.Model(
    ...     M, 0.5 * M + 1e-5 * K, K, contacts=[(199,)],
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=0.5,
    ... )
    >>> small = sh.craig_bampton(chain, modes=12, frequency_band=(0.2, 1), places=[99])
    >>> small.n_dof, small.certificate.frequency_error < 1e-2
    (14, True)
    >>> response = sh.frf(sh.HarmonicBalance(small, sh.forces.PointForce(place=99)), (0.2, 1))
    >>> response.structure_dof.values[:2]
    array([ 99, 199])
    """
    modes = check.integer("modes", modes, minimum=0)
    band = ends_of(frequency_band, "non-negative")
    blade_modes = check.integer("blade_modes", blade_modes, minimum=0)
    if blade_modes and blade is None:
        raise ValueError(f"blade_modes={blade_modes}: expected 0, or a blade that has modes")
    if isinstance(structure, (Model, Sector)):
        check_whole("structure", structure)
    if isinstance(structure, Sector):
        check_at_one_speed("structure", structure.structure)
        reduced = _sector(structure, modes, band, interface_modes, places)
        if blade is not None:
            of_blade = own_numbers("blade", structure, blade)
            parts = _blade(structure.structure, reduced.structure._lift, of_blade, blade_modes)
            reduced._store(blade=parts)
        return reduced
    check.instance("structure", structure, Model, "a Model or a Sector")
    check_at_one_speed("structure", structure)
    if blade is not None:
        raise ValueError("blade: expected None, only a sector has one")
    if interface_modes is not None:
        raise ValueError(f"interface_modes={interface_modes}: expected None, only a sector has any")
    watched = own_numbers("places", structure, places)
    boundary = np.unique([*structure.touched, *watched]).astype(np.intp)
    component = _component(structure, boundary, sp.eye_array(len(boundary), format="csr"), modes)
    kept = np.concatenate([boundary, component.representatives])
    reduced = ReducedModel(structure, kept, component)
    both = watched, np.searchsorted(boundary, watched)
    reduced._store(certificate=certified(structure, reduced, both, band, None))
    return reduced


def _component(model: Model, boundary: NDArray[np.intp], motion: Any, modes: int) -> Component:
    if len(boundary) == 0:
        raise ValueError(_NOTHING_TOUCHED)
    if len(boundary) == model.n_dof:
        raise ValueError("places: expected fewer, nothing is left to be reduced")
    return Component(model.mass_matrix, model.stiffness_matrix, boundary, motion, modes)


def _blade(structure: Model, basis: FloatArray, blade: NDArray[np.intp], n_modes: int) -> Blade:
    """Stiffness, mass and modes of a blade as the reduced sector of a ``basis`` has them.

    The stiffness resists what the blade moves beside its static motion with the root, so that it
    does not resist where the root takes it. Modes are those of the same motion.
    """
    if not 0 < len(blade) < structure.n_dof:
        raise ValueError("blade: expected some degrees of freedom of the sector, and not all")
    others = np.setdiff1d(np.arange(structure.n_dof), blade)
    rows = structure.stiffness_matrix.tocsr()[blade]
    inside = rows[:, blade].tocsc()
    beside = basis[blade] - follow(inside, -(rows[:, others] @ basis[others]))
    mass = structure.mass_matrix.tocsr()[blade][:, blade]
    natural, shapes = np.zeros(0), np.zeros((len(blade), 0))
    if n_modes:
        natural, shapes = _modes_of_blade(inside, mass.tocsc(), n_modes)
    both = projected(inside, beside), projected(mass, basis[blade])
    return Blade(*both, natural, shapes.T @ (mass @ beside))


def _modes_of_blade(stiffness: Any, mass: Any, count: int) -> tuple[FloatArray, FloatArray]:
    """The lowest modes of a blade held at its root: frequencies [Hz], shapes of unit mass."""
    # One more tells whether the last one is alone.
    squares, shapes = lowest_modes(stiffness, mass, count + 1)
    natural = np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)
    if len(natural) < count:
        raise ValueError(
            f"blade_modes={count}: expected at most {len(natural)}, the modes of the blade"
        )
    for mode in np.flatnonzero(np.diff(natural) <= _ALIKE * natural[1:])[:1].tolist():
        check.warn(
            f"blade_modes={count}: modes {mode} and {mode + 1} of the blade alone have the same "
            f"frequency, {natural[mode]:.6g} Hz, and no shapes of their own; keep both, with the "
            "same deviations"
        )
    return natural[:count], shapes[:, :count]


def _sector(
    sector: Sector,
    modes: int,
    band: tuple[float, float],
    interface_modes: int | None,
    places: Iterable[Any],
) -> Sector:
    """A sector on its interfaces or their motions, what contacts touch, and some of its inside."""
    left, right = sector.interfaces.left, sector.interfaces.right
    watched = own_numbers("places", sector, places)
    for dof in watched[np.isin(watched, right)]:
        raise ValueError(f"places: expected none on the right, {dof} is one of the next sector")
    touched = np.unique([*sector.touched, *watched]).astype(np.intp)
    if not len(touched):
        raise ValueError(_NOTHING_TOUCHED)
    shared, chosen = _interface(sector, np.flatnonzero(np.isin(left, touched)), interface_modes)
    inner = np.setdiff1d(touched, left)
    # Right of a sector is the left of the next one, in the axes of that one.
    turned = sector.interfaces.rotation[left][:, left] @ shared
    boundary = np.concatenate([left, right, inner])
    motion = sp.block_diag([shared, turned, sp.eye_array(len(inner))], format="csr")
    structure = sector.structure
    component = _component(structure, boundary, motion, modes)
    kept = np.concatenate([left[chosen], right[chosen], inner, component.representatives])
    n = len(chosen)
    reduced = ReducedModel(structure, kept, component, n)
    places = reduced.places
    reduced._store(places=None)  # right has the axes of the next sector
    result = Sector(reduced, np.arange(n), np.arange(n, 2 * n), sector.n_sectors)
    result._set_contacts(_contacts(sector, component.basis))
    result = result.under_forces(sector.influences)
    reduced._store(places=places)
    result._store(outputs={n: _seen(sector, result, out) for n, out in sector.outputs.items()})
    # As numbered among the degrees of freedom that are not right.
    own, others = sector.interfaces.others, kept[result.interfaces.others]
    at = {int(dof): i for i, dof in enumerate(others)}
    both = np.searchsorted(own, watched), np.array([at[int(d)] for d in watched], dtype=np.intp)
    n_waves = sector.n_sectors // 2
    waves = {0, (n_waves + 1) // 2, n_waves} | waves_near(result, band)
    reduced._store(certificate=certified(sector, result, both, band, tuple(sorted(waves))))
    return result


def _seen(sector: Sector, reduced: Sector, output: Output) -> Output:
    """An output of a sector, of its reduced one."""
    projected = sector.interfaces.everywhere(output.rows) @ reduced.structure._lift
    right = np.abs(projected[:, reduced.interfaces.right]).max(initial=0.0)
    if right > _NOTHING * np.abs(projected).max():
        raise ValueError(
            f"outputs[{output.name!r}]: expected places that do not move with the interface on the "
            "right, in a sector that is reduced; keep them with places="
        )
    return output.of(projected[:, reduced.interfaces.others])


def _interface(
    sector: Sector, touched: NDArray[np.intp], count: int | None
) -> tuple[FloatArray, NDArray[np.intp]]:
    """Motions (n_left, n) of the left interface that are kept, and the places that tell them."""
    left = sector.interfaces.left
    if count is None:
        return np.eye(len(left)), np.arange(len(left))
    free = np.setdiff1d(np.arange(len(left)), touched)
    if not len(free):
        raise ValueError(
            f"interface_modes={check.shown(count)}: expected None, contacts and places= keep all "
            "of the interface"
        )
    count = check.integer("interface_modes", count, 1, len(free))
    n_waves = len(sector.nodal_diameters)
    waves = np.unique(np.linspace(0, n_waves - 1, min(n_waves, _WAVES)).astype(int))
    each = min(max(count // 2, 4), sector.n_dof)
    shapes = []
    for wave in waves.tolist():
        for stuck in (False, True) if sector.n_contacts else (False,):
            natural, motion = natural_modes_of(sector, wave, each, stuck)
            # Low modes count most; a free motion no more than the lowest that vibrates.
            lowest = natural[natural > 1e-3 * natural.max()].min()
            weighted = motion[left[free]] / np.maximum(natural, lowest)
            shapes += [weighted.real, weighted.imag]
    vectors, sizes, _ = np.linalg.svd(np.hstack(shapes), full_matrices=False)
    count = min(count, int(np.count_nonzero(sizes > 1e-10 * sizes[0])))
    rows = chosen_rows(vectors[:, :count])
    chosen = np.concatenate([touched, free[rows]])
    shared = np.zeros((len(left), len(chosen)))
    shared[touched, np.arange(len(touched))] = 1.0
    shared[free, len(touched) :] = by_rows(vectors[:, :count], rows)
    return shared, chosen


def _contacts(sector: Sector, basis: FloatArray) -> dict[str, Contacts]:
    """The contacts of a sector in the coordinates of its reduced one."""
    n = sector.n_whole
    named = sector._directions_as_named
    own = named[:, :n] @ basis
    beyond = named[:, n:] @ sector.interfaces.rotation @ basis
    rows = [_ends(here, there) for here, there in zip(own, beyond, strict=True)]
    return {
        group.name: Contacts(
            group.law, *([rows[row] for row in column] for column in group.rows.T), **group.values
        )
        for group in sector.groups
    }


def _ends(here: FloatArray, there: FloatArray) -> Any:
    """Weights of the coordinates of this sector and of the next."""
    weights: dict[Any, float] = {
        int(i): float(here[i]) for i in np.flatnonzero(np.abs(here) > _NOTHING)
    }
    for i in np.flatnonzero(np.abs(there) > _NOTHING):
        weights[next_sector(int(i))] = float(there[i])
    return weights
