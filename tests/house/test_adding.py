"""Pages for contributors name files and folders that exist, in five lines each."""

import re

import pytest

from tests.house.test_readme import ROOT

PAGES = [path for path in sorted((ROOT / "docs" / "adding").glob("*.md")) if path.stem != "index"]
NAMED = re.compile(r"`((?:symhbm|tests|docs)/[\w/.-]*)`")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_has_five_lines_and_names_what_exists(page):
    text = page.read_text(encoding="utf-8")
    assert re.findall(r"^(\d)\. ", text, re.MULTILINE) == list("12345")
    named = NAMED.findall(text)
    assert any(path.startswith("symhbm/") for path in named)
    assert [path for path in named if not (ROOT / path).exists()] == []
    assert f"]({page.name})" in (page.parent / "index.md").read_text(encoding="utf-8")


def test_rooms_that_are_to_be_run_exist():
    text = (ROOT / "docs" / "adding" / "index.md").read_text(encoding="utf-8")
    rooms = set(re.findall(r"tests/\w+", text))
    assert len(rooms) > 10
    assert [room for room in rooms if not (ROOT / room).is_dir()] == []
