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
