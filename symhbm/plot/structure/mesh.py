"""Drawings of meshes: the outside of elements, sets of nodes, sides of a sector and its axes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.model import Structure
from symhbm.model.mesh import Mesh, element
from symhbm.numerics import FloatArray, check
from symhbm.plot.picture import Axis, Panel, Picture

_VIEW = np.radians([-60.0, 25.0])
"""Where the picture is seen from: turned about z, and above the plane of x and y."""
_LIGHT = np.array([0.3, -0.5, 0.8])
_COLOURS = "#d55e00", "#0072b2", "#00795a", "#7b3294", "#b8860b", "#8c1c4a", "#4b6a88", "#5a5a00"
_USUAL = "left", "right"
_MOST_EDGES = 20_000
"""Faces from which on their edges are left out."""
_SHADE = 0.35
"""Darkest side of a face over its colour."""


def mesh_picture(model: Structure, sets: Sequence[str] | None, words: str) -> Picture:
    """The mesh of a structure whose places have one, above ``words``.

    Raises TypeError for ``sets`` that are no names, KeyError for unknown ones.
    """
    places = model.places
    mesh: Mesh = places.mesh
    named = [name for name in _USUAL if name in mesh.names] if sets is None else [*sets]
    for name in named:
        check.known(check.text("sets", name), mesh.names, "set of nodes")
    free = (model if model.beneath is None else model.beneath).places.nodes
    chosen = {name: mesh.names[name] for name in named}
    held = np.setdiff1d(np.concatenate([*map(np.ravel, mesh.elements.values())]), free)
    told = getattr(places.program, "held", None)
    held = held if told is None else np.union1d(held, np.asarray(told)[:, 0])
    view = _view()
    panel = Panel(even="datalim", title=_title(mesh, model), framed=False, legend_at="outside")
    panel.x, panel.y = (Axis(text, ticks=((), None), grid=False) for text in (words, ""))
    colours: dict[str, str] = {n: _COLOURS[i % len(_COLOURS)] for i, n in enumerate(chosen)}
    _draw_faces(panel, mesh, view, chosen, colours)
    for name, nodes in chosen.items():
        panel.entry(f"{name}, {len(nodes)} nodes", facecolor=colours[name])
        at = mesh.points(nodes) @ view.T
        look: Any = dict(marker=".", linestyle="", markersize=4, color=colours[name], zorder=3)
        panel.line(at[:, 0], at[:, 1], **look)
    marks = {"held": (mesh.points(held), "^", "0.2")}
    if model.n_contacts:
        marks["contacts"] = model.contact_coordinates, "o", "#e0007f"
    for kind, (points, mark, colour) in marks.items():
        if len(points):
            at = points @ view.T
            style: Any = dict(marker=mark, linestyle="", markersize=5, color=colour, zorder=4)
            panel.line(at[:, 0], at[:, 1], label=f"{kind}, {len(points)}", **style)
    _draw_axes(panel, mesh, view, getattr(places.program, "axis", None))
    return Picture([panel], (8.6, 6.0), alone=True)


def _title(mesh: Mesh, model: Structure) -> str:
    count = sum(len(block) for block in mesh.elements.values())
    return f"{len(mesh.node)} nodes, {count} elements, {model.n_whole} degrees of freedom"


def _view() -> FloatArray:
    """Unit vectors to the right, upwards and to the eye, (3, 3)."""
    turn, rise = _VIEW
    right = np.array([-np.sin(turn), np.cos(turn), 0])
    eye = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
    return np.stack([right, np.cross(eye, right), eye])


def _outline(kind: str) -> list[int]:
    """The nodes of a face one after the other, midside nodes between corners."""
    size = len(element(kind).points)
    if element(kind).order == 1:
        return [*range(size)]
    return [i + beside for i in range(size // 2) for beside in (0, size // 2)]


def _draw_faces(
    panel: Panel,
    mesh: Mesh,
    view: FloatArray,
    chosen: dict[str, NDArray[np.int64]],
    colours: dict[str, str],
) -> None:
    """Faces that look to the eye, the nearest last; those of sets in their colours."""
    from matplotlib.colors import to_rgb

    areas, depth, shown = [], [], []
    for kind, faces in mesh.skin.items():
        points = mesh.points(faces)[:, _outline(kind)]
        upright = np.cross(points[:, 1] - points[:, 0], points[:, -1] - points[:, 0])
        upright /= np.linalg.norm(upright, axis=1, keepdims=True)
        towards = upright @ view[2] > 0
        colour = np.full((len(faces), 3), 0.86)
        for name, nodes in chosen.items():
            colour[np.isin(faces, nodes).all(axis=1)] = to_rgb(colours[name])
        light = _SHADE + (1 - _SHADE) * np.abs(upright @ _LIGHT) / np.linalg.norm(_LIGHT)
        seen = points[towards] @ view.T
        areas += [*seen[..., :2]]
        depth += seen[..., 2].mean(axis=1).tolist()
        shown += [*(colour * light[:, None])[towards]]
    if not areas:
        return
    order = np.argsort(depth, kind="stable")
    edges = "none" if len(areas) > _MOST_EDGES else "0.35"
    panel.add(
        "areas",
        [areas[i] for i in order],
        facecolors=[shown[i] for i in order],
        edgecolors=edges,
        linewidths=0.4,
        rasterized=len(areas) > _MOST_EDGES // 4,
        zorder=1,
    )


def _draw_axes(panel: Panel, mesh: Mesh, view: FloatArray, axis: str | None) -> None:
    """Arrows of x, y and z at 0, and the axis of rotation."""
    reach = 0.35 * np.abs(mesh.coordinates).max()
    for i, letter in enumerate("xyz"):
        end = reach * view[:2, i]
        rotation = letter == axis
        look: Any = dict(arrowstyle="-|>", color="0.1", linewidth=2.0 if rotation else 1.0)
        panel.add("arrow", (0.0, 0.0), end.tolist(), shrinkA=0, shrinkB=0, **look)
        text = f"{letter}, axis of rotation" if rotation else letter
        panel.text(1.12 * end, text, ha="center", va="center", fontsize=9)
