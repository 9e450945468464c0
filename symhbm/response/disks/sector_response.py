"""`sector_response`: the response of any sector of a disk from that of the first."""

from collections.abc import Iterable

import numpy as np
import xarray as xr

from symhbm.numerics import check
from symhbm.results import Description, check_dataset


def sector_response(response: xr.Dataset, sector: int | Iterable[int]) -> xr.Dataset:
    """Response of other sectors of a disk, ``X_h^(j) = X_h^(0) exp(-i h E j phi)``.

    Parameters
    ----------
    response
        A result of `frf`, `follow`, `solve` or `recover` of a `Sector`, condensed or not.
    sector
        The number of a sector, 0 for the one that was solved, ascending the way it is turned to the
        next one; or several numbers.

    Returns
    -------
    Dataset with ``coefficient`` and ``peak_coefficient`` [m] and the coefficients of outputs, as
    far as there, in the axes of each sector itself. Several sectors are a dimension ahead.
    Amplitudes are those of the first one.

    Raises
    ------
    TypeError, ValueError
        For a number that is none, and a dataset that is not of a sector under an engine order.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.Model([[1.0, 0], [0, 0]], [[2.0, 0], [0, 0]], [[3e4, -2e4], [-2e4, 2e4]])
    >>> disk = sh.Sector(blade, left=[0], right=[1], n_sectors=12)
    >>> problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(3, pattern={0: 1.0}))
    >>> first = sh.solve(problem, 30)
    >>> second = sh.datasets.sector_response(first, 1)  # it lags by a quarter of a period
    >>> bool(abs(second.coefficient[..., 1] - first.coefficient[..., 0]).max() < 1e-15)
    True
    """
    check_dataset("response", response)
    told = Description(response).problem
    n_sectors = told.get("n_sectors")
    if n_sectors is None:
        raise ValueError("response: expected the result of a symhbm.Sector under an engine order")
    order = response["engine_order"] if "engine_order" in response else told["order"]
    if isinstance(sector, Iterable) and not isinstance(sector, (str, bytes)):
        each = [sector_response(response, number) for number in sector]
        if not each:
            raise ValueError("sector=[]: expected at least one")
        return xr.concat(each, "sector")
    number = check.integer("sector", sector, 0, n_sectors - 1)
    turns = response["harmonic"] * order * number % n_sectors / n_sectors
    cosine, sine = np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)
    result = xr.Dataset(attrs=response.attrs)
    outputs = [f"{name}_coefficient" for name in told.get("outputs", {})]
    for name in ("coefficient", "peak_coefficient", *outputs):
        if name in response:
            a, b = (response[name].sel(component=part) for part in ("cos", "sin"))
            parts = a * cosine - b * sine, a * sine + b * cosine
            moved = xr.concat(parts, response["component"]).transpose(*response[name].dims, ...)
            result[name] = moved.assign_attrs(response[name].attrs)
    about = {"long_name": "sector of the disk", "units": "1"}
    return result.assign_coords(sector=((), number, about))
