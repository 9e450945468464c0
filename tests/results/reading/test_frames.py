"""Results as tables of pandas, beside what xarray makes of the same variables."""

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from tests.problems import ring_of_blades

DISK = ring_of_blades(3, normal_load=1)  # fmt: skip
PROBLEM = sh.HarmonicBalance(DISK, sh.forces.EngineOrder(1))
LOADS = [0.5, 2.0, 50.0]


@pytest.fixture(scope="module")
def sweep():
    return sh.frf(PROBLEM, (10, 40), over={"normal_load": LOADS}, progress=False)


def by_xarray(variable, dims):
    """Values that are no padding, in the order of the dimensions."""
    values = variable.transpose(*dims).values.ravel()
    return values[np.isfinite(values)]


def test_points_have_columns_beside_each_other_or_rows_of_each(sweep):
    wide, long = sh.datasets.table(sweep), sh.datasets.table(sweep, each="dof")
    assert len(wide) == int(sweep.n_points.sum())
    assert len(long) == 3 * len(wide)
    dims = "normal_load", "point", "dof"
    np.testing.assert_array_equal(long["amplitude"], by_xarray(sweep.amplitude, dims))
    found = wide[["amplitude_0", "amplitude_1", "amplitude_2"]].to_numpy().ravel()
    np.testing.assert_array_equal(found, long["amplitude"])
    assert long["dof"].tolist() == [0, 1, 2] * len(wide)
    np.testing.assert_array_equal(long["frequency"], np.repeat(wide["frequency"], 3))
    states = sh.datasets.table(sweep, each="contact", variables=["contact_state"])
    assert [*states] == ["normal_load", "point", "contact", "frequency", "contact_state"]
    assert not states["contact_state"].isin([-1]).any()


def test_units_and_meanings_of_all_columns(sweep):
    for kind in ("points", "peaks", "events", "sets"):
        table = sh.datasets.table(sweep, kind)
        assert table.attrs["units"].keys() == table.attrs["long_name"].keys() == {*table.columns}
    units = sh.datasets.table(sweep).attrs["units"]
    assert (units["amplitude_0"], units["frequency"], units["normal_load"]) == ("m", "Hz", "N")


def test_archives_are_read_part_by_part(sweep, tmp_path, monkeypatch):
    sh.save(sweep, tmp_path / "sweep.nc")
    with sh.load(tmp_path / "sweep.nc", lazy=True) as archive:
        monkeypatch.setattr("symhbm.results.reading.selection._LARGEST_BLOCK", 7)
        loaded = []
        load = xr.Dataset.load

        def tell(part, **options):
            loaded.append({*part.data_vars})
            return load(part, **options)

        monkeypatch.setattr(xr.Dataset, "load", tell)
        parts = sh.datasets.table(archive, "peaks", variables=["peak_amplitude"])
    assert len(loaded) > 1
    assert set.union(*loaded) <= {"peak_amplitude", "peak_frequency"}
    monkeypatch.undo()
    assert parts.equals(sh.datasets.table(sweep, "peaks", variables=["peak_amplitude"]))
