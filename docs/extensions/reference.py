"""A page for every public name, tables of them, ``.. public:: frf follow``, and of commands.

The pages are files in ``reference/generated``, which is not in the repository. Without names the
directive lists all of a module: ``.. public:: :module: plot``.
"""

import enum
import inspect
from pathlib import Path
from typing import ClassVar

import click
from docutils import nodes
from docutils.nodes import Node
from docutils.parsers.rst import directives
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.ext.autosummary import Autosummary
from sphinx.util.docutils import SphinxDirective

import symhbm
from symhbm.cli import main

MODULES = "datasets", "forces", "goals", "laws", "mistuning", "plot", "statistics"
"""Public modules, whose names are public, too."""
WIDTH = 80
"""Characters of a line of help."""
FOLDER = Path("reference", "generated")


def public_names() -> dict[str, object]:
    """Return all public names, without ``symhbm.``, and what they are."""
    names = {name: getattr(symhbm, name) for name in symhbm.__all__ if name not in MODULES}
    for module in MODULES:
        place = getattr(symhbm, module)
        names |= {f"{module}.{name}": getattr(place, name) for name in place.__all__}
    return names


def page(name: str, thing: object) -> str:
    """Return the page of a name."""
    title = f"{name}\n{'=' * len(name)}\n\n"
    if isinstance(thing, type):
        listed = ":members:\n   :undoc-members:" if issubclass(thing, enum.Enum) else ":members:"
        bases = "" if thing.__base__ is object else "   :show-inheritance:\n"
        return f"{title}.. autoclass:: symhbm::{name}\n   {listed}\n{bases}"
    if callable(thing):
        return f"{title}.. autofunction:: symhbm::{name}\n"
    return f"{title}.. autodata:: symhbm::{name}\n   :no-value:\n"


def write_pages(app: Sphinx) -> None:
    """Write pages that differ from those there are, and remove those of names that are gone."""
    folder = app.srcdir / FOLDER
    folder.mkdir(exist_ok=True)
    pages = {folder / f"symhbm.{n}.rst": page(n, thing) for n, thing in public_names().items()}
    for path in {*folder.iterdir()} - pages.keys():
        path.unlink()
    for path, text in pages.items():
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


class Public(Autosummary):
    """A table of public names with their first lines."""

    optional_arguments = 100
    final_argument_whitespace = False
    option_spec: ClassVar = {"module": directives.unchanged, "at-a-glance": directives.flag}

    def run(self) -> list[Node]:
        """Return the table, and a hidden list of pages."""
        names = self.arguments
        if "module" in self.options:
            module = self.options["module"]
            top = module == "symhbm"
            names = [
                n for n in public_names() if ("." not in n if top else n.startswith(f"{module}."))
            ]
        pages = {} if "at-a-glance" in self.options else {"toctree": "generated"}
        self.options = pages | {"nosignatures": None}
        self.content = StringList(names, "<public>")
        # Names without a module are of this one, in the table and in its first lines.
        self.env.ref_context["py:module"] = "symhbm"
        return super().run()

    def get_items(self, names: list[str]) -> list[tuple[str, str | None, str, str]]:
        """Return names with the first lines of their docstrings, whole."""
        public = public_names()
        return [
            (name, None, (inspect.getdoc(public[name]) or "").partition("\n")[0], full)
            if callable(public[name])
            else (name, None, first, full)
            for name, _, first, full in super().get_items(names)
        ]


class CommandLine(SphinxDirective):
    """What ``--help`` of every command says."""

    def run(self) -> list[Node]:
        """Return a section for each command."""
        shown = [self.section("symhbm", main)]
        return shown + [self.section(f"symhbm {n}", one) for n, one in main.commands.items()]

    def section(self, name: str, command: click.Command) -> nodes.section:
        """Return a section with the help of one command."""
        settings = main.context_settings | dict(terminal_width=WIDTH, max_content_width=WIDTH)
        context = click.Context(command, info_name=name, **settings)
        section = nodes.section(ids=[name.replace(" ", "-")], names=[name])
        section += nodes.title("", name)
        section += nodes.literal_block("", command.get_help(context), language="none")
        return section


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for them."""
    app.add_directive("public", Public)
    app.add_directive("command-line", CommandLine)
    app.connect("config-inited", lambda app, _: write_pages(app))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
