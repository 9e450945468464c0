"""Each study runs as documented and meets its landmark."""

import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import pytest

mpl.use("Agg")

import symhbm as sh
from studies import fig03_single_blade, fig08_engine_orders, harmonic_convergence
from studies.run import run

ROOT = Path(__file__).parent.parent


@pytest.mark.parametrize("study", [fig03_single_blade, fig08_engine_orders, harmonic_convergence])
def test_study_leaves_an_archive_and_a_picture(study, tmp_path, capsys):
    archive, picture = run(study.NAME, study.compute, study.draw, results=tmp_path)
    assert capsys.readouterr().out.split() == [str(archive), str(picture)]
    assert picture.stat().st_size > 10_000
    assert sh.load(archive).attrs["references"]


def test_landmarks_of_figure_3():
    """Peaks in dB re 1 m of the source's Fig. 3; 0.5, 1, 2, 3, 5, 18 N (data/reference)."""
    dataset = fig03_single_blade.compute(progress=False)
    published = {0.5: -37.3008, 1: -42.6733, 2: -67.3431, 3: -70.2151, 5: -68.8598, 18: -60.1788}
    import numpy as np

    for load, level in published.items():
        peak = dataset.sel(normal_load=load).peak_amplitude
        # Digits as given.
        assert float(20 * np.log10(peak[0])) == pytest.approx(level, abs=5e-5)


def test_studies_run_from_the_command_line(tmp_path):
    """The documented command, on one study."""
    done = subprocess.run(
        [sys.executable, "-m", "studies.fig03_single_blade"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    paths = [Path(line) for line in done.stdout.split()]
    assert [path.suffix for path in paths] == [".nc", ".png"]
    assert all(path.exists() for path in paths)
