"""Exact periodic motions: reference values, balances, independent sliders, symmetries, limits."""

from functools import cache, partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from symhbm.numerics.loops.polynomials import crossings
from symhbm.time_domain.event_march import march
from symhbm.time_domain.exact_motion import exact_motion
from symhbm.time_domain.linear_motion import DEGREE, LinearMotion, extremes
from tests.designs import uneven
from tests.problems import rub
from tests.reference import EXACT
from tests.refusals import refused

TURN = 2 * np.pi


def blade(**values):
    return fig03.problem().with_parameters(**values)


def ring(order=1, **values):
    return fig08.problem().with_parameters(engine_order=order, **values)


def mistuned(n_blades, normal_load, excitation, harmonics=(1,)):
    return uneven(n_blades, excitation, harmonics, normal_load=normal_load)


def gyroscopic():
    """Full matrices, contacts to the ground and between, damping that is not symmetric."""
    rng = np.random.default_rng(4)
    spread, turn = rng.normal(size=(2, 4, 4))
    model = sh.Model(
        np.eye(4) + 0.1,
        np.eye(4) + 5 * (turn - turn.T),
        1e4 * (2 * np.eye(4) + 0.1 * spread @ spread.T),
        contacts=[(0, 1), (1, 2), (3,), (0,)],
        **rub([1e4, 3e4, 1e5, 1e4], 0.5, [1, 2, 0.1, 50]),
    )
    force = sh.forces.HarmonicForce(
        cosine={1: [1, 0, 0, 1], 2: [0, 1, 0, 0]}, sine={3: [0, 0, 1, 0]}
    )
    return sh.HarmonicBalance(model, force, (1, 2, 3))


def all_harmonics(normal_load):
    """A mean and even harmonics: no symmetry between the halves of the period."""
    force = sh.forces.HarmonicForce(
        cosine={0: [0.3, 0, 0, 0, 0, 0], 1: [1, 0, 0, 0.5, 0, 0], 2: [0, 1, 0, 0, 0, 0.3]},
        sine={3: [0, 0, 0.2, 0, 0, 0]},
    )
    return mistuned(6, normal_load, force, (0, 1, 2, 3))


def together():
    """Two equal bodies whose contacts change their states at the same instants."""
    model = sh.Model(
        np.eye(2),
        0.5 * np.eye(2),
        1e4 * np.eye(2),
        contacts=[(0,), (1,), (0, 1)],
        **rub(1e4, 0.5, 2.0),
    )
    return sh.HarmonicBalance(
        model, sh.forces.HarmonicForce(cosine={1: [1, 1], 3: [0.2, 0.2]}), (1, 3)
    )


CASES = {
    "blade": (partial(blade, normal_load=1.5), 15.0),
    "blade, stuck": (partial(blade, normal_load=100.0), 20.0),
    "blade, no damping": (partial(blade, normal_load=3.0, damping=0.0), 20.0),
    "blade, no damping, at the resonance of slip": (
        partial(blade, normal_load=1.6, damping=0.0),
        100 / TURN,
    ),
    "ring, order 1": (partial(ring, 1, normal_load=10.0), 63.0),
    "ring, order 3": (partial(ring, 3), 212.736),
    "ring, order 0": (partial(ring, 0), 20.0),
    "ring, no friction": (partial(ring, 1, friction_coefficient=0.0), 20.0),
    "ring, no contact spring": (partial(ring, 1, contact_stiffness=0.0), 20.0),
    "3 blades": (partial(mistuned, 3, 1.0, sh.forces.PointForce(amplitude=3.0)), 100.0),
    "6 blades": (partial(mistuned, 6, 1.0, sh.forces.PointForce(amplitude=3.0)), 100.0),
    "13 blades": (partial(mistuned, 13, 20.0, sh.forces.EngineOrder(1)), 75.0),
    "24 blades": (partial(mistuned, 24, 5.0, sh.forces.EngineOrder(3)), 120.0),
    "all harmonics, slip": (partial(all_harmonics, 1.0), 60.0),
    "all harmonics, stick": (partial(all_harmonics, 100.0), 60.0),
    "gyroscopic": (gyroscopic, 25.0),
    "together": (together, 19.0),
}
each_case = pytest.mark.parametrize("name", CASES)


@cache
def solved(name):
    build, hertz = CASES[name]
    problem = build()
    motion = exact_motion(problem, TURN * hertz)
    assert motion.converged, motion.status
    return problem, motion


REFERENCE_POINTS = [
    (partial(blade, normal_load=point["Fn"]), point) for point in EXACT["single_blade_points"]
] + [
    (partial(ring, curve["EO"], normal_load=curve["Fn"]), point)
    for curve in EXACT["ring_EO_1_3_6_Fn100"]
    for point in curve["points"]
]


def test_reference_values():
    """The reference is good to 1e-11; what is asked is ten times that."""
    assert len(REFERENCE_POINTS) == 49
    for build, point in REFERENCE_POINTS:
        motion = exact_motion(build(), TURN * point["freq_hz"])
        np.testing.assert_allclose(motion.amplitude, point["x_max_abs"], rtol=1e-10)
        if "a" not in point:
            continue
        a, b = (np.array(point[key]).T for key in ("a", "b"))
        found = motion.coefficients(range(1, a.shape[1] + 1))[0]
        size = 1e-10 * max(np.abs(a).max(), np.abs(b).max())
        np.testing.assert_allclose(found[:, 0::2], a, rtol=0, atol=size)
        np.testing.assert_allclose(found[:, 1::2], b, rtol=0, atol=size)
        np.testing.assert_allclose(1 - motion.stick_fraction, point["slip_fraction"], atol=1e-10)


@each_case
def test_periodic_and_energy_balanced(name):
    """Both to 1e-10: round-off of a march is 1e-14, the last step of Newton's method leaves it."""
    problem, motion = solved(name)
    assert motion.periodicity < 1e-10
    start, end = motion.at(0.0), motion.at(TURN * (1 - 1e-15))
    size = motion.amplitude.max()
    sizes = size, motion.frequency * size, problem.model.contact_stiffness.max() * size
    for first, last, scale in zip(start, end, sizes, strict=True):
        np.testing.assert_allclose(last, first, rtol=0, atol=1e-10 * scale)
    lost = motion.friction_loss.sum() + motion.damping_loss
    # Work is a small difference where little is lost: it is measured by the power exchanged.
    x = motion.coefficients(range(1, 4))[0]
    exchanged = np.pi * np.abs(x).max() * motion._linear.largest_force
    assert abs(motion.work - lost) < 1e-10 * exchanged
    assert np.all(motion.friction_loss >= -1e-12 * exchanged)


@pytest.mark.parametrize("share", [1 - 1e-11, 1 + 1e-11])
def test_grazing(share):
    """A limit a hair below the force of a stuck contact: two slips of 5e-6 rad, or none at all."""
    stuck = exact_motion(blade(normal_load=100.0), TURN * 20.0)
    reach = 1e4 * stuck.amplitude[0]
    motion = exact_motion(blade(normal_load=2 * reach * share), TURN * 20.0)
    assert motion.converged
    np.testing.assert_allclose(motion.amplitude, stuck.amplitude, rtol=1e-8)
    if share > 1:
        assert not len(motion.event_angle)
        assert motion.friction_loss[0] == 0
    else:
        assert list(motion.event_kind) == ["slip", "stick"] * 2
        # The top of a cosine cut at 1 - 1e-11: half the cut of sqrt(2e-11) on either side, at the
        # onset; the slip moves the extremes, so that only the order of magnitude is asked.
        assert 1e-7 < 1 - motion.stick_fraction[0] < 1e-4
        assert motion.friction_loss[0] > 0


@pytest.mark.parametrize(("ratio", "limit"), [(0.7, 0.3), (1.3, 0.5)])
def test_rigid_contacts_approach_coulomb_friction(ratio, limit):
    """Den Hartog's closed form (1931) of motions without stops, at the rate of k_d^(-1/2)."""
    shape = np.sin(np.pi / ratio) / (ratio * (1 + np.cos(np.pi / ratio)))
    rigid = 1e-4 * np.sqrt(1 / (1 - ratio**2) ** 2 - (shape * limit) ** 2)
    amplitudes = []
    for stiffness in 1e8 * 4.0 ** np.arange(6):
        problem = blade(**rub(stiffness, 1.0, limit), damping=0.0)
        motion = exact_motion(problem, 100 * ratio)
        assert motion.converged
        amplitudes.append(motion.amplitude[0])
    errors = np.array(amplitudes) / rigid - 1
    # Four times the stiffness, half of the error; the next order is a thousandth of it here.
    np.testing.assert_allclose(errors[:-1] / errors[1:], 2, rtol=0.01)
    limits = np.array(amplitudes)
    for order in range(1, len(limits)):
        # Richardson's extrapolation in powers of k_d^(-1/2).
        limits = (2**order * limits[1:] - limits[:-1]) / (2**order - 1)
    assert limits[0] == pytest.approx(rigid, rel=1e-8)


def test_order_zero_and_no_force_rest():
    _, motion = solved("ring, order 0")
    np.testing.assert_array_equal(motion.reversals, 0)
    # Equal blades move alike but for round-off of their sum of forces.
    assert np.abs(motion.at(np.linspace(0, TURN, 50))[2]).max() < 1e-9
    rest = exact_motion(ring(1, force_amplitude=0.0), TURN * 20.0)
    assert rest.converged
    np.testing.assert_array_equal(rest.amplitude, 0.0)


def test_undamped_resonance_is_singular():
    body = sh.HarmonicBalance(sh.Model([[1.0]], [[0.0]], [[1e4]]), sh.forces.PointForce())
    motion = exact_motion(body, 100.0)
    assert not motion.converged
    assert motion.status == sh.Status.SYSTEM_SINGULAR


SINGULAR = sh.Model(np.ones((2, 2)), np.eye(2), np.eye(2))
test_bad_input = refused([
    (lambda: exact_motion(blade(cubic_stiffness=1.0), 100.0), ValueError, "Cubic"),
    (lambda: exact_motion(blade(), 0.0), ValueError, "frequency"),
    (lambda: exact_motion(blade(), 100.0, np.zeros(4)),
     ValueError, r"start: expected shape \(3,\)"),
    (lambda: exact_motion(blade(), 100.0, ["a"]), TypeError, "start"),
    (lambda: exact_motion(sh.HarmonicBalance(SINGULAR, sh.forces.PointForce()), 1.0),
     ValueError, "mass_matrix"),
])  # fmt: skip


def polynomial(roots):
    powers = np.zeros(DEGREE + 1)
    powers[: len(roots) + 1] = np.polynomial.polynomial.polyfromroots(roots)
    return powers


@given(st.lists(st.floats(0.01, 0.99), min_size=0, max_size=5), st.floats(1.1, 3.0))
@settings(max_examples=200)
def test_every_change_of_sign_is_found(roots, outside):
    """A root of a cluster of five is known to a fifth root of round-off, 1e-3."""
    powers = polynomial([*sorted(roots), outside])
    found = [place for place, _ in crossings(powers)]
    assert len(found) <= len(roots)
    assert (len(found) - len(roots)) % 2 == 0
    gaps = np.diff([-1.0, *sorted(roots), 2.0])
    for i, root in enumerate(sorted(roots)):
        if min(gaps[i], gaps[i + 1]) > 0.02:
            assert min(abs(place - root) for place in found) < 1e-3


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_close_pairs_differ_from_double_zeros(gap):
    """Round-off of the values, 1e-16, hides pairs closer than 1e-8 only."""
    found = list(crossings(polynomial([0.3, 0.3 + gap])))
    assert [falls for _, falls in found] == [True, False]
    np.testing.assert_allclose([place for place, _ in found], [0.3, 0.3 + gap], atol=1e-10 / gap)
    apart = polynomial([0.3, 0.3])
    apart[0] += gap**2
    assert not list(crossings(apart))


def test_extremes_of_polynomials():
    """Extremes inside and at the ends, against 1e5 samples: half a step squared, 1e-10."""
    powers = np.zeros((2, DEGREE + 1, 2))
    powers[0, :5] = np.random.default_rng(0).normal(size=(5, 2))
    powers[1, :2] = powers[0].sum(axis=0), [1.0, -1.0]
    samples = np.linspace(0, 1, 100_001)[:, None] ** np.arange(DEGREE + 1)
    values = np.concatenate([samples @ part for part in powers])
    high, low = extremes(powers)
    np.testing.assert_allclose(high, values.max(axis=0), atol=1e-9)
    np.testing.assert_allclose(low, values.min(axis=0), atol=1e-9)


def test_a_march_ends_where_less_than_an_instant_is_left():
    """An event within round-off of the end leaves an interval that no cell is made of."""
    values = dict(mass=1, stiffness=1e4, damping=0.5, contact_stiffness=1e4)
    values |= dict(friction_coefficient=0.5, normal_load=3)
    problem = sh.HarmonicBalance(sh.single_blade(**values), sh.forces.PointForce(), (1, 3))
    linear = LinearMotion(problem, 120.0)
    state = np.array([3e-4, 0.0, 1.0])
    last = march(linear, state, 2 * np.pi).events[-1, 0]
    for steps in (0, 1, 2):
        length = last
        for _ in range(steps):
            length = np.nextafter(length, 10)
        run = march(linear, state, length)
        assert abs(run.cells.start[-1] + run.cells.width[-1] - length) < 3e-15
