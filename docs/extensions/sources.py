"""Names in the text lead somewhere: ``model/structure.py`` to its code, ``sh.frf`` to its page."""

from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

from docutils import nodes
from reference import public_names
from sphinx.application import Sphinx

from studies.__main__ import STUDIES

ROOMS = "symhbm/", ""
"""What names of files are relative to."""
NAMES = ("guide/verbs",)
"""Pages whose names are public ones without ``sh.``, too."""


def file_of(root: Path, text: str) -> str | None:
    """Return the path of a file of the repository, of a folder that of its door."""
    if not text.endswith((".py", "/")) or text.startswith(("/", ".")):
        return None
    for room in ROOMS:
        path = f"{room}{text}__init__.py" if text.endswith("/") else f"{room}{text}"
        if path.startswith(("symhbm/", "studies/")) and (root / path).is_file():
            return path
    return None


def page_of(app: Sphinx, docname: str, text: str) -> str | None:
    """Return the page that a literal text leads to: of a study, of other code, of a public name."""
    if path := file_of(app.srcdir.parent, text):
        stem = Path(path).stem
        if path.startswith("studies/") and stem in STUDIES:
            return f"gallery/generated/{stem}"
        page = f"source/{path.removesuffix('.py')}"
        wanted(app)[page] = path
        return page
    name = text.partition("(")[0].removeprefix("sh.")
    meant = text.startswith("sh.") or docname in NAMES
    return f"reference/generated/symhbm.{name}" if meant and name in public_names() else None


def link(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    """Turn names of files and of what the package offers into links."""
    if app.builder.format != "html":
        return
    for literal in [*doctree.findall(nodes.literal)]:
        page = page_of(app, docname, literal.astext())
        if page is None or page == docname or isinstance(literal.parent, nodes.reference):
            continue
        to = app.builder.get_relative_uri(docname, page)
        reference = nodes.reference("", "", internal=True, refuri=to)
        literal.replace_self(reference)
        reference += literal


def wanted(app: Sphinx) -> dict[str, str]:
    """Pages that are linked to, and the files that they show."""
    if not hasattr(app.env, "source_pages"):
        app.env.source_pages = {}  # type: ignore[attr-defined]
    return app.env.source_pages  # type: ignore[attr-defined]


def pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Give the pages of files."""
    for page, path in wanted(app).items():
        code = (app.srcdir.parent / path).read_text(encoding="utf-8")
        shown = app.builder.highlighter.highlight_block(code, "python")  # type: ignore[attr-defined]
        body = f"<h1>{escape(path)}</h1>{shown}"
        yield page, {"title": path, "body": body}, "page.html"


def followed(app: Sphinx, module: str, name: str) -> str | None:
    """Where the code of a name is: of public ones where it was defined, of others nowhere.

    The page of a file leads back to names of one module alone.
    """
    return None if module == "symhbm" else "symhbm"


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect all."""
    app.connect("viewcode-follow-imported", followed)
    app.connect("doctree-resolved", link)
    app.connect("html-collect-pages", pages)
    return {"parallel_read_safe": True, "parallel_write_safe": False}
