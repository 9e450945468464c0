"""Reading of datasets block by block, by their dimensions, without padding, as texts to show.

`at` chooses one point of each curve: at its peaks, at its largest response, or at a value.
"""

import unicodedata
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr

from symhbm.continuation import Status
from symhbm.numerics import FloatArray, check
from symhbm.results.description import Description, amplitude_of
from symhbm.results.schema import check_dataset, check_present
from symhbm.results.tables import blank, consecutive_blocks
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
_PADDED = ("point", "peak", "event", "solution", "branch")
"""Dimensions along which curves have lengths of their own."""
At = Literal["peak", "largest"] | int | float
"""The highest peak, the largest response, the number of a peak, or a value of what moves."""
CHOSEN = "chosen"
"""Coordinate of points of curves: which ones these are."""
_SAME = 1e-9
"""Relative distance of a peak from the point of a path that it is."""


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


def at(result: xr.Dataset, at: At | None = None) -> xr.Dataset:
    """One point of each curve: at its highest peak, at another one, or at a value.

    Parameters
    ----------
    result
        A result of `frf` or `follow`: one curve, a sweep or an ensemble.
    at
        ``"peak"`` for the highest located peak of each curve, an integer for the peak of this
        number, from 0 along the curve; a real number as ``19.0`` for the stored point that is
        nearest to this value of what moves, mostly the frequency [Hz]; ``"largest"`` for the point
        of the largest response, which may be at an end of the band. By default the highest peak,
        and the largest response of curves that have none.

    Returns
    -------
    Dataset like that of `solve`, along the dimensions of the sweep. The coordinate ``chosen`` says
    which point it is; curves that have none are filled with NaN, -1 or empty words there. Peaks of
    paths are points of them. Between the values of a grid (``at=`` of `frf`) ``coefficient`` [m],
    ``amplitude`` [m] and what moves are known of a peak, and nothing else.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no result with curves, for results without the coefficients of peaks, for places
        that are none, and where no curve has such a point.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> tops = sh.datasets.at(sh.frf(problem, (10, 30), over={"normal_load": [1, 3]}), "peak")
    >>> tops.frequency.values.round(2), tops.dissipation.dims
    (array([15.92, 19.37]), ('normal_load', 'contact'))
    """
    check_dataset("result", result)
    check_present(result, "amplitude", container="result")
    name = moving(result)
    along = "point" if "point" in result.dims else name
    if along not in result["amplitude"].dims:
        raise ValueError(f"result: expected curves over {name}, got one point of each")
    if "solution" in result.dims:
        if result.sizes["solution"] > 1:
            raise ValueError(
                f"result: expected one response at each {name}, it has several; select one of "
                "them, for example by .isel(solution=0)"
            )
        result = result.isel(solution=0)
    inner = along, "dof", "harmonic", "component"
    dims = [str(dim) for dim in result["amplitude"].dims if dim not in inner]
    like = xr.DataArray(np.empty([result.sizes[dim] for dim in dims]), dims=dims)

    def table(of: str, axis: str) -> FloatArray:
        """A variable curve by curve, the largest of all degrees of freedom."""
        values = result[of].max("dof", skipna=False) if "dof" in result[of].dims else result[of]
        values = values.broadcast_like(like).transpose(*dims, axis).values
        return values.reshape(-1, values.shape[-1]).astype(float)

    value, size = table(name, along), table("amplitude", along)
    value[~np.isfinite(size)] = np.nan
    low, high = np.fmin.reduce(value, axis=1), np.fmax.reduce(value, axis=1)
    peak, words = np.full(len(value), -1), np.full(len(value), "", dtype=object)
    if isinstance(at, str):
        check.one_of("at", at, ("peak", "largest"))
    elif not isinstance(at, float) and at is not None:
        check.integer("at", at, 0)
    if not isinstance(at, float) and at != "largest":
        needed = {f"peak_{name}", "peak_amplitude", *["peak_coefficient"] * (at is None)}
        if needed <= {*result.variables} and result.sizes.get("peak"):
            peak, words = _peaks(table("peak_amplitude", "peak"), at)
    target = np.full(len(value), np.nan if not isinstance(at, float) else at)
    if (peak >= 0).any():
        check_present(result, "peak_coefficient", container="result")
        target = np.where(peak >= 0, table(f"peak_{name}", "peak")[range(len(peak)), peak], target)
    if isinstance(at, float):
        words[(low <= at) & (at <= high)] = "nearest point"
    elif at in (None, "largest"):
        words[(peak < 0) & np.isfinite(size).any(axis=1)] = "largest point"
    chosen = words != ""
    if not chosen.any():
        ends = f"{np.fmin.reduce(low):g} to {np.fmax.reduce(high):g}"
        raise ValueError(
            f"at={at!r}: no curve has it; expected 'peak', 'largest', the number of a peak from "
            f"0, or with a decimal point a value from {ends} of {name.replace('_', ' ')}"
        )
    by_size = np.isnan(target)[:, None]
    distance = np.where(by_size, -size, np.abs(value - target[:, None]))
    point = np.where(np.isnan(distance), np.inf, distance).argmin(axis=1)
    found = value[range(len(point)), point]
    between = (peak >= 0) & ~(np.abs(found - target) <= _SAME * np.abs(target))

    def each(values: np.ndarray) -> xr.DataArray:
        return like.copy(data=values.reshape(like.shape))

    of_points = [str(n) for n, of in result.variables.items() if along in of.dims]
    others = [n for n, of in result.variables.items() if {"event", "peak", "branch"} & {*of.dims}]
    one = result.drop_vars(others).isel({along: each(point)}).reset_coords(name)
    if between.any():  # of a grid
        one = one.drop_vars({*of_points} - {name, "coefficient", "amplitude"})
        one[name] = each(np.where(between, target, found)).assign_attrs(result[name].attrs)
        motions = result["peak_coefficient"].isel(peak=each(np.maximum(peak, 0)))
        for own, of in (("coefficient", motions), ("amplitude", amplitude_of(motions))):
            if own in one:
                one[own] = one[own].where(each(~between), of).transpose(*one[own].dims)
    for own in {*of_points} & {*one.variables}:
        one[own] = one[own].where(each(chosen), blank(one[own].dtype, ()).item())
    return one.set_coords(name).assign_coords({CHOSEN: each(words)})


def _peaks(amplitude: FloatArray, at: Any) -> tuple[np.ndarray, np.ndarray]:
    """Number of a peak of each curve, -1 where it has none, and what it is called."""
    bounded = np.isfinite(amplitude)
    if at in (None, "peak"):
        number = np.where(bounded, amplitude, -np.inf).argmax(axis=1)
        words = np.where(bounded.sum(axis=1) > 1, "highest peak", "peak").astype(object)
    else:
        number = np.full(len(bounded), min(at, bounded.shape[1] - 1))
        words = np.full(len(bounded), f"peak {at}", dtype=object)
        bounded[:, number[0]] &= number[0] == at
    there = bounded[range(len(number)), number]
    return np.where(there, number, -1), np.where(there, words, "")
