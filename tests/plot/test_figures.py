"""Pictures are saved alike: text as text, the same bytes each time, and no file is huge."""

import re
import subprocess
import sys

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from studies import fig03_single_blade as fig03


@pytest.fixture(scope="module")
def response():
    return sh.frf(fig03.problem(), (10, 30), over={"normal_load": [1, 3]}, progress=False)


CODE = """
import matplotlib; matplotlib.use("Agg")
import sys
import symhbm as sh
from studies import fig03_single_blade as fig03
one = sh.frf(fig03.problem(), (10, 30), over={"normal_load": [1, 3]}, progress=False)
for kind in sh.plot.FORMATS:
    sh.plot.response(one).savefig(f"{sys.argv[1]}.{kind}")
"""


@pytest.mark.slow
@pytest.mark.parametrize("process", ["this", pytest.param("another", marks=pytest.mark.slow)])
def test_the_same_picture_is_the_same_file(process, response, tmp_path):
    if process == "another":
        subprocess.run([sys.executable, "-c", CODE, str(tmp_path / "first")], check=True)
    for kind in sh.plot.FORMATS:
        first, second = (tmp_path / f"{name}.{kind}" for name in ("first", "second"))
        for path in (first, second) if process == "this" else (second,):
            sh.plot.response(response).savefig(path)
        assert first.read_bytes() == second.read_bytes()
        assert b"Date>" not in first.read_bytes()
        assert b"/CreationDate" not in first.read_bytes()


def test_dots_and_options_of_the_caller(response, tmp_path):
    figure = sh.plot.response(response)
    width, height = figure.get_size_inches()
    figure.savefig(tmp_path / "sharp.png")
    assert plt.imread(tmp_path / "sharp.png").shape[:2] == (round(200 * height), 200 * width)
    figure.savefig(tmp_path / "rough.png", dpi=50)
    assert plt.imread(tmp_path / "rough.png").shape[1] == 50 * width
    figure.savefig(tmp_path / "named.svg", metadata={"Title": "twelve loads"})
    assert "twelve loads" in (tmp_path / "named.svg").read_text()


@pytest.mark.slow
def test_large_ensembles_are_pixels_in_small_files(tmp_path):
    """200 curves of 601 points each are 280,000 points as they are drawn, 1.9 MB as lines."""
    value = np.linspace(10, 30, 601)
    waves = 1e-3 * (2 + np.sin(value * np.linspace(1, 5, 200)[:, None]))
    many = xr.Dataset(
        {"amplitude": (("sample", "frequency", "dof"), waves[..., None])},
        {"frequency": value},
    )
    figure = sh.plot.response(many)
    assert all(line.get_rasterized() for line in figure.axes[0].lines)
    for kind in ("svg", "pdf"):
        path = sh.plot.save(figure, tmp_path / f"many.{kind}")
        assert path.stat().st_size < 700_000
    text = (tmp_path / "many.svg").read_text()
    assert text.count("<image") == 1
    assert "largest response [dB re 1 m]" in "".join(
        re.findall(r">([^<>]+)</(?:text|tspan)>", text)
    )
    few = sh.plot.response(many.isel(sample=slice(5)))
    assert not any(line.get_rasterized() for line in few.axes[0].lines)


def test_figures_of_others_are_saved_alike(response, tmp_path):
    figure, ax = plt.subplots()
    sh.plot.response(response, ax=ax)
    path = sh.plot.save(figure, tmp_path / "own.svg")
    assert path == tmp_path / "own.svg"
    assert "<text" in path.read_text()
    for wrong, error, words in (
        ("x.gif", ValueError, r"path='x.gif': expected a name ending in .png, .svg, .pdf"),
        ("no/x.png", ValueError, "path=.no.x.png.: .* in an existing dir"),
        ("x", ValueError, "path='x'"),
        (3, TypeError, "path=3"),
    ):
        with pytest.raises(error, match=words):
            sh.plot.save(figure, wrong)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="expected a figure"):
        sh.plot.save(ax, "x.png")  # type: ignore[arg-type]


def test_panels_are_closed_on_errors_and_in_notebooks(monkeypatch):
    with pytest.raises(ZeroDivisionError), sh.plot.panels():
        raise ZeroDivisionError
    assert plt.get_fignums() == []
    with sh.plot.panels(2, 1, sharex=True) as (figure, axes):
        assert len(axes) == 2
    assert plt.get_fignums() == [figure.number]  # type: ignore[attr-defined]
    plt.close("all")
    monkeypatch.setattr(mpl, "get_backend", lambda: "module://matplotlib_inline.backend_inline")
    with sh.plot.panels(0) as (figure, axes):
        assert axes is None
    assert plt.get_fignums() == []
