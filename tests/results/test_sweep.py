"""What `over` means: dimensions, patterns and pairs, each set as if computed alone."""

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from tests.problems import BLADE as VALUES

BLADE = sh.HarmonicBalance(sh.single_blade(**VALUES), sh.forces.PointForce())
RING = sh.HarmonicBalance(sh.bladed_disk(3, **VALUES), sh.forces.EngineOrder(1))
BAND = (15.0, 24.0)
PARAMETERS = set(BLADE.parameters) | set(RING.parameters)


def sweep(problem, over=None, **options):
    return sh.frf(problem, BAND, over=over, progress=False, **options)


def assert_computed_alone(one, problem):
    """One set of a sweep equals the curve of a problem that has these values from the start."""
    alone = sweep(sh.HarmonicBalance(problem.model, problem.excitation, problem.harmonics))
    assert str(one.status.values) == str(alone.status.values)
    for name in ("n_points", "n_peaks", "n_events", "linear_solves"):
        assert int(one[name]) == int(alone[name])
    for dim in ("point", "peak", "event"):
        one = one.isel({dim: slice(int(one[f"n_{dim}s"]))})
    for name in alone.variables:
        if {"point", "peak", "event"} & set(alone[name].dims):
            np.testing.assert_array_equal(one[name], alone[name], err_msg=str(name))


def along(values, *dims, **coords):
    return xr.DataArray(values, dims=dims, coords=coords)


PATTERNS = np.array([[1.0, 2.0, 3.0], [3.0, 3.0, 4.0]])
UNEVEN = np.array([1.0, 1.1, 0.9])
DRAWS = xr.Dataset(
    {
        "normal_load": (("sample", "contact"), PATTERNS),
        "stiffness": (("sample", "dof"), 1e4 * np.array([UNEVEN, UNEVEN[::-1]])),
    },
    coords={"sample": [7, 3]},
)
PAIRED = {
    "normal_load": along([1.0, 3.0], "sample"),
    "contact_stiffness": along([1e4, 2e4], "sample"),
    "mass": [1.0, 1.1],
}
FOLLOWING = {
    "normal_load": [1.0, 3.0],
    "contact_stiffness": along([1e4, 2e4], "normal_load"),
}
# What is swept, the dimensions of its results, one set of it, and the values of that set.
SWEEPS = {
    "nothing": (BLADE, None, (), {}, {}),
    "an empty mapping": (BLADE, {}, (), {}, {}),
    "an empty dataset": (BLADE, xr.Dataset(), (), {}, {}),
    "one number": (BLADE, {"normal_load": 5}, (), {}, {"normal_load": 5}),
    "a list": (
        *(BLADE, {"normal_load": [1.0, 3.0, 10.0]}, ("normal_load",)),
        *({"normal_load": 2}, {"normal_load": 10.0}),
    ),
    "a tuple": (
        *(BLADE, {"force_amplitude": (1, 2)}, ("force_amplitude",)),
        *({"force_amplitude": 1}, {"force_amplitude": 2}),
    ),
    "every blade": (
        *(RING, {"stiffness": np.array([1e4, 1.1e4])}, ("stiffness",)),
        *({"stiffness": 1}, {"stiffness": [1.1e4] * 3}),
    ),
    "engine orders": (
        *(RING, {"engine_order": [2, 0]}, ("engine_order",)),
        *({"engine_order": 1}, {"engine_order": 0}),
    ),
    "a product": (
        *(BLADE, {"stiffness": [1e4, 9e3], "normal_load": [1.0, 3.0]}),
        *(("stiffness", "normal_load"), {"stiffness": 1, "normal_load": 0}),
        {"stiffness": 9e3, "normal_load": 1.0},
    ),
    "pairs": (
        *(BLADE, PAIRED, ("sample", "mass"), {"sample": 1, "mass": 1}),
        {"normal_load": 3.0, "contact_stiffness": 2e4, "mass": 1.1},
    ),
    "what depends on a list": (
        *(BLADE, FOLLOWING, ("normal_load",), {"normal_load": 1}),
        {"normal_load": 3.0, "contact_stiffness": 2e4},
    ),
    "a pattern of contacts": (
        *(RING, {"normal_load": along(UNEVEN, "contact")}, (), {}, {"normal_load": UNEVEN}),
    ),
    "a pattern of blades": (
        *(RING, {"stiffness": along(1e4 * UNEVEN, "dof")}, (), {}, {"stiffness": 1e4 * UNEVEN}),
    ),
    "patterns": (
        *(RING, {"normal_load": along(PATTERNS.T, "contact", "sample")}, ("sample",)),
        *({"sample": 1}, {"normal_load": PATTERNS[1]}),
    ),
    "a dataset": (
        *(RING, DRAWS, ("sample",), {"sample": 1}),
        {"normal_load": PATTERNS[1], "stiffness": 1e4 * UNEVEN[::-1]},
    ),
}


@pytest.mark.parametrize("name", SWEEPS)
def test_each_set_is_computed_as_if_alone(name):
    problem, over, dims, chosen, values = SWEEPS[name]
    curves = sweep(problem, over)
    assert curves.amplitude.dims == (*dims, "point", "dof")
    assert curves.peak_amplitude.dims == (*dims, "peak")
    assert curves.status.dims == curves.n_points.dims == dims
    one = curves.isel(chosen)
    for parameter, value in values.items():
        np.testing.assert_array_equal(
            one[parameter], np.ravel(value)[0] if dims == (parameter,) else value
        )
        kinds = {np.asarray(problem.parameters[parameter]).dtype.kind, one[parameter].dtype.kind}
        assert kinds == {"i" if parameter == "engine_order" else "f"}
    assert_computed_alone(one, problem.with_parameters(**values))
    rebuilt = sh.datasets.rebuild(one).parameters
    for parameter, value in values.items():
        np.testing.assert_array_equal(
            rebuilt[parameter], np.broadcast_to(value, np.shape(rebuilt[parameter]))
        )


@pytest.mark.parametrize("labels", [[10, 20], [0.5, -0.5], ["tuned", "mistuned"]], ids=str)
def test_labels_of_the_samples_survive(tmp_path, labels):
    draws = xr.DataArray([1.0, 3.0], dims="sample", coords={"sample": labels})
    curves = sweep(BLADE, {"normal_load": draws})
    assert curves.sample.values.tolist() == labels
    loaded = sh.load(sh.save(curves, tmp_path / "samples.nc"))
    assert loaded.sample.values.tolist() == labels
    assert float(loaded.normal_load.sel(sample=labels[1])) == 3.0


def test_labels_beside_the_dimension_survive():
    draws = xr.DataArray(
        [1.0, 3.0], dims="sample", coords={"group": ("sample", [4, 5]), "seed": 2013}
    )
    curves = sweep(BLADE, {"normal_load": draws})
    assert curves.group.dims == ("sample",)
    assert curves.group.values.tolist() == [4, 5]
    assert int(curves.seed) == 2013


@pytest.mark.filterwarnings("ignore:2 of 2 curves are incomplete")
@pytest.mark.parametrize("name", sorted(PARAMETERS))
def test_nominal_values_are_kept(name):
    curves = sweep(RING, {name: [1, 2]}, at=[16.0], max_points=2)
    nominal = curves[f"{name}_nominal"]
    np.testing.assert_array_equal(nominal, RING.parameters[name])
    assert nominal.dims == RING_DIMS.get(name, ())
    assert curves[name].attrs["units"] == nominal.attrs["units"]
    for other in PARAMETERS - {name}:
        assert f"{other}_nominal" not in curves
        np.testing.assert_array_equal(curves[other], RING.parameters[other])


RING_DIMS = {
    **dict.fromkeys(["mass", "damping", "stiffness"], ("dof",)),
    **dict.fromkeys(["contact_stiffness", "friction_coefficient", "normal_load"], ("contact",)),
    "cubic_stiffness": ("contact",),
}


@pytest.mark.filterwarnings("ignore:2 of 2 curves are incomplete")
def test_the_problem_and_what_was_given_stay_as_they_were():
    draws = xr.DataArray([[3, 1], [2, 2], [1, 3]], dims=("contact", "sample"))
    over, copy = {"normal_load": draws}, draws.copy(deep=True)
    sweep(RING, over, at=[16.0], max_points=2)
    assert list(over) == ["normal_load"]
    xr.testing.assert_identical(draws, copy)
    assert RING.parameters["normal_load"].tolist() == [3.0] * 3
