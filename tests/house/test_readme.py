"""Every block of code in README.md and docs/ runs by itself, and prints what it says it prints."""

import ast
import re
import runpy
import shlex
import sys
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(
    r"(?:<!-- (?P<mark>[^>]*?) -->\n)?```(?P<language>\w+)\n(?P<code>.*?)```\n", re.DOTALL
)
SLOW, CLUSTER, JOBS = "takes long", "needs a cluster", "jobs"
"""Marks in front of a block: it runs in the slow suite, cannot run here, or is a job or what starts
jobs, as tests/cli/test_jobs.py does."""
WHOLE = ("README.md", "getting-started.md")
"""Pages whose blocks run in all suites; of others the first one does that does not take long."""
SET_UP = {"python3", "python", "cd", ".venv/bin/python"}
"""Commands that are for those who set up the project, and are run where it is tested."""
NUMBER = re.compile(r"(?<![\w.])-?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?(?![\w])")


@dataclass
class Block:
    """Code in Python, and the commands that work on the files it makes."""

    name: str
    mark: str
    code: str
    commands: list[str] = field(default_factory=list)


def blocks_of(page: Path) -> list[Block]:
    text, blocks = page.read_text(encoding="utf-8"), list[Block]()
    for fence in FENCE.finditer(text):
        code, mark = fence["code"], fence["mark"] or ""
        if mark.partition(":")[0] == JOBS or fence["language"] == "text":  # what is printed
            continue
        if fence["language"] == "python":
            line = text[: fence.start("code")].count("\n") + 1
            blocks.append(Block(f"{page.name}:{line}", mark, code))
        elif fence["language"] == "sh":
            commands = [c for c in code.splitlines() if c.split()[0] not in SET_UP]
            if commands:
                blocks[-1].commands += commands
        else:
            raise ValueError(
                f"{page.name}: expected blocks in python, sh and text, {fence['language']}"
            )
    return blocks


BLOCKS = [block for page in PAGES for block in blocks_of(page)]


def cases():
    met = set()
    for block in BLOCKS:
        page = block.name.partition(":")[0]
        is_slow = block.mark == SLOW or page in met
        if not (is_slow or page in WHOLE or block.mark == CLUSTER):
            met.add(page)
        if block.mark != CLUSTER:
            yield pytest.param(block, marks=[pytest.mark.slow] * is_slow, id=block.name)


def numbers(text: str) -> list[str]:
    return [number.replace(",", "") for number in NUMBER.findall(text)]


def same(claimed: str, printed: str) -> bool:
    """Whether a number that is claimed is one that was printed, to all digits it has."""
    mantissa, _, exponent = claimed.partition("e")
    digit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    return abs(float(claimed) - float(printed)) <= 0.5001 * digit


def check(comment: str, printed: str) -> None:
    """All numbers of a comment are printed, in the same order, or the last is below its bound."""
    if bound := re.search(r"below (\S+)", comment):
        assert float(numbers(printed)[-1]) < float(bound[1]), f"{comment!r}: got {printed!r}"
        return
    remaining = iter(numbers(printed))
    for claimed in numbers(comment):
        assert any(same(claimed, value) for value in remaining), f"{comment!r}: got {printed!r}"


@pytest.mark.parametrize("block", [*cases()])
def test_block_runs_by_itself_and_prints_what_it_says(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    script = tmp_path / "script.py"
    script.write_text(block.code)
    lines, printed = block.code.splitlines(), {}

    def record(*values):
        line = sys._getframe(1).f_lineno
        printed[line] = " ".join([printed.get(line, ""), *map(str, values)])

    # Who runs a script runs it again, beside the files of the first time.
    for _ in range(2 if "sh.save(" in block.code else 1):
        printed.clear()
        runpy.run_path(str(script), init_globals={"print": record}, run_name="__main__")
    for node in ast.walk(ast.parse(block.code)):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "print":
            comment = lines[node.end_lineno - 1].partition("  # ")[2]
            check(comment, printed[node.lineno])
    for command in block.commands:
        run(command)


def run(command: str) -> None:
    """Run a command of the shell in this process; whatever it may not do raises."""
    from symhbm.cli import main

    words = shlex.split(command, comments=True)
    assert words[0] == "symhbm", command
    with pytest.raises(SystemExit) as ended:
        main(words[1:])
    assert not ended.value.code, f"{command}: exit code {ended.value.code}"


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
def test_block_is_marked_by_a_known_word_and_imports_what_it_uses(block):
    assert block.mark in ("", SLOW, CLUSTER)
    for node in ast.walk(ast.parse(block.code, block.name)):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("symhbm"):
            offered = import_module(str(node.module))
            assert [one.name for one in node.names if not hasattr(offered, one.name)] == []
    assert "import symhbm as sh" in block.code


def test_links_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\((?!http)([^)#]+)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
