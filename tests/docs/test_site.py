"""The site is built without a warning and without a network, and its links are right."""

import json
import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import symhbm as sh
from studies.__main__ import STUDIES, study

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent.parent
QUICK = "fig04_hysteresis_loop"
"""A study that takes a second."""
COMMAND = re.compile(r"sphinx-build (?P<options>.*) docs build/site$", re.MULTILINE)


LOADED = {"script": "src", "link": "href", "img": "src"}
"""What a page loads by itself."""


class Page(HTMLParser):
    """Links of a page, its anchors, what it loads, and its formulas."""

    def __init__(self, path: Path):
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.formulas = 0
        self.text = path.read_text(encoding="utf-8")
        self.feed(self.text)

    def handle_starttag(self, tag, attrs):
        named = dict(attrs)
        self.anchors |= {named[key] for key in ("id", "name") if named.get(key)}
        self.formulas += tag == "math"
        if tag == "a" and named.get("href"):
            self.links.append(named["href"])
        if named.get(LOADED.get(tag, "")):
            self.loaded.append(named[LOADED[tag]])


@pytest.fixture(scope="module")
def copied(tmp_path_factory) -> Path:
    """The repository by links, with pages of its own and one computed study: nothing is left."""
    root = tmp_path_factory.mktemp("repository")
    for path in ROOT.iterdir():
        if path.suffix == ".md":  # read from where a link leads, their own links would be wrong
            shutil.copy(path, root)
        elif path.name in ("studies", "symhbm"):
            (root / path.name).symlink_to(path)
    leave = shutil.ignore_patterns("generated", "__pycache__")
    shutil.copytree(ROOT / "docs", root / "docs", ignore=leave)
    (root / "data" / "results").mkdir(parents=True)
    for folder in ("pictures", "reference"):
        (root / "data" / folder).symlink_to(ROOT / "data" / folder)
    return root


def build(root: Path, *options: str) -> Path:
    """Build the site by the command that CONTRIBUTING.md tells, and without a network."""
    found = COMMAND.search((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))
    assert found, "CONTRIBUTING.md: expected the command"
    nowhere = dict.fromkeys(("http_proxy", "https_proxy", "all_proxy"), "http://127.0.0.1:9")
    # The kernels of notebooks choose where pictures go; tests chose files.
    given = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
    command = [sys.executable, "-m", "sphinx", *found["options"].split(), *options]
    run = subprocess.run(
        [*command, "docs", "build/site"],
        cwd=root, env=given | nowhere, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout[-2000:] + run.stderr[-4000:]
    return root / "build" / "site"


@pytest.fixture(scope="module")
def site(copied) -> dict[str, Page]:
    """The pages by their paths; notebooks run in tests of their own."""
    assert not study(QUICK, copied / "data" / "results", say=lambda _: None).error
    folder = build(copied, "-D", "nb_execution_mode=off", "-D", "gallery_seconds=0")
    paths = [path for path in folder.rglob("*.html") if "_static" not in path.parts]
    return {path.relative_to(folder).as_posix(): Page(path) for path in paths}


def test_links_and_anchors_are_right(site, copied):
    folder, wrong = copied / "build" / "site", []
    for name, page in site.items():
        for link in page.links + page.loaded:
            url = urlsplit(link)
            if url.scheme or url.netloc:
                continue
            path = (folder / name).parent / unquote(url.path) if url.path else folder / name
            target = path.resolve().relative_to(folder.resolve()).as_posix()
            anchors = site[target].anchors if target in site else {unquote(url.fragment)}
            if not path.exists() or (url.fragment and unquote(url.fragment) not in anchors):
                wrong.append((name, link))
    assert wrong == []


def test_pages_load_nothing_from_elsewhere(site, copied):
    for name, page in site.items():
        assert [one for one in page.loaded if urlsplit(one).netloc] == [], name
    for path in (copied / "build" / "site" / "_static").rglob("*.css"):
        outside = re.findall(r"url\([\"']?(?:https?:)?//[^)]*", path.read_text(encoding="utf-8"))
        assert outside == [], path.name


def test_every_public_name_has_a_page_and_a_place_in_a_table(site):
    listed = "".join(page.text for name, page in site.items() if name.count("/") == 1)
    for place in (
        sh,
        sh.laws,
        sh.forces,
        sh.datasets,
        sh.goals,
        sh.mistuning,
        sh.statistics,
        sh.plot,
    ):
        prefix = "" if place is sh else place.__name__.rpartition(".")[2] + "."
        for name in place.__all__:
            if not callable(getattr(place, name)):
                continue
            assert f"reference/generated/symhbm.{prefix}{name}.html" in site
            assert f'href="generated/symhbm.{prefix}{name}.html' in listed, name


def test_types_lead_to_pages_of_other_projects(site):
    page = site["reference/generated/symhbm.frf.html"]
    outside = {urlsplit(link).netloc for link in page.links}
    assert {"numpy.org", "docs.xarray.dev", "docs.python.org"} <= outside
    assert "_SupportsArray" not in "".join(page.text for page in site.values())


def test_formulas_are_typeset(site):
    assert site["theory.html"].formulas > 140
    for name, page in site.items():
        if not name.startswith(("_modules", "source", "gallery")):
            assert "$$" not in page.text, name


def test_names_in_the_text_lead_to_code_and_reference(site):
    assert "../reference/generated/symhbm.frf.html" in site["guide/verbs.html"].links
    assert "../reference/generated/symhbm.datasets.table.html" in site["guide/notebooks.html"].links
    assert "source/symhbm/balance/equations.html" in site["theory.html"].links
    assert "symhbm/balance/equations.py" in site["source/symhbm/balance/equations.html"].text
    assert "../gallery/generated/open_sector_modes.html" in site["guide/finite-elements.html"].links


def test_search_knows_words_and_names(site, copied):
    index = (copied / "build" / "site" / "searchindex.js").read_text(encoding="utf-8")
    found = json.loads(index.removeprefix("Search.setIndex(").rstrip(");\n"))
    assert "searchindex.js" in {Path(one).name for one in site["search.html"].loaded}
    assert {"guide/mistuned-disks", "theory"} <= {*found["docnames"]}
    assert "symhbm" in found["objects"]
    known = {*found["terms"]} | {*found["titleterms"]}
    assert {"mistun", "hysteresi"} <= known
    # Words by which the field searches, as the index stems them.
    field = "iwan jenkin backbon nnm isol hcf snubber lace nlvib tmdsimpi pyharm bifurcationkit"
    assert {*field.split()} <= known


def test_gallery_shows_what_was_computed_and_says_what_was_not(site, copied):
    computed = site[f"gallery/generated/{QUICK}.html"]
    assert "Landmarks" in computed.text
    assert "closed form" in computed.text
    assert any(link.endswith(f"{QUICK}.nc") for link in computed.links)
    for name in STUDIES:
        page = site[f"gallery/generated/{name}.html"]
        assert f"studies.{name}" in page.text
        if name != QUICK:
            assert "Not computed where this page was made" in page.text, name
            assert "Landmarks" not in page.text, name


@pytest.mark.slow
def test_the_whole_site_is_built_with_notebooks_and_quick_studies(copied):
    folder = build(copied)
    page = Page(folder / "notebooks" / "first-curve.html")
    assert sum("_images/" in one for one in page.loaded) > 5
