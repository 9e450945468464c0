"""The structure of an archive in a page: its mesh as `symhbm.plot.model` draws it, its account."""

import base64
from html import escape
from io import BytesIO

import xarray as xr
from matplotlib.figure import Figure

from symhbm.plot.rendering import drawn
from symhbm.plot.structure import model as picture_of_model
from symhbm.plot.viewer.packing import plain
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
    structure = rebuild(dataset).model
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
