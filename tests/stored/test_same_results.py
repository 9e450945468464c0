"""Random problems have the results of before: no peak and no event is lost, invented or moved."""

from functools import cache

import numpy as np
import pytest

import symhbm as sh
from tests.stored.problems import KINDS, OF_EACH, case
from tests.stored.results import BEFORE_SPEED, Found, found, read

NEAR = 1e-11
"""Largest relative difference of frequencies and amplitudes; they differ by up to 5e-13."""
OFTEN = 2
"""Problems of each kind that are computed whenever tests are."""
MISSED = {("gyroscopic forces", 34): 15.61789243}
"""Peaks [Hz] that were not found before; a scan shows them.

It rises by 4e-5 of itself above the valley beside it, by 1e-6 of the largest response.
"""
INVENTED = {("contacts that open", 34): 34.95057488}
"""Peaks [Hz] that were found before and are none: a scan falls throughout.

At an end of slip in a plane, before which slopes were round-off.
"""

NEWER = ("period doubling", "Neimark-Sacker", "symmetry breaking", "change of stability")
"""Kinds of events that were not told before."""


@cache
def before():
    return read(BEFORE_SPEED)


def without(peaks, frequency):
    """Peaks but for the one at a frequency [Hz], which must be there; they come one after another.

    ``peaks`` are frequencies, amplitudes and kinds.
    """
    keep = np.abs(peaks[0] - frequency) > 1e-6
    assert np.sum(~keep) == 1
    return [values[keep] for values in peaks]


def peaks_of(response: Found):
    return [response.peak_frequency, response.peak_amplitude, response.peak_kind]


def same(name, response: Found, expected: Found):
    assert response.status == expected.status
    peaks, of_before = peaks_of(response), peaks_of(expected)
    if name in MISSED:
        peaks = without(peaks, MISSED[name])
    if name in INVENTED:
        of_before = without(of_before, INVENTED[name])
    frequency, amplitude, kind = of_before
    assert peaks[2].tolist() == kind.tolist()
    np.testing.assert_allclose(peaks[0], frequency, rtol=NEAR)
    np.testing.assert_allclose(peaks[1], amplitude, rtol=NEAR)
    told = ~np.isin(response.event_kind, NEWER)
    assert response.event_kind[told].tolist() == expected.event_kind.tolist()
    assert response.event_contact[told].tolist() == expected.event_contact.tolist()
    np.testing.assert_allclose(response.event_frequency[told], expected.event_frequency, rtol=NEAR)
    np.testing.assert_allclose(response.amplitude, expected.amplitude, rtol=NEAR)


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        pytest.param(kind, number, marks=[pytest.mark.slow] * (number >= OFTEN))
        for kind in KINDS
        for number in range(OF_EACH)
    ],
)
def test_results_are_those_of_before(kind, number):
    """Along the path and on a grid."""
    expected = before()[kind, number]
    for response in found(case(kind, number)):
        same((kind, number), response, expected)


@pytest.mark.parametrize(("name", "frequency"), MISSED.items())
def test_peaks_that_were_missed_are_there(name, frequency):
    """Points around them are solved for, and are lower."""
    problem, band, _ = case(*name)
    at = frequency + np.linspace(-2e-3, 2e-3, 9)
    amplitude = sh.frf(problem, band, at=at, progress=False).amplitude.max("dof").values
    assert np.all(np.diff(amplitude)[:4] > 0)
    assert np.all(np.diff(amplitude)[4:] < 0)
