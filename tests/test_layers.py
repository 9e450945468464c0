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
    "drawn",
    "fourier",
    "crossings",
    "extremes",
    "inertia",
    "model",
    "band_function",
    "interior",
    "reduction",
    "condensed_model",
    "excitation",
    "symmetry",
    "plausibility",
    "condense",
    # first floor: symbols
    "friction",
    "linear",
    "compiled",
    "native",
    "one_harmonic",
    "two_reversals",
    "loops",
    "contact",
    "contact_springs",
    "sampled",
    "cubic_spring",
    "equations",
    "unknowns",
    "evaluation",
    "condensed_forces",
    "condensed_modes",
    "residual",
    "mean_position",
    "several_points",
    "switching_angles",
    "second_order",
    "curve",
    # second floor: numerics
    "newton",
    "constraints",
    "condensed_graph",
    "point_system",
    "resonance_count",
    "newton_graph",
    "compiled_corrector",
    "corrector",
    "events",
    "hop",
    "resonances",
    "stations",
    "folds",
    "branch_points",
    "predictor",
    "continuation",
    "start",
    "deflation",
    "linear_pieces",
    "event_march",
    "periodic_orbit",
    "exact_motion",
    "shooting",
    "angle_solvers",
    "angle_system",
    "angle_corrector",
    "doubt",
    "divisions",
    "overlooked",
    "slopes",
    "crests",
    "maxima",
    "gaps",
    "peaks",
    "monodromy",
    "stability",
    "summit",
    "peak_conditions",
    "point",
    "audit",
    "periodic_motion",
    "harmonic_sets",
    "superharmonics",
    "truncation",
    "walk",
    "angle_walks",
    "landscape",
    "natural_band",
    "tracking.step",
    "tracking.path",
    "tracking.branches",
    "tracking.between",
    "tracking.ridge",
    "tracking.crest",
    "tracking",
    "stretches",
    "refinement",
    "branch",
    # third floor: labels
    "names",
    "sweep",
    "tables",
    "provenance",
    "schema",
    "seal",
    "spool",
    "store",
    "lazy",
    "archive",
    "merge",
    "worker",
    "ensemble",
    "runs",
    "frf",
    "peak_curve",
    "solve",
    "recover",
    "transient",
    "stored_points",
    "verify",
    "design.space",
    "design.pieces",
    "design.program",
    "design.optimum",
    "design.descent",
    "design.cases",
    "design.search",
    "design.certificate",
    "design.influence",
    "design.report",
    "design.arguments",
    "design.minimise",
    "design",
    "sensitivity",
    "mistuning.copula",
    "mistuning.samples",
    "mistuning.draws",
    "mistuning",
    "statistics.population",
    "statistics.bands",
    "statistics.factors",
    "statistics.participation",
    "statistics.univariate",
    "statistics.confidence",
    "statistics.extreme_values",
    "statistics",
    # roof
    "plot.drawing",
    "plot.lines",
    "plot.curves",
    "plot.ensemble",
    "plot.shapes",
    "plot.contact",
    "plot.map",
    "plot.network",
    "plot.layout",
    "plot.symbols",
    "plot.masses",
    "plot.schematic",
    "plot",
    "__init__",
    "cli.pieces",
    "cli.findings",
    "cli.words",
    "cli.selection",
    "cli.table",
    "cli.picture",
    "cli.terminal",
    "cli.commands",
    "cli.transfer",
    "cli",
    "__main__",
]
ONLY_IN = {
    "casadi": {
        "compiled",
        "native",
        "condensed_graph",
        "point_system",
        "newton_graph",
        "compiled_corrector",
        "one_harmonic",
        "contact_springs",
        "two_reversals",
        "friction",
        "cubic_spring",
        "equations",
        "residual",
        "second_order",
        "switching_angles",
        "angle_solvers",
        "angle_system",
        "design",
    },
    "xarray": {
        "sweep",
        "provenance",
        "schema",
        "lazy",
        "archive",
        "merge",
        "runs",
        "frf",
        "peak_curve",
        "solve",
        "recover",
        "transient",
        "stored_points",
        "verify",
        "design",
        "sensitivity",
        "mistuning",
        "statistics",
        "plot",
        "cli",
    },
    "matplotlib": {"plot"},
    "tqdm": {"merge", "ensemble", "tracking", "verify", "design"},
    "click": {"cli"},
}


LAZY = {"mistuning", "plot", "statistics"}
"""Modules that the package imports once they are asked for."""
SLOW = {"matplotlib", "netCDF4", "dask", "scipy.stats"}
SLOW |= {f"scipy.{name}" for name in ("optimize", "interpolate", "integrate")}
"""Packages that not every computation needs, and take longer to import than one of those."""


def path_of(name: str) -> Path:
    path = PACKAGE / name.replace(".", "/")
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def imports_of(name: str) -> set[str]:
    """Every module imported anywhere in a file, in full."""
    found = set()
    for node in ast.walk(ast.parse(path_of(name).read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}: relative import"
            module = node.module or ""
            found |= {f"{module}.{alias.name}" for alias in node.names} | {module}
    return found


def place_of(module: str) -> str | None:
    """The module of this package that an imported name is, or is in."""
    parts = module.split(".")[1:]
    names = (".".join(parts[:n]) for n in range(len(parts), 0, -1))
    return next((name for name in names if name in ORDER), None)


def test_every_module_has_its_place():
    assert sorted(map(path_of, ORDER)) == sorted(PACKAGE.rglob("*.py"))


@pytest.mark.parametrize("name", ORDER)
def test_imports_run_downhill(name):
    above = set(ORDER[ORDER.index(name) :])
    inside = {place_of(module) for module in imports_of(name) if module.startswith("symhbm.")}
    # A package's own name comes with each import of one of its modules.
    inside -= {name.split(".")[0]}
    assert not inside & above - (LAZY if name == "__init__" else set())


@pytest.mark.parametrize("name", ORDER)
def test_packages_stay_on_their_floors(name):
    roots = {module.split(".")[0] for module in imports_of(name)}
    for package, allowed in ONLY_IN.items():
        assert package not in roots or {name, name.split(".")[0]} & allowed


def test_import_is_light():
    code = (
        "import sys, time; start = time.process_time(); import symhbm;"
        f"print(time.process_time() - start, not {SLOW} & {{*sys.modules}})"
    )
    run = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        for _ in range(3)
    ]
    times, light = zip(*(r.stdout.split() for r in run), strict=True)
    assert set(light) == {"True"}
    # The bound is 1.5 s of one core; the best of three leaves out a cold disk.
    assert min(map(float, times)) < 1.5
