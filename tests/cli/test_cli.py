"""The command line says what is in the datasets, to the last digit where it writes numbers."""

import csv
import importlib
import io
import json
import subprocess
import sys
import tomllib
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import symhbm as sh
from symhbm.cli import main
from symhbm.cli.selection import kinds
from symhbm.continuation import Status
from symhbm.plot.viewer.ensemble import samples_of
from symhbm.results.reading import blocks
from tests.archives import interrupt, run
from tests.problems import BLADE as VALUES
from tests.problems import duffing, one_blade, ring_of_blades
from tests.quick import quick_first
from tests.sectors_to_reduce import chain_sector

ROOT = Path(__file__).parent.parent.parent
BLADE = sh.HarmonicBalance(sh.single_blade(**VALUES), sh.forces.PointForce(), harmonics=(1, 3))
RING = sh.HarmonicBalance(
    sh.bladed_disk(5, **VALUES | {"contact_stiffness": 1e6, "normal_load": 10.0}),
    sh.forces.EngineOrder(1),
)
DUFFING = duffing()
LOADS = xr.DataArray(
    np.random.default_rng(2013).uniform(7, 13, (3, 5)),
    dims=("sample", "contact"),
    coords={"sample": [4, 5, 6]},
)
GRID = np.linspace(150, 250, 41)
CASES = {
    "path": lambda: sh.frf(BLADE, (10, 30), over={"normal_load": [0.5, 3.0, 100.0]}),
    "grid": lambda: sh.frf(RING, (150, 250), at=GRID, over={"normal_load": LOADS}),
    "short": lambda: sh.frf(BLADE, (10, 30), over={"normal_load": [0.5, 3.0]}, max_points=12),
    "accurate": lambda: sh.frf(BLADE, (30, 10), accuracy=1e-3, stability=True),
    "follow": lambda: sh.follow(BLADE, "normal_load", (0.5, 50), frequency=19.5),
    "solutions": lambda: sh.frf(DUFFING, (0.32, 0.08), at=[0.15, 0.19, 0.21]),
    "point": lambda: sh.solve(RING, 190.0),
    "motion": lambda: sh.periodic_motion(BLADE, 19.5, n_angles=16),
}


@cache
def dataset(case):
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="2 of 2 curves are incomplete")  # "short"
        return CASES[case]()


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("archives")
    return cache(lambda case: sh.save(dataset(case), folder / f"{case}.nc"))


def told(*arguments):
    """What ``info`` says, by its labels; a label without a name goes on with the one before."""
    code, out, err = run("info", *arguments)
    assert (code, err) == (0, "")
    said, label = {}, ""
    for line in out.splitlines():
        assert len(line) <= 100 or line.startswith("archive")
        label = line[:23].strip() or label
        said[label] = f"{said.get(label, '')} {line[23:].strip()}".strip()
    return said


def table(*arguments):
    code, out, err = run("export", *arguments)
    assert (code, err) == (0, "")
    head, *rows = csv.reader(io.StringIO(out))
    return {
        name.split(" ")[0]: list(column)
        for name, column in zip(head, zip(*rows, strict=True), strict=True)
    }


def test_info_of_a_path(archive):
    ds, said = dataset("path"), told(archive("path"))
    assert said["structure"] == "1 blade, 1 contact to the ground"
    assert said["normal_load"] == "swept, 3 values: 0.5, 3, 100 N"
    assert said["stiffness"] == "10000 N m-1"
    assert said["excitation"] == "point force on blade 0"
    assert said["harmonics"] == "1, 3"
    assert said["computed"] == "frequency response from 10 to 30 Hz, along the path"
    assert said["curves"] == "3 of 3 complete"
    assert said["points"] == f"{int(ds.n_points.sum())}, all converged"
    # The largest of three loads is the nearly free blade: -37.3006 dB, known in closed form.
    assert said["highest peak"].startswith("0.01364")
    assert said["highest peak"].endswith("blade 0, smooth, normal_load=0.5")
    assert "(-37.30 dB re 1 m), at 15.9164 Hz" in said["highest peak"]
    assert said["events"] == "4: 2 end of slip, 2 onset of slip"
    slipping = int((ds.contact_state == 1).sum())
    assert f"at {slipping} of {int(ds.n_points.sum())} points" in said["contacts"]
    assert said["dissipation"].startswith(f"at most {float(ds.dissipation.max()):.4g} J")
    assert said["residual"].startswith(f"at most {float(ds.residual_norm.max()):.1e}")
    assert "largest response" not in said


def test_info_of_an_ensemble(archive):
    ds, said = dataset("grid"), told(archive("grid"))
    assert said["structure"] == "5 blades, 5 contacts each between two neighbours in a ring"
    low, high = float(LOADS.min()), float(LOADS.max())
    assert said["normal_load"] == (
        f"swept over sample: {low:.6g} to {high:.6g} N, differing between contacts, "
        "nominal value 10 N"
    )
    assert said["engine_order"] == "1"
    assert said["computed"] == "frequency response from 150 to 250 Hz, at 41 values"
    assert said["parameter sets"] == "3 along sample"
    assert said["points"] == "123, all converged"
    tops = ds.peak_amplitude.max("peak")
    assert said["highest peak"].startswith(f"{float(tops.max()):.6g} m")
    assert said["highest peak"].endswith(f"sample={int(tops.idxmax())}")
    stuck = [j for j in range(5) if not (ds.contact_state.isel(contact=j) == 1).any()]
    assert ("always stuck" in said["contacts"]) == bool(stuck)


@pytest.mark.slow
def test_info_of_all_that_there_is(archive):
    said = told(archive("short"))
    assert said["curves"].startswith("0 of 2 complete, 2 not 2: the largest number of points")
    assert "largest response" in said
    said = told(archive("accurate"))
    assert said["harmonics"].startswith("as many as each point takes for an accuracy of 0.001")
    assert said["computed"].startswith("frequency response from 30 to 10 Hz")
    assert said["stability"] == f"{dataset('accurate').sizes['point']} stable"
    worst = float(dataset("accurate").truncation_error.max())
    assert said["truncation error"].startswith(f"at most {worst:.1e}")
    said = told(archive("follow"))
    assert said["normal_load"] == "followed, 0.5 to 50 N, nominal value 3 N"
    assert said["computed"].startswith("response over normal_load from 0.5 to 50 N")
    assert said["computed"].endswith("at 19.5 Hz")
    said = told(archive("solutions"))
    assert said["points"] == "5, all converged (each solution at a value counts)"
    assert said["stability"] == "4 stable, 1 unstable"
    assert said["events"] == "2: 2 fold"
    assert said["cubic_stiffness"] == "0.1 N m-3"
    said = told(archive("point"))
    assert (said["computed"], said["status"]) == (
        "response at one frequency, 190 Hz",
        "1 of 1 complete",
    )
    # Tuned blades move alike: round-off does not choose among them.
    assert said["largest response"].endswith("blade 0")
    said = told(archive("motion"))
    assert said["computed"].startswith("periodic motion in time, without truncation, at 16 angles")
    assert said["events"] == f"{dataset('motion').sizes['event']}: 2 end of slip, 2 onset of slip"


def interrupted(target, at=GRID, **options):
    """A run of three curves that was stopped after two of them."""
    over = {"normal_load": LOADS}
    interrupt(2, sh.frf, RING, (150, 250), at=at, over=over, archive=target, **options)
    return target.with_name("run.nc.partial")


@pytest.mark.slow
def test_info_of_a_flutter_limit(tmp_path):
    blade = one_blade()  # fmt: skip
    problem = sh.HarmonicBalance(blade, harmonics=(1,))
    given = "normal_load", (1, 2)
    held = sh.maximise_flutter_limit(problem, *given, (1e-6, 4e-4), progress=False)
    damped = sh.maximise_damping(problem, *given, 3e-4, progress=False)
    sh.save(held, tmp_path / "held.nc")
    sh.save(damped, tmp_path / "damped.nc")
    said = told(tmp_path / "held.nc")
    assert said["normal_load"].endswith(" 1 to 2 N")
    assert said["largest flutter limit"].startswith("0.113416, at ")
    assert said["design"].startswith("the parameter changes nothing within the bounds")
    assert told(tmp_path / "damped.nc")["normal_load"].endswith(" 2 N")
    assert run("plot", tmp_path / "held.nc")[1].strip().endswith("held_flutter-limit.png")


@pytest.mark.parametrize("at", [None, GRID], ids=["path", "grid"])
def test_info_of_an_unfinished_run(tmp_path, at):
    path = interrupted(tmp_path / "run.nc", at)
    said = told(path)
    assert said["curves"] == "2 of 3 complete, 1 of 3 not computed yet"
    assert said["points"].endswith("all converged")
    code, out, err = run("info", tmp_path / "run.nc")
    assert (code, out) == (2, "")
    assert f"an unfinished run {path}" in err
    code, out, err = run("export", path, "--variables", "converged")
    assert (code, err) == (
        0,
        "symhbm export: 1 of 3 curves are incomplete, --table sets says why\n",
    )


def test_info_of_a_run_that_computed_nothing(tmp_path):
    waiting = dataset("path").copy(deep=True)
    waiting["status"][:] = str(Status.NOT_STARTED)
    waiting["frequency"][:] = np.nan
    waiting["converged"][:] = False
    said = told(sh.save(waiting, tmp_path / "waiting.nc"))
    assert said["curves"] == "0 of 3 complete, 3 of 3 not computed yet"
    assert said["points"] == "none"


def test_modes_of_blades_in_words_and_tables(tmp_path):
    sector = sh.craig_bampton(chain_sector(3), 2, (1, 60), blade=[1, 2, 3], blade_modes=2)
    name, values = "frequency_deviation_1", np.array([[0.01, 0, -0.02], [0, 0.03, 0]])
    problem = sh.HarmonicBalance(
        sh.mistuned_ring(sector), sh.forces.EngineOrder(1, pattern={3: 1.0})
    )
    over = {name: xr.DataArray(values, dims=("sample", "blade"))}
    path = sh.save(sh.frf(problem, (12, 25), at=[15.0], over=over), tmp_path / "ring.nc")
    said = told(path)
    assert said[name] == (
        "swept over sample: -0.02 to 0.03, differing between blades, nominal value 0"
    )
    assert said["stiffness_deviation"] == said["frequency_deviation_0"] == "0"
    assert not any(label.startswith("blade_") for label in said)
    sets = table(path, "--table", "sets")
    columns = np.array([sets[f"{name}_{blade}"] for blade in range(3)], dtype=float)
    np.testing.assert_array_equal(columns, values.T)


def test_info_of_mistuned_blades_statistics_and_verifications(tmp_path):
    blades = np.array([1e4, 1.01e4, 0.99e4, 1e4, 1e4])
    problem = RING.with_parameters(stiffness=blades)
    said = told(sh.save(sh.solve(problem, 190.0), tmp_path / "mistuned.nc"))
    assert said["stiffness"] == (
        "mistuned, 9900 to 10100 N m-1, differing between blades (mean 10000)"
    )
    ds = dataset("grid")
    mean = ds[["amplitude"]].mean("sample", keep_attrs=True)
    mean["share"] = ("frequency", np.where(ds.frequency < 160, np.nan, 0.5))
    mean.attrs = {"title": "A mean", "symhbm_schema": 1, "note": "by hand"}
    said = told(sh.save(mean, tmp_path / "mean.nc"))
    assert (said["title"], said["note"]) == ("A mean", "by hand")
    low, high = float(mean.amplitude.min()), float(mean.amplitude.max())
    assert f"{low:.6g} to {high:.6g} m" in said["amplitude"]
    missing = int((ds.frequency < 160).sum())
    assert said["share"] == f"along frequency, 0.5 ({missing} of 41 are NaN)"
    verified = sh.verify(dataset("point"), exact="none")
    said = told(sh.save(verified, tmp_path / "verified.nc"))
    assert said["verification"] == "passed, 1 points checked"


@given(st.lists(st.integers(1, 6), max_size=4), st.integers(1, 9), st.integers(1, 40))
def test_blocks_hold_every_row_once_and_in_order(shape, width, budget):
    array = np.arange(int(np.prod(shape))).reshape(shape)
    dims = [f"d{i}" for i in range(len(shape))]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("symhbm.results.reading.blockwise._LARGEST_BLOCK", budget)
        rows = []
        for block in blocks(dict(zip(dims, shape, strict=True)), dims, width):
            part = array[tuple(block.get(dim, slice(None)) for dim in dims)]
            assert part.size * width <= max(budget, width)
            rows += part.ravel().tolist()
    assert rows == list(range(array.size))


def test_an_exported_path_is_the_path_to_the_last_digit(archive):
    ds = dataset("path")
    found = table(archive("path"), "--variables", "all")
    inside = np.isfinite(ds.frequency.values)
    expected = {
        "normal_load": np.broadcast_to(ds.normal_load.values[:, None], inside.shape),
        "frequency": ds.frequency.values,
        "amplitude_0": ds.amplitude.values[..., 0],
        "coefficient_dof0_h3_sin": ds.coefficient.sel(harmonic=3, component="sin").values[..., 0],
        "dissipation_0": ds.dissipation.values[..., 0],
    }
    for name, values in expected.items():
        np.testing.assert_array_equal(np.array(found[name], dtype=float), values[inside])
    assert found["converged"] == ["True"] * int(inside.sum())


_ESCAPES = "\x1b]0;owned\x07\x1b[2Jtext\x9b2J\u202e"


def test_control_characters_of_an_archive_are_not_written(tmp_path):
    changed = dataset("point").assign_attrs(title=_ESCAPES, _note=_ESCAPES)
    changed["own_text"] = ((), _ESCAPES, {"long_name": _ESCAPES, "units": _ESCAPES})
    changed["own"] = changed["amplitude"].assign_attrs(units=_ESCAPES)
    changed["word"] = ("dof", np.array([_ESCAPES] * changed.sizes["dof"]))
    target = sh.save(changed, tmp_path / "changed.nc")
    for verb in (
        ("info", target),
        ("export", target, "--variables", "own,word,own_text"),
        ("export", target, "--table", "sets"),
        ("export", target, "--variables", _ESCAPES),
        ("verify", target),
    ):
        _, out, err = run(*verb)
        assert out + err
        for character in (out + err).replace("\n", ""):
            assert character.isprintable(), verb


def test_a_number_in_an_attribute_is_no_size(tmp_path):
    ds = dataset("point")
    told_wrong = json.loads(ds.attrs["problem"]) | {"n_dof": 10**11}
    changed = ds.assign_attrs(problem=json.dumps(told_wrong))
    assert "blades" in told(sh.save(changed, tmp_path / "changed.nc"))["structure"]


def test_an_archive_may_be_named_without_its_ending(archive):
    path = archive("grid")
    assert run("info", path.with_suffix("")) == run("info", path)


def test_a_table_for_standard_output_and_for_no_other_program(tmp_path, archive):
    path = archive("grid")
    assert run("export", path, "--output", "-") == run("export", path)
    code, out, err = run("export", path, "--output", tmp_path / "grid.xlsx")
    assert (code, out) == (2, "")
    assert "expected a name ending in .csv" in err
    assert not (tmp_path / "grid.xlsx").exists()


def test_a_verification_tells_what_is_incomplete(archive):
    code, _, err = run("verify", archive("short"), "--exact", "none")
    assert (code, "2 of 2 curves are incomplete" in err) == (0, True)


def test_an_exported_table_is_read_by_pandas(tmp_path, archive):
    ds, path = dataset("grid"), tmp_path / "grid.csv"
    code, out, err = run("export", archive("grid"), "--output", path)
    assert (code, out, err) == (0, f"{path}\n", "")
    frame = pd.read_csv(path, dtype=str)
    assert not any("coefficient" in name for name in frame.columns)
    back = frame[[f"amplitude_{i} [m]" for i in range(5)]].astype(float).values
    np.testing.assert_array_equal(back.reshape(ds.amplitude.shape), ds.amplitude.values)
    # An angle that is not known is an empty field, and NaN again.
    angle = frame[[f"theta_star_{i} [rad]" for i in range(5)]].astype(float).values
    np.testing.assert_array_equal(angle.reshape(ds.theta_star.shape), ds.theta_star.values)
    assert np.isnan(angle).any()


def test_other_tables(archive):
    ds = dataset("grid")
    found = table(archive("grid"), "--table", "peaks")
    kept = ds.peak_kind.values != ""
    np.testing.assert_array_equal(
        np.array(found["peak_frequency"], dtype=float), ds.peak_frequency.values[kept]
    )
    assert found["peak_kind"] == ds.peak_kind.values[kept].tolist()
    assert len(table(archive("grid"), "--table", "events")["event_kind"]) == int(ds.n_events.sum())
    sets = table(archive("grid"), "--table", "sets")
    assert sets["sample"] == ["4", "5", "6"]
    np.testing.assert_array_equal(np.array(sets["normal_load_3"], dtype=float), LOADS[:, 3])
    several = table(archive("solutions"))
    assert (several["frequency"], several["solution"]) == (
        ["0.15", "0.19", "0.19", "0.19", "0.21"],
        ["0", "0", "1", "2", "0"],
    )
    motion = table(archive("motion"))
    np.testing.assert_array_equal(
        np.array(motion["friction_force_0"], dtype=float),
        dataset("motion").friction_force.values[:, 0],
    )
    assert len(table(archive("motion"), "--table", "events")["event_angle"]) == 4
    assert table(archive("point"))["frequency"] == ["190.0"]


def test_points_that_are_not_there_keep_their_row(tmp_path):
    ds = dataset("solutions").copy(deep=True)
    place = {"frequency": 0}
    ds.n_solutions[place] = 0
    ds.converged[place] = False
    ds.amplitude[place] = np.nan
    path = sh.save(ds, tmp_path / "hole.nc")
    found = table(path, "--variables", "amplitude,converged")
    assert (found["frequency"][0], found["amplitude_0"][0], found["converged"][0]) == (
        "0.15",
        "",
        "False",
    )


def test_selections(archive):
    ds = dataset("grid")
    chosen = ["--select", "sample=4,6", "--select", "frequency=160:170", "--select", "dof=3"]
    found = table(archive("grid"), *chosen, "--variables", "amplitude")
    part = ds.amplitude.sel(sample=[4, 6], frequency=slice(160, 170), dof=3)
    assert set(found) == {"sample", "frequency", "amplitude_3"}
    np.testing.assert_array_equal(np.array(found["amplitude_3"], dtype=float), part.values.ravel())
    # A range holds for peaks as it does for points, also along a path.
    for case, low, high in (("grid", 160, 200), ("path", 15, 20)):
        peaks = dataset(case).peak_frequency.values
        inside = peaks[(peaks >= low) & (peaks <= high)]
        assert len(inside)
        found = table(archive(case), "--table", "peaks", "--select", f"frequency={low}:{high}")
        np.testing.assert_array_equal(np.array(found["peak_frequency"], dtype=float), inside)
    found = table(archive("path"), "--select", "frequency=15:20", "--select", "normal_load=3")
    values = np.array(found["frequency"], dtype=float)
    path = dataset("path").sel(normal_load=3).frequency.values
    np.testing.assert_array_equal(values, path[(path >= 15) & (path <= 20)])
    # Numbers agree to round-off: 152.5 is a third of 457.5.
    assert (
        table(archive("grid"), "--select", f"frequency={457.5 / 3!r}")["frequency"] == ["152.5"] * 3
    )


def test_plot(archive, tmp_path, monkeypatch):
    path = archive("path")
    picture = path.with_name("path_response.png")
    assert run("plot", path) == (0, f"{picture}\n", "")
    assert picture.read_bytes().startswith(b"\x89PNG")
    for suffix, start in ((".pdf", b"%PDF"), (".svg", b"<?xml")):
        output = tmp_path / f"loads{suffix}"
        code, out, err = run("plot", path, "--select", "normal_load=0.5,3", "--output", output)
        assert (code, out, err) == (0, f"{output}\n", "")
        assert output.read_bytes().startswith(start)
    calls = []

    def drawn(kind):
        def draw(part, *, contact=None, place=None, ax=None):
            calls.append((kind, part, contact, place))
            return sh.plot.rendering.plt.figure(figsize=(1, 1))

        return draw

    for kind in ("envelope", "disk", "blades", "hysteresis", "stick_map"):
        monkeypatch.setattr(sh.plot, kind, drawn(kind))
    for case, kind in (("grid", "envelope"), ("point", "disk"), ("motion", "hysteresis")):
        code, out, err = run("plot", archive(case), "--contact", "0")
        assert (code, out, err) == (0, f"{path.with_name(f'{case}_{kind}.png')}\n", "")
        assert (calls[-1][0], calls[-1][2]) == (kind, 0)
    code, out, err = run("plot", archive("grid"), "--select", "sample=5", "--kind", "stick-map")
    assert code == 0
    assert calls[-1][0] == "stick_map"
    assert "sample" not in calls[-1][1].dims
    # One sample of an ensemble is a response like any other.
    assert run("plot", archive("grid"), "--select", "sample=5", "--place", "2")[1].endswith(
        "grid_response.png\n"
    )
    assert run("plot", archive("grid"), "--kind", "blades")[0] == 0
    assert calls[-1][1].sizes == dataset("grid").sizes


@pytest.mark.parametrize(
    "kind", quick_first(["disk", "stick-map", "blades", "states", "envelope", "hysteresis"], 2)
)
def test_every_kind_is_drawn(archive, kind):
    path = archive("grid")
    chosen = ("--select", "sample=5") if kind in ("disk", "hysteresis") else ()
    code, _, err = run("plot", path, "--kind", kind, *chosen)
    assert (code, err) == (0, "")
    assert path.with_name(f"grid_{kind}.png").read_bytes().startswith(b"\x89PNG")


def test_info_of_draws(tmp_path):
    draws = sh.mistuning.uniform(RING, 2, seed=7, normal_load=0.3, contact_stiffness=[0.1] * 5)
    dataset = sh.frf(RING, (180, 182), at=[181.0], over=draws)
    said = told(sh.save(dataset, tmp_path / "x.nc"))
    assert said["normal_load"].endswith("10 N; uniform, relative half-width 0.3, seed 7")
    assert said["contact_stiffness"].endswith("; uniform, seed 7")


def test_info_of_sectors(tmp_path):
    disk = ring_of_blades(5, contact_stiffness=1e5, normal_load=10)
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(2))
    loads = xr.DataArray([[9.0] * 5, [9.0, 10.0, 9.0, 9.0, 9.0]], dims=("sample", "contact"))
    dataset = sh.frf(problem, (80, 90), at=[85.0], over={"normal_load": loads})
    said = told(sh.save(dataset, tmp_path / "x.nc"))
    assert said["solved"] == "one of 5 sectors that move alike, in 1 of 2 curves"


def test_no_incomplete_curve_is_drawn_as_if_it_were_complete(tmp_path, monkeypatch):
    path = interrupted(tmp_path / "run.nc")
    calls, make = [], sh.plot.blades.picture

    def blades(values, ax=None):
        calls.append(make(values))
        return sh.plot.rendering.plt.figure(figsize=(1, 1))

    monkeypatch.setattr(sh.plot, "blades", blades)
    assert run("plot", path, "--kind", "blades")[0] == 0
    assert "left out, NaN: 1 of 3" in [item.label for item in calls[0].panels[0].items]


def test_resume(tmp_path, monkeypatch):
    target = tmp_path / "run.nc"
    for give_partial in (False, True):
        partial = interrupted(target)
        assert told(partial)["curves"].startswith("2 of 3 complete, 1 of 3 not computed yet")
        given_name = partial if give_partial else target
        code, out, err = run("resume", given_name, "--workers", "2", "--no-progress")
        assert (code, err) == (0, "")
        assert out == f"2 of 3 curves were there, 1 computed, 0 of all are incomplete\n{target}\n"
        xr.testing.assert_identical(
            sh.load(target),
            sh.load(sh.save(dataset("grid"), tmp_path / "whole.nc", overwrite=True)),
        )
        assert "nothing to resume" in run("resume", target)[1]
        target.unlink()
    assert "no such file" in run("resume", tmp_path / "other.nc")[2]
    partial = interrupted(target)

    def stopped(path, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(sh, "resume", stopped)
    code, out, err = run("resume", target)
    assert (code, out) == (130, "")
    assert f"kept in {partial}" in err


@pytest.mark.slow
def test_warnings_are_lines_without_code(tmp_path):
    target = tmp_path / "run.nc"
    interrupted(target, max_points=3)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        code, out, err = run("resume", target, "--workers", "1", "--no-progress")
    assert code == 0
    assert "3 of all are incomplete" in out
    (line,) = err.splitlines()
    assert line.startswith("symhbm: 3 of 3 curves are incomplete: the largest number of points")


def test_a_broken_bound_is_an_exit_code(archive):
    bound = ["--bound", "residual_stored=0"]
    code, out, _ = run("verify", archive("point"), "--exact", "none", *bound)
    assert code == 1
    assert "BROKEN" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["info", "{none}"], "no such file"),
        (["info", "{text}"], "no NetCDF file"),
        (["info", "{cut}"], "damaged, or no NetCDF file"),
        (["info", "{foreign}"], "not written by symhbm"),
        (["info", "{here}"], "a directory, expected a file"),
        (["inform", "{grid}"], "did you mean 'info'?"),
        (["plot", "{grid}", "--kind", "pie"], "'response', 'bode'"),
        (["plot", "{path}", "--place", "7"], "place=7: expected an integer from 0 to 0"),
        (["plot", "{path}", "--contact", "0"], "--contact 0: response takes no --contact"),
        (["plot", "{path}", "--output", "x.gif"], "--output x.gif: expected a name ending in .png"),
        (["plot", "{path}", "--output", "{none}/x.png"], "in an existing directory"),
        (["plot", "{path}", "--select", "normal_load=7"], "there are 0.5, 3.0, 100.0"),
        (["plot", "{path}", "--select", "normal_load"], "expected NAME=VALUE"),
        (["plot", "{path}", "--select", "load=3"], "did you mean 'normal_load'?"),
        (["plot", "{path}", "--select", "normal_load=x"], "expected a number"),
        (["plot", "{path}", "--select", "component=tan"], "there are cos, sin"),
        (["plot", "{path}", "--select", "frequency=20"], "expected a range LOW:HIGH"),
        (["plot", "{path}", "--select", "frequency=20:10"], "in ascending order"),
        (["plot", "{path}", "--select", "frequency=40:50"], "from 10.0 to 30.0"),
        (["export", "{grid}", "--select", "sample=0"], "there are 4, 5, 6"),
        (["export", "{grid}", "--select", "frequency=1:2"], "there are 41 from 150.0 to 250.0"),
        (["export", "{grid}", "--variables", "amplitud"], "did you mean 'amplitude'?"),
        (["export", "{grid}", "--variables", "peak_dof"], "it has the dimensions sample, peak"),
        (["export", "{point}", "--table", "peaks"], "the archive has no peaks"),
        (["export", "{grid}", "--table", "rows"], "'points', 'peaks', 'events', 'sets'"),
        (["export", "{grid}", "--table", "sets", "--select", "frequency=150:160"], "whole curve"),
        (["export", "{grid}", "--output", "{here}"], "expected a file name"),
        (["resume", "{none}", "--workers", "0"], "x>=1"),
        (["verify", "{point}", "--bound", "residual=1"], "'residual' is no figure"),
        (["verify", "{point}", "--bound", "energy_error"], "expected FIGURE=VALUE"),
        (["verify", "{point}", "--exact", "some"], "exact='some'"),
        (["verify", "{point}", "--output", "{none}/out.nc"], "cannot be written"),
    ],
)
def test_bad_input_is_one_line(archive, tmp_path, arguments, message):
    files = {name: tmp_path / f"{name}.nc" for name in ("none", "text", "cut", "foreign")}
    files |= {name: archive(name) for name in ("path", "grid", "point")} | {"here": tmp_path}
    files["text"].write_text("no archive")
    files["cut"].write_bytes(files["grid"].read_bytes()[:20000])
    xr.Dataset({"a": 1}).to_netcdf(files["foreign"])
    code, out, err = run(*(argument.format(**files) for argument in arguments))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_help_and_version():
    code, out, _ = run("--help")
    assert code == 0
    for name in ("info", "plot", "verify", "export", "resume"):
        assert f"symhbm {name} blade.nc" in out
        code, text, _ = run(name, "--help")
        assert code == 0
        # Lines of examples stay lines.
        assert f"Examples:\n    symhbm {name}" in text
    assert run("--version")[1].strip().endswith(sh.__version__)


def test_every_file_of_verbs_is_a_command():
    files = {path.stem.rstrip("_") for path in (ROOT / "symhbm" / "cli" / "verbs").glob("[!_]*.py")}
    assert files == {*main.commands}


@pytest.mark.slow
def test_several_archives_in_one_picture(archive, tmp_path):
    path, output = archive("path"), tmp_path / "both.svg"
    other = sh.save(sh.frf(BLADE.with_parameters(stiffness=1.2e4), (10, 30)), tmp_path / "stiff.nc")
    code, _, err = run("plot", path, other, "--output", output)
    assert (code, err) == (0, "")
    text = output.read_text()
    assert ">stiff<" in text
    assert "path, " in text
    options = ("--label", "as built", "--label", "stiffer blade", "--output", output)
    assert run("plot", path, other, *options)[0] == 0
    assert ">stiffer blade<" in output.read_text()
    for more, words in (
        (["--kind", "states"], "states draws one, got 2"),
        (["--label", "one"], "--label: expected 2"),
        (["--label", "one", "--label", "one"], "expected different ones"),
    ):
        code, _, err = run("plot", path, other, *more)
        assert code == 2
        assert words in err


@pytest.mark.slow
def test_a_point_of_each_curve_in_pictures_and_tables(archive, tmp_path):
    path, output = archive("path"), tmp_path / "loops.svg"
    code, _, err = run("plot", path, "--kind", "hysteresis", "--at", "peak", "--output", output)
    assert (code, err) == (0, "")
    assert "peak of each curve" in output.read_text()
    rows = [*csv.reader(io.StringIO(run("export", path, "--at", "peak")[1]))]
    top = sh.datasets.at(dataset("path"), "peak")
    column = rows[0].index("dissipation_0 [J]")
    assert [float(row[column]) for row in rows[1:]] == top.dissipation.values[:, 0].tolist()
    for at, words in (
        ("top", "expected peak, largest"),
        ("9", "no curve has it"),
        ("99.5", "10 to 30"),
    ):
        code, _, err = run("export", path, "--at", at)
        assert code == 2
        assert words in err


def test_every_picture_of_the_library_is_a_kind(monkeypatch):
    expected = ["response", "bode", "backbone", "envelope", "disk", "blades"]
    expected += ["nonlinear-modes", "limit-cycles"]
    expected += ["flutter-limit", "pareto-front"]
    expected += ["hysteresis", "normal-force", "states", "stick-map", "contact-map", "model"]
    expected += ["phase", "nyquist", "phase-portrait", "transmissibility"]
    assert kinds() == [*expected, "next-measurements"]
    monkeypatch.setattr(sh.plot, "a_new_one", lambda dataset, *, ax=None: None, raising=False)
    monkeypatch.setattr(sh.plot, "__all__", [*sh.plot.__all__, "a_new_one"])
    assert kinds() == [*expected, "a-new-one", "next-measurements"]


def test_the_program_is_installed_as_symhbm():
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    module, name = scripts["symhbm"].split(":")
    assert getattr(importlib.import_module(module), name) is main


@pytest.mark.slow
def test_a_reader_may_stop_reading(archive):
    # More than a pipe holds, so that the writer meets the closed end.
    command = [sys.executable, "-m", "symhbm", "export", str(archive("grid")), "--variables", "all"]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline().startswith("sample,frequency [Hz],")
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 141


@pytest.mark.slow
def test_the_library_does_without_click():
    code = (
        "import json, sys; import symhbm;"
        "print(json.dumps([name for name in ('click', 'symhbm.cli') if name in sys.modules]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert json.loads(done.stdout) == []


@pytest.mark.slow
def test_info_names_places_and_forces_as_they_were_given(tmp_path):
    places = dict(
        node=np.repeat([10, 20], 3), direction=[*"xyz"] * 2, label=["root"] * 3 + ["tip"] * 3
    )
    loads = np.array([1.0, 2.0])
    rub = sh.Friction(
        tangential=[("tip:x",), ("root:x",)],
        contact_stiffness=1e3 * loads,
        friction_coefficient=0.3,
        normal_load=loads,
    )
    unit = np.eye(6)
    model = sh.Model(unit, unit, 1e4 * unit, places=places, contacts={"rub": rub})
    force = sh.forces.HarmonicForce(cosine={1: {"tip:z": 20.0, "root:z": 1.0}}, amplitude=1.5)
    path = sh.save(sh.frf(sh.HarmonicBalance(model, force), (10, 30)), tmp_path / "blade.nc")
    said = told(path)
    assert said["excitation"].endswith("at most 30 N at tip:z")
    assert ", tip:z, smooth" in said["highest peak"]
    assert said["contact_stiffness"] == (
        "1000 to 2000 N m-1, differing between contacts (mean 1500)"
    )
    point = sh.forces.PointForce("tip:z", 2.0)
    path = sh.save(sh.solve(sh.HarmonicBalance(model, point), 12.0), tmp_path / "point.nc")
    assert told(path)["excitation"] == "point force on tip:z"


def test_sweeps_over_chosen_values_are_responses(tmp_path):
    """Whatever their dimension is called: what was drawn has samples."""
    loads = xr.DataArray([[0.5] * 5, [1.0] * 5, [1, 2, 3, 4, 5]], dims=("preload", "contact"))
    path = tmp_path / "loads.nc"
    sh.frf(RING, (150, 250), over={"normal_load": loads}, archive=path, progress=False)
    code, said, _ = run("plot", path)
    assert code == 0
    assert said.strip().endswith("response.png")
    assert samples_of(sh.load(path)) is None
    assert samples_of(dataset("grid")) == "sample"
