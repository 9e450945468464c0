"""Peak curves against closed forms and frequency responses; their statuses and errors."""

import re

import numpy as np
import pytest
from by_hand import Structure
from scipy.interpolate import CubicHermiteSpline

import symhbm as sh
from studies.closed_form import EXACT_DIGITS, one_blade
from symhbm.continuation.status import Status
from symhbm.model.linear import natural_band
from tests.designs import BAND, Failing, blade, ring
from tests.problems import duffing

SINGLE = blade()


def curve(problem=SINGLE, parameter="normal_load", band=(3.0, 4.0), *args, **options):
    return sh.peak_curve(problem, parameter, band, *args, **{"progress": False, **options})


def interpolated(dataset, loads):
    """The curve between its points: cubic, in logarithms."""
    load, amplitude = dataset.normal_load.values, dataset.peak_amplitude.values
    slope = dataset.peak_amplitude_slope.values * load / amplitude
    return np.exp(CubicHermiteSpline(np.log(load), np.log(amplitude), slope)(np.log(loads)))


@pytest.fixture(scope="module")
def single():
    return curve(band=(1.0, 1000.0))


def test_minimum_of_one_blade(single):
    # The digits are those of the design with IPOPT; both are solved for to round-off.
    assert single.minimum_normal_load.values == pytest.approx([3.088578873912], rel=1e-10)
    assert single.minimum_amplitude.values == pytest.approx([3.082288527639e-4], rel=1e-10)
    assert single.minimum_frequency.values == pytest.approx([19.496559186804], rel=1e-10)
    assert single.minimum_kind.values.tolist() == ["smooth"]
    assert single.status.item() == Status.REACHED_END


def test_full_stick_of_one_blade(single):
    stuck = one_blade(single).largest_contact_force() / 0.5
    assert single.event_kind.values.tolist() == ["full stick"]
    # The closed form has the damped resonance, at which the displacement of the contact peaks.
    assert single.event_normal_load.values == pytest.approx([stuck], rel=1e-9)
    beyond = single.sel(normal_load=slice(1.001 * stuck, None))
    # The residual, some round-offs of the forces, is amplified by the resonance.
    assert np.ptp(beyond.peak_amplitude.values) <= 1e-10 * beyond.peak_amplitude.values[0]
    assert not beyond.peak_amplitude_slope.values.any()


def test_closed_form_of_one_blade(single):
    exact = [one_blade(single, normal_load=load).peak() for load in single.normal_load.values]
    amplitude, frequency = np.array(exact).T
    np.testing.assert_allclose(single.peak_amplitude, amplitude, rtol=EXACT_DIGITS)
    # Where the peak is flat the closed form tells its frequency to the root of its digits.
    np.testing.assert_allclose(single.peak_frequency, frequency, rtol=1e-7)
    assert np.all(single.peak_residual_norm < 1e-11)


@pytest.mark.slow
def test_points_are_as_many_as_interpolation_needs(single):
    loads = np.geomspace(1.0, 1000.0, 60)[1:-1]
    exact = [one_blade(single, normal_load=load).peak()[0] for load in loads]
    # Points are added until the estimated error is 1e-5.
    np.testing.assert_allclose(interpolated(single, loads), exact, rtol=3e-5)
    assert single.surveyed.dtype == bool
    assert single.surveyed.values[[0, -1]].all()
    assert single.surveyed.sum() <= single.n_surveys


def test_minimum_of_a_tuned_ring():
    dataset = curve(ring(), band=(2.0, 3.0))
    assert dataset.n_sectors == 13
    assert dataset.minimum_normal_load.values == pytest.approx([2.3674], rel=1e-4)
    load = dataset.minimum_normal_load.item()
    amplitudes = [one_blade(dataset, normal_load=load * f).peak()[0] for f in (0.999, 1.0, 1.001)]
    assert dataset.minimum_amplitude.item() == pytest.approx(amplitudes[1], rel=EXACT_DIGITS)
    assert amplitudes[1] < min(amplitudes[0], amplitudes[2])


def two_dofs_a_blade():
    """Three blades of two masses, their tips in contact: the problem, and the same by hand."""
    rng = np.random.default_rng(5)
    root, tip = 1e4 * rng.uniform(0.9, 1.1, 3), 2e4
    friction, stiffness = np.array([0.5, 0.4, 0.6]), 2e4
    mass = np.kron(np.eye(3), np.diag([1.0, 0.5]))
    elastic = np.kron(np.diag(root), [[1, 0], [0, 0]]) + np.kron(
        np.eye(3), [[tip, -tip], [-tip, tip]]
    )
    damping = 2.0 * mass + 1e-4 * elastic
    contacts = [(1, 3), (3, 5), (5, 1)]
    directions = np.zeros((3, 6))
    for row, (first, second) in zip(directions, contacts, strict=True):
        row[first], row[second] = 1, -1
    force = np.zeros(6, dtype=complex)
    force[1::2] = np.exp(-2j * np.pi * np.arange(3) / 3)
    model = sh.Model(
        mass,
        damping,
        elastic,
        contacts=contacts,
        contact_stiffness=stiffness,
        friction_coefficient=friction,
        normal_load=10.0,
    )
    excitation = sh.forces.HarmonicForce(cosine={1: force.real}, sine={1: -force.imag})

    def by_hand(load):
        matrices = mass, damping, elastic, directions, np.full(3, stiffness)
        return Structure(*matrices, friction * load, force).highest(5, 60)

    return sh.HarmonicBalance(model, excitation), by_hand


def assert_by_hand(dataset, by_hand, loads):
    for load in loads:
        amplitude, frequency = by_hand(load)
        point = dataset.sel(normal_load=load)
        # Corners stand where grids by hand end, to 1e-9 of the frequency.
        assert point.peak_amplitude.item() == pytest.approx(amplitude, rel=2e-9)
        assert point.peak_frequency.item() == pytest.approx(frequency, rel=1e-7)


@pytest.mark.slow
def test_several_degrees_of_freedom_a_blade():
    """The lowest peak is an exchange of two equal peaks."""
    problem, by_hand = two_dofs_a_blade()
    loads = np.array([1.02, 1.05, 1.1])
    dataset = curve(problem, "normal_load", (1.02, 1.1), loads, frequency_band=(5, 60))
    assert dataset.status.item() == Status.REACHED_END
    assert_by_hand(dataset, by_hand, loads)
    assert dataset.minimum_kind.values.tolist() == ["exchange"]
    load = dataset.minimum_normal_load.item()
    assert "exchange of the dominant peak" in dataset.event_kind.values
    peaks = [by_hand(load * factor) for factor in (1 - 1e-6, 1.0, 1 + 1e-6)]
    assert peaks[1][0] == pytest.approx(dataset.minimum_amplitude.item(), rel=2e-9)
    assert peaks[0][0] > peaks[1][0] < peaks[2][0]
    # Other peaks lead on either side.
    assert abs(peaks[0][1] - peaks[2][1]) > 1


@pytest.mark.slow
def test_unbounded():
    undamped = SINGLE.with_parameters(damping=0.0)
    dataset = curve(undamped, "normal_load", (1.2, 2.4), [1.2, 1.5, 2.0, 2.4])
    # mu F_n <= pi f0 / 4: the energy of the force grows with the amplitude as fast as that lost.
    assert np.isinf(dataset.peak_amplitude.values).tolist() == [True, True, False, False]
    assert dataset.peak_kind.values.tolist() == ["unbounded", "unbounded", "smooth", "smooth"]
    assert Status.PEAK_UNBOUNDED in dataset.status.item()
    assert "add damping" in dataset.status.item()
    (pole,) = dataset.event_normal_load.values[
        dataset.event_kind.values == "peak becomes unbounded"
    ]
    # The pole is extrapolated from the last peaks solved for.
    assert pole == pytest.approx(np.pi / 2, rel=1e-5)


@pytest.mark.slow
def test_edge():
    with pytest.raises(sh.SolveError, match="wider frequency band") as caught:
        curve(band=(2.0, 3.0), frequency_band=(18, 19), throw=True)
    dataset = caught.value.result
    assert {*dataset.peak_kind.values} == {"smooth", "edge"}
    crossings = dataset.event_normal_load.values[
        dataset.event_kind.values == "peak crosses the end of the band"
    ]
    frequencies = [one_blade(dataset, normal_load=load).peak()[1] for load in crossings]
    assert frequencies == pytest.approx([18, 19], rel=1e-7)
    assert dataset.minimum_kind.values.tolist() == ["end"]


def test_an_executor_that_fails_loses_nothing():
    with pytest.warns(RuntimeWarning, match="computed in this process"):
        dataset = curve(band=(3.0, 3.2), executor=Failing(1))
    assert dataset.identical(curve(band=(3.0, 3.2)))


def test_problems_of_points(single):
    chosen = sh.datasets.rebuild(single.isel(normal_load=3))
    assert chosen.parameters["normal_load"] == single.normal_load.values[3]
    assert sh.datasets.rebuild(single).parameters["normal_load"] == 10


@pytest.mark.slow
def test_peaks_of_responses_that_fold():
    """A spring that stiffens: over the force, the peak is that of the branch with its folds."""
    problem, band = duffing(), (0.08, 0.4)
    result = sh.peak_curve(
        problem, "force_amplitude", (0.05, 0.25), at=[0.05, 0.18, 0.25], frequency_band=band
    )
    assert result.status.item() == sh.Status.REACHED_END
    # Published for 0.18 N to all digits.
    assert result.peak_amplitude.values[1] == pytest.approx(2.8416245993690933, rel=1e-9)
    for amplitude, peak in zip([0.05, 0.25], result.peak_amplitude.values[[0, 2]], strict=True):
        at = sh.frf(problem.with_parameters(force_amplitude=amplitude), band)
        assert peak == pytest.approx(at.peak_amplitude.item(), rel=1e-9)


def test_natural_band():
    low, high = natural_band([SINGLE.model])
    assert low == pytest.approx(0.2 * 100 / (2 * np.pi))
    assert high == pytest.approx(1.2 * np.sqrt(2e4) / (2 * np.pi))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("normal_lod", (1, 2)), "normal_lod"),
        (("engine_order", (1, 2)), "engine_order"),
        (("normal_load", (1, 1)), "band=(1, 1): expected two different values"),
        (("normal_load", (-1, 1)), "band=(-1, 1): expected values finite and >= 0"),
        (("mass", (0, 1)), "band=(0, 1): expected values finite and > 0"),
        (("normal_load", (1, 2), [3.0]), "at=[3.0]: expected values within the band"),
    ],
)
def test_bad_arguments(arguments, words):
    with pytest.raises((KeyError, ValueError), match=re.escape(words)):
        curve(ring(3, engine_order=1), *arguments)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (dict(frequency_band=(0, 10)), "frequency_band=(0, 10): expected values finite and > 0"),
        (dict(frequency_band=[(1, 3), (2, 4)]), "expected bands that do not overlap"),
        (dict(frequency_band=[1, 2, 3]), "expected two different values"),
    ],
)
def test_bad_options(options, words):
    with pytest.raises((TypeError, ValueError), match=re.escape(words)):
        curve(**options)


def test_friction_over_samples_is_refused():
    sampled = sh.HarmonicBalance(SINGLE.model, SINGLE.excitation, samples=64)
    with pytest.raises(ValueError, match="samples=64: expected a problem with located"):
        curve(sampled)


def opening():
    """A blade whose largest response lies on an island under loads from some 1.631 to 1.665 N."""
    contact = sh.Friction(
        tangential=(0,),
        normal=(1,),
        contact_stiffness=1e4,
        normal_stiffness=1.5e4,
        friction_coefficient=0.5,
        normal_load=1.64,
    )
    stiffness = [[1e4, 3e3], [3e3, 2e4]]
    blade = sh.Model(np.eye(2), np.diag([2.0, 3]), stiffness, contacts={"contact": contact})
    force = sh.forces.HarmonicForce(cosine={1: [1, 0]}, sine={1: [0, -0.5]})
    return sh.HarmonicBalance(blade, force, (0, 1, 2, 3))


@pytest.mark.slow
@pytest.mark.parametrize("at", [[1.6, 1.64, 1.66, 1.67, 1.7], None])
def test_peaks_on_islands_are_told(at):
    problem = opening()
    peaks = curve(problem, band=(1.5, 1.75), frequency_band=(10, 25), at=at)
    assert peaks.status == Status.PEAK_ON_ISLAND
    there = peaks.normal_load.values[peaks.peak_on_island]
    assert there.min() > 1.62
    assert there.max() < 1.6648
    # Independent of it: what frf reaches at each value, and the island by another parameter.
    for load in (1.6, 1.64, 1.66, 1.67):
        at_load = problem.with_parameters(normal_load=load)
        reached = sh.frf(at_load, (10, 25), progress=False).amplitude.max().item()
        row = peaks.sel(normal_load=load, method="nearest", tolerance=5e-3)
        assert bool(row.peak_on_island) == (1.63 < load < 1.6648)
        assert bool(row.peak_on_island) == (row.peak_amplitude > 1.5 * reached)
    row = peaks.sel(normal_load=1.64, method="nearest")
    followed = sh.follow(
        problem, "normal_load", (1.5, 1.75), frequency=row.peak_frequency.item(), progress=False
    )
    crossed = np.abs(followed.normal_load - row.normal_load) < 0.03
    assert followed.amplitude.values[crossed].max() > 0.97 * row.peak_amplitude


@pytest.mark.slow
def test_between_values_off_an_island_its_ends_are_no_missed_peaks():
    peaks = curve(opening(), band=(1.5, 1.75), frequency_band=(10, 25), at=[1.5, 1.75])
    assert not peaks.peak_on_island.any()
    assert peaks.status == Status.PEAK_ON_ISLAND


def test_the_problem_of_a_curve_stays_as_it_was():
    problem = blade()
    before = problem.differentiable
    assert "cubic_stiffness" not in before  # idle: nothing is derived by it
    with pytest.raises(ValueError, match="frequency_band"):
        curve(problem, "cubic_stiffness", (1e6, 2e6), frequency_band=(3.0, -1.0))
    curve(problem, "cubic_stiffness", (1e-3, 2e-3), frequency_band=BAND)
    assert problem.differentiable == before


def test_a_value_that_only_the_structure_refuses_is_a_value_error():
    positive = sh.laws.Parameter("N/m^3", "stiffness", "$k_3$", "N/m^3", bound="positive")
    cubic = sh.laws.SmoothLaw(lambda y, v, p: p["k3"] * y**3, {"k3": (1e6, positive)}, [(0,)])
    model = sh.Model([[1.0]], [[0.5]], [[1e4]], contacts={"stop": cubic})
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(), (1,))
    with pytest.raises(ValueError, match="k3"):
        curve(problem, "k3", (0.0, 1e6), frequency_band=BAND)
