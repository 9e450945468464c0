"""The compiled corrector: the same solutions as step by step, in few linear solves."""

from functools import partial
from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from studies import fig03_single_blade as fig03
from symhbm.continuation.between import slopes as slopes_of_path
from symhbm.continuation.between.segments import Segments
from symhbm.continuation.between.slopes import estimate_slopes
from symhbm.continuation.correctors import StepwiseCorrector, compiled, corrector_of, programs
from symhbm.continuation.correctors.corrector import AtLimit, Hyperplane, unit_parameter
from symhbm.continuation.events.modes import modes
from symhbm.continuation.following import follow_branch
from symhbm.continuation.problem import FrequencyProblem
from symhbm.continuation.segment import measure
from symhbm.numerics import c_library
from symhbm.numerics.compiled import Compiled
from symhbm.peaks.survey import sector_of
from tests.designs import blade, mistuned, ring
from tests.pressed_contact import pressed_mass
from tests.problems import rub
from tests.quick import quick_first

TURN = 2 * np.pi
different = partial(mistuned, seed=1, normal_load=0.3)


def condensed(harmonics=(1,)):
    """A chain on springs, a force inside and dampers here and there, kept at its contacts."""
    size = 40
    chain = sp.diags_array(
        [np.full(size, 2.1), np.full(size, -1.0), np.full(size, -1.0)], offsets=[0, 1, -1]
    )
    damping = sp.diags_array(np.where(np.arange(size) % 7 == 3, 0.3, 0.02))
    model = sh.Model(
        sp.eye_array(size),
        damping,
        1e3 * chain,
        contacts=[(5,), (12, 13), (30,)],
        **rub(2e3, 0.5, [1.0, 0.5, 2.0]),
    )
    cosine = {1: np.where(np.arange(size) == 20, 30.0, 0.0)}
    if 0 in harmonics:
        cosine[0] = np.where(np.arange(size) == 5, 3.0, 0.0)
    force = sh.forces.HarmonicForce(cosine=cosine)
    small = sh.condense(model, force, (4.0, 8.0), harmonics, places=(20,))
    return sh.HarmonicBalance(small, force, harmonics)


def rubbing():
    """Friction with the mean, odd and even harmonics."""
    base = blade(normal_load=200)
    force = sh.forces.PointForce(amplitude=100.0) + sh.forces.StaticLoad((20.0,))
    return sh.HarmonicBalance(base.model, force, (0, 1, 2, 3))


def several_harmonics():
    stiffness = np.array([1.0, 1.1, 0.9, 1.05]) * 1e4
    return ring(4, 1e5, 1, (1, 3), stiffness=stiffness, normal_load=3.0)


def many_sectors():
    """Matrices that are factorised as sparse ones."""
    stiffness = 1e4 * (1 + 0.02 * np.random.default_rng(3).standard_normal(52))
    return ring(52, 1e5, 3, (1, 3), stiffness=stiffness, normal_load=3.0)


def stiffening():
    """Closed forms of contacts, and several responses at one frequency."""
    return blade(force=20.0, cubic_stiffness=1e6, contact_stiffness=1e3)


def opening():
    """Contacts that open, and two displacements of one contact."""
    model = pressed_mass(centrifugal_load=1e-3, engine_order=2)
    force = sh.forces.HarmonicForce(cosine={1: [1.0, 1.0]}, amplitude=15.0)
    return sh.HarmonicBalance(model, force, (0, 1, 2, 3))


PROBLEMS = {
    "blade": (fig03.problem, (10, 30)),
    "ring": (ring, (150, 280)),
    "sector": (lambda: sector_of(ring()), (150, 280)),
    "mistuned": (different, (150, 280)),
    "condensed": (condensed, (4, 8)),
    "condensed with a mean": (lambda: condensed((0, 1)), (4, 8)),
    "rubbing": (rubbing, (12, 30)),
    "several harmonics": (several_harmonics, (14, 60)),
    "many sectors": (many_sectors, (14, 18)),
    "stiffening": (stiffening, (6, 40)),
    "opening": (opening, (15, 45)),
}
LOCATED = "rubbing", "several harmonics", "many sectors", "stiffening", "opening"
"""Whose events are located before the equations are evaluated."""


def branch_of(name):
    build, band = PROBLEMS[name]
    return follow_branch(FrequencyProblem(build()), (TURN * band[0], TURN * band[1]), 5000, False)


def alike(one, other, scale, rough=1e-9):
    """Whether both found the same solution, or none of them one."""
    assert (one is None) == (other is None)
    if one is None:
        return 0
    # Two iterations that differ by round-off end within the tolerance of the residual.
    assert np.abs((one.point - other.point) / scale).max() < 1e-9
    assert one.direction == pytest.approx(other.direction, abs=1e-7)
    np.testing.assert_allclose(one.margins, other.margins, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(one.rate, other.rate, rtol=1e-5, atol=1e-6)
    assert one.error == pytest.approx(other.error, rel=1e-6, abs=1e-10)
    assert one.amplification == pytest.approx(other.amplification, rel=rough)
    assert (one.sign, one.crosses) == (other.sign, other.crosses)
    assert one.resonances_below == other.resonances_below
    assert max(one.residual_norm, other.residual_norm) <= 1e-12
    return 1


@pytest.mark.parametrize("name", quick_first(PROBLEMS, 4))
def test_corrections_are_those_step_by_step(name):
    """From guesses off the path and onto limits; both end on the curve to its tolerance."""
    branch = branch_of(name)
    curve = branch.curve
    fast, slow = corrector_of(curve), StepwiseCorrector(curve)
    if name == "stiffening":
        fast = compiled.LocatedCorrector(curve)
    kind = compiled.LocatedCorrector if name in LOCATED else compiled.CompiledCorrector
    assert isinstance(fast, kind)
    # The force of one blade of a sector, or the largest of all as they turn.
    rough = 0.3 if name == "sector" else 1e-8
    rng, compared, limits = np.random.default_rng(0), 0, 0
    aside = 1e-5 if name == "many sectors" else 1e-3  # farther, so many contacts slip otherwise
    for point in branch.points:
        scale = point.scale
        guess = point.state + scale * aside * rng.normal(size=len(scale))
        constraints = [
            Hyperplane(guess, scale, point.after / scale),
            Hyperplane(guess, scale, unit_parameter(len(scale))),
        ]
        near = int(np.argmin(np.abs(point.margins)))
        if abs(point.margins[near]) < 0.1:
            constraints.append(AtLimit(curve, near, scale))
        for constraint in constraints:
            both = [c.correct(guess, constraint, point.switches) for c in (fast, slow)]
            compared += alike(*both, scale, rough)
        given = point.state, scale, point.after / scale, point.switches
        alike(*(c.tangent(*given) for c in (fast, slow)), scale, rough)
    for left, right in pairwise(branch.points):
        for contact in np.flatnonzero(left.switches != right.switches).tolist():
            guess = right.state + aside * right.scale * rng.normal(size=len(right.scale))
            limit = AtLimit(curve, contact, right.scale)
            given = guess, limit, left.switches, 1e-8
            limits += alike(*(c.correct(*given) for c in (fast, slow)), right.scale, rough)
    assert compared > len(branch.points)
    assert limits > 0
    assert fast.solves == pytest.approx(slow.solves, rel=0.02)


def test_outside_the_band_of_a_condensation_there_is_no_solution():
    problem = condensed()
    curve, size = FrequencyProblem(problem), problem.n_unknowns + 1
    guess = np.append(np.zeros(size - 1), 9.0 * TURN)
    scale = curve.scale(guess)
    plane = Hyperplane(guess, scale, unit_parameter(size))
    slip = np.zeros(problem.n_contacts, dtype=bool)
    assert corrector_of(curve).correct(guess, plane, slip) is None


@pytest.mark.parametrize("in_order", [True, False])
def test_large_rings_are_compiled_in_an_order_that_stays_sparse(in_order):
    """In any other order they are solved step by step."""
    n = 260
    numbers = np.arange(n) if in_order else np.random.default_rng(2).permutation(n)
    pairs = list(zip(numbers, np.roll(numbers, -1), strict=True))
    contact = sh.Friction(tangential=pairs, **rub(1e6, 0.5, 10.0))
    parts = (factor * sp.eye_array(n) for factor in (1.0, 0.5, 1e4))
    model = sh.Model(*parts, contacts={"friction": contact})
    curve = FrequencyProblem(sh.HarmonicBalance(model, sh.forces.PointForce(), (1,)))
    assert isinstance(corrector_of(curve), StepwiseCorrector) != in_order


def test_what_cannot_be_solved_is_none():
    """A singular system, a guess that is not finite, and one too far away."""
    curve = FrequencyProblem(ring())
    corrector = corrector_of(curve)
    size = curve.problem.n_unknowns + 1
    guess, slip = np.append(np.zeros(size - 1), 1000.0), np.zeros(13, dtype=bool)
    scale = curve.scale(guess)
    flat = Hyperplane(guess, scale, np.zeros(size))
    assert corrector.correct(guess, flat, slip) is None
    assert corrector.tangent(guess, scale, np.full(size, np.nan), slip) is not None  # by frequency
    lost = np.full(size, np.nan)
    plane = Hyperplane(guess, scale, unit_parameter(size))
    assert corrector.correct(lost, plane, slip) is None
    assert corrector.correct(guess, plane, slip, radius=1e-9) is None


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty folder of compiled functions, and no structure prepared so far."""
    monkeypatch.setenv(c_library.CACHE, str(tmp_path / "cache"))
    monkeypatch.setattr(programs, "_OFTEN", 3)
    monkeypatch.setattr(programs, "_OFTEN_LOCATED", 3)
    programs._programs.cache_clear()
    yield tmp_path / "cache"
    programs._programs.cache_clear()


needs_compiler = pytest.mark.skipif(c_library.compiler() is None, reason="no compiler of C")


def curves(problem, n):
    loads = np.geomspace(2, 30, n)
    return sh.frf(problem, (10, 30), over={"normal_load": loads}, progress=False)


def test_machine_code_is_looked_for_once_and_made_once(cache, monkeypatch):
    """Whether there is any or not: a look at many small calls would take longer than they do."""
    problem, asked = fig03.problem(), []
    monkeypatch.setattr(programs, "to_machine_code", lambda of, make, announce: asked.append(make))
    for _ in range(5):
        curves(problem, 1)
    assert asked == [False, True]


@needs_compiler
@pytest.mark.parametrize("harmonics", [(1, 3), pytest.param((1,), marks=pytest.mark.slow)])
def test_many_curves_are_machine_code_to_the_same_bits(cache, monkeypatch, harmonics):
    """Decided in front of a call, told in its result, kept for other processes."""
    problem, name = fig03.problem(harmonics), "equations_evaluated_by"
    few, many = curves(problem, 2), curves(problem, 3)
    assert (few.attrs[name], many.attrs[name]) == ("the virtual machine of CasADi", "machine code")
    assert len([*cache.glob("*.so")]) == 1
    programs._programs.cache_clear()  # as another process
    again = curves(problem, 2)
    assert again.attrs[name] == "machine code"
    assert again.drop_attrs().equals(few.drop_attrs())
    monkeypatch.setenv(c_library.COMPILER, "")
    programs._programs.cache_clear()
    without = curves(problem, 3)
    assert without.attrs[name] == "the virtual machine of CasADi"
    assert without.drop_attrs().equals(many.drop_attrs())


def test_a_singular_system_is_no_solution():
    """Neither by LAPACK nor by the factorisation that CasADi generates."""
    matrix, right = ca.MX.sym("matrix", 3, 3), ca.MX.sym("right", 3)
    for solver in ("lapacklu", "qr"):
        solve = Compiled(ca.Function("solve", [matrix, right], [ca.solve(matrix, right, solver)]))
        with pytest.raises(RuntimeError):
            solve(np.ones(9), np.ones(3))


@pytest.mark.parametrize(
    ("name", "points", "solves"), [("blade", 46, 180), ("ring", 28, 105), ("mistuned", 110, 700)]
)
def test_work_of_a_curve(name, points, solves):
    """Bounds a quarter above what is needed; solves for events and peaks included."""
    branch = branch_of(name)
    assert len(branch.points) <= points
    assert branch.corrector.solves <= solves


def test_slopes_of_many_segments_are_those_of_each():
    branch = branch_of("mistuned")
    problem, points = branch.curve.problem, branch.points
    segments = Segments.of(points)
    roots = np.random.default_rng(0).random((len(points) - 1, 2)) < 0.3
    segments = segments._replace(switch_events=roots)

    def estimated(some):
        measured = measure(problem.single_valued, some.left, some.right, some.scale)
        return estimate_slopes(problem, some, measured, per_dof=True)

    together = estimated(segments)
    assert np.isfinite(together.error).all()
    for k in range(len(points) - 1):
        alone = estimated(segments.take([k]))
        for single, many in zip(alone[:4], together[:4], strict=True):
            np.testing.assert_array_equal(single[0], many[k])


@pytest.mark.slow
def test_motions_that_cannot_lead_need_not_be_examined(monkeypatch):
    branch = branch_of("many sectors")
    assert not branch.curve.problem.equations.assemble.as_full
    problem, segments = branch.curve.problem, Segments.of(branch.points)
    measured = measure(problem.single_valued, segments.left, segments.right, segments.scale)
    some = estimate_slopes(problem, segments, measured)
    monkeypatch.setattr(slopes_of_path, "_MANY", np.inf)
    every = estimate_slopes(problem, segments, measured)
    assert every.of_states.all()
    assert not some.of_states.all()
    for name in ("turns", "is_doubtful", "error"):
        np.testing.assert_array_equal(getattr(some, name), getattr(every, name))
    assert every.turns.any()
    examined = some.of_states != 0
    np.testing.assert_allclose(some.of_states[examined], every.of_states[examined], rtol=1e-9)


def test_a_force_that_is_no_number_is_told():
    problem = rubbing()
    curve = FrequencyProblem(problem)
    corrector = corrector_of(curve)
    assert isinstance(corrector, compiled.LocatedCorrector)
    guess = np.full(problem.n_unknowns + 1, np.nan)
    scale = np.ones(len(guess))
    held = np.zeros(problem.n_contacts, dtype=bool)
    assert corrector.correct(guess, Hyperplane(guess, scale, scale), held) is None


@pytest.mark.parametrize("name", ["mistuned", "condensed", "condensed with a mean"])
def test_resonances_below_are_counted(name):
    """The count alone against the modes themselves, computed one by one."""
    branch = branch_of(name)
    for point in branch.points:
        friction = branch.curve.problem.locate(point.unknowns, point.value, point.switches)
        natural_modes = modes(branch.curve, point.unknowns, point.value, friction.switches)
        assert natural_modes is not None
        assert point.resonances_below == (np.count_nonzero(natural_modes.detuning < 0),)


def test_steps_of_the_located_system_are_those_of_the_equations():
    """Contact states free, at motions that are no solution."""
    problem = fig03.problem((1, 3)).with_parameters(normal_load=5)
    corrector, rng = corrector_of(FrequencyProblem(problem)), np.random.default_rng(3)
    for _ in range(5):
        unknowns = 1e-3 * rng.normal(size=problem.n_unknowns)
        norm, step = corrector.step(unknowns, 110.0)
        expected, other = StepwiseCorrector.step(corrector, unknowns, 110.0)
        np.testing.assert_allclose(norm, expected, rtol=1e-12)
        np.testing.assert_allclose(step, other, rtol=0, atol=1e-11 * np.abs(other).max())
    assert corrector.solves == 10
