"""Motions without a force: their equations, and the paths of modes and of limit cycles."""

from dataclasses import replace

import numpy as np
import pytest
from closed_forms import OneBlade
from scipy.optimize import minimize_scalar

import symhbm as sh
from symhbm.balance import SustainedMotion, unforced
from symhbm.continuation import Status, newton
from symhbm.continuation.path import Path
from symhbm.continuation.unforced import (
    LimitCycleProblem,
    NonlinearModeProblem,
    cycles_of_mode,
    first_harmonic,
    follow_mode,
    linear_mode,
)
from symhbm.continuation.unforced.modes import _modes_about
from symhbm.model import Structure
from tests.pressed_contact import pressed_mass

ODD = tuple(range(1, 22, 2))


class PressedBlade(sh.laws.Coulomb):
    """Friction whose limit rises with the frequency, so that margins move with it."""

    def slip_limit(self, frequency, values):
        return values["friction_coefficient"] * (values["normal_load"] + 1e-4 * frequency**2)


def friction(law=None, **values):
    given = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3.0)
    return sh.Contacts(law or sh.laws.Coulomb(), [(0,)], **given | values)


def blade(contacts=None, damping=0.5):
    contacts = {"rubs": friction()} if contacts is None else contacts
    return sh.Model([[1.0]], [[damping]], [[1e4]], contacts=contacts)


def sustained_problem(kind, harmonics):
    if kind == "shroud":
        return sh.HarmonicBalance(pressed_mass(), sh.forces.StaticLoad([1.0, 2.0]), harmonics)
    law = PressedBlade() if kind == "pressed" else None
    return sh.HarmonicBalance(blade({"rubs": friction(law)}), harmonics=harmonics)


def in_own_units(evaluation, n, unit=1.0):
    """The residual of the balance [N], and of the conditions [m] in the ``unit`` they have."""
    weight = evaluation.magnitude / unit
    return evaluation.residual / np.where(np.arange(len(evaluation.residual)) < n, 1.0, weight)


@pytest.mark.parametrize("kind", ["friction", "pressed", "shroud"])
@pytest.mark.parametrize("harmonics", [(0, 1), (0, 1, 2, 3)])
def test_derivatives_of_a_mode_are_exact(kind, harmonics):
    problem = unforced(sustained_problem(kind, harmonics))
    mode, n = NonlinearModeProblem(problem, 0), problem.n_unknowns
    random = np.random.default_rng(1)
    unknowns = np.concatenate([2e-4 * random.normal(size=n), [118.0, 0.09]])
    value = -3.4
    evaluation = mode.evaluate(unknowns, value)
    states = evaluation.states.switches
    scale = mode.scale(np.append(unknowns, value))
    columns = np.column_stack([evaluation.jacobian, evaluation.by_parameter])
    rates, quotients = [], []
    for i in range(n + 3):
        step = 1e-6 * scale[i] * np.eye(n + 3)[i]
        ends = [np.append(unknowns, value) + sign * step for sign in (1, -1)]
        found = [mode.evaluate(end[:-1], end[-1], states) for end in ends]
        pair = [in_own_units(f, n, 10 ** end[-1]) for f, end in zip(found, ends, strict=True)]
        quotients.append((pair[0] - pair[1]) / 2e-6)
        margins = np.nan_to_num([f.states.margins for f in found])
        rates.append((margins[0] - margins[1]) / 2e-6)
    exact = columns * scale
    exact[n:] *= 10**value / evaluation.magnitude
    size = np.abs(exact).max(axis=1, keepdims=True)
    np.testing.assert_allclose(exact / size, np.array(quotients).T / size, atol=2e-8)
    along = [mode.margin_rate(evaluation, scale[i] * np.eye(n + 3)[i]) for i in range(n + 3)]
    known = np.isfinite(evaluation.states.margins)
    np.testing.assert_allclose(np.array(along)[:, known], np.array(rates)[:, known], atol=1e-7)
    for switch in np.flatnonzero(known):
        row = mode.margin_gradient(evaluation, switch) * scale
        np.testing.assert_allclose(row, np.array(along)[:, switch], atol=1e-14)


def mode_path(harmonics):
    """Path of the mode of one blade over amplitudes of 1e-6 to 1e-2 m."""
    problem = unforced(sh.HarmonicBalance(blade(), harmonics=harmonics))
    n = problem.n_unknowns
    start = np.zeros(n + 2)
    start[problem.basis.component(1)] = 1e-6
    start[n:] = np.sqrt(2e4), 0.25 / np.sqrt(2e4)
    path = Path(NonlinearModeProblem(problem, 0), start, -6.0, -2.0)
    points = list(path)
    assert path.status == Status.REACHED_END
    return points, n


def test_path_of_a_mode_follows_the_closed_form():
    points, n = mode_path((1,))
    assert len(points) < 50
    for point in points:
        frequency, ratio = OneBlade(1, 0.5, 1e4, 1e4, slip_limit=1.5).mode(10**point.value)
        np.testing.assert_allclose(point.state[n : n + 2], [frequency, ratio], rtol=1e-11)
    (onset,) = [point for point in points if point.events]
    assert onset.events[0].kind == "onset of slip"
    assert 10**onset.value == pytest.approx(1.5e-4, rel=1e-12)


def cycle_problem(damping, harmonics, amplitude, frequency):
    """A blade that negative damping drives and friction holds, and a motion near a cycle."""
    air = sh.laws.SmoothLaw(lambda y, v, p: p["c"] * v, {"c": (damping, "N s/m")}, [(0,)])
    model = blade({"rubs": friction(), "air": air}, damping=0.0)
    problem = unforced(sh.HarmonicBalance(model, harmonics=harmonics))
    start = np.zeros(problem.n_unknowns + 1)
    start[problem.basis.component(1)], start[-1] = amplitude, frequency
    phase = first_harmonic(problem, 0)[1]
    return LimitCycleProblem(problem, "c", phase), start


@pytest.mark.parametrize("ratio", [0.0, 1e-12, -1e-12])
def test_a_cycle_at_a_point_is_that_between_its_neighbours(ratio):
    """Where the damping ratio of a point of the mode is 0, or round-off of either sign."""
    problem = cycle_problem(-0.5, (1,), 1e-4, 141.0)[0].problem
    mode, linear = NonlinearModeProblem(problem, 0), linear_mode(problem, 0, None, (0,))
    branch = follow_mode(mode, linear, (-5.0, -3.0), 1000)
    (cycle,) = cycles_of_mode(branch)
    assert mode.amplitude(cycle) == pytest.approx(1.508422732e-4, rel=1e-9)
    ratios = np.array([mode.damping_ratio(point.state) for point in branch.points])
    (after,) = np.flatnonzero(np.diff(np.sign(ratios))) + 1
    state = np.concatenate([cycle, [ratio, np.log10(mode.amplitude(cycle))]])
    points = branch.points.copy()
    points.insert(after, points[after]._replace(state=state))
    (same,) = cycles_of_mode(replace(branch, points=points))
    np.testing.assert_array_equal(same, cycle)


@pytest.mark.parametrize(
    ("damping", "harmonics", "low", "high"),
    [
        (-0.5, (1,), (1.508422732e-4, 141.3963523), (3.803857572e-2, 100.0209923)),
        (-0.5, ODD, (1.508534886e-4, 141.3961668), (3.804208183e-2, 100.0207243)),
        (-2.0, (1,), (1.534837042e-4, None), (9.380589451e-3, None)),
        (-2.0, ODD, (1.535626339e-4, None), (9.386874915e-3, None)),
    ],
)
def test_path_of_limit_cycles_goes_through_their_fold(damping, harmonics, low, high):
    curve, start = cycle_problem(damping, harmonics, low[0], low[1] or 141.2)
    first = newton(lambda unknowns: curve.evaluate(unknowns, damping), start)
    assert first.converged
    n = curve.problem.n_unknowns
    path = Path(curve, first.unknowns, damping, -60.0)
    points = list(path)
    # Beyond the fold there is none: the path comes back along the upper, unstable one.
    assert path.status == Status.TURNED_BACK
    for state, (amplitude, frequency) in ((points[0].state, low), (points[-1].state, high)):
        assert np.hypot(*state[:2]) == pytest.approx(amplitude, rel=1e-9)
        if frequency is not None:
            assert state[n] == pytest.approx(frequency, rel=1e-9)
    (fold,) = [point for point in points if point.events]
    if harmonics == (1,):
        largest = minimize_scalar(lambda a: -closed_damping(a), (2e-4, 3e-4, 5e-4), tol=1e-12)
        assert fold.value == pytest.approx(largest.fun, rel=1e-12)
        assert np.hypot(*fold.state[:2]) == pytest.approx(largest.x, rel=1e-5)


def closed_damping(amplitude):
    """Negative damping that friction balances under one harmonic [N s/m]."""
    frequency, ratio = OneBlade(1, 0.0, 1e4, 1e4, slip_limit=1.5).mode(amplitude)
    return 2 * ratio * frequency


def test_derivative_of_a_limit_cycle_by_its_parameter():
    curve, start = cycle_problem(-0.5, (1, 3), 3e-4, 120.0)
    evaluation = curve.evaluate(start, -0.5)
    high, low = (in_own_units(curve.evaluate(start, -0.5 + step), 4) for step in (1e-4, -1e-4))
    np.testing.assert_allclose(evaluation.by_parameter, (high - low) / 2e-4, rtol=1e-8, atol=1e-12)


def test_force_that_sustains_is_that_of_the_mass_times_the_velocity():
    matrices = np.array([[2.0, 0.3], [0.3, 1.0]]), np.diag([1.0, 2.0]), np.diag([1e4, 2e4])
    problem = unforced(sh.HarmonicBalance(sh.Model(*matrices), harmonics=(0, 1, 2)))
    sustained, random = SustainedMotion(problem), np.random.default_rng(0)
    motion = random.normal(size=(2, 5))
    velocity = motion @ problem.basis.derivative_matrix.T * 7.0
    expected = 2 * 0.1 * 7.0 * matrices[0] @ velocity
    np.testing.assert_allclose(
        sustained.force(motion.ravel(), 7.0, 0.1), expected.ravel(), rtol=1e-14
    )
    phasors = motion[:, 1::2] - 1j * motion[:, 2::2]
    square = np.einsum("ih,ij,jh->", phasors.conj(), matrices[0], phasors).real
    assert sustained.modal_amplitude(motion.ravel()) == pytest.approx(np.sqrt(square), rel=1e-14)


def test_structures_without_a_mass_matrix_are_refused():
    class Spring(Structure):
        def dynamic_stiffness(self, harmonic, frequency):
            return np.array([[1e4 + 0j]]), np.array([[0j]])

    problem = sh.HarmonicBalance(Spring(1), harmonics=(1,))
    with pytest.raises(TypeError, match="craig_bampton"):
        NonlinearModeProblem(problem, 0)


def test_structure_that_turns_with_the_frequency_is_refused():
    rotor = sh.RotatingModel(blade(), stiffness={0: [[1e4]], 300: [[1.5e4]]})
    problem = sh.HarmonicBalance(rotor, sh.forces.EngineOrder(3))
    with pytest.raises(ValueError, match=r"at\(speed\)"):
        NonlinearModeProblem(problem, 0)


@pytest.mark.parametrize("frequency", [20.0, 150.0])
def test_modes_about_rest_have_gyroscopic_forces_once(frequency):
    """Whatever the frequency is that they are linearised at: those of the quadratic problem."""
    stiffness, skew = np.diag([1e4, 2.25e4]), np.array([[0, 60.0], [-60.0, 0]])
    model = sh.Model(np.eye(2), np.eye(2) + skew, stiffness)
    problem = sh.HarmonicBalance(model, harmonics=(1,))
    natural, _ = _modes_about(problem, np.zeros(problem.n_unknowns), frequency, 2)
    whole = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness, -skew]])
    expected = np.unique(np.abs(np.linalg.eigvals(whole).imag).round(9))
    np.testing.assert_allclose(natural, expected, rtol=1e-9)
