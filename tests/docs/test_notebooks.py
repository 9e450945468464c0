"""Notebooks run, each in an empty folder, print what they say, and show each picture once."""

import re
from html.parser import HTMLParser
from pathlib import Path

import jupytext
import nbformat
import pytest
from nbclient import NotebookClient
from nbconvert import HTMLExporter

from tests.house.test_readme import check

ROOT = Path(__file__).parent.parent.parent
FOLDER = ROOT / "docs" / "notebooks"
LONG = {"best-damper", "finite-element-sector", "mistuned-disks", "own-law"}
LONG |= {"two-designs-of-a-shroud", "identified-contacts"}
DRAWS = re.compile(r"^sh\.plot\.|plt\.subplots\(", re.MULTILINE)
BAR = re.compile(r"\s*|symhbm: .*|.*\d+%\|.*|\w+s: \d+ \[.*/.*")
NAMES = sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "index")


class Pictures(HTMLParser):
    """Number of pictures of a page."""

    count = 0

    def handle_starttag(self, tag, attrs):
        self.count += tag == "img"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Runs a notebook once, in an empty folder."""
    finished = {}

    def run_once(name: str) -> nbformat.NotebookNode:
        if name not in finished:
            notebook = jupytext.read(FOLDER / f"{name}.md")
            folder = str(tmp_path_factory.mktemp(name))
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("PYTHONPATH", str(ROOT))
                patch.delenv("MPLBACKEND", raising=False)  # which the command line sets
                # Of one cell: a guard against one that hangs, none takes nearly as long.
                client = NotebookClient(notebook, timeout=1800, kernel_name="python3")
                client.resources = {"metadata": {"path": folder}}
                client.execute()
            finished[name] = notebook
        return finished[name]

    return run_once


def streams(cell: nbformat.NotebookNode, name: str) -> str:
    return "".join(one.text for one in cell.outputs if one.get("name") == name)


def pictures(cell: nbformat.NotebookNode) -> int:
    return sum("image/png" in one.get("data", {}) for one in cell.outputs)


def cells(notebook: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in LONG else []) for n in NAMES]
)
def test_notebook_runs_and_prints_what_it_says(name, run):
    for cell in cells(run(name)):
        for line in cell.source.splitlines():
            if "print(" in line and (said := line.partition("  # ")[2]):
                check(said, streams(cell, "stdout"))
        lines = re.split("[\r\n]", streams(cell, "stderr"))
        assert [line for line in lines if not BAR.fullmatch(line)] == [], cell.source
        assert pictures(cell) == bool(DRAWS.search(cell.source)), cell.source


def test_a_long_notebook_is_exported_with_each_picture_once(run):
    """Some twenty cells, with pictures of the library and of others."""
    notebook = run("first-curve")
    assert 18 <= len(cells(notebook)) <= 24
    shown = Pictures()
    page, _ = HTMLExporter().from_notebook_node(notebook)
    shown.feed(page)
    assert shown.count == sum(map(pictures, cells(notebook))) >= 6


def test_notebooks_are_listed():
    index = (FOLDER / "index.md").read_text(encoding="utf-8")
    assert [name for name in NAMES if f"({name}.md)" not in index] == []


def test_from_matrices_to_a_document_takes_few_lines():
    """Matrices, a sector, contacts, a sweep, two designs, loops at peaks, a table with units."""
    notebook = jupytext.read(FOLDER / "two-designs-of-a-shroud.md")
    code = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "code")
    assert len([line for line in code.splitlines() if line.strip()]) < 40
    steps = "read_structure", "sh.Sector", "with_contacts", "over=", "with_parameters", "compare("
    steps += 'plot.hysteresis(results, at="peak")', "units=True", "to_csv"
    assert [step for step in steps if step not in code] == []
