"""Text on the problem behind a dataset: structure, parameters, force, harmonics, laws."""

import json
from typing import Any

import numpy as np
import xarray as xr

from symhbm.model import is_pattern
from symhbm.model.contacts import weights_of
from symhbm.results.provenance import DRAWN
from symhbm.results.reading import is_inner
from symhbm.results.telling.words import Rows, Words, count

MOST_LISTED = 8
"""Most values that are listed one by one."""
_OF_FORCE = ("force_amplitude", "engine_order")
"""Parameters of the excitation, which has lines of its own."""


def problem(words: Words) -> Rows:
    """Labels and texts on the problem."""
    dataset, about = words.dataset, words.description.problem
    if not about:
        return
    body = "blade" if about["lumped"] else "degree of freedom"
    contacts = words.description.contacts
    text = f"{count(about['n_dof'], body)}, {count(len(contacts), 'contact')}"
    yield "structure", f"{text} {_where(about['n_dof'], contacts)}".rstrip()
    sectors = dataset.get("n_sectors")
    if sectors is not None and (sectors > 1).any():
        alike = int((sectors > 1).sum())
        which = "" if alike == sectors.size else f", in {alike} of {sectors.size} curves"
        solved = " or ".join(map(str, np.unique(sectors.values[sectors.values > 1])))
        yield "solved", f"one of {solved} sectors that move alike{which}"
    groups = words.description.groups
    if groups:
        yield "contact laws", "; ".join(f"{name}: {of['law']['of']}" for name, of in groups.items())
    for name in words.description.parameters:
        if name in dataset.variables and name not in _OF_FORCE:
            text = _parameter(words, name, body)
            if name != "cubic_stiffness" or text != "0 N m-3":
                yield f"  {name}", text
    forces = words.description.forces
    yield "excitation", " and ".join(_force(words, force) for force in forces)
    for name in _OF_FORCE:
        if name in dataset.variables:
            yield f"  {name}", _parameter(words, name, body)
    listed = ", ".join(map(str, about["harmonics"]))
    if "accuracy" in dataset.attrs:
        listed = (
            f"as many as each point takes for an accuracy of {dataset.attrs['accuracy']:g}; "
            f"those of all points are {listed}"
        )
    yield "harmonics", listed
    samples, solver = about.get("samples"), words.description.angles
    if np.any(dataset.get("contact_stiffness", np.ones(1))):
        law = "located switching angles, no sampling"
        if samples:
            law = f"marched over {samples} samples a period"
        elif solver:
            law = f"switching angles as unknowns, Eqs. (4)-(11), solved by {solver}"
        yield "friction law", law


def _where(n_dof: int, ends: tuple[Any, ...]) -> str:
    """Where the contacts of a problem are."""
    contacts = [_dofs_of(each) for each in ends]
    ring = [sorted((j, (j + 1) % n_dof)) for j in range(len(contacts))]
    if n_dof == len(contacts) > 2 and sorted(map(sorted, contacts)) == sorted(ring):
        return "each between two neighbours in a ring"
    sizes = [len(dofs) for dofs in contacts]
    kinds = {
        "between two of them": sizes.count(2),
        "between several of them": sum(size > 2 for size in sizes),
        "to the ground": sizes.count(1),
    }
    every = [text if n == len(contacts) else f"{n} {text}" for text, n in kinds.items() if n]
    return " and ".join(every)


def _dofs_of(ends: Any) -> tuple[int, ...]:
    """Degrees of freedom of a contact, in the first of several directions."""
    several = isinstance(ends, tuple) and not isinstance(ends[0], int)
    return weights_of(ends[0] if several else ends)[0]


def _force(words: Words, force: dict[str, Any]) -> str:
    """Kind of a force, its harmonics unless that is the first alone, where it is largest."""
    kinds = {
        "PointForce": f"point force on {_place_of_force(words, force.get('place', 0))}",
        "EngineOrder": "engine order, a travelling wave over the blades",
        "StaticLoad": "static load",
    }
    values = force.get("values", ())
    if force["type"] == "StaticLoad" and not any(
        [*values.values()] if isinstance(values, dict) else values
    ):
        return "none"
    on = [force["harmonic"]] if "harmonic" in force else []
    on = on or sorted({*force.get("cosine", {}), *force.get("sine", {})})
    if force.get("mean") is not None:
        on = [0, *on]
    harmonic = f", harmonic {', '.join(map(str, on))}" if on not in ([], [1]) else ""
    return f"{kinds.get(force['type'], force['type'])}{harmonic}{_largest(words, force)}"


def _place_of_force(words: Words, number: int) -> str:
    """A place that forces name, in the numbers of the whole structure."""
    if "structure_dof" not in words.dataset.coords:
        return words.place(number)
    kept = np.atleast_1d(words.dataset["structure_dof"].values).tolist()
    if number in kept:
        return words.place(kept.index(number))
    return f"degree of freedom {number} of the whole structure"


def _largest(words: Words, force: dict[str, Any]) -> str:
    """The largest force of a pattern, and where it is: the amplitude scales all of them."""
    of_harmonic: dict[tuple[int, int], float] = {}
    for part in ("pattern", "cosine", "sine"):
        for harmonic, values in (force.get(part) or {}).items():
            entries = values.items() if isinstance(values, dict) else enumerate(values)
            for dof, value in entries:
                key, size = (harmonic, dof), abs(value)
                of_harmonic[key] = float(np.hypot(of_harmonic.get(key, 0.0), size))
    sizes: dict[int, float] = {}
    for (_, dof), size in of_harmonic.items():
        sizes[dof] = sizes.get(dof, 0.0) + size
    if not sizes or not force.get("amplitude"):
        return ""
    at = max(sizes, key=sizes.__getitem__)
    size = words.short(force["amplitude"] * sizes[at])
    return f", at most {size} N at {_place_of_force(words, at)}"


def _parameter(words: Words, name: str, body: str) -> str:
    """Values of a parameter with their unit and their pattern."""
    dataset, short = words.dataset, words.short
    variable = dataset[name]
    values = variable.values
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "none"
    units = words.description.parameters[name].units
    unit = "" if units == "1" else f" {units}"
    outer = [str(dim) for dim in variable.dims if not is_inner(dim) and not is_pattern(dim)]
    of = {"dof": f"{body}s", "blade": "blades"}
    owners = [of.get(str(dim), "contacts") for dim in variable.dims if is_pattern(dim)]
    spread = f"{short(finite.min())} to {short(finite.max())}{unit}"
    differs = owners and np.any(values != values[..., :1])
    pattern = f", differing between {owners[0]}" if differs else ""
    nominal = ""
    if f"{name}_nominal" in dataset.variables:
        nominal = f", nominal value {words.span(dataset[f'{name}_nominal'].values)}{unit}"
    if name == words.along and variable.ndim:
        index = words.description.index
        entry = "" if index is None else f" at one place ({index})"
        return f"followed{entry}, {spread}{nominal}"
    if outer == [name]:
        if finite.size <= MOST_LISTED:
            spread = f"{', '.join(map(short, finite))}{unit}"
        return f"swept, {count(finite.size, 'value')}: {spread}"
    if outer:
        return f"swept over {', '.join(outer)}: {spread}{pattern}{nominal}{_drawn(variable)}"
    if differs:
        kind = "mistuned, " * (owners[0] != "contacts")
        return f"{kind}{spread}{pattern} (mean {short(finite.mean())})"
    return f"{short(finite.flat[0])}{unit}"


def _drawn(variable: xr.DataArray) -> str:
    """Distribution of the drawn values of a parameter."""
    draw = json.loads(variable.attrs.get(DRAWN, "{}"))
    if "seed" not in draw:
        return ""
    spreads = [key for key in draw if key.startswith(("relative", "coefficient"))]
    width = [f"{key} {draw[key]:g}" for key in spreads if isinstance(draw[key], float)]
    return f"; {', '.join([draw['distribution'], *width, 'seed ' + str(draw['seed'])])}"
