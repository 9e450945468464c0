"""Draws: exact marginals, correlations as asked for, the same samples however they are drawn."""

import json
from itertools import product

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import symhbm as sh
from tests.problems import ring_of_blades
from tests.quick import quick_first

BLADES = 13
DISK = ring_of_blades(BLADES, contact_stiffness=np.linspace(0.9e6, 1.1e6, BLADES), normal_load=10.0)
PROBLEM = sh.HarmonicBalance(DISK, sh.forces.EngineOrder(3))
SAMPLINGS = ("random", "sobol", "latin_hypercube")
SPREADS = dict(friction_coefficient=0.1, contact_stiffness=0.2, normal_load=0.3)
MARGINALS = {
    "uniform": lambda h: stats.uniform(1 - h, 2 * h),
    "truncated_normal": lambda s: stats.truncnorm(-3, 3, loc=1, scale=s),
    "lognormal": lambda v: stats.lognorm(
        np.sqrt(np.log1p(v**2)), scale=np.exp(-np.log1p(v**2) / 2)
    ),
}
CORRELATIONS = {
    "none": {},
    "neighbours": {"correlation": 2.0},
    "parameters": {"between": {("normal_load", "friction_coefficient"): -0.6}},
    "both": {"correlation": 1.5, "between": {("normal_load", "contact_stiffness"): 0.9}},
}
every_sampling = pytest.mark.parametrize("sampling", SAMPLINGS)


def draw(marginal="uniform", n_samples=25, problem=DISK, **options):
    function = getattr(sh.mistuning, marginal)
    return function(problem, n_samples, **({"seed": 7} | SPREADS | options))


def factors(draws, name):
    return (draws[name] / xr.DataArray(DISK.parameters[name], dims="contact")).values


@pytest.mark.parametrize(
    ("marginal", "sampling", "correlation"),
    quick_first(
        [
            ("uniform", "random", "both"),
            ("truncated_normal", "sobol", "none"),
            ("lognormal", "latin_hypercube", "neighbours"),
            ("lognormal", "random", "parameters"),
            *product(MARGINALS, SAMPLINGS, CORRELATIONS),
        ],
        4,
    ),
)
def test_marginals_are_those_asked_for(marginal, sampling, correlation):
    """By Kolmogorov and Smirnov, each contact by itself: 39 tests with a seed that is fixed, so
    the smallest of their p-values is below 1e-5 with a probability of 4e-4 if all is right."""
    draws = draw(marginal, 2000, sampling=sampling, **CORRELATIONS[correlation])
    for name, spread in SPREADS.items():
        law = MARGINALS[marginal](spread)
        for column in factors(draws, name).T:
            assert stats.kstest(column, law.cdf).pvalue > 1e-5
        assert law.mean() == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("marginal", "sampling", "correlation"),
    [("uniform", "random", "both"), ("truncated_normal", "sobol", "none"),
     ("lognormal", "sobol", "both")],
)  # fmt: skip
def test_a_sample_is_the_same_however_many_are_drawn(marginal, sampling, correlation):
    options = dict(sampling=sampling, **CORRELATIONS[correlation])
    many = draw(marginal, 37, **options)
    for n_samples in (1, 2, 5, 32):
        few = draw(marginal, n_samples, **options)
        for name in SPREADS:
            np.testing.assert_array_equal(few[name], many[name][:n_samples])


@every_sampling
def test_a_parameter_has_a_stream_of_its_own(sampling):
    together = draw(sampling=sampling, stiffness=0.05, force_amplitude=0.1, problem=PROBLEM)
    for name, spread in SPREADS.items():
        alone = sh.mistuning.uniform(DISK, 25, seed=7, sampling=sampling, **{name: spread})
        np.testing.assert_array_equal(alone[name], together[name])
    shuffled = draw(**dict(reversed(SPREADS.items())), sampling=sampling)
    for name in SPREADS:
        np.testing.assert_array_equal(shuffled[name], together[name])
    apart = factors(together, "normal_load") / 0.3 - factors(together, "friction_coefficient") / 0.1
    assert np.ptp(apart) > 1


def test_seeds_differ_and_repeat():
    assert draw(seed=1).equals(draw(seed=1))
    for sampling in SAMPLINGS:
        one, other = (draw(seed=seed, sampling=sampling) for seed in (1, 2))
        assert not np.any(one.normal_load == other.normal_load)


def test_sobol_points_fill_the_space():
    """Of 2^m points of a Sobol sequence each of 2^m equal intervals holds one, in every direction;
    of a Latin hypercube too, for any number."""
    for sampling, n in (("sobol", 256), ("latin_hypercube", 100)):
        draws = draw(n_samples=n, sampling=sampling)
        for name, width in SPREADS.items():
            share = (factors(draws, name) / width - 1 / width + 1) / 2
            cells = np.sort(np.floor(share * n).astype(int), axis=0)
            np.testing.assert_array_equal(cells, np.tile(np.arange(n)[:, None], BLADES))


def test_correlation_around_the_ring():
    """Of 20000 Gaussian scores; the standard error of a correlation is at most 0.0071."""
    draws = draw("lognormal", 20_000, correlation=2.0)
    scores = np.log(factors(draws, "normal_load"))
    gap = np.abs(np.subtract.outer(np.arange(BLADES), np.arange(BLADES)))
    expected = np.exp(-np.minimum(gap, BLADES - gap) / 2.0)
    np.testing.assert_allclose(np.corrcoef(scores.T), expected, atol=5 * 0.0071)
    other = np.log(factors(draws, "friction_coefficient"))
    assert abs(np.corrcoef(scores.T, other.T)[:BLADES, BLADES:]).max() < 5 * 0.0071


def test_correlation_by_matrix_and_between_parameters():
    alike = np.ones((BLADES, BLADES))
    pair = ("friction_coefficient", "contact_stiffness")
    draws = draw(
        "lognormal",
        20_000,
        correlation={"normal_load": alike},
        between={pair: -1.0, (*pair[:1], "normal_load"): 0.0},
    )
    load = factors(draws, "normal_load")
    # The symmetric root of a singular matrix is good to the root of round-off.
    assert np.ptp(load, axis=1).max() < 1e-6
    one, other = (
        np.log(factors(draws, name)) / np.sqrt(np.log1p(SPREADS[name] ** 2)) for name in pair
    )
    np.testing.assert_allclose(np.corrcoef(one[:, 3], other[:, 3])[0, 1], -1.0, atol=1e-9)
    assert abs(np.corrcoef(one[:, 3], other[:, 4])[0, 1]) < 5 * 0.0071


@settings(max_examples=25)
@given(st.integers(1, 60), st.floats(0.0, 1e6))
def test_every_correlation_length_is_one(n_blades, length):
    """The kernel is positive semidefinite on every ring: no length is refused."""
    values = [1.0] * max(n_blades, 3)
    disk = ring_of_blades(
        len(values),
        stiffness=values,
        damping=0.0,
        contact_stiffness=1.0,
        friction_coefficient=1.0,
        normal_load=1.0,
    )
    draws = sh.mistuning.uniform(disk, 3, seed=0, correlation=length, stiffness=1.0)
    assert np.all((draws.stiffness >= 0) & (draws.stiffness <= 2))


def test_draws_go_into_a_response_and_its_archive(tmp_path):
    draws = xr.merge(
        [
            sh.mistuning.uniform(PROBLEM, 3, seed=2013, normal_load=0.3, stiffness=0.02),
            sh.mistuning.lognormal(PROBLEM, 3, seed=2013, force_amplitude=0.1),
        ],
        combine_attrs="override",
    )
    assert draws.normal_load.dims == ("sample", "contact")
    assert draws.stiffness.dims == ("sample", "dof")
    assert draws.force_amplitude.dims == ("sample",)
    np.testing.assert_array_equal(draws.sample, [0, 1, 2])
    xr.testing.assert_identical(sh.load(sh.save(draws, tmp_path / "draws.nc")), draws)
    response = sh.frf(PROBLEM, (70, 75), at=[72.0], over=draws, progress=False)
    loaded = sh.load(sh.save(response, tmp_path / "response.nc"))
    for name in draws.data_vars:
        np.testing.assert_array_equal(loaded[name], draws[name])
        assert loaded[name].attrs == draws[name].attrs
    drawn = json.loads(loaded.normal_load.attrs["drawn"])
    assert drawn["distribution"] == "uniform"
    assert drawn["relative half-width"] == 0.3
    assert drawn["seed"] == 2013
    assert drawn["symhbm"] == sh.__version__
    assert json.loads(loaded.force_amplitude.attrs["drawn"])["distribution"] == "lognormal"
    problem = sh.datasets.rebuild(loaded.isel(sample=1))
    np.testing.assert_array_equal(problem.parameters["stiffness"], draws.stiffness[1])


def test_a_spread_per_contact():
    spreads = np.linspace(0, 0.5, BLADES)
    load = sh.mistuning.uniform(DISK, 500, seed=1, normal_load=spreads).normal_load
    assert np.all(load[:, 0] == 10)
    # 500 uniform samples leave a gap above 0.05 of the half-width with a probability below 1e-5.
    np.testing.assert_allclose(np.abs(load / 10 - 1).max("sample"), spreads, atol=0.05 * 0.5)


def test_explicit_samples_and_patterns():
    alternating = sh.mistuning.pattern("AB", BLADES, A=0.97, B=1.03)
    np.testing.assert_array_equal(alternating[:3], [0.97, 1.03, 0.97])
    wave = sh.mistuning.harmonic(BLADES, 2, 0.1, phase=0.4)
    transform = np.abs(np.fft.fft(wave)) / BLADES
    # Amplitudes of the cosine, to round-off: one half at each of n and N - n, one at zero.
    expected = np.zeros(BLADES)
    expected[[0, 2, BLADES - 2]] = 1, 0.05, 0.05
    np.testing.assert_allclose(transform, expected, atol=1e-14)
    draws = sh.mistuning.explicit(
        DISK, relative=True, stiffness={"AB": alternating, "wave": wave}, mass=[wave, wave]
    )
    assert draws.pattern.values.tolist() == ["AB", "wave"]
    np.testing.assert_array_equal(draws.stiffness, 1e4 * np.array([alternating, wave]))
    response = sh.frf(PROBLEM, (70, 75), at=[72.0], over=draws, progress=False)
    assert response.pattern.values.tolist() == ["AB", "wave"]
    loads = np.arange(1.0, 27.0).reshape(2, 13)
    np.testing.assert_array_equal(sh.mistuning.explicit(DISK, normal_load=loads).normal_load, loads)
    amplitude = sh.mistuning.explicit(PROBLEM, force_amplitude=[1.0, 2.0]).force_amplitude
    assert amplitude.dims == ("sample",)


EYE = np.eye(BLADES)
WAVE = np.ones(BLADES)
BAD = {
    "no parameter": (dict(), "at least one parameter"),
    "unknown parameter": (dict(load=0.1), "normal_load"),
    "integer parameter": (dict(engine_order=0.1), "engine_order"),
    "too wide": (dict(stiffness=1.2), "stiffness=1.2: expected"),
    "massless": (dict(mass=1.0), "mass=1.0: expected"),
    "negative spread": (dict(stiffness=-0.1), "stiffness=-0.1: expected"),
    "wrong number of spreads": (dict(stiffness=[0.1, 0.2]), "13"),
    "nothing to spread": (dict(cubic_stiffness=0.1), "nominal value is not 0"),
    "seed": (dict(stiffness=0.1, seed=-1), "seed=-1"),
    "no samples": (dict(stiffness=0.1, n_samples=0), "n_samples=0"),
    "sampling": (dict(stiffness=0.1, sampling="halton"), "'sobol'"),
    "length": (dict(stiffness=0.1, correlation=-1.0), "correlation=-1.0"),
    "shape": (dict(stiffness=0.1, correlation=np.eye(3)), "(13, 13)"),
    "diagonal": (dict(stiffness=0.1, correlation=2 * EYE), "ones on its diagonal"),
    "indefinite": (dict(stiffness=0.1, correlation=2 * EYE - 1), "lowest eigenvalue"),
    "unknown name": (dict(stiffness=0.1, correlation={"mass": 1.0}), "'mass'"),
    "no pair": (dict(stiffness=0.1, between={"mass": 1.0}), "pairs of two parameters"),
    "no pairs": (dict(stiffness=0.1, between=0.5), "between=0.5"),
    "above one": (dict(stiffness=0.1, mass=0.1, between={("mass", "stiffness"): 1.1}), "lowest"),
    "pair of unlike correlations": (
        dict(
            stiffness=0.1, mass=0.1, correlation={"mass": 3}, between={("mass", "stiffness"): 0.8}
        ),
        "would leave 0.6",
    ),
    "pair of unlike sizes": (
        dict(stiffness=0.1, force_amplitude=0.1, between={("stiffness", "force_amplitude"): 0.1}),
        "as many values",
    ),
}


CALLS = [
    (lambda m: m.truncated_normal(DISK, 3, seed=1, stiffness=0.4), "0.333333"),
    (lambda m: m.truncated_normal(DISK, 3, seed=1, cut=0.0, stiffness=0.1), "cut=0.0"),
    (lambda m: m.uniform("disk", 3, seed=1, stiffness=0.1), "problem='disk'"),
    (lambda m: m.explicit(DISK, stiffness=WAVE), "(n_samples, 13)"),
    (lambda m: m.explicit(DISK, normal_load=[-WAVE]), "normal_load"),
    (lambda m: m.explicit(DISK, stiffness=[WAVE], mass=[WAVE] * 2), "as many samples"),
    (lambda m: m.explicit(DISK, stiffness={"A": WAVE}, mass={"B": WAVE}), "same patterns"),
    (lambda m: m.pattern("AB", 4, A=1.0), "'B'"),
    (lambda m: m.pattern("", 4, A=1.0), "letters=''"),
    (lambda m: m.harmonic(4, -1, 0.1), "nodal_diameter=-1"),
]


def uniform(options):
    return lambda m: m.uniform(PROBLEM, **({"n_samples": 3, "seed": 1} | options))


@pytest.mark.parametrize(
    ("call", "word"), [*((uniform(options), word) for options, word in BAD.values()), *CALLS]
)
def test_bad_draws(call, word):
    with pytest.raises((ValueError, KeyError, TypeError)) as caught:
        call(sh.mistuning)
    assert word in str(caught.value)


def test_wide_spreads_stay_in_range():
    draws = draw("uniform", 1000, normal_load=1.0)
    assert float(draws.normal_load.min()) >= 0
    signs = sh.mistuning.uniform(PROBLEM, 100, seed=1, force_amplitude=3.0).force_amplitude
    assert float(signs.min()) < 0 < float(signs.max())


def test_contacts_of_a_condensed_structure_are_drawn():
    """The structure itself, and the problem of it, give the same samples."""
    matrix = 1e4 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    model = sh.Model(
        np.eye(4),
        1e-5 * matrix,
        matrix,
        contacts=[(0,), (3,)],
        contact_stiffness=1e4,
        friction_coefficient=0.5,
        normal_load=3,
    )
    condensed = sh.condense(model, sh.forces.PointForce(0), (5, 30), (1,))
    one, other = (
        sh.mistuning.uniform(of, 3, seed=1, normal_load=0.2)
        for of in (condensed, sh.HarmonicBalance(condensed, sh.forces.PointForce(0)))
    )
    assert one.identical(other)
    assert one.normal_load.dims == ("sample", "contact")
