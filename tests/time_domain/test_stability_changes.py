"""Changes of stability, against Floquet multipliers of motions that SciPy integrates and closes."""

import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import symhbm as sh
from symhbm.time_domain.stability_changes import _Along, _Sample
from tests.continuation.test_branch_points import DAMPING, GAMMA, TURN, pair, pitchforks
from tests.pressed_contact import two_blades
from tests.problems import duffing, rub

CHANGES = ("period doubling", "Neimark-Sacker", "symmetry breaking", "change of stability")


class Motion:
    """Motions of ``x'' = -damping x' - force(x, x') + drive cos(w t)``, closed by shooting.

    ``slopes`` gives the derivatives of the force by displacement and velocity.
    """

    def __init__(self, size, force, slopes, drive):
        self.size, self.force, self.slopes, self.drive = size, force, slopes, drive

    def period(self, omega, state):
        """State (2 size,) after a period, and its derivative by the first one."""
        n = self.size

        def rate(t, both):
            x, v = both[: 2 * n].reshape(2, n)
            change = both[2 * n :].reshape(2, n, 2 * n)
            by_x, by_v = self.slopes(x, v)
            pushed = -by_x @ change[0] - by_v @ change[1]
            acceleration = self.drive * np.cos(omega * t) - self.force(x, v)
            return np.concatenate([v, acceleration, change[1].ravel(), pushed.ravel()])

        start = np.concatenate([state, np.eye(2 * n).ravel()])
        end = solve_ivp(rate, (0, TURN / omega), start, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        return end[: 2 * n], end[2 * n :].reshape(2 * n, 2 * n)

    def multipliers(self, omega, state):
        """Multipliers of the periodic motion near a state, by Newton's method."""
        for _ in range(12):
            end, slope = self.period(omega, state)
            step = np.linalg.solve(slope - np.eye(len(state)), end - state)
            state = state - step
            if np.linalg.norm(step) < 1e-9 * np.linalg.norm(state):
                return np.linalg.eigvals(slope)
        raise AssertionError("no periodic motion")


def state_of(point):
    """Displacement and velocity at the start of the period of a point of a dataset."""
    omega, harmonic = TURN * float(point.frequency), point.harmonic.values
    cosine, sine = (point.coefficient.sel(component=c).values for c in ("cos", "sin"))
    return np.concatenate([cosine.sum(axis=1), omega * sine @ harmonic])


def changes_of(curve):
    """Kind and index of the point of each change of stability of one curve."""
    values = curve.frequency.values.tolist()
    pairs = zip(curve.event_kind.values, curve.event_frequency.values, strict=True)
    return [(kind, values.index(at)) for kind, at in pairs if kind in CHANGES]


def check_change(curve, index, motion, beyond, rtol):
    """Zero growth at the point, and the exact change close by; returns the multipliers beside it.

    ``beyond`` is positive where the motion is unstable, a function of its multipliers.
    """
    point = curve.isel(point=index)
    omega = TURN * float(point.frequency)
    assert abs(float(point.growth_rate)) < 1e-8 * omega
    assert {*curve.stability.values[[index - 1, index + 1]].tolist()} == {0, 1}
    state = state_of(point)

    def distance(shift):
        return beyond(motion.multipliers(omega * (1 + shift), state))

    sides = -10 * rtol, 10 * rtol
    assert distance(sides[0]) * distance(sides[1]) < 0
    shift = brentq(distance, *sides, xtol=1e-9)
    assert abs(shift) < rtol
    return motion.multipliers(omega * (1 + shift), state)


def followed(problem, band, **options):
    with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
        return sh.frf(problem, tuple(edge / TURN for edge in band), **options)


def stiffening(force, damping, harmonics):
    return duffing(harmonics, damping, 1.0, force)


@pytest.mark.slow
def test_period_doubling():
    """On the motions of a Duffing oscillator with a mean, which branch off the odd ones."""
    path = followed(stiffening(25.0, 0.2, range(16)), (2.5, 1.3))
    assert not changes_of(path)
    branch = sh.other_branches(path).isel(branch=1)
    motion = Motion(
        1,
        lambda x, v: 0.2 * v + x + x**3,
        lambda x, v: (np.diag(1 + 3 * x**2), 0.2 * np.eye(1)),
        np.array([25.0]),
    )
    found = [index for kind, index in changes_of(branch) if kind == "period doubling"]
    assert len(found) == len(changes_of(branch)) >= 1
    # The two halves of the branch are the same motion, turned over.
    values = branch.frequency.values[found]
    assert np.ptp(values[np.abs(values - values[0]) < 1e-3]) < 1e-9
    at = check_change(branch, found[0], motion, lambda values: -1 - values.real.min(), 1e-6)
    assert np.abs(at + 1).min() < 1e-6


@pytest.mark.slow
def test_neimark_sacker():
    """On the motions of two equal Duffing oscillators that differ."""
    path = followed(pair(0.3, 0.1, harmonics=(1, 3, 5, 7, 9)), (1.0, 1.5))
    branch = sh.other_branches(path).isel(branch=1)
    stiffness = np.array([[1.1, -0.1], [-0.1, 1.1]])
    motion = Motion(
        2,
        lambda x, v: stiffness @ x + DAMPING * v + GAMMA * x**3,
        lambda x, v: (stiffness + np.diag(3 * GAMMA * x**2), DAMPING * np.eye(2)),
        np.array([0.3, 0.3]),
    )
    found = [index for kind, index in changes_of(branch) if kind == "Neimark-Sacker"]
    assert len(found) == len(changes_of(branch)) == 2
    for index in found:
        at = check_change(branch, index, motion, lambda values: np.abs(values).max() - 1, 1e-6)
        passing = at[np.abs(np.abs(at) - 1) < 1e-6]
        assert len(passing) == 2
        assert np.abs(passing.imag).min() > 0.1


@pytest.mark.slow
def test_a_law_of_velocity():
    """A driven van der Pol oscillator leaves entrainment through a pair of multipliers."""
    law = sh.laws.SmoothLaw(
        lambda y, v, p: p["growth"] * (y**2 - 1) * v,
        parameters={"growth": (0.1, "N s/m")},
        directions=[(0,)],
    )
    model = sh.Model([[1.0]], [[0.0]], [[1.0]], contacts={"own": law})
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=0.3), (1, 3, 5, 7, 9))
    curve = followed(problem, (0.7, 1.4), stability=True)
    found = [index for kind, index in changes_of(curve) if kind == "Neimark-Sacker"]
    assert len(found) == len(changes_of(curve)) == 2
    motion = Motion(
        1,
        lambda x, v: x + 0.1 * (x**2 - 1) * v,
        lambda x, v: (np.diag(1 + 0.2 * x * v), np.diag(0.1 * (x**2 - 1))),
        np.array([0.3]),
    )
    for index in found:
        check_change(curve, index, motion, lambda values: np.abs(values).max() - 1, 1e-6)


@pytest.mark.slow
def test_odd_motions_lose_their_symmetry_where_even_harmonics_branch_off():
    """A multiplier of the half period that odd harmonics alone do not balance."""
    odd = followed(stiffening(10.0, 0.1, range(1, 20, 2)), (2.5, 1.0))
    whole = followed(stiffening(10.0, 0.1, range(20)), (2.5, 1.0))
    found = changes_of(odd)
    assert [kind for kind, _ in found] == ["symmetry breaking"]
    at = odd.frequency.values[found[0][1]]
    branch = whole.event_frequency.values[whole.event_kind.values == "branch point"]
    np.testing.assert_allclose(at, branch, rtol=1e-9)


def test_points_where_more_than_two_branches_meet():
    """A ring of three gives way in two ways at once: no sign changes, a multiplier passes +1."""
    coupling = 0.02
    stiffness = np.eye(3) + coupling * (3 * np.eye(3) - 1)
    model = sh.Model(
        np.eye(3),
        DAMPING * np.eye(3),
        stiffness,
        contacts=[(0,), (1,), (2,)],
        cubic_stiffness=GAMMA,
    )
    problem = sh.HarmonicBalance(model, sh.forces.HarmonicForce(cosine={1: [0.3] * 3}))
    curve = followed(problem, (0.5, 2.0))
    assert not (curve.event_kind == "branch point").any()
    # Differences feel the coupling three times, in a pair twice.
    lower = pitchforks(0.3, 1.5 * coupling).min()
    kinds = [kind for kind, index in changes_of(curve)]
    at = [TURN * curve.frequency.values[index] for _, index in changes_of(curve)]
    assert kinds == ["change of stability"]
    assert at[0] == pytest.approx(lower, rel=1e-9)


def test_friction_that_ends_flutter():
    """Forces that are not symmetric make stuck contacts flutter; the onset of slip ends that."""
    model = sh.Model(
        np.eye(2),
        0.5 * np.eye(2),
        [[1e4, 200.0], [-200.0, 1.02e4]],
        contacts=[(0,), (1,)],
        **rub(3e3, 0.5, 3.0),
    )
    problem = sh.HarmonicBalance(model, sh.forces.HarmonicForce(cosine={1: [1.0, 0.5]}), (1, 3, 5))
    for band in ((14, 24), (24, 14)):
        with warnings.catch_warnings(action="ignore", category=UserWarning):  # not symmetric
            curve = sh.frf(problem, band, stability=True)
        kinds, at = curve.event_kind.values.astype(str), curve.event_frequency.values
        changes, slip = at[kinds == "change of stability"], at[np.char.endswith(kinds, "of slip")]
        assert np.sort(changes).tolist() == [slip.min(), slip.max()]
        inside = (curve.frequency > slip.min()) & (curve.frequency < slip.max())
        outside = (curve.frequency < slip.min()) | (curve.frequency > slip.max())
        assert (curve.stability[inside.values] == 1).all()
        assert (curve.stability[outside.values] == 0).all()


@pytest.mark.parametrize("options", [dict(keep=["event_kind"]), dict(at=[0.2, 0.21])])
def test_changes_are_of_paths_whose_stability_is_told(options):
    problem = stiffening(10.0, 0.1, (1, 3, 5))
    assert not {*followed(problem, (2.5, 1.0), **options).event_kind.values} & {*CHANGES}
    assert changes_of(followed(problem, (2.5, 1.0)))


def test_contacts_that_open_double_the_period():
    """Two blades whose shrouds rub and part: the exact motions on both sides of each change."""
    problem = two_blades().with_harmonics(tuple(range(10)))
    curve = sh.frf(problem, (23, 25))
    found = changes_of(curve)
    assert [kind for kind, _ in found] == ["period doubling"] * 2
    for _, index in found:
        at = float(curve.frequency[index])
        beyond = []
        for shift in (-2e-3, 2e-3):
            motion = sh.periodic_motion(problem, at * (1 + shift))
            real = motion.multiplier_real.values[motion.multiplier_imag.values == 0]
            beyond.append(-1 - real.min())
        assert beyond[0] * beyond[1] < 0


@pytest.mark.slow
def test_two_period_doublings_within_a_step():
    """On both sides two multipliers turn on one circle, and the growth rate is constant."""
    stop = sh.Gap(normal=(0, 1), normal_stiffness=76306.0, gap=0.0)
    damping, stiffness = 7.4 * np.eye(2), [[1.2e4, -2e3], [-2e3, 1.4e4]]
    model = sh.Model(np.eye(2), damping, stiffness, contacts={"stop": stop})
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=5.0), range(8))
    up, down = (
        sh.follow(problem, "gap", band, frequency=16.0, stability=True)
        for band in ((-5.12e-5, -4.94e-5), (-4.94e-5, -5.12e-5))
    )
    found = []
    for curve in (up, down):
        doubles = curve.event_kind.values == "period doubling"
        found.append(np.sort(curve.event_gap.values[doubles]))
    assert len(found[0]) == 2
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


@pytest.mark.parametrize(("rates", "asked"), [((-3, 0.5), [0.5]), ((0.5, 3), [0.5]), ((2, 3), [])])
def test_rates_are_looked_at_between_points_of_which_one_is_close_to_zero(rates, asked):
    low, high = (_Sample(float(i), rate, 1.0, int(np.sign(rate))) for i, rate in enumerate(rates))
    shares: list[float] = []
    along: Any = SimpleNamespace(_close=1.0, _sample=lambda share: shares.append(share) or low)
    _Along._middle(along, low, high)
    assert shares == asked
