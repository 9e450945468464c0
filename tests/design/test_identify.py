"""Fits of responses: exact derivatives, true values, what is not seen, errors, and bad input."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import symhbm as sh
from symhbm.design.identification import estimate
from symhbm.design.identification.objective import Objective, objective_of
from symhbm.design.identification.observations import Rows
from tests.design.differences import differences
from tests.measurements import complex_responses, measured_responses
from tests.problems import one_blade, ring_of_blades
from tests.problems import problem as catalogued
from tests.quick import quick_first

FREQUENCIES = np.linspace(13, 24, 12)
LEVELS = [0.5, 2.0]
TRUE = {"normal_load": 3.0, "contact_stiffness": 1e4, "damping": 0.5}


def blade(harmonics=(1,), **changes):
    return sh.HarmonicBalance(one_blade(**changes), sh.forces.PointForce(), harmonics)


@pytest.fixture(scope="module")
def exact():
    return measured_responses(blade(), LEVELS, FREQUENCIES)


@pytest.fixture(scope="module")
def noisy():
    return measured_responses(blade(), LEVELS, FREQUENCIES, noise=0.02)


@pytest.fixture(scope="module")
def fitted(noisy):
    return sh.identify(blade(normal_load=8.0), noisy, [*TRUE], predict=True, progress=False)


def mixed_objective():
    """Three blades that rub each other: all forms, quantities, sensors, priors and a relation."""
    problem = sh.HarmonicBalance(
        ring_of_blades(3, damping=5.0), sh.forces.PointForce(amplitude=2), (1, 3)
    )
    rng, at = np.random.default_rng(0), [16.0, 18.0, 22.0]
    random = rng.standard_normal((2, 3)) * 1e-4
    data = [
        sh.datasets.measured(at, random[0] + 1j * random[1], units="m", deviation=1e-5, place=1),
        sh.datasets.measured(at, abs(random[0]), units="g", deviation=0.1, form="magnitude"),
        sh.datasets.measured(
            at, random[1], units="rad", deviation=0.1, form="phase", place=2, quantity="velocity"
        ),
        sh.datasets.measured(at, random[1] + 0j, units="m", deviation=1e-5, harmonic=3),
    ]
    unknown = {
        "contact_stiffness": {"vary": "each"},
        "friction_coefficient": {"bounds": (0, 2), "prior": (0.3, 0.1)},
        "normal_load": lambda p: 20 * p["friction_coefficient"][0] ** 2,
        "damping": {"log_prior": (4.0, 0.2)},
        "mass": None,
        "gain[0]": None,
        "phase[1]": None,
        "delay[2]": (-1e-3, 1e-3),
    }
    objective = objective_of(problem, Rows.of(data), unknown)
    x = objective.unknowns.start + 0.05 * rng.standard_normal(objective.unknowns.n)
    return objective, x


def test_jacobian_and_hessian_agree_with_differences():
    objective, x = mixed_objective()
    point = objective.at(x)
    by_residuals = differences(lambda x: objective.at(x).residuals, x)
    by_gradient = differences(lambda x: objective.at(x).gradient, x)
    assert not point.on_corners()
    scale = np.abs(point.jacobian).max(axis=0)
    assert (np.abs(by_residuals - point.jacobian) / scale).max() < 1e-7
    size = np.sqrt(np.abs(np.outer(*[np.diag(point.jacobian.T @ point.jacobian)] * 2)))
    assert (np.abs(by_gradient - point.hessian) / size).max() < 1e-5


@pytest.mark.parametrize("factor", quick_first([1 / 3, 3.0], 1))
def test_true_values_without_noise(exact, factor):
    wrong = blade(**{name: factor * value for name, value in TRUE.items()})
    fit = sh.identify(wrong, exact, [*TRUE], profiles=False, progress=False)
    np.testing.assert_allclose(fit.estimate, [*TRUE.values()], rtol=1e-8)
    assert fit.status == "the optimum was found"


def test_one_sector_stands_for_a_tuned_disk():
    problem = sh.HarmonicBalance(ring_of_blades(5), sh.forces.EngineOrder(1), (1, 3))
    data = measured_responses(problem, LEVELS, [16.0, 18.0, 20.0, 22.0], place=2)
    wrong = problem.with_parameters(normal_load=5.0, contact_stiffness=8e3)
    objective = objective_of(wrong, Rows.of(data), ["normal_load", "contact_stiffness"])
    assert objective.curves[0].problem.n_unknowns == 4
    fit = sh.identify(
        wrong, data, ["normal_load", "contact_stiffness"], profiles=False, progress=False
    )
    np.testing.assert_allclose(fit.estimate, [3.0, 1e4], rtol=1e-8)
    # Contacts that differ are no sectors that move alike.
    apart = objective_of(wrong, Rows.of(data), {"normal_load": {"vary": "each"}})
    assert apart.curves[0].problem.n_unknowns == 20


def test_magnitudes_accelerations_and_phases():
    response = complex_responses(blade(), LEVELS, FREQUENCIES)
    acceleration = -((2 * np.pi * FREQUENCIES) ** 2) * response
    given: Any = dict(deviation=1e-3, force_amplitude=np.reshape(LEVELS, (-1, 1)))
    data = [
        sh.datasets.measured(
            FREQUENCIES, abs(acceleration), units="m s-2", form="magnitude", **given
        ),
        sh.datasets.measured(
            FREQUENCIES, np.angle(response, deg=True) + 360, units="deg", form="phase", **given
        ),
    ]
    wrong = blade(normal_load=5.0, contact_stiffness=8e3)
    fit = sh.identify(
        wrong, data, ["normal_load", "contact_stiffness"], profiles=False, progress=False
    )
    np.testing.assert_allclose(fit.estimate, [3.0, 1e4], rtol=1e-8)


def test_gain_and_delay_of_a_sensor(exact):
    turned = exact.copy()
    values = exact.measured_value.values.reshape(-1, 2) @ [1, 1j]
    omega = 2 * np.pi * exact.measured_frequency.values[::2]
    values = 1.2 * np.exp(-1j * omega * 2e-4) * values
    turned["measured_value"] = "measurement", np.column_stack([values.real, values.imag]).ravel()
    unknown = {"normal_load": None, "gain[0]": None, "delay[0]": (-1e-2, 1e-2)}
    fit = sh.identify(blade(normal_load=5.0), turned, unknown, profiles=False, progress=False)
    np.testing.assert_allclose(fit.estimate, [3.0, 1.2, 2e-4], rtol=1e-8)
    assert fit.unknown_units.values.tolist() == ["N", "1", "s"]


def test_products_and_stuck_contacts_and_nodes_are_not_seen(exact):
    with pytest.warns(RuntimeWarning, match="only their product"):
        fit = sh.identify(
            blade(normal_load=4.0), exact, ["normal_load", "friction_coefficient"], progress=False
        )
    assert "normal_load and friction_coefficient apart" in fit.status.item()
    assert fit.singular_value[-1] < 1e-10
    assert np.isnan(fit.standard_error).all()
    limit = fit.estimate[0] * fit.estimate[1]
    np.testing.assert_allclose(limit, 1.5, rtol=1e-8)

    stuck = measured_responses(blade(normal_load=1e3, damping=20.0), [0.1], FREQUENCIES)
    with pytest.warns(RuntimeWarning, match="Not seen: normal_load, with which no"):
        fit = sh.identify(
            blade(normal_load=2e3, contact_stiffness=9e3, damping=20.0),
            stuck,
            ["normal_load", "contact_stiffness"],
            progress=False,
        )
    np.testing.assert_allclose(fit.estimate[1], 1e4, rtol=1e-8)

    # Two blades that move against each other leave one amid them at rest.
    chain = sh.Model(
        np.eye(3),
        0.5 * np.eye(3),
        [[2e4, -1e4, 0], [-1e4, 2e4, -1e4], [0, -1e4, 2e4]],
        contacts=[(0,), (2,)],
        contact_stiffness=5e3,
        friction_coefficient=0.5,
        normal_load=2.0,
    )
    apart = sh.forces.HarmonicForce({1: [1.0, 0.0, -1.0]})
    problem = sh.HarmonicBalance(chain, apart)
    still = sh.datasets.measured(
        FREQUENCIES, np.zeros(len(FREQUENCIES)) + 0j, units="m", deviation=1e-6, place=1
    )
    with pytest.warns(RuntimeWarning, match="Not seen: normal_load"):
        sh.identify(problem, still, "normal_load", progress=False)


def test_errors_intervals_and_what_is_left(fitted):
    assert (abs(fitted.estimate - [*TRUE.values()]) < 4 * fitted.standard_error).all()
    np.testing.assert_allclose(fitted.exact_standard_error, fitted.standard_error, rtol=0.1)
    ends, wide = fitted.profile_interval, fitted.interval
    assert ((ends[:, 0] < fitted.estimate) & (fitted.estimate < ends[:, 1])).all()
    np.testing.assert_allclose(np.diff(ends), np.diff(wide), rtol=0.1)
    assert (fitted.curve_size == 2 * len(FREQUENCIES)).all()
    np.testing.assert_allclose(np.diag(fitted.estimate_correlation), 1.0)
    residual = (fitted.computed_value - fitted.measured_value) / fitted.measured_deviation
    np.testing.assert_allclose(fitted.measured_residual, residual, rtol=1e-9)


def test_curves_are_predicted_from_the_others(noisy, fitted):
    without = noisy.copy(deep=True)
    first = noisy.measured_at_force_amplitude == LEVELS[0]
    without["measured_left_out"] = first.astype(np.int8)
    others = sh.identify(blade(), without, [*TRUE], profiles=False, progress=False)
    residual = (others.computed_value - noisy.measured_value) / noisy.measured_deviation
    assert float((residual**2).values[first].mean()) == pytest.approx(
        float(fitted.curve_predicted[0]), rel=1e-6
    )


@pytest.mark.slow
def test_profiles_end_where_the_others_fit_as_badly_as_the_level_says(noisy):
    """At each end, held there, the others are fitted again: the sum of squares rises by 1.96^2."""
    names = ["contact_stiffness", "stiffness", "mass"]
    fit = sh.identify(blade(), noisy, names, progress=False)
    assert abs(fit.estimate_correlation.values - np.eye(3)).max() > 0.9
    best = float((fit.measured_residual**2).sum())
    for side in (0, 1):
        end = float(fit.profile_interval.sel(unknown="mass")[side])
        held = sh.identify(blade(mass=end), noisy, names[:2], profiles=False, progress=False)
        rise = float((held.measured_residual**2).sum()) - best
        assert rise == pytest.approx(1.959964**2, rel=1e-2)


@pytest.mark.slow
def test_noise_that_is_not_known_is_estimated(noisy):
    unknown = noisy.copy()
    response = noisy.measured_value.values.reshape(-1, 2)
    rng = np.random.default_rng(3)
    unknown["measured_value"] = (
        "measurement",
        (complex_parts() + 2e-5 * rng.standard_normal(response.shape)).ravel(),
    )
    unknown["measured_deviation"] = "measurement", np.full(response.size, np.nan)
    fit = sh.identify(blade(normal_load=5.0), unknown, ["normal_load"], progress=False)
    assert fit.noise_level == pytest.approx(2e-5, rel=0.3)
    wide = np.diff(fit.interval)[0, 0] / (2 * fit.standard_error[0])
    assert 1.96 < wide < 2.1


def complex_parts():
    response = complex_responses(blade(), LEVELS, FREQUENCIES).ravel()
    return np.column_stack([np.real(response), np.imag(response)])


@pytest.mark.slow
def test_a_wrong_model_is_told(noisy):
    with pytest.warns(RuntimeWarning, match="times the noise that was given"):
        sh.identify(blade(mass=1.05), noisy, "normal_load", progress=False, profiles=False)


@pytest.mark.slow
def test_relations_priors_and_bounds(exact):
    given: Any = dict(profiles=False, progress=False)
    relation: Any = {
        "normal_load": (0.1, 100.0),
        "contact_stiffness": lambda p: 1e4 / 3 * p["normal_load"],
    }
    fit = sh.identify(blade(normal_load=8.0), exact, relation, **given)
    np.testing.assert_allclose(fit.estimate, 3.0, rtol=1e-8)
    assert fit.contact_stiffness == pytest.approx(1e4)
    # A prior says how the product, which is all that is seen, divides.
    prior = {"normal_load": {"prior": (4.0, 0.1)}, "friction_coefficient": None}
    fit = sh.identify(blade(), exact, prior, **given)
    np.testing.assert_allclose(fit.estimate, [4.0, 1.5 / 4], rtol=1e-6)
    with pytest.warns(RuntimeWarning, match="residuals"):
        fit = sh.identify(blade(normal_load=5.0), exact, {"normal_load": (4.0, 9.0)}, **given)
    assert fit.estimate == pytest.approx(4.0)
    assert "At a bound: normal_load" in fit.certificate.item()


def test_a_fit_is_a_dataset_like_others(fitted, tmp_path):
    sh.save(fitted, tmp_path / "fit.nc")
    with sh.load(tmp_path / "fit.nc") as loaded:
        assert loaded.certificate.item() == fitted.certificate.item()
        problem = sh.datasets.rebuild(loaded)
        np.testing.assert_allclose(problem.parameters["normal_load"], fitted.estimate[0])
        with pytest.raises(KeyError, match="'normal_load' is no unknown"):
            sh.identify(problem, fitted, "mass", start=loaded, progress=False)
        again = sh.identify(
            problem, fitted, [*TRUE], start=loaded, n_starts=1, profiles=False, progress=False
        )
        np.testing.assert_allclose(again.estimate, fitted.estimate, rtol=1e-9)
        assert (
            sh.verify(loaded, points=4, exact="none", progress=False).residual_stored.max() < 1e-9
        )


def test_an_interrupted_fit_tells_its_best_values(exact, monkeypatch):
    from symhbm.design.identification import estimate

    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(estimate, "polished", interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        sh.identify(blade(normal_load=4.0), exact, "normal_load", progress=False)
    [note] = caught.value.__notes__
    assert "start={'normal_load': 3.0" in note or "start={'normal_load': 2.9999" in note


def test_an_archive_keeps_what_an_interrupt_leaves(exact, tmp_path, monkeypatch):
    """The same call goes on from there, opens what is finished, and refuses that of another."""
    target, evaluated, at = tmp_path / "fit.nc", [0], Objective.at
    relation: Any = {"normal_load": None, "contact_stiffness": lambda p: 1e4 / 3 * p["normal_load"]}
    given: Any = dict(archive=target, profiles=False, progress=False)

    def counted(self, x):
        evaluated[0] += 1
        if evaluated[0] == 6:
            raise KeyboardInterrupt
        return at(self, x)

    monkeypatch.setattr(Objective, "at", counted)
    with pytest.raises(KeyboardInterrupt) as caught:
        sh.identify(blade(normal_load=8.0), exact, relation, **given)
    assert "kept in" in caught.value.__notes__[0]
    fit = sh.identify(blade(normal_load=8.0), exact, relation, **given)
    np.testing.assert_allclose(fit.estimate, 3.0, rtol=1e-8)
    assert [path.name for path in tmp_path.iterdir()] == ["fit.nc"]
    first = evaluated[0]
    again = sh.identify(blade(normal_load=8.0), exact, relation, **given)
    assert (evaluated[0], again.estimate.item()) == (first, fit.estimate.item())
    relation["contact_stiffness"] = lambda p: 1e4 / 4 * p["normal_load"]
    with pytest.raises(sh.datasets.ArchiveError, match="of another one"):
        sh.identify(blade(normal_load=8.0), exact, relation, **given)


BAD = [
    (dict(unknown="normal_lode"), KeyError, "did you mean 'normal_load'"),
    (dict(unknown={}), TypeError, "names of parameters"),
    (dict(unknown=[{"normal_load": (1, 2)}]), TypeError, "unknown={'normal_load': (1, 2)}"),
    (dict(unknown={"normal_load": (3, 1)}), ValueError, "low < high"),
    (dict(unknown={"normal_load": {"bound": (1, 3)}}), ValueError, "'bound' is none"),
    (dict(unknown={"normal_load": {"vary": "some"}}), ValueError, "vary"),
    (dict(unknown={"normal_load": {"prior": (1.0, 0.0)}}), ValueError, "standard deviation"),
    (dict(unknown="normal_load[7]"), ValueError, "a number from 0 to 0"),
    (dict(unknown=["normal_load", "normal_load[0]"]), ValueError, "there twice"),
    (dict(unknown={"gain[tip]": None}), KeyError, "the place of a measurement"),
    (dict(unknown={"normal_load": lambda p: p["mass"]}), ValueError, "at least one"),
    (dict(unknown="force_amplitude"), ValueError, "not given with the data"),
    (dict(data=3), TypeError, "symhbm.datasets.measured"),
    (dict(data=[]), ValueError, "at least one dataset"),
    (dict(loss="quartic"), ValueError, "one of 'linear'"),
    (dict(confidence=95), ValueError, "probability"),
    (dict(n_starts=0), ValueError, ">= 1"),
    (dict(start={"mass": 1.0}), KeyError, "no unknown"),
]


@pytest.mark.parametrize(("change", "kind", "words"), BAD)
def test_bad_fits_are_refused(exact, change, kind, words):
    given: Any = dict(data=exact, unknown="normal_load", progress=False) | change
    with pytest.raises(kind, match=r"expected|allowed") as caught:
        sh.identify(blade(), **given)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        (dict(place="nowhere"), KeyError, "'nowhere' is no place, the structure has none"),
        (dict(place=4), (KeyError, ValueError, IndexError), "4"),
        (dict(harmonic=3), ValueError, "harmonic=3"),
        (dict(quantity="strain", units="1"), KeyError, "'strain' is no output"),
        (dict(charge=3.0), KeyError, "'charge' is no parameter"),
        (dict(frequency=[10.0], response=[1 + 0j]), ValueError, "at least as many values"),
    ],
)
def test_bad_measurements_are_refused(change, kind, words):
    given: Any = dict(frequency=[10.0, 11.0], response=[1e-4 + 0j, 2e-4], units="m") | change
    data = sh.datasets.measured(given.pop("frequency"), given.pop("response"), **given)
    unknown = ["normal_load", "contact_stiffness", "damping"]
    with pytest.raises(kind) as caught:
        sh.identify(blade(), data, unknown, progress=False)
    assert words in str(caught.value)


@pytest.mark.parametrize("place", ["tip", 1])
def test_outputs_are_measured_at_their_rows(place):
    model = one_blade().with_outputs({"strain": {0: 2.0}}, "1")
    given: Any = dict(units="1", quantity="strain", place=place)
    data = sh.datasets.measured([10.0, 11.0], [1e-4 + 0j, 2e-4], **given)
    with pytest.raises(ValueError, match=r"expected a row of strain, from 0 to 0"):
        sh.identify(
            sh.HarmonicBalance(model, sh.forces.PointForce()), data, "normal_load", progress=False
        )


def test_newton_steps_that_go_up_are_not_taken(monkeypatch):
    """Although they end nearer to where the slope is zero."""
    monkeypatch.setattr(estimate, "_distance", lambda point, *_: point.distance)
    unknowns = SimpleNamespace(bounds=(np.zeros(1), np.ones(1)))
    at: Any = dict(x=np.full(1, 0.5), gradient=np.full(1, 0.1), hessian=np.eye(1))
    low, high = (SimpleNamespace(value=v, distance=1 / v, **at) for v in (1.0, 1.1))
    objective: Any = SimpleNamespace(unknowns=unknowns, remember=id, at=lambda _: high)
    assert estimate.polished(objective, low, np.arange(1), "linear") == (low, 1.0)  # type: ignore[arg-type]


def test_frequencies_outside_the_band_of_a_condensed_structure_are_refused():
    problem = catalogued("coulomb condensed point 13")
    low, high = problem.model.frequency
    data = sh.datasets.measured([low, 2 * high], [1e-4 + 0j, 1e-4], units="m", deviation=1e-6)
    with pytest.raises(ValueError, match=r"frequency.*condensed"):
        sh.identify(problem, data, "normal_load", progress=False)


def test_deviations_of_some_and_units_that_differ_without_are_refused(exact):
    some = exact.copy(deep=True)
    some["measured_deviation"].values[0] = np.nan
    with pytest.raises(ValueError, match=r"deviation: expected one of all measurements or of none"):
        sh.identify(blade(), some, "normal_load", progress=False)
    data = [
        sh.datasets.measured([15.0, 16.0], [1e-4, 2e-4], units="m", form="magnitude"),
        sh.datasets.measured([15.0, 16.0], [1.0, 2.0], units="m s-2", form="magnitude"),
    ]
    with pytest.raises(ValueError, match=r"several units .m, m s-2. have none in common"):
        sh.identify(blade(), data, "normal_load", progress=False)
