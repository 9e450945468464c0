"""One point of each curve: at its peaks, at its largest response, nearest to a value."""

import numpy as np
import pytest

import symhbm as sh
from tests.problems import one_blade, ring_of_blades

BLADE = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(), (1, 3))
LOADS = [1.0, 3.0, 6.0]


@pytest.fixture(scope="module")
def paths():
    return sh.frf(BLADE, (10, 30), over={"normal_load": LOADS}, progress=False)


@pytest.fixture(scope="module")
def grid():
    values = np.linspace(10, 30, 21)
    return sh.frf(BLADE, (10, 30), at=values, over={"normal_load": LOADS}, progress=False)


def test_peaks_of_paths_have_all_that_is_known_of_their_points(paths):
    tops = sh.datasets.at(paths, "peak")
    np.testing.assert_array_equal(tops.frequency, paths.peak_frequency.isel(peak=0))
    for name in ("dissipation", "contact_state", "stick_fraction", "amplitude"):
        assert tops[name].dims[0] == "normal_load"
        for load in LOADS:
            one, of = paths.sel(normal_load=load), tops[name].sel(normal_load=load)
            hertz = tops.frequency.sel(normal_load=load).item()
            row = np.flatnonzero(one.frequency.values == hertz)
            np.testing.assert_array_equal(one[name].values[row[0]], of)
    assert set(tops.chosen.values) == {"peak"}
    one = sh.datasets.at(paths.sel(normal_load=3.0), 0)
    assert one.chosen.item() == "peak 0"
    assert one.dissipation.item() == tops.dissipation.sel(normal_load=3.0).item()


def test_peaks_between_the_values_of_a_grid_are_solved_again_to_the_same_motion(grid):
    tops = sh.datasets.at(grid, "peak")
    assert "dissipation" not in tops
    for load in LOADS:
        one = tops.sel(normal_load=load)
        again = sh.solve(BLADE.with_parameters(normal_load=load), one.frequency.item())
        np.testing.assert_allclose(one.coefficient, again.coefficient, rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(one.amplitude, again.amplitude, rtol=1e-8)


def test_values_and_largest_responses(grid):
    near = sh.datasets.at(grid, 18.8)
    np.testing.assert_array_equal(near.frequency, 19.0)
    np.testing.assert_array_equal(near.dissipation, grid.dissipation.sel(frequency=19.0))
    largest = sh.datasets.at(grid, "largest")
    expected = grid.frequency[grid.amplitude.isel(dof=0).argmax("frequency")]
    np.testing.assert_array_equal(largest.frequency, expected)
    edge = grid.sel(frequency=slice(10, 12)).isel(peak=slice(0))
    assert (sh.datasets.at(edge).frequency == 12).all()
    assert set(sh.datasets.at(edge).chosen.values) == {"largest point"}


def test_curves_without_such_a_point_are_blank(paths):
    peaks = paths.peak_amplitude.copy()
    peaks[1] = np.nan
    tops = sh.datasets.at(paths.assign(peak_amplitude=peaks), "peak")
    assert tops.chosen.values.tolist() == ["peak", "", "peak"]
    assert np.isnan(tops.frequency.values).tolist() == [False, True, False]
    assert tops.contact_state.values[:, 0].tolist() == [1, -1, 1]
    figure = sh.plot.hysteresis(paths.assign(peak_amplitude=peaks), at="peak")
    assert figure.axes[0].get_title() == "peak of each curve, 1 of 3 have none"


def test_tables_and_motions_take_a_point_of_each_curve(paths):
    tops = sh.datasets.at(paths, "peak")
    table = sh.datasets.table(paths, at="peak")
    np.testing.assert_array_equal(table["dissipation_0"], tops.dissipation.isel(contact=0))
    motion = sh.datasets.motion(paths, at="peak")
    expected = sh.datasets.motion(paths, "peaks").phase_lag.isel(peak=0)
    np.testing.assert_allclose(motion.phase_lag, expected, rtol=1e-12)


def test_titles_of_tables_tell_units_and_places():
    places = dict(node=[7, 9], direction="z", label=["tip", "root"])
    pair = sh.Model(np.eye(2), np.eye(2), [[2e4, -1e4], [-1e4, 1.5e4]], places=sh.Places(**places))
    result = sh.frf(sh.HarmonicBalance(pair, sh.forces.PointForce("tip:z")), (5, 40))
    peaks = sh.datasets.table(result, "peaks")
    assert {*peaks["peak_place"]} == {"tip:z", "root:z"}
    names = np.array(["tip:z", "root:z"])
    assert peaks["peak_place"].tolist() == names[peaks["peak_dof"]].tolist()
    points = sh.datasets.table(result)
    np.testing.assert_array_equal(points["amplitude_root:z"], result.amplitude.isel(dof=1))
    titles = {"frequency": "f", "amplitude_tip:z": "tip"}
    short = sh.datasets.table(result, columns=titles, units=True)
    assert [*short] == ["f [Hz]", "tip [m]"]
    assert short.attrs["units"] == {"f [Hz]": "Hz", "tip [m]": "m"}
    coefficients = sh.datasets.table(result, variables=["coefficient"])
    assert "coefficient_tip:z_h1_cos" in coefficients


def test_peaks_of_every_blade_are_chosen_by_their_height():
    loads = np.random.default_rng(3).uniform(3, 7, 5)
    ring = sh.HarmonicBalance(ring_of_blades(5, normal_load=loads), sh.forces.EngineOrder(2))
    result = sh.frf(ring, (10, 60), peaks="each", progress=False)
    top = sh.datasets.at(result, "peak")
    best = int(np.nanargmax(result.peak_amplitude))
    assert top.frequency.item() == result.peak_frequency[best].item()
    np.testing.assert_allclose(top.amplitude.max(), result.peak_amplitude.max(), rtol=1e-9)
