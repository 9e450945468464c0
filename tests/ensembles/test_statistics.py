"""Statistics of ensembles against numpy on the same numbers, known laws, and a fact of rings."""

from functools import cache

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.optimize import minimize

import symhbm as sh
from symhbm.ensembles.statistics import population
from symhbm.ensembles.statistics.confidence import drop
from symhbm.ensembles.statistics.extreme_values import _by_moments
from tests.problems import ring_of_blades

BLADES = 5
SAMPLES = 5
GRID = np.linspace(15.0, 24.0, 19)
BAND = (15.0, 24.0)
ROUND_OFF = 1e-12
"""Sums of at most a few hundred terms in another order."""
FAILED = "the path could not be continued"


def problem_of(n_blades):
    return sh.HarmonicBalance(
        ring_of_blades(n_blades, contact_stiffness=4e3), sh.forces.EngineOrder(1)
    )


PROBLEM = problem_of(BLADES)


@cache
def draws():
    spreads = dict(stiffness=0.05, contact_stiffness=0.3, normal_load=0.3)
    return sh.mistuning.uniform(PROBLEM, SAMPLES, seed=3, **spreads)


@cache
def response(kind="grid"):
    options = {"grid": dict(at=GRID), "path": {}, "each": dict(at=GRID, peaks="each")}[kind]
    return sh.frf(PROBLEM, BAND, over=draws(), progress=False, **options)


@cache
def tuned(kind="grid"):
    return sh.frf(PROBLEM, BAND, at=GRID if kind == "grid" else None, progress=False)


def with_failures(dataset):
    """The second sample stopped early, the fourth has a point that is not converged."""
    bad = dataset.copy(deep=True)
    bad["status"][1] = FAILED
    bad["amplitude"][1, 9:] = np.nan
    bad["converged"][1, 9:] = False
    bad["converged"][3, 5] = False
    bad["amplitude"][3, 5] = 1e9
    return bad, bad.isel(sample=[0, 2, 4])


def test_envelope_is_that_of_numpy():
    whole = sh.statistics.envelope(response(), (0.1, 0.5))
    values = response().amplitude.values
    for name, expected in {
        "amplitude_minimum": values.min(axis=0),
        "amplitude_maximum": values.max(axis=0),
        "amplitude_mean": values.mean(axis=0),
        "amplitude_quantile": np.moveaxis(np.quantile(values, [0.1, 0.5], axis=0), 0, -1),
        "largest_minimum": values.max(axis=2).min(axis=0),
        "largest_maximum": values.max(axis=(0, 2)),
        "largest_mean": values.max(axis=2).mean(axis=0),
        "largest_quantile": np.quantile(values.max(axis=2), [0.1, 0.5], axis=0).T,
    }.items():
        np.testing.assert_allclose(whole[name], expected, rtol=ROUND_OFF)
    assert whole.n_used == SAMPLES
    assert whole.n_failed == 0
    rebuilt = sh.datasets.rebuild(whole).parameters
    for name, value in PROBLEM.parameters.items():
        np.testing.assert_array_equal(rebuilt[name], value)


@pytest.mark.parametrize("function", ["envelope", "localisation", "amplification"])
def test_archives_are_read_in_blocks(tmp_path, monkeypatch, function):
    """The result is the same, and no more than a few blocks of an archive are read at a time."""
    arguments = (tuned(),) if function == "amplification" else ()
    whole = getattr(sh.statistics, function)(response(), *arguments)
    path = sh.save(response(), tmp_path / "response.nc")
    block = 2 * 8 * GRID.size * BLADES
    read = []
    slices = population.slices
    for module in ("population", "bands"):
        monkeypatch.setattr(
            f"symhbm.statistics.{module}.slices",
            lambda size, each, most=0: [read.append(s) or s for s in slices(size, each, block)],
        )
    with xr.open_dataset(path) as lazy:
        parts = getattr(sh.statistics, function)(lazy, *arguments).load()
    assert len(read) > 2
    xr.testing.assert_allclose(parts, whole, rtol=ROUND_OFF)


def test_failed_samples_are_counted_and_left_out():
    bad, good = with_failures(response())
    for function in (sh.statistics.envelope, sh.statistics.localisation):
        with_bad, without = function(bad), function(good)
        assert (int(with_bad.n_used), int(with_bad.n_failed)) == (3, 2)
        assert (int(without.n_used), int(without.n_failed)) == (3, 0)
        for name in without.data_vars:
            if "sample" not in without[name].dims and name != "n_failed":
                np.testing.assert_array_equal(with_bad[name], without[name])
    factors = sh.statistics.amplification(bad, tuned())
    expected = sh.statistics.amplification(good, tuned())
    for name in expected.data_vars:
        if "amplification" in str(name):
            kept = factors[name].isel(sample=[0, 2, 4])
            np.testing.assert_array_equal(kept, expected[name])
            lost = factors[name].isel(sample=[1, 3])
            assert np.all(lost == -1) if "dof_of" in str(name) else np.all(np.isnan(lost))
    assert int(sh.statistics.convergence(factors, [2, 3]).n_failed) == 2
    assert int(sh.statistics.worst(bad, tuned()).sample) not in (1, 3)


def test_every_sample_failed():
    bad = response().copy(deep=True)
    bad["status"][:] = FAILED
    with pytest.warns(UserWarning, match="NaN, none of 5 samples is complete"):
        result = sh.statistics.envelope(bad)
    assert int(result.n_used) == 0
    assert np.all(np.isnan(result.amplitude_mean))
    with pytest.warns(UserWarning, match="Amplification factors.*max_points="):
        factors = sh.statistics.amplification(bad, tuned())
    assert np.all(np.isnan(factors.amplification_of_peaks))
    with pytest.raises(ValueError, match=f"{SAMPLES} failed"):
        sh.statistics.worst(bad, tuned())
    with pytest.raises(ValueError, match=f"{SAMPLES} did"):
        sh.statistics.position(factors, 2.0)


@pytest.mark.parametrize("kind", ["grid", "path", "each"])
def test_amplification_of_peaks(kind):
    result, reference = response(kind), tuned("path" if kind == "path" else "grid")
    factors = sh.statistics.amplification(result, reference)
    peak = float(reference.peak_amplitude.max())
    along = "point" if kind == "path" else "frequency"
    highest = np.fmax(
        result.peak_amplitude.max("peak").values, result.amplitude.max((along, "dof")).values
    )
    np.testing.assert_allclose(
        factors.largest_amplification_of_peaks, highest / peak, rtol=ROUND_OFF
    )
    largest = factors.amplification_of_peaks.max("dof")
    np.testing.assert_array_equal(factors.largest_amplification_of_peaks, largest)
    of_blades = {"grid": "grid", "path": "points of the path", "each": "located peaks"}[kind]
    assert factors.amplification_of_peaks.attrs["source"] == of_blades
    assert factors.largest_amplification_of_peaks.attrs["source"] == "located peaks"
    assert ("amplification_at_frequency" in factors) == (kind != "path")
    if kind == "each":
        for dof in range(BLADES):
            located = result.peak_amplitude.where(result.peak_dof == dof).max("peak").values
            top = np.fmax(located, result.amplitude.isel(dof=dof).max("frequency").values)
            np.testing.assert_allclose(
                factors.amplification_of_peaks.isel(dof=dof), top / peak, rtol=ROUND_OFF
            )


def test_amplification_at_the_same_frequency():
    factors = sh.statistics.amplification(response(), tuned())
    ratio = response().amplitude.values / tuned().amplitude.values.max(axis=1)[:, None]
    np.testing.assert_allclose(
        factors.amplification_at_frequency, ratio.max(axis=1), rtol=ROUND_OFF
    )
    np.testing.assert_array_equal(factors.frequency_of_amplification, GRID[ratio.argmax(axis=1)])
    np.testing.assert_array_equal(
        factors.frequency_of_largest_amplification, GRID[ratio.max(axis=2).argmax(axis=1)]
    )
    np.testing.assert_array_equal(
        factors.dof_of_largest_amplification_at_frequency, ratio.max(axis=1).argmax(axis=1)
    )


def test_the_tuned_structure_is_not_amplified():
    """Samples without mistuning: both factors are 1, to the accuracy of a solved point."""
    same = sh.mistuning.uniform(PROBLEM, 2, seed=0, normal_load=0.0)
    result = sh.frf(PROBLEM, BAND, at=GRID, over=same, progress=False)
    factors = sh.statistics.amplification(result, tuned())
    for name in ("amplification_of_peaks", "amplification_at_frequency"):
        np.testing.assert_allclose(factors[f"largest_{name}"], 1, rtol=1e-8)
    # All blades move alike: the lower bound of the ratio.
    spread = sh.statistics.localisation(result)
    np.testing.assert_allclose(spread.localisation, 1 / BLADES, rtol=1e-8)
    np.testing.assert_allclose(spread.localisation_at_peak, 1 / BLADES, rtol=1e-8)


@pytest.mark.parametrize("by", ["amplification_of_peaks", "amplification_at_frequency"])
def test_the_worst_sample(tmp_path, by):
    worst = sh.statistics.worst(response(), tuned(), by)
    factors = sh.statistics.amplification(response(), tuned())
    sample = int(factors[f"largest_{by}"].argmax("sample"))
    assert int(worst.sample) == sample
    assert float(worst[f"largest_{by}"]) == float(factors[f"largest_{by}"].max())
    np.testing.assert_array_equal(worst.normal_load, draws().normal_load[sample])
    problem = sh.datasets.rebuild(sh.load(sh.save(worst, tmp_path / "worst.nc")))
    again = sh.frf(problem, BAND, at=GRID, progress=False)
    # The same curve: points are solved to 1e-9 and better.
    np.testing.assert_allclose(again.amplitude, worst.amplitude, rtol=1e-8)
    blade = int(worst[f"dof_of_largest_{by}"])
    assert float(worst[by][blade]) == float(worst[f"largest_{by}"])


@pytest.mark.parametrize("kind", ["grid", "path"])
def test_localisation_is_that_of_the_largest_response(kind):
    result = sh.statistics.localisation(response(kind))
    for sample in range(SAMPLES):
        one = response(kind).isel(sample=sample)
        peak = int(one.peak_amplitude.fillna(0).argmax("peak"))
        at_peak = np.hypot(*one.peak_coefficient.isel(peak=peak).squeeze("harmonic").values.T)
        along = "point" if kind == "path" else "frequency"
        points = one.amplitude.transpose(along, "dof").values
        if np.nanmax(points) > at_peak.max():
            at_peak = points[np.nanargmax(points.max(axis=1))]
        expected = np.sum(at_peak**4) / np.sum(at_peak**2) ** 2
        assert float(result.localisation_at_peak[sample]) == pytest.approx(expected, rel=1e-9)
    if kind == "grid":
        a = response().amplitude.values
        expected = (a**4).sum(axis=2) / (a**2).sum(axis=2) ** 2
        np.testing.assert_allclose(result.localisation, expected, rtol=ROUND_OFF)
        assert float(result.localisation.min()) >= 1 / BLADES - ROUND_OFF
        assert float(result.localisation.max()) <= 1


def test_statistics_over_another_parameter():
    """Of `follow`: the grid and the names are those of the parameter."""
    over = draws().isel(sample=slice(2))[["stiffness"]]
    options = dict(frequency=17.0, at=[1.0, 2.0, 5.0], progress=False)
    result = sh.follow(PROBLEM, "normal_load", (1, 5), over=over, **options)
    reference = sh.follow(PROBLEM, "normal_load", (1, 5), **options)
    factors = sh.statistics.amplification(result, reference)
    ratio = (result.amplitude / reference.amplitude.max("dof")).max("dof")
    np.testing.assert_allclose(
        factors.largest_amplification_at_frequency, ratio.max("normal_load"), rtol=ROUND_OFF
    )
    assert factors.normal_load_of_largest_amplification.attrs["units"] == "N"
    assert sh.statistics.envelope(result).amplitude_mean.dims == ("normal_load", "dof")


def test_generalised_extreme_values_are_found_again():
    """Within five standard errors of the largest likelihood, of 400 maxima (shape: 0.04)."""
    true = stats.genextreme(0.15, loc=2.0, scale=0.3)
    values = true.rvs(400, random_state=np.random.default_rng(5))
    fit = sh.statistics.extreme_value_fit(values, block=1, n_bootstrap=200)
    assert fit.status == sh.Status.SUCCESS
    assert float(fit["shape"]) == pytest.approx(-0.15, abs=5 * 0.04)
    ours = -stats.genextreme.logpdf(
        values, -float(fit["shape"]), float(fit.location), float(fit.scale)
    ).sum()
    assert ours <= stats.genextreme.nnlf(stats.genextreme.fit(values), values) + 1e-6
    expected = stats.genextreme.ppf(
        fit.level, -float(fit["shape"]), float(fit.location), float(fit.scale)
    )
    np.testing.assert_allclose(fit.return_level, expected, rtol=1e-9)
    for name, value in {"return_level": true.ppf(fit.level), "shape": -0.15}.items():
        interval = fit[f"{name}_interval"].transpose(..., "bound").values
        assert np.all(interval[..., 0] < value)
        assert np.all(value < interval[..., 1])
    distance = stats.kstest(
        values, stats.genextreme(-fit["shape"].item(), fit.location.item(), fit.scale.item()).cdf
    )
    assert float(fit.kolmogorov_smirnov) == pytest.approx(distance.statistic, rel=1e-9)
    assert float(fit.anderson_darling_p_value) > 0.01


@pytest.mark.parametrize("shape", [-0.2, 0.2])
def test_fits_start_at_the_moments_of_the_distribution(shape):
    values = stats.genextreme.ppf((np.arange(2000) + 0.5) / 2000, -shape)
    np.testing.assert_allclose(_by_moments(values, "gev"), [0, 0, shape], atol=5e-3)


EIGHTY = stats.genextreme(0.2, loc=2.0, scale=0.3)
"""A distribution with an upper bound at 3.5."""


@pytest.mark.parametrize("confidence", [0.5, 0.95, 0.999])
def test_the_drop_of_many_values_is_that_of_chi_squared(confidence):
    expected = stats.chi2.ppf(confidence, 1) / 2
    assert drop(10**6, 3, confidence) == pytest.approx(expected, rel=1e-4)


def _drop(values, fit, name, value, index=()):
    """How far the likelihood of scipy falls where a figure is given, at the most."""

    def minus_log(rest):
        if name == "upper_bound":
            scale, shape = np.exp(rest[0]), -np.exp(rest[1])
            return stats.genextreme.nnlf((-shape, value + scale / shape, scale), values)
        if name == "shape":
            return stats.genextreme.nnlf((-value, rest[0], np.exp(rest[1])), values)
        above = stats.genextreme.ppf(fit.level[index], -rest[1], 0, np.exp(rest[0]))
        return stats.genextreme.nnlf((-rest[1], value - above, np.exp(rest[0])), values)

    location, scale, shape = (float(fit[n]) for n in ("location", "scale", "shape"))
    start = {"shape": [location, np.log(scale)], "upper_bound": [np.log(scale), np.log(-shape)]}
    best = minimize(minus_log, start.get(name, [np.log(scale), shape]), method="Nelder-Mead")
    return best.fun - stats.genextreme.nnlf((-shape, location, scale), values)


@pytest.mark.slow
def test_ends_of_intervals_are_equally_likely():
    """At each end the likelihood has fallen as far as Student's distribution allows."""
    values = EIGHTY.rvs(80, random_state=np.random.default_rng(8))
    fit = sh.statistics.extreme_value_fit(values, 1, n_bootstrap=100)
    allowed = 40 * np.log1p(stats.t.ppf(0.975, 77) ** 2 / 77)
    for end in ("lower", "upper"):
        for index in (1, 3):
            value = float(fit.return_level_interval.sel(bound=end)[index])
            assert _drop(values, fit, "return_level", value, index) == pytest.approx(allowed, 1e-2)
        value = float(fit.shape_interval.sel(bound=end))
        assert _drop(values, fit, "shape", value) == pytest.approx(allowed, 1e-2)
    lowest = float(fit.upper_bound_interval.sel(bound="lower"))
    assert _drop(values, fit, "upper_bound", lowest) == pytest.approx(allowed, 1e-2)
    # The shape may be 0 or more, as which there is no bound.
    no_bound = float(fit.shape_interval.sel(bound="upper")) >= 0
    assert np.isinf(float(fit.upper_bound_interval.sel(bound="upper"))) == no_bound


def test_a_wrong_distribution_is_detected():
    """Gumbel's law on maxima of two far clusters."""
    rng = np.random.default_rng(2)
    values = np.concatenate([rng.normal(0, 0.1, 100), rng.normal(5, 0.1, 100)])
    fit = sh.statistics.extreme_value_fit(values, 1, "gumbel", n_bootstrap=100)
    assert fit.status == sh.Status.SUCCESS
    assert float(fit["shape"]) == 0
    assert float(fit.anderson_darling_p_value) < 0.02
    assert float(fit.kolmogorov_smirnov_p_value) < 0.02


@pytest.mark.parametrize(
    ("values", "word"),
    [
        (np.linspace(0, 1, 100), "too few samples: 4 blocks"),
        (np.ones(1000), "all alike"),
        (np.tile(np.arange(25.0) ** 0.01, 30), "all alike"),
    ],
)
def test_fits_that_fail_say_so(values, word):
    with pytest.warns(UserWarning, match=f"extreme_value_fit: NaN, .*{word}.*try .*block="):
        fit = sh.statistics.extreme_value_fit(values)
    assert word in fit.status.item()
    assert np.all(np.isnan(fit.return_level))
    assert np.all(np.isnan(fit.return_level_interval))
    assert np.isnan(float(fit.kolmogorov_smirnov_p_value))


def test_the_number_of_samples_that_an_error_takes():
    """Of normal numbers that of the textbook, and so many samples keep the error."""
    rng = np.random.default_rng(4)
    first = rng.normal(2.0, 0.3, 400)
    needed = sh.statistics.samples_needed(first, 0.01)
    assert needed == pytest.approx((1.96 * 0.15 / 0.01) ** 2, rel=0.15)
    means = rng.normal(2.0, 0.3, (1000, needed)).mean(axis=1)
    kept = np.mean(np.abs(means / 2.0 - 1) < 0.01)
    assert kept == pytest.approx(0.95, abs=0.03)
    assert sh.statistics.samples_needed(first, 0.02) == pytest.approx(needed / 4, abs=1)
    many = rng.normal(2.0, 0.3, 10_000)  # the interval of few samples is itself uncertain
    tail = sh.statistics.samples_needed(many, 0.01, quantile=0.95)
    quantiles = np.quantile(rng.normal(2.0, 0.3, (1000, tail)), 0.95, axis=1)
    exact = 2.0 + 0.3 * 1.6449
    assert np.mean(np.abs(quantiles / exact - 1) < 0.01) == pytest.approx(0.95, abs=0.04)
    with pytest.raises(ValueError, match=r"nearer to 0\.5"):
        sh.statistics.samples_needed(first[:20], quantile=0.99)
    with pytest.raises(ValueError, match="relative=0"):
        sh.statistics.samples_needed(first, 0)


@pytest.mark.slow
def test_seeds_of_the_fit_and_numbers_left_over():
    values = np.random.default_rng(3).gumbel(size=1010)
    values[3] = np.nan
    fits = [
        sh.statistics.extreme_value_fit(values, 25, "gumbel", n_bootstrap=100, seed=seed)
        for seed in (1, 1, 2)
    ]
    assert fits[0].identical(fits[1])
    assert fits[0].anderson_darling_p_value != fits[2].anderson_darling_p_value
    assert (int(fits[0].n_blocks), int(fits[0].n_unused)) == (40, 9)
    assert (int(fits[0].n_used), int(fits[0].n_failed)) == (1009, 1)


def test_convergence():
    values = np.random.default_rng(4).normal(2.0, 0.5, 3000)
    result = sh.statistics.convergence(values)
    assert result.n_samples.values.tolist() == [10, 20, 50, 100, 200, 500, 1000, 2000, 3000]
    first = values[:50]
    at = result.sel(n_samples=50)
    assert float(at.mean_value) == pytest.approx(first.mean())
    assert float(at.mean_standard_error) == pytest.approx(stats.sem(first))
    expected = stats.ttest_1samp(first, 0).confidence_interval(0.95)
    np.testing.assert_allclose(at.mean_interval, list(expected))
    assert float(at.maximum) == first.max()
    # Of the normal distribution the standard deviation has the standard error s / sqrt(2 n).
    error = float(result.standard_deviation_standard_error[-1])
    assert error == pytest.approx(0.5 / np.sqrt(2 * 3000), rel=0.1)
    assert np.isinf(result.quantile_interval.sel(n_samples=10, quantile=0.95, bound="upper"))


def test_intervals_hold_as_often_as_they_say():
    """Of 100 samples each of 40 numbers; the count of misses is binomial, with five deviations."""
    rng, misses = np.random.default_rng(6), np.zeros(3)
    law = stats.weibull_min(1.5)
    for _ in range(100):
        values = law.rvs(40, random_state=rng)
        result = sh.statistics.convergence(values, [40], confidence=0.9)
        quantile = result.quantile_interval.isel(n_samples=0).values
        true = law.ppf(result["quantile"].values)
        misses[0] += not quantile[1, 0] <= true[1] <= quantile[1, 1]
        misses[1] += law.cdf(result.maximum.item()) < result.share_below_maximum.item()
        position = sh.statistics.position(values, law.ppf(0.9), confidence=0.9)
        low, high = position.probability_interval.values
        misses[2] += not low <= 0.9**25 <= high
    # The first and the last miss less often still, as counts are whole numbers.
    spread = 5 * np.sqrt(100 * 0.1 * 0.9)
    assert np.all(misses <= 10 + spread)


def test_position_of_a_value():
    values = np.arange(1.0, 101.0)
    position = sh.statistics.position(values, 96.5, quantiles=(0.05, 0.99))
    assert float(position.share_below) == 0.96
    assert float(position.probability) == pytest.approx(0.96**25)
    interval = stats.binomtest(96, 100).proportion_ci(0.95)
    np.testing.assert_allclose(position.share_below_interval, [interval.low, interval.high])
    # The 5 % quantile of the worst of 25 is the 88.7 % quantile of one, the 89.6th of 101 ranks.
    np.testing.assert_array_equal(position.worst_quantile, [90.0, np.inf])


NUMBERS = np.linspace(0, 1, 50)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda s: s.envelope(1), "dataset=1"),
        (lambda s: s.envelope(tuned()), "one swept dimension"),
        (lambda s: s.envelope(response("path")), "on a grid"),
        (lambda s: s.envelope(response(), [2.0]), "quantiles=[2.0]"),
        (lambda s: s.envelope(response().assign_attrs(symhbm_schema=99)), "99"),
        (lambda s: s.envelope(response().drop_vars("amplitude")), "amplitude"),
        (lambda s: s.envelope(response().isel(frequency=0)), "one point"),
        (lambda s: s.envelope(response().expand_dims(solution=2)), "solution"),
        (lambda s: s.envelope(response().expand_dims("case")), ".isel(case=0)"),
        (lambda s: s.amplification(response(), response()), "tuned: expected one response"),
        (lambda s: s.amplification(response(), tuned().assign(status=FAILED)), FAILED),
        (lambda s: s.amplification(response(), tuned().isel(dof=[0])), "5 degrees of freedom"),
        (lambda s: s.amplification(response(), tuned().isel(frequency=slice(9))), "the grid"),
        (lambda s: s.amplification(response(), other_band()), "band"),
        (lambda s: s.amplification(response(), silent()), "bounded responses > 0"),
        (lambda s: s.worst(response(), tuned(), "peak"), "amplification_of_peaks"),
        (lambda s: s.extreme_value_fit(np.ones((2, 2))), "shape (2, 2)"),
        (lambda s: s.extreme_value_fit(["1"]), "expected real numbers"),
        (lambda s: s.extreme_value_fit([np.inf, 1.0]), "finite"),
        (lambda s: s.extreme_value_fit(NUMBERS, 0), "block=0"),
        (lambda s: s.extreme_value_fit(NUMBERS, 1, "weibull"), "distribution='weibull'"),
        (lambda s: s.extreme_value_fit(NUMBERS, levels=[1.0]), "levels=[1.0]"),
        (lambda s: s.extreme_value_fit(NUMBERS, n_bootstrap=9), "n_bootstrap=9"),
        (lambda s: s.convergence(NUMBERS, [51]), "the 50 samples"),
        (lambda s: s.convergence(NUMBERS, [20, 10]), "ascending"),
        (lambda s: s.convergence(NUMBERS, confidence=1.0), "confidence=1"),
        (lambda s: s.convergence(response(), of="peak"), "'peak'"),
        (lambda s: s.position(NUMBERS, np.nan), "value=nan"),
        (lambda s: s.position(NUMBERS, 1.0, 0), "n=0"),
    ],
)
def test_bad_input(call, word):
    with pytest.raises((ValueError, KeyError, TypeError)) as caught:
        call(sh.statistics)
    assert word in str(caught.value)


def other_band():
    return sh.frf(PROBLEM, (14.0, 24.0), at=GRID, progress=False)


def silent():
    return tuned().assign(
        amplitude=0 * tuned().amplitude, peak_amplitude=0 * tuned().peak_amplitude
    )


PROBLEMS = {n: problem_of(n) for n in (3, 5, 13)}


@settings(max_examples=15)
@given(
    st.sampled_from(list(PROBLEMS)),
    st.integers(0, 2**32),
    st.integers(0, 13),
    st.floats(0.05, 4.0),
    st.floats(12.0, 60.0),
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
)
def test_no_contact_mistuning_exceeds_the_bound(
    n_blades, seed, order, spread, frequency, load, contact
):
    """``c omega |x_i| / f0 <= (1 + sqrt N) / 2``, pointwise, however contacts are mistuned.

    Friction only takes energy: with one harmonic ``c omega |x|^2 <= Im(x* f)``, which puts ``x``
    into a ball around half the response of damping alone.
    """
    problem = PROBLEMS[n_blades].with_parameters(
        engine_order=order,
        normal_load=10.0**load,
        contact_stiffness=10.0 ** (4 + contact),
        damping=0.3,
    )
    names = ("contact_stiffness", "friction_coefficient", "normal_load")
    draws = sh.mistuning.lognormal(problem, 1, seed=seed, **dict.fromkeys(names, spread))
    chosen = {name: draws[name].values[0] for name in names}
    point = sh.solve(problem.with_parameters(**chosen), frequency)
    assert point.converged
    factor = 0.3 * 2 * np.pi * frequency * point.amplitude.values / 1.0
    assert factor.max() <= (1 + np.sqrt(n_blades)) / 2 * (1 + 1e-9)


@pytest.mark.slow
def test_one_solution_at_each_value_is_no_choice():
    stop = sh.Gap(normal=[(0,), (1,)], normal_stiffness=1e3, gap=1e-3)
    pair = sh.Model(np.eye(2), np.eye(2), [[1.1e4, -1e3], [-1e3, 1.1e4]], contacts={"stop": stop})
    problem = sh.HarmonicBalance(pair, sh.forces.PointForce(amplitude=1.0), (0, 1, 2))
    over = sh.mistuning.uniform(problem, 2, seed=1, gap=0.2)
    grid = np.linspace(14.0, 20.0, 7)
    opening = sh.frf(problem, (14, 20), at=grid, over=over, progress=False)
    nominal = sh.frf(problem, (14, 20), at=grid, progress=False)
    assert opening.sizes["solution"] == nominal.sizes["solution"] == 1
    found = sh.statistics.amplification(opening, nominal)
    chosen = [of.isel(solution=0) for of in (opening, nominal)]
    xr.testing.assert_identical(found, sh.statistics.amplification(*chosen))
