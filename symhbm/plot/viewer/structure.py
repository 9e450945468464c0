"""The structure of an archive in a page: its mesh as `symhbm.plot.model` draws it, its account."""

import base64
from html import escape
from io import BytesIO

import xarray as xr
from matplotlib.figure import Figure

from symhbm.model import Structure
from symhbm.plot.rendering import drawn
from symhbm.plot.structure import model as picture_of_model
from symhbm.plot.viewer.packing import DIGITS, plain
from symhbm.plot.viewer.page import page_of
from symhbm.results.archive import rebuild

_DOTS = 180
"""Dots per inch of a picture, whose lines of a mesh are thin."""
_MESH = '"of": "Mesh"'
"""What the record of a problem has where a mesh is part of it."""
_LONGEST = 400


def mesh_html(dataset: xr.Dataset) -> str:
    """The mesh of a result and what its program told, in HTML; ``""`` where it has no mesh."""
    if _MESH not in dataset.attrs.get("problem", ""):
        return ""
    return _shown(rebuild(dataset).model)


def structure_page(structure: Structure, name: str) -> str:
    """The text of a page of a structure alone; ValueError for one without a mesh."""
    if getattr(structure.places, "mesh", None) is None:
        raise ValueError("result: expected a structure whose places have a mesh, or results")
    first = escape(plain(repr(structure).splitlines()[0]))
    sections = dict(title=escape(name), subtitle=first, mesh=_shown(structure))
    for empty in ("thinning", "peaks", "events", "failed", "notes", "facts", "provenance"):
        sections[empty] = ""
    data = {"digits": DIGITS, "curves": [], "dims": []}
    return page_of(f"{name} - symhbm", [*sections.items()], data)


def _shown(structure: Structure) -> str:
    """The picture of a structure with a mesh, and its account."""
    picture = picture_of_model.picture(structure)
    [panel] = picture.panels
    figure = Figure(figsize=picture.size, layout="constrained")
    drawn(picture, figure.add_subplot())
    content = BytesIO()
    figure.savefig(content, format="png", dpi=_DOTS)
    words = "; ".join([panel.title, *(item.label for item in panel.items if item.label)])
    program = structure.places.program
    lines = () if program is None else program.account
    told = "".join(f"<li>{escape(plain(line, _LONGEST))}</li>" for line in lines)
    image = base64.b64encode(content.getvalue()).decode("ascii")
    return (
        f'<img src="data:image/png;base64,{image}" alt="Mesh: {escape(plain(words, _LONGEST))}">'
        + f"<p>What was found when it was imported:</p><ul>{told}</ul>" * bool(told)
    )
