"""Nonlinear modes that others state numbers or closed forms of."""

import numpy as np
import pytest

import symhbm as sh
from tests.published import duffing, duffing_problem, two_masses
from tests.quick import quick_first
from tests.reference import STATED

DRY_FRICTION = STATED["two_masses_on_dry_friction"]


def frequency_over_stuck(found):
    return 2 * np.pi * found.frequency.values / np.sqrt(640.0)


@pytest.mark.slow
def test_two_masses_on_dry_friction():
    found = sh.nonlinear_modes(two_masses(21), band=(1e-2, 12.0), place=1, progress=False)
    told, frequency = DRY_FRICTION, frequency_over_stuck(found)
    assert np.sqrt(640.0) == pytest.approx(told["stuck"], abs=5e-5)
    modal = np.log(found.modal_amplitude.values)
    for name in ("at_small", "at_one", "at_large"):
        amplitude, expected = told[name]
        # Six digits, the last one rounded, and interpolated here as well.
        assert np.interp(np.log(amplitude), modal, frequency) == pytest.approx(expected, abs=2e-6)
    assert 2 * np.pi * found.frequency[-1].item() == pytest.approx(told["free"], abs=1e-4)
    # The fold where the mass lets go is theirs as well; the highest frequency agrees to 1e-4.
    assert found.event_kind.values.tolist() == ["fold", "fold", "damping turns"]
    assert frequency.max() == pytest.approx(told["highest"], abs=1.1e-4)


@pytest.mark.slow
def test_fold_of_two_masses_on_dry_friction_is_truncation():
    """With more harmonics it is gone, and the highest frequency moves by 2e-5."""
    few, many = (
        sh.nonlinear_modes(two_masses(highest), band=(0.13, 0.14), place=1, progress=False)
        for highest in (21, 41)
    )
    assert few.event_kind.values.tolist() == ["fold", "fold"]
    assert many.sizes["event"] == 0
    difference = frequency_over_stuck(many).max() - frequency_over_stuck(few).max()
    assert 1e-5 < difference < 3e-5


@pytest.mark.slow
@pytest.mark.parametrize("cubic", quick_first([0.5, -0.5], 1))
def test_duffing_oscillator(cubic):
    problem = duffing_problem(cubic)
    largest = 3.0 if cubic > 0 else 1.2
    found = sh.nonlinear_modes(problem, band=(1e-2, largest), progress=False)
    expected = duffing(1.0, cubic, found.largest_displacement.values[:, 0])
    np.testing.assert_allclose(2 * np.pi * found.frequency, expected, rtol=1e-9)
    assert np.abs(found.damping_ratio).max() < 1e-12


@pytest.mark.slow
def test_similar_modes_of_two_equal_oscillators():
    """R. M. Rosenberg's similar modes: both masses move alike or opposed, at any amplitude."""
    coupling, cubic = 0.3, 0.5
    stiffness = [[1.0 + coupling, -coupling], [-coupling, 1.0 + coupling]]
    model = sh.Model(
        np.eye(2), np.zeros((2, 2)), stiffness, contacts=[(0,), (1,)], cubic_stiffness=cubic
    )
    problem = sh.HarmonicBalance(model, harmonics=range(1, 10, 2))
    for mode, linear in ((0, 1.0), (1, 1.0 + 2 * coupling)):
        found = sh.nonlinear_modes(problem, mode=mode, band=(1e-2, 0.2), progress=False)
        largest = found.largest_displacement.values
        np.testing.assert_allclose(largest[:, 1], largest[:, 0], rtol=1e-9)
        expected = duffing(linear, cubic, largest[:, 0])
        np.testing.assert_allclose(2 * np.pi * found.frequency, expected, rtol=1e-9)
