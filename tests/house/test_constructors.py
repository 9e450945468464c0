"""Constructors store, functions compute."""

import ast
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent / "symhbm"
ROOMS = ("continuation", "peaks", "response", "design", "ensembles")
BUILT = ROOT / "continuation" / "correctors"
"""Its constructors build functions of CasADi."""


def computes(node):
    """Whether a node is a loop, or calls a method of the object that is not finished yet."""
    called = node.func if isinstance(node, ast.Call) else None
    own = isinstance(called, ast.Attribute) and ast.unparse(called.value) == "self"
    return own or isinstance(node, ast.For | ast.While)


def test_constructors_run_no_algorithm():
    constructors = {
        f"{path.relative_to(ROOT)}:{node.name}": function
        for room in ROOMS
        for path in sorted((ROOT / room).rglob("*.py"))
        if BUILT not in path.parents
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef)
        for function in node.body
        if isinstance(function, ast.FunctionDef) and function.name in ("__init__", "__post_init__")
    }
    assert len(constructors) > 10
    assert [name for name, one in constructors.items() if any(map(computes, ast.walk(one)))] == []
