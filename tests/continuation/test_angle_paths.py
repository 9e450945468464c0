"""Branches with the switching angles as unknowns: the same as with located angles."""

import json
import warnings
from functools import cache

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade, fig08_engine_orders
from symhbm.continuation.angles.corrector import AngleCorrector
from symhbm.continuation.angles.system import angle_system
from symhbm.continuation.correctors.corrector import Hyperplane, unit_parameter
from symhbm.continuation.correctors.stepwise import StepwiseCorrector
from symhbm.continuation.newton import ACCEPTED
from symhbm.continuation.problem import FrequencyProblem, ParameterProblem
from symhbm.continuation.start import solve_point
from symhbm.continuation.status import Status
from tests.balance.test_switching_angles import false_start
from tests.problems import rub
from tests.quick import quick_first
from tests.refusals import refused

SOLVERS = ("newton", "rootfinder", "ipopt")
TURN = 2 * np.pi
INNER = ["dof", "harmonic", "component"]
AGREEMENT = 1e-9
"""Largest difference from located friction, relative to the response."""


@cache
def blade(harmonics):
    return fig03_single_blade.problem(harmonics)


@cache
def ring(harmonics):
    return fig08_engine_orders.problem(harmonics)


def compared(problem, band, solver, over=None, n=41, **options):
    """Both curves and the largest difference wherever the angles are solved for."""
    values = np.linspace(*sorted(band), n)

    def computed(**more):
        if options:
            return sh.follow(problem, band=band, over=over, progress=False, **options, **more)
        return sh.frf(problem, band, over=over, progress=False, **more)

    with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
        path, reference = computed(angles=solver), computed()
        grid, located = computed(angles=solver, at=values), computed(at=values)
    distance = np.sqrt(((grid.coefficient - located.coefficient) ** 2).sum(INNER, skipna=False))
    return path, reference, grid, distance / np.sqrt((located.coefficient**2).sum(INNER))


def assert_same(path, reference, moving="frequency"):
    """The same peaks and events, the whole band."""
    assert set(path.status.values.ravel()) == {str(Status.REACHED_END)}
    assert np.all(path.angles_share == 1)
    for name in (f"peak_{moving}", "peak_amplitude", f"event_{moving}"):
        assert path[name].shape == reference[name].shape
        np.testing.assert_allclose(path[name], reference[name], rtol=AGREEMENT)
    for name in ("peak_kind", "event_kind", "event_contact"):
        np.testing.assert_array_equal(path[name], reference[name])


@pytest.mark.parametrize(
    ("harmonics", "solver"), [((1,), "newton"), *(((1, 3, 5), solver) for solver in SOLVERS)]
)
def test_blade_of_figure_3(harmonics, solver):
    """Gross slip at the start of the band, onset and end of slip inside it, a stuck contact."""
    over = {"normal_load": [0.5, 18, 500]}
    path, reference, grid, distance = compared(blade(harmonics), (10, 30), solver, over)
    assert_same(path, reference)
    assert grid.converged.all()
    assert float(distance.max()) <= AGREEMENT
    assert path.residual_norm.max() <= ACCEPTED
    slips = path.contact_state == 1
    assert int(slips.sum()) > 20
    assert not np.isnan(path.theta_0.where(slips, 0)).any()
    assert not np.isnan(path.theta_star.where(slips, 0)).any()


@pytest.mark.parametrize("solver", quick_first(SOLVERS, 1))
def test_ring_where_every_false_point_converges(solver):
    path, reference, grid, distance = compared(ring((1, 3)), (60, 90), solver)
    assert_same(path, reference)
    assert int(path.n_sectors) == 13
    assert grid.converged.all()
    assert float(distance.max()) <= AGREEMENT


@pytest.mark.parametrize(
    ("name", "band", "solver"),
    [
        ("normal_load", (0.1, 100), "newton"),
        ("normal_load", (100, 0.1), "ipopt"),
        ("contact_stiffness", (1e5, 1e3), "rootfinder"),
    ],
)
def test_a_parameter_is_followed(name, band, solver):
    problem = blade((1, 3)).with_parameters(normal_load=3)
    options = dict(parameter=name, frequency=19.5)
    path, reference, grid, distance = compared(problem, band, solver, **options)
    assert_same(path, reference, name)
    assert path.sizes["event"] > 0
    assert grid.converged.all()
    assert float(distance.max()) <= AGREEMENT


def test_no_path_begins_with_located_friction(monkeypatch):
    """Neither a start nor a point comes from the solver of located friction."""

    def forbidden(*_):
        raise AssertionError("a located solution")

    # The check where the form applies gives no start.
    monkeypatch.setattr(AngleCorrector, "applies", lambda *_: None)
    for target in (
        "symhbm.continuation.following.solve_point",
        "symhbm.continuation.start.solve_point",
    ):
        monkeypatch.setattr(target, forbidden)
    for name in ("free", "correct", "tangent_along"):
        monkeypatch.setattr(StepwiseCorrector, name, forbidden)
    response = sh.frf(
        blade((1, 3)), (10, 30), over={"normal_load": [0.01, 3]}, angles="newton", progress=False
    )
    assert np.all(response.status == str(Status.REACHED_END))


@pytest.mark.slow
@pytest.mark.parametrize(("band", "n"), [((65, 67), 9), ((60, 80), 121)])
def test_a_band_in_which_a_contact_reverses_while_it_slips(band, n):
    problem = ring((1, 3)).with_parameters(normal_load=10)
    with pytest.warns(RuntimeWarning, match="reverses while it slips.*followed over"):
        path = sh.frf(problem, band, angles="newton", progress=False)
    assert str(path.status.values).startswith(str(Status.ANGLES_DO_NOT_APPLY))
    _, _, grid, distance = compared(problem, band, "newton", n=n)
    corrector = AngleCorrector(FrequencyProblem(problem), "newton")
    applies = [corrector.applies(TURN * float(f)) for f in grid.frequency]
    np.testing.assert_array_equal(grid.converged, applies)
    assert float(path.angles_share) == pytest.approx(np.mean(applies), abs=2 / (n - 1))
    assert 0 < float(path.angles_share) < 1
    assert float(distance.where(grid.converged).max()) <= AGREEMENT
    assert np.isnan(grid.amplitude.where(~grid.converged, drop=True)).all()
    # The gap has no points; beyond it the branch continues to the end of the band.
    gap = grid.frequency.values[~grid.converged.values]
    assert not np.any((path.frequency >= gap[0]) & (path.frequency <= gap[-1]))
    assert path.frequency[0] == band[0]
    assert path.frequency[-1] == band[1]
    whole = sh.frf(problem, band, progress=False)
    np.testing.assert_allclose(path.peak_amplitude, whole.peak_amplitude, rtol=AGREEMENT)


def test_false_solutions_are_no_points():
    """Solved as far as the equations tell, and refused by how the contact moves."""
    problem, omega = ring((1, 3)).with_parameters(normal_load=10), TURN * 69
    curve = FrequencyProblem(problem)
    corrector, system = AngleCorrector(curve, "newton"), angle_system(problem, "frequency")
    start = false_start(problem)
    x, theta_0, rho = system.angles.split(start)
    slip = np.ones(problem.n_contacts, dtype=bool)
    guess = np.append(x, omega)
    scale = curve.scale(guess)
    plane = Hyperplane(guess, scale, unit_parameter(len(guess)))
    bordered = system.bordered(curve, guess, plane, slip)
    first = np.concatenate([x, theta_0, rho, [omega]]) / bordered.column
    false_point, _ = system.solve("newton", bordered._replace(start=first), 1e-6)
    assert np.abs(system.evaluate(false_point, bordered.values)[0]).max() <= 1e-9
    state = false_point * bordered.column
    located = solve_point(problem, omega).unknowns
    assert np.linalg.norm(state[: len(x)] - located) > 0.1 * np.linalg.norm(located)
    point = np.append(state[: len(x)], state[-1])
    evaluation = curve.evaluate(point[:-1], point[-1], slip)
    angles = system.angles.split(state[:-1])[1:]
    assert not corrector._is_valid(point, *angles, slip, evaluation)


@pytest.mark.parametrize("moving", ["frequency", "normal_load", "contact_stiffness", "mass"])
def test_jacobian_is_exact(moving):
    problem = ring((1, 3)).with_parameters(normal_load=10)
    omega = TURN * 75
    curve = FrequencyProblem(problem)
    value = omega
    if moving != "frequency":
        curve = ParameterProblem(problem, moving, omega)
        value = float(np.ravel(problem.parameters[moving])[0])
    unknowns = solve_point(problem, omega).unknowns
    guess = np.append(1.01 * unknowns, value)
    scale = curve.scale(guess)
    plane = Hyperplane(guess, scale, np.linspace(-1, 1, len(guess)))
    system = angle_system(problem, moving)
    bordered = system.bordered(curve, guess, plane, np.ones(problem.n_contacts, dtype=bool))
    _, jacobian = system.evaluate(bordered.start, bordered.values)
    for k, unit in enumerate(np.eye(len(bordered.start))):
        ahead, back = (
            system.evaluate(bordered.start + h * unit, bordered.values)[0] for h in (1e-6, -1e-6)
        )
        difference = (ahead - back) / 2e-6
        # Central differences: 1e-16 over 2e-6 of what each row is scaled by.
        np.testing.assert_allclose(jacobian[:, k], difference, rtol=1e-6, atol=1e-7)


@pytest.mark.slow
def test_the_dataset_names_the_solver(tmp_path):
    problem = blade((1, 3))
    over = {"normal_load": [3]}
    response = sh.frf(
        problem, (10, 30), over=over, angles="newton", archive=tmp_path / "a.nc", progress=False
    )
    assert json.loads(response.attrs["followed"])["angles"] == "newton"
    assert response.angles_share.attrs["units"] == "1"
    verified = sh.verify(response, exact="none", progress=False)
    report = json.loads(verified.attrs["verification"])
    assert report["passed"]
    assert 0 <= float(verified.angles_difference.max()) <= AGREEMENT
    # An error of 1e-6 in one coefficient is reported.
    wrong = response.load().copy(deep=True)
    wrong.coefficient[0, 5, 0, 0, 0] *= 1 + 1e-6
    figures = json.loads(sh.verify(wrong, exact="none", progress=False).attrs["verification"])
    assert figures["figures"]["angles_difference"]["broken"]
    located = sh.frf(problem, (10, 30), over=over, progress=False)
    assert "angles_share" not in located
    assert "angles_difference" not in sh.verify(located, exact="none", progress=False)


def condensed():
    chain = 1e4 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    model = sh.Model(np.eye(3), 1e-4 * chain, chain, contacts=[(0,)], **rub(1e4, 0.5, 1))
    force = sh.forces.PointForce(place=0)
    return sh.HarmonicBalance(sh.condense(model, force, (5, 20)), force)


def by_angles(problem, band=(10, 30), angles="newton", **options):
    return sh.frf(problem, band, angles=angles, **options)


def followed(**options):
    return sh.follow(blade((1, 3)), "normal_load", (1, 3), frequency=19.5, **options)


EVEN, SINGLE = fig03_single_blade.problem((1, 2, 3)), blade((1, 3))
SAMPLED = sh.HarmonicBalance(SINGLE.model, SINGLE.excitation, (1, 3), 64)
BAD = [
    (dict(angles="broyden"), "angles='broyden': expected one of newton, rootfinder, ipopt"),
    (dict(angles=3), "angles=3: expected one of newton, rootfinder, ipopt"),
    (dict(angles="newton", accuracy=1e-3), "angles='newton': expected None with accuracy"),
]
test_what_has_no_angles_is_refused = refused([
    *((lambda given=given: by_angles(SINGLE, **given), ValueError, words) for given, words in BAD),
    *((lambda given=given: followed(**given), ValueError, words) for given, words in BAD),
    (lambda: by_angles(EVEN), ValueError, r"odd harmonics only: \[2\]"),
    (lambda: by_angles(SAMPLED), ValueError, "a sampled law has no angles"),
    (lambda: by_angles(SINGLE.with_parameters(cubic_stiffness=1e6)),
     ValueError, "expected None with cubic springs"),
    (lambda: by_angles(SINGLE, over={"cubic_stiffness": [0, 1e6]}),
     ValueError, "expected None with cubic springs"),
    (lambda: by_angles(condensed(), (6, 10)),
     ValueError, "expected None for a condensed structure"),
])  # fmt: skip
