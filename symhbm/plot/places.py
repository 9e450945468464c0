"""The degrees of freedom that a picture shows, as they are asked for by ``place=``."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import xarray as xr

from symhbm.model import Place, number_of
from symhbm.numerics import check
from symhbm.results import Description, places_of

Shown = Place | Iterable[Place] | None
"""A number of a degree of freedom, a blade as ``"blade 3"``, a label or node as ``"tip"``, one of
its directions as ``"tip:y"``, or several of these, of which the largest response is shown."""
_MOST_LISTED = 6


class Chosen(NamedTuple):
    """Degrees of freedom along ``dof``, and what their response is called."""

    dofs: tuple[int, ...]
    words: str
    every: bool

    @property
    def alone(self) -> int | None:
        """The degree of freedom where it is one that was asked for."""
        return self.dofs[0] if len(self.dofs) == 1 and not self.every else None


def chosen(dataset: xr.Dataset, place: Any) -> Chosen:
    """The degrees of freedom that ``place`` asks for.

    Raises TypeError, ValueError or KeyError, which tell what is allowed.
    """
    output = _output(dataset)
    if place is None:
        n_dof, kept = dataset.sizes["dof"], dataset.variables.get("structure_dof")
        words = "largest response" + ("" if kept is None else f" of {kept.size} kept DOFs")
        words = words if output is None else f"{'largest ' * (n_dof > 1)}{output}"
        return Chosen(tuple(range(n_dof)), words, True)
    alone = isinstance(place, str) or not isinstance(place, Iterable)
    parts = [_one(dataset, one) for one in ([place] if alone else place)]
    if not parts:
        raise ValueError(f"place={check.shown(place)}: expected {_allowed(dataset)}")
    dofs = tuple(dict.fromkeys(dof for part, _ in parts for dof in part))
    names = [name for _, name in parts]
    listed = ", ".join(names) if len(names) <= _MOST_LISTED else f"{len(names)} places"
    which = "" if output is not None else "response of "
    return Chosen(dofs, f"{'largest ' * (len(dofs) > 1)}{which}{listed}", False)


def blades_of(dataset: xr.Dataset) -> list[int] | None:
    """Degrees of freedom of the structure that are its blades, as the model or the force tells."""
    description = Description(dataset)
    size = description.condensed_from or description.problem.get("n_dof", 0)
    if description.lumped:
        return [*range(size)]
    waves = [force for force in description.forces if force.get("type") == "EngineOrder"]
    if not waves:
        return None
    return [*(range(size) if waves[0]["places"] is None else waves[0]["places"])]


def position_of(dataset: xr.Dataset) -> dict[int, int]:
    """Position along ``dof`` of the degrees of freedom of the structure, by their numbers."""
    label = "dof" if Description(dataset).condensed_from is None else "structure_dof"
    return {int(dof): i for i, dof in enumerate(dataset[label].values)}


def _one(dataset: xr.Dataset, place: Any) -> tuple[tuple[int, ...], str]:
    """Degrees of freedom of one place, and its name."""
    places, n_dof = places_of(dataset), dataset.sizes["dof"]
    output = _output(dataset)
    if output is not None:
        return (number := check.integer("place", place, 0, n_dof - 1),), f"{output} {number}"
    if not isinstance(place, str):
        number = _number(dataset, place, n_dof)
        if places is not None:
            return (number,), places.name(number)
        kept = dataset.variables.get("structure_dof")
        if kept is None:
            return (number,), f"DOF {number}"
        return (number,), f"DOF {int(kept.values[number])} (kept DOF {number})"
    reason = ""
    try:
        if ":" in place:
            number = number_of(places, place, n_dof)
            return (number,), places.name(number) if places is not None else place
        if places is not None:
            nodes = places.nodes_of(int(place) if place.lstrip("+-").isdigit() else place)
            return tuple(int(dof) for node in nodes for dof in places.dofs_of(int(node))), place
    except (KeyError, TypeError) as error:
        reason = f"{error.args[0]}; "
    number = _blade(dataset, place)
    if number is None:
        raise KeyError(f"place={place!r}: {reason}expected {_allowed(dataset)}")
    return (number,), place


def _number(dataset: xr.Dataset, place: Any, n_dof: int) -> int:
    """A number along ``dof``; the error also tells other numbers that could be meant."""
    try:
        return check.integer("place", place, 0, n_dof - 1)
    except ValueError as error:
        places, kept, hint = places_of(dataset), dataset.variables.get("structure_dof"), ""
        if kept is not None:
            hint = f"; of the structure these are its degrees of freedom {check.brief(kept.values)}"
        elif places is not None and place in places.nodes:
            hint = f"; the node {place} is '{place}'"
        raise ValueError(f"{error}{hint}") from None


def _output(dataset: xr.Dataset) -> str | None:
    """What the values are in words where they are those of an output, else None."""
    name = Description(dataset).output
    return None if name is None else name.replace("_", " ")


def _blade(dataset: xr.Dataset, place: str) -> int | None:
    """The degree of freedom of ``"blade 3"``, None for another text or without this blade."""
    word, _, digits = place.partition(" ")
    blades = blades_of(dataset) or []
    if word != "blade" or not digits.isdigit() or int(digits) >= len(blades):
        return None
    return position_of(dataset).get(blades[int(digits)])


def _allowed(dataset: xr.Dataset) -> str:
    """What ``place`` may be with a dataset, in words."""
    parts = [f"a number from 0 to {dataset.sizes['dof'] - 1}"]
    blades, position, places = blades_of(dataset) or [], position_of(dataset), places_of(dataset)
    here = [i for i, dof in enumerate(blades) if dof in position]
    if here:
        parts.append(f"'blade {here[0]}' to 'blade {here[-1]}'")
    if places is not None:
        names = [*map(repr, places.labels)][:_MOST_LISTED] or [f"'{places.nodes[0]}'"]
        more = ", ..." if len(places.labels) > _MOST_LISTED else ""
        parts.append(f"a label or a node ({', '.join(names)}{more})")
        parts.append(f"one of its directions as {places.name(0)!r}")
    outputs = Description(dataset).outputs
    of_outputs = (
        f"; outputs ({', '.join(outputs)}) are drawn by symhbm.datasets.output(result, name)"
    )
    return ", ".join(parts) + ", or several of these" + (of_outputs if outputs else "")
