"""Newton's method in one call: the curves of the steps in Python, to the bit, for every law."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.continuation import FrequencyProblem, follow_branch
from symhbm.continuation.correctors import Hyperplane, compiled, one_call
from tests.problems import FRICTION, LAWS, OWN_LAWS, chain, problem

TURN = 2 * np.pi


def two_laws():
    """A chain with friction under a constant load in one place and a varying one in another."""
    contacts = {
        "first": LAWS["coulomb"]([(0, 3)], None, None),
        "second": LAWS["varying"]([(3, 6), (6, 9)], None, [(5, 8), (8, 11)]),
    }
    parts = [getattr(chain("none"), f"{name}_matrix") for name in ("mass", "damping", "stiffness")]
    force = sh.forces.HarmonicForce(cosine={1: {0: 1.0, 2: 0.3}}, sine={1: {1: 0.5}}, amplitude=3.0)
    return sh.HarmonicBalance(sh.Model(*parts, contacts=contacts), force, (0, 1, 2, 3))


PROBLEMS = {
    "coulomb": lambda: problem("coulomb chain point 13"),
    "reduced harmonics": lambda: problem("coulomb sector order 13"),
    "varying": lambda: problem("varying mistuned static 0123"),
    "planar": lambda: problem("planar blade point 13"),
    "pressed": lambda: problem("pressed blade point 0123"),
    "stop": lambda: problem("stop chain point 0123"),
    "two laws": two_laws,
}


@pytest.fixture
def pays(monkeypatch):
    """One call pays at once; numba is there."""
    pytest.importorskip("numba")
    monkeypatch.setattr(type(one_call.correct), "pays", True)


def corrector(given, machine: bool):
    """The corrector of a problem in one call, or in Python."""
    if machine:
        one_call._groups(given.equations)  # its laws as machine code
    made = compiled.LocatedCorrector(FrequencyProblem(given))
    if not machine:
        made._one_call = None
    assert (made._one_call is not None) == machine
    return made


def branch_of(given):
    """The branch over a band of the product of problems."""
    return follow_branch(FrequencyProblem(given), (TURN * 16, TURN * 30), 4000, False)


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_branch_is_the_same_as_step_by_step(name, pays, monkeypatch):
    """States, tangents, events and peaks, and the work they take."""
    given = PROBLEMS[name]()
    assert corrector(given, True)
    fast = branch_of(given)
    monkeypatch.setattr(compiled, "one_call", lambda *given: None)
    slow = branch_of(given)
    assert (fast.status, fast.corrector.solves) == (slow.status, slow.corrector.solves)
    assert len(fast.points) == len(slow.points) > 10
    assert len(fast.peaks) == len(slow.peaks) > 0
    assert any(point.switches.any() for point in fast.points)
    for one, other in zip(fast.points, slow.points, strict=True):
        np.testing.assert_allclose(one.state, other.state, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(one.after, other.after, rtol=1e-9, atol=1e-12)
        assert np.array_equal(one.switches, other.switches)


def test_searches_end_where_those_step_by_step_do(pays):
    """From near, where they find nothing new, and from far, where they come to the solution."""
    given = problem("varying blade point 0123")
    fast, slow = corrector(given, True), corrector(given, False)
    known = fast.free(np.zeros(given.n_unknowns), TURN * 24).unknowns
    rng, reached, fast.solves = np.random.default_rng(0), 0, 0
    for other in (known, 5 * known):
        for start in known * (1 + 0.3 * rng.normal(size=(3, len(known)))):
            both = [one.approach(start, TURN * 24, other[None], 40) for one in (fast, slow)]
            assert (both[0] is None) == (both[1] is None)
            if both[0] is not None:
                reached += 1
                np.testing.assert_allclose(both[0][0], both[1][0], rtol=1e-10, atol=1e-14)
                assert both[0][2] == both[1][2]
    assert reached > 0
    assert fast.solves == slow.solves > 0


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e308])
def test_guesses_that_are_no_motion_give_nothing(value, pays):
    given = problem("coulomb chain point 13")
    one = corrector(given, True)
    size = given.n_unknowns + 1
    guess = np.full(size, value)
    plane = Hyperplane(guess, np.ones(size), np.eye(size)[-1])
    switches = np.zeros(1, dtype=bool)
    assert one.correct(guess, plane, switches) is None
    assert one.tangent_along(guess, plane, switches) is None
    assert one.approach(guess[:-1], 100.0, np.ones((1, size - 1)), 40) is None


def test_what_it_tells_of_a_point_is_what_steps_tell(pays):
    """The sign of the determinant, and that a force is no number."""
    given = problem("coulomb chain point 13")
    size = given.n_unknowns + 1
    told = []
    for machine in (True, False):
        one = corrector(given, machine)
        known = one.free(np.zeros(size - 1), TURN * 24).unknowns
        point, unit = np.append(known, TURN * 24), np.eye(size)[-1]
        plane = Hyperplane(point, np.ones(size), unit)
        switches = given.locate(known, TURN * 24).switches
        signs = [part.sign for part in (one.correct(point, plane, switches), one.tangent(
            point, np.ones(size), unit, switches
        ))]  # fmt: skip
        undefined = np.append(known, np.nan)
        assert one.defined
        assert one.correct(undefined, plane, switches) is None
        told.append((signs, one.defined))
    assert told[0] == told[1] == ([signs[0]] * 2, False)


@pytest.mark.parametrize("laws", [False, True])
def test_without_calls_by_address_corrections_go_step_by_step(laws, pays, monkeypatch):
    """What numba does not promise may change."""

    def fails(loop, *arguments):
        raise NotImplementedError("another calling convention")

    given = problem("coulomb chain point 13")
    assert corrector(given, True)
    monkeypatch.setattr(one_call.OneCall, "_works", None)
    monkeypatch.setattr(type(one_call.correct), "address", fails)
    if laws:
        monkeypatch.setattr(one_call, "_groups", one_call._groups.__wrapped__)
    assert compiled.LocatedCorrector(FrequencyProblem(given))._one_call is None
    assert follow_branch(FrequencyProblem(given), (TURN * 16, TURN * 18), 4000, False).points


class Halved(sh.laws.Coulomb):
    """Events of half the motion: a law that locates in its own way."""

    def locate(self, at, held=None):
        """Those of half the motion."""
        return super().locate(at._replace(motion=at.motion / 2), held)


@pytest.mark.parametrize("law", [Halved(), sh.laws.Coulomb().sampled(64), OWN_LAWS[1]])
def test_laws_that_locate_in_another_way_do_so(law, pays):
    """Those derived from one with a loop, those over samples, those that a frequency moves."""
    values = {**FRICTION, "damper_mass": 1e-4}
    own = {name: values[name] for name in law.parameters}
    model = sh.Model(np.eye(3), np.eye(3), 1e4 * np.eye(3), contacts={
        "contact": sh.Contacts(law, *[[(0,)]] * len(law.directions), **own)
    })  # fmt: skip
    given = sh.HarmonicBalance(model, sh.forces.PointForce(), (0, 1, 3))
    assert compiled.LocatedCorrector(FrequencyProblem(given))._one_call is None
