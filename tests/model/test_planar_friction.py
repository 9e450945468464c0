"""Friction in a plane: closed forms, one direction, samples, and derivatives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symhbm as sh
from symhbm.model.contacts import marched
from symhbm.numerics import FourierBasis
from tests.law_slopes import at_motion, figures_of, force_of, returned, turned_by, values_of
from tests.quick import quick_first
from tests.refusals import refused
from tests.stored.problems import case

# Every first use compiles the loops for a minute; the examples of a property are not to blame.
QUIET = settings(max_examples=30, derandomize=True)
KINDS = {
    "constant": sh.laws.PlanarFriction("constant"),
    "load": sh.laws.PlanarFriction(),
    "gap": sh.laws.PlanarFriction("gap"),
}


def random_motion(rng, basis, directions):
    decay = np.maximum(basis.order, 1) ** -1.5
    return rng.normal(size=(directions, basis.n_components)) * decay


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [1.01, 3.0, 100.0])
@pytest.mark.parametrize("harmonics", [(1,), (0, 1, 2, 3)])
def test_circle(kind, size, harmonics):
    basis, law = FourierBasis(harmonics), KINDS[kind]
    k, limit = 1.3, 0.8
    radius = size * limit / k
    motion = np.zeros((len(law.directions), basis.n_components))
    at = basis.component(1)
    motion[0, at], motion[1, at + 1] = radius, radius
    values = values_of(law, stiffness=k, friction=0.4, load=2.0)
    force, _ = force_of(law, basis, motion, values)
    along = limit**2 / (k * radius)
    across = limit * np.sqrt(1 - (limit / (k * radius)) ** 2)
    expected = np.zeros((2, basis.n_components))
    expected[0, at], expected[0, at + 1] = along, -across
    expected[1, at], expected[1, at + 1] = across, along
    np.testing.assert_allclose(force[:2], expected, rtol=0, atol=1e-11)
    figures = figures_of(law, basis, motion, values)
    assert figures["dissipation"] == pytest.approx(2 * np.pi * radius * across, rel=1e-10)
    assert figures["slip_distance"] == pytest.approx(2 * np.pi * radius * across / limit, rel=1e-10)
    assert figures["stick_fraction"] == 0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("inclined", [False, True])
def test_along_a_line_it_is_the_law_of_one_direction(kind, inclined):
    """Also where one motion is in both directions: a wall of the slider may stand still."""
    rng, law, constant = np.random.default_rng(4), KINDS[kind], kind == "constant"
    plain = sh.laws.Coulomb() if constant else sh.laws.VariableLoadFriction(law.given)
    basis, axis, states = FourierBasis((0, 1, 2, 3)), np.array([0.8, -0.6]), set()
    for load in (16.0, 4.0, 1.0, 0.3) if constant else (4.0, 2.5, 1.5, 0.8, 0.3, -0.2, -0.5):
        line, press = random_motion(rng, basis, 2)
        friction = rng.choice([0.5, 1.0, 2.0]) if inclined else 0.5
        press = 0.5 / friction * line if inclined else press
        values = values_of(law, load=load, friction=friction)
        one_way = np.array([line, press])[: len(plain.directions)]
        motion = np.vstack([np.outer(axis, line), one_way[1:]])
        force, located = force_of(law, basis, motion, values)
        expected, one = force_of(plain, basis, one_way, values)
        whole = np.vstack([np.outer(axis, expected[0]), expected[1:]])
        np.testing.assert_allclose(force, whole, rtol=0, atol=3e-12)
        np.testing.assert_array_equal(located.states, one.states)
        np.testing.assert_allclose(located.margins, one.margins, rtol=1e-9, atol=1e-12)
        figures = figures_of(law, basis, motion, values)
        own = figures_of(plain, basis, one_way, values)
        assert own.keys() - figures.keys() <= {"theta_0", "theta_star", "reversals"}
        for name in own.keys() & figures.keys():
            assert figures[name] == pytest.approx(own[name], rel=1e-9, abs=1e-11), name
        states.add(figures["contact_state"])
    assert states >= ({0, 1} if constant else {1, 2} if inclined else {0, 1, 2})


@pytest.mark.parametrize("kind", KINDS)
def test_against_radial_return(kind):
    """Of first order: eight times the samples, an eighth of the difference."""
    rng, law, basis, states = np.random.default_rng(2), KINDS[kind], FourierBasis((0, 1, 2)), []
    for load in (6.0, 2.2, 0.3, -0.4)[: 3 if kind == "constant" else 4]:
        values = values_of(law, load=load)
        motion = random_motion(rng, basis, len(law.directions))
        force, located = force_of(law, basis, motion, values)
        first = 0 if located.states[0, 0] else 1  # full stick leaves the mean to choose
        coarse, fine = (
            np.abs(returned(law, basis, motion, values, n, 10) - force)[:2, first:].max()
            for n in (500, 4000)
        )
        assert fine < 2e-3
        assert fine < 0.3 * coarse or fine < 1e-9
        states.append(figures_of(law, basis, motion, values)["contact_state"])
    assert {*states} >= ({0, 1} if kind == "constant" else {0, 1, 2})


FRICTION = KINDS | {"line": sh.laws.VariableLoadFriction()}


@QUIET
@given(st.sampled_from([*FRICTION]), st.integers(0, 10_000), st.floats(0, 6.3), st.floats(-2, 1))
def test_invariants(kind, seed, angle, level):
    """Turned axes, another origin of time, another scale; no work is won, and contacts push."""
    law, basis, rng = FRICTION[kind], FourierBasis((0, 1, 2, 3)), np.random.default_rng(seed)
    motion = random_motion(rng, basis, len(law.directions))
    load = 10**level if kind == "constant" else rng.uniform(-1, 4)
    values = values_of(law, stiffness=10**-level, friction=0.4, load=load)
    force, _ = force_of(law, basis, motion, values)
    scale = np.abs(force).max() + 1e-300
    axes = np.eye(len(motion))
    if "across" in law.directions:
        c, s = np.cos(angle), np.sin(angle)
        axes[:2, :2] = [[c, -s], [s, c]]
    turned, _ = force_of(law, basis, axes @ motion, values)
    np.testing.assert_allclose(turned, axes @ force, rtol=0, atol=2e-12 * scale)
    shift = turned_by(basis, angle)
    later, _ = force_of(law, basis, motion @ shift.T, values)
    np.testing.assert_allclose(later, force @ shift.T, rtol=0, atol=2e-12 * scale)
    figures = figures_of(law, basis, motion, values)
    assert figures["dissipation"] >= -1e-12 * scale
    least, mean, largest = (
        figures[f"{name}_normal_force"] for name in ("least", "mean", "largest")
    )
    assert 0 <= least <= mean + 1e-12
    assert mean <= largest + 1e-12
    assert figures["open_fraction"] + figures["stick_fraction"] <= 1 + 1e-12
    assert figures["dissipation"] <= 0.4 * largest * figures["slip_distance"] * (1 + 1e-9) + 1e-12
    rubs = [name != "normal" for name in law.directions]
    assert np.abs(force[rubs]).max() <= 4 / np.pi * 0.4 * largest * (1 + 1e-12)


def test_limits():
    """No spring, no friction, no motion, never touching, always open, touching without a load."""
    basis, rng = FourierBasis((0, 1, 2)), np.random.default_rng(7)
    for law in KINDS.values():
        motion = random_motion(rng, basis, len(law.directions))
        none = np.zeros_like(motion)
        for point, changed in (
            (motion, dict(stiffness=0.0)),
            (motion, dict(friction=0.0)),
            (none, {}),
            (motion, dict(load=0.0)),
            (none, dict(load=0.0)),
        ):
            values = values_of(law, **changed)
            force, located = force_of(law, basis, point, values)
            assert np.isfinite(force).all()
            assert np.isfinite(located.events).all()
            assert np.isfinite(located.margins_by_motion).all()
            assert not np.isnan(located.margins).any()
            if not (law.varies and "load" in changed and point is motion):
                np.testing.assert_array_equal(force[:2], 0)
            assert all(np.isfinite(v) for v in figures_of(law, basis, point, values).values())
    law, motion = KINDS["load"], random_motion(rng, basis, 3)
    apart = values_of(law, load=-50.0)
    force, located = force_of(law, basis, motion, apart)
    np.testing.assert_array_equal(force, 0)
    assert figures_of(law, basis, motion, apart)["contact_state"] == 3
    assert located.states.tolist() == [[True, True, False]]
    pressed = values_of(law, load=50.0)
    force, located = force_of(law, basis, motion, pressed)
    assert located.states.tolist() == [[False, False, True]]
    np.testing.assert_allclose(force[:, 1:], motion[:, 1:], rtol=1e-14)


def test_histories_without_friction_show_the_normal_force():
    """Such a contact slides freely wherever it is closed."""
    law, basis = KINDS["load"], FourierBasis((0, 1, 2))
    motion = random_motion(np.random.default_rng(7), basis, 3)
    values = values_of(law, friction=0.0, load=0.05)
    (history,) = law.history(at_motion(basis, motion, values), 64)
    press = 0.05 + basis.values(history.angle) @ motion[2]
    np.testing.assert_allclose(history.force[2], np.maximum(press, 0), rtol=0, atol=1e-12)
    assert not history.force[:2].any()
    # What it does from each point on, among which those are where it opens and closes.
    middle = (history.angle[1:] + history.angle[:-1]) / 2
    pushed = 0.05 + basis.values(middle) @ motion[2]
    np.testing.assert_array_equal(history.state[:-1], np.where(pushed > 0, 1, 2))
    changes = 1 + np.flatnonzero(np.diff(history.state))
    assert len(changes) >= 1
    np.testing.assert_allclose(press[changes], 0, atol=1e-12)


def test_laws_are_told_by_what_is_given():
    law = sh.laws.PlanarFriction("gap", preload="coupled")
    assert repr(law) == "PlanarFriction('gap', preload='coupled')"
    assert sh.laws.PlanarFriction() == sh.laws.PlanarFriction("normal_load")
    assert sh.laws.PlanarFriction() != sh.laws.PlanarFriction("gap")


def test_no_peak_where_slip_ends_on_a_flank():
    """A wrong slope before the end of slip made it a corner."""
    problem, _, _ = case("contacts that open", 34)
    response = sh.frf(problem, (33.45057, 36.45057), at=np.linspace(34.9, 35, 21), progress=False)
    assert response.event_kind.values.tolist() == ["end of slip"]
    assert (response.amplitude.isel(dof=0).diff("frequency") < 0).all()
    assert response.n_peaks == 0


@pytest.mark.parametrize("kind", ["constant", "load"])
def test_marches_beside_the_onset_of_slip_know_their_error(kind):
    """Laps settle slowly there: a hundred of them leave half of a slip that is not there."""
    law, basis, rng = KINDS[kind], FourierBasis((0, 1, 2, 3)), np.random.default_rng(1)
    tight = 0
    for _ in range(8):
        motion = random_motion(rng, basis, len(law.directions))
        motion[2:] *= 0.3
        ends = np.array([1e-2, 2e2])
        for _ in range(40):
            middle = np.sqrt(ends.prod())
            slips = force_of(law, basis, motion, values_of(law, load=middle))[1].states[0, 0]
            ends[0 if slips else 1] = middle
        for share in (1e-8, 1e-5, 1e-3, 3e-2):
            values = values_of(law, load=ends[1] * (1 - share))
            both = marched(law, at_motion(basis, motion, values))
            assert both is not None
            found, error = both
            known = figures_of(law, basis, motion, values)["dissipation"]
            scale = ends[1] * np.abs(motion[:2]).sum()
            # Within the bound of `verify`: samples miss a slip that is shorter than their spacing.
            assert abs(found.dissipation[0] - known) <= error.dissipation[0] + 1e-6 * scale
            tight += error.dissipation[0] < 1e-3 * scale
    assert tight > 24


def test_errors_of_marches_that_stick_are_those_of_round_off():
    law, basis = KINDS["constant"], FourierBasis((1,))
    each = [(mu, size * np.eye(2)) for mu, size in [(1, 1.0), (3, 1.0), (1, 2.0)]]
    at = [at_motion(basis, motion, values_of(law, load=1e6, friction=mu)) for mu, motion in each]
    few, *twice = (marched(law, one)[1].dissipation.item() for one in at)  # type: ignore[index]
    assert few > 0
    assert twice == pytest.approx([2 * few, 2 * few])


def block(across, places=True, **named):
    """A node with three directions, which rubs on the ground."""
    table = dict(node=[7, 7, 7], direction=[*"xyz"]) if places else None
    model = sh.Model(np.eye(3), np.eye(3), 1e4 * np.eye(3), places=table)
    friction = dict(contact_stiffness=1e4, friction_coefficient=0.3, normal_load=5.0)
    return model.with_contacts(pad=sh.Friction(tangential={0: 1.0}, across=across, **friction))


ANGLE = r"contacts\['pad'\], across\[0\]: expected .* at {} degrees"
test_what_is_no_plane_or_no_load_is_refused = refused([
    (lambda: block({0: -2.0}), ValueError, ANGLE.format(0)),
    (lambda: block({0: -2.0}, False), ValueError, ANGLE.format(0)),
    (lambda: block({"7:x": 1.0, "7:y": 1.0}), ValueError, ANGLE.format(45)),
    *(row for law in (sh.laws.PlanarFriction, sh.laws.VariableLoadFriction) for row in (
        (lambda law=law: law("force"),
         ValueError, "given='force': expected one of 'normal_load', 'gap'"),
        (lambda law=law: law(preload="none"),
         ValueError, "preload='none': expected one of 'balanced', 'coupled'"),
    )),
])  # fmt: skip


@pytest.mark.parametrize("places", [True, False])
def test_what_is_at_a_right_angle_is_taken(places):
    assert block({1: 0.6, 2: -0.8}, places).n_contacts == 1
    # Without places these may be coordinates of modes, whose angle nobody knows.
    if not places:
        assert block({0: 0.5, 1: 1.0}, places).n_contacts == 1


@pytest.mark.slow
@pytest.mark.parametrize("number", quick_first([34, 4], 1))
def test_slopes_at_onsets_are_those_of_slip(number):
    """On the side where the contact slips, whatever round-off says of the margin there."""
    problem, band, _ = case("contacts that open", number)
    path = sh.frf(problem, band, progress=False)
    events = [*zip(path.event_frequency.values, path.event_kind.values, strict=True)]
    beside = {f: f * (1 + (1e-9 if kind == "onset of slip" else -1e-9)) for f, kind in events}
    grid = sh.frf(problem, band, at=sorted(beside.values()), progress=False)
    points = path.swap_dims(point="frequency")
    for frequency, kind in events:
        name = "amplitude_slope" if kind == "onset of slip" else "amplitude_slope_before"
        slope = points[name].sel(frequency=frequency).values
        near = grid.amplitude_slope.sel(frequency=beside[frequency]).values
        np.testing.assert_allclose(slope, near, rtol=0, atol=1e-3 * np.abs(near).max())
