"""Factors as a sweep: values by contact that stay in ratio, with a label of their own."""

import numpy as np
import pytest

import symhbm as sh
from tests.archives import run
from tests.problems import ring_of_blades

LOADS = np.array([4.0, 5.0, 6.0])
PROBLEM = sh.HarmonicBalance(ring_of_blades(3, normal_load=LOADS), sh.forces.EngineOrder(1))


@pytest.fixture(scope="module")
def sweep():
    over = {"normal_load": sh.scale([0.5, 1, 2])}
    return sh.frf(PROBLEM, (10, 40), over=over, progress=False)


def test_each_set_has_its_multiple_of_all_values(sweep):
    assert sweep.normal_load.dims == ("normal_load_factor", "contact")
    for factor in (0.5, 1.0, 2.0):
        one = sweep.sel(normal_load_factor=factor)
        np.testing.assert_array_equal(one.normal_load, factor * LOADS)
        alone = sh.frf(
            PROBLEM.with_parameters(normal_load=factor * LOADS), (10, 40), progress=False
        )
        np.testing.assert_array_equal(
            one.peak_amplitude.dropna("peak"), alone.peak_amplitude.dropna("peak")
        )


def test_the_factor_is_told_in_pictures_tables_and_archives(sweep, tmp_path):
    path = sh.save(sweep, tmp_path / "loads.nc")
    loaded = sh.load(path)
    np.testing.assert_array_equal(loaded.normal_load_factor, [0.5, 1, 2])
    labels = [t.get_text() for t in sh.plot.response(loaded).axes[0].get_legend().get_texts()]
    assert labels == [f"normal load factor = {factor}" for factor in ("0.5", "1", "2")]
    assert sh.datasets.table(sweep, "peaks")["normal_load_factor"].iloc[-1] == 2
    code, out, _ = run("info", path)
    assert code == 0
    assert "normal_load_factor" in out
    code, out, _ = run("export", path, "--select", "normal_load_factor=2", "--table", "sets")
    assert out.splitlines()[0].startswith("normal_load_factor,")


def test_groups_are_scaled_apart_or_together():
    def group(load):
        return sh.Contacts(
            sh.laws.Coulomb(), [(0,), (1,)], contact_stiffness=1e4, friction_coefficient=0.5,
            normal_load=load,
        )  # fmt: skip

    model = sh.Model(
        np.eye(2), np.eye(2), [[2e4, -1e4], [-1e4, 2e4]],
        contacts={"shroud": group([1.0, 2.0]), "root": group([3.0, 4.0])},
    )  # fmt: skip
    problem = sh.HarmonicBalance(model, sh.forces.PointForce())
    names = "shroud.normal_load", "root.normal_load"
    options = dict(at=[15.0, 20.0], progress=False)
    apart = sh.frf(problem, (10, 30), over={n: sh.scale([1, 2]) for n in names}, **options)
    assert apart.status.dims == ("shroud.normal_load_factor", "root.normal_load_factor")
    over = {n: sh.scale([1, 2], "tightening") for n in names}
    together = sh.frf(problem, (10, 30), over=over, **options)
    assert together.status.dims == ("tightening",)
    np.testing.assert_array_equal(together["root.normal_load"].sel(tightening=2), [6.0, 8.0])


@pytest.mark.parametrize(
    ("factors", "error"),
    [([], ValueError), (2.0, ValueError), (["a"], TypeError), ([np.nan], ValueError)],
)
def test_factors_that_are_none(factors, error):
    with pytest.raises(error, match="factors"):
        sh.scale(factors)
    with pytest.raises(ValueError, match="normal_load"):
        sh.frf(PROBLEM, (10, 40), over={"normal_load": sh.scale([-1.0])})
