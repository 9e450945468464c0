"""What pages hold, without a browser: names of files, sizes, thinning, and what sets are shown."""

import json
import re
import sys
from functools import cache

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import symhbm as sh
from symhbm.cli import main
from symhbm.plot.viewer.packing import number, packed, plain, thinned
from symhbm.plot.viewer.page import embedded
from symhbm.plot.viewer.sets import MOST_CURVES, sets_of
from tests.pages import data_of, texts_of, unpacked
from tests.problems import one_blade, ring_of_blades

BLADE = one_blade()
PROBLEM = sh.HarmonicBalance(BLADE, sh.forces.PointForce(), harmonics=(1, 3))


@cache
def response():
    return sh.frf(PROBLEM, (10, 30), over={"normal_load": [1, 3]}, progress=False)


def test_names_of_files(tmp_path):
    for bad in ("blade.nc", "blade", "missing/blade.html"):
        with pytest.raises(ValueError, match=r"expected a name ending in \.html"):
            sh.view(response(), tmp_path / bad)
    with pytest.raises(TypeError, match="path=3"):
        sh.view(response(), 3)
    with pytest.raises(TypeError, match="result="):
        sh.view("blade.nc", tmp_path / "blade.html")
    with pytest.raises(TypeError, match="tuned="):
        sh.view(response(), tmp_path / "blade.html", tuned=PROBLEM)
    assert [*tmp_path.iterdir()] == []
    first = sh.view(response(), tmp_path / "blade.html", tuned=response())
    assert any("tuned structure is not shown" in line for line in texts_of(first))
    assert sh.view(response(), first) == first
    assert first.stat().st_size < 6e6


def test_without_plotly_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly.offline", None)
    with pytest.raises(ImportError, match=re.escape("pip install 'symhbm[view]'")):
        sh.view(response(), tmp_path / "blade.html")
    archive = sh.save(response(), tmp_path / "blade.nc")
    done = CliRunner().invoke(main, ["view", str(archive)])
    assert done.exit_code == 2
    assert "symhbm[view]" in done.stderr
    assert done.stderr.count("\n") == 1


def test_the_command(tmp_path):
    archive = sh.save(response(), tmp_path / "blade.nc")
    done = CliRunner().invoke(main, ["view", str(archive), "--select", "normal_load=3"])
    assert (done.exit_code, done.stdout.strip()) == (0, str(tmp_path / "blade.html"))
    data = data_of(tmp_path / "blade.html")
    assert data["dims"] == [{"name": "normal load", "units": "N", "labels": ["3"]}]
    done = CliRunner().invoke(main, ["view", str(archive), "--output", str(archive)])
    assert done.exit_code == 2
    assert ".html" in done.stderr
    assert sh.load(archive).identical(response())


def test_points_are_those_of_the_archive_bit_by_bit(tmp_path):
    data = data_of(sh.view(response(), tmp_path / "blade.html"))
    for k, curve in enumerate(data["curves"]):
        one = response().isel(normal_load=k)
        n_points = int(one.n_points)
        assert curve["n"] == [n_points, n_points]
        np.testing.assert_array_equal(unpacked(curve["x"]), one.frequency.values[:n_points])
        column = unpacked(curve["columns"]["amplitude:0"])
        np.testing.assert_array_equal(column, one.amplitude.values[:n_points, 0])
        state = unpacked(curve["states"])
        np.testing.assert_array_equal(state, one.contact_state.values[:n_points, 0])
        for mark in curve["marks"]:
            at = one[f"{mark['what']}_frequency"].values[mark["number"]]
            assert mark["x"] == at == unpacked(curve["x"])[mark["point"]]


def test_thinning_keeps_what_it_must_and_stays_close():
    value = np.linspace(0, 1, 2000)
    level = (40 * np.exp(-(((value - 0.4) / 0.01) ** 2)) + np.sin(9 * value))[:, None]
    kept = np.zeros(2000, dtype=bool)
    kept[[17, 1500]] = True
    for most in (60, 200, 1000):
        points = thinned(value, level, kept, most)
        assert len(points) <= most
        assert {0, 17, 1500, 1999} <= {*points}
        drawn = np.interp(value, value[points], level[points, 0])
        assert np.abs(drawn - level[:, 0]).max() < 100 / most
    close = thinned(value, level, kept, 5000, tolerance=0.01)
    drawn = np.interp(value, value[close], level[close, 0])
    assert np.abs(drawn - level[:, 0]).max() < 0.02
    assert len(close) < 500
    np.testing.assert_array_equal(thinned(value, level, kept, 2000), np.arange(2000))
    gaps = level.copy()
    gaps[900] = np.nan
    assert {899, 900, 901} <= {*thinned(value, gaps, kept, 100)}
    assert thinned(value[:0], level[:0], kept[:0], 10).size == 0
    all_kept = thinned(value, level, np.ones(2000, dtype=bool), 10)
    assert len(all_kept) == 2000


def test_long_curves_are_thinned_around_their_peaks_and_events(tmp_path, monkeypatch):
    monkeypatch.setattr("symhbm.plot.viewer.collected._VALUES", 1)
    dense = sh.frf(PROBLEM, (10, 30), at=np.linspace(10, 30, 400), progress=False)
    path = sh.view(dense, tmp_path / "dense.html")
    (curve,) = data_of(path)["curves"]
    assert curve["n"][1] == 400
    assert curve["n"][0] <= 60 + 2 * len(curve["marks"])
    assert f"{curve['n'][0]} of 400 points" in path.read_text(encoding="utf-8")
    row = unpacked(curve["row"])
    np.testing.assert_array_equal(unpacked(curve["x"]), dense.frequency.values[row])
    state = dense.contact_state.values[:, 0]
    changes = np.flatnonzero(state[1:] != state[:-1])
    assert {*changes, *(changes + 1)} <= {*row}


def test_of_many_sets_the_extremes_are_shown():
    sizes = (40, 7)
    tops = np.random.default_rng(1).uniform(1, 2, (*sizes, 1))
    tops[33, 2], tops[21, 6] = 9.0, 0.1
    status = np.full(sizes, str(sh.Status.REACHED_END), dtype=object)
    many = xr.Dataset(
        {
            "peak_amplitude": (("sample", "load", "peak"), tops),
            "status": (("sample", "load"), status),
        }
    )
    sets = sets_of(many)
    assert sets.dims == ("sample", "load")
    assert sets.total == 280
    assert sets.n_shown == len([*sets.positions()]) <= MOST_CURVES
    assert 33 in sets.shown[0]
    assert sets.shown[1] == tuple(range(7))
    assert sets_of(many.isel(sample=slice(17))).n_shown == 119


@pytest.mark.slow
def test_a_page_never_has_more_than_it_may(tmp_path, monkeypatch):
    disk = ring_of_blades(5, contact_stiffness=1e6, normal_load=10)
    orders = {"engine_order": [1, 2], "normal_load": [5, 10, 20]}
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(1))
    disks = sh.frf(problem.with_by_sector(False), (100, 300), over=orders, progress=False)
    whole = sh.view(disks, tmp_path / "whole.html").stat().st_size
    module = sys.modules["symhbm.plot.viewer.view"]
    monkeypatch.setattr(module, "MOST_BYTES", whole - 1000)
    monkeypatch.setattr("symhbm.plot.viewer.sets.MOST_CURVES", 8)
    path = sh.view(disks, tmp_path / "less.html")
    assert path.stat().st_size < whole - 1000
    assert len(data_of(path)["curves"]) == 2
    assert "2 of 6 curves are shown one by one" in path.read_text(encoding="utf-8")
    monkeypatch.setattr(module, "MOST_BYTES", 1_000_000)
    with pytest.raises(ValueError, match="expected at most 1; select fewer"):
        sh.view(disks, path)
    assert len(data_of(path)["curves"]) == 2


def test_texts_and_numbers():
    assert number(19.39691496531) == "19.396915"
    assert number(np.float64(1.0062841e-05)) == "1.0062841e-05"
    assert plain("a\n\x00b\u202e" + "x" * 500, 10) == "a b xxxxxx ..."
    text = embedded({"a": "</script><!-- & \u2028"})
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == {"a": "</script><!-- & \u2028"}
    with pytest.raises(ValueError, match="JSON"):
        embedded(float("nan"))
    values = np.array([1.5, np.nan, np.inf])
    np.testing.assert_array_equal(unpacked(packed(values)), values)


def test_lazy_archives_are_left_as_they_are(tmp_path):
    path = sh.save(response(), tmp_path / "blade.nc")
    with sh.load(path, lazy=True) as lazy:
        sh.view(lazy, tmp_path / "blade.html")
        assert not lazy["amplitude"].variable._in_memory


def test_two_results_are_over_the_same_axes(tmp_path):
    stiffer = sh.frf(PROBLEM.with_parameters(stiffness=1.2e4), (10, 30), progress=False)
    page = sh.view({"as built": response(), "stiffer": stiffer}, tmp_path / "two.html")
    data, text = data_of(page), page.read_text(encoding="utf-8")
    [menu] = data["dims"]
    assert menu["labels"] == [*(f"as built: normal load = {n} N" for n in (1, 3)), "stiffer"]
    for entry, one in zip(data["curves"], [*response().normal_load.values, None], strict=True):
        result = stiffer if one is None else response().sel(normal_load=one)
        known = np.isfinite(result.frequency.values)
        np.testing.assert_array_equal(unpacked(entry["x"]), result.frequency.values[known])
    assert "stiffness: 10000 N m-1 or 12000 N m-1" in text
    # Buttons of the second table of peaks lead to the third curve.
    assert re.findall(r"data-curve=\"(\d)\"", text)[-1] == "2"
    for heading in ("<h3>as built</h3>", "<h3>stiffer</h3>"):
        assert heading in text
    followed = sh.follow(PROBLEM, "normal_load", (1, 6), frequency=19.0, progress=False)
    with pytest.raises(ValueError, match="curves over the same parameter"):
        sh.view({"a": response(), "b": followed}, tmp_path / "none.html")
    with pytest.raises(ValueError, match="at least one"):
        sh.view({}, tmp_path / "none.html")


def test_the_command_takes_several_archives(tmp_path):
    paths = [sh.save(response().isel(normal_load=k), tmp_path / f"{k}.nc") for k in (0, 1)]
    arguments = ["view", *map(str, paths), "--label", "one", "--label", "two"]
    assert CliRunner().invoke(main, arguments).exit_code == 0
    assert data_of(tmp_path / "0.html")["dims"][0]["labels"] == ["one", "two"]


def test_measured_points_stand_on_the_curve_of_their_parameters(tmp_path):
    problem = sh.HarmonicBalance(one_blade(), sh.forces.PointForce())
    response = sh.frf(problem, (14, 20), over={"force_amplitude": [1, 2]}, progress=False)
    data = sh.datasets.measured([15, 17], [[3e-4, 4e-4j]], units="m", force_amplitude=[[2.0]])
    first, second = data_of(sh.view(response.assign(data.variables), tmp_path / "fit.html"))[
        "curves"
    ]
    assert first["measured"] == {}
    points = second["measured"]["amplitude:0"]
    np.testing.assert_allclose(unpacked(points["x"]), [15, 17])
    np.testing.assert_allclose(unpacked(points["y"]), [3e-4, 4e-4])
    modes = sh.nonlinear_modes(problem, progress=False)
    data = sh.datasets.measured([18.0], [0.1], units="mm", form="mode", amplitude=0.4)
    [curve] = data_of(sh.view(modes.assign(data.variables), tmp_path / "mode.html"))["curves"]
    for panel, value in (("frequency", 18.0), ("damping_ratio", 0.1)):
        points = curve["measured"][f"{panel}:0"]
        np.testing.assert_allclose(unpacked(points["x"]), 4e-4)
        np.testing.assert_allclose(unpacked(points["y"]), value)
