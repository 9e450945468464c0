"""Pitchforks and detached branches of cubic springs, against all solutions of one harmonic.

Two equal Duffing oscillators, coupled by a spring and driven alike, may move alike: then each is
one such oscillator, whose responses are roots of a cubic. Motions that differ branch off where the
equations of a small difference are singular. Beside that all solutions are looked for at random.
"""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq, root

import symhbm as sh
from symhbm.continuation.correctors import corrector_of
from symhbm.continuation.events.turns import find_branch_point
from symhbm.continuation.newton import newton
from symhbm.continuation.problem import FrequencyProblem
from symhbm.continuation.status import Status
from tests.quick import quick_first

TURN = 2 * np.pi
GAMMA, DAMPING = 0.1, 0.05


def pair(force, coupling, difference=0.0, harmonics=(1,)):
    stiffness = [[1 + coupling, -coupling], [-coupling, 1 + coupling + difference]]
    model = sh.Model(
        np.eye(2), DAMPING * np.eye(2), stiffness, contacts=[(0,), (1,)], cubic_stiffness=GAMMA
    )
    return sh.HarmonicBalance(model, sh.forces.HarmonicForce(cosine={1: [force, force]}), harmonics)


def alike(omega, force):
    """Amplitudes of all motions alike: ``[(1 - w^2 + s a^2)^2 + (c w)^2] a^2 = f^2``."""
    spring, detuning = 0.75 * GAMMA, 1 - omega**2
    square = np.roots(
        [spring**2, 2 * spring * detuning, detuning**2 + (DAMPING * omega) ** 2, -(force**2)]
    )
    return np.sort(np.sqrt(square.real[np.abs(square.imag) < 1e-9 * np.abs(square)]))


def pitchforks(force, coupling):
    """Frequencies where small differences of motions alike have a solution, over all amplitudes."""

    def curve(square, side):
        """The frequency at an amplitude, on either flank, and the determinant of differences."""
        spring = 0.75 * GAMMA * square
        centre = 1 + spring - DAMPING**2 / 2
        rest = centre**2 - (1 + spring) ** 2 + force**2 / square
        squared = centre + side * np.sqrt(max(rest, 0.0))
        stuck = 1 + 2 * coupling - squared
        return np.sqrt(squared), (stuck + 3 * spring) * (stuck + spring) + DAMPING**2 * squared

    # At the peak both flanks meet: c w a = f.
    top = max(alike(omega, force)[-1] for omega in np.linspace(1.0, 2.0, 2001)) ** 2
    squares = np.geomspace((1.2 * force) ** 2, top * (1 - 1e-9), 4001)
    frequencies = []
    for side in (-1, 1):
        values = np.array([curve(square, side)[1] for square in squares])
        for i in np.flatnonzero(values[1:] * values[:-1] < 0):
            zero = brentq(lambda s, side=side: curve(s, side)[1], *squares[i : i + 2], xtol=1e-14)
            frequencies.append(curve(zero, side)[0])
    return np.sort(frequencies)


@cache
def all_solutions(omega, force, coupling, difference=0.0, harmonics=1, n_starts=400):
    """All amplitudes (n, 2) that random starts lead to, by equations of its own."""
    stiffness = np.array([[1 + coupling, -coupling], [-coupling, 1 + coupling + difference]])

    def balance(unknowns):
        x = unknowns.reshape(2, 2) @ [1, 1j]  # cosine + i sine: x = Re(conj(c) exp(i w t))
        spring = 0.75 * GAMMA * np.abs(x) ** 2 * x
        # The derivative of Re(conj(c) exp(i w t)) has the coefficient -i w c.
        force_balance = stiffness @ x - omega**2 * x - 1j * omega * DAMPING * x + spring - force
        return np.column_stack([force_balance.real, force_balance.imag]).ravel()

    rng, solutions = np.random.default_rng(3), []
    for _ in range(n_starts):
        result = root(balance, 4 * rng.normal(size=4), tol=1e-13)
        if np.abs(balance(result.x)).max() > 1e-10:
            continue
        if all(np.abs(result.x - other).max() > 1e-5 for other in solutions):
            solutions.append(result.x)
    return np.array([np.hypot(*x.reshape(2, 2).T) for x in solutions])


@pytest.mark.parametrize(("force", "coupling"), [(0.18, 0.02), (0.3, 0.02), (0.3, 0.1)])
@pytest.mark.parametrize("band", [(0.5, 2.0), (2.0, 0.5)])
def test_pitchforks_are_reported_and_passed(force, coupling, band):
    problem = pair(force, coupling)
    with pytest.warns(RuntimeWarning, match="other solutions branch off"):
        path = sh.frf(problem, tuple(edge / TURN for edge in band))
    assert path.status.item() == Status.BRANCH_POINTS
    is_branch = path.event_kind.values == "branch point"
    reported = TURN * np.sort(path.event_frequency.values[is_branch])
    exact = pitchforks(force, coupling)
    np.testing.assert_allclose(reported, exact, rtol=1e-10)
    assert np.all(path.event_contact.values[is_branch] == -1)
    # The path is that of motions alike, as far as these digits go.
    for omega, amplitude in zip(TURN * path.frequency.values, path.amplitude.values, strict=True):
        assert amplitude[0] == pytest.approx(amplitude[1], rel=1e-6)
        spring = 0.75 * GAMMA * amplitude[0] ** 2
        balance = np.hypot(1 - omega**2 + spring, DAMPING * omega) * amplitude[0]
        assert balance == pytest.approx(force, rel=1e-6)
    # All of it, and no solution twice.
    omegas = np.linspace(1.05, 1.5, 7)
    with pytest.warns(RuntimeWarning, match="other solutions branch off"):
        grid = sh.frf(problem, tuple(edge / TURN for edge in band), at=omegas / TURN)
    for omega, rows in zip(omegas, grid.transpose("frequency", ...).amplitude.values, strict=True):
        solutions = np.sort(rows[np.isfinite(rows[:, 0]), 0])
        np.testing.assert_allclose(solutions, alike(omega, force), rtol=1e-8)


@pytest.mark.parametrize(("difference", "meet"), [(0.0, True), (1e-6, False), (1e-3, False)])
def test_paths_that_come_close_do_not_meet(difference, meet):
    """Motions nearly alike before and beyond a pitchfork are one path in a symmetric pair alone."""
    curve = FrequencyProblem(pair(0.3, 0.02, difference))
    corrector = corrector_of(curve)
    (_, pitchfork), states = pitchforks(0.3, 0.02), []
    for omega in (pitchfork - 0.01, pitchfork + 0.01):
        # The middle one of three, the force ahead of the motion by its phase.
        amplitude = alike(omega, 0.3)[1]
        stiffness = 1 - omega**2 + 0.75 * GAMMA * amplitude**2
        motion = 0.3 / (stiffness + 1j * omega * DAMPING)
        start = np.tile([motion.real, -motion.imag], 2)
        solution = newton(lambda trial, omega=omega: curve.evaluate(trial, omega), start)
        assert solution.converged
        assert np.abs(solution.unknowns - start).max() < 100 * difference + 1e-9
        states.append(np.append(solution.unknowns, omega))
    scale, slip = curve.scale(states[0]), np.zeros(2, dtype=bool)
    row = (states[1] - states[0]) / scale
    tangents = [corrector.tangent(state, scale, row, slip) for state in states]
    assert tangents[0].sign != tangents[1].sign
    base = SimpleNamespace(state=states[0], after=tangents[0].direction * scale, switches=slip)
    base.scale = scale
    solution = find_branch_point(corrector, base, tangents[1])
    assert (solution is not None) == meet
    if meet:
        assert solution.point[-1] == pytest.approx(pitchfork, rel=1e-10)


@pytest.mark.parametrize("coupling", quick_first([0.15, 0.08], 1))
def test_branch_points_next_to_folds(coupling):
    """Two masses far apart in a chain hardly feel each other, and give way where each one folds."""
    n = 8
    chain = np.diag([1.0] + [2.0] * (n - 2) + [1.0]) - np.eye(n, k=1) - np.eye(n, k=-1)
    model = sh.Model(
        np.eye(n),
        DAMPING * np.eye(n),
        np.eye(n) + coupling * chain,
        contacts=[(0,), (n - 1,)],
        cubic_stiffness=0.3,
    )
    force = np.zeros(n)
    force[[0, -1]] = 0.4
    problem = sh.HarmonicBalance(model, sh.forces.HarmonicForce(cosine={1: force}))
    events = []
    for band in ((0.1, 0.4), (0.4, 0.1)):
        with pytest.warns(RuntimeWarning, match="other solutions branch off"):
            path = sh.frf(problem, band)
        assert path.status.item() == Status.BRANCH_POINTS
        by_kind = zip(path.event_kind.values, path.event_frequency.values, strict=True)
        events.append(sorted(by_kind))
    up, down = events
    assert [kind for kind, _ in up] == [kind for kind, _ in down]
    np.testing.assert_allclose([at for _, at in up], [at for _, at in down], rtol=1e-10)
    folds, branch = ([at for kind, at in up if kind == k] for k in ("fold", "branch point"))
    assert len(folds) == len(branch) == 2
    np.testing.assert_allclose(folds, branch, rtol=1e-6)
    # Changes of stability are the same, too: here within one step of one of both paths.
    assert len(up) == (4 if coupling == 0.08 else 8)
