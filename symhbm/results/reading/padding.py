"""`trimmed`: a result without the padding that no curve of it needs."""

import numpy as np
import xarray as xr

from symhbm.results.reading.blockwise import is_inner
from symhbm.results.schema import check_dataset

_PADDED = ("point", "peak", "event", "solution", "branch")
"""Dimensions along which curves have lengths of their own."""


def trimmed(result: xr.Dataset) -> xr.Dataset:
    """A result whose padded dimensions are as long as its longest curve, and no longer.

    The curves of a sweep have different numbers of points, peaks and events; shorter ones are
    filled up with NaN, -1, False or empty words. A selected curve keeps what the longest of all
    needed, and this takes it off: of one curve nothing but its own values is left. `table` needs no
    trimming.

    Parameters
    ----------
    result
        A result of this library, or a part of one. Of an archive opened lazily only frequencies
        and the like are read.

    Returns
    -------
    Dataset with shorter dimensions ``point``, ``peak``, ``event`` and ``solution``, of length 0
    where no curve has one; everything else as it is.

    Raises
    ------
    TypeError
        For what is no dataset.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> sweep = sh.frf(problem, (10, 30), over={"normal_load": [1, 3]})
    >>> curve = sh.datasets.trimmed(sweep.sel(normal_load=3))
    >>> curve.sizes["point"] == curve.n_points.item() < sweep.sizes["point"]
    True
    """
    check_dataset("result", result)
    length = {}
    for dim in set(_PADDED) & {*map(str, result.dims)}:
        told = [variable for variable in result.variables.values() if _tells(variable, dim)]
        used = np.zeros(result.sizes[dim], dtype=bool)
        for variable in told:
            others = tuple(variable.dims.index(other) for other in variable.dims if other != dim)
            used |= np.isfinite(variable.values).any(axis=others)
        if told:
            length[dim] = slice(0, int(np.flatnonzero(used).max(initial=-1)) + 1)
    return result.isel(length)


def _tells(variable: xr.Variable, dim: str) -> bool:
    """Whether numbers of a variable tell what is padding along a dimension, and are few."""
    return (
        dim in variable.dims
        and variable.dtype.kind == "f"
        and not any(map(is_inner, variable.dims))
    )
