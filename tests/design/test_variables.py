"""What is designed: variables and values, bad input in words, and loads of single contacts."""

import numpy as np
import pytest
import scipy.sparse as sp
from by_hand import Structure
from designs import BAND, BOUNDS, blade, design, ring
from scipy.optimize import LinearConstraint
from xarray import DataArray

import symhbm as sh
from symhbm.balance.second_order import SecondOrder
from symhbm.continuation.status import Status
from symhbm.design.arguments import read_bands, read_limits, read_start, read_variables
from symhbm.results.sweep import parse


def variables_of(problem, parameters="normal_load", bounds=(0.1, 10.0), vary="common"):
    return read_variables(problem, parameters, bounds, vary)


class TestSpace:
    def test_a_pattern_repeats(self):
        variables = variables_of(ring(6), vary=[2, 7, 2])
        assert [group.label for group in variables.groups] == ["normal_load[2]", "normal_load[7]"]
        assert [group.entries for group in variables.groups] == [(0, 2, 3, 5), (1, 4)]

    def test_variables_of_several_parameters_come_in_their_order(self):
        variables = variables_of(
            ring(5),
            ["contact_stiffness", "normal_load"],
            {"normal_load": (0.1, 10.0), "contact_stiffness": (1e4, 1e6)},
            {"normal_load": "each", "contact_stiffness": "common"},
        )
        labels = [group.label for group in variables.groups]
        assert labels == ["contact_stiffness", *(f"normal_load[{j}]" for j in range(5))]
        assert np.exp(variables.lower) == pytest.approx([1e4] + [0.1] * 5)

    def test_values_land_on_their_entries(self):
        problem = ring(6)
        variables = variables_of(problem, vary=[0, 1])
        values = variables.parameters(problem, np.log([2.0, 3.0]))["normal_load"]
        assert values == pytest.approx([2, 3] * 3)
        assert variables.values(variables.upper + 1) == pytest.approx(
            [10, 10], rel=0
        )  # within bounds

    def test_samples_keep_their_proportions(self):
        problem = ring(4, normal_load=[1.0, 2.0, 4.0, 8.0])
        sample = np.array([2.0, 2.0, 2.0, 2.0])
        variables = variables_of(problem).proportional(problem, {"normal_load": sample})
        values = variables.parameters(problem, np.log([3.0]))["normal_load"]
        assert values == pytest.approx([6.0, 3.0, 1.5, 0.75])

    @pytest.mark.parametrize("vary", ["common", "each", [0, 1]])
    def test_derivatives_are_those_of_the_values(self, vary):
        problem = ring(4)
        variables = variables_of(problem, vary=vary)
        x = np.linspace(-0.5, 0.5, variables.n_variables)
        places = SecondOrder(problem, ["normal_load", "damping"]).places
        derivative = variables.derivative(variables.problem(problem, x), places)
        first = min(place.start for place in places.values())
        place = places["normal_load"]
        rows = slice(place.start - first, place.stop - first)
        step = 1e-6

        def values(x):
            return variables.parameters(problem, x)["normal_load"]

        expected = np.array(
            [(values(x + e) - values(x - e)) / (2 * step) for e in step * np.eye(len(x))]
        ).T
        assert derivative[rows] == pytest.approx(expected, abs=1e-8)  # differences: STEP^2
        assert not np.delete(derivative, np.r_[rows], axis=0).any()


class TestBands:
    def test_one_pair_is_that_of_all_cases(self):
        sweep = parse(blade(), {"damping": [0.5, 0.6]})
        assert read_bands((40, 5), sweep) == [((5.0, 40.0),)] * 2
        assert read_bands([(5, 18), (22, 40)], sweep) == [((5.0, 18.0), (22.0, 40.0))] * 2

    def test_those_of_cases_go_by_name(self):
        sweep = parse(blade(), {"damping": [0.5, 0.6], "mass": [1.0, 1.1, 1.2]})
        pairs = np.arange(1.0, 13).reshape(3, 2, 2)
        bands = read_bands(DataArray(pairs, dims=("mass", "edge", "damping")), sweep)
        assert bands[0] == ((1.0, 3.0),)
        assert bands[1] == ((5.0, 7.0),)  # the second mass
        assert bands[3] == ((2.0, 4.0),)  # the second damping


BAD = {
    KeyError: [
        (
            dict(parameters="normal_lod"),
            "'normal_lod' is no parameter that can be designed; .* did you mean 'normal_load'",
        ),
        (dict(parameters="engine_order"), "'engine_order' is no parameter that"),
        (dict(fresh={"dampin": [1]}), "'dampin' is no parameter"),
    ],
    TypeError: [
        (dict(parameters=[]), r"parameters=\[\]: expected a name or several"),
        (dict(parameters=["normal_load"] * 2), "parameters=.*different ones"),
        (dict(parameters=3), "parameters=3: expected a name"),
        (dict(bounds=None), "bounds=None: expected real numbers"),
        (
            dict(parameters=["normal_load", "damping"], bounds=(1, 2)),
            r"bounds=\(1, 2\): expected a mapping with an entry for each parameter",
        ),
        (dict(constraint=2.0), "constraint=2.0: expected a scipy.optimize.L"),
        (dict(over=[1]), r"over=\[1\]: expected a mapping of parameters"),
        (dict(fresh=[1]), r"fresh=\[1\]: expected a mapping of parameters"),
    ],
    ValueError: [
        (dict(bounds=(5, 1)), r"bounds=\(5, 1\): expected two.* lower < upper"),
        (dict(bounds=(-1, 1)), r"bounds=\(-1, 1\): .*finite and > 0"),
        (dict(bounds=(1, np.inf)), r"bounds=\(1, inf\): .*finite and > 0"),
        (dict(bounds=5), "bounds=5: expected two values"),
        (
            dict(parameters=["normal_load", "damping"], bounds={"damping": (1, 2)}),
            "bounds=.*expected an entry for 'normal_load'",
        ),
        (
            dict(
                parameters=["normal_load", "damping"],
                bounds=dict(damping=(1, 2), normal_load=(2, 1)),
            ),
            r"bounds\['normal_load'\]=\(2, 1\): expected two values, lower < upper",
        ),
        (
            dict(bounds={"normal_load": (1, 2), "dampin": (1, 2)}),
            "bounds=.*expected entries for normal_load alone, 'dampin' is not designed",
        ),
        (dict(vary="eech"), "vary='eech': expected 'common', 'each', or a seq"),
        (dict(vary=[0, 1, 2, 3]), r"vary=\[0, .*no longer than the 3 val"),
        (dict(vary=[0, 0.5]), r"vary=\[0, 0.5\]: expected 'common'"),
        (dict(vary={"mass": "each"}), "vary=.*'mass' is not designed"),
        (
            dict(start=[1, 2]),
            r"start=\[1, 2\]: expected one value, .* of the 1 variables, got shape \(2,\)",
        ),
        (dict(start=-1), "start=-1: expected values finite and > 0"),
        (dict(frequency_band=(1, 2, 3)), r"frequency_band=\(1, 2, 3\): expected two diff"),
        (dict(frequency_band=(5, 5)), r"frequency_band=\(5, 5\): expected bands of som"),
        (dict(frequency_band=[]), r"frequency_band=\[\]: expected two different"),
        (dict(frequency_band=np.ones((2, 2, 2))), "frequency_band=array.*a list of such"),
        (
            dict(
                frequency_band=DataArray([[1.0, 2]] * 3, dims=("case", "edge")),
                over={"damping": DataArray([0.5, 0.6], dims="case")},
            ),
            "frequency_band=.*expected .*over the dimensions of the sweep, {'case': 2}",
        ),
        (
            dict(
                frequency_band=DataArray(
                    [[1.0, 2]] * 2, {"damping": [0.6, 0.5]}, ("damping", "edge")
                ),
                over={"damping": [0.5, 0.6]},
            ),
            r"frequency_band: 'damping' has the labels \[0.6, 0.5\], those .* are \[0.5, 0.6\]",
        ),
        (dict(statistic="tail", tail=0), "tail=0: expected a share above 0"),
        (dict(tail=1.5), "tail=1.5: expected a share above 0, up to 1"),
        (dict(statistic="wurst"), "statistic='wurst': expected 'worst', 'mea"),
        (
            dict(constraint=LinearConstraint(np.ones((1, 2)), 1, 2)),
            r"constraint: expected a finite matrix with 1 columns.* got shape \(1, 2\)",
        ),
        (
            dict(constraint=LinearConstraint([[1.0], [0.0]], 0, 2)),
            "constraint: expected rows with an entry other than 0, row 1 has none",
        ),
        (
            dict(constraint=LinearConstraint([[1.0]], np.nan, 2)),
            "constraint: expected numbers as bounds.* lb=.*nan",
        ),
        (
            dict(constraint=LinearConstraint([[1.0]], np.inf, np.inf)),
            "constraint: expected numbers as bounds.* lb=.*inf",
        ),
        (dict(n_starts=0), "n_starts=0: expected an integer >= 1"),
        (
            dict(over={"normal_load": [0.0, 1.0]}),
            r"over\['normal_load'\]: expected positive values of a designed parameter",
        ),
        (
            dict(over={"damping": DataArray([0.5, 0.6], dims="start")}),
            r"over\['damping'\]: expected a name of your own, 'start' is the result's",
        ),
        (
            dict(fresh={"normal_load": [0.0, 1.0]}),
            r"fresh\['normal_load'\]: expected positive values",
        ),
        (dict(over={"force_amplitude": [0.0, 1.0]}), "force_amplitude=0: expec"),
    ],
}


class TestBadInput:
    @pytest.mark.parametrize(
        ("error", "options", "words"), [(e, *row) for e, rows in BAD.items() for row in rows]
    )
    def test_it_is_named_with_its_value_and_what_is_allowed(self, error, options, words):
        given = dict(parameters="normal_load", bounds=BOUNDS, frequency_band=BAND) | options
        with pytest.raises(error, match=words):
            sh.minimise_peak(ring(3, 1e5, 1), **given)

    def test_friction_over_samples_has_no_second_derivatives(self):
        sampled = sh.HarmonicBalance(blade().model, blade().excitation, (1,), samples=64)
        with pytest.raises(
            ValueError, match=r"problem: expected located switching angles.*64 samp"
        ):
            design(sampled)

    def test_proportions_need_a_nominal_value(self):
        with pytest.raises(ValueError, match=r"over\['normal_load'\]: expected positive nominal"):
            design(blade(normal_load=0.0), over={"normal_load": [1.0, 2.0]})

    def test_fresh_cases_have_no_bands_of_their_own(self):
        dims = ("damping", "edge")
        with pytest.raises(ValueError, match="fresh: expected None where cases have bands of thei"):
            design(
                blade(),
                frequency_band=DataArray([[5.0, 40.0], [5.0, 41.0]], dims=dims),
                over={"damping": [0.5, 0.6]},
                fresh={"damping": [0.7]},
            )

    def test_a_structure_without_contacts_has_no_loads(self):
        free = sh.Model(np.eye(2), 0.5 * np.eye(2), 1e4 * np.eye(2))
        with pytest.raises(ValueError, match="parameters='normal_load': expected contacts"):
            design(sh.HarmonicBalance(free, sh.forces.PointForce(amplitude=1.0), (1,)))

    def test_no_problem(self):
        with pytest.raises(TypeError, match=r"problem=.*expected a HarmonicBalance"):
            design(blade().model)

    def test_good_values_are_read(self):
        variables = variables_of(ring(3, 1e5, 1), vary="each")
        assert read_start(variables, 2.0) == pytest.approx(np.log([2.0] * 3))
        assert read_start(variables, None) is None
        given = LinearConstraint(sp.csr_array([[1.0, 2.0, 3.0]]), -np.inf, 5)
        limits = read_limits(ring(3, 1e5, 1), variables, given)
        # Over the largest value within the bounds, which is 10 each.
        assert limits.matrix * 60 == pytest.approx(np.array([[1.0, 2.0, 3.0]]))
        assert (limits.low.item(), limits.high.item() * 60) == (-np.inf, pytest.approx(5))


FRICTION = np.array([0.5, 0.4, 0.6])
SMALL = (5.0, 120.0)
NEAR = (0.5, 10.0)
"""Loads [N] about the optima."""


@pytest.fixture(scope="module")
def mistuned():
    """Three blades whose contacts have friction of their own."""
    return ring(3, 1e5, 1, friction_coefficient=FRICTION)


@pytest.fixture(scope="module")
def common(mistuned):
    return design(mistuned, bounds=NEAR, frequency_band=SMALL)


@pytest.fixture(scope="module")
def each(mistuned):
    return design(mistuned, bounds=NEAR, frequency_band=SMALL, vary="each")


@pytest.fixture(scope="module")
def fixed(mistuned):
    mean = LinearConstraint(np.ones((1, 3)) / 3, 3.0, 3.0)
    return design(mistuned, bounds=NEAR, frequency_band=SMALL, vary="each", constraint=mean)


class TestEach:
    @pytest.mark.slow
    def test_single_loads_make_up_for_friction(self, common, each):
        assert each.status.item() == Status.DESIGN_OPTIMAL
        assert each.design_amplitude.item() < common.design_amplitude.item() * (1 - 1e-3)
        # The limits of all contacts are those of the tuned ring, whose blades all move alike.
        tuned = design(ring(3, 1e5, 1), bounds=NEAR, frequency_band=SMALL)
        limits = each.design_value.values * FRICTION
        assert limits == pytest.approx(np.full(3, tuned.design_value.item() / 2), rel=1e-7)
        expected = pytest.approx(tuned.design_amplitude.item(), rel=1e-10)
        assert each.design_amplitude.item() == expected
        assert each.active_multiplier.values == pytest.approx(np.ones(3) / 3, abs=1e-6)

    @pytest.mark.slow
    def test_a_pattern_is_solved_by_sectors(self):
        problem = ring(6, 1e5, 2)
        optimum = design(problem, bounds=NEAR, frequency_band=SMALL, vary=[0, 1])
        alike = design(problem, bounds=NEAR, frequency_band=SMALL)
        assert optimum.n_sectors == 3
        assert alike.n_sectors == 6
        assert optimum["variable"].values.tolist() == ["normal_load[0]", "normal_load[1]"]
        assert optimum.design_amplitude <= alike.design_amplitude * (1 + 1e-10)
        # All sectors of two move alike, and so do these two.
        assert optimum.n_points == pytest.approx(alike.n_points, abs=5)


def by_hand(loads, stiffness=(1e4, 1e4, 1e4), damping=0.5):
    """The ring of three blades of these tests under engine order 1, in numpy alone."""
    around = np.array([[1.0, -1, 0], [0, 1, -1], [-1, 0, 1]])
    matrices = np.eye(3), damping * np.eye(3), np.diag(stiffness), around, np.full(3, 1e5)
    return Structure(*matrices, FRICTION * loads, np.exp(-2j * np.pi * np.arange(3) / 3))


def assert_lowest_by_hand(optimum, directions, band, **parameters):
    """The design has the response it is told to have, and those beside it have larger ones."""
    loads, lowest = optimum.design_value.values, optimum.design_amplitude.item()
    top, frequency = by_hand(loads, **parameters).highest(*band, 600)
    # Both are solved to 1e-12; by hand a peak is looked for on ever finer grids.
    assert top == pytest.approx(lowest, rel=1e-9)
    assert np.abs(optimum.active_frequency - frequency).min() < 1e-3
    for direction in directions:
        beside = by_hand(loads + direction, **parameters)
        # In a part of the band: what is higher elsewhere is higher still.
        assert beside.highest(frequency - 4, frequency + 4, 200)[0] > lowest


class TestByHand:
    """Designs against responses that nothing of the package computes."""

    @pytest.mark.slow
    def test_each_contact_its_own_load(self, each):
        directions = [[0.02, 0, 0], [0, -0.02, 0.0], [0.01, 0.01, -0.01]]
        assert_lowest_by_hand(each, np.array(directions), (50, 115))

    @pytest.mark.slow
    def test_a_ring_with_a_fixed_mean(self, fixed):
        assert fixed.design_value.mean().item() == pytest.approx(3.0, rel=1e-9)
        directions = [[0.02, -0.02, 0], [-0.01, 0, 0.01], [0, 0.01, -0.01]]
        assert_lowest_by_hand(fixed, np.array(directions), (50, 115))

    @pytest.mark.slow
    @pytest.mark.parametrize("mean", [None, 3.0])
    def test_blades_that_differ(self, mean):
        """No design is known in advance: neither blades nor contacts are alike."""
        parameters = dict(stiffness=(1.02e4, 0.97e4, 1e4), damping=3.0)
        problem = ring(
            3,
            1e5,
            1,
            friction_coefficient=FRICTION,
            stiffness=np.array(parameters["stiffness"]),
            damping=3.0,
        )
        row = None if mean is None else LinearConstraint(np.ones((1, 3)) / 3, mean, mean)
        optimum = design(problem, bounds=NEAR, frequency_band=(8, 100), vary="each", constraint=row)
        assert optimum.status.item() == Status.DESIGN_OPTIMAL
        rng = np.random.default_rng(4)
        directions = rng.normal(size=(12, 3)) * np.repeat([1e-3, 1e-2, 0.1, 0.3], 3)[:, None]
        if mean is not None:
            directions -= directions.mean(axis=1, keepdims=True)
        assert_lowest_by_hand(optimum, directions, (8, 100), **parameters)


class TestConstraint:
    @pytest.mark.slow
    def test_a_mean_that_is_fixed_holds(self, each, fixed):
        assert fixed.status.item() == Status.DESIGN_OPTIMAL
        assert fixed.design_value.mean() == pytest.approx(3.0, rel=1e-9)  # required
        assert fixed.design_amplitude > each.design_amplitude
        assert fixed.design_amplitude < fixed.start_amplitude.min() * (1 + 1e-9)
        assert "Held by the constraint" in fixed.certificate.item()
        assert fixed.design_optimality < 1e-8

    def test_an_inactive_constraint_changes_no_digit(self, mistuned, common):
        loose = LinearConstraint([[1.0], [2.0]], [-np.inf, 0.1], [50.0, np.inf])
        optimum = design(mistuned, bounds=NEAR, frequency_band=SMALL, constraint=loose)
        assert optimum.design_value.values == pytest.approx(common.design_value.values, rel=1e-8)
        assert "constraint" not in optimum.certificate.item()

    def test_of_two_equal_rows_the_one_that_binds_holds(self):
        rows = LinearConstraint([[1.0], [1.0]], [-np.inf, 5.0], [9.0, np.inf])
        optimum = design(blade(), constraint=rows)
        assert optimum.design_value.item() == pytest.approx(5.0, rel=1e-9)
        assert "Held by the constraint" in optimum.certificate.item()

    def test_constraints_that_nothing_in_the_bounds_satisfies_are_named(self, mistuned):
        far = LinearConstraint(np.ones((1, 3)) / 3, 600.0, 700.0)
        with pytest.raises(ValueError, match="constraint: expected limits that some values"):
            design(mistuned, vary="each", constraint=far)
