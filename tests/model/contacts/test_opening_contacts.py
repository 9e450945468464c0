"""Responses of structures whose contacts open: balances, events, folds, archives, derivatives."""

import numpy as np
import pytest

import symhbm as sh

EXACT = {
    16: [-3.998492401e-05, 3.674271150e-02, 3.409874388e-05, 7.795083125e-06, 4.465171591e-04],
    18: [-9.987179539e-05, 3.632012543e-03, 1.422607796e-05, 5.773367971e-06, 5.075708575e-04],
    22: [-1.446979086e-04, 1.156848381e-03, 1.033308484e-05, 2.088340095e-06, 8.408895006e-04],
    24: [-2.054309655e-04, 8.460516758e-04, 1.326422932e-05, 8.488495698e-07, 1.532925347e-03],
    27: [2.465003671e-04, 5.968948334e-04, 2.347823917e-05, 4.674807206e-06, 6.695183424e-03],
}
"""Exact motions of `two_way` by frequency [Hz]: mean, sizes of harmonics 1, 2, 3 of x, 1 of y."""
TRUNCATION = {
    1: {16: 5e-4, 18: 1e-3, 22: 1e-2, 24: 2.5e-2, 27: 2.5e-2},
    3: {16: 1.5e-4, 18: 3e-4, 22: 2.5e-4, 24: 2.5e-4, 27: 2.5e-4},
    5: {16: 8e-5, 18: 7e-5, 22: 2.5e-5, 24: 2.5e-5, 27: 2.5e-5},
    9: {16: 2.5e-5, 18: 1.5e-5, 22: 1.5e-6, 24: 1.5e-6, 27: 5e-6},
    25: {16: 1e-6, 18: 4e-7, 22: 1.5e-7, 24: 4e-8, 27: 4e-7},
}
"""Largest error of balances with harmonics up to a highest one, over the largest entry."""


def two_way(given="normal_load", **changes):
    """Two springs at right angles and a contact to the ground that both press and rub."""
    values = dict(
        contact_stiffness=1e4, normal_stiffness=1e4, friction_coefficient=0.3, normal_load=5.0
    )
    if given == "gap":
        values["gap"] = -values.pop("normal_load") / values["normal_stiffness"]
    law = sh.laws.VariableLoadFriction(given)
    contact = sh.Contacts(law, [(0,)], [(1,)], **(values | changes))
    matrices = np.eye(2), np.diag([2.0, 3.0]), np.diag([1e4, 2.25e4])
    return sh.Model(*matrices, contacts={"shroud": contact})


TURNING = sh.forces.HarmonicForce(cosine={1: [10, 0]}, sine={1: [0, 10]})


def problem_of(highest, **changes):
    return sh.HarmonicBalance(two_way(**changes), TURNING, range(highest + 1))


def stop(**options):
    """A blade and a unilateral spring under a preload."""
    law = sh.laws.UnilateralSpring(**options)
    contact = sh.Contacts(law, [(0,)], normal_stiffness=2e4, **{law.given: 10.0})
    return sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"stop": contact})


def stop_problem(highest):
    return sh.HarmonicBalance(stop(), sh.forces.PointForce(amplitude=5.0), range(highest + 1))


@pytest.mark.parametrize("highest", TRUNCATION)
def test_cold_starts_find_exact_motions_up_to_truncation(highest):
    problem = problem_of(highest)
    for frequency, expected in EXACT.items():
        found = sh.solve(problem, frequency)
        assert found.status.item().startswith("success")
        assert found.iterations.item() <= 15
        phasor = found.coefficient.isel(point=0) if "point" in found.dims else found.coefficient
        phasor = np.hypot(*np.moveaxis(phasor.values.reshape(2, -1, 2), -1, 0))
        mean = found.coefficient.values.reshape(2, -1, 2)[0, 0, 0]
        sizes = [mean, *phasor[0, 1:4], *[0] * max(3 - highest, 0), phasor[1, 1]]
        kept = np.arange(5) <= highest
        kept[4] = True
        error = np.abs(np.array(sizes) - expected)[kept].max() / np.abs(expected).max()
        assert error <= TRUNCATION[highest][frequency], (frequency, error)


def test_a_coupled_preload_moves_the_mean_alone():
    """The same contact with its preload as a static load in harmonic 0."""
    law = sh.laws.VariableLoadFriction(preload="coupled")
    values = two_way().parameters
    contact = sh.Contacts(law, [(0,)], [(1,)], **{n: values[n] for n in law.parameters})
    matrices = np.eye(2), np.diag([2.0, 3.0]), np.diag([1e4, 2.25e4])
    coupled = sh.Model(*matrices, contacts={"shroud": contact})
    # Where the preload is a static force, the reference is where nothing is loaded.
    force = sh.forces.HarmonicForce(cosine={0: [0, 5.0], 1: [10, 0]}, sine={1: [0, 10]})
    at = sh.solve(sh.HarmonicBalance(coupled, force, range(6)), 24)
    balanced = sh.solve(problem_of(5), 24)
    np.testing.assert_allclose(
        at.coefficient.values, balanced.coefficient.values, rtol=1e-9, atol=1e-14
    )
    np.testing.assert_allclose(at.mean_normal_force, balanced.mean_normal_force, rtol=1e-9)


def test_a_path_lands_on_the_onset_of_opening():
    response = sh.frf(problem_of(3), (10, 35))
    assert response.status.item() == sh.Status.REACHED_END
    assert response.event_kind.values.tolist() == ["onset of opening"]
    onset = sh.solve(problem_of(3), response.event_frequency.values[0])
    assert onset.least_normal_force.item() == pytest.approx(0, abs=1e-8)
    beyond = response.frequency.values - response.event_frequency.values[0]
    away = np.abs(beyond) > 1e-9  # at the onset itself round-off tells
    np.testing.assert_array_equal(response.contact_state[away, 0] == 2, beyond[away] > 0)
    share = response.open_fraction.values[away, 0]
    np.testing.assert_array_equal(share > 0, beyond[away] > 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("highest", "folds"), [(9, (20.47063, 23.06090)), (25, (20.47064, 23.06092))]
)
def test_folds_and_openings_of_a_stop(highest, folds):
    response = sh.frf(stop_problem(highest), (10, 35))
    kinds, found = response.event_kind.values, response.event_frequency.values
    np.testing.assert_allclose(np.sort(found[kinds == "fold"]), folds, atol=1e-5)
    # The closed response opens where its amplitude is N0 / k_n.
    np.testing.assert_allclose(found[kinds == "onset of opening"], 22.51015948, atol=1e-8)
    np.testing.assert_allclose(found[kinds == "end of opening"], 31.82780472, atol=1e-8)
    assert response.peak_frequency.item() == pytest.approx(20.5113, abs=1e-3)
    assert response.peak_amplitude.item() == pytest.approx(2.39268e-2, abs=1e-6)


@pytest.mark.slow
def test_folds_of_a_stop_by_an_independent_balance():
    """Sampled without events, in NumPy alone: the folds are where its Jacobian is singular."""
    highest, count = 9, 40_000
    tau = 2 * np.pi * (np.arange(count) + 0.5) / count
    order = np.array([0] + [h for n in range(1, highest + 1) for h in (n, n)])
    at = np.array([np.cos(n * tau) if i % 2 or not i else np.sin(n * tau)
                   for i, n in enumerate(order)]).T  # fmt: skip
    analysis = 2 * at.T / count
    analysis[0] /= 2
    turn = np.zeros((len(order), len(order)))
    for n in range(1, highest + 1):
        turn[2 * n - 1, 2 * n], turn[2 * n, 2 * n - 1] = n, -n
    for fold in sh.frf(stop_problem(highest), (10, 35)).pipe(
        lambda r: r.event_frequency.values[r.event_kind.values == "fold"]
    ):
        found = sh.frf(stop_problem(highest), (10, 35), at=[fold - 2e-4, fold + 2e-4])
        assert sorted(found.n_solutions.values.tolist()) == [1, 3]
        inside = found.isel(frequency=int(found.n_solutions.values.argmax()))
        omega = 2 * np.pi * inside.frequency.item()
        signs = set()
        for k in range(3):
            pairs = inside.coefficient.values[k, 0]
            x = np.concatenate([pairs[:1, 0], pairs[1:].ravel()])
            press = 10 + 2e4 * (at @ x)
            contact = analysis @ np.maximum(press, 0)
            contact[0] -= 10
            linear = np.diag(1e4 - (omega * order) ** 2) + 2 * omega * turn
            residual = linear @ x + contact
            residual[1] -= 5
            assert np.abs(residual).max() < 1e-5
            jacobian = linear + 2e4 * (analysis * (press > 0)) @ at
            signs.add(np.sign(np.linalg.det(jacobian / 1e4)))
        assert signs == {1.0, -1.0}


def test_three_solutions_of_a_stop():
    found = sh.frf(stop_problem(25), (10, 35), at=[21.5])
    assert found.n_solutions.item() == 3
    first = np.hypot(*found.coefficient.values[0, :, 0, 1].T)
    expected = [4.253796125e-04, 2.335143879e-03, 6.739868186e-03]
    np.testing.assert_allclose(np.sort(first), expected, rtol=1e-6)
    mean = found.coefficient.values[0, :, 0, 0, 0]
    np.testing.assert_allclose(
        np.sort(-mean), [0, 4.946573564e-04, 1.980739015e-03], rtol=1e-5, atol=1e-12
    )


def test_one_harmonic_opens_where_a_closed_form_says():
    problem = stop_problem(1)
    found = sh.frf(problem, (10, 35))
    openings = found.event_frequency.values[found.event_kind.values != "fold"]
    # |X| = N0 / k_n with both springs: |k + k_n - w^2 + i c w| = F k_n / N0.
    square = np.roots([1, 4 - 2 * 3e4, 3e4**2 - (5 * 2e4 / 10) ** 2])
    np.testing.assert_allclose(np.sort(openings), np.sort(np.sqrt(square)) / 2 / np.pi, rtol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("given", ["normal_load", "gap"])
def test_the_given_parameter_is_stored_and_stays(given):
    problem = problem_of(1, given=given)
    assert given in problem.parameters
    assert ({"normal_load", "gap"} - {given}).isdisjoint(problem.parameters)
    at = sh.frf(problem, (16, 24), over={"normal_stiffness": [1e4, 2e4]})
    assert given in at
    expected = problem.with_parameters(normal_stiffness=2e4)
    law, group = expected.model.groups[0].law, expected.model.groups[0]
    load = law.load(1.0, expected.model.values_of(group))
    assert load == pytest.approx(5.0 if given == "normal_load" else 10.0)


@pytest.mark.slow
def test_load_stiffness_and_friction_are_designed_together():
    problem, names = problem_of(3), ["normal_load", "friction_coefficient", "normal_stiffness"]
    bounds = dict(zip(names, [(1.0, 40.0), (0.1, 0.8), (5e3, 2e4)], strict=False))
    best = sh.minimise_peak(problem, names, bounds, (12, 35))
    at = problem.with_parameters(**dict(zip(names, best.design_value.values, strict=False)))
    largest = sh.frf(at, (12, 35)).peak_amplitude.max().item()
    assert best.design_amplitude.item() == pytest.approx(largest, rel=1e-8)
    before = sh.frf(problem, (12, 35)).peak_amplitude.max().item()
    assert largest < 0.8 * before
