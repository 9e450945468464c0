"""Datasets own their variables."""

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from tests.problems import one_blade

BLADE = sh.HarmonicBalance(one_blade(), sh.forces.PointForce())
NAMED = xr.DataArray(
    [1.0, 3.0], dims="case", coords={"case": ["low", "high"], "cost": ("case", [1, 2])}
)
CALLS = {
    "path": {},
    "grid": dict(at=[15.0, 19.0]),
    "labels": dict(over={"normal_load": NAMED}),
}


@pytest.mark.parametrize("name", CALLS)
def test_results_belong_to_their_dataset(name):
    """They may be written to, and labels that datasets share stay as they are."""
    first, second = (sh.frf(BLADE, (15, 22), progress=False, **CALLS[name]) for _ in range(2))
    before = second.copy(deep=True)
    for variable in first.data_vars.values():
        if variable.dtype.kind == "f" and variable.ndim > 1:
            variable.values[:] = 0.0
    first.attrs["title"] = "another"
    first["dof"].attrs["long_name"] = "another"
    first = first.assign_coords(dof=first["dof"] + 1)
    xr.testing.assert_identical(second, before)
    assert not np.any(first.amplitude)
    assert sh.frf(BLADE, (15, 22), progress=False, **CALLS[name]).dof.values.tolist() == [0]
