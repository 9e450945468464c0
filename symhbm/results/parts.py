"""Parts of a sweep, one for each job: their parameter sets, and the whole they belong to.

The dataset of a part has the parameter sets of the part alone, and beside them the values of all
sets under names that begin with ``whole_``: parts are merged, and what is missing is computed, from
nothing else.
"""

import json
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import xarray as xr

from symhbm.numerics import check
from symhbm.results.description import Description
from symhbm.results.provenance import DatasetParts, variable_of
from symhbm.results.sweep import Sweep
from symhbm.results.tables import Encoded

PART = "part"
"""Attribute of a part: which values of which swept dimension."""
COMPUTED = "computed"
"""Attribute of a part: when, where and by which versions."""
MERGED = "merged_from"
"""Attribute of what was merged: the parts, and who computed them."""
_WHOLE = "whole_"
_BLANK = "whole_blank"
"""Variable of a part: the curve of a set that is not computed, in bytes."""
_LATER = (PART, COMPUTED, "verification")
"""Attributes that the whole does not have."""

JobPart = tuple[int, int] | range | Mapping[str, range]
"""How a part is given: its number and how many there are, or positions along a dimension."""


@dataclass(frozen=True)
class Part:
    """Positions from ``first`` up to ``stop`` along one swept dimension of a ``size``."""

    dim: str
    first: int
    stop: int
    size: int

    @property
    def positions(self) -> slice:
        """The positions along the dimension."""
        return slice(self.first, self.stop)

    def numbers(self, whole: Sweep) -> np.ndarray:
        """Numbers of its parameter sets among those of the ``whole`` sweep, in their order."""
        numbers = np.arange(whole.size).reshape(whole.shape)
        chosen = (slice(None),) * whole.dims.index(self.dim) + (self.positions,)
        return numbers[chosen].ravel()


def check_part(part: JobPart | None, sweep: Sweep) -> Part | None:
    """The part of a sweep that is asked for, None for all of it.

    Raises TypeError and ValueError for anything else than ``(k, n)``, a range of positions along
    the longest dimension, or one by the name of its dimension.
    """
    if part is None:
        return None
    shown = check.shown(part)
    if not sweep.dims:
        raise ValueError(f"part={shown}: expected None where no parameter is swept")
    sizes = dict(zip(sweep.dims, sweep.shape, strict=True))
    dim = max(sizes, key=lambda name: sizes[name])
    chosen: Any = part
    if isinstance(part, Mapping):
        if len(part) != 1:
            raise ValueError(f"part={shown}: expected one dimension")
        [(dim, chosen)] = part.items()
        check.known(dim, sizes, "swept dimension")
    size = sizes[dim]
    if isinstance(chosen, range):
        if chosen.step != 1 or not 0 <= chosen.start < chosen.stop <= size:
            raise ValueError(
                f"part={shown}: expected a range of steps of 1 within the {size} values along "
                f"{dim!r}, range(0, {size})"
            )
        return Part(dim, chosen.start, chosen.stop, size)
    if isinstance(part, Mapping) or not isinstance(part, (tuple, list)) or len(part) != 2:
        raise TypeError(
            f"part={shown}: expected (k, n), the k-th of n parts, a range as range(0, 1000), or "
            "{dimension: range}"
        )
    count = check.integer("n of part", part[1], 1, size)
    number = check.integer("k of part", part[0], 1, count)
    return Part(dim, (number - 1) * size // count, number * size // count, size)


def restricted(sweep: Sweep, part: Part) -> Sweep:
    """The parameter sets of a part."""
    return Sweep.of(
        {
            name: value.isel({part.dim: part.positions}) if part.dim in value.dims else value
            for name, value in sweep.values.items()
        }
    )


def call_of_part(
    own: DatasetParts, whole: DatasetParts, part: Part, blank: Encoded
) -> DatasetParts:
    """The description of a part with all that makes that of the ``whole`` again.

    Raises ValueError where a name of the user's begins as those of the whole do.
    """
    layout, data = blank
    compressed = np.frombuffer(zlib.compress(data), np.uint8)
    about = {"long_name": "curve of a parameter set that is not computed", "layout": layout}
    variables = own.variables | {_BLANK: ((f"{_BLANK}_byte",), compressed, about)}
    coordinates = dict(own.coordinates)
    for target, source in ((variables, whole.variables), (coordinates, whole.coordinates)):
        for name, entry in source.items():
            value = variable_of(entry)
            if part.dim in value.dims:
                if f"{_WHOLE}{name}" in whole.variables | whole.coordinates:
                    raise ValueError(
                        f"over: expected a name other than '{_WHOLE}{name}', parts of a sweep "
                        "have it"
                    )
                dims = [f"{_WHOLE}{dim}" if dim == part.dim else dim for dim in value.dims]
                target[f"{_WHOLE}{name}"] = xr.Variable(dims, value.values, value.attrs)
    attributes = own.attributes | {PART: json.dumps(asdict(part))}
    return DatasetParts(variables, coordinates, attributes, own.sizes)


def ranges(numbers: Any, most: int | None = None) -> str:
    """Numbers in ascending order in short: 0 to 3, 7; at the most so many ranges."""
    numbers = np.asarray(numbers)
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) != 1) + 1) if numbers.size else []
    texts = [str(r[0]) if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs[:most]]
    more = len(runs) - len(texts)
    return ", ".join([*texts, f"and {more} more"] if more else texts)


def part_of(dataset: xr.Dataset) -> Part | None:
    """The part that a dataset is, None for one of a whole sweep."""
    return Part(**json.loads(dataset.attrs[PART])) if PART in dataset.attrs else None


def n_merged(dataset: xr.Dataset) -> int:
    """Number of parts that a dataset was merged from, 0 for one that was not."""
    return sum(
        entry["archive"] is not None for entry in json.loads(dataset.attrs.get(MERGED, "[]"))
    )


def variables_of_whole(dataset: xr.Dataset) -> list[str]:
    """Names of the variables of a part that tell of the whole."""
    part = part_of(dataset)
    if part is None:
        return []
    of_sets = [n for n, value in dataset.variables.items() if _WHOLE + part.dim in value.dims]
    return [_BLANK, *map(str, of_sets)]


def whole_call(dataset: xr.Dataset) -> xr.Dataset:
    """The description of the whole sweep that the dataset of a part belongs to, without results.

    Raises ValueError where the part does not hold what it says.
    """
    part = part_of(dataset)
    assert part is not None
    parts, request = DatasetParts.of(dataset), Description(dataset).request
    of_whole = _WHOLE + part.dim

    def entries(of_part: dict[str, Any]) -> dict[str, Any]:
        """Each where it was: in the place of the values of the part those of the whole."""
        result = {}
        for name, value in of_part.items():
            if name == _BLANK or of_whole in value.dims:
                continue
            if part.dim in value.dims:
                # Every result runs along the dimensions of the sweep, and has no such values.
                if _WHOLE + name not in of_part:
                    continue
                value = of_part[_WHOLE + name]
            dims = [part.dim if dim == of_whole else dim for dim in value.dims]
            result[name] = xr.Variable(dims, value.values, value.attrs)
        return result

    attributes = {name: value for name, value in parts.attributes.items() if name not in _LATER}
    harmonics = tuple(request["harmonics"])
    problem = json.loads(attributes["problem"]) | {"harmonics": list(harmonics)}
    attributes["problem"] = json.dumps(problem)
    assert parts.sizes is not None
    sizes = *parts.sizes[:2], harmonics
    whole = DatasetParts(entries(parts.variables), entries(parts.coordinates), attributes, sizes)
    result = whole.dataset()
    for name, value in result.variables.items():
        if part.dim in value.dims:
            own = value.isel({part.dim: part.positions})
            if not own.equals(dataset.variables[name].load()):
                raise ValueError(f"its {name} is not that of the whole sweep")
    return result


def blank_of(dataset: xr.Dataset) -> Encoded:
    """The curve of a set of a part that is not computed."""
    stored = dataset[_BLANK]
    return str(stored.attrs["layout"]), zlib.decompress(stored.values.tobytes())
