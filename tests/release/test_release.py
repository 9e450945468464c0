"""A version is told alike everywhere, and its files and dependencies are those that are said."""

import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

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
    assert [fault.partition(":")[0] for fault in disagreements(tmp_path)] == [
        "CITATION.cff",
        "CHANGELOG.md",
    ]
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
