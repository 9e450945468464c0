"""`natural_modes`: natural frequencies and modes of a structure, or of the waves of a disk."""

from collections.abc import Iterable
from numbers import Integral

import numpy as np
import xarray as xr

from symhbm.model import Structure
from symhbm.model.cyclic import RotatingModel
from symhbm.model.linear import gyroscopic_part, natural_modes_of
from symhbm.numerics import check


def natural_modes(
    structure: Structure,
    nodal_diameter: int | Iterable[int] | None = None,
    *,
    count: int | None = None,
    stuck: bool = False,
) -> xr.Dataset:
    """Natural frequencies and modes without damping, ``K x = (2 pi f)^2 M x``.

    Parameters
    ----------
    structure
        A `Model`, or any structure with matrices; of a `Sector`, the waves of its disk.
    nodal_diameter
        Of a sector: one number of nodal diameters, or several, negative ones in the other sense;
        None for all that differ. These are 0 to N / 2, two modes of one frequency belonging to each
        but 0 and N / 2, one in each sense; where Coriolis forces or the air split the two, those of
        the other sense, too.
    count
        How many, from the lowest; None for 10, or all of a smaller structure. Above some 500
        degrees of freedom they are computed by shift and invert, from a sparse factorisation.
    stuck
        With the contacts stuck and closed, gaps too: springs of their stiffness along each of their
        directions. Without they are open.

    Returns
    -------
    Dataset with ``frequency`` (mode) [Hz], ascending, and ``mode_shape`` (mode, dof, component)
    [kg^-1/2] of unit mass, of a sector those of all of its degrees of freedom and of unit mass of
    one sector: ``cos a + sin b`` over the period, ``a - i b`` as a complex number. Several nodal
    diameters are a dimension ahead.

    Raises
    ------
    TypeError, ValueError
        For bad arguments, a structure without matrices, nodal diameters of one that is no sector,
        and where some motion has neither mass nor stiffness, or grows. What has no mass has no
        mode.

    Notes
    -----
    What takes power is damping and left out, of the air, too: the imaginary part of its
    coefficients, and where the real part of blades before and behind differs. Where the imaginary
    part of both differs it takes none: it splits frequencies, as Coriolis forces do.

    Examples
    --------
    A ring of 24 masses, each on a spring to the ground and on one to the next:

    >>> import symhbm as sh
    >>> mass = sh.Model([[1.0, 0], [0, 0]], [[0.1, 0], [0, 0]], [[3e4, -2e4], [-2e4, 2e4]])
    >>> disk = sh.Sector(mass, left=[0], right=[1], n_sectors=24)
    >>> modes = sh.natural_modes(disk)
    >>> modes.frequency.sel(nodal_diameter=[0, 6, 12]).values.round(3).ravel()
    array([15.915, 35.588, 47.746])
    """
    check.instance("structure", structure, Structure, "a Model or a Sector")
    if isinstance(getattr(structure, "structure", structure), RotatingModel):
        raise TypeError(
            "structure: expected one at one speed, structure.at(speed), its modes change with it; "
            "symhbm.campbell follows them over the speed"
        )
    structure = structure.without_rule()
    size = structure.n_dof
    count = min(10, size) if count is None else check.integer("count", count, 1, size)
    stuck = check.flag("stuck", stuck)
    waves = waves_of(structure, nodal_diameter, nodal_diameter is None and both_senses(structure))
    each = [_labelled(structure, wave, count, stuck) for wave in waves]
    if waves == [None] or isinstance(nodal_diameter, Integral):
        return each[0]
    return xr.concat(each, "nodal_diameter")


def both_senses(structure: Structure) -> bool:
    """Whether Coriolis forces or the air make waves of either sense differ."""
    waves = [None] if structure.nodal_diameters is None else structure.nodal_diameters
    return any(
        gyroscopic_part(structure.matrices(wave).damping_matrix) is not None for wave in waves
    )


def waves_of(
    structure: Structure, given: int | Iterable[int] | None, both: bool
) -> list[int | None]:
    """The numbers of nodal diameters that are asked for, None alone of what has no waves.

    TypeError or ValueError for bad ones.
    """
    known = structure.nodal_diameters
    if known is None:
        if given is not None:
            structure.matrices(given)  # type: ignore[arg-type]  # it refuses
        return [None]
    highest = known.stop - 1
    if given is None:
        lowest = -((structure.n_sectors - 1) // 2) if both else 0  # type: ignore[attr-defined]
        return [*range(lowest, highest + 1)]
    each = given if isinstance(given, Iterable) else [given]
    waves = [check.integer("nodal_diameter", n, -highest, highest) for n in each]
    if not waves:
        raise ValueError("nodal_diameter=[]: expected at least one")
    return [*waves]


def _labelled(structure: Structure, wave: int | None, count: int, stuck: bool) -> xr.Dataset:
    coordinates = dict[str, object]()
    if wave is not None:
        coordinates["nodal_diameter"] = (), wave, {"long_name": "nodal diameters", "units": "1"}
    frequencies, shapes = natural_modes_of(structure, wave, count, stuck)
    parts = np.stack([shapes.T.real, -shapes.T.imag], axis=-1)
    variables = {
        "frequency": ("mode", frequencies, {"long_name": "natural frequency", "units": "Hz"}),
        "mode_shape": (
            ("mode", "dof", "component"),
            parts,
            {"long_name": "natural mode of unit mass", "units": "kg-0.5"},
        ),
    }
    return xr.Dataset(variables, coordinates | {"component": ["cos", "sin"]})
