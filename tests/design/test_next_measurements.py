"""What is proposed to be measured next makes estimates surer than most others would."""

from typing import Any

import numpy as np
import pytest

import symhbm as sh
from symhbm.design.identification import next_measurements
from tests.measurements import measured_responses
from tests.problems import one_blade
from tests.quick import quick_first

FREQUENCIES = np.linspace(14, 24, 9)


def fitted(**changes):
    problem = sh.HarmonicBalance(one_blade(**changes), sh.forces.PointForce())
    data = measured_responses(problem, [0.7], FREQUENCIES, deviation=2e-6)
    given: Any = dict(profiles=False, progress=False)
    return problem, data, sh.identify(problem, data, ["normal_load", "contact_stiffness"], **given)


def candidates(levels):
    return sh.datasets.measured(
        FREQUENCIES,
        np.zeros(len(FREQUENCIES)) + 0j,
        units="m",
        deviation=2e-6,
        force_amplitude=np.reshape(levels, (-1, 1)),
    )


@pytest.mark.slow
@pytest.mark.parametrize("criterion", quick_first(["D", "A"], 1))
def test_expected_errors_are_those_of_a_fit_with_the_measurements(criterion):
    problem, data, fit = fitted()
    levels = [0.3, 1.5, 4.0]
    ranked = next_measurements(fit, candidates(levels), criterion=criterion)
    order = ranked.candidate_force_amplitude.values.tolist()
    assert sorted(order) == levels
    for i, level in enumerate(order):
        more = measured_responses(problem, [level], FREQUENCIES, deviation=2e-6)
        both = sh.identify(
            problem, [data, more], ["normal_load", "contact_stiffness"], profiles=False,
            progress=False,
        )  # fmt: skip
        np.testing.assert_allclose(ranked.expected_error[i], both.standard_error, rtol=1e-6)
    along = ranked.information_gain if criterion == "D" else -ranked.mean_square_error
    assert (np.diff(along) <= 0).all()


def test_bad_candidates_are_refused():
    _, _, fit = fitted()
    without = sh.datasets.measured(20.0, 0j, units="m")
    with pytest.raises(ValueError, match=r"candidates: expected standard deviations"):
        next_measurements(fit, without)
    with pytest.raises(TypeError, match=r"fit=3: expected a result"):
        next_measurements(3, without)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match=r"criterion='E': expected one of 'D', 'A'"):
        next_measurements(fit, candidates([1.0]), criterion="E")
    with pytest.raises(KeyError, match=r"start: 'normal_load' is no unknown; allowed: damping"):
        next_measurements(fit, candidates([1.0]), unknown=["damping"])
    with pytest.raises(ValueError, match=r"unknown: expected those of the fit"):
        next_measurements(
            fit, candidates([1.0]), unknown=["normal_load", "contact_stiffness", "damping"]
        )
