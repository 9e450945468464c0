"""Reading of datasets block by block, by their dimensions, without padding, as texts to show."""

import unicodedata
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from symhbm.continuation import Status
from symhbm.results.description import Description
from symhbm.results.schema import check_dataset
from symhbm.results.tables import consecutive_blocks
from symhbm.results.variables import VARIABLES

SAMPLE = "sample"
"""The dimension of what was drawn; others of a sweep are of values that were chosen."""
INNER = ("dof", "contact", "blade", "harmonic", "component")
"""Dimensions inside one point, peak or event."""
ALIKE = 1e-9
"""Relative difference of values that differ by round-off alone."""
COMPLETE = Status.REACHED_END, Status.SUCCESS, Status.CLOSED, Status.WITHOUT_BOUND
"""How curves and points end of which nothing is missing."""
_LARGEST_BLOCK = 2**21
"""Values read at once."""


def is_inner(dim: object) -> bool:
    """Whether a dimension is inside one point, peak or event: the rows of outputs are, too."""
    return dim in INNER or str(dim).endswith("_row")


def moving(dataset: xr.Dataset) -> str:
    """Name of the parameter along which a response was followed."""
    return Description(dataset).moving


def curve_status(dataset: xr.Dataset) -> xr.DataArray | None:
    """How the curve of each parameter set ended, None where there is none.

    A design or a fit has a status of its own, beside that of its curves.
    """
    own = "certificate" in dataset.variables or "curve_status" in dataset.variables
    return dataset.get("curve_status" if own else "status")


def with_curve_status(dataset: xr.Dataset) -> xr.Dataset:
    """Curves of which a design or a fit is to tell its own status."""
    if "status" not in dataset.variables:
        return dataset
    about = {"long_name": VARIABLES["curve_status"].long_name}
    named = dataset.rename(status="curve_status")
    return named.assign(curve_status=named["curve_status"].assign_attrs(about))


def set_dimensions(dataset: xr.Dataset) -> tuple[str, ...]:
    """Dimensions of the parameter sets."""
    status = curve_status(dataset)
    return () if status is None else tuple(map(str, status.dims))


def completeness(dataset: xr.Dataset) -> tuple[int, int, Counter[str]]:
    """Numbers of parameter sets that are complete, not computed yet, and failed by their status."""
    status = curve_status(dataset)
    failed = Counter(map(str, [] if status is None else status.values.ravel().tolist()))
    waiting = failed.pop(str(Status.NOT_STARTED), 0)
    complete = sum(failed.pop(str(text), 0) for text in COMPLETE)
    return complete, waiting, failed


def blocks(sizes: Mapping[Any, int], dims: Sequence[str], width: int) -> Iterator[dict[str, slice]]:
    """Slices of ``dims`` in the order of rows, each of at most some million values.

    ``width`` is the number of values of a row.
    """
    budget = max(1, _LARGEST_BLOCK // max(1, width))
    for block in consecutive_blocks([sizes.get(dim, 1) for dim in dims], budget):
        yield dict(zip(dims, block, strict=True))


def read(
    dataset: xr.Dataset, name: str, inner: tuple[str, ...] = ()
) -> Iterator[tuple[dict[str, int], np.ndarray]]:
    """Start and values of each block of a variable, with the dimensions ``inner`` last."""
    variable = dataset[name].variable
    outer = [str(dim) for dim in variable.dims if dim not in inner]
    width = int(np.prod([variable.sizes[dim] for dim in inner]))
    for block in blocks(variable.sizes, outer, width):
        begin = {dim: cut.start for dim, cut in block.items()}
        yield begin, variable.isel(block).transpose(*outer, *inner).values


def largest(
    dataset: xr.Dataset, name: str, array: xr.DataArray | None = None
) -> tuple[float, dict[str, int]] | None:
    """Largest value of a variable and its position, None where all values are NaN."""
    best: tuple[float, dict[str, int]] | None = None
    holder = dataset if array is None else array.to_dataset(name=name)
    dims = [str(dim) for dim in holder[name].dims]
    for begin, values in read(holder, name):
        if not values.size or np.isnan(values).all():
            continue
        # Of blades that differ by round-off alone the first one counts.
        first = np.argmax(values >= np.nanmax(values) * (1 - ALIKE))
        index = np.unravel_index(first, values.shape)
        value = float(values[index])
        if best is None or value > best[0] * (1 + ALIKE):
            position = {d: int(i) + begin[d] for d, i in zip(dims, index, strict=True)}
            best = value, position
    return best


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


def printable(text: str) -> str:
    """A text in one line: control characters, which a terminal obeys, are spaces."""
    if text.isprintable():
        return text
    return "".join(" " if unicodedata.category(c)[0] == "C" else c for c in text)
