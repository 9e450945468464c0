"""Constructors store, functions compute."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent / "symhbm"
ROOMS = ("continuation", "peaks", "response", "design", "ensembles")
BUILT = ROOT / "continuation" / "correctors"
"""Its constructors build functions of CasADi."""
CONSTRUCTORS = {
    f"{path.relative_to(ROOT)}:{node.name}": function
    for room in ROOMS
    for path in sorted((ROOT / room).rglob("*.py"))
    if BUILT not in path.parents
    for node in ast.walk(ast.parse(path.read_text()))
    if isinstance(node, ast.ClassDef)
    for function in node.body
    if isinstance(function, ast.FunctionDef) and function.name in ("__init__", "__post_init__")
}


@pytest.mark.parametrize("name", CONSTRUCTORS)
def test_constructors_run_no_algorithm(name):
    """Neither a loop nor a method of the object that is not finished yet."""
    nodes = [*ast.walk(CONSTRUCTORS[name])]
    called = [node.func for node in nodes if isinstance(node, ast.Call)]
    own = [
        target.attr
        for target in called
        if isinstance(target, ast.Attribute)
        and isinstance(target.value, ast.Name)
        and target.value.id == "self"
    ]
    assert not own
    assert not any(isinstance(node, ast.For | ast.While) for node in nodes)


def test_constructors_are_looked_at():
    assert len(CONSTRUCTORS) > 10
