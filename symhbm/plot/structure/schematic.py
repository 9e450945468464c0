"""Schematic drawings of models: masses, springs, dampers, contacts and the force on them."""

import textwrap
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple, Unpack

import numpy as np

from symhbm.model import (
    EngineOrder,
    Excitation,
    ForceSum,
    HarmonicForce,
    PointForce,
    StaticLoad,
    Structure,
    force_coefficients,
)
from symhbm.model.contacts import Weights
from symhbm.numerics import FloatArray, FourierBasis, check, check_harmonics
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.plot.structure.masses import (
    WORDS,
    draw_dots,
    draw_forces,
    draw_hub,
    draw_symbols,
    number,
)
from symhbm.plot.structure.mesh import mesh_picture
from symhbm.plot.structure.network import (
    Network,
    joined,
    kinds_of_contacts,
    layout_of,
    network,
    places_of_contacts,
)

MOST_MASSES = 16
"""Largest number of masses that are drawn with symbols."""
MOST_BESIDE = 4
"""Largest number of contacts on one pair, or between one mass and the ground, with symbols."""
_WRAP = 66


class _Force(NamedTuple):
    """Size on each degree of freedom (n_dof,) [N], its text, and how many excited are not kept."""

    size: FloatArray
    text: str
    inside: int


@pictured
def model(
    structure: Any, *, force: Any = None, sets: Sequence[str] | None = None, **common: Unpack[Look]
) -> Picture:
    """Draw a structure: masses, the elements between them and to the ground, contacts.

    One of a finite-element program, whose places have a mesh, is drawn as the outside of its
    elements, with sets of nodes, supports, contacts, the axes, and the axis of rotation; a force is
    told in words below.

    Up to 16 masses have symbols: zigzags are springs, pistons viscous dampers, a spring with two
    plates that are pressed together a friction damper, a spring with an arrow through it a cubic
    spring, and a broken line a contact that does nothing. Of each kind the first is named; values
    that differ stand beside each, others below. Larger structures are dots and lines, as far from
    each other as there are links between them.

    A stiffness or damping matrix is drawn where it is a sum of springs or dampers: symmetric, with
    no positive entry off its diagonal and no negative sum of a row. What a matrix has beyond that,
    and coupling by inertia, is not drawn, and named below.

    Parameters
    ----------
    structure
        A `symhbm.Model` of any kind, or a `symhbm.HarmonicBalance`, whose force is drawn as well.
    force
        An excitation, or a `symhbm.HarmonicBalance` that has one, to be drawn as arrows; their
        lengths tell how large it is on each degree of freedom.
    sets
        Names of sets of nodes of a mesh to be coloured; by default the sides of a sector.
    common
        As of all pictures.

    Raises
    ------
    TypeError, ValueError
        For what is no model and no excitation, for a force that does not fit the model, and for
        sets of a structure without a mesh; KeyError for unknown ones.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     13, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> sh.plot.model(disk, force=sh.forces.EngineOrder(3)).savefig("disk.png")
    """
    drawn, load = _model_and_force(structure, force)
    if getattr(drawn.places, "mesh", None) is not None:
        return mesh_picture(drawn, sets, textwrap.fill(load.text, _WRAP) if load else "")
    if sets is not None:
        raise ValueError(f"sets={check.shown(sets)}: expected a structure whose places have a mesh")
    parts = network(drawn)
    pairs = joined(drawn, parts)
    kinds = kinds_of_contacts(drawn)
    detailed = _is_small(drawn, len(pairs))
    layout = layout_of(drawn, parts, pairs, detailed)
    lines = [*_linear_values(parts), *_contact_values(drawn, kinds)]
    notes = [f"Not drawn: {item}." for item in _not_drawn(drawn, parts, load)]
    notes = [*([] if load is None else [load.text]), *notes]
    lines += [textwrap.fill(line, _WRAP) for line in notes]
    head = repr(drawn).partition("\n")[0].partition(": ")[2]
    # Axes that keep their place: a layout then knows the room that all lines below need.
    panel = Panel(
        even="datalim", title=head if parts.linear else f"condensed: {head}", framed=False
    )
    panel.x = Axis("\n".join(lines), ticks=((), None), grid=False, size=8.5)
    panel.y = Axis(ticks=((), None), grid=False)
    if not parts.linear:
        draw_hub(panel, layout, "linear\nstructure")
    elif layout.hub and detailed and (parts.springs.ground.any() or parts.dampers.ground.any()):
        draw_hub(panel, layout, "disk" if drawn.lumped else "ground")
    draw = draw_symbols if detailed else draw_dots
    draw(panel, drawn, parts, kinds, layout)
    if load is not None:
        draw_forces(panel, layout, load.size, detailed)
    return Picture([panel], _size(layout.positions, detailed), alone=True)


def _is_small(model: Structure, n_pairs: int) -> bool:
    """Whether symbols have the room that they need."""
    beside = Counter(tuple(sorted(dofs[:2])) for dofs in places_of_contacts(model))
    allowed = MOST_BESIDE if model.n_dof > 1 else 3 * MOST_BESIDE
    crowded = max(beside.values(), default=0) > allowed
    return model.n_dof <= MOST_MASSES and n_pairs <= 2 * model.n_dof and not crowded


def _model_and_force(structure: Any, force: Any) -> tuple[Structure, _Force | None]:
    """The model, and the force on it."""
    model = structure if isinstance(structure, Structure) else getattr(structure, "model", None)
    if not isinstance(model, Structure):
        raise TypeError(
            f"structure={check.shown(structure)}: expected a Model, or a HarmonicBalance, "
            "which rebuild makes of a dataset"
        )
    name, holder = ("structure", structure) if force is None else ("force", force)
    excitation = getattr(holder, "excitation", None if force is None else force)
    if excitation is None:
        return model, None
    if not isinstance(excitation, Excitation):
        raise TypeError(
            f"{name}={check.shown(holder)}: expected an excitation or a HarmonicBalance"
        )
    placed = excitation.placed(model.number_of)
    return model, _force(model, placed, getattr(holder, "basis", None))


def _force(model: Structure, excitation: Excitation, basis: FourierBasis | None) -> _Force:
    parts = excitation.scaled if isinstance(excitation, ForceSum) else (excitation,)
    if basis is None:
        tables = [getattr(part, name, {}) for part in parts for name in ("cosine", "sine")]
        harmonics = {harmonic for table in tables for harmonic in table}
        harmonics |= {0, 1, *(getattr(part, "harmonic", 1) for part in parts)}
        basis = FourierBasis(check_harmonics(harmonics))
    each = [_coefficients(model, part, basis) for part in parts]
    size = np.linalg.norm(np.sum(each, axis=0), axis=1)
    texts = [_text(*pair) for pair in zip(parts, each, strict=True)]
    inside = 0
    if model.kept is not None:
        watched = model.kept[model.kept < model.n_whole]
        inside = int(np.count_nonzero(np.delete(size, watched)))
        size = np.concatenate([size[watched], np.zeros(model.n_dof - len(watched))])
    return _Force(size, "; ".join(texts), inside)


def _coefficients(model: Structure, part: Excitation, basis: FourierBasis) -> FloatArray:
    """Coefficients (n_whole, n_components) [N]; relative sizes of what the frequency changes."""
    if not part.changes:
        return force_coefficients(part, model.n_whole, basis)
    shapes = model.force_shapes(part, basis).values()
    return np.sum([shape / (np.abs(shape).max() or 1.0) for shape in shapes], axis=0)


def _text(part: Excitation, coefficients: FloatArray) -> str:
    """What a force is, from its coefficients (n_dof, n_components) [N]."""
    size = np.linalg.norm(coefficients, axis=1)
    count = np.count_nonzero(size)
    amplitude = f"$f_0$ = {number(part.amplitude)} {part.units}"
    if part.changes:
        where = f"{_counted(count, 'degree')} of freedom"
        return f"{part.meaning}, {amplitude}: a force on {where} that changes with the frequency"
    if isinstance(part, PointForce):
        turn = "" if part.harmonic == 1 else f"{part.harmonic} "
        phase = f" + {number(part.phase)} rad" if part.phase else ""
        return rf"force $f_0$ cos({turn}$\omega t${phase}) on {part.place}, {amplitude}"
    if isinstance(part, EngineOrder):
        where = _counted(count, "blade")
        if part.pattern is not None:
            where = f"{_counted(count, 'degree')} of freedom"
        return f"force of engine order {part.order} on {where}, {amplitude}"
    up_to = f"up to {number(size.max())} N"
    if isinstance(part, StaticLoad):
        return f"static load on {_counted(count, 'degree')} of freedom, {up_to}"
    text = f"force on {_counted(count, 'degree')} of freedom"
    if isinstance(part, HarmonicForce):
        mean = {0} if part.mean is not None else set()
        numbers = sorted({*part.cosine, *part.sine} | mean)
        summed = " (root of the sum of squares)" if len(numbers) > 1 else ""
        plural = "harmonics" if len(numbers) > 1 else "harmonic"
        text += f", {plural} {', '.join(map(str, numbers))}, {up_to}{summed}"
    return text


def _size(places: FloatArray, detailed: bool) -> tuple[float, float]:
    """Width and height of a figure [inch]."""
    width, height = np.ptp(places, axis=0)
    if not detailed:
        return 8.6, float(np.clip(2.6 + 5.0 * height / (width or 1.0), 3.6, 7.0))
    if height == 0:
        return max(1.3 * len(places) + 1.4, 5.6), 3.4 if len(places) == 1 else 4.1
    return 6.6, 7.2


def _linear_values(parts: Network) -> list[str]:
    if not parts.linear:
        return []
    massless = int((parts.mass == 0).sum())
    without = f", {_counted(massless, 'degree')} of freedom without it (dashed)"
    lines = [f"mass $m$ = {_span(parts.mass)} kg{without if massless else ''}"]
    for letter, unit, name, links in (
        ("k", "N/m", "spring", parts.springs),
        ("c", "N s/m", "damper", parts.dampers),
    ):
        grounded = links.ground[links.ground > 0]
        values = links.ground[:0] if links.reason else links.values
        for numbers, where in ((grounded, "to the ground"), (values, "between")):
            if len(numbers):
                plural = name + "s" * (len(numbers) > 1)
                lines.append(f"{plural} {where} ${letter}$ = {_span(numbers)} {unit}")
    return lines


def _contact_values(model: Structure, kinds: list[list[str]]) -> list[str]:
    lines = []
    for group in model.groups:
        chosen = group.law.acts(values := group.values)
        if not chosen.any():
            continue
        texts = []
        for name in group.law.parameters:
            symbol, unit = group.law.parameters[name].shown_as(name)
            texts.append(f"{symbol} = {_span(values[name][chosen])} {unit}".strip())
        noun = WORDS.get(group.law.drawn_as, f"contact of {group.law!r}")
        lines.append(f"{_counted(np.count_nonzero(chosen), noun)}: {', '.join(texts)}")
    opened = sum("opened" in entry for entry in kinds)
    return [*lines, f"{_counted(opened, WORDS['opened'])}, without force"] if opened else lines


def _not_drawn(model: Structure, parts: Network, force: _Force | None) -> list[str]:
    """Properties of a model that the picture does not show."""
    notes = []
    if not model.has_matrices:
        notes.append(f"mass, damping and stiffness of all {model.n_whole} degrees of freedom")
    if parts.springs.reason:
        notes.append(
            f"springs; the stiffness matrix {parts.springs.reason} and is no network of them, "
            "grey lines are what it couples"
        )
    if parts.dampers.reason:
        notes.append(f"viscous dampers; the damping matrix {parts.dampers.reason}")
    if parts.inertial_pairs:
        notes.append(f"coupling of {_counted(parts.inertial_pairs, 'pair')} by inertia")
    several = sum(len(rows) > 1 for rows in model.groups.rows)
    if several:
        notes.append(f"further directions of {_counted(several, 'contact')}")
    weighted = sum(isinstance(ends, Weights) for ends in model.groups.row_ends)
    if weighted:
        notes.append(f"weights of {_counted(weighted, 'displacement')} of contacts")
    if force is not None and force.inside:
        notes.append(f"the force on {_counted(force.inside, 'degree')} of freedom not kept")
    return notes


def _counted(count: Any, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _span(values: FloatArray) -> str:
    low, high = float(values.min()), float(values.max())
    near = high - low <= 1e-9 * max(abs(low), abs(high))
    return number(low) if near else f"{number(low)} to {number(high)}"
