"""Goals of solutions beside what datasets tell, and their derivatives beside differences."""

import casadi as ca
import numpy as np
import pytest

import symhbm as sh
from symhbm.balance import GoalOrder, SecondOrder, ValueOf
from symhbm.continuation import solve_point
from tests.designs import blade, ring

STEP = 1e-5
"""Of differences, relative."""


class Push(sh.goals.Goal):
    """A product of the frequency, a parameter, a displacement and forces of contacts."""

    units, meaning = "N2 m s-1", "all that a goal may depend on"

    def value(self, at):
        force = at.contacts["friction"][0].force
        load = at.parameters["normal_load"][0]
        return at.frequency * load * ca.sumsqr(force) * ca.sumsqr(at.coefficients[:, 0])


def pressed(preload="balanced"):
    """A mass whose friction has a load that moves, and opens."""
    contact = sh.Friction(
        tangential=(0,), normal=(1,), normal_stiffness=1e4,
        contact_stiffness=1e4, friction_coefficient=0.4, normal_load=1.0, preload=preload,
    )  # fmt: skip
    stiffness = np.array([[1e4, 3e3], [3e3, 2e4]])
    model = sh.Model(np.eye(2), np.diag([1.0, 1.0]), stiffness, contacts={"friction": contact})
    return sh.HarmonicBalance(model, sh.forces.PointForce(place=0, amplitude=8.0), (0, 1, 2))


PROBLEMS = {
    "one harmonic": lambda: (ring(3, 1e4, 1, normal_load=1.0), 24.0),
    "several": lambda: (blade((1, 3), normal_load=2.0), 19.0),
    "opens": lambda: (pressed(), 17.0),
}
GOALS = [sh.goals.Dissipation(), sh.goals.SlipDistance("friction", 0), Push()]
MEANS = [sh.goals.MeanNormalForce("friction", 0), sh.goals.MeanDisplacement(1)]
CASES = [(name, goal) for name in PROBLEMS for goal in GOALS if (name, goal) != ("opens", GOALS[1])]
CASES += [("opens", goal) for goal in MEANS]


@pytest.mark.parametrize(("name", "goal"), CASES)
def test_derivatives_are_those_of_differences(name, goal):
    problem, frequency = PROBLEMS[name]()
    unknowns, omega = solve_point(problem, 2 * np.pi * frequency).unknowns, 2 * np.pi * frequency
    load = np.array(problem.parameters["normal_load"])
    order = GoalOrder(goal, problem, SecondOrder(problem, ["normal_load"]))

    def at(point):
        motion, speed, loads = np.split(point, [len(unknowns), len(unknowns) + 1])
        here = problem.with_parameters(normal_load=loads)
        states = here.locate(motion, float(speed[0]))
        given = here, motion, float(speed[0]), states
        return ValueOf.at(goal, *given).value, order(*given)

    point = np.concatenate([unknowns, [omega], load])
    scale = np.concatenate([np.full(len(unknowns), np.abs(unknowns).max()), [omega], load])
    gradient, hessian = at(point)[1]
    rows = []
    for i in range(len(point)):
        step = np.zeros(len(point))
        step[i] = STEP * scale[i]
        (above, slope_above), (below, slope_below) = at(point + step), at(point - step)
        slope = (above - below) / (2 * STEP)
        assert slope == pytest.approx(
            gradient[i] * scale[i], rel=1e-6, abs=1e-7 * np.abs(gradient * scale).max()
        )
        rows.append((slope_above[0] - slope_below[0]) / (2 * STEP) * scale)
    expected = hessian * np.outer(scale, scale)
    assert np.abs(np.array(rows) - expected).max() <= 1e-6 * np.abs(expected).max()


def test_energy_and_path_are_those_of_datasets():
    problem, frequency = PROBLEMS["one harmonic"]()
    stored = sh.solve(problem, frequency).dissipation.values
    solution = solve_point(problem, 2 * np.pi * frequency)
    at = problem, solution.unknowns, 2 * np.pi * frequency, solution.evaluation.states

    def value(goal):
        return ValueOf.at(goal, *at).value

    assert value(sh.goals.Dissipation()) == pytest.approx(stored.sum(), rel=1e-12)
    assert value(sh.goals.Dissipation("friction", 1)) == pytest.approx(stored[1], rel=1e-12)
    assert value(sh.goals.SlipDistance()) == pytest.approx(stored.sum() / 0.5, rel=1e-12)
    [symmetry] = [problem.equal_sectors]
    sector = problem.of_sector(symmetry)
    one = solve_point(sector, 2 * np.pi * frequency)
    given = sector, one.unknowns, 2 * np.pi * frequency, one.evaluation.states
    assert ValueOf.at(GOALS[0], *given).value == pytest.approx(stored.sum(), rel=1e-12)


@pytest.mark.parametrize("preload", ["balanced", "coupled"])
def test_means_are_those_of_datasets(preload):
    problem = pressed(preload)
    omega = 2 * np.pi * 17.0
    solution, stored = solve_point(problem, omega), sh.solve(problem, 17.0)
    at = problem, solution.unknowns, omega, solution.evaluation.states
    force, motion = (ValueOf.at(goal, *at).value for goal in MEANS)
    assert 0 < stored.open_fraction.item() < 1
    assert force == pytest.approx(stored.mean_normal_force.item(), rel=1e-12)
    assert motion == pytest.approx(abs(stored.coefficient.values[1, 0, 0]), rel=1e-12)


BAD = {
    "no goal": (3, TypeError, "=3: expected"),
    "no group": (sh.goals.Dissipation("screw"), KeyError, "'screw' is no group of contacts"),
    "no contact": (sh.goals.Dissipation("friction", 1), ValueError, "contact=1: expected"),
    "of no group": (sh.goals.Dissipation(contact=0), ValueError, "expected the group"),
    "nothing presses": (MEANS[0], TypeError, "expected contacts with a normal direction"),
    "no mean": (
        sh.goals.MeanDisplacement(0),
        ValueError,
        r"expected harmonic 0 among those of the problem, \(1,\)",
    ),
    "no place": (sh.goals.MeanDisplacement("tip"), TypeError, "='tip': expected a number"),
    "no number": (sh.goals.MeanDisplacement(7), ValueError, "7"),
    "a spring": (sh.goals.SlipDistance("cubic"), TypeError, "expected friction under a constant"),
}


@pytest.mark.parametrize(("goal", "error", "words"), BAD.values(), ids=BAD)
def test_bad_goals_are_named(goal, error, words):
    with pytest.raises(error, match=f"peaks_of.*{words}"):
        blade().with_peaks_of(goal)
    given = dict(peaks={"a": {"goal": goal}}, objective=lambda peaks, _: peaks["a"])
    with pytest.raises(error, match=rf"peaks\['a'\]\['goal'\].*{words}"):
        sh.minimise_peak(blade(), "normal_load", (1, 9), **given)
