"""`natural_modes`: natural frequencies and modes of a structure, or of the waves of a disk."""

from collections.abc import Iterable
from numbers import Integral

import numpy as np
import xarray as xr

from symhbm.model import Structure
from symhbm.model.linear import natural_modes_of
from symhbm.model.rotation import RotatingModel
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
        Of a sector: one number of nodal diameters, or several; None for all that differ, 0 to
        N / 2. Two modes of one frequency belong to each but 0 and N / 2: one in each sense.
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
        and where some motion has neither mass nor stiffness. What has no mass has no mode.

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
    if not isinstance(structure, Structure):
        raise TypeError(f"structure={check.shown(structure)}: expected a Model or a Sector")
    if isinstance(getattr(structure, "structure", structure), RotatingModel):
        raise TypeError(
            "structure: expected one at one speed, structure.at(speed), its modes change with it; "
            "symhbm.campbell follows them over the speed"
        )
    size = structure.n_dof
    count = min(10, size) if count is None else check.integer("count", count, 1, size)
    stuck = check.flag("stuck", stuck)
    known = structure.nodal_diameters
    if known is None or isinstance(nodal_diameter, Integral):
        return _labelled(structure, nodal_diameter, count, stuck)  # type: ignore[arg-type]
    if nodal_diameter is not None and not isinstance(nodal_diameter, Iterable):
        raise TypeError(f"nodal_diameter={check.shown(nodal_diameter)}: expected integers")
    waves = known if nodal_diameter is None else nodal_diameter
    each = [_labelled(structure, wave, count, stuck) for wave in waves]
    if not each:
        raise ValueError("nodal_diameter=[]: expected at least one")
    return xr.concat(each, "nodal_diameter")


def _labelled(structure: Structure, wave: int | None, count: int, stuck: bool) -> xr.Dataset:
    known, coordinates = structure.nodal_diameters, dict[str, object]()
    if known is not None:
        wave = check.integer("nodal_diameter", wave, known.start, known.stop - 1)
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
