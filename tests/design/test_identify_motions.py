"""Fits of peaks, of nonlinear modes and of natural modes, alone and together with responses."""

from typing import Any

import numpy as np
import pytest

import symhbm as sh
from symhbm.design.identification.objective import Objective, objective_of
from symhbm.design.identification.observations import Rows
from tests.design.differences import differences
from tests.measurements import measured_responses
from tests.problems import one_blade, ring_of_blades

TRUE = {"normal_load": 3.0, "contact_stiffness": 1e4, "damping": 2.0}
WRONG = {"normal_load": 7.0, "contact_stiffness": 5e3, "damping": 1.0}
LEVELS, AMPLITUDES = [0.3, 1.0, 2.0], [1e-4, 3e-4, 1e-3]
SURE: Any = dict(deviation=1e-3, frequency_deviation=1e-3)


def blade(harmonics=(1,), **changes):
    model = one_blade(**(TRUE | changes))
    return sh.HarmonicBalance(model, sh.forces.PointForce(), harmonics)


def ring(**changes):
    model = ring_of_blades(5, **(TRUE | changes))
    return sh.HarmonicBalance(model, sh.forces.EngineOrder(1), (1, 3))


def peaks_of(problem, levels=LEVELS, **given):
    """Peaks of frequency responses, of one harmonic that of its amplitude."""
    found = sh.frf(problem, (10, 30), over={"force_amplitude": levels}, progress=False)
    highest = found.isel(peak=found.peak_amplitude.argmax("peak"))
    at = highest.peak_frequency.values, highest.peak_amplitude.values
    options: Any = dict(units="m", form="peak", deviation=1e-7, frequency_deviation=1e-3) | given
    return sh.datasets.measured(*at, force_amplitude=levels, **options)


def modes_of(problem, amplitudes=AMPLITUDES, **given):
    found = sh.nonlinear_modes(problem, at=amplitudes, band=(1e-5, 1e-2), progress=False, **given)
    first = found.isel(solution=0)
    options: Any = dict(units="m", form="mode", amplitude=amplitudes) | SURE | given
    return sh.datasets.measured(first.frequency.values, first.damping_ratio.values, **options)


def signals():
    """Two harmonics of an acceleration and of a strain of a blade on a base that moves."""
    model = one_blade(**TRUE).with_outputs({"strain": {0: 3.0}}, "1")
    base = sh.forces.BaseMotion(acceleration=1.2, influence={0: 1.0})
    time, rng = np.linspace(0, 1, 400), np.random.default_rng(3)
    waves = [np.cos(2 * np.pi * n * 18.0 * time) for n in (1, 3)]
    signal = 1e-3 * (waves[0] + 0.2 * waves[1] + 0.1 * rng.standard_normal(len(time)))
    options: Any = dict(harmonics=(1, 3), place=0)
    data = [
        sh.datasets.measured_signal(time, 1e4 * signal, 18.0, units="m s-2", **options),
        sh.datasets.measured_signal(time, signal, 18.0, units="1", quantity="strain", **options),
    ]
    return sh.HarmonicBalance(model, base, (1, 3)), data


@pytest.mark.parametrize("kind", ["peaks", "accelerations", "modes", "waves", "signals"])
def test_derivatives_agree_with_differences(kind):
    rng, names = np.random.default_rng(0), [*TRUE]
    at, known = [19.0, 18.0, 17.0], dict(force_amplitude=LEVELS)
    problem: Any = ring() if kind == "waves" else blade((1, 3))
    if kind == "peaks":
        options: Any = dict(units="m", form="peak", frequency_deviation=0.01, **known)
        data = sh.datasets.measured(at, 1e-4 * rng.random(3), deviation=1e-6, **options)
    elif kind == "accelerations":  # of which the frequencies are left out, and a gain is unknown
        options = dict(units="m s-2", form="peak", frequency_deviation=0.01, **known)
        data = sh.datasets.measured(at, 1 + rng.random(3), deviation=0.01, **options)
        data["measured_left_out"].values[::2] = 1
        names[2] = "gain[0]"
    elif kind == "signals":
        problem, data = signals()
    else:
        waves: Any = dict(nodal_diameter=1) if kind == "waves" else {}
        options = dict(units="m", form="mode", amplitude=AMPLITUDES, **SURE, **waves)
        data = [sh.datasets.measured(at, 0.1 * rng.random(3), **options)]
        data.append(sh.datasets.measured(20.0, 0.01, units="m", form="mode", **SURE, **waves))
    objective = objective_of(problem, Rows.of(data), names)
    x = objective.unknowns.start + 0.03 * rng.standard_normal(objective.unknowns.n)
    point = objective.at(x)
    objective.remember(point)
    by_residuals = differences(lambda x: objective.at(x).residuals, x)
    size = np.abs(point.jacobian).max()
    np.testing.assert_allclose(point.jacobian, by_residuals, atol=1e-7 * size, rtol=0)
    by_gradient = differences(lambda x: objective.at(x).gradient, x, 1e-4)
    size = np.abs(point.hessian).max()
    np.testing.assert_allclose(point.hessian, by_gradient, atol=1e-7 * size, rtol=0)


@pytest.mark.parametrize("kind", ["peaks", "modes", "frequencies", "waves", "all"])
def test_true_values_are_found(kind):
    problem, wrong, unknown = blade(), blade(**WRONG), [*TRUE]
    if kind == "peaks":
        data: Any = peaks_of(problem)
    elif kind == "modes":
        data = modes_of(problem)
    elif kind == "frequencies":  # damping is not seen by them
        data, unknown = modes_of(problem), unknown[:2]
        data["measured_left_out"].values[1::2] = 1
    elif kind == "waves":
        problem, wrong = ring(), ring(**WRONG)
        data = modes_of(problem, nodal_diameter=1)
    else:
        small = sh.nonlinear_modes(problem, band=(1e-9, 1e-8), progress=False).isel(point=0)
        at = small.frequency.item(), small.damping_ratio.item()
        data = [peaks_of(problem), modes_of(problem, AMPLITUDES[1:])]
        data.append(sh.datasets.measured(*at, units="m", form="mode", **SURE))
        data.append(measured_responses(problem, [1.0], np.linspace(14, 24, 5)))
    fit = sh.identify(wrong, data, unknown, profiles=False, progress=False, throw=True)
    np.testing.assert_allclose(fit.estimate, [TRUE[name] for name in unknown], rtol=1e-8)


def test_a_fit_of_modes_has_the_mode_over_its_amplitude():
    """Of a problem that nothing drives, too; errors of peaks are those of the exact Hessian."""
    alone = sh.HarmonicBalance(one_blade(**(TRUE | WRONG)))
    fit = sh.identify(alone, modes_of(blade()), [*TRUE], profiles=False, progress=False)
    assert fit.amplitude.max() > 1e-3
    assert fit.damping_ratio.max() > 0.1
    assert np.isfinite(fit.exact_standard_error).all()
    fit = sh.identify(blade(), peaks_of(blade()), [*TRUE], progress=False)
    np.testing.assert_allclose(fit.exact_standard_error, fit.standard_error, rtol=1e-3)
    lower, upper = fit.profile_interval.values.T
    np.testing.assert_allclose((upper - lower) / fit.standard_error / 2, 1.96, rtol=0.05)


def test_the_end_of_a_band_is_no_peak():
    """Where the response rises towards an end alone, no value of damping has a peak in the band."""
    known: Any = dict(deviation=1e-6, frequency_deviation=0.1, force_amplitude=[1.0, 2.0])
    data = sh.datasets.measured([60.0, 61.0], [1e-5, 2e-5], units="m", form="peak", **known)
    with pytest.raises(sh.SolveError, match="no peak was found from 30 to 120 Hz"):
        sh.identify(blade(), data, "damping", n_starts=2, progress=False)


def test_other_peaks_than_those_followed_are_told(monkeypatch):
    monkeypatch.setattr(Objective, "afresh", lambda self, x: self.at(x).value + 1.0)
    with pytest.warns(RuntimeWarning, match="other solutions are found from scratch"):
        sh.identify(blade(), peaks_of(blade()), "damping", profiles=False, progress=False)


BAD = [
    (dict(form="mode", units="m s-2"), ValueError, "of a length"),
    (dict(form="mode", band=(1, 2)), ValueError, "it is of peaks"),
    (dict(form="peak", amplitude=1.0), ValueError, "it is of modes"),
    (dict(form="peak", band=(11, 12)), ValueError, "frequencies of peaks in it"),
    (dict(form="magnitude", mode=2), ValueError, "it is of peaks or modes"),
    (dict(form="peak", response=[-1.0]), ValueError, "no less than 0"),
    (dict(form="magnitude", response=None), TypeError, "expected numbers"),
]


@pytest.mark.parametrize(("change", "kind", "words"), BAD)
def test_bad_measurements_of_motions_are_refused(change, kind, words):
    given: Any = dict(frequency=[10.0], response=[0.1], units="m") | change
    with pytest.raises(kind, match=words):
        sh.datasets.measured(given.pop("frequency"), given.pop("response"), **given)


@pytest.mark.parametrize(
    ("unknown", "given", "words"),
    [
        ("mass", {}, "does not change the mass matrix"),
        ({"normal_load": {"vary": "each"}}, dict(nodal_diameter=1), "alike on all sectors"),
        ("damping", dict(mode=7), "expected a number from 0"),
        ("damping", dict(place="tip"), "tip"),
    ],
)
def test_modes_that_cannot_be_fitted_are_refused(unknown, given, words):
    data = sh.datasets.measured([20.0] * 3, [0.01] * 3, units="m", form="mode", **SURE, **given)
    with pytest.raises((ValueError, KeyError, TypeError, sh.SolveError), match=words):
        sh.identify(ring(), data, unknown, progress=False)
