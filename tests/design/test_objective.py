"""Aims of the user, peaks by name, and constraints: closed forms, grids, and bad input in words."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import Bounds, LinearConstraint, NonlinearConstraint

import symhbm as sh
from symhbm.continuation.status import Status
from symhbm.design.cases import Work
from tests.designs import (
    BEST_LOAD,
    blade,
    closed_peak,
    design,
    failing,
    minimum,
    ring,
)

NEAR = (0.3, 20.0)
"""Loads [N] about the optima."""
WEIGHT = 2e-5
"""Of a load [m/N]: a Newton is as bad as so much of the peak."""
DIGITS = 1e-9
"""Relative, of two exact solutions."""


def weighted(peaks, parameters):
    return peaks["largest"] + WEIGHT * parameters["normal_load"][0]


class TestObjective:
    def test_a_weight_and_a_peak(self):
        optimum = design(blade(), bounds=NEAR, objective=weighted)
        at, least = minimum(lambda load: closed_peak(load) + WEIGHT * load, NEAR)
        assert optimum.design_aim.item() == pytest.approx(least, rel=DIGITS)
        assert optimum.design_value.item() == pytest.approx(at, rel=1e-6)
        peak = closed_peak(optimum.design_value.item())
        assert optimum.named_peak_amplitude.item() == pytest.approx(peak, rel=1e-10)
        assert optimum.status.item() == Status.DESIGN_OPTIMAL
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

        def value(load):
            return np.sqrt(closed_peak(load) * closed_peak(load, 2e4)) * (1 + 0.05 * load) ** 2

        assert optimum.design_aim.item() == pytest.approx(minimum(value, NEAR)[1], rel=DIGITS)
        assert optimum.named_peak.values.tolist() == ["stiff", "soft"]
        assert optimum.active_named_peak.values.tolist() == [0, 1]
        assert optimum.active_multiplier.values == pytest.approx([0.5, 0.5], abs=1e-8)

    @pytest.mark.slow
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
            assert optimum.status.item() == Status.DESIGN_OPTIMAL
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
        assert optimum.status.item() == Status.DESIGN_OPTIMAL

    @pytest.mark.slow
    def test_one_that_nothing_satisfies_as_far_as_it_was_tried(self, tmp_path):
        far = NonlinearConstraint(lambda x: x[0] ** 2, 1e5, 2e5)
        optimum = design(blade(), bounds=NEAR, constraint=far)
        assert optimum.status.item() == Status.DESIGN_INFEASIBLE
        assert "satisfies constraint, from 32 starts" in optimum.certificate.item()
        assert sh.load(sh.save(optimum, tmp_path / "none.nc")).identical(optimum)
        with pytest.raises(sh.SolveError, match="no design within the bounds was found"):
            design(blade(), bounds=NEAR, constraint=far, throw=True)


class TestFailures:
    @pytest.mark.slow
    def test_designs_nearby_that_fail_are_no_good_status(self, monkeypatch):
        failing(monkeypatch, lambda load: 4.0 < load < 9.0)
        optimum = design(blade(), bounds=(1.0, 20.0), start=6.0, n_starts=3)
        assert optimum.design_value.item() == pytest.approx(BEST_LOAD, rel=1e-6)
        assert optimum.n_failed > 0
        assert optimum.status.item() == Status.DESIGN_BESIDE_FAILURES
        text = optimum.certificate.item()
        assert "could not be followed, the nearest at values up to a factor of" in text
        assert str(Status.MINIMUM_STEP) in text
        with pytest.raises(sh.SolveError, match="better ones there may have been missed"):
            design(blade(), bounds=(1.0, 20.0), start=6.0, n_starts=3, throw=True)

    def test_those_far_away_are_told_as_well(self, monkeypatch):
        failing(monkeypatch, lambda load: load > 60.0)
        optimum = design(blade(), bounds=(0.05, 500.0), n_starts=3)
        assert optimum.design_value.item() == pytest.approx(BEST_LOAD, rel=1e-6)
        assert optimum.status.item() == Status.DESIGN_OPTIMAL
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
        assert optimum.status.item() == Status.DESIGN_NOT_SURVEYED
        assert "The check failed" in optimum.certificate.item()
        assert "Checked" not in optimum.certificate.item()
