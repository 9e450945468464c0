"""Names in backticks, in docstrings, comments and pages, are those of things that exist."""

import io
import re
import tokenize
from functools import cache, reduce
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent.parent.parent
SOURCES = sorted((ROOT / "symhbm").rglob("*.py"))
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
FOLDERS = ["symhbm", "studies", "tests", "docs", "data"]
PATHS = [f"/{path}" for name in FOLDERS for path in [Path(name), *(ROOT / name).rglob("*")]]
FENCED = re.compile(r"```.*?```", re.DOTALL)
IN_BACKTICKS = re.compile(r"(?<!`)`([^`]+)`(?!`)")
CODE = {tokenize.NAME, tokenize.STRING, getattr(tokenize, "FSTRING_MIDDLE", tokenize.STRING)}


@cache
def words_of(path: Path) -> set[str]:
    """Words in the code of a file, its docstrings and comments apart."""
    tokens = tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline)
    code = (t.string for t in tokens if t.type in CODE and '"""' not in t.string)
    return {word for text in code for word in re.findall(r"\w+", text)}


@cache
def words_of_all(*paths: Path) -> set[str]:
    return set[str]().union(*map(words_of, paths))


def part(whole: Any, name: str) -> Any:
    """What is called so in a module, a class or its instances."""
    if hasattr(whole, name):
        return getattr(whole, name)
    if name in getattr(whole, "__annotations__", {}):
        return None
    return import_module(f"{whole.__name__}.{name}")


def is_path(name: str) -> bool:
    return any(path.endswith(f"/{name.rstrip('/')}") for path in PATHS)


def is_public(name: str) -> bool:
    """Whether a name that begins with symhbm leads to something."""
    try:
        reduce(part, name.split(".")[1:], import_module("symhbm"))
    except (ImportError, AttributeError):
        return False
    return True


def is_word(name: str) -> bool:
    """Whether the code has all parts of a name, if the first is a module's the others there."""
    first, *others = name.split(".")
    files = [path for path in SOURCES if first in (path.stem, path.parent.name)]
    everywhere = words_of_all(*SOURCES)
    there = words_of_all(*files) if files else everywhere
    return {first} <= everywhere | {path.stem for path in files} and {*others} <= there


@pytest.mark.parametrize("path", [*SOURCES, *PAGES], ids=lambda path: path.name)
def test_what_is_named_exists(path):
    text = FENCED.sub("", path.read_text(encoding="utf-8"))
    names = IN_BACKTICKS.findall(text)
    missing = [n for n in names if re.fullmatch(r"[\w/]+(/|\.py)", n) and not is_path(n)]
    missing += [n for n in names if re.fullmatch(r"symhbm(\.\w+)+", n) and not is_public(n)]
    if path in SOURCES:
        plain = [n for n in names if re.fullmatch(r"(?!symhbm\b)[A-Za-z_]\w*(\.\w+)*", n)]
        missing += [n for n in plain if not n.endswith(".py") and not is_word(n)]
    assert missing == []


def test_verbs_are_where_their_page_says():
    rows = (ROOT / "docs" / "guide" / "verbs.md").read_text(encoding="utf-8").splitlines()
    columns = [row.split("|")[1] for row in rows if row.startswith("| `")]
    names = [name for column in columns for name in IN_BACKTICKS.findall(column)]
    assert len(names) > 30
    assert [name for name in names if not is_public(f"symhbm.{name}")] == []
