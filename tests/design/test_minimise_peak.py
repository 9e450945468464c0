"""The load that flattens the peak: closed forms, what holds an optimum, and what is said of it."""

from dataclasses import replace

import numpy as np
import pytest
from xarray import DataArray

import symhbm as sh
from symhbm.continuation.status import Status
from symhbm.design.arguments import read_variables
from symhbm.design.cases import Cases, NamedPeak, Work
from symhbm.design.outcome import certificate, status_of
from symhbm.design.program import ActiveSet, Aim, CaseStatistic, Limits, Program
from symhbm.design.search import Descent, Design, SearchResult
from symhbm.peaks.survey import survey
from symhbm.results.sweep import parse
from tests.designs import (
    BAND,
    BEST_AMPLITUDE,
    BEST_FREQUENCY,
    BEST_LOAD,
    BOUNDS,
    blade,
    closed_peak,
    design,
    minimum,
    ring,
)
from tests.quick import quick_first

AMPLITUDE = 1e-10
"""Relative; the reference has 13 digits, and responses are solved for to 1e-12."""
LOAD = 1e-8
"""Relative, as required; the load follows from a slope, which has as many digits as its equation:
the last Newton step is below 1e-10."""
DIFFERENCES = 1e-5
"""Relative, as required: central differences of steps of 1e-4 are off by 1e-8 for the third
derivative and by 1e-12 / 1e-4 for the digits of the two optima, both times up to 1e2."""
STEP = 1e-4
CONTINUOUS = (
    "mass",
    "stiffness",
    "damping",
    "contact_stiffness",
    "friction_coefficient",
    "force_amplitude",
)


def value(best):
    return float(best.design_value.item())


def amplitude(best):
    return float(best.design_amplitude.item())


@pytest.fixture(scope="module")
def best():
    return design(blade(), n_starts=None)


class TestOneBlade:
    @pytest.mark.parametrize("start", [0.05, 30, 400])
    def test_the_optimum_of_the_closed_form_from_any_start(self, start):
        optimum = design(blade(), start=start)
        # Not from the middle of the bounds alone; stuck ones have no way to go.
        assert optimum.sizes["descent"] == (2 if start < 282 else 1)
        assert optimum.descent_converged.all()
        # Descents compare values, whose last digit leaves half of those of the load.
        assert optimum.descent_value.values == pytest.approx(BEST_LOAD, rel=1e-6)
        assert value(optimum) == pytest.approx(BEST_LOAD, rel=LOAD)
        assert amplitude(optimum) == pytest.approx(BEST_AMPLITUDE, rel=AMPLITUDE)
        assert optimum.active_frequency.item() == pytest.approx(BEST_FREQUENCY, rel=AMPLITUDE)
        assert optimum.status.item() == Status.DESIGN_OPTIMAL
        assert optimum.design_optimality < 1e-10
        assert optimum.design_curvature > 1
        assert optimum.active_kind.item() == "smooth"
        assert optimum.active_multiplier.item() == pytest.approx(1)

    def test_given_starts_lead_to_the_same_optimum(self, best):
        assert value(best) == pytest.approx(BEST_LOAD, rel=LOAD)
        assert best.sizes["start"] == 3  # a factor of 25 apart, at least 3
        assert best.design_lower.item() == pytest.approx(BOUNDS[0])
        assert best.variable.item() == "normal_load"
        assert best.variable_units.item() == "N"

    def test_without_damping_the_optimum_is_a_fraction_of_pi(self):
        force, mass, stiffness, contact, friction = 0.7, 2.0, 3e4, 2e4, 0.25
        problem = blade(
            force=force,
            mass=mass,
            stiffness=stiffness,
            damping=0.0,
            contact_stiffness=contact,
            friction_coefficient=friction,
        )
        optimum = design(problem, bounds=(1.0, 20.0))
        assert value(optimum) == pytest.approx(np.pi * force / (2 * friction), rel=LOAD)
        assert amplitude(optimum) == pytest.approx(np.pi * force / contact, rel=AMPLITUDE)
        omega = np.sqrt((stiffness + contact / 2) / mass)
        assert 2 * np.pi * optimum.active_frequency.item() == pytest.approx(omega, rel=AMPLITUDE)

    def test_both_factors_together_have_no_one_optimum(self):
        names = ["friction_coefficient", "normal_load"]
        bounds = {"friction_coefficient": (0.1, 1.0), "normal_load": (0.1, 100.0)}
        optimum = design(blade(), names, bounds)
        assert np.prod(optimum.design_value) == pytest.approx(BEST_LOAD * 0.5, rel=LOAD)
        assert amplitude(optimum) == pytest.approx(BEST_AMPLITUDE, rel=AMPLITUDE)
        assert "curvature vanishes" in optimum.certificate.item()
        assert np.isnan(optimum.design_value_by_force_amplitude).all()
        assert optimum.design_amplitude_by_force_amplitude.item() == pytest.approx(
            amplitude(optimum)
        )

    def test_a_contact_is_the_better_the_stiffer(self):
        optimum = design(blade(normal_load=3.0), "contact_stiffness", (2e3, 2e4))
        assert optimum.status.item() == Status.DESIGN_AT_BOUND
        assert value(optimum) == pytest.approx(2e4, rel=1e-15)
        assert amplitude(optimum) == pytest.approx(closed_peak(3.0, 2e4), rel=AMPLITUDE)
        assert "contact_stiffness at its upper bound" in optimum.certificate.item()

    def test_a_bound_holds_by_the_slope_of_the_response(self):
        optimum = design(blade(), bounds=(0.05, 2.0))
        assert optimum.status.item() == Status.DESIGN_AT_BOUND
        assert value(optimum) == pytest.approx(2.0, rel=1e-15)

        more, less = (np.log(closed_peak(2 * (1 + side * STEP))) for side in (1, -1))
        slope = (more - less) / (2 * STEP)
        assert optimum.design_bound_multiplier.item() == pytest.approx(slope, rel=DIFFERENCES)
        by_load = optimum.design_amplitude_by_normal_load.item() * 2.0 / amplitude(optimum)
        assert by_load == pytest.approx(slope, rel=DIFFERENCES)

    def test_bounds_that_nearly_touch(self):
        optimum = design(blade(), bounds=(3.0, 3.0 + 1e-6))
        assert 3.0 <= value(optimum) <= 3.0 + 1e-6
        assert optimum.status.item() == Status.DESIGN_AT_BOUND

    def test_a_divided_and_a_reversed_band(self):
        whole = [(40.0, 20.0), (20.0, 5.0)]
        optimum = design(blade(), frequency_band=whole, bounds=(1.0, 10.0))
        assert value(optimum) == pytest.approx(BEST_LOAD, rel=LOAD)

    def test_derivatives_by_the_force_are_ratios(self, best):
        assert best.design_value_by_force_amplitude.item() == pytest.approx(value(best), rel=LOAD)
        by_force = best.design_amplitude_by_force_amplitude.item()
        assert by_force == pytest.approx(amplitude(best), rel=AMPLITUDE)


CASES = {
    "contact_stiffness": np.array([1e4, 2e4]),
    "force_amplitude": np.array([1.0, 1.9]),
}
"""A blade that wants less friction, and one that wants more: both hold the optimum."""


def over(**values):
    return {name: DataArray(one, dims="case") for name, one in values.items()}


@pytest.fixture(scope="module")
def both():
    return design(blade(), bounds=(2.0, 10.0), over=over(**CASES))


def resolved(name, optimum, swept):
    """Differences of optimal values and responses, one parameter a little more and less."""
    bounds = (value(optimum) * 0.98, value(optimum) * 1.02)
    ends = []
    for sign in (1, -1):
        if name in swept:
            step = STEP * swept[name].max()
            changed = swept | {name: swept[name] + sign * step}
            problem = blade()
        else:
            nominal = float(np.max(blade().parameters[name]))
            step, changed = STEP * nominal, swept
            problem = blade().with_parameters(**{name: nominal + sign * step})
        ends.append(design(problem, bounds=bounds, over=over(**changed) or None))
    more, less = ends
    assert {more.status.item(), less.status.item()} == {Status.DESIGN_OPTIMAL}
    return (
        (value(more) - value(less)) / (2 * step),
        (amplitude(more) - amplitude(less)) / (2 * step),
    )


class TestSensitivity:
    @pytest.mark.parametrize("name", CONTINUOUS)
    def test_derivatives_are_those_of_optima_solved_again(self, best, name):
        by_value, by_amplitude = resolved(name, best, {})
        assert best[f"design_value_by_{name}"].item() == pytest.approx(by_value, rel=DIFFERENCES)
        # By friction it vanishes: the load makes up for it.
        assert best[f"design_amplitude_by_{name}"].item() == pytest.approx(
            by_amplitude, rel=DIFFERENCES, abs=1e-9 * amplitude(best)
        )


def assert_two_hold(optimum, problem, band, swept):
    """Two maxima are equal, and their gradients, by differences of located peaks, cancel."""
    assert optimum.status.item() == Status.DESIGN_OPTIMAL
    assert optimum.active_case.values.tolist() == [0, 1]
    one, other = optimum.active_amplitude.values
    assert one == pytest.approx(other, rel=1e-8)  # required
    assert optimum.case_amplitude.values == pytest.approx([amplitude(optimum)] * 2, rel=1e-8)
    weights = optimum.active_multiplier.values
    assert np.all(weights > 0)
    assert weights.sum() == pytest.approx(1, abs=1e-12)
    assert np.isinf(optimum.design_curvature)
    loads = value(optimum) * np.array([1 - STEP, 1 + STEP])
    peaks = sh.frf(problem, band, over={"normal_load": loads} | swept, progress=False)
    heights = np.log(peaks.peak_amplitude.max("peak").transpose("normal_load", "case").values)
    slopes = (heights[1] - heights[0]) / (2 * STEP)
    assert slopes[0] > 0.01 > -0.01 > slopes[1] or slopes[1] > 0.01 > -0.01 > slopes[0]
    assert weights @ slopes == pytest.approx(0, abs=1e-6)  # differences: STEP^2 and more


class TestTwoCases:
    def test_two_maxima_hold(self, both):
        assert_two_hold(both, blade(), BAND, over(**CASES))

    def test_every_case_may_have_its_own_band(self, both):
        bands = DataArray([[5.0, 40.0], [15.0, 30.0]], dims=("case", "edge"))
        optimum = design(blade(), frequency_band=bands, bounds=(2.0, 10.0), over=over(**CASES))
        assert value(optimum) == pytest.approx(value(both), rel=LOAD)

    def test_bands_are_read_by_the_names_of_their_dimensions(self):
        bands = DataArray([[5.0, 6.0], [40.0, 41.0]], dims=("edge", "case"))
        optimum = design(blade(), frequency_band=bands, bounds=(2.0, 10.0), over=over(**CASES))
        assert "5 to 40 Hz and 6 to 41 Hz" in optimum.certificate.item()


class TestRing:
    def test_one_harmonic_is_one_blade(self):
        optimum = design(ring(), bounds=(0.5, 20.0), frequency_band=(5.0, 350.0))
        ratio = 2 * np.sin(np.pi * 3 / 13)
        at, least = minimum(lambda load: closed_peak(load, 1e6, ratio), (0.5, 20.0))
        assert amplitude(optimum) == pytest.approx(least, rel=AMPLITUDE)
        assert value(optimum) == pytest.approx(at, rel=1e-6)
        assert value(optimum) == pytest.approx(2.36742084, rel=1e-8)
        assert optimum.n_sectors == 13
        assert optimum.design_value_by_force_amplitude.item() == pytest.approx(
            value(optimum), rel=LOAD
        )

    @pytest.mark.slow
    def test_three_harmonics_by_a_scan_around(self):
        problem = ring(harmonics=(1, 3, 5))
        optimum = design(problem, frequency_band=(5.0, 350.0), n_starts=None)
        assert value(optimum) == pytest.approx(2.0156126, rel=1e-7)
        assert_lowest_peak(optimum)


def assert_lowest_peak(optimum, steps=(0.01, 0.05, 0.2)):
    """Full responses around: the peak is that of the design, and higher beside it."""
    problem, band = (
        sh.datasets.rebuild(optimum),
        (optimum.frequency.min().item(), optimum.frequency.max().item()),
    )
    factors = sorted([1 - step for step in steps] + [1.0] + [1 + step for step in steps])
    loads = value(optimum) * np.array(factors)
    peaks = sh.frf(problem, band, over={"normal_load": loads}, progress=False)
    heights = peaks.peak_amplitude.max("peak").values
    middle = len(steps)
    assert heights[middle] == pytest.approx(amplitude(optimum), rel=AMPLITUDE)
    assert np.all(np.diff(heights[: middle + 1]) < 0)
    assert np.all(np.diff(heights[middle:]) > 0)


class TestCertificate:
    def test_no_response_in_the_band_is_higher(self, best):
        grid = np.unique(
            np.concatenate(
                [np.linspace(*BAND, 300), BEST_FREQUENCY * (1 + np.geomspace(1e-9, 1e-2, 50))]
            )
        )
        dense = sh.frf(sh.datasets.rebuild(best), BAND, at=grid, progress=False)
        # The nearest of these is a billionth beside the peak, where the response is the same.
        assert dense.amplitude.max() <= amplitude(best) * (1 + 1e-9)
        assert dense.amplitude.max() == pytest.approx(amplitude(best), rel=1e-9)

    def test_no_load_beside_is_better(self, best):
        assert_lowest_peak(best)

    def test_certificate_of_proved_and_unproved_statements(self, best):
        text = best.certificate.item()
        assert "At this design the largest response over 5 to 40 Hz is 0.00030822885" in text
        assert "Checked: the response was followed once more, and none of its" in text
        assert "a smooth peak at 19.496559 Hz" in text
        assert "strict local minimum" in text
        assert "and that no other design within the bounds is better" in text
        assert "cubic" not in text


def held_at(load):
    """Active set, status and certificate of a search that stops at a load."""
    problem, bands = blade(), (BAND,)
    variables = read_variables(problem, "normal_load", BOUNDS, "common")
    program = Program(variables, CaseStatistic(), (Aim.of_peak(1),), Limits.none(1), ("largest",))
    peaks = [NamedPeak("largest", problem, [bands])]
    cases = Cases(Work(peaks, parse(problem, None), program.variables))
    x = np.log([load])
    states = cases(x)
    design = Design(x, states, states[0].height)
    active = ActiveSet.of(program, x, states, program.step(states, x, 1e-12))
    searched = SearchResult(design, active, [design], [Descent(design, True, active)])
    return active, status_of(program, searched), certificate(program, searched, bands, cases)


@pytest.mark.parametrize("distance", [0.0, 1e-7, -1e-5, 1e-3, -1e-1])
def test_a_design_with_a_slope_is_no_optimum(distance):
    """Beside the best load the response is the same to many digits; its slope is not."""
    active, status, text = held_at(BEST_LOAD * (1 + distance))
    # By the closed form, over the logarithm of the load.
    logarithms = np.log(BEST_LOAD) + np.array([-1, 0, 1]) * 1e-3
    low, top, high = (np.log(closed_peak(np.exp(at))) for at in logarithms)
    curvature = (low - 2 * top + high) / 1e-6
    if abs(distance) < 1e-2:
        # To first order in the distance, and the digits of the best load.
        assert active.stationarity == pytest.approx(curvature * abs(distance), rel=0.02, abs=1e-9)
    assert active.stationarity < 1e-8 or distance
    assert status == (Status.DESIGN_STALLED if distance else Status.DESIGN_OPTIMAL)
    assert f"below {max(active.stationarity, 1e-16):.1e} of the response" in text


def test_a_saddle_is_no_optimum():
    """Where the response falls to second order nothing is found, however small its slope."""
    active, _, _ = held_at(BEST_LOAD)
    bent = [replace(followed, hessian=-followed.hessian) for followed in active.maxima]
    saddle = replace(active, maxima=bent)
    assert saddle.curvature == pytest.approx(-active.curvature, rel=1e-6)
    assert saddle.stationarity < 1e-8
    state = replace(survey_of_best(), contenders=bent)
    design = Design(active.x, [state], state.height)
    searched = SearchResult(design, saddle, [design], [Descent(design, True, saddle)])
    assert status_of(saddle.program, searched) == Status.DESIGN_STALLED
    text = certificate(saddle.program, searched, (BAND,), cases_of(blade()))
    assert "a lower response may lie close by" in text


def cases_of(problem):
    space = read_variables(problem, "normal_load", BOUNDS, "common")
    return Cases(Work([NamedPeak("largest", problem, [(BAND,)])], parse(problem, None), space))


def survey_of_best():
    return cases_of(blade())(np.log([BEST_LOAD]))[0]


FORCED = over(force_amplitude=np.array([0.01, 1.0]), engine_order=np.array([0, 1]))
"""Blades that move together, which no contact touches, and one engine order that is quieter."""
STIFF = over(force_amplitude=np.array([1.0, 200.0]), stiffness=np.array([1e4, 9e4]))
"""One blade, and one whose resonance lies beyond the band, driven harder."""
ENDS = {
    "no resonance": (blade, {}, dict(frequency_band=(40.0, 60.0)), "WITHOUT_PEAK", "holds no peak"),
    "lower bound": (blade, {}, dict(bounds=(5.0, 200.0)), "AT_BOUND", "at its lower bound"),
    "stuck": (blade, {}, dict(bounds=(300.0, 500.0)), "WITHOUT_EFFECT", "contacts never slip"),
    "plateau": (
        ring,
        dict(n_blades=3, contact_stiffness=1e5, engine_order=1),
        dict(frequency_band=(5.0, 120.0), over=FORCED, start=0.06),
        "ON_PLATEAU",
        "does not change with the design here",
    ),
    "unbounded": (
        blade,
        dict(damping=0.0),
        dict(bounds=(0.05, 1.0)),
        "UNBOUNDED",
        "Nothing is known: the largest response is not bounded at any design tried (unbounded at "
        "15.9155 Hz)",
    ),
    "end of the band": (blade, {}, dict(over=STIFF), "AT_EDGE", "the end of the band of case 1"),
}


class TestEnds:
    @pytest.mark.parametrize("which", ENDS)
    def test_every_end_has_its_words(self, which):
        build, parameters, options, status, words = ENDS[which]
        optimum = design(build(**parameters), **options)
        assert optimum.status.item() == Status[f"DESIGN_{status}"]
        assert words in optimum.certificate.item()
        lower, upper = options.get("bounds", BOUNDS)
        assert lower <= value(optimum) <= upper
        unbounded = status == "UNBOUNDED"
        assert np.isinf(amplitude(optimum)) if unbounded else np.isfinite(amplitude(optimum))
        assert (
            amplitude(optimum) == pytest.approx(optimum.start_amplitude.min().item())
            or amplitude(optimum) < optimum.start_amplitude.min()
        )

    def test_a_failed_search_raises_on_demand(self):
        with pytest.raises(sh.SolveError, match="does not change") as caught:
            design(blade(), bounds=(300.0, 500.0), throw=True)
        assert caught.value.result.status.item() == Status.DESIGN_WITHOUT_EFFECT


class TestArchive:
    def test_a_case_that_is_rebuilt_has_its_own_values(self, both):
        problem = sh.datasets.rebuild(both.isel(case=1))
        assert problem.parameters["contact_stiffness"] == 2e4
        assert problem.parameters["normal_load"] == pytest.approx(value(both), rel=1e-15)
        again = sh.frf(problem, BAND, progress=False)
        assert again.peak_amplitude.max() == pytest.approx(amplitude(both), rel=AMPLITUDE)


def test_a_band_that_is_not_followed_to_its_end_proves_nothing(monkeypatch):
    """What lies beyond the last point of an incomplete survey may be higher."""

    def cut(problem, bands, **options):
        return replace(survey(problem, bands, **options), status=sh.Status.PEAK_NOT_LOCATED)

    monkeypatch.setattr("symhbm.design.cases.survey", cut)
    optimum = design(blade())
    assert optimum.status.item() == sh.Status.DESIGN_NOT_SURVEYED
    assert np.isinf(optimum.design_amplitude)
    assert "Nothing is known" in optimum.certificate.item()
    assert str(sh.Status.PEAK_NOT_LOCATED) in optimum.certificate.item()


@pytest.mark.slow
@pytest.mark.parametrize("band", quick_first([[(15.0, 18.0)], [(5.0, 15.0), (22.0, 30.0)]], 1))
def test_beside_a_resonance_the_ends_of_bands_count(band):
    """The peak outside is no maximum; the ends of two bands rise against each other."""
    with pytest.warns(RuntimeWarning, match="no peak lies in the band"):
        best = sh.minimise_peak(blade(), "normal_load", (0.1, 50.0), band, progress=False)
    loads = np.geomspace(1.0, 4.0, 40)
    ends = [
        float(np.nanmax(sh.frf(blade(normal_load=load), one, progress=False).amplitude))
        for one in band
        for load in loads
    ]
    lowest = np.reshape(ends, (len(band), -1)).max(axis=0).min()
    assert best.design_amplitude.item() <= lowest * (1 + 1e-9)
    assert best.status.item() == sh.Status.DESIGN_WITHOUT_PEAK
    assert set(best.active_kind.values) <= {"edge"}
