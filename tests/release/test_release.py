"""A version is told alike everywhere, and its files and dependencies are those that are said."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

from tests.release.dependencies import refused
from tests.release.metadata import (
    ROOT,
    disagreements,
    for_an_index,
    lowest,
    project,
    quick_start,
)
from tests.release.smoke import SMOKE

README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_metadata():
    about = project()
    assert about["license"] == "BSD-3-Clause"
    assert "Typing :: Typed" in about["classifiers"]
    assert (ROOT / "symhbm" / "py.typed").exists()
    assert not [fault for fault in disagreements() if "CITATION" in fault]


def test_each_dependency_has_one_lower_bound_that_it_allows():
    pins = [Requirement(pin) for pin in lowest()]
    for pin, line in zip(pins, project()["dependencies"], strict=True):
        (version,) = (one.version for one in pin.specifier)
        assert Version(version) in Requirement(line).specifier


def test_versions_that_disagree_are_told(tmp_path):
    (tmp_path / "pyproject.toml").write_text('[project]\nversion = "0.2.0"\n')
    (tmp_path / "CITATION.cff").write_text("cff-version: 1.2.0\nversion: 0.1.0\n")
    (tmp_path / "CHANGELOG.md").write_text("# Changelog\n\n## Unreleased\n")
    recipe = tmp_path / "docs" / "release" / "recipe.yaml"
    recipe.parent.mkdir(parents=True)
    recipe.write_text('context:\n  version: "0.1.0"\n')
    assert [fault.partition(":")[0] for fault in disagreements(tmp_path)] == [
        "CITATION.cff",
        "docs/release/recipe.yaml",
        "CHANGELOG.md",
    ]
    recipe.write_text('context:\n  version: "0.2.0"\n')
    (tmp_path / "CITATION.cff").write_text("cff-version: 1.2.0\nversion: 0.2.0\n")
    (tmp_path / "CHANGELOG.md").write_text("# Changelog\n\n## 0.2.0 - 2026-12-01\n")
    assert not disagreements(tmp_path)


@pytest.mark.parametrize("repository", [None, "https://example.org/symhbm"])
def test_page_of_an_index_has_no_link_to_files_beside_it(repository):
    page = for_an_index(README, repository)
    targets = [part.partition(")")[0] for part in page.split("](")[1:]]
    assert all(target.startswith(("http", "#")) for target in targets)
    assert ("blob/HEAD/docs/theory.md" in page) == (repository is not None)
    assert quick_start(page) == quick_start(README)


def test_smoke_set_has_tests_of_each_room():
    rooms = {path.parent.name for path in (ROOT / "symhbm").glob("*/__init__.py")}
    assert rooms - {"cli"} == {name.split("/")[1] for name in SMOKE}
    for name in SMOKE:
        path, _, test = name.partition("::")
        assert f"def {test}" in (ROOT / path).read_text(encoding="utf-8")


@pytest.mark.slow
def test_lower_bounds_and_newest_versions():
    command = [sys.executable, "-m", "tests.release.bounds"]
    done = subprocess.run(command, cwd=Path(ROOT), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_licences_that_are_refused():
    found = {"a==1": "BSD-3-Clause", "b==2": "unknown", "c==3": "AGPL-3.0-only"}
    assert refused(found) == ["b==2: unknown", "c==3: AGPL-3.0-only"]


def test_recipe_has_the_dependencies_of_the_package():
    recipe = (ROOT / "docs" / "release" / "recipe.yaml").read_text(encoding="utf-8")
    for line in project()["dependencies"]:
        name, _, bound = line.lower().partition(">=")
        assert re.search(rf"- {name}(-base)? >={re.escape(bound)}$", recipe, re.MULTILINE), line


def test_paper_is_short_and_cites_and_shows_what_there_is():
    text = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
    body = text.partition("# Summary")[2]
    assert len(body.split()) < 1000
    for part in ("Statement of need", "State of the field", "Dependencies, and why each"):
        assert part in body
    references = (ROOT / "docs" / "paper.bib").read_text(encoding="utf-8")
    cited = set(re.findall(r"@(\w+\d{4})", body))
    assert cited == set(re.findall(r"^@\w+\{(\w+),", references, re.MULTILINE))
    named = body.lower()
    assert [
        one for one in map(Requirement, project()["dependencies"]) if one.name.lower() not in named
    ] == []
    (picture,) = re.findall(r"\]\((\S+\.png)\)", body)
    assert (ROOT / "docs" / picture).exists()


def test_workflows_try_three_systems_and_each_python():
    text = (ROOT / ".github" / "workflows" / "tests.yml").read_text(encoding="utf-8")
    for word in ("ubuntu-latest", "macos-latest", "windows-latest", '"3.11"', '"3.12"', '"3.13"'):
        assert word in text
