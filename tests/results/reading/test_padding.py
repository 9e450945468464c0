"""Results without the padding that their longest curve does not need."""

import numpy as np
import pytest

import symhbm as sh
from tests.problems import ring_of_blades

DISK = ring_of_blades(3, normal_load=1)  # fmt: skip
PROBLEM = sh.HarmonicBalance(DISK, sh.forces.EngineOrder(1))
LOADS = [0.0, 2.0, 50.0]


@pytest.fixture(scope="module")
def sweep():
    return sh.frf(PROBLEM, (10, 40), over={"normal_load": LOADS}, progress=False)


def test_what_needs_all_stays_as_it_is(sweep):
    assert sh.datasets.trimmed(sweep).identical(sweep)


@pytest.mark.parametrize("load", LOADS)
def test_one_curve_has_its_own_values_and_nothing_else(sweep, load):
    chosen = sweep.sel(normal_load=load)
    found = sh.datasets.trimmed(chosen)
    for dim in ("point", "peak", "event"):
        assert found.sizes[dim] == chosen[f"n_{dim}s"].item()
    assert np.isfinite(found.amplitude).all()
    assert (found.peak_kind != "").all()
    single = sh.frf(PROBLEM.with_parameters(normal_load=load), (10, 40), progress=False)
    assert found.sizes["point"] == single.sizes["point"]


def test_several_curves_keep_the_longest(sweep):
    two = sweep.isel(normal_load=[0, 1])
    assert sh.datasets.trimmed(two).sizes["point"] == two.n_points.max()
    assert sh.datasets.trimmed(two).sizes["event"] == two.n_events.max()


def test_several_solutions_at_a_value():
    chosen = sh.frf(PROBLEM, (10, 40), at=[15.0, 20.0], progress=False)
    assert sh.datasets.trimmed(chosen).sizes == chosen.sizes


def test_trimmed_results_are_results(sweep, tmp_path):
    found = sh.datasets.trimmed(sweep.sel(normal_load=2.0))
    sh.save(found, tmp_path / "one.nc")
    checked = sh.verify(sh.load(tmp_path / "one.nc"), progress=False)
    assert checked.residual_stored.max() < 1e-9
    assert sh.datasets.trimmed(sh.solve(PROBLEM, 20.0)).sizes == sh.solve(PROBLEM, 20.0).sizes


def test_archives_that_are_opened_lazily(sweep, tmp_path):
    sh.save(sweep, tmp_path / "sweep.nc")
    with sh.load(tmp_path / "sweep.nc", lazy=True) as archive:
        found = sh.datasets.trimmed(archive.sel(normal_load=0.0))
        assert not found["coefficient"].variable._in_memory
        assert found.sizes["event"] == 0
