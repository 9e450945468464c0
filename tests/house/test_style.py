"""The linter, the formatter and the type checker find nothing."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
TYPES = ["pyright", "--pythonpath", sys.executable]
ALWAYS = {"symhbm/workers.py"}
"""Files whose types are checked beside those that differ from the last commit."""


def check(*command):
    run = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr


def changed():
    """Files of the package and of the studies that differ from the last commit."""
    command = ["git", "status", "--porcelain", "--untracked-files=all", "--", "symhbm", "studies"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    paths = {line[3:].split(" -> ")[-1] for line in run.stdout.splitlines()}
    return {path for path in paths if path.endswith(".py") and (ROOT / path).exists()}


@pytest.mark.parametrize("command", [["check"], ["format", "--check"]], ids=" ".join)
def test_clean(command):
    check("ruff", *command)


def test_types_of_what_changed():
    check(*TYPES, *sorted(ALWAYS | changed()))


@pytest.mark.slow
def test_types():
    check(*TYPES)
