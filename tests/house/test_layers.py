"""Imports run downhill from room to room, through their doors, and nowhere in a circle."""

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import symhbm

ROOT = Path(__file__).parent.parent.parent
ROOMS = [
    "numerics",
    "workers",
    "model",
    "balance",
    "continuation",
    "time_domain",
    "results",
    "peaks",
    "response",
    "design",
    "ensembles",
    "plot",
    "__init__",
    "cli",
    "__main__",
]
"""From the ground to the roof: a room imports from those before it."""
ONLY_IN = {
    "casadi": "numerics model.contacts balance continuation.correctors continuation.angles design",
    "xarray": "results peaks response design ensembles plot cli",
    "pandas": "results",
    "matplotlib": "plot",
    "plotly": "plot.viewer",
    "tqdm": "workers",
    "click": "cli",
}
MOST_NAMES_OF_THE_TOP = 55
MOST_MODULES = 825
"""Modules of all packages that the import brings, a tenth more than it does."""
SLOW = {"xarray", "pandas", "matplotlib", "plotly", "netCDF4", "dask", "numba", "scipy.stats"}
SLOW |= {f"scipy.{name}" for name in ("optimize", "interpolate", "integrate")}
"""Packages that describing a problem does not need, and take longer to import than it."""
SUFFIXES = {".py", ".typed", ".js", ".css", ".html"}
MOST_FILES, MOST_NAMES, MOST_ROOMS = 14, 40, 16
LONGEST_CHAIN, MOST_ARROWS = 30, 2225
"""Files of which each imports the next, and imports of a file by another one, through doors."""

FILES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted((ROOT / "symhbm").rglob("*.py"))
}
DOORS = sorted(name for name, path in FILES.items() if path.name == "__init__.py")


def room_of(module: str) -> str:
    """The folder or file of the package that a module, or a name, is in."""
    room = module.split(".")[1] if "." in module else ""
    return room if room in ROOMS else "__init__"


@cache
def imports_of(module: str) -> set[tuple[str, str]]:
    """Every name imported anywhere in a file, with the module it is imported from."""
    found = set()
    for node in ast.walk(ast.parse(FILES[module].read_text())):
        if isinstance(node, ast.Import):
            found |= {(alias.name, "") for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative import"
            found |= {(node.module or "", alias.name) for alias in node.names}
    return found


def inside(module: str) -> set[tuple[str, str]]:
    return {pair for pair in imports_of(module) if pair[0].split(".")[0] == "symhbm"}


def test_imports_run_downhill():
    uphill = [
        (module, source, name)
        for module in FILES
        for source, name in inside(module)
        if ROOMS.index(room_of(f"{source}.{name}")) > ROOMS.index(room_of(module))
    ]
    assert not uphill


@pytest.mark.parametrize("room", ROOMS)
def test_imports_from_other_rooms_go_through_their_doors(room):
    for module in (module for module in FILES if room_of(module) == room):
        own = module if module in DOORS else module.rpartition(".")[0]
        for source, name in inside(module):
            package = source if source in DOORS else source.rpartition(".")[0]
            if package == "symhbm" or own == package or own.startswith(f"{package}."):
                continue
            assert source in DOORS, f"{module}, {source}: import {name} from {package}"
            assert name in __import__(source, fromlist=["__all__"]).__all__, module


def test_nothing_is_imported_in_a_circle():
    arrows = {
        module: {
            f"{source}.{name}" if f"{source}.{name}" in FILES else source
            for source, name in inside(module)
        }
        - {module}
        for module in FILES
    }
    TopologicalSorter(arrows).prepare()


def defined_in(source: str, name: str) -> str:
    """The file that an imported name comes from, whatever doors it passes."""
    if f"{source}.{name}" in FILES:
        return f"{source}.{name}"
    through = {pair for pair in inside(source) if pair[1] == name} if source in DOORS else ()
    return defined_in(*next(iter(through))) if through else source


def test_chains_of_imports_stay_short():
    files = [module for module in FILES if module not in DOORS]
    arrows = {
        module: {defined_in(*pair) for pair in inside(module)}.intersection(files) - {module}
        for module in files
    }
    length: dict[str, int] = {}
    for module in TopologicalSorter(arrows).static_order():
        length[module] = 1 + max((length[below] for below in arrows[module]), default=0)
    assert max(length.values()) <= LONGEST_CHAIN
    assert sum(len(below) for below in arrows.values()) <= MOST_ARROWS


def test_rooms_hold_sources_alone():
    files = {path for path in (ROOT / "symhbm").rglob("*") if path.is_file()}
    assert {path.suffix for path in files if path.parent.name != "__pycache__"} <= SUFFIXES


@pytest.mark.parametrize("door", DOORS)
def test_rooms_stay_small(door):
    folder = FILES[door].parent
    names = [path for path in folder.iterdir() if path.name != "__pycache__"]
    if door == "symhbm":
        assert len(names) <= MOST_ROOMS, full(door, len(names), "rooms", MOST_ROOMS)
        return
    n_files = sum(path.suffix == ".py" for path in names)
    assert n_files <= MOST_FILES, full(door, n_files, "files", MOST_FILES)
    n_names = len(getattr(__import__(door, fromlist=["__all__"]), "__all__", ()))
    assert n_names <= MOST_NAMES, full(door, n_names, "names", MOST_NAMES)


def full(door: str, count: int, of: str, most: int) -> str:
    """What to do where a room has too many files, or its door too many names."""
    return (
        f"{door} has {count} {of}, at most {most}: put two of half an idea together, or make a "
        "room in it of what belongs together, with a door of its own; see docs/adding/index.md"
    )


def test_a_full_room_says_what_to_do():
    assert "symhbm.plot has 15 files, at most 14: put two" in full("symhbm.plot", 15, "files", 14)


@pytest.mark.parametrize("package", ONLY_IN)
def test_packages_stay_in_their_rooms(package):
    allowed = tuple(f"symhbm.{room}." for room in ONLY_IN[package].split())
    importing = {
        module
        for module in FILES
        for source, _ in imports_of(module)
        if source.split(".")[0] == package
    }
    assert not [module for module in importing if not f"{module}.".startswith(allowed)]


def test_names_that_are_imported_later_are_those_that_types_know():
    [block] = [
        node for node in ast.parse(FILES["symhbm"].read_text()).body if isinstance(node, ast.If)
    ]
    known = {
        alias.name: f"symhbm.{alias.name}" if node.module == "symhbm" else node.module
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert known == symhbm._ROOM_OF
    assert all(hasattr(symhbm, name) for name in symhbm.__all__)


def test_the_top_has_few_names_and_none_beside_its_list():
    """Rooms are there, too: Python puts them beside the names of their package."""
    ours = {
        name: thing
        for name, thing in vars(symhbm).items()
        if not name.startswith("_") and str(getattr(thing, "__module__", "")).startswith("symhbm")
    }
    assert len(symhbm.__all__) <= MOST_NAMES_OF_THE_TOP
    assert {*ours} <= {*symhbm.__all__}
    assert "Model" in ours


def test_import_is_light():
    """What is slow to import waits until it is needed; all modules, of others too, are counted."""
    code = f"import sys, symhbm; print(len(sys.modules), not {SLOW} & {{*sys.modules}})"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    count, light = run.stdout.split()
    assert light == "True"
    assert int(count) < MOST_MODULES
