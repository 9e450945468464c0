"""One page of HTML: style, scripts, data, and a policy that runs nothing else.

A structure alone is such a page: its mesh as `symhbm.plot.model` draws it, and its account.
"""

import base64
import hashlib
import json
import re
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from symhbm.model import Structure
from symhbm.plot.rendering import drawn
from symhbm.plot.structure import model as picture_of_model
from symhbm.plot.viewer.packing import DIGITS, plain
from symhbm.results.archive import rebuild

_HERE = Path(__file__).parent
_SCRIPTS = ("data.js", "states.js", "charts.js", "page.js")
"""Our own scripts, which are one in the page."""
_EMPTY = re.compile(
    r"<section>(<details><summary>)?<h2>[^<]*</h2>(</summary>)?\s*"
    r"(</details>|<details><summary>[^<]*</summary>\s*</details>)?</section>\n?"
)
"""Sections of which a page has nothing to show."""
_DOTS = 180
"""Dots per inch of a picture, whose lines of a mesh are thin."""
_MESH = '"of": "Mesh"'
"""What the record of a problem has where a mesh is part of it."""
_LONGEST = 400


def plotting_library() -> str:
    """The script of plotly; ImportError that names what to install where it is missing."""
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise ImportError(
            "symhbm view needs plotly, which is not installed; "
            "pip install 'symhbm[view]' installs it"
        ) from error
    return get_plotlyjs()


def page_of(title: str, sections: list[tuple[str, str]], data: dict[str, Any]) -> str:
    """The page: ``sections`` are texts of HTML by their names, ``data`` what the scripts draw."""
    library = plotting_library()
    own = "\n".join((_HERE / name).read_text(encoding="utf-8") for name in _SCRIPTS)
    style = (_HERE / "page.css").read_text(encoding="utf-8")
    body = (_HERE / "page.html").read_text(encoding="utf-8")
    for name, text in sections:
        body = body.replace(f"<!-- {name} -->", text, 1)
    body = _EMPTY.sub("", body)
    policy = (
        f"default-src 'none'; script-src {_hash(library)} {_hash(own)}; "
        "style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n{body}\n"
        f'<script type="application/json" id="data">{embedded(data)}</script>\n'
        f"<script>{library}</script>\n<script>{own}</script>\n</body>\n</html>\n"
    )


def _hash(script: str) -> str:
    """What the policy calls a script that may run."""
    digest = hashlib.sha256(script.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def embedded(data: Any) -> str:
    """JSON that may stand inside of any element of a page."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text


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
