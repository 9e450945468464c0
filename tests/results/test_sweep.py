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


@pytest.mark.parametrize(
    ("name", "values"),
    [("normal_load", [1.0, 3.0, 10.0]), ("mass", [1.0, 1.2]), ("force_amplitude", (1, 2))],
)
def test_a_list_is_a_dimension_of_its_own_name(name, values):
    curves = sweep(BLADE, {name: values})
    assert curves[name].dims == (name,)
    assert curves[name].values.tolist() == list(values)
    assert curves.amplitude.dims == (name, "point", "dof")
    assert curves.peak_amplitude.dims == (name, "peak")
    assert curves.status.dims == curves.n_points.dims == (name,)
    for value in values:
        assert_computed_alone(curves.sel({name: value}), BLADE.with_parameters(**{name: value}))


def test_a_list_sets_every_blade():
    curves = sweep(RING, {"stiffness": np.array([1e4, 1.1e4])})
    assert curves.stiffness.dims == ("stiffness",)
    uniform = RING.with_parameters(stiffness=[1.1e4] * 3)
    assert_computed_alone(curves.isel(stiffness=1), uniform)


def test_engine_orders_stay_integers():
    curves = sweep(RING, {"engine_order": [2, 0]})
    assert curves.engine_order.dtype == np.int64
    assert curves.engine_order.values.tolist() == [2, 0]
    for order in (0, 2):
        assert_computed_alone(
            curves.sel(engine_order=order), RING.with_parameters(engine_order=order)
        )


def test_one_number_is_no_dimension():
    curves = sweep(BLADE, {"normal_load": 5})
    assert curves.normal_load.dims == ()
    assert_computed_alone(curves, BLADE.with_parameters(normal_load=5))
    assert sh.datasets.rebuild(curves).parameters["normal_load"].tolist() == [5.0]


@pytest.mark.parametrize("over", [None, {}, xr.Dataset()], ids=repr)
def test_nothing_to_sweep(over):
    curve = sweep(BLADE, over)
    assert curve.amplitude.dims == ("point", "dof")
    assert_computed_alone(curve, BLADE)


def test_several_names_give_their_product():
    curves = sweep(BLADE, {"normal_load": [1.0, 3.0, 10.0], "stiffness": [1e4, 9e3]})
    assert curves.amplitude.dims == ("normal_load", "stiffness", "point", "dof")
    assert curves.n_points.shape == (3, 2)
    for load in (1.0, 10.0):
        for stiffness in (1e4, 9e3):
            assert_computed_alone(
                curves.sel(normal_load=load, stiffness=stiffness),
                BLADE.with_parameters(normal_load=load, stiffness=stiffness),
            )


def test_order_of_the_names_is_the_order_of_the_dimensions():
    curves = sweep(BLADE, {"stiffness": [1e4, 9e3], "normal_load": [1.0, 3.0]}, at=[16, 17, 18])
    assert curves.amplitude.dims == ("stiffness", "normal_load", "frequency", "dof")
    assert curves.coefficient.dims[2:] == ("frequency", "dof", "harmonic", "component")
    assert curves.contact_state.dims[2:] == ("frequency", "contact")


def test_names_that_share_a_dimension_go_in_pairs():
    loads, stiffnesses = [1.0, 3.0], [1e4, 2e4]
    over = {
        "normal_load": xr.DataArray(loads, dims="sample"),
        "contact_stiffness": xr.DataArray(stiffnesses, dims="sample"),
        "mass": [1.0, 1.1],
    }
    curves = sweep(BLADE, over)
    assert curves.amplitude.dims == ("sample", "mass", "point", "dof")
    assert curves.normal_load.dims == curves.contact_stiffness.dims == ("sample",)
    for i in range(2):
        assert_computed_alone(
            curves.isel(sample=i, mass=1),
            BLADE.with_parameters(normal_load=loads[i], contact_stiffness=stiffnesses[i], mass=1.1),
        )


def test_a_list_and_what_depends_on_it():
    """The second name follows the first along the dimension of the first."""
    over = {
        "normal_load": [1.0, 3.0],
        "contact_stiffness": xr.DataArray([1e4, 2e4], dims="normal_load"),
    }
    curves = sweep(BLADE, over)
    assert curves.amplitude.dims == ("normal_load", "point", "dof")
    chosen = BLADE.with_parameters(normal_load=3.0, contact_stiffness=2e4)
    assert_computed_alone(curves.sel(normal_load=3.0), chosen)


@pytest.mark.parametrize(("name", "dim"), [("normal_load", "contact"), ("stiffness", "dof")])
def test_a_pattern(name, dim):
    values = VALUES[name] * np.array([1.0, 1.1, 0.9])
    curve = sweep(RING, {name: xr.DataArray(values, dims=dim)})
    assert curve.amplitude.dims == ("point", "dof")
    assert curve[name].dims == (dim,)
    assert_computed_alone(curve, RING.with_parameters(**{name: values}))


@pytest.mark.parametrize("dims", [("sample", "contact"), ("contact", "sample")])
def test_an_ensemble_of_patterns(dims):
    values = np.array([[1.0, 2.0, 3.0], [3.0, 3.0, 4.0]])
    draws = xr.DataArray(values, dims=("sample", "contact")).transpose(*dims)
    curves = sweep(RING, {"normal_load": draws})
    assert curves.amplitude.dims == ("sample", "point", "dof")
    assert curves.normal_load.dims == ("sample", "contact")
    np.testing.assert_array_equal(curves.normal_load, values)
    for i in range(2):
        assert_computed_alone(curves.isel(sample=i), RING.with_parameters(normal_load=values[i]))


def test_a_dataset_is_a_mapping_of_its_variables():
    rng = np.random.default_rng(1)
    draws = xr.Dataset(
        {
            "normal_load": (("sample", "contact"), rng.uniform(2, 4, (3, 3))),
            "stiffness": (("sample", "dof"), rng.uniform(0.9e4, 1.1e4, (3, 3))),
        },
        coords={"sample": [7, 3, 5]},
    )
    curves = sweep(RING, draws)
    assert curves.amplitude.dims == ("sample", "point", "dof")
    assert curves.sample.values.tolist() == [7, 3, 5]
    xr.testing.assert_identical(curves, sweep(RING, dict(draws.data_vars)))
    chosen = {str(name): draws[name].sel(sample=3).values for name in draws}
    assert_computed_alone(curves.sel(sample=3), RING.with_parameters(**chosen))


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
