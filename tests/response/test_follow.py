"""Responses over any parameter at one frequency, against a closed form and single points."""

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from symhbm.model.contacts.coulomb.located import locate
from symhbm.model.contacts.coulomb.sampled import locate_sampled
from symhbm.numerics.fourier import FourierBasis
from tests.problems import ring_of_blades

TWO_PI = 2 * np.pi
MU = 0.5


def stuck_stiffness(frequency):
    """Magnitude of the dynamic stiffness with the contact stuck [N/m]."""
    omega = TWO_PI * frequency
    return float(np.hypot(2e4 - omega**2, 0.5 * omega))


def both_ways(problem, parameter, band, **options):
    up = sh.follow(problem, parameter, band, throw=True, **options)
    down = sh.follow(problem, parameter, band[::-1], throw=True, **options)
    return up, down


def mistuned_ring(n_blades=5, seed=1):
    """Ring with stiffness +-2 %, friction +-30 %, loads +-30 %, uniform."""
    rng = np.random.default_rng([seed, n_blades])

    def around(nominal, width):
        return nominal * (1 + width * rng.uniform(-1, 1, n_blades))

    disk = ring_of_blades(
        n_blades,
        stiffness=around(1e4, 0.02),
        contact_stiffness=around(2e4, 0.1),
        friction_coefficient=around(MU, 0.3),
        normal_load=around(20.0, 0.3),
    )
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(1))


# One blade, closed form


@pytest.mark.parametrize("frequency", [15.5, 22.0])
def test_events_over_each_friction_parameter(frequency):
    """The contact is at its limit where ``k_d A = mu F_n``, A that of the stuck blade."""
    stiffness = stuck_stiffness(frequency)
    limit = 1e4 / stiffness
    cases = {
        "normal_load": (limit / MU, "end of slip", {}),
        "friction_coefficient": (limit / 100, "end of slip", {}),
        "force_amplitude": (MU * 100 / limit, "onset of slip", {}),
    }
    for name, (value, kind, changes) in cases.items():
        problem = fig03.problem().with_parameters(**changes)
        up, down = both_ways(problem, name, (value / 3, value * 3), frequency=frequency)
        opposite = {"end of slip": "onset of slip", "onset of slip": "end of slip"}[kind]
        for curve, expected in ((up, kind), (down, opposite)):
            assert curve.event_kind.values.tolist() == [expected]
            assert curve.event_contact.values.tolist() == [0]
            # Required: 1e-9.
            assert float(curve[f"event_{name}"][0]) == pytest.approx(value, rel=1e-9)
            assert curve[f"event_{name}"].values[0] in curve[name].values


# Sweeps, reasons to stop, archives


def test_points_give_the_problem_back():
    problem, name, index = mistuned_ring(), "stiffness", 2
    nominal = problem.parameters[name]
    band = 0.8 * nominal.min(), 1.2 * nominal.max()
    curve = sh.follow(problem, f"{name}[{index}]", band, frequency=19.0)
    np.testing.assert_array_equal(sh.datasets.rebuild(curve).parameters[name], nominal)
    point = curve.isel(point=3)
    rebuilt = sh.datasets.rebuild(point)
    expected = nominal.copy()
    expected[index] = float(point[name])
    np.testing.assert_array_equal(rebuilt.parameters[name], expected)
    again = sh.solve(rebuilt, float(point.frequency), throw=True)
    # Required: 1e-9.
    np.testing.assert_allclose(again.amplitude, point.amplitude, rtol=1e-9)


# Bad input


def test_a_model_without_contacts():
    """Nothing depends on a contact that is not there; no place can be chosen."""
    problem = sh.HarmonicBalance(sh.Model([[1.0]], [[0.1]], [[1.0]]), sh.forces.PointForce())
    curve = sh.follow(problem, "force_amplitude", (0.5, 2), frequency=0.1, throw=True)
    exact = 1 / np.hypot(1 - (TWO_PI * 0.1) ** 2, 0.1 * TWO_PI * 0.1)
    # A linear response: round-off.
    np.testing.assert_allclose(curve.amplitude[:, 0], exact * curve.force_amplitude, rtol=1e-11)
    with pytest.raises(ValueError, match=r"normal_load\[0\]"):
        sh.follow(problem, "normal_load[0]", (0.5, 2), frequency=0.1)


@pytest.mark.parametrize(
    ("problem", "harmonics"), [(fig03.problem, (0, 1, 2, 3)), (fig08.problem, (1, 3))]
)
def test_down_to_no_force_at_all(problem, harmonics):
    """Towards rest motions become too small for squares of their inverses; at rest they are 0."""
    start = problem(harmonics).with_parameters(normal_load=1.0)
    followed = sh.follow(
        start, "force_amplitude", (1, 0), frequency=15.0 if problem is fig03.problem else 77.0
    )
    assert str(followed.status.values) == sh.Status.REACHED_END
    assert followed.converged.all()
    assert float(followed.force_amplitude[-1]) == 0.0
    np.testing.assert_array_equal(followed.amplitude[-1], 0.0)
    assert int(followed.n_points) < 60
    # Below the onset of slip the response is linear.
    stuck = followed.isel(point=[-3, -2])
    assert (stuck.contact_state == 0).all()
    ratio = (stuck.amplitude / stuck.force_amplitude).values
    np.testing.assert_allclose(ratio[0], ratio[1], rtol=1e-9)


@pytest.mark.parametrize("size", [1e-170, 1e-305, 5e-324])
def test_motions_too_small_to_have_an_inverse(size):
    """They are none: the events of the law are those of rest, up to the mean."""
    for harmonics in ((1, 3), (0, 1, 2, 3)):
        basis = FourierBasis(harmonics)
        motion = size * np.random.default_rng(1).uniform(0.5, 1, (2, basis.n_components))
        limits = np.array([1e4, 1e6]), np.array([0.0, 1.0])
        found = locate(basis, motion, *limits)
        rest = locate(basis, 0 * motion, *limits)
        for field in ("matrix", "vector", "slip", "slip_margin_gradient", "stick_fraction"):
            np.testing.assert_array_equal(getattr(found, field), getattr(rest, field))
        sampled = locate_sampled(basis, motion, *limits, samples=64)
        assert np.isfinite(sampled.slip_margin_gradient).all()
