"""Contact laws of an expression: forces, derivatives, samples, archives and what is refused."""

import json
import pickle

import casadi as ca
import numpy as np
import pytest

import symhbm as sh
from symhbm.balance.second_order import SecondOrder
from symhbm.model.contacts import Motions, SmoothForce
from symhbm.numerics import FourierBasis
from symhbm.results.archive import ArchiveError
from tests.quick import quick_first
from tests.smooth_laws import LAWS, beyond, group_of, problem_of


def unknowns_like(problem, seed=0, size=1e-3):
    return size * np.random.default_rng(seed).normal(size=problem.n_unknowns)


def dense(matrix):
    return matrix.toarray() if hasattr(matrix, "toarray") else matrix


@pytest.mark.parametrize("seed", quick_first(range(3), 1))
@pytest.mark.parametrize("name", LAWS)
def test_derivatives_to_second_order(name, seed):
    """By coefficients, frequency and every parameter, with break points that move."""
    problem, names = problem_of(group_of(name)), [*LAWS[name][1]]
    second, n = SecondOrder(problem, names), problem.n_unknowns
    given = [problem.parameters[key][0] for key in names]
    point = np.concatenate([unknowns_like(problem, seed), [90.0], given])
    rng = np.random.default_rng(seed + 10)
    size = np.concatenate([np.full(n, 1e-3), [90.0], given])
    weights = rng.normal(size=n)

    def at(point):
        moved = problem.with_parameters(**dict(zip(names, point[n + 1 :], strict=True)))
        found = second(moved, point[:n], point[n], weights)
        return found.evaluation, dense(found.jacobian), dense(found.hessian)

    evaluation, jacobian, hessian = at(point)
    np.testing.assert_allclose(jacobian[:, :n], dense(evaluation.jacobian), rtol=1e-12, atol=1e-6)
    along, step = size * rng.normal(size=len(size)), 1e-5
    (ahead, slope_ahead, _), (behind, slope_behind, _) = (
        at(point + s * step * along) for s in (1, -1)
    )
    first = (ahead.residual - behind.residual) / (2 * step)
    expected = jacobian @ along
    np.testing.assert_allclose(first, expected, rtol=0, atol=1e-7 * np.abs(expected).max())
    bent = size * (weights @ (slope_ahead - slope_behind)) / (2 * step)
    expected = size * (hessian @ along)
    np.testing.assert_allclose(bent, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


MOTION = np.array([1.0, 0.0, 0.1, 0.05, 0.0, 0.02]) / 90
"""Harmonics 1, 3 and 5 of a displacement whose velocity is about 1 m/s at 90 rad/s."""


def summed(formula, count, harmonics=(1, 3, 5), motion=MOTION):
    """Coefficients of a force by a sum over equidistant angles."""
    basis, tau = FourierBasis(harmonics), 2 * np.pi * np.arange(count) / count
    functions = basis.values(tau)
    force = formula(functions @ motion, 90.0 * basis.values(tau, 1) @ motion)
    return 2 * np.pi / count * (functions * basis.norm).T @ force


def located_force(expression, parameters, breakpoints=()):
    """Coefficients of the force of a law, and how they were summed."""
    group = sh.laws.SmoothLaw(expression, parameters, [(0,)], breakpoints)
    law, basis = group.law, FourierBasis((1, 3, 5))
    values = {name: np.ravel(value) for name, value in group.values.items()}
    at = Motions(basis, MOTION[None], 90.0, values)
    located = law.locate(at)
    return law.forces(at, located)[0], located.details


@pytest.mark.parametrize(("small", "samples"), [(None, 64), (0.3, 512), (0.05, 2048), (0.01, 8192)])
def test_doubling_stops_where_it_should(small, samples):
    """One doubling after the sum is exact, which is what tells so: y^5 is exact at 32 samples."""
    if small is None:
        found, details = located_force(lambda y, v, p: p["k"] * y**5, {"k": (1e9, "N/m^5")})

        def formula(y, v):
            return 1e9 * y**5

        exact = summed(formula, 32)
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-14 * np.abs(exact).max())
    else:
        parameters = {"k": (1, "N"), "e": (small, "m/s")}
        found, details = located_force(lambda y, v, p: p["k"] * ca.tanh(v / p["e"]), parameters)

        def formula(y, v):
            return np.tanh(v / small)

    assert details.count[0] == samples
    true = summed(formula, 4 * samples)
    allowed = np.maximum(details.error[0], 1e-14 * np.abs(true).max())
    assert np.all(np.abs(found - true) <= allowed)
    # A quarter as many would not have done.
    assert np.abs(summed(formula, samples // 4) - true).max() > 1e-12 * np.abs(true).max()


def test_kinks_converge_slowly_and_say_so():
    """Without break points the stated error is true; with them there is none."""
    gap = 4e-3
    parameters = {"k": (1e3, "N/m"), "g": (gap, "m")}

    def expression(y, v, p):
        return p["k"] * ca.fmax(y - p["g"], 0)

    def formula(y, v):
        return 1e3 * np.maximum(y - gap, 0)

    slow, details = located_force(expression, parameters)
    fast, exact = located_force(expression, parameters, lambda y, v, p: y - p["g"])
    true = summed(formula, 2**20)
    size = np.abs(true).max()
    assert details.count[0] == 2**14
    assert details.error.max() > 1e-10 * size
    assert np.abs(slow - true).max() <= details.error.max()
    assert np.abs(fast - true).max() < 1e-10 * size
    assert exact.error.max() < 1e-12 * size
    assert exact.count[0] <= 64
    assert len(exact.breaks[0].angle) == 2


def test_break_points_of_a_near_touch_are_found():
    """A force that begins as a root of the distance, and a contact that does not touch."""
    highest = FourierBasis((1, 3, 5)).values(2 * np.pi * np.arange(2**16) / 2**16) @ MOTION
    for depth, touches in ((1e-3, 2), (1e-7, 2), (-1e-6, 0)):
        parameters = {"k": (1e3, "N/m"), "g": (highest.max() * (1 - depth), "m")}
        found, details = located_force(
            lambda y, v, p: p["k"] * ca.fmax(y - p["g"], 0) ** 1.5, parameters, beyond
        )
        assert len(details.breaks[0].angle) == touches
        assert found.any() == (touches > 0)
        assert details.error.max() <= (1e-12 + 1e-15 / abs(depth)) * np.abs(found).max()


@pytest.mark.slow
def test_units_meaning_and_bounds_of_parameters():
    """Units as datasets have them, and a record where more is to be said."""
    record = sh.laws.Parameter("N m-3", "how it bends", "$c$", bound="positive", designed=True)
    group = sh.laws.SmoothLaw(
        lambda y, v, p: p["k5"] * y**5 + p["c3"] * y**3 + p["d"] * v,
        {"k5": (1e13, "N/m^5", "fifth power"), "c3": (1e6, record), "d": (0.1, "N*s/m")},
        [(0, 1), (0,)],
    )
    problem = problem_of(group, (1, 3), amplitude=0.5)
    response = sh.frf(problem, (14, 15), over={"own.k5": [1e13, 2e13]}, progress=False)
    assert response.k5.attrs["units"] == "N m-5"
    assert response.k5.attrs["long_name"] == "fifth power"
    assert response.d.attrs["units"] == "N s m-1"
    assert problem.parameters["c3"].tolist() == [1e6, 1e6]
    with pytest.raises(ValueError, match="expected values finite and > 0"):
        problem.with_parameters(c3=-1.0)
    best = sh.minimise_peak(problem, "c3", frequency_band=(12, 20), bounds=(1e4, 1e7))
    start = float(sh.frf(problem, (12, 20), progress=False).amplitude.max())
    assert float(best.design_amplitude) <= start
    path = sh.follow(problem, "d", (0.01, 1.0), frequency=15.0, progress=False)
    assert str(path.status.values) == "the end of the band was reached"


def test_weights_of_numbers_and_places_are_those_of_one_direction():
    given = np.eye(2), np.eye(2), 1e4 * np.eye(2)
    places = dict(node=[7, 7], direction=[*"xy"])
    for weights in ({0: 1.0, 1: -1.0}, {0: 1.0, "7:y": -1.0}):
        law = sh.laws.SmoothLaw(LAWS["spring"][0], {"k5": (1e13, "N/m^5")}, weights)
        directions = sh.Model(*given, contacts={"own": law}, places=places).directions
        assert directions.toarray().tolist() == [[1.0, -1.0]]


def test_harmonics_that_a_force_needs():
    """A force that is not odd asks for harmonics 0 and even; an odd one does not."""
    for name in ("gap", "hertz", "magnet", "rubbing"):
        with pytest.raises(ValueError, match="expected 0 and even ones among them"):
            sh.frf(problem_of(group_of(name), (1, 3)), (10, 20), progress=False)
    for name in ("dashpot", "spring", "rounded", "drag"):
        assert group_of(name).law.odd
    law, values = group_of("dashpot").law, {"c": np.array([3.0, 0.0])}
    assert law.acts(values).tolist() == [True, False]
    assert not law.holds(values).any()
    assert group_of("gap").law.holds({"k": np.ones(1), "g": np.ones(1)}).all()


def test_laws_of_one_displacement_alone_give_back_what_they_take():
    found = {name for name in LAWS if group_of(name).law.gives_back}
    assert found == {"gap", "hertz", "magnet", "spring"}


def test_a_law_is_data():
    """It pickles, and equals one made again; its archive holds operations and no code."""
    law, again = group_of("hertz").law, group_of("hertz").law
    assert law == again
    assert pickle.loads(pickle.dumps(law)) == law
    assert law != group_of("gap").law
    assert {operation[0] for operation in json.loads(law.graph)["operations"]} <= {
        *("input", "constant", "sub", "fmax", "constpow", "pow", "mul")
    }


def tampered(*operations, **changes):
    graph = json.loads(group_of("gap").law.graph)
    graph["operations"] += operations
    return json.dumps(graph | changes)


DAMAGED = [
    "nonsense",
    "[]",
    '{"operations": 3, "results": [0]}',
    tampered(["__import__", 0]),
    tampered(["floor", 0]),
    tampered(["add", 0]),
    tampered(["add", 0, 10**9]),
    tampered(["neg", -1]),
    tampered(["neg", True]),
    tampered(["input", 4]),
    tampered(["constant", "nan"]),
    tampered(["constant", 3]),
    tampered(results=[]),
    tampered(results=[10**6, 0]),
    tampered(operations=[["input", 0]] * 100_001),
]


@pytest.fixture(scope="module")
def response():
    return sh.solve(problem_of(group_of("gap")), 15.0)


@pytest.mark.parametrize("text", DAMAGED)
def test_damaged_graphs_are_refused(text, response):
    law = group_of("gap").law
    with pytest.raises(ValueError, match="graph of a contact law: damaged, or of another version"):
        SmoothForce(text, law.parameters, law.directions, 1, False)
    description = json.loads(response.attrs["problem"])
    description["groups"]["own"]["law"]["fields"]["graph"] = text
    damaged = response.assign_attrs(problem=json.dumps(description))
    with pytest.raises(ArchiveError, match="the description of the problem is damaged"):
        sh.datasets.rebuild(damaged)


CALLS = []


def remembering(y, v, p):
    CALLS.append(y)
    return p["k"] * y * len(CALLS)


def remembering_numbers(y, v, p):
    if isinstance(y, ca.DM):
        CALLS.append(float(y))
        return p["k"] * y + sum(CALLS)
    return p["k"] * y


def drawn(y, v, p):
    return p["k"] * y * np.random.default_rng().random()


K = {"k": (1e3, "N/m"), "g": (1e-3, "m")}
STRANGE = ca.SX.sym("strange")


@pytest.mark.parametrize(
    ("expression", "parameters", "breakpoints", "error", "text"),
    [
        (remembering, K, (), ValueError, "without memory or chance"),
        (remembering_numbers, K, (), ValueError, "without memory or chance"),
        (drawn, K, (), ValueError, "without memory or chance"),
        (lambda y, v, p: y * STRANGE, K, (), ValueError, "holds strange, expected nothing but"),
        (lambda y, v, p: p["kk"] * y, K, (), ValueError, "expression: 'kk' is no parameter"),
        (lambda y, v, p: y if y > 0 else 0, K, (), ValueError, "failed with RuntimeError"),
        (lambda y: y, K, (), ValueError, "failed with TypeError"),
        (lambda y, v, p: 1.0, K, (), TypeError, "expected a CasADi expression .* got 1.0"),
        (lambda y, v, p: None, K, (), TypeError, "expected a CasADi expression .* got None"),
        (lambda y, v, p: ca.vertcat(y, v), K, (), ValueError, r"expected 1 value .* \(2, 1\)"),
        (lambda y, v, p: ca.sqrt(ca.fabs(y)), K, (), ValueError, "slope of the force at rest is"),
        (lambda y, v, p: ca.log(y), K, (), ValueError, "the force at rest is -inf"),
        (lambda y, v, p: v / ca.fabs(v), K, (), ValueError, "the force at rest is nan"),
        (lambda y, v, p: y / 0, K, (), ValueError, "holds the constant inf"),
        (lambda y, v, p: p["k"] * ca.sign(v), K, (), ValueError, "the force jumps at rest"),
        (lambda y, v, p: ca.floor(y), K, (), ValueError, "holds an operation that is none of"),
        ("y", K, (), TypeError, "expression='y': expected a function"),
        (lambda y, v, p: y, {}, (), TypeError, "expected"),
        (lambda y, v, p: y, {"k": 3}, (), TypeError, r"parameters\['k'\]=3: expected \(value"),
        (lambda y, v, p: y, {"k": (3, "N/m^^")}, (), ValueError, "expected units as"),
        (lambda y, v, p: y, {"k": ("a", "N")}, (), TypeError, "expected real numbers"),
        (lambda y, v, p: y, {"k": (np.nan, "N")}, (), ValueError, "expected values finite"),
        (lambda y, v, p: y, K, lambda y, v, p: 2.0, TypeError, r"breakpoints\[0\]: expected a"),
        (lambda y, v, p: y, K, [3], TypeError, r"breakpoints\[0\]=3: expected a function"),
        (lambda y, v, p: y, K, lambda y, v, p: p["q"], ValueError, r"breakpoints\[0\]: 'q' is no"),
    ],
)
def test_wrong_laws_are_refused_in_one_sentence(expression, parameters, breakpoints, error, text):
    CALLS.clear()
    with pytest.raises(error, match=text) as caught:
        sh.laws.SmoothLaw(expression, parameters, [(0,)], breakpoints)
    assert "\n" not in str(caught.value)


UNDEFINED = "the force of a contact law is no number, or jumps at a break point"


@pytest.mark.slow
def test_forces_that_are_undefined_at_some_motions():
    """What depends on the motion is a status, and the points before are valid."""
    root = problem_of(
        sh.laws.SmoothLaw(lambda y, v, p: p["k"] * y * ca.sqrt(1 - y / p["g"]), K, [(0,)])
    )
    jump = problem_of(
        sh.laws.SmoothLaw(
            lambda y, v, p: ca.if_else(y > p["g"], p["k"] * y, 0),
            K,
            [(0,)],
            lambda y, v, p: y - p["g"],
        )
    )
    for problem in (root, jump):
        with pytest.warns(RuntimeWarning, match="the curve is incomplete: " + UNDEFINED):
            response = sh.frf(problem, (5, 30), progress=False)
        assert str(response.status.values).startswith(UNDEFINED)
        assert response.sizes["point"] > 10
        assert np.isfinite(response.amplitude).all()
        # It ends where the largest displacement reaches what the force is undefined beyond.
        assert response.amplitude.values[-1, 0] == pytest.approx(1e-3, rel=1e-3)
    with_zero = problem_of(group_of("rounded")).with_parameters(e=0.0)
    assert str(sh.solve(with_zero, 15.0).status.values).startswith(UNDEFINED)
