"""What is designed: variables and values, bad input in words, and loads of single contacts."""

import numpy as np
import pytest
import scipy.sparse as sp
from by_hand import Structure
from designs import blade, design, ring
from scipy.optimize import LinearConstraint
from xarray import DataArray

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


class TestBadInput:
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


class TestConstraint:
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
