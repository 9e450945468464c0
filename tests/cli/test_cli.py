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
from symhbm.plot.viewer.ensemble import samples_of
from symhbm.results.reading import blocks
from tests.archives import interrupt, run
from tests.problems import BLADE as VALUES
from tests.problems import duffing

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


def interrupted(target, at=GRID, **options):
    """A run of three curves that was stopped after two of them."""
    over = {"normal_load": LOADS}
    interrupt(2, sh.frf, RING, (150, 250), at=at, over=over, archive=target, **options)
    return target.with_name("run.nc.partial")


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


def test_info_of_what_was_made_by_hand(tmp_path):
    ds = dataset("grid")
    mean = ds[["amplitude"]].mean("sample", keep_attrs=True)
    mean["share"] = ("frequency", np.where(ds.frequency < 160, np.nan, 0.5))
    mean.attrs = {"title": "A mean", "symhbm_schema": 1, "note": "by hand"}
    said = told(sh.save(mean, tmp_path / "mean.nc"))
    assert (said["title"], said["note"]) == ("A mean", "by hand")
    missing = int((ds.frequency < 160).sum())
    assert said["share"] == f"along frequency, 0.5 ({missing} of 41 are NaN)"


@given(st.lists(st.integers(1, 6), max_size=4), st.integers(1, 9), st.integers(1, 40))
def test_blocks_hold_every_row_once_and_in_order(shape, width, budget):
    array = np.arange(int(np.prod(shape))).reshape(shape)
    dims = [f"d{i}" for i in range(len(shape))]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("symhbm.results.reading.selection._LARGEST_BLOCK", budget)
        rows = []
        for block in blocks(dict(zip(dims, shape, strict=True)), dims, width):
            part = array[tuple(block.get(dim, slice(None)) for dim in dims)]
            assert part.size * width <= max(budget, width)
            rows += part.ravel().tolist()
    assert rows == list(range(array.size))


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
        (["plot", "{path}", "{grid}", "--kind", "states"], "states draws one, got 2"),
        (["plot", "{path}", "{grid}", "--label", "one"], "--label: expected 2"),
        (["plot", "{path}", "{grid}", "--label=one", "--label=one"], "expected different ones"),
        (["export", "{path}", "--at", "top"], "expected peak, largest"),
        (["export", "{path}", "--at", "9"], "no curve has it"),
        (["export", "{path}", "--at", "99.5"], "10 to 30"),
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
