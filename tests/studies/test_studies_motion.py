"""Landmarks of the studies that compare the balance with the exact motion in time."""

import json
from pathlib import Path

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig04_hysteresis_loop as fig04
from studies import fig08_engine_orders as fig08
from studies import one_harmonic_validity as validity
from studies import travelling_wave
from studies.run import run
from symhbm.time_domain.exact_motion import exact_motion

EXACT = json.loads(
    (Path(__file__).parent.parent.parent / "data" / "reference" / "exact_values.json").read_text()
)


@pytest.fixture(scope="module")
def loop():
    return fig04.compute(progress=False)


@pytest.fixture(scope="module")
def corners():
    """The map at its smallest and its largest engine order and load, and where nothing slips."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(validity, "ENGINE_ORDERS", (1, 3, 6))
        patch.setattr(validity, "NORMAL_LOADS", (100.0, 2e4))
        return validity.compute(progress=False)


def wave_from_one_harmonic(order, load, frequency):
    """Exact wave, one-harmonic amplitude, and the problem."""
    problem = fig08.problem().with_parameters(engine_order=order, normal_load=load)
    found = sh.solve(problem, frequency, throw=True)
    start = travelling_wave.balanced_state(problem, found.coefficient.values.ravel())
    wave = travelling_wave.travelling_wave(problem, frequency, start)
    return wave, float(found.amplitude.max()), problem


def check_archive(study, dataset, tmp_path, capsys):
    """What is computed survives the archive, is drawn, and says what it is."""
    archive, picture = run(study.NAME, lambda: dataset, study.draw, results=tmp_path)
    scalable = picture.with_suffix(".svg")
    assert capsys.readouterr().out.split() == [str(archive), str(picture), str(scalable)]
    assert picture.stat().st_size > 10_000
    loaded = sh.load(archive)
    assert loaded.identical(dataset.assign_coords({k: loaded[k] for k in loaded.coords}))
    assert loaded.attrs["symhbm_schema"] == 1
    assert {"title", "references", "symhbm_version"} <= set(loaded.attrs)
    for variable in loaded.variables.values():
        assert variable.attrs["units"]
        assert variable.attrs["long_name"]


def test_loop_leaves_an_archive_and_a_picture(loop, tmp_path, capsys):
    check_archive(fig04, loop, tmp_path, capsys)


@pytest.mark.slow
def test_map_leaves_an_archive_and_a_picture(corners, tmp_path, capsys):
    check_archive(validity, corners, tmp_path, capsys)


def test_closed_forms_of_one_harmonic(loop):
    """One blade to ground: onset of slip after the reversal, and area of a parallelogram."""
    one = loop.sel(motion="one harmonic")
    amplitude, limit = float(one.amplitude), float(loop.limit)
    travel = limit / float(loop.contact_stiffness)
    # Round-off of a solved point.
    onset = float(one.theta_star - one.theta_0)
    assert onset == pytest.approx(np.arccos(1 - 2 * travel / amplitude), rel=1e-12)
    area = 4 * limit * (amplitude - travel)
    assert float(one.dissipation) == pytest.approx(area, rel=1e-12)


def test_dissipation_is_the_area_of_the_loop(loop):
    # Trapezoids over 4096 angles: the square of a step of 1.5e-3, times the curvature.
    np.testing.assert_allclose(loop.loop_area, loop.dissipation, rtol=1e-5)


def test_corners_of_the_loop(loop):
    limit, stiffness = float(loop.limit), float(loop.contact_stiffness)
    for motion in loop.motion.values:
        row = loop.sel(motion=motion)
        a, b, c, d = row.mark_displacement.values
        # The exact motion is interpolated between its angles, 3e-7 off.
        assert a == pytest.approx(float(row.amplitude), rel=1e-6)
        assert c == pytest.approx(-a, rel=1e-6)
        assert [a - b, d - c] == pytest.approx([2 * limit / stiffness] * 2, rel=1e-5)
        # Round-off of the balance.
        assert row.mark_force.values == pytest.approx(limit * np.array([1, -1, -1, 1]), rel=1e-9)
        assert np.abs(row.friction_force).max() <= limit * (1 + 1e-9)


def test_the_series_is_that_of_the_marched_force(loop):
    """The coefficients of the force by sums over samples are those of the balance."""
    for motion, harmonics in (("one harmonic", [1]), ("harmonics 1, 3, 5", [1, 3, 5])):
        row = loop.sel(motion=motion)
        marched, seen = (np.fft.rfft(row[name]) for name in ("friction_force", "series"))
        # Kinks leave the square of a step.
        largest = np.abs(marched).max()
        np.testing.assert_allclose(marched[harmonics], seen[harmonics], rtol=0, atol=1e-6 * largest)


def test_exact_loop_is_that_of_the_periodic_motion(loop):
    problem = fig03.problem().with_parameters(normal_load=3)
    motion = sh.periodic_motion(problem, 20.0, throw=True)
    row = loop.sel(motion="exact")
    # The same solution, both to 1e-11.
    assert float(row.dissipation) == pytest.approx(float(motion.dissipation[0]), rel=1e-9)
    # Three harmonics are 1e-5 off, one 1e-3 (found here; the reference has no such point).
    errors = np.abs(loop.amplitude / row.amplitude - 1).values
    assert errors[0] < 2e-3
    assert errors[1] < 2e-5


def test_reference_peaks(corners):
    """Engine orders 1, 3 and 6 at 100 N (data/reference)."""
    for curve in EXACT["ring_EO_1_3_6_Fn100"]:
        row = corners.sel(engine_order=curve["EO"], normal_load=100)
        peak = float(curve["hbm1_peak_X"])
        # The peak of the balance is solved for.
        assert float(row.peak_amplitude) == pytest.approx(peak, rel=1e-9)
        exact = float(curve["exact_peak_x"])
        # The top of a parabola: 3e-5 of the frequency is a hundredth of a half-width or less.
        assert float(row.exact_peak_amplitude) == pytest.approx(exact, rel=1e-6)
        assert bool(row.peak_slips)
    errors = corners.peak_error.sel(normal_load=100)
    assert float(errors.sel(engine_order=1)) == pytest.approx(-0.091, abs=1e-3)
    # Where one harmonic is enough, as the source says.
    assert float(np.abs(errors.sel(engine_order=[3, 6])).max()) < 1e-3


def test_nothing_slips_at_the_largest_load(corners):
    stuck = corners.sel(normal_load=2e4)
    assert not stuck.slips.any()
    assert not stuck.peak_slips.any()
    # Both peaks are those of the linear response; the exact one is looked for, never below.
    assert float(np.abs(stuck.peak_error).max()) < 1e-6
    assert float(np.abs(stuck.worst_error).max()) < 1e-9
    assert float(corners.periodicity.max()) <= 1e-11


@pytest.mark.parametrize(("order", "load", "frequency"), [(1, 10.0, 63.0), (3, 100.0, 211.4)])
def test_wave_is_the_exact_motion_of_the_ring(order, load, frequency):
    """A twenty-sixth of the period tells the whole of it."""
    wave, _, problem = wave_from_one_harmonic(order, load, frequency)
    motion = exact_motion(problem, 2 * np.pi * frequency, start=wave.state)
    assert motion.converged
    # Both repeat themselves to 1e-11; light damping costs two digits.
    assert wave.amplitude == pytest.approx(motion.amplitude.max(), rel=1e-9)
    np.testing.assert_allclose(motion.amplitude, wave.amplitude, rtol=1e-9)


def test_one_harmonic_is_a_third_off():
    """Engine order 1, 10 N, 63 Hz: the worst point of the reference (test_periodic_motion.py)."""
    wave, amplitude, _ = wave_from_one_harmonic(1, 10.0, 63.0)
    # As many digits as were given.
    assert amplitude / wave.amplitude - 1 == pytest.approx(0.35, abs=0.01)
    assert wave.slips


def test_one_harmonic_sticks_where_the_motion_slides():
    """Engine order 2, 1.78 N: 1 % of the response; more harmonics see it (computed here)."""
    load, frequency = float(10**0.25), 13.80628
    wave, amplitude, problem = wave_from_one_harmonic(2, load, frequency)
    assert amplitude < 0.01 * wave.amplitude
    several = sh.HarmonicBalance(problem.model, problem.excitation, range(1, 8, 2))
    found = float(sh.solve(several, frequency, throw=True).amplitude.max())
    # Harmonics to 7 leave 10 %, to 15 still 2 %.
    assert found == pytest.approx(wave.amplitude, rel=0.12)


def test_bad_order_of_the_wave():
    """Orders that are no wave of single blades are refused."""
    problem = fig08.problem().with_parameters(engine_order=13)
    with pytest.raises(ValueError, match="not invertible"):
        travelling_wave.travelling_wave(problem, 20.0, np.zeros(39))
