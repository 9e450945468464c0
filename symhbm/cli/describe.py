"""Text on an archive: its origin, its structure, its parameters and its results."""

import json
import textwrap
from typing import Any

import numpy as np
import xarray as xr

from symhbm.cli.designs import designs
from symhbm.cli.findings import Lines, count, findings, place, short
from symhbm.model import is_pattern
from symhbm.results import DRAWN, VARIABLES, Description, parts, variables_of_model
from symhbm.results.reading import is_inner, moving, printable, read

_WIDTH, _MARGIN = 100, 24
"""Width of a line, and of its label."""
_MOST_LISTED = 8
"""Most values that are listed one by one."""
_OF_FORCE = ("force_amplitude", "engine_order")
"""Parameters of the excitation, which has lines of its own."""
_DESCRIBED_ATTRIBUTES = {
    *("title", "references", "symhbm_schema", "symhbm_version", "casadi_version"),
    *("problem", "swept", "followed", "accuracy", "left_out", "verification"),
    *(parts.PART, parts.COMPUTED, parts.MERGED),
}


def describe(dataset: xr.Dataset) -> str:
    """Text on a dataset of this library: problem, request, completeness and results.

    Variables are read one at a time, block by block: a lazily opened archive may be larger than
    the memory.
    """
    lines = []
    for name, text in _lines(dataset):
        wrapped = textwrap.wrap(printable(text), _WIDTH - _MARGIN, break_on_hyphens=False) or [""]
        for label, line in zip([printable(name), *[""] * len(wrapped)], wrapped, strict=False):
            lines.append(f"{label:<{_MARGIN - 1}} {line}".rstrip())
    return "\n".join(lines)


def _lines(dataset: xr.Dataset) -> Lines:
    yield from _origin(dataset)
    if "problem" in dataset.attrs:
        yield from _problem(dataset)
    if "status" in dataset.variables:
        yield from findings(dataset)
    yield from designs(dataset)
    left_out = Description(dataset).left_out
    if left_out:
        yield "left out by keep=", ", ".join(left_out)
    yield from _others(dataset)


def _origin(dataset: xr.Dataset) -> Lines:
    attributes = dataset.attrs
    yield "title", str(attributes.get("title", "none"))
    made = {"symhbm": "symhbm_version", "CasADi": "casadi_version", "schema": "symhbm_schema"}
    words = [f"{maker} {attributes[key]}" for maker, key in made.items() if key in attributes]
    yield "made by", ", ".join(words)
    if "references" in attributes:
        yield "reference", str(attributes["references"])


def _problem(dataset: xr.Dataset) -> Lines:
    problem = Description(dataset).problem
    n_dof, contacts = problem["n_dof"], problem["contacts"]
    body = "blade" if problem["lumped"] else "degree of freedom"
    contacts = [_places(ends) for ends in contacts]
    sizes = [len(dofs) for dofs in contacts]
    kinds = {
        "between two of them": sizes.count(2),
        "between several of them": sum(size > 2 for size in sizes),
        "to the ground": sizes.count(1),
    }
    where = " and ".join(
        words if n == len(contacts) else f"{n} {words}" for words, n in kinds.items() if n
    )
    ring = [sorted((j, (j + 1) % n_dof)) for j in range(len(contacts))]
    if n_dof == len(contacts) > 2 and sorted(map(sorted, contacts)) == sorted(ring):
        where = "each between two neighbours in a ring"
    text = f"{count(n_dof, body)}, {count(len(contacts), 'contact')}"
    yield "structure", f"{text} {where}".rstrip()
    sectors = dataset.get("n_sectors")
    if sectors is not None and (sectors > 1).any():
        alike = int((sectors > 1).sum())
        which = "" if alike == sectors.size else f", in {alike} of {sectors.size} curves"
        solved = " or ".join(map(str, np.unique(sectors.values[sectors.values > 1])))
        yield "solved", f"one of {solved} sectors that move alike{which}"
    for name in Description(dataset).parameters:
        if name in dataset.variables and name not in _OF_FORCE:
            text = _parameter(dataset, name, body)
            if name != "cubic_stiffness" or text != "0 N m-3":
                yield f"  {name}", text
    forces = Description(dataset).forces
    yield "excitation", " and ".join(_force(dataset, force) for force in forces)
    for name in _OF_FORCE:
        if name in dataset.variables:
            yield f"  {name}", _parameter(dataset, name, body)
    listed = ", ".join(map(str, problem["harmonics"]))
    if "accuracy" in dataset.attrs:
        listed = (
            f"as many as each point takes for an accuracy of {dataset.attrs['accuracy']:g}; "
            f"those of all points are {listed}"
        )
    yield "harmonics", listed
    samples = problem.get("samples")
    if np.any(dataset.get("contact_stiffness", np.ones(1))):
        solver = json.loads(dataset.attrs.get("followed", "{}")).get("angles")
        law = "located switching angles, no sampling"
        if samples:
            law = f"marched over {samples} samples a period"
        elif solver:
            law = f"switching angles as unknowns, Eqs. (4)-(11), solved by {solver}"
        yield "friction law", law


def _force(dataset: xr.Dataset, force: dict[str, Any]) -> str:
    """Kind of a force, its harmonics unless that is the first alone, where it is largest."""
    kinds = {
        "PointForce": f"point force on {_place_of_force(dataset, force.get('dof', 0))}",
        "EngineOrder": "engine order, a travelling wave over the blades",
        "StaticLoad": "static load",
    }
    values = force.get("values", ())
    if force["type"] == "StaticLoad" and not any(
        [*values.values()] if isinstance(values, dict) else values
    ):
        return "none"
    on = [str(force["harmonic"])] if "harmonic" in force else []
    on = on or sorted({*force.get("cosine", {}), *force.get("sine", {})}, key=int)
    if force.get("mean") is not None:
        on = ["0", *on]
    harmonic = f", harmonic {', '.join(on)}" if on not in ([], ["1"]) else ""
    largest = _largest(dataset, force)
    return f"{kinds.get(force['type'], force['type'])}{harmonic}{largest}"


def _place_of_force(dataset: xr.Dataset, number: int) -> str:
    """A place that forces name, in the numbers of the whole structure."""
    if "structure_dof" not in dataset.coords:
        return place(dataset, number)
    kept = np.atleast_1d(dataset["structure_dof"].values).tolist()
    if number in kept:
        return place(dataset, kept.index(number))
    return f"degree of freedom {number} of the whole structure"


def _largest(dataset: xr.Dataset, force: dict[str, Any]) -> str:
    """The largest force of a pattern, and where it is: the amplitude scales all of them."""
    of_harmonic: dict[tuple[str, int], float] = {}
    for part in ("pattern", "cosine", "sine"):
        for harmonic, values in (force.get(part) or {}).items():
            entries = values.items() if isinstance(values, dict) else enumerate(values)
            for dof, value in entries:
                key, size = (harmonic, int(dof)), np.linalg.norm(np.atleast_1d(value))
                of_harmonic[key] = float(np.hypot(of_harmonic.get(key, 0.0), size))
    sizes: dict[int, float] = {}
    for (_, dof), size in of_harmonic.items():
        sizes[dof] = sizes.get(dof, 0.0) + size
    if not sizes or not force.get("amplitude"):
        return ""
    at = max(sizes, key=sizes.__getitem__)
    size = short(force["amplitude"] * sizes[at])
    return f", at most {size} N at {_place_of_force(dataset, at)}"


def _places(ends: Any) -> list[int]:
    """Degrees of freedom of a stored contact, in the first of several directions."""
    several = isinstance(ends, list) and not isinstance(ends[0], int)
    return [*map(int, ends[0] if several else ends)]


def _drawn(variable: xr.DataArray) -> str:
    """Distribution of the drawn values of a parameter."""
    draw = json.loads(variable.attrs.get(DRAWN, "{}"))
    if "seed" not in draw:
        return ""
    spreads = [key for key in draw if key.startswith(("relative", "coefficient"))]
    width = [f"{key} {draw[key]:g}" for key in spreads if isinstance(draw[key], float)]
    return f"; {', '.join([draw['distribution'], *width, 'seed ' + str(draw['seed'])])}"


def _parameter(dataset: xr.Dataset, name: str, body: str) -> str:
    """Values of a parameter with their unit and their pattern."""
    variable = dataset[name]
    units = Description(dataset).parameters[name].units
    unit = "" if units == "1" else f" {units}"
    values = variable.values
    finite = values[np.isfinite(values)]
    outer = [str(dim) for dim in variable.dims if not is_inner(dim) and not is_pattern(dim)]
    of = {"dof": f"{body}s", "blade": "blades"}
    owners = [of.get(str(dim), "contacts") for dim in variable.dims if is_pattern(dim)]
    if not finite.size:
        return "none"
    spread = f"{short(finite.min())} to {short(finite.max())}{unit}"
    differs = owners and np.any(values != values[..., :1])
    pattern = f", differing between {owners[0]}" if differs else ""
    nominal = ""
    if f"{name}_nominal" in dataset.variables:
        standard = np.unique(dataset[f"{name}_nominal"].values)
        standard = " to ".join(map(short, dict.fromkeys([standard.min(), standard.max()])))
        nominal = f", nominal value {standard}{unit}"
    if name == moving(dataset) and variable.ndim:
        index = Description(dataset).request["index"]
        entry = "" if index is None else f" at one place ({index})"
        return f"followed{entry}, {spread}{nominal}"
    if outer == [name]:
        if finite.size <= _MOST_LISTED:
            spread = f"{', '.join(map(short, finite))}{unit}"
        return f"swept, {count(finite.size, 'value')}: {spread}"
    if outer:
        drawn = _drawn(variable)
        return f"swept over {', '.join(outer)}: {spread}{pattern}{nominal}{drawn}"
    if differs:
        kind = "mistuned, " * (owners[0] != "contacts")
        return f"{kind}{spread}{pattern} (mean {short(finite.mean())})"
    return f"{short(finite.flat[0])}{unit}"


def _others(dataset: xr.Dataset) -> Lines:
    """Variables and attributes of the user; all variables where there is no status."""
    parameters = Description(dataset).parameters
    described = {*VARIABLES, *parameters, "harmonic", "component", "dof", "contact"}
    followed = [*parameters, moving(dataset)]
    described |= {f"{prefix}_{name}" for prefix in ("peak", "event") for name in followed}
    described |= {f"{name}_nominal" for name in parameters}
    described |= {*variables_of_model(dataset), *parts.variables_of_whole(dataset)}
    if "status" not in dataset.variables:
        described -= {str(name) for name in dataset.data_vars} - {*parameters}
        sizes = ", ".join(f"{size} {dim}" for dim, size in dataset.sizes.items())
        yield "dimensions", sizes or "none"
    for name, variable in dataset.variables.items():
        if name in described:
            continue
        attributes = variable.attrs
        unit = "" if attributes.get("units", "1") == "1" else f" {attributes['units']}"
        text = [f"{attributes['long_name']}"] if attributes.get("long_name", name) != name else []
        text += [f"along {', '.join(map(str, variable.dims))}"] if variable.dims else []
        yield f"{name}", ", ".join([*text, _spread(dataset, str(name)) + unit])
    for name, value in dataset.attrs.items():
        if name not in _DESCRIBED_ATTRIBUTES:
            yield str(name), textwrap.shorten(str(value), 2 * _WIDTH, placeholder=" ...")


def _spread(dataset: xr.Dataset, name: str) -> str:
    low, high, missing, size = np.inf, -np.inf, 0, 0
    if dataset[name].dtype.kind not in "iufb":
        values = list(dict.fromkeys(map(str, dataset[name].values.ravel().tolist())))
        more = ", ..." if len(values) > _MOST_LISTED else ""
        return ", ".join(values[:_MOST_LISTED]) + more
    for _, values in read(dataset, name):
        numbers = values[~np.isnan(values)]
        size, missing = size + values.size, missing + values.size - numbers.size
        if numbers.size:
            low, high = min(low, numbers.min()), max(high, numbers.max())
    if missing == size:
        return f"{size} values, none known" if size else "no values"
    text = f"{short(low)} to {short(high)}" if high > low else short(low)
    return f"{text} ({missing} of {size} are NaN)" if missing else text
