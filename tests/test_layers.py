"""Imports run downhill only, and each package stays on its floors."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "symhbm"
ORDER = [
    # ground floor: plain values
    "status",
    "check",
    "hermite",
    "fourier",
    "extremes",
    "model",
    "excitation",
    # first floor: symbols
    "friction",
    "one_harmonic",
    "contact",
    "sampled",
    "cubic_spring",
    "linear",
    "equations",
    "residual",
    "switching_angles",
    "curve",
    # second floor: numerics
    "newton",
    "corrector",
    "events",
    "hop",
    "resonances",
    "stations",
    "folds",
    "continuation",
    "start",
    "deflation",
    "linear_pieces",
    "event_march",
    "periodic_orbit",
    "exact_motion",
    "shooting",
    "angle_solvers",
    "peaks",
    "monodromy",
    "stability",
    "point",
    "audit",
    "periodic_motion",
    "harmonic_sets",
    "superharmonics",
    "truncation",
    "walk",
    "stretches",
    "refinement",
    "branch",
    # third floor: labels
    "names",
    "sweep",
    "tables",
    "provenance",
    "schema",
    "store",
    "archive",
    "merge",
    "ensemble",
    "resume",
    "frf",
    "solve",
    "transient",
    "stored_points",
    "verify",
    # roof
    "plot",
    "cli",
    "__main__",
    "__init__",
]
ONLY_IN = {
    "casadi": {
        "friction",
        "cubic_spring",
        "equations",
        "residual",
        "switching_angles",
        "angle_solvers",
    },
    "xarray": {
        "sweep",
        "provenance",
        "schema",
        "archive",
        "merge",
        "resume",
        "frf",
        "solve",
        "transient",
        "stored_points",
        "verify",
        "plot",
    },
    "matplotlib": {"plot"},
    "tqdm": {"merge", "ensemble", "verify"},
}


def imports_of(name: str) -> set[str]:
    """Every module imported anywhere in a file, in full."""
    found = set()
    for node in ast.walk(ast.parse((PACKAGE / f"{name}.py").read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}: relative import"
            module = node.module or ""
            found |= {f"{module}.{alias.name}" for alias in node.names} | {module}
    return found


def test_every_module_has_its_place():
    assert {path.stem for path in PACKAGE.glob("*.py")} == set(ORDER)


@pytest.mark.parametrize("name", ORDER)
def test_imports_run_downhill(name):
    above = set(ORDER[ORDER.index(name) :])
    inside = {module.split(".")[1] for module in imports_of(name) if module.startswith("symhbm.")}
    assert not inside & above - ({"plot"} if name == "__init__" else set())


@pytest.mark.parametrize("name", ORDER)
def test_packages_stay_on_their_floors(name):
    roots = {module.split(".")[0] for module in imports_of(name)}
    for package, allowed in ONLY_IN.items():
        assert package not in roots or name in allowed


def test_import_is_light():
    code = (
        "import sys, time; start = time.perf_counter(); import symhbm;"
        "print(time.perf_counter() - start, 'matplotlib' in sys.modules)"
    )
    run = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        for _ in range(3)
    ]
    times, loaded = zip(*(r.stdout.split() for r in run), strict=True)
    assert set(loaded) == {"False"}
    # The bound is 1.5 s; the best of three leaves out a cold disk.
    assert min(map(float, times)) < 1.5
