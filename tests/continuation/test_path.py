"""The path: an iterator over points, events among them, and its status at the end."""

from contextlib import nullcontext

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig12_mistuned_disk as fig12
from symhbm.continuation import path as continuation
from symhbm.continuation.correctors import corrector_of
from symhbm.continuation.events import turns
from symhbm.continuation.path import Path
from symhbm.continuation.problem import FrequencyProblem, ParameterProblem
from symhbm.continuation.start import solve_point
from symhbm.continuation.status import Status
from tests.problems import duffing

TURN = 2 * np.pi


def path_from_start(curve, start, end, **options):
    return Path(curve, solve_point(*curve.at(start)).unknowns, start, end, **options)


def test_points_come_one_by_one():
    path = path_from_start(FrequencyProblem(fig03.problem()), 10 * TURN, 30 * TURN)
    assert path.status == Status.NOT_STARTED
    first = next(iter(path))
    assert first.value == 10 * TURN
    assert path.status == Status.NOT_STARTED
    points = list(path)
    assert path.status == Status.REACHED_END
    assert points[-1].value == 30 * TURN


def test_largest_number_of_points():
    path = path_from_start(FrequencyProblem(fig03.problem()), 10 * TURN, 30 * TURN, max_points=7)
    assert len(list(path)) == 7
    assert path.status == Status.MAXIMUM_POINTS
    assert "max_points" in path.status


def test_a_start_that_is_no_solution():
    path = Path(FrequencyProblem(fig03.problem()), np.array([1.0, 2.0]), 60.0, 180.0)
    assert list(path) == []
    assert path.status == Status.NO_START


@pytest.mark.parametrize(("band", "several"), [((0.5, 1.2), True), ((0.5, 2.0), False)])
def test_other_solutions_at_an_end_of_the_band_are_reported(band, several):
    warns = pytest.warns(RuntimeWarning, match="other solutions") if several else nullcontext()
    with warns:
        curve = sh.frf(duffing(), (band[0] / TURN, band[1] / TURN))
    assert ("other solutions" in str(curve.status.values)) == several
    assert ("wider band" in str(curve.status.values)) == several


def test_parameter_through_zero():
    """A spring that softens, is none, and stiffens: the closed form at every point."""
    curve = ParameterProblem(duffing(), "cubic_stiffness", 0.8, smallest=1e-3)
    path = path_from_start(curve, -0.05, 0.2)
    points = list(path)
    assert path.status == Status.REACHED_END
    for point in points:
        square = float(point.unknowns @ point.unknowns)
        force = np.sqrt(square * ((1 - 0.64 + 0.75 * point.value * square) ** 2 + 0.04**2))
        # Newton's tolerance times the condition of the balance.
        assert force == pytest.approx(0.18, rel=1e-10)


def test_values_out_of_range_are_failed_steps():
    """Towards a load of zero no iteration may end in an exception."""
    for start in (3.0, 0.3):
        curve = ParameterProblem(fig03.problem(), "normal_load", 19 * TURN, smallest=1e-3)
        path = path_from_start(curve, start, 0.0)
        assert list(path)[-1].value == 0
        assert path.status == Status.REACHED_END
    with pytest.raises(ArithmeticError, match="normal_load"):
        curve.evaluate(np.zeros(2), -1.0)


@pytest.mark.parametrize("overshoot", [1.05, 2.0])
def test_a_step_across_an_event_ends_on_it(overshoot, monkeypatch):
    """A step at fixed value that meets another contact state ends where the state changes."""
    monkeypatch.setattr(turns, "LARGEST_PREDICTION_ERROR", 10.0)
    curve = FrequencyProblem(fig03.problem((1, 3)).with_parameters(normal_load=18))
    points = list(path_from_start(curve, 10 * TURN, 30 * TURN))
    i = next(i for i, point in enumerate(points) if point.events)
    base, event = points[i - 1], points[i]
    length = overshoot * (event.value - base.value) / base.after[-1]
    crossing = turns._at_distance(corrector_of(curve), base, 30 * TURN, length, may_change=True)
    assert crossing is not None
    # Both are solved to the round-off of the limit.
    assert crossing.solution.point[-1] == pytest.approx(event.value, rel=1e-11)
    assert crossing.switches.tolist() == event.switches.tolist()
    same_states = turns._at_distance(corrector_of(curve), base, 30 * TURN, length, may_change=False)
    assert same_states is None
    ahead = turns.step_over_corner(corrector_of(curve), points[3], 30 * TURN, 0.2)
    assert ahead is not None
    assert ahead.solution.residual_norm <= 1e-11
    assert points[3].value < ahead.solution.point[-1] < 30 * TURN


def test_a_mass_matrix_that_is_singular():
    """One of two degrees of freedom moves without inertia: the path does without modes."""
    mass = np.ones((2, 2))
    stiffness = np.array([[3.0, -1.0], [-1.0, 2.0]])
    model = sh.Model(mass, 0.02 * np.eye(2), stiffness)
    curve = sh.frf(sh.HarmonicBalance(model, sh.forces.PointForce()), (0.05, 0.3), throw=True)
    for i, frequency in enumerate(curve.frequency.values):
        omega = TURN * frequency
        exact = np.linalg.solve(stiffness - omega**2 * mass + 0.02j * omega * np.eye(2), [1, 0])
        # Newton's tolerance times the condition of the balance.
        np.testing.assert_allclose(curve.amplitude[i], np.abs(exact), rtol=1e-9)


def test_events_are_those_of_short_steps(monkeypatch):
    """Also where a path turns back on itself within a step, and two limits are equally near."""
    problem = fig12.problem()
    draws = fig12.samples(problem).isel(sample=0)
    values = {str(name): draws[name].values for name in draws.data_vars}
    problem, band = problem.with_parameters(**values), (50, 255)
    curve = sh.frf(problem, band, throw=True, progress=False)
    monkeypatch.setattr(continuation, "PREDICTION_ERROR", 1e-3)
    expected = sh.frf(problem, band, throw=True, progress=False)
    assert expected.n_points > 1.3 * curve.n_points
    assert expected.n_events >= 6
    for name in ("event_contact", "event_kind"):
        assert curve[name].values.tolist() == expected[name].values.tolist()
    np.testing.assert_allclose(curve.event_frequency, expected.event_frequency, rtol=1e-11)


def test_a_path_that_bends_between_two_events_close_to_each_other():
    """One contact begins to slip, and another ends after 1/300 of the step before."""
    problem, widths = fig12.problem(), dict(mass=0.02, stiffness=0.05, damping=0.1)
    draws = sh.mistuning.uniform(problem, 2, seed=118, **widths)
    disk = problem.with_parameters(**{name: of.values[1] for name, of in draws.items()})
    up, down = (sh.frf(disk, band, throw=True) for band in [(148.8, 149), (149, 148.8)])
    np.testing.assert_allclose(
        up.event_frequency.values, down.event_frequency.values[::-1], rtol=1e-9
    )
    assert len(up.event_frequency) == 7
