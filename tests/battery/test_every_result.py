"""What holds for results of all verbs: archives, descriptions, pictures, pages and commands."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import symhbm as sh
from symhbm.cli import main
from symhbm.results.telling import as_text
from tests.designs import any_status
from tests.pages import data_of, texts_of
from tests.problems import chain, duffing, one_blade, ring_of_blades
from tests.sectors_to_reduce import chain_sector
from tests.stored.shown import read, same, told

FORCED = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(phase=0.2), (1, 3))
FREE = sh.HarmonicBalance(one_blade(), harmonics=(1, 3))
DRIVEN = FREE.with_parameters(damping=-0.5)
RING = sh.HarmonicBalance(ring_of_blades(3), sh.forces.EngineOrder(1), (1, 3))
FORCE = sh.forces.HarmonicForce(cosine={1: {0: 1.0, 3: 0.5}}, sine={2: {1: 0.3}})
FORCE += sh.forces.StaticLoad({0: 0.2})
PRESSED = sh.HarmonicBalance(chain("pressed"), FORCE, (0, 1, 2))
LOADS, BAND, GRID = {"normal_load": [1.0, 3.0]}, (10, 30), [18.0, 20.0, 24.0]
ORDERS, HELD = {"engine_order": [0, 1]}, (1e-6, 4e-4)
FORCES = {"force_amplitude": [1, 2]}
GUMBEL = np.random.default_rng(3).gumbel(size=40)
QUIET = dict(progress=False)


@cache
def drawn() -> xr.Dataset:
    draws = sh.mistuning.uniform(RING, 3, seed=1, normal_load=0.3, stiffness=0.02)
    return sh.frf(RING, (14, 40), at=[18.0, 25.0, 33.0], over=draws, **QUIET)


def tuned() -> xr.Dataset:
    return sh.frf(RING, (14, 40), at=[18.0, 25.0, 33.0], **QUIET)


def condensed() -> xr.Dataset:
    small = sh.condense(chain("coulomb"), sh.forces.PointForce(), (14, 40), (1, 3), **QUIET)
    return sh.frf(sh.HarmonicBalance(small, sh.forces.PointForce()), (20, 24), **QUIET)


def front() -> xr.Dataset:
    aims = {"peak": lambda p, q: p["largest"], "load": lambda p, q: q["normal_load"][0]}
    return sh.pareto_front(FORCED, "normal_load", (1, 6), (10, 40), aims=aims, n_points=2, **QUIET)


def named() -> xr.Dataset:
    places = sh.Places(np.repeat([10, 20], 3), [*"xyz"] * 2, label=["root"] * 3 + ["tip"] * 3)
    rub = sh.Friction(
        tangential=[("tip:z",), ("root:z",)], contact_stiffness=[1e3, 2e3],
        friction_coefficient=0.3, normal_load=[1.0, 2.0],
    )  # fmt: skip
    unit = np.eye(6)
    model = sh.Model(unit, unit, 1e4 * unit, places=places, contacts={"rub": rub})
    force = sh.forces.HarmonicForce(cosine={1: {"tip:z": 20.0, "root:z": 1.0}}, amplitude=1.5)
    return sh.frf(sh.HarmonicBalance(model, force), BAND, at=GRID, **QUIET)


def of_blades() -> xr.Dataset:
    """Deviations of the frequencies of blades, apart and mode by mode."""
    small = sh.craig_bampton(chain_sector(3), 2, (1, 60), blade=[1, 2, 3], blade_modes=2)
    ring, wave = sh.mistuned_ring(small), sh.forces.EngineOrder(1, pattern={3: 1.0})
    values = xr.DataArray([[0.01, 0, -0.02], [0, 0.03, 0]], dims=("sample", "blade"))
    over = {"frequency_deviation_1": values}
    return sh.frf(sh.HarmonicBalance(ring, wave), (12, 25), at=[15.0], over=over, **QUIET)


def waiting() -> xr.Dataset:
    """A run that has computed nothing yet."""
    found = result("grid").copy(deep=True)
    found["status"][:], found["converged"][:] = str(sh.Status.NOT_STARTED), False
    for name in ("amplitude", "coefficient", "residual_norm"):
        found[name][:] = np.nan
    return found


RESULTS: dict[str, Callable[[], Any]] = {
    "path": lambda: sh.frf(FORCED, BAND, over={"normal_load": [0.5, 3.0, 500.0]}, **QUIET),
    "grid": lambda: sh.frf(FORCED, BAND, at=GRID, over=LOADS, **QUIET),
    "engine orders": lambda: sh.frf(RING, (14, 18), at=[15, 17], over=ORDERS, **QUIET),
    "several laws": lambda: sh.frf(PRESSED, (20, 22), at=[20.5, 21.5], over=FORCES, **QUIET),
    "folds": lambda: sh.frf(duffing(), (0.32, 0.08), at=[0.15, 0.19, 0.21], **QUIET),
    "accuracy": lambda: sh.frf(FORCED, (30, 10), accuracy=1e-3, stability=True, **QUIET),
    "ensemble": drawn,
    "condensed": condensed,
    "point": lambda: sh.solve(RING, 17.0),
    "mistuned": lambda: sh.solve(RING.with_parameters(stiffness=[1e4, 1.01e4, 9.9e3]), 17.0),
    "named": named,
    "of blades": of_blades,
    "waiting": waiting,
    "over the load": lambda: sh.follow(FORCED, "normal_load", (0.5, 50), frequency=19.5, **QUIET),
    "modes": lambda: sh.nonlinear_modes(FREE, over=LOADS, **QUIET),
    "modes over": lambda: sh.nonlinear_modes(FREE, "normal_load", (1, 9), amplitude=3e-4, **QUIET),
    "cycles": lambda: sh.limit_cycles(DRIVEN, over=LOADS, **QUIET),
    "cycles over": lambda: sh.limit_cycles(DRIVEN, "damping", (-30, -0.1), **QUIET),
    "motion": lambda: sh.periodic_motion(PRESSED, 21.0, n_angles=16),
    "peaks over": lambda: sh.peak_curve(FORCED, "normal_load", (2, 4), **QUIET),
    "design": lambda: sh.minimise_peak(FORCED, "normal_load", (1, 9), BAND, n_starts=1, **QUIET),
    "front": front,
    "limits": lambda: sh.flutter_limit(FREE, "normal_load", (1, 9), amplitudes=HELD, **QUIET),
    "most damping": lambda: sh.maximise_damping(FREE, "normal_load", (1, 9), 3e-4, **QUIET),
    "at rest": lambda: sh.static_states(PRESSED),
    "branches": lambda: sh.other_branches(result("folding")),
    "folding": lambda: sh.frf(duffing(), (0.08, 0.191), **QUIET),
    "draws": lambda: sh.mistuning.uniform(RING, 3, seed=1, normal_load=0.3),
    "slopes of peaks": lambda: sh.datasets.sensitivity(result("path")),
    "verified": lambda: sh.verify(result("grid"), exact="none", **QUIET),
    "band": lambda: sh.statistics.envelope(drawn()),
    "amplification": lambda: sh.statistics.amplification(drawn(), tuned()),
    "localisation": lambda: sh.statistics.localisation(drawn()),
    "fit": lambda: sh.statistics.extreme_value_fit(GUMBEL, 1, n_bootstrap=100),
    "convergence": lambda: sh.statistics.convergence(GUMBEL),
    "position": lambda: sh.statistics.position(result("amplification"), 1.1),
}  # fmt: skip
WITHOUT_PICTURE = {"slopes of peaks", "band", "amplification", "localisation", "fit", "convergence"}
WITHOUT_PICTURE |= {"position", "peaks over", "cycles", "at rest", "draws", "waiting"}


@cache
def result(name: str) -> xr.Dataset:
    with any_status():
        return RESULTS[name]()


each = pytest.mark.parametrize("name", RESULTS)
READ = {"path", "grid", "point", "motion", "verified"}
"""Results that commands read in all runs; the others are slow tests."""
pytestmark = pytest.mark.filterwarnings("ignore:.*incomplete:RuntimeWarning")


@each
def test_archives_give_it_back(name, tmp_path):
    found = result(name)
    before = found.copy(deep=True)
    path = sh.save(found, tmp_path / "archive.nc")
    loaded = sh.load(path)
    xr.testing.assert_identical(loaded, found)
    xr.testing.assert_identical(found, before)
    for key, variable in found.variables.items():
        assert loaded[key].dtype == variable.dtype or variable.dtype.kind == "U", key
    with sh.load(path, lazy=True) as lazy:
        xr.testing.assert_identical(lazy, found)
    xr.testing.assert_identical(sh.load(sh.save(loaded, tmp_path / "again.nc")), found)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["again.nc", "archive.nc"]


@each
def test_it_explains_itself(name):
    found = result(name)
    for key, variable in found.variables.items():
        assert variable.attrs.get("long_name"), key
        assert variable.dtype.kind in "fibOU", key
        # As an attribute, not hidden by a method.
        assert key in found.coords or not hasattr(xr.Dataset, str(key)), key
        # Rows and columns of the matrices are indices, not physical.
        if variable.dtype.kind in "fib" and not str(key).endswith(("_row", "_column")):
            assert variable.attrs.get("units"), key
        if variable.dtype.kind == "O":
            assert all(isinstance(value, str) for value in variable.values.ravel()), key
    for holder in (found, *found.variables.values()):
        for key, value in holder.attrs.items():
            assert isinstance(value, str | int | float | np.number | np.ndarray), key
            assert not isinstance(value, bool), key
    of_problem = ("references", "casadi_version") if "problem" in found.attrs else ()
    for key in ("title", "symhbm_version", *of_problem):
        assert found.attrs[key], key
    assert found.attrs["symhbm_schema"] == 1


def shown(name: str) -> dict[str, Any]:
    """What the command line says of a result, the titles of its tables, and its page."""
    found = result(name)
    with TemporaryDirectory() as folder:
        page = sh.view(found, Path(folder) / "page.html")
        titles = {kind: columns_of(found, kind) for kind in ("points", "peaks", "events", "sets")}
        return told(
            dict(text=as_text(found), tables=titles, data=data_of(page), page=texts_of(page))
        )


def columns_of(found: xr.Dataset, kind: str) -> Any:
    """Columns of a table: numbers, and the texts there are; or why there is none."""
    try:
        table = sh.datasets.table(found, kind, units=True)
    except (ValueError, KeyError) as error:
        return str(error)
    if kind == "points" and "point" in found.dims:
        return [*table.columns]  # a path chooses its points
    is_text = {name: table[name].dtype.kind == "O" for name in table.columns}
    return {
        name: sorted({*map(str, table[name])}) if is_text[name] else table[name].to_numpy()
        for name in table.columns
    }


@each
def test_it_is_told_as_before(name):
    same(shown(name), read("results")[name])


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n not in READ)) for n in RESULTS]
)
def test_the_command_line_reads_it(name, tmp_path, monkeypatch):
    path = str(sh.save(result(name), tmp_path / "x.nc"))

    def said(*arguments):
        done = CliRunner().invoke(main, list(arguments))
        assert done.exit_code == 0, (done.output, done.exception)
        return done.stdout

    whole = said("info", path), said("export", path, "--variables", "all")
    # Read a few values at a time they are the same.
    monkeypatch.setattr("symhbm.results.reading.selection._LARGEST_BLOCK", 97)
    assert (said("info", path), said("export", path, "--variables", "all")) == whole
    assert Path(said("view", path).strip()).stat().st_size < 6e6
    if name in WITHOUT_PICTURE:
        return
    assert Path(said("plot", path).strip()).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("name", "what"),
    {
        "design": "a design", "most damping": "a design", "front": "designs", "limits": "a limit",
        "peaks over": "a curve", "branches": "a branch", "point": "a solution",
        "motion": "a motion", "verified": "a verification",
    }.items(),
)  # fmt: skip
def test_an_interrupt_ends_in_a_sentence(name, what, monkeypatch):
    """Of the call as a whole, also where the verbs that it calls have others."""
    for needed in ("grid", "folding"):
        result(needed)

    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(sh.HarmonicBalance, "evaluate", interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        RESULTS[name]()
    [note] = caught.value.__notes__
    assert note.startswith(f"symhbm: interrupted; nothing is kept of {what} that")
