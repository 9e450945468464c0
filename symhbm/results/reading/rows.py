"""Tables of datasets: a row per point, peak, event or parameter set, as columns or of pandas."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from symhbm.numerics import check
from symhbm.results.description import Description
from symhbm.results.provenance import places_of
from symhbm.results.reading.selection import (
    INNER,
    At,
    blocks,
    curve_status,
    is_inner,
    moving,
    set_dimensions,
)
from symhbm.results.reading.selection import at as chosen_points
from symhbm.results.schema import check_dataset, check_present

KINDS = ("points", "peaks", "events", "sets")
"""What a row may be."""
EACH = ("dof", "contact")
"""What may have a row of its own within a point or a peak."""
_LETTERS = {"harmonic": "h", "component": ""}
_OF_PREFIX = {"peaks": "peak_", "events": "event_"}


class Column(NamedTuple):
    """A column: its name, the unit of its numbers and what they mean."""

    name: str
    units: str
    long_name: str

    @property
    def title(self) -> str:
        """The name and the unit."""
        return self.name if self.units in ("1", "") else f"{self.name} [{self.units}]"


class Rows(NamedTuple):
    """The columns of a table, and its values block by block, an array for each column."""

    columns: list[Column]
    blocks: Iterator[list[np.ndarray]]


def rows_of(
    dataset: xr.Dataset,
    kind: str = "points",
    variables: Sequence[str] | None = None,
    each: str | None = None,
    limited: Callable[[xr.Dataset], xr.Dataset] | None = None,
) -> Rows:
    """The table of a dataset, without its padding, read block by block.

    ``variables`` are the names of the columns beside the coordinates; by default all that the table
    has but the Fourier coefficients, and ``["all"]`` means these, too. With ``each``, one of
    `EACH`, a row is of one degree of freedom or contact. ``limited`` blanks what is not wanted of a
    part that was read.

    Raises
    ------
    KeyError
        For an unknown name.
    ValueError
        Where the dataset has no such table, or a variable does not fit it.
    """
    dataset = _with_places(dataset)
    stored = [str(name) for name in dataset.variables]
    for name in variables or ():
        if name != "all":
            check_present(dataset, name, container="archive")
    along = _along(dataset, kind)
    if each is not None and each not in along:
        check.known(each, [dim for dim in EACH if dim in dataset.dims], "dimension of the rows")
        along = [*along, each]
    names = _variables(dataset, kind, along, variables, each)
    others = [str(n) for n, c in dataset.coords.items() if set(c.dims) <= set(along)]
    places = [*dict.fromkeys([*along, *others])]
    names = [*places, *(name for name in names if name not in places)]
    prefix = _OF_PREFIX.get(kind, "")
    marker = f"{prefix}{moving(dataset)}" if {"point", "peak", "event"} & set(along) else ""
    needed = {*names, marker, "n_solutions"} & set(stored)
    inner = {name: _inner(dataset, name, along) for name in names}
    columns = [column for name in names for column in _columns(dataset, name, inner[name])]
    return Rows(columns, _blocks(dataset[[*needed]], along, inner, marker, limited))


def _with_places(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with the places that peak, where these have names."""
    places = places_of(dataset)
    if places is None or "peak_dof" not in dataset.variables or "dof" not in dataset.dims:
        return dataset
    number = dataset["peak_dof"]
    names = np.array([*map(places.name, range(places.n_dof)), ""], dtype=object)
    known = np.where((number >= 0) & (number < places.n_dof), number, -1)
    about = {"long_name": "place that peaks", "units": "1"}
    return dataset.assign(peak_place=(number.dims, names[known], about))


def _blocks(
    whole: xr.Dataset,
    along: Sequence[str],
    inner: dict[str, tuple[str, ...]],
    marker: str,
    limited: Callable[[xr.Dataset], xr.Dataset] | None,
) -> Iterator[list[np.ndarray]]:
    width = sum(int(np.prod([whole.sizes[dim] for dim in dims])) for dims in inner.values())
    for block in blocks(whole.sizes, along, width):
        part = whole.isel(block, missing_dims="ignore")
        for dim in along:
            if dim not in part.variables and dim in part.dims:
                part[dim] = (dim, block[dim].start + np.arange(part.sizes[dim]))
        part = part.load() if limited is None else limited(part.load())
        shape = tuple(part.sizes.get(dim, 1) for dim in along)
        kept = np.ones(shape, dtype=bool)
        if marker in part.variables:
            kept &= np.isfinite(_spread(part, marker, along, shape, ())[..., 0])
        if "solution" in along and "n_solutions" in part.variables:
            # A value without any solution keeps one row, which tells so.
            most = np.maximum(_spread(part, "n_solutions", along, shape, ())[..., 0], 1)
            solution = np.arange(shape[along.index("solution")])
            places = [-1 if dim == "solution" else 1 for dim in along]
            kept &= solution.reshape(places) < most
        columns: list[np.ndarray] = []
        for name, dims in inner.items():
            columns += [*_spread(part, name, along, shape, dims)[kept].T]
        yield columns


def _spread(
    part: xr.Dataset, name: str, along: Sequence[str], shape: tuple[int, ...], inner: Sequence[str]
) -> np.ndarray:
    """Values of a variable over all dimensions of the rows, its inner entries along the last."""
    sizes = dict(zip(along, shape, strict=True)) | {dim: part.sizes[dim] for dim in inner}
    values = part[name].variable.set_dims(sizes).transpose(*sizes).values
    return values.reshape(*shape, math.prod(values.shape[len(shape) :]))


def _along(dataset: xr.Dataset, kind: str) -> list[str]:
    """The dimensions of the rows."""
    inner_axes = {"peaks": ["peak"], "events": ["event"], "sets": []}
    sets = set_dimensions(dataset)
    if kind in inner_axes:
        missing = [dim for dim in inner_axes[kind] if dim not in dataset.dims]
        if missing or curve_status(dataset) is None:
            names = Description(dataset).left_out
            left_out = any(name.startswith(f"{inner_axes[kind][0]}_") for name in names)
            why = ", they were left out by keep=" if left_out else ""
            raise ValueError(f"table of {kind}: the archive has no {kind}{why}")
        return [*sets, *inner_axes[kind]]
    if curve_status(dataset) is not None:
        axes = dict.fromkeys(("point", moving(dataset), "angle", "solution"))
        return [*sets, *(axis for axis in axes if axis in dataset.dims and axis not in sets)]
    data = [dataset[name].dims for name in dataset.data_vars]
    outer = [[str(dim) for dim in dims if not is_inner(dim)] for dims in data]
    return max(outer, key=len, default=[])


def _variables(
    dataset: xr.Dataset,
    kind: str,
    along: Sequence[str],
    wanted: Sequence[str] | None,
    each: str | None,
) -> list[str]:
    named = [name for name in wanted or () if name != "all"]
    for name in named:
        if not all(dim in along or is_inner(dim) for dim in dataset[name].dims):
            raise ValueError(
                f"variable {name!r}: it has the dimensions {_listed(dataset[name].dims)}, a row "
                f"of the table of {kind} is one of {_listed(along)}"
            )
    if wanted is not None and "all" not in wanted:
        return named
    swept, records = Description(dataset).swept, Description(dataset).parameters
    parameters = {*records, *(f"{name}_nominal" for name in records)}
    beside = {*EACH} - {each} if each else set()
    chosen = []
    for name in map(str, dataset.data_vars):
        dims = {str(dim) for dim in dataset[name].dims}
        outer = {dim for dim in dims if not is_inner(dim)}
        of_set = kind == "sets" and name in swept and outer <= set(along)
        belongs = outer == {*along} - {each} and (name not in parameters or name in swept)
        wide = wanted is not None or "harmonic" not in dims
        if (belongs or of_set) and wide and not dims & beside:
            chosen.append(name)
    return chosen


def _inner(dataset: xr.Dataset, name: str, along: Sequence[str]) -> tuple[str, ...]:
    dims = dataset[name].dims if name in dataset.variables else ()
    rows = [str(dim) for dim in dims if dim not in INNER and is_inner(dim)]
    return tuple(dim for dim in (*rows, *INNER) if dim in dims and dim not in along)


def _columns(dataset: xr.Dataset, name: str, inner: Sequence[str]) -> list[Column]:
    """The columns of a variable, as ``amplitude_tip:z`` [m], or ``amplitude_3`` without places."""
    about = dataset[name].attrs if name in dataset.variables else {}
    titles, places = [name], places_of(dataset)
    for dim in inner:
        labels = dataset[dim].values if dim in dataset.variables else range(dataset.sizes[dim])
        named = dim == "dof" and places is not None
        labels = [*map(places.name, range(places.n_dof))] if named else labels  # type: ignore
        letter = "" if len(inner) == 1 or named else _LETTERS.get(dim, dim)
        titles = [f"{title}_{letter}{label}" for title in titles for label in labels]
    units, long_name = about.get("units", "1"), about.get("long_name", name.replace("_", " "))
    return [Column(title, units, long_name) for title in titles]


def _listed(dims: Any) -> str:
    return ", ".join(map(str, dims)) or "none"


def table(
    result: xr.Dataset,
    kind: str = "points",
    *,
    variables: Sequence[str] | None = None,
    each: str | None = None,
    at: At | None = None,
    columns: Sequence[str] | Mapping[str, str] | None = None,
    units: bool = False,
) -> pd.DataFrame:
    """A result as a table of pandas: one row per point, peak, event or parameter set.

    Parameters
    ----------
    result
        A result of this library: of one curve, a sweep or an ensemble. An archive that was opened
        by ``load(..., lazy=True)`` is read part by part, and only the variables of the columns.
    kind
        What a row is: one of the ``"points"`` of curves (of a motion, an angle), of their
        ``"peaks"``, of their ``"events"``, or of the parameter ``"sets"``, which tell ``status``
        and counts.
    variables
        Names of the variables to show beside those that place a row; by default all that belong to
        the rows but Fourier coefficients, and ``["all"]`` means these, too.
    each
        ``"dof"`` or ``"contact"`` for a row of each degree of freedom or contact, in a column
        ``dof`` or ``contact``; by default they are columns beside each other.
    at
        One point of each curve alone, as of `symhbm.datasets.at`: ``"peak"``, the number of a peak
        or a frequency [Hz].
    columns
        Names of the columns to show, in their order, or ``{name: title}``; by default all.
    units
        Titles of columns tell the unit, as in ``"peak_frequency [Hz]"``, for documents.

    Returns
    -------
    Table without padding: curves of a sweep have as many rows as they have points. Columns that
    place a row come first: the values of swept parameters or the number of the ``sample``, the
    number of the ``point``, ``peak`` or ``event``, and the parameter that moves, mostly
    ``frequency`` [Hz]. Then come the variables; ``amplitude_tip:z`` [m] is that of a place,
    ``amplitude_3`` [m] of degree of freedom 3 where places have no names, ``contact_state_0`` that
    of contact 0, ``coefficient_dof0_h1_cos`` [m] a Fourier coefficient.
    Of points these are ``amplitude`` [m], ``residual_norm`` [-], ``converged`` and more; of peaks
    ``peak_frequency`` [Hz], ``peak_amplitude`` [m], ``peak_dof``, ``peak_kind``; of events
    ``event_frequency`` [Hz], ``event_kind``, ``event_contact``; of sets ``status``, ``n_points``,
    ``n_peaks``. ``attrs["units"]`` has the unit of each column and ``attrs["long_name"]`` what it
    means; the glossary of the documentation has all variables.

    Raises
    ------
    TypeError
        For what is no dataset.
    KeyError
        For unknown names of variables, or of ``each``.
    ValueError
        For an unknown kind, a table that the result does not have, and variables that misfit.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> sweep = sh.frf(problem, (10, 30), over={"normal_load": [1, 3]})
    >>> peaks = sh.datasets.table(sweep, "peaks")
    >>> peaks[["normal_load", "peak_frequency", "peak_kind"]].round(3).values.tolist()
    [[1.0, 15.923, 'smooth'], [3.0, 19.374, 'smooth']]
    >>> short = {"normal_load": "load", "frequency": "resonance", "dissipation_0": "loss"}
    >>> [*sh.datasets.table(sweep, at="peak", columns=short, units=True)]
    ['load [N]', 'resonance [Hz]', 'loss [J]']
    """
    check_dataset("result", result)
    kind = check.one_of("kind", kind, KINDS)
    if isinstance(variables, str):
        raise TypeError(f"variables={variables!r}: expected a sequence of names")
    if each is not None:
        check.one_of("each", each, EACH)
    check.flag("units", units)
    found, blocks = rows_of(
        result if at is None else chosen_points(result, at), kind, variables, each
    )
    parts, numbers = [*blocks], {column.name: k for k, column in enumerate(found)}
    if isinstance(columns, str):
        raise TypeError(f"columns={columns!r}: expected a sequence of names, or {{name: title}}")
    named = columns if isinstance(columns, Mapping) else {n: n for n in columns or numbers}
    series, shown = {}, []
    for name, title in named.items():
        check.known(name, numbers, "column of the table")
        column = found[numbers[name]]._replace(name=title)
        shown.append(column._replace(name=column.title) if units else column)
        pieces = [part[numbers[name]] for part in parts]
        series[shown[-1].name] = np.concatenate(pieces) if pieces else np.empty(0)
    frame = pd.DataFrame(series)
    frame.attrs["units"] = {column.name: column.units for column in shown}
    frame.attrs["long_name"] = {column.name: column.long_name for column in shown}
    return frame
