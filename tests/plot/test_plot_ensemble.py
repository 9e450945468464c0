"""Figures of ensembles: what is drawn is what is stored, and what is left out is told."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.continuation import Status
from tests.paper import level, texts
from tests.problems import duffing, ring_of_blades

GRID = np.linspace(60, 95, 29)


def problem():
    disk = ring_of_blades(5, contact_stiffness=1e5, normal_load=10)
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(2, amplitude=1.0))


def loads():
    values = np.random.default_rng(5).uniform(7, 13, (6, 5))
    return {"normal_load": xr.DataArray(values, dims=("sample", "contact"))}


@pytest.fixture(scope="module")
def ensemble():
    return sh.frf(problem(), (60, 95), at=GRID, over=loads())


@pytest.fixture(scope="module")
def paths():
    return sh.frf(problem(), (60, 95), over=loads())


def band(ax, number):
    """Lower and upper edge of a band at the grid."""
    vertices = ax.collections[number].get_paths()[0].vertices
    rows = [vertices[vertices[:, 0] == x][:, 1] for x in GRID]
    return np.array([row.min() for row in rows]), np.array([row.max() for row in rows])


@pytest.mark.parametrize("dof", [None, 3])
def test_bands_are_extremes_and_quantiles(ensemble, dof):
    figure = sh.plot.envelope(
        ensemble, place=dof, quantiles=(0.25, 0.75), samples=2, extremes=False
    )
    (ax,) = figure.axes
    shown = ensemble.amplitude.max("dof") if dof is None else ensemble.amplitude.isel(dof=dof)
    amplitude = shown.transpose("sample", "frequency").values
    np.testing.assert_array_equal(band(ax, 0), level([amplitude.min(0), amplitude.max(0)]))
    # Round-off of logarithms.
    expected = level(np.quantile(amplitude, [0.25, 0.75], axis=0))
    np.testing.assert_allclose(band(ax, 1), expected, rtol=1e-14)
    first, second, median = ax.lines
    np.testing.assert_array_equal([first.get_ydata(), second.get_ydata()], level(amplitude[:2]))
    np.testing.assert_allclose(median.get_ydata(), level(np.median(amplitude, axis=0)), rtol=1e-14)
    np.testing.assert_array_equal(median.get_xdata(), GRID)
    assert texts(ax) == [
        "smallest to largest of 6, on the grid",
        "25 to 75 %",
        "single samples",
        "median",
    ]


def test_failed_samples_are_left_out_and_counted(ensemble):
    amplitude = ensemble.amplitude.copy(deep=True)
    amplitude[1] = np.nan
    amplitude[3, 5:8] = np.nan
    amplitude[:, 20] = np.nan
    figure = sh.plot.envelope(ensemble.assign(amplitude=amplitude))
    (ax,) = figure.axes
    kept = amplitude.max("dof", skipna=False).values[[0, 2, 3, 4, 5]]
    median = ax.lines[0].get_ydata()
    assert np.isnan(median[20])
    others = np.arange(29) != 20
    np.testing.assert_allclose(median[others], level(np.nanmedian(kept[:, others], 0)), rtol=1e-14)
    # Three of one and one of each of five.
    assert texts(ax)[-1] == "left out, not converged:\n1 of 6 samples,\n8 points in 5 samples"


def test_samples_that_wait_are_not_called_failed(ensemble):
    waiting = ensemble.copy(deep=True)
    waiting["status"] = waiting.status.where(np.arange(6) < 4, str(Status.NOT_STARTED))
    for name in ("coefficient", "amplitude"):
        waiting[name][4:] = np.nan
    waiting["converged"][4:] = False
    drawn = texts(sh.plot.envelope(waiting).axes[0])
    assert drawn[-1] == "not computed yet:\n2 of 6 samples"
    assert drawn[0] == "smallest to largest of 4, on the grid"
    assert not any("converged" in text for text in drawn)


def test_paths_are_read_off_through_their_peaks(ensemble, paths):
    (ax,) = sh.plot.envelope(paths, samples=6, extremes=False).axes
    for number in range(6):
        value, drawn = (np.asarray(data) for data in ax.lines[number].get_data())
        exact = level(ensemble.amplitude.isel(sample=number).max("dof").values)
        error = np.abs(np.interp(GRID, value, drawn) - exact)
        # Paths tell the largest response within 1 %; straight lines join the values drawn.
        assert np.median(error) < 0.002
        assert error.max() < 0.1
        top = level(paths.peak_amplitude.isel(sample=number).max().values)
        # The grid of the figure misses the peak by half of 35 / 1200 Hz at most.
        assert top - 1e-3 < drawn.max() <= top + 1e-12
    assert len(texts(ax)) == 4


def test_paths_that_end_early(paths):
    """A path that ends in the middle, and one with a hole, are left out where they are missing."""
    amplitude, frequency = paths.amplitude.copy(deep=True), paths.frequency.values.copy()
    last = int(np.searchsorted(frequency[2], 75.0))
    frequency[2, last:] = np.nan
    amplitude[4, 6] = np.nan
    cut = paths.assign(amplitude=amplitude).assign_coords(
        frequency=(("sample", "point"), frequency)
    )
    cut = cut.drop_vars("peak_frequency")
    (ax,) = sh.plot.envelope(cut, samples=6).axes
    value = np.asarray(ax.lines[0].get_xdata())
    ended, holed = (np.asarray(ax.lines[i].get_ydata()) for i in (2, 4))
    np.testing.assert_array_equal(np.isnan(ended), value > frequency[2, last - 1])
    inside = (value > frequency[4, 5]) & (value < frequency[4, 7])
    np.testing.assert_array_equal(np.isnan(holed), inside)
    assert "% of the band in 2 samples" in texts(ax)[-1]


def test_tuned_curve(ensemble):
    tuned = sh.frf(problem(), (60, 95), at=GRID)
    (ax,) = sh.plot.envelope(ensemble, tuned=tuned).axes
    line = next(line for line in ax.lines if line.get_label() == "tuned")
    x, y = line.get_data()
    top = level(tuned.amplitude.max("dof").values)
    np.testing.assert_array_equal(np.asarray(y)[np.isin(x, GRID)], top)
    with pytest.raises(ValueError, match="tuned: dataset: expected one curve"):
        sh.plot.envelope(ensemble, tuned=ensemble)
    followed = sh.follow(problem(), "normal_load", (5, 20), frequency=75.0)
    with pytest.raises(ValueError, match="tuned: expected a curve over frequency"):
        sh.plot.envelope(ensemble, tuned=followed)
    with pytest.raises(KeyError, match="tuned: "):
        sh.plot.envelope(ensemble, tuned=tuned.drop_vars("amplitude"))


def test_ensemble_over_a_followed_parameter():
    masses = xr.DataArray([0.9, 1.0, 1.1], dims="sample")
    followed = sh.follow(problem(), "normal_load", (1, 100), frequency=75.0, over={"mass": masses})
    (ax,) = sh.plot.envelope(followed).axes
    assert "F_n" in ax.get_xlabel()
    assert ax.get_xscale() == "log"
    assert ax.get_xlim() == pytest.approx((1, 100))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"quantiles": (0.9, 0.1)}, "quantiles="),
        ({"quantiles": (0.1, 1.1)}, "quantiles="),
        ({"quantiles": 0.5}, "quantiles=0.5"),
        ({"samples": 7}, "samples=7"),
        ({"place": 5}, "place=5"),
        ({"style": "curves"}, "style='curves'"),
    ],
)
def test_bad_arguments(ensemble, options, words):
    with pytest.raises(ValueError, match=words):
        sh.plot.envelope(ensemble, **options)
    assert plt.get_fignums() == []


def test_further_dimensions(ensemble):
    with pytest.raises(ValueError, match="dimension draw as well"):
        sh.plot.envelope(ensemble.expand_dims(draw=2))
    assert plt.get_fignums() == []


@pytest.fixture(scope="module")
def folded():
    """Three stiffening springs: each response folds."""
    springs = {"cubic_stiffness": xr.DataArray([0.08, 0.1, 0.13], dims="sample")}
    return sh.frf(duffing(), (0.08, 0.32), over=springs, throw=True, progress=False)


def crossings(curve, at):
    """Amplitudes of a path at a value: smallest and largest."""
    x, y = sh.plot.curve(curve)
    i = np.flatnonzero((x[:-1] - at) * (x[1:] - at) <= 0)
    share = (at - x[i]) / (x[i + 1] - x[i])
    found = np.exp(np.log(y[i]) + share * np.log(y[i + 1] / y[i]))
    return found.min(), found.max()


@pytest.mark.slow
def test_bands_of_curves_that_fold_hold_every_solution(folded):
    (ax,) = sh.plot.envelope(folded, extremes=False).axes
    upper, lower = ax.lines[:2]
    value = np.asarray(upper.get_xdata())
    edges = [collection.get_paths()[0] for collection in ax.collections]
    for number in (300, 550, 700, 1100):
        found = [crossings(folded.isel(sample=i), value[number]) for i in range(3)]
        low, high = np.sort([one[0] for one in found]), np.sort([one[1] for one in found])
        own = edges[0].vertices[edges[0].vertices[:, 0] == value[number]][:, 1]
        # Straight lines in decibels, read off at a value.
        assert [own.min(), own.max()] == pytest.approx(level([low[0], high[-1]]), abs=1e-6)
        assert upper.get_ydata()[number] == pytest.approx(level(high[1]), abs=1e-6)
        if low[1] < high[1] * 0.99:
            assert lower.get_ydata()[number] == pytest.approx(level(low[1]), abs=1e-6)
        else:
            assert np.isnan(lower.get_ydata()[number])
    assert texts(ax)[2:4] == ["median of the largest", "median of the smallest"]
    assert texts(ax)[4].startswith("several responses at one value:\n3 of 3 samples")


def test_several_solutions_on_a_grid_are_all_shown(ensemble):
    """Bands go from the smallest to the largest solution; missing solutions are none."""
    second = (0.5 * ensemble.amplitude).where(ensemble.frequency > 80)
    both = xr.concat([ensemble.amplitude, second], "solution")
    several = ensemble.drop_vars("amplitude").assign(amplitude=both)
    (ax,) = sh.plot.envelope(several, extremes=False).axes
    top = ensemble.amplitude.max("dof").transpose("sample", "frequency").values
    low = np.where(np.arange(29) > np.searchsorted(GRID, 80, "right") - 1, 0.5, 1.0) * top
    np.testing.assert_allclose(band(ax, 0), level([low.min(0), top.max(0)]), rtol=1e-12)
    assert "6 of 6 samples" in texts(ax)[-1]


def test_highest_and_lowest_samples_are_named(paths, ensemble):
    peaks = paths.peak_amplitude.max("peak")
    for case in (paths, ensemble):
        (ax,) = sh.plot.envelope(case).axes
        high, low = int(peaks.values.argmax()), int(peaks.values.argmin())
        assert texts(ax)[-2:] == [f"sample {high}, highest peak", f"sample {low}, lowest peak"]
        lines = [line for line in ax.lines if line.get_linewidth() == 0.9 and len(line.get_xdata())]
        tops = [np.max(line.get_ydata()) for line in lines]
        # Peaks between the values of a grid, too.
        assert tops == pytest.approx(level(peaks.values[[high, low]]), abs=1e-9)


def test_samples_that_end_early_are_not_the_lowest(paths):
    amplitude = paths.amplitude.copy(deep=True)
    lowest = int(paths.peak_amplitude.max("peak").values.argmin())
    amplitude[lowest, 3] = np.nan
    (ax,) = sh.plot.envelope(paths.assign(amplitude=amplitude)).axes
    names = [text for text in texts(ax) if "lowest" in text]
    assert names
    assert f"sample {lowest}," not in names[0]


@pytest.mark.parametrize("scale", ["decibel", "linear", "log"])
def test_a_density_counts_each_sample_once_in_a_cell(paths, scale):
    ax, bar = sh.plot.envelope(paths, style="density", scale=scale, extremes=False).axes
    (mesh,) = ax.collections
    share = mesh.get_array()
    assert share.shape == (200, 300)
    assert set(np.unique(6 * share.compressed()).round(9)) <= set(range(1, 7))
    # Every sample passes every column, so that shares of a column add to one at least.
    assert (share.filled(0).sum(axis=0) >= 1 - 1e-12).all()
    corners = np.asarray(mesh.get_coordinates())
    rows = corners[:, 0, 1]
    every = ax.lines[0].get_ydata()
    assert rows[0] <= every.min()
    assert rows[-1] >= every.max()
    # The median runs where samples pass, or between them.
    column = np.searchsorted(corners[0, :, 0], ax.lines[0].get_xdata()[600]) - 1
    passed = np.flatnonzero(~share.mask[:, column])
    row = np.searchsorted(rows, every[600]) - 1
    assert passed[0] <= row <= passed[-1]
    assert bar.get_ylabel() == "share of 6 samples that pass"


def test_a_density_has_no_holes_between_the_values_of_a_grid(ensemble):
    ax, _ = sh.plot.envelope(ensemble, style="density", extremes=False).axes
    share = ax.collections[0].get_array().filled(0)
    # 29 values, 300 columns: straight lines pass each of them.
    assert (share.sum(axis=0) >= 1 - 1e-12).all()


def test_a_density_of_curves_that_fold_has_all_of_their_ways(folded):
    ax, _ = sh.plot.envelope(folded, style="density", extremes=False).axes
    share = ax.collections[0].get_array()
    corners = np.asarray(ax.collections[0].get_coordinates())
    at = 0.19
    column = np.searchsorted(corners[0, :, 0], at) - 1
    cells = np.flatnonzero(~share.mask[:, column])
    for i in range(3):
        for size in crossings(folded.isel(sample=i), at):
            row = np.searchsorted(corners[:, 0, 1], level(size)) - 1
            assert np.abs(cells - row).min() <= 1
    # Nothing is between the ways.
    assert len(cells) < np.ptp(cells) / 2


def test_bars_of_one_response(ensemble):
    values = ensemble.amplitude.isel(sample=0).max("frequency")
    values.attrs = {"long_name": "largest amplitude", "units": "m"}
    (ax,) = sh.plot.blades(values).axes
    heights = [bar.get_height() for bar in ax.patches]
    assert ax.get_ylabel() == "largest amplitude [µm]"
    # Round-off of the factor.
    np.testing.assert_allclose(heights, 1e6 * values, rtol=1e-15)
    unknown = values.where(values.dof != 2)
    (ax,) = sh.plot.blades(unknown).axes
    assert [text.get_text() for text in ax.texts] == ["?"]


def test_boxes_of_an_ensemble(ensemble):
    values = ensemble.stick_fraction.min("frequency").rename("least stick")
    values.attrs = {}
    (ax,) = sh.plot.blades(values).axes
    assert ax.get_xlabel() == "contact"
    assert ax.get_ylabel() == "least stick"
    bottoms = np.array([bar.get_y() for bar in ax.patches]).reshape(2, 5)
    tops = bottoms + np.array([bar.get_height() for bar in ax.patches]).reshape(2, 5)
    np.testing.assert_allclose([bottoms[0], tops[0]], [values.min("sample"), values.max("sample")])
    quartiles = np.quantile(values, [0.25, 0.75], axis=0)
    np.testing.assert_allclose([bottoms[1], tops[1]], quartiles)
    worst = int(values.max("contact").argmax("sample"))
    line = next(line for line in ax.lines if "largest" in str(line.get_label()))
    np.testing.assert_array_equal(line.get_ydata(), values.isel(sample=worst))
    assert f"sample {worst}, the largest" in texts(ax)


def test_samples_with_nan_are_counted(ensemble):
    values = ensemble.amplitude.max("frequency").copy(deep=True)
    values[2, 1] = np.nan
    (ax,) = sh.plot.blades(values).axes
    assert texts(ax)[0] == "smallest to largest of 5"
    assert texts(ax)[-1] == "left out, NaN: 1 of 6"


@pytest.mark.parametrize(
    ("values", "error", "words"),
    [
        (xr.DataArray(np.ones((2, 3)), dims=("dof", "frequency")), ValueError, "frequency"),
        (xr.DataArray(np.ones(2), dims="sample"), ValueError, "sample"),
        (xr.DataArray([np.nan, np.nan], dims="dof"), ValueError, "finite"),
        (xr.DataArray(["a", "b"], dims="dof"), TypeError, "values="),
        ([1.0, 2.0], TypeError, r"values=\[1.0, 2.0\]"),
    ],
)
def test_bad_values(values, error, words):
    with pytest.raises(error, match=words):
        sh.plot.blades(values)
    assert plt.get_fignums() == []
