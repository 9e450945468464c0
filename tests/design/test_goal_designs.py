"""Designs of goals and of one frequency, beside minima of values that are solved for one by one."""

import numpy as np
import pytest
from xarray import DataArray

import symhbm as sh
from symhbm.continuation.status import Status
from tests.designs import BAND, blade, design, minimum


def test_response_at_one_frequency():
    """Between sticking and slipping freely neither end of the loads is best."""
    problem, frequency = blade(), 20.2
    optimum = design(problem, bounds=(0.5, 8.0), frequency_band=frequency, n_starts=5)

    def amplitude(load):
        return sh.solve(problem.with_parameters(normal_load=load), frequency).amplitude.item()

    grid = [amplitude(load) for load in np.geomspace(0.5, 8.0, 200)]
    assert optimum.design_amplitude.item() <= min(grid) * (1 + 1e-12)
    at = optimum.design_value.item()
    assert amplitude(at) == pytest.approx(optimum.design_amplitude.item(), rel=1e-12)
    assert "at 20.2 Hz" in optimum.certificate.item()
    assert "its 1 stored points" in optimum.certificate.item()


def test_one_frequency_of_each_case():
    """The weight of a load holds the optimum, which the band of the two frequencies does not."""
    cases = DataArray([1.0, 1.2], dims="case")
    frequency = DataArray([19.0, 19.6], dims="case")
    optimum = design(
        blade(), bounds=(0.5, 8.0), frequency_band=frequency, over={"force_amplitude": cases},
        objective=lambda peaks, p: peaks["largest"] * (1 + p["normal_load"][0]),
    )  # fmt: skip

    def value(load):
        pairs = zip(cases.values, frequency.values, strict=True)
        found = [
            sh.solve(
                blade().with_parameters(normal_load=load, force_amplitude=force), at
            ).amplitude.item()
            for force, at in pairs
        ]
        return max(found) * (1 + load)

    assert optimum.design_aim.item() == pytest.approx(value(optimum.design_value.item()), 1e-11)
    assert optimum.case_amplitude.dims == ("named_peak", "case")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("goal", "weight"), [(sh.goals.SlipDistance(), 0.2), (sh.goals.Dissipation(), 0.05)]
)
def test_a_peak_and_wear(goal, weight):
    problem = blade((1, 3))
    optimum = design(
        problem, bounds=(2.0, 8.0),
        peaks={"tip": {}, "wear": {"goal": goal}},
        objective=lambda peaks, _: peaks["tip"] + weight * peaks["wear"],
    )  # fmt: skip

    def value(load):
        one = problem.with_parameters(normal_load=load)
        response = sh.frf(one, BAND, progress=False)
        peak = response.isel(peak=0)
        at = sh.frf(one, BAND, at=[float(peak.peak_frequency)], progress=False)
        worn = at.dissipation.max().item()
        if isinstance(goal, sh.goals.SlipDistance):
            worn /= 0.5 * load
        return peak.peak_amplitude.item() + weight * worn

    at, least = minimum(value, (2.0, 8.0))
    # Of one contact both peak together.
    assert optimum.design_aim.item() == pytest.approx(least, rel=1e-9)
    assert optimum.design_value.item() == pytest.approx(at, rel=1e-5)
    assert optimum.status.item() == Status.DESIGN_OPTIMAL
    assert optimum.named_peak_units.values.tolist() == ["m", goal.units]
    assert (
        f"wear {optimum.named_peak_amplitude.values[1]:.10g} {goal.units}"
        in optimum.certificate.item()
    )


def test_contacts_that_stick_wear_nothing():
    optimum = design(
        blade(), bounds=(0.5, 500.0), peaks={"wear": {"goal": sh.goals.SlipDistance()}},
        objective=lambda peaks, _: peaks["wear"],
    )  # fmt: skip
    assert optimum.design_aim.item() == 0.0
    assert optimum.named_peak_amplitude.item() == 0.0
    assert optimum.status.item() == Status.DESIGN_ON_PLATEAU


def test_a_negative_goal_is_refused():
    class Fed(sh.goals.Dissipation):
        def value(self, at):
            return -super().value(at)

    given = dict(peaks={"a": {"goal": Fed()}}, objective=lambda peaks, _: peaks["a"])
    with pytest.raises(ValueError, match=r"Fed\(.*\): expected a goal of no less than 0, got -"):
        design(blade(), bounds=(1, 6), **given)
