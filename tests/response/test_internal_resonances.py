"""Modes near 1:2 and 1:3: all motions at one amplitude, found without a path by `alternating`."""

import numpy as np
import pytest

import symhbm as sh
from tests import alternating
from tests.quick import quick_first

CUBIC = dict(cubic_stiffness=1e9)
SLIDER = dict(contact_stiffness=5e3, friction_coefficient=1.0, normal_load=1.0)


def matrices(ratio):
    """Two modes at 100 and ``ratio`` times 100 rad/s, both seen at the first degree of freedom."""
    shapes = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    damping, stiffness = (
        shapes @ np.diag(of_modes) @ shapes.T
        for of_modes in ([0.5, 0.5 * ratio], [1e4, (100 * ratio) ** 2])
    )
    return np.eye(2), damping, stiffness


def laws(kind):
    """A law of symhbm and the same for `alternating`, with its samples and its own error."""
    if kind == "cubic":
        spring = sh.Contacts(sh.laws.CubicSpring(), [(0,)], **CUBIC)
        return spring, alternating.polynomial(0.0, 1e9), 32, 1e-8
    if kind == "quadratic":
        values = {"square": (2e6, "N/m^2"), "cube": (1e9, "N/m^3")}
        bush = sh.laws.SmoothLaw(
            lambda y, v, p: p["square"] * y**2 + p["cube"] * y**3, values, [(0,)]
        )
        return bush, alternating.polynomial(2e6, 1e9), 32, 1e-8
    if kind == "stop":
        stop = sh.Gap(normal=(0,), normal_stiffness=1e4, gap=1e-3)
        return stop, alternating.stop(1e4, 1e-3), 256, 1e-5
    return sh.Contacts(sh.laws.Coulomb(), [(0,)], **SLIDER), alternating.slider(5e3, 1.0), 128, 1e-4


def cubic_problem(ratio, harmonics):
    contacts = {"hard": laws("cubic")[0]}
    return sh.HarmonicBalance(sh.Model(*matrices(ratio), contacts=contacts), harmonics=harmonics)


def frequencies(problem, amplitude, **options):
    """Angular frequencies of a mode at one amplitude, in their order, NaN of what was not found."""
    options = dict(band=(1e-5, 1e-1), at=[amplitude], progress=False) | options
    found = sh.nonlinear_modes(problem, **options)
    return np.sort(2 * np.pi * found.frequency.values[0, : found.n_solutions.item()])


def all_motions(kind, ratio, harmonics, amplitude, band=(50, 450)):
    """Angular frequencies within a band of all motions that many random starts lead to."""
    _, law, samples, error = laws(kind)
    free = alternating.FreeMotions(*matrices(ratio), 0, law, harmonics, samples)
    motions = free.found(amplitude, 0, free.starts(amplitude, 0, band, 800))
    # What moves mostly in a higher harmonic repeats sooner: it is no mode of this amplitude.
    size = np.abs(motions[:, :-2]).reshape(len(motions), 2, -1).max(1)
    first = size[:, free.first : free.first + 2].max(1)
    motions = motions[size.max(1) < 2 * first]
    return inside(motions[:, -2], band), error


def inside(values, band):
    return np.sort(values[(values > band[0]) & (values < band[1])])


CASES = [
    ("cubic", 2.95, (1, 3, 5), 0.034, 3),
    ("quadratic", 1.9, (0, 1, 2), 1e-3, 2),
    ("friction", 2.9, (1, 3), 1e-3, 2),
    ("cubic", 2.95, (1, 3), 0.034, 1),
    ("stop", 1.9, (0, 1, 2, 3), 2e-3, 2),
]


@pytest.mark.parametrize(
    ("kind", "ratio", "harmonics", "amplitude", "number"), quick_first(CASES, 3)
)
def test_both_modes_are_all_motions_at_one_amplitude(kind, ratio, harmonics, amplitude, number):
    contacts = {"contact": laws(kind)[0]}
    problem = sh.HarmonicBalance(sh.Model(*matrices(ratio), contacts=contacts), None, harmonics)
    of_modes = [frequencies(problem, amplitude, mode=mode) for mode in (0, 1)]
    expected, error = all_motions(kind, ratio, harmonics, amplitude)
    assert len(expected) == number
    found = inside(np.concatenate(of_modes), (50, 450))
    np.testing.assert_allclose(found, expected, rtol=error)


@pytest.mark.parametrize(
    ("ratio", "amplitude", "number"), [(2.95, 0.034, 3), (2.95, 0.0398, 1), (3.2, 0.03415, 3)]
)
def test_path_that_leaves_within_a_step_or_bends_sharply(ratio, amplitude, number):
    """The third harmonic of the first mode meets the stiffened second one between two steps."""
    expected, error = all_motions("cubic", ratio, (1, 3, 5), amplitude, (280, 320))
    assert len(expected) == number
    found = frequencies(cubic_problem(ratio, (1, 3, 5)), amplitude)
    np.testing.assert_allclose(found, expected, rtol=error)
