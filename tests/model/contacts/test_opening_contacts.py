"""Responses of structures whose contacts open: balances, events, folds, archives, derivatives."""

import numpy as np
import pytest

import symhbm as sh
from tests.pressed_contact import gap_stop, two_way

EXACT = {
    16: [-3.998492401e-05, 3.674271150e-02, 3.409874388e-05, 7.795083125e-06, 4.465171591e-04],
    18: [-9.987179539e-05, 3.632012543e-03, 1.422607796e-05, 5.773367971e-06, 5.075708575e-04],
    22: [-1.446979086e-04, 1.156848381e-03, 1.033308484e-05, 2.088340095e-06, 8.408895006e-04],
    24: [-2.054309655e-04, 8.460516758e-04, 1.326422932e-05, 8.488495698e-07, 1.532925347e-03],
    27: [2.465003671e-04, 5.968948334e-04, 2.347823917e-05, 4.674807206e-06, 6.695183424e-03],
}
"""Exact motions of `two_way` by frequency [Hz]: mean, sizes of harmonics 1, 2, 3 of x, 1 of y."""
TRUNCATION = {
    1: {16: 5e-4, 18: 1e-3, 22: 1e-2, 24: 2.5e-2, 27: 2.5e-2},
    3: {16: 1.5e-4, 18: 3e-4, 22: 2.5e-4, 24: 2.5e-4, 27: 2.5e-4},
    5: {16: 8e-5, 18: 7e-5, 22: 2.5e-5, 24: 2.5e-5, 27: 2.5e-5},
    9: {16: 2.5e-5, 18: 1.5e-5, 22: 1.5e-6, 24: 1.5e-6, 27: 5e-6},
    25: {16: 1e-6, 18: 4e-7, 22: 1.5e-7, 24: 4e-8, 27: 4e-7},
}
"""Largest error of balances with harmonics up to a highest one, over the largest entry."""


def problem_of(highest):
    return two_way().with_harmonics(tuple(range(highest + 1)))


def stop_problem(highest):
    return gap_stop().with_harmonics(tuple(range(highest + 1)))


@pytest.mark.parametrize("highest", TRUNCATION)
def test_cold_starts_find_exact_motions_up_to_truncation(highest):
    problem = problem_of(highest)
    for frequency, expected in EXACT.items():
        found = sh.solve(problem, frequency)
        assert found.status.item().startswith("success")
        assert found.iterations.item() <= 15
        phasor = found.coefficient.isel(point=0) if "point" in found.dims else found.coefficient
        phasor = np.hypot(*np.moveaxis(phasor.values.reshape(2, -1, 2), -1, 0))
        mean = found.coefficient.values.reshape(2, -1, 2)[0, 0, 0]
        sizes = [mean, *phasor[0, 1:4], *[0] * max(3 - highest, 0), phasor[1, 1]]
        kept = np.arange(5) <= highest
        kept[4] = True
        error = np.abs(np.array(sizes) - expected)[kept].max() / np.abs(expected).max()
        assert error <= TRUNCATION[highest][frequency], (frequency, error)


def test_a_path_lands_on_the_onset_of_opening():
    response = sh.frf(problem_of(3), (10, 35))
    assert response.status.item() == sh.Status.REACHED_END
    assert response.event_kind.values.tolist() == ["onset of opening"]
    onset = sh.solve(problem_of(3), response.event_frequency.values[0])
    assert onset.least_normal_force.item() == pytest.approx(0, abs=1e-8)
    beyond = response.frequency.values - response.event_frequency.values[0]
    away = np.abs(beyond) > 1e-9  # at the onset itself round-off tells
    np.testing.assert_array_equal(response.contact_state[away, 0] == 2, beyond[away] > 0)
    share = response.open_fraction.values[away, 0]
    np.testing.assert_array_equal(share > 0, beyond[away] > 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("highest", "folds"), [(9, (20.47063, 23.06090)), (25, (20.47064, 23.06092))]
)
def test_folds_and_openings_of_a_stop(highest, folds):
    response = sh.frf(stop_problem(highest), (10, 35))
    kinds, found = response.event_kind.values, response.event_frequency.values
    np.testing.assert_allclose(np.sort(found[kinds == "fold"]), folds, atol=1e-5)
    # The closed response opens where its amplitude is N0 / k_n.
    np.testing.assert_allclose(found[kinds == "onset of opening"], 22.51015948, atol=1e-8)
    np.testing.assert_allclose(found[kinds == "end of opening"], 31.82780472, atol=1e-8)
    assert response.peak_frequency.item() == pytest.approx(20.5113, abs=1e-3)
    assert response.peak_amplitude.item() == pytest.approx(2.39268e-2, abs=1e-6)


def test_one_harmonic_opens_where_a_closed_form_says():
    problem = stop_problem(1)
    found = sh.frf(problem, (10, 35))
    openings = found.event_frequency.values[found.event_kind.values != "fold"]
    # |X| = N0 / k_n with both springs: |k + k_n - w^2 + i c w| = F k_n / N0.
    square = np.roots([1, 4 - 2 * 3e4, 3e4**2 - (5 * 2e4 / 10) ** 2])
    np.testing.assert_allclose(np.sort(openings), np.sort(np.sqrt(square)) / 2 / np.pi, rtol=1e-10)
