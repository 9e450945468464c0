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


@pytest.fixture(scope="module")
def ensemble():
    drawn = sh.mistuning.uniform(PROBLEM, 3, seed=1, normal_load=0.3)
    return sh.frf(PROBLEM, (10, 40), over=drawn, progress=False)


def by_xarray(variable, dims):
    """Values that are no padding, in the order of the dimensions."""
    values = variable.transpose(*dims).values.ravel()
    return values[np.isfinite(values)]


def test_peaks_and_events_of_a_sweep(sweep):
    peaks = sh.datasets.table(sweep, "peaks")
    assert len(peaks) == int(sweep.n_peaks.sum())
    for name in ("peak_frequency", "peak_amplitude"):
        np.testing.assert_array_equal(peaks[name], by_xarray(sweep[name], ("normal_load", "peak")))
    for load, of_load in peaks.groupby("normal_load"):
        assert len(of_load) == sweep.n_peaks.sel(normal_load=load)
        assert of_load["peak"].tolist() == list(range(len(of_load)))
    events = sh.datasets.table(sweep, "events")
    assert len(events) == int(sweep.n_events.sum()) > 0
    assert events["event_kind"].isin(["onset of slip", "end of slip"]).all()


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


def test_fourier_coefficients_are_asked_for(sweep):
    assert not [name for name in sh.datasets.table(sweep) if name.startswith("coefficient")]
    named = sh.datasets.table(sweep, variables=["coefficient"])
    cosine = sweep.coefficient.sel(dof=2, harmonic=1, component="cos")
    expected = by_xarray(cosine, ("normal_load", "point"))
    np.testing.assert_array_equal(named["coefficient_dof2_h1_cos"], expected)
    assert len([*sh.datasets.table(sweep, variables=["all"])]) > len([*named])


def test_units_and_meanings_of_all_columns(sweep):
    for kind in ("points", "peaks", "events", "sets"):
        table = sh.datasets.table(sweep, kind)
        assert table.attrs["units"].keys() == table.attrs["long_name"].keys() == {*table.columns}
    units = sh.datasets.table(sweep).attrs["units"]
    assert (units["amplitude_0"], units["frequency"], units["normal_load"]) == ("m", "Hz", "N")


def test_sets_of_an_ensemble(ensemble):
    sets = sh.datasets.table(ensemble, "sets")
    assert sets["sample"].tolist() == [0, 1, 2]
    assert sets["n_peaks"].tolist() == ensemble.n_peaks.values.tolist()
    assert sets["status"].tolist() == ["the end of the band was reached"] * 3
    peaks = sh.datasets.table(ensemble, "peaks")
    largest = peaks.groupby("sample")["peak_amplitude"].max()
    np.testing.assert_array_equal(largest, ensemble.peak_amplitude.max("peak"))


def test_archives_are_read_part_by_part(sweep, tmp_path, monkeypatch):
    sh.save(sweep, tmp_path / "sweep.nc")
    with sh.load(tmp_path / "sweep.nc", lazy=True) as archive:
        monkeypatch.setattr("symhbm.results.reading.blockwise._LARGEST_BLOCK", 7)
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


def test_one_point_and_a_motion():
    point = sh.solve(PROBLEM, 20.0)
    row = sh.datasets.table(point, each="dof")
    np.testing.assert_array_equal(row["amplitude"], point.amplitude)
    motion = sh.periodic_motion(PROBLEM, 20.0)
    table = sh.datasets.table(motion)
    assert len(table) == motion.sizes["angle"]
    np.testing.assert_array_equal(table["displacement_1"], motion.displacement.isel(dof=1))


BAD = {
    "result": (TypeError, "result=3", lambda ds: sh.datasets.table(3)),
    "kind": (ValueError, "kind='rows'", lambda ds: sh.datasets.table(ds, "rows")),
    "each": (ValueError, "each='blade'", lambda ds: sh.datasets.table(ds, each="blade")),
    "unknown": (KeyError, "amplitud", lambda ds: sh.datasets.table(ds, variables=["amplitud"])),
    "text": (
        TypeError,
        "variables='amplitude'",
        lambda ds: sh.datasets.table(ds, variables="amplitude"),
    ),
    "misfit": (
        ValueError,
        "variable 'peak_dof'",
        lambda ds: sh.datasets.table(ds, variables=["peak_dof"]),
    ),
    "missing": (
        ValueError,
        "table of peaks: the archive has no peaks",
        lambda ds: sh.datasets.table(ds.drop_dims("peak"), "peaks"),
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_arguments(sweep, name):
    error, words, call = BAD[name]
    with pytest.raises(error, match=words):
        call(sweep)
