"""Aims of the user, peaks by name, and constraints: closed forms, grids, and bad input in words."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from designs import BAND, BEST_AMPLITUDE, BEST_LOAD, blade, design, ring
from scipy.optimize import Bounds, LinearConstraint, NonlinearConstraint, minimize_scalar
from xarray import DataArray

import symhbm as sh
from studies.closed_form import OneBlade
from symhbm.continuation.status import Status
from symhbm.design.cases import Work
from symhbm.design.maxima import Maxima

NEAR = (0.3, 20.0)
"""Loads [N] about the optima."""
WEIGHT = 2e-5
"""Of a load [m/N]: a Newton is as bad as so much of the peak."""
DIGITS = 1e-9
"""Relative, of two exact solutions."""


def closed_peak(load, friction=0.5):
    """Peak of the blade [m] in closed form."""
    return OneBlade(1.0, 0.5, 1e4, 1e4, friction * load, 1.0, 1.0).peak()[0]


def weighted(peaks, parameters):
    return peaks["largest"] + WEIGHT * parameters["normal_load"][0]


class TestObjective:
    def test_a_weight_and_a_peak(self):
        optimum = design(blade(), bounds=NEAR, objective=weighted)
        closed = minimize_scalar(
            lambda log_load: closed_peak(np.exp(log_load)) + WEIGHT * np.exp(log_load),
            bounds=np.log(NEAR),
            method="bounded",
            options={"xatol": 1e-9},
        )
        assert optimum.design_aim.item() == pytest.approx(closed.fun, rel=DIGITS)
        # A minimum of values alone has half their digits.
        assert optimum.design_value.item() == pytest.approx(np.exp(closed.x), rel=1e-6)
        peak = closed_peak(optimum.design_value.item())
        assert optimum.named_peak_amplitude.item() == pytest.approx(peak, rel=1e-10)
        assert optimum.design_status.item() == Status.DESIGN_OPTIMAL
        assert optimum.design_optimality < 1e-9
        assert "At this design the objective over 5 to 40 Hz is" in optimum.certificate.item()

    def test_its_slope_and_curvature_are_exact(self):
        """At a bound the multiplier is the slope of the objective, by differences."""
        optimum = design(blade(), bounds=(0.3, 2.0), objective=weighted)

        def value(log_load):
            load = np.exp(log_load)
            return np.log(closed_peak(load) + WEIGHT * load)

        at, step = np.log(2.0), 1e-4
        slope = (value(at + step) - value(at - step)) / (2 * step)
        assert optimum.design_bound_multiplier.item() == pytest.approx(slope, rel=1e-5)
        inside = design(blade(), bounds=NEAR, objective=weighted)
        at, step = np.log(inside.design_value.item()), 1e-3
        bend = (value(at + step) - 2 * value(at) + value(at - step)) / step**2
        assert inside.design_curvature.item() == pytest.approx(bend, rel=1e-4)

    def test_the_largest_response_itself_is_the_default(self):
        optimum = design(blade(), bounds=NEAR, objective=lambda peaks, _: 7 * peaks["largest"])
        assert optimum.design_value.item() == pytest.approx(BEST_LOAD, rel=1e-8)
        assert optimum.design_aim.item() == pytest.approx(7 * BEST_AMPLITUDE, rel=1e-10)

    def test_powers_of_several_peaks_under_several_loads(self):
        """A product of peaks of two problems, and a stress that goes with the load."""
        soft = blade(contact_stiffness=2e4)
        optimum = design(
            blade(),
            bounds=NEAR,
            peaks={"stiff": {}, "soft": {"problem": soft}},
            objective=lambda peaks, p: (
                ca.sqrt(peaks["stiff"] * peaks["soft"]) * (1 + 0.05 * p["normal_load"][0]) ** 2
            ),
        )

        def value(log_load):
            load = np.exp(log_load)
            other = OneBlade(1.0, 0.5, 1e4, 2e4, 0.5 * load, 1.0, 1.0).peak()[0]
            return np.sqrt(closed_peak(load) * other) * (1 + 0.05 * load) ** 2

        bounds = np.log(NEAR)
        closed = minimize_scalar(value, bounds=bounds, method="bounded", options={"xatol": 1e-9})
        assert optimum.design_aim.item() == pytest.approx(closed.fun, rel=DIGITS)
        assert optimum.named_peak.values.tolist() == ["stiff", "soft"]
        assert optimum.active_named_peak.values.tolist() == [0, 1]
        assert optimum.active_multiplier.values == pytest.approx([0.5, 0.5], abs=1e-8)

    def test_it_is_that_of_statistics_of_cases(self):
        cases = {"contact_stiffness": DataArray([1e4, 2e4], dims="case")}
        options = dict(bounds=NEAR, over=cases, statistic="mean")
        plain = design(blade(), **options)
        same = design(blade(), objective=lambda peaks, _: peaks["largest"] ** 2, **options)
        assert same.design_value.values == pytest.approx(plain.design_value.values, rel=1e-8)
        assert same.design_aim.item() == pytest.approx(plain.design_amplitude.item() ** 2, 1e-9)
        assert same.case_amplitude.dims == ("named_peak", "case")

    def test_it_comes_back_from_an_archive(self, tmp_path):
        optimum = design(blade(), bounds=NEAR, objective=weighted)
        assert sh.load(sh.save(optimum, tmp_path / "own.nc")).identical(optimum)
        assert sh.datasets.rebuild(optimum).parameters["normal_load"] == optimum.design_value.values

    def test_one_degree_of_freedom_of_a_ring(self):
        """The blade that counts is the one that is lowest, at its own best load."""
        problem = ring(3, 1e5, 1, stiffness=np.array([1e4, 1.05e4, 0.95e4]))
        options = dict(bounds=(0.5, 10.0), frequency_band=(30.0, 120.0))
        optimum = design(
            problem, peaks={"one": {"dof": 0}}, objective=lambda peaks, _: peaks["one"], **options
        )
        loads = optimum.design_value.item() * np.array([0.97, 1.0, 1.03])
        beside = sh.frf(
            problem, (30.0, 120.0), over={"normal_load": loads}, peaks="each", progress=False
        )
        of_one = beside.peak_amplitude.where(beside.peak_dof == 0).max("peak").values
        assert optimum.design_aim.item() == pytest.approx(of_one[1], rel=1e-9)
        assert of_one.argmin() == 1
        assert optimum.design_aim < design(problem, **options).design_amplitude


def on_a_grid(problem, loads, frequencies):
    """Largest stored amplitudes at each load, of dense responses without peaks or derivatives."""
    dense = sh.frf(problem, BAND, at=frequencies, over={"normal_load": loads}, progress=False)
    return dense.amplitude.max(("frequency", "dof")).values


class TestGrid:
    """Brute force over parameters and frequencies, from stored amplitudes alone."""

    FREQUENCIES = np.linspace(15.0, 23.0, 1601)
    LOADS = np.geomspace(1.0, 10.0, 61)

    @pytest.mark.slow
    def test_no_load_of_a_grid_is_better(self):
        optimum = design(blade(), bounds=NEAR, objective=weighted)
        value = on_a_grid(blade(), self.LOADS, self.FREQUENCIES) + WEIGHT * self.LOADS
        best = int(value.argmin())
        # A grid of frequencies misses the peak by half of its curvature times a step squared.
        assert value[best] > optimum.design_aim.item() * (1 - 1e-5)
        assert value[best] < optimum.design_aim.item() * (1 + 2e-3)
        beside = self.LOADS[[best - 1, best + 1]]
        assert beside[0] < optimum.design_value.item() < beside[1]

    @pytest.mark.slow
    def test_two_values_under_a_constraint(self):
        """Friction and load with a bound on their product, the load weighs."""
        frictions = np.linspace(0.2, 0.8, 7)
        optimum = design(
            blade(),
            ["normal_load", "friction_coefficient"],
            {"normal_load": (0.5, 20.0), "friction_coefficient": (0.2, 0.8)},
            objective=weighted,
            constraint=lambda p: p["normal_load"] * p["friction_coefficient"] <= 1.2,
        )
        lowest = np.inf
        for friction in frictions:
            loads = self.LOADS[self.LOADS * friction <= 1.2]
            problem = blade(friction_coefficient=friction)
            peaks = on_a_grid(problem, loads, self.FREQUENCIES)
            lowest = min(lowest, float((peaks + WEIGHT * loads).min()))
        assert lowest > optimum.design_aim.item() * (1 - 1e-5)
        assert lowest < optimum.design_aim.item() * 1.02
        load, friction = optimum.design_value.values
        assert load * friction == pytest.approx(1.2, rel=1e-8)
        assert friction == pytest.approx(0.8)
        assert "Held by the constraint" in optimum.certificate.item()


def product(parameters):
    return parameters["normal_load"][0] * parameters["friction_coefficient"][0] <= 1.0


HELD = {
    "linear": LinearConstraint([[1.0]], -np.inf, 2.0),
    "nonlinear": NonlinearConstraint(lambda x: x[0] ** 2, -np.inf, 4.0),
    "NumPy": NonlinearConstraint(lambda x: np.log(x), -np.inf, np.log(2.0)),
    "CasADi": NonlinearConstraint(lambda x: ca.sumsqr(x), -np.inf, 4.0),
    "with its Jacobian": NonlinearConstraint(
        lambda x: x**2, -np.inf, 4.0, jac=lambda x: [[2 * x[0]]]
    ),
    "relation": product,
    "several": [LinearConstraint([[1.0]], 0.5, 3.0), product],
    "equation": lambda p: p["normal_load"] == 2.0,
    "bounds": None,
}


class TestConstraint:
    @pytest.mark.parametrize("which", HELD)
    def test_each_kind_holds_at_the_same_design(self, which):
        bounds = Bounds(0.3, 2.0) if which == "bounds" else NEAR
        optimum = design(blade(), bounds=bounds, constraint=HELD[which])
        assert optimum.design_value.item() == pytest.approx(2.0, rel=1e-9)
        assert optimum.design_amplitude.item() == pytest.approx(closed_peak(2.0), rel=1e-8)
        if which != "bounds":
            assert optimum.design_status.item() == Status.DESIGN_OPTIMAL
            assert "Held by the constraint" in optimum.certificate.item()
            assert np.isinf(optimum.design_curvature)

    def test_one_that_depends_on_other_parameters_has_no_derivative_by_them(self):
        """They are numbers in it: what their change would do to it is not known."""
        optimum = design(blade(), bounds=NEAR, constraint=product)
        assert np.isnan(optimum.design_value_by_friction_coefficient)
        assert np.isnan(optimum.design_amplitude_by_friction_coefficient)
        assert optimum.design_value_by_mass.item() == pytest.approx(0, abs=1e-9)

    def test_a_curved_one_by_two_variables(self):
        """The smaller the load, the more the friction, on a circle."""
        bounds = Bounds([0.5, 0.05], [20.0, 2.0])
        circle = NonlinearConstraint(lambda x: (x[0] / 3) ** 2 + x[1] ** 2, -np.inf, 1.0)
        names = ["normal_load", "friction_coefficient"]
        optimum = design(blade(), names, bounds, constraint=circle)
        load, friction = optimum.design_value.values
        # The largest product on the circle, which is less than the best one.
        assert (load / 3, friction) == pytest.approx((np.sqrt(0.5),) * 2, rel=1e-7)
        assert load * friction < BEST_LOAD * 0.5
        assert optimum.design_status.item() == Status.DESIGN_OPTIMAL

    def test_one_that_nothing_satisfies_as_far_as_it_was_tried(self, tmp_path):
        far = NonlinearConstraint(lambda x: x[0] ** 2, 1e5, 2e5)
        optimum = design(blade(), bounds=NEAR, constraint=far)
        assert optimum.design_status.item() == Status.DESIGN_INFEASIBLE
        assert "satisfies constraint, from 32 starts" in optimum.certificate.item()
        assert sh.load(sh.save(optimum, tmp_path / "none.nc")).identical(optimum)
        with pytest.raises(sh.SolveError, match="no design within the bounds was found"):
            design(blade(), bounds=NEAR, constraint=far, throw=True)


def symbol_of_its_own(peaks, parameters):
    return ca.SX.sym("own") * peaks["largest"]


BAD = {
    "no function": (dict(objective=3), TypeError, "objective=3: expected a function of peaks"),
    "one argument": (dict(objective=lambda peaks: 1), TypeError, "objective: .*it raised TypeErr"),
    "a number": (
        dict(objective=lambda p, q: 1.0),
        TypeError,
        "objective: .*got 1.0, a number that",
    ),
    "nothing": (dict(objective=lambda p, q: None), TypeError, "objective: expected .*got None"),
    "no such peak": (dict(objective=lambda p, q: p["a"]), KeyError, "'a' is no peak; .*largest"),
    "no such parameter": (
        dict(objective=lambda p, q: q["normal_lod"]),
        KeyError,
        "objective: 'normal_lod' is no parameter of the problem.*did you mean 'normal_load'",
    ),
    "constant": (dict(objective=lambda p, q: q["mass"]), ValueError, "objective: .*no design chan"),
    "several": (
        dict(objective=lambda p, q: [p["largest"]] * 2),
        ValueError,
        r"objective: expected one expression, got one of shape \(2, 1\)",
    ),
    "not a number": (
        dict(objective=lambda p, q: p["largest"] * np.nan),
        ValueError,
        "objective: expected a positive number, got nan",
    ),
    "negative": (
        dict(objective=lambda p, q: -p["largest"]),
        ValueError,
        "objective: expected a positive number, got -0.0003.* with largest = 0.0003",
    ),
    "falling": (
        dict(objective=lambda p, q: 1 / p["largest"]),
        ValueError,
        "objective: expected an expression that falls with no peak that rises; .*'largest'",
    ),
    "own symbol": (
        dict(objective=symbol_of_its_own),
        ValueError,
        "objective: .*has own of its own",
    ),
    "branch": (
        dict(objective=lambda p, q: p["largest"] if p["largest"] > 0 else 0),
        TypeError,
        "objective: expected a function that CasADi's symbols go through",
    ),
    "peaks alone": (dict(peaks={"a": {}}), TypeError, "objective=None: expected a function"),
    "no peaks": (dict(peaks={}), TypeError, "peaks={}: expected a mapping of names"),
    "peak of nothing": (dict(peaks={"a": 3}), TypeError, r"peaks\['a'\]=3: expected a name, and a"),
    "peak with a wrong key": (
        dict(peaks={"a": {"freq": (5, 6)}}),
        ValueError,
        r"peaks\['a'\]: expected any of frequency, dof, problem, goal, got 'freq'",
    ),
    "peak in no band": (
        dict(peaks={"a": {"frequency": (5, 5)}}),
        ValueError,
        r"peaks\['a'\]\['frequency'\]=\(5, 5\): expected bands of some width",
    ),
    "peak of no dof": (
        dict(peaks={"a": {"dof": 4}}),
        ValueError,
        r"peaks\['a'\]\['dof'\]: .*0 to 0",
    ),
    "peak of no problem": (
        dict(peaks={"a": {"problem": 4}}),
        TypeError,
        r"peaks\['a'\]\['problem'\]=4: expected a HarmonicBalance",
    ),
    "peak of another size": (
        dict(peaks={"a": {"problem": ring(3)}}),
        ValueError,
        r"peaks\['a'\]\['problem'\]: expected 1 values of normal_load, .*got 3",
    ),
    "fresh": (
        dict(objective=weighted, fresh={"damping": [0.4]}),
        ValueError,
        "fresh: expected None .*with an objective",
    ),
    "bounds of SciPy": (
        dict(bounds=Bounds(3, 1)),
        ValueError,
        "bounds: .*lower < upper for normal",
    ),
    "bounds of nothing": (dict(bounds=Bounds(0, 1)), ValueError, "bounds.lb=.*finite and > 0"),
    "too many bounds": (dict(bounds=Bounds([1, 2], 3)), ValueError, "bounds.lb=.*1 variables"),
    "contradictory": (
        dict(constraint=[LinearConstraint([[1]], 5, 9), LinearConstraint([[1]], 1, 4)]),
        ValueError,
        r"constraint\[0\] and constraint\[1\]: expected limits that some values within the bounds",
    ),
    "contradictory by itself": (
        dict(constraint=[LinearConstraint([[1]], 1, 4), lambda p: p["normal_load"] >= 500]),
        ValueError,
        r"^constraint\[1\]: expected limits that some values",
    ),
    "limits the wrong way": (
        dict(constraint=NonlinearConstraint(lambda x: x[0] ** 2, 4, 2)),
        ValueError,
        "constraint: expected lower limits no larger than upper ones, row 0 has 4 and 2",
    ),
    "wrong Jacobian": (
        dict(constraint=NonlinearConstraint(lambda x: x[0] ** 2, 0, 4, jac=lambda x: [[x[0]]])),
        ValueError,
        "constraint.jac: expected the derivative of fun, which at",
    ),
    "no symbols": (
        dict(constraint=NonlinearConstraint(lambda x: 3.0, 0, 4)),
        TypeError,
        "constraint.fun: expected an expression of CasADi's symbols",
    ),
    "not finite": (
        dict(constraint=NonlinearConstraint(lambda x: ca.sqrt(x[0] - 5), 0, 4)),
        ValueError,
        "constraint: expected finite numbers within the bounds, row 0 has",
    ),
    "no relation": (
        dict(constraint=lambda p: p["normal_load"]),
        TypeError,
        "constraint: expected relations of parameters, for example",
    ),
    "a chain": (
        dict(constraint=lambda p: 1 <= p["normal_load"] <= 2),
        TypeError,
        "constraint: expected a function that CasADi's symbols go through",
    ),
    "of no design": (dict(constraint=lambda p: p["mass"] <= 2), TypeError, "constraint: expected"),
}


@pytest.mark.parametrize("which", BAD)
def test_bad_input_is_named_with_what_is_allowed(which):
    options, error, words = BAD[which]
    with pytest.raises(error, match=words):
        design(blade(), **(dict(bounds=NEAR) | options))


def failing(monkeypatch, fails):
    """Let the responses at some loads not be followed."""
    call = Work.__call__

    def some(self, number, x, previous):
        if fails(float(np.exp(x[0]))):
            return Maxima.of_failure(str(Status.MINIMUM_STEP))
        return call(self, number, x, previous)

    monkeypatch.setattr(Work, "__call__", some)


class TestFailures:
    def test_designs_nearby_that_fail_are_no_good_status(self, monkeypatch):
        failing(monkeypatch, lambda load: 4.0 < load < 9.0)
        optimum = design(blade(), bounds=(1.0, 20.0), start=6.0, n_starts=3)
        assert optimum.design_value.item() == pytest.approx(BEST_LOAD, rel=1e-6)
        assert optimum.n_failed > 0
        assert optimum.design_status.item() == Status.DESIGN_BESIDE_FAILURES
        text = optimum.certificate.item()
        assert "could not be followed, the nearest at values up to a factor of" in text
        assert str(Status.MINIMUM_STEP) in text
        with pytest.raises(sh.SolveError, match="better ones there may have been missed"):
            design(blade(), bounds=(1.0, 20.0), start=6.0, n_starts=3, throw=True)

    def test_those_far_away_are_told_as_well(self, monkeypatch):
        failing(monkeypatch, lambda load: load > 60.0)
        optimum = design(blade(), bounds=(0.05, 500.0), n_starts=3)
        assert optimum.design_value.item() == pytest.approx(BEST_LOAD, rel=1e-6)
        assert optimum.design_status.item() == Status.DESIGN_OPTIMAL
        assert optimum.n_failed > 0
        assert "could not be followed" in optimum.certificate.item()

    def test_a_response_that_is_higher_when_followed_again_fails_the_check(self, monkeypatch):
        """The last run beside the search: what it finds higher is no checked optimum."""
        survey = Work.__call__

        def lower(self, number, x, previous):
            state = survey(self, number, x, previous)
            contenders = [replace(one, value=one.value - 1e-6) for one in state.contenders]
            return replace(state, contenders=contenders, height=state.height - 1e-6)

        monkeypatch.setattr(Work, "__call__", lower)
        optimum = design(blade(), bounds=NEAR)
        assert optimum.design_status.item() == Status.DESIGN_NOT_SURVEYED
        assert "The check failed" in optimum.certificate.item()
        assert "Checked" not in optimum.certificate.item()
