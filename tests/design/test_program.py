"""The statistic that is minimised, steps of its models, cases of several samples, executors."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from designs import BAND, Failing, blade, design, ring
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import LinearConstraint, minimize
from xarray import DataArray

import symhbm as sh
from symhbm.continuation.status import Status
from symhbm.design.arguments import read_limits
from symhbm.design.cases import FollowedMaximum, Maxima
from symhbm.design.program import Aim, CaseStatistic, Program, Statistic
from symhbm.design.search import feasible
from symhbm.design.variables import DesignVariables, Group

ROUND_OFF = 1e-12
HEIGHTS = st.lists(st.floats(-5, 5), min_size=1, max_size=8).map(np.array)


def space(n_variables, lower=0.1, upper=10.0):
    groups = [Group("normal_load", f"{j}", (j,), lower, upper) for j in range(n_variables)]
    return DesignVariables(tuple(groups), {"normal_load": np.ones(n_variables)})


def statistic_of(kind="worst", tail=0.1):
    return CaseStatistic(Statistic(kind), tail)


def program(kind="worst", tail=0.1, n_variables=1, constraint=None):
    variables = space(n_variables)
    limits = read_limits(ring(3, 1e5, 1), variables, constraint)
    aims = (Aim.of_peak(n_variables),)
    return Program(variables, statistic_of(kind, tail), aims, limits, ("largest",))


class TestStatistic:
    @given(HEIGHTS)
    def test_the_worst_and_the_mean(self, heights):
        assert statistic_of("worst").value(heights) == heights.max()
        mean = np.log(np.exp(heights).mean())
        assert statistic_of("mean").value(heights) == pytest.approx(mean, abs=ROUND_OFF)

    @given(HEIGHTS)
    def test_the_ends_of_the_tail_are_the_mean_and_the_worst(self, heights):
        whole, last = statistic_of("tail", 1.0), statistic_of("tail", 1 / len(heights))
        assert whole.value(heights) == pytest.approx(
            statistic_of("mean").value(heights), abs=ROUND_OFF
        )
        assert last.value(heights) == pytest.approx(heights.max(), abs=ROUND_OFF)
        assert statistic_of("tail", 1e-6).value(heights) == pytest.approx(
            heights.max(), abs=ROUND_OFF
        )

    @given(HEIGHTS, st.floats(0.01, 1.0))
    def test_the_tail_is_the_conditional_value_at_risk(self, heights, tail):
        amplitudes = np.exp(heights)
        # Its definition as a minimum over the quantile, which is one of the values.
        candidates = [
            q + np.maximum(amplitudes - q, 0).sum() / (tail * len(heights)) for q in amplitudes
        ]
        case_statistic = statistic_of("tail", tail)
        assert np.exp(case_statistic.value(heights)) == pytest.approx(
            min(candidates), rel=ROUND_OFF
        )
        weights = case_statistic.weights(heights)
        assert weights.sum() == pytest.approx(1, abs=ROUND_OFF)
        assert np.all((weights >= 0) & (weights <= 1 / (tail * len(heights)) + ROUND_OFF))

    @given(HEIGHTS)
    def test_an_unbounded_response_is_infinite(self, heights):
        for statistic in Statistic:
            assert statistic_of(statistic).value(np.append(heights, np.inf)) == np.inf

    def test_a_kink_is_where_the_last_of_the_tail_are_equal(self):
        heights = np.array([0.0, 1.0, 0.5, 0.5 + 1e-12])
        assert statistic_of("worst").tied(heights) == [1]
        assert statistic_of("mean").tied(heights) == []
        assert statistic_of("tail", 0.5).tied(heights) == [2, 3]
        assert statistic_of("tail", 0.25).tied(heights) == [1]
        assert statistic_of("tail", 1.0).tied(heights) == [0]


def models(rng, n_cases, n_contenders, n_variables):
    """Maxima of cases as convex quadratic models."""
    states = []
    for _ in range(n_cases):
        contenders = []
        for _ in range(n_contenders):
            root = rng.normal(size=(n_variables, n_variables))
            hessian = root @ root.T + np.eye(n_variables)
            value, gradient = rng.normal() / 10, rng.normal(size=n_variables)
            contenders.append(FollowedMaximum(value, gradient, hessian, None, np.zeros(0)))
        contenders.sort(key=lambda contender: -contender.value)
        states.append(Maxima(contenders, contenders[0].value, True))
    return states


class TestStep:
    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize(("statistic", "tail"), [("worst", 1), ("mean", 1), ("tail", 0.6)])
    def test_it_is_the_minimum_of_the_models_in_the_box(self, statistic, tail, seed):
        n = 2
        states = models(np.random.default_rng(seed), 3, 2, n)
        design_program = program(statistic, tail, n)
        step = design_program.step(states, np.zeros(n), 0.3)
        assert step.solved

        def value(d):
            heights = [
                max(p.value + p.gradient @ d + d @ p.hessian @ d / 2 for p in state.contenders)
                for state in states
            ]
            return design_program.statistic.value(np.array(heights))

        assert step.predicted == pytest.approx(value(step.x), abs=1e-9)  # IPOPT: 1e-11
        others = [
            minimize(value, start, method="Nelder-Mead", bounds=[(-0.3, 0.3)] * n).fun
            for start in (np.zeros(n), step.x)
        ]
        assert step.predicted <= min(others) + 1e-9
        weights = np.concatenate(step.weights)
        assert np.all(weights > -1e-8)
        # In the logarithm all shares sum to 1.
        assert weights.sum() == pytest.approx(1, abs=1e-6)

    def test_constraints_are_on_values(self):
        rows = LinearConstraint([[1.0, 1.0]], 2.0, 2.0)
        design_program = program(n_variables=2, constraint=rows)
        x = design_program.nearest(np.log([3.0, 0.5]))
        assert np.exp(x).sum() == pytest.approx(2, abs=1e-9)
        # Orthogonal to the constraint in logarithms: multiples of the values.
        pull = (x - np.log([3.0, 0.5])) / np.exp(x)
        assert pull[0] == pytest.approx(pull[1], rel=1e-6)

    def test_a_design_that_satisfies_constraints_is_found(self):
        rows = LinearConstraint([[1.0, 1.0]], 19.9, 20)
        x = feasible(program(n_variables=2, constraint=rows))
        assert 19.9 * (1 - 1e-8) <= np.exp(x).sum() <= 20 * (1 + 1e-8)


def over(**values):
    return {name: DataArray(one, dims="sample") for name, one in values.items()}


SAMPLES = over(
    contact_stiffness=[1e4, 2e4, 1.4e4],
    force_amplitude=[1.0, 1.9, 1.2],
    normal_load=[10.0, 10.5, 9.5],  # in proportion to the nominal 10
)
SMOOTH = ("mass", "stiffness", "damping", "contact_stiffness", "force_amplitude")
NEAR = (2.0, 10.0)
"""Loads [N] about all optima: one start, in the middle, will do."""
FRESH = over(normal_load=[9.0, 11.0], damping=[0.4, 0.6])


def robust(statistic="worst", **options):
    return design(blade(), bounds=NEAR, over=SAMPLES, statistic=statistic, **options)


@pytest.fixture(scope="module")
def worst():
    return robust(fresh=FRESH)


@pytest.fixture(scope="module")
def mean():
    return robust("mean")


def peaks_at(load, samples):
    """Largest responses of samples with a nominal load."""
    loads = {"normal_load": samples["normal_load"] / 10.0 * load}
    responses = sh.frf(blade(), BAND, over=samples | loads, progress=False)
    return responses.peak_amplitude.max("peak").values


class TestSamples:
    def test_swept_loads_keep_their_proportions(self, worst):
        load = worst.design_value.item()
        assert worst.normal_load.values[:, 0] == pytest.approx(load * np.array([1, 1.05, 0.95]))
        assert worst.normal_load_nominal.item() == pytest.approx(load)
        assert worst.case_amplitude.dims == ("sample",)
        assert worst.case_amplitude.values == pytest.approx(peaks_at(load, SAMPLES), rel=1e-10)

    def test_fresh_cases_are_reported_and_not_designed_for(self, worst):
        expected = peaks_at(worst.design_value.item(), FRESH)
        assert worst.fresh_case_amplitude.values == pytest.approx(expected, rel=1e-10)
        assert worst.fresh_amplitude.item() == pytest.approx(expected.max(), rel=1e-10)

    @pytest.mark.parametrize("statistic", ["worst", "mean", "tail"])
    def test_loads_beside_are_worse(self, worst, mean, statistic):
        tail = 0.5
        best = {"worst": worst, "mean": mean}.get(statistic) or robust("tail", tail=tail)
        design_program = statistic_of(statistic, tail)
        assert best.status.item() == Status.DESIGN_OPTIMAL
        assert best.design_optimality < 1e-8

        def value(factor):
            heights = np.log(peaks_at(best.design_value.item() * factor, SAMPLES))
            return np.exp(design_program.value(heights))

        assert value(1.0) == pytest.approx(best.design_amplitude.item(), rel=1e-10)
        assert min(value(0.98), value(1.02)) > value(1.0)

    @pytest.mark.parametrize(("statistic", "tail"), [("worst", 1 / 3), ("mean", 1.0)])
    def test_the_ends_of_the_tail_are_the_same_designs(self, worst, mean, statistic, tail):
        one, other = {"worst": worst, "mean": mean}[statistic], robust("tail", tail=tail)
        assert other.status.item() == one.status.item()
        # Those by load and friction vanish, as the loads chosen make up for both.
        names = [f"design_{what}_by_{name}" for what in ("value", "amplitude") for name in SMOOTH]
        for name in ["design_value", "design_amplitude", "design_curvature", *names]:
            # Multipliers come with 1e-11 from IPOPT.
            assert other[name].values == pytest.approx(one[name].values, rel=1e-7)

    def test_a_tail_may_end_in_a_kink(self):
        stiffness, force = np.array([1e4, 2e4, 1e4]), np.array([1.0, 1.9, 1.3])
        samples = over(contact_stiffness=stiffness, force_amplitude=force)
        best = design(blade(), bounds=NEAR, over=samples, statistic="tail", tail=0.5)
        assert best.status.item() == Status.DESIGN_OPTIMAL
        assert best.design_optimality < 1e-8
        # The last is the worst everywhere; which of the others comes next changes at this load,
        # where they are equal, as at the optimum of these two alone.
        assert best.case_amplitude[0].item() == pytest.approx(best.case_amplitude[1].item(), 1e-8)
        samples = over(contact_stiffness=stiffness[:2], force_amplitude=force[:2])
        two = design(blade(), bounds=NEAR, over=samples)
        assert best.design_value.item() == pytest.approx(two.design_value.item(), 1e-8)
        for name in SMOOTH:
            moved = two[f"design_value_by_{name}"].item()
            assert best[f"design_value_by_{name}"].item() == pytest.approx(moved, rel=1e-6)


class Refusing(ThreadPoolExecutor):
    """Takes some tasks and then none."""

    def __init__(self, n_taken):
        super().__init__(1)
        self.left = n_taken

    def submit(self, *args, **kwargs):
        self.left -= 1
        if self.left < 0:
            raise OSError("no more")
        return super().submit(*args, **kwargs)


PAIR = {name: samples[:2] for name, samples in SAMPLES.items()}


@pytest.fixture(scope="module")
def pair():
    return design(blade(), bounds=NEAR, over=PAIR)


def same(*optima):
    """Whether they are the same to the bit, whatever evaluated the equations."""
    one, other = (optimum.assign_attrs(equations_evaluated_by="any") for optimum in optima)
    return one.identical(other)


class TestExecutors:
    @pytest.mark.parametrize("kind", [ProcessPoolExecutor, ThreadPoolExecutor])
    def test_executors_change_no_digit(self, pair, kind):
        with kind(2) as executor:
            assert same(design(blade(), bounds=NEAR, over=PAIR, executor=executor), pair)

    @pytest.mark.parametrize("executor", [Refusing(4), Failing(1)], ids=["refusing", "failing"])
    def test_one_that_fails_is_done_without(self, pair, executor):
        with pytest.warns(RuntimeWarning, match=r"the executor failed \((OS|Memory)Error:? no m"):
            optimum = design(blade(), bounds=NEAR, over=PAIR, executor=executor)
        assert same(optimum, pair)
