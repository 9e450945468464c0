"""Figures of ensembles: what is drawn is what is stored, and what is left out is told."""

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from tests.paper import level, texts
from tests.problems import ring_of_blades

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
    assert rows[0] <= every.min() + 1e-12 * abs(every.min())
    assert rows[-1] >= every.max() - 1e-12 * abs(every.max())
    # The median runs where samples pass, or between them.
    column = np.searchsorted(corners[0, :, 0], ax.lines[0].get_xdata()[600]) - 1
    passed = np.flatnonzero(~share.mask[:, column])
    row = np.searchsorted(rows, every[600]) - 1
    assert passed[0] <= row <= passed[-1]
    assert bar.get_ylabel() == "share of 6 samples that pass"
