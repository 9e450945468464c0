"""Frequency responses against closed forms: ends reached, peaks found, work bounded."""

import numpy as np
import pytest
import xarray as xr
from closed_forms import OneBlade
from hypothesis import given
from hypothesis import strategies as st

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from symhbm.numerics import check
from symhbm.results.request import check_grid
from tests.problems import ring_of_blades
from tests.quick import quick_first
from tests.reference import EXACT

TWO_PI = 2 * np.pi


def ring_equivalent(engine_order, load, contact_stiffness=1e6):
    ratio = 2 * abs(np.sin(np.pi * engine_order / 13))
    return OneBlade(1.0, 0.5, 1e4, contact_stiffness, 0.5 * load, ratio=ratio)


@pytest.fixture(scope="module")
def figure_3():
    return fig03.compute(progress=False)


@pytest.fixture(scope="module")
def figure_8():
    return fig08.compute(progress=False)


@pytest.mark.parametrize("load", fig03.NORMAL_LOADS)
def test_peaks_of_figure_3(figure_3, load):
    """Against the amplitude-parametrised closed form, and the published digits."""
    curve = figure_3.sel(normal_load=load)
    peaks = OneBlade(1.0, 0.5, 1e4, 1e4, 0.5 * load).peaks()
    assert int(curve.n_peaks) == len(peaks) == 1
    omega, amplitude = peaks[0]
    # Required: 1e-9. A flat peak of the closed form fixes its frequency to about 1e-10.
    assert float(curve.peak_amplitude[0]) == pytest.approx(amplitude, rel=1e-9)
    assert float(curve.peak_frequency[0]) == pytest.approx(omega / TWO_PI, rel=1e-9)
    assert curve.peak_kind[0] == "smooth"
    row = next(row for row in EXACT["single_blade_peaks"] if row["Fn"] == load)
    assert float(curve.peak_amplitude[0]) == pytest.approx(float(row["hbm1_peak_X"]), rel=1e-9)
    assert float(curve.peak_frequency[0]) == pytest.approx(float(row["hbm1_peak_hz"]), rel=1e-9)


@pytest.mark.parametrize("case", EXACT["ring_EO_1_3_6_Fn100"], ids=lambda case: f"EO{case['EO']}")
def test_peaks_of_figure_8(figure_8, case):
    curve = figure_8.sel(engine_order=case["EO"])
    assert int(curve.n_peaks) == 1
    amplitude, frequency = float(case["hbm1_peak_X"]), float(case["hbm1_peak_hz"])
    assert float(curve.peak_amplitude[0]) == pytest.approx(amplitude, rel=1e-9)
    assert float(curve.peak_frequency[0]) == pytest.approx(frequency, rel=1e-9)


def test_work_of_the_figures(figure_3, figure_8):
    """Linear solves, peaks and events included, and points, of a curve."""
    solves = np.concatenate([ds.linear_solves.values.ravel() for ds in (figure_3, figure_8)])
    assert np.median(solves) <= 140
    assert max(int(ds.n_points.max()) for ds in (figure_3, figure_8)) <= 58


@pytest.mark.parametrize("engine_order", range(7))
@pytest.mark.parametrize("load", quick_first([1, 10, 0, 100, 0.5, 2, 1e5], 1))
def test_every_resonance_of_the_ring_from_any_start(engine_order, load):
    blade = ring_equivalent(engine_order, load)
    expected = blade.peaks()
    problem = fig08.problem().with_parameters(engine_order=engine_order, normal_load=load)
    for first in (5, 7.3, 20, 50):
        curve = sh.frf(problem, (first, 350), throw=True)
        inside = [(w / TWO_PI, a) for w, a in expected if first < w / TWO_PI < 350]
        found = list(zip(curve.peak_frequency.values, curve.peak_amplitude.values, strict=True))
        assert len(found) == len(inside)
        np.testing.assert_allclose(found, inside, rtol=1e-6)
        assert curve.converged.all()
        assert np.all(np.diff(curve.frequency) > 0)
        assert curve.frequency.values[[0, -1]].tolist() == [first, 350]


def test_all_contacts_of_a_tuned_ring_let_go_together(figure_8):
    curve = figure_8.sel(engine_order=3)
    assert int(curve.n_events) == 26
    assert sorted(curve.event_contact.values[:13].tolist()) == list(range(13))
    assert len(set(curve.event_frequency.values[:13])) == 1
    assert set(curve.event_kind.values[:13]) == {"onset of slip"}


def test_undamped_resonance_without_bound_is_reported_and_crossed():
    """mu F_n <= pi f0 / 4: friction alone cannot hold one blade."""
    for load, bounded in ((0, False), (1, False), (1.57, False), (1.58, True), (3, True)):
        blade = fig03.problem().model.with_parameters(damping=0, normal_load=load)
        curve = sh.frf(sh.HarmonicBalance(blade, sh.forces.PointForce()), (10, 30), throw=True)
        assert int(curve.n_peaks) == 1
        assert (curve.peak_kind[0] == "smooth") == bounded
        told = sh.Status.REACHED_END if bounded else sh.Status.WITHOUT_BOUND
        assert curve.status.item() == told
        assert np.isfinite(curve.peak_amplitude[0]) == bounded
        if not bounded:
            assert float(curve.peak_frequency[0]) == pytest.approx(100 / TWO_PI, rel=1e-9)
        assert curve.frequency.values[-1] == 30
        assert curve.converged.all()


def test_a_band_that_ends_at_an_undamped_resonance_is_not_called_complete():
    """Short of the pole the way up is an edge; just beyond it there is no point to go on from."""
    blade = fig03.problem().model.with_parameters(damping=0, normal_load=1)
    problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    pole = 100 / TWO_PI
    for end, peaks in ((pole * (1 - 1e-10), 0), (pole * (1 + 1e-10), 1)):
        with pytest.warns(RuntimeWarning, match="the curve is incomplete: .* without bound"):
            curve = sh.frf(problem, (10, end))
        assert "without bound" in str(curve.status.values)
        assert int(curve.n_peaks) == peaks
        assert curve.converged.all()
        assert float(curve.frequency[-1]) < pole
        with pytest.raises(sh.SolveError, match="without bound"):
            sh.frf(problem, (10, end), throw=True)


def test_light_damping_keeps_its_digits():
    """A quality factor of 1e8: the amplitude is f0/(c w0), to the round-off it amplifies."""
    blade = fig03.problem().model.with_parameters(damping=1e-6, normal_load=0)
    curve = sh.frf(sh.HarmonicBalance(blade, sh.forces.PointForce()), (10, 30), throw=True)
    assert float(curve.peak_amplitude[0]) == pytest.approx(1e4, rel=1e-7)


def test_units_do_not_matter():
    """Millimetres, kilograms and milliseconds give the same curve."""
    length, time = 1e3, 1e3
    force = length / time**2
    disk = ring_of_blades(
        13,
        stiffness=1e4 / time**2,
        damping=0.5 / time,
        contact_stiffness=1e6 / time**2,
        normal_load=100 * force,
    )
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(3, amplitude=force))
    grid = np.linspace(50, 350, 61)
    curve = sh.frf(problem, (50 / time, 350 / time), at=np.clip(grid / time, 50 / time, 350 / time))
    reference = sh.frf(fig08.problem().with_parameters(engine_order=3), (50, 350), at=grid)
    np.testing.assert_allclose(curve.amplitude / length, reference.amplitude, rtol=1e-8)
    np.testing.assert_allclose(curve.peak_frequency * time, reference.peak_frequency, rtol=1e-9)
    np.testing.assert_allclose(curve.event_frequency * time, reference.event_frequency, rtol=1e-9)
    # Points differ where round-off decides on the last iteration before them.
    assert abs(int(curve.n_points) - int(reference.n_points)) <= 1


def test_an_incomplete_curve_says_so():
    with pytest.warns(RuntimeWarning, match="the curve is incomplete"):
        curve = sh.frf(fig03.problem(), (10, 30), max_points=5)
    assert "largest number of points" in str(curve.status.values)
    assert curve.sizes["point"] == 5
    assert curve.converged.all()
    with pytest.raises(sh.SolveError, match="largest number of points") as caught:
        sh.frf(fig03.problem(), (10, 30), max_points=5, throw=True)
    xr.testing.assert_identical(caught.value.result, curve)


def test_grid_beyond_a_broken_path_is_solved_from_nothing():
    grid = [12.0, 29.0]
    with pytest.warns(RuntimeWarning, match="the curve is incomplete"):
        curve = sh.frf(fig03.problem(), (10, 30), at=grid, max_points=5)
    assert curve.converged.all()
    assert "largest number of points" in str(curve.status.values)


@pytest.mark.parametrize("band", [(10, 30), (30, 10)])
@pytest.mark.parametrize("load", [282.8427, 282.843, 283])
def test_slip_for_a_moment_at_the_top_of_a_resonance(load, band):
    """Full stick needs 282.8431 N and more: slip lasts for 1e-4 of the width, or not at all."""
    curve = sh.frf(fig03.problem().with_parameters(normal_load=load), band, throw=True)
    omega, amplitude = OneBlade(1.0, 0.5, 1e4, 1e4, 0.5 * load).peaks()[0]
    assert int(curve.n_events) == (0 if load == 283 else 2)
    assert float(curve.peak_amplitude[0]) == pytest.approx(amplitude, rel=1e-10)
    assert float(curve.peak_frequency[0]) == pytest.approx(omega / TWO_PI, rel=1e-10)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3)])
@pytest.mark.parametrize("stiffness", [1e6, 1e12])
def test_stiff_contacts_in_gross_slip(stiffness, harmonics):
    """The force keeps its digits although k_d y exceeds it a billion times."""
    blade = fig03.problem().model.with_parameters(contact_stiffness=stiffness, normal_load=0.5)
    curve = sh.frf(
        sh.HarmonicBalance(blade, sh.forces.PointForce(), harmonics), (10, 30), throw=True
    )
    if harmonics == (1,):
        _, amplitude = OneBlade(1.0, 0.5, 1e4, stiffness, 0.25).peaks()[0]
        # The reference forms arccos(1 - 2 rho), rho = 2e-8 and smaller: half the digits.
        assert float(curve.peak_amplitude[0]) == pytest.approx(amplitude, rel=1e-7)
    assert curve.converged.all()


@pytest.mark.parametrize(
    ("harmonics", "load", "expected"),
    [
        # Superharmonic resonances far below the main one, narrow and weak.
        ((1, 3), 0.05, [(4.5248, "smooth"), (15.9154, "smooth")]),
        ((1, 3, 5), 0.05, [(2.3838, None), (3.3405, None), (4.4754, None), (15.9154, "smooth")]),
        # A minor loop begins to slip: the path turns by more than 90 degrees.
        ((1, 3), 1, [(6.4202, "corner"), (15.9227, "smooth")]),
    ],
)
def test_superharmonic_peaks(harmonics, load, expected):
    problem = fig03.problem(harmonics).with_parameters(normal_load=load)
    curve = sh.frf(problem, (1, 30), throw=True)
    np.testing.assert_allclose(curve.peak_frequency, [f for f, _ in expected], atol=1e-4)
    for (_, kind), found in zip(expected, curve.peak_kind.values, strict=True):
        assert kind in (None, found)
    # Independent points from nothing, on either side of each peak, are lower.
    for frequency, amplitude in zip(
        curve.peak_frequency.values, curve.peak_amplitude.values, strict=True
    ):
        for side in (-1e-4, 1e-4):
            point = sh.solve(problem, frequency * (1 + side), throw=True)
            assert float(point.amplitude[0]) < amplitude
        top = sh.solve(problem, frequency, throw=True)
        assert float(top.amplitude[0]) == pytest.approx(amplitude, rel=1e-7)


def test_corners_on_the_flank_of_a_superharmonic_are_passed():
    """Steps that shrank from corner to corner do not end the path: both directions agree."""
    disk = ring_of_blades(13, contact_stiffness=1e6, normal_load=5.56)
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(1), harmonics=(1, 3))
    there, back = (sh.frf(problem, band, throw=True, progress=False) for band in ((5, 70), (70, 5)))
    # Solved for, to about 1e-12.
    assert there.peak_amplitude.values == pytest.approx(back.peak_amplitude.values, rel=1e-9)


def test_round_off_at_an_end_of_the_band_is_the_end():
    """``arange`` ends a few units of the last place beyond."""
    grid = np.arange(50, 350.01, 0.1)
    assert grid[-1] > 350
    np.testing.assert_array_equal(check_grid(grid, (350, 50))[[0, -1]], [50, 350])
    np.testing.assert_array_equal(check_grid(grid, (50, 350))[1:-1], grid[1:-1])
    np.testing.assert_array_equal(check_grid([-1e-17, 0.5, 1 + 1e-12], (0, 1)), [0, 0.5, 1])
    np.testing.assert_array_equal(check_grid([1e-13, 0.5], (0, 1)), [0, 0.5])
    with pytest.raises(ValueError, match="ascending"):
        check_grid([0.5, 1, 1 + 1e-12], (0, 1))
    for at, words in (
        ([50.0, 350.00001], "within the band 50 to 350, got 50 to 350.00001"),
        ([49.99999, 60.0], "50 to 350, got 49.99999 to 60"),
        ([20.0, 60.0], "50 to 350, got 20 to 60"),
    ):
        with pytest.raises(ValueError, match=words):
            check_grid(at, (50, 350))


def test_grids_with_round_off_at_their_ends():
    problem = fig03.problem().with_parameters(normal_load=3)
    grid = 15.0 + np.array([-1e-14, 0.5, 1 + 1e-14])
    response = sh.frf(problem, (15, 16), at=grid, progress=False)
    assert response.frequency.values.tolist() == [15.0, 15.5, 16.0] != grid.tolist()
    assert response.converged.all()
    loads = sh.follow(problem, "normal_load", (0, 3), at=[-1e-18, 3 + 1e-14], frequency=15.0)
    assert loads.normal_load.values.tolist() == [0.0, 3.0]


@given(st.lists(st.floats(-1e12, 1e12), min_size=2, max_size=5))
def test_different_numbers_do_not_look_alike(values):
    texts = check.told_apart(*values)
    assert len(set(texts)) == len(set(values))
    for text, value in zip(texts, values, strict=True):
        assert float(text) == pytest.approx(value, rel=1e-5)


@pytest.mark.filterwarnings("ignore:.*switching angles:RuntimeWarning")
def test_solved_angles_are_told_where_motion_reverses_while_it_sticks():
    problem = fig03.problem().with_parameters(normal_load=0.3).with_harmonics((1, 3, 5))
    both = [sh.frf(problem, (5, 12), angles=how, progress=False) for how in (None, "newton")]
    unknown = [np.isnan(found.theta_star.values[found.contact_state == 1]) for found in both]
    assert unknown[0].any()
    assert not unknown[1].any()
