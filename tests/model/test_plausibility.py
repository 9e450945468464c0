"""Models, bands and harmonic sets that are not what was meant are refused, or warned of."""

import warnings

import numpy as np
import pytest
import scipy.sparse as sp
from designs import any_status

import symhbm as sh
from symhbm.balance.mean_position import is_held
from symhbm.model import plausibility
from symhbm.model.plausibility import DOUBT, _highest, _lowest, _resonances
from tests.refusals import refused

ONE = np.eye(2)
DAMPING = 0.5 * ONE
STIFFNESS = np.array([[2e4, -1e4], [-1e4, 2e4]])
CONTACT = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=1.0)
BLADE = dict(mass=1, stiffness=1e4, damping=0.5) | CONTACT


def two_masses(mass=ONE, damping=DAMPING, stiffness=STIFFNESS, **contact):
    return sh.Model(mass, damping, stiffness, contacts=[(0, 1)], **CONTACT | contact)


def blade(harmonics=(1,), **values):
    force = sh.forces.PointForce(amplitude=1.0)
    return sh.HarmonicBalance(sh.single_blade(**BLADE | values), force, harmonics)


def frf(problem, band, **options):
    return sh.frf(problem, band, progress=False, **options)


def said(call):
    """The one warning of a call, nothing where there is none."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with any_status():
            call()
    assert len(caught) <= 1
    assert all(warning.filename == __file__ for warning in caught)
    return str(caught[0].message) if caught else ""


def test_doubts_are_looked_for_once(monkeypatch):
    """Of one model in one band, and told at each call."""
    looked, find = [], plausibility._of_band
    monkeypatch.setattr(
        plausibility, "_of_band", lambda *call: looked.append(call[2]) or find(*call)
    )
    problem, near, far = blade(), (10, 30), (1000, 1001)
    assert [said(lambda: frf(problem, near)) for _ in range(2)] == ["", ""]
    first, second = [said(lambda: frf(problem, far)) for _ in range(2)]
    assert first == second
    assert "the band 1000 to 1001 Hz lies" in first
    assert not said(lambda: frf(problem, near))
    assert said(lambda: frf(problem.with_parameters(stiffness=1e8), near))
    assert looked == [near, far, near, near]


# Contacts that do nothing


def contact(**given):
    return sh.Model(ONE, DAMPING, STIFFNESS, contacts=[(0, 1)], **given)


test_a_contact_parameter_that_was_forgotten = refused([
    (lambda: contact(), ValueError, "without them contacts do nothing"),
    (lambda: contact(contact_stiffness=1e4),
     ValueError, "a linear spring is a part of stiffness_matrix"),
    *(
        (call, ValueError, f"{name}=None")
        for name in CONTACT
        for call in (
            lambda none={name: None}: contact(**CONTACT | none),
            lambda none={name: None}: contact(cubic_stiffness=1.0, **CONTACT | none),
            lambda none={name: None}: sh.single_blade(**BLADE | none),
            lambda none={name: None}: sh.bladed_disk(3, **BLADE | none),
        )
    ),
])  # fmt: skip


# Matrices and bands

SWAPPED = two_masses(damping=STIFFNESS, stiffness=DAMPING)
ORDER = "order mass, damping, stiffness"
APART = sh.Model(ONE, 0.5 * ONE, np.diag([1e2, 1e8]))  # 1.6 and 1592 Hz
SPRING = sh.Model([[1.0]], [[0.05]], [[1.0]], contacts=[(0,)], cubic_stiffness=0.1)
ALONE = sh.Model(np.eye(3), 0.5 * np.eye(3), 1e4 * np.eye(3), contacts=[(0,)], **CONTACT)
LOADS = {"normal_load": [1.0, 2.0]}
EFFECTIVE = dict(contact_stiffness=[1.0], friction_coefficient=[0.5], normal_load=[1.0, 2.0])


def forced(model, amplitude=1.0):
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=amplitude))


def curve(model, band=(10, 30), **options):
    return lambda: frf(forced(model), band, **options)


def of_blade(band, harmonics=(1,), over=None, **values):
    return lambda: frf(blade(harmonics, **values), band, over=over)


def of_spring(**over):
    return lambda: frf(forced(SPRING, 0.01), (0.1, 0.12), over=over)


def oscillator(damping, stiffness):
    return lambda: sh.solve(forced(sh.Model([[1.0]], [[damping]], [[stiffness]])), 0.1)


def skewed(*entries):
    return curve(two_masses(stiffness=STIFFNESS + np.array([[0, entries[0]], [entries[1], 0]])))


def followed():
    sh.follow(forced(SWAPPED), "normal_load", (1, 2), frequency=20.0, progress=False)


def peaks_of_a_damped_blade():
    band = dict(frequency_band=(15, 20), progress=False)
    sh.peak_curve(blade(damping=1e3), "normal_load", (50, 60), **band)


def design_of_a_damped_blade():
    sh.minimise_peak(blade(damping=1e3), "normal_load", (2, 40), n_starts=1, progress=False)


def air_of_a_ring():
    sector = sh.Model([[1.0, 0], [0, 0]], [[2.0, 0], [0, 0]], [[3e4, -2e4], [-2e4, 2e4]])
    air = sh.Influence({0: 1.0}, {-1: 60 + 300j, 0: -100 + 500j, 1: 30 - 250j}, 30.0)
    ring = sh.mistuned_ring(sh.Sector(sector, [0], [1], 6).with_influences(air))
    assert abs(ring.stiffness_matrix - ring.stiffness_matrix.T).max() > 1
    sh.solve(sh.HarmonicBalance(ring, sh.forces.EngineOrder(2, pattern={0: 1.0})), 30.0)


# The smallest damping ratio is that of 2e4 / (2 sqrt(0.5)).
OF_ORDER = [DOUBT, "damping is at least 1.41e+04 times the critical one", ORDER]
TOLD = [
    (curve(SWAPPED), OF_ORDER),
    (lambda: sh.solve(forced(SWAPPED), 20.0), OF_ORDER),
    (followed, OF_ORDER),
    *((oscillator(damping, 1.0), []) for damping in (0, 0.05)),
    *((oscillator(1.0, stiffness), [ORDER]) for stiffness in (0, 0.05)),
    (
        skewed(5e3, -5e3),
        ["stiffness_matrix is not symmetric: entry (0, 1) is -5000, entry (1, 0) is -15000"],
    ),
    (skewed(0.1, 0), ["entry (0, 1) is -9999.9, entry (1, 0) is -10000"]),
    (skewed(1e-3, 0), []),  # what a file with few digits leaves
    (curve(two_masses(damping=DAMPING + np.array([[0, 3], [-3, 0]]))), []),  # what rotation makes
    (air_of_a_ring, []),
    # 15.9 Hz where the contact slides, 22.5 Hz where it sticks.
    (of_blade((2 * np.pi * 10, 2 * np.pi * 30)), ["lies 2.79 times above", "not in rad/s or rpm"]),
    (
        of_blade((600, 1800)),
        ["lies 26.7 times above the nearest natural frequency, 22.51 Hz", "are in Hz"],
    ),
    (of_blade((1800, 600)), ["the band 600 to 1800 Hz", "are in Hz"]),
    (of_blade((0.1, 1)), ["lies 15.9 times below the nearest natural frequency, 15.92 Hz"]),
    *((of_blade(band), []) for band in ((10, 30), (40, 60), (4, 6))),
    (curve(APART, (40, 41)), ["nearest natural frequency, 1.592 Hz"]),
    (curve(APART, (1, 41)), []),
    (of_blade((2.2, 2.5), (1, 3, 5, 7)), []),
    (of_blade((2.2, 2.5), (1, 3, 5)), ["below"]),
    (lambda: sh.solve(blade(), 1e-3), []),  # one frequency may be static
    (lambda: sh.solve(blade(), 350.0), []),
    (lambda: sh.solve(blade(), 1200.0), ["frequency=1200 Hz lies 53.3 times above"]),
    (lambda: sh.solve(forced(two_masses(mass=np.array([[1, 0.999], [0.999, 1]]))), 1e3), []),
    # What moves is not doubted.
    (of_blade((60, 90), over={"mass": [0.01, 0.05]}), []),
    (of_blade((10, 30), over={"damping": [0.5, 1.0]}, damping=1e4), []),
    (of_blade((60, 90), over=LOADS), ["above"]),
    # Cubic springs alone have no friction.
    (of_spring(**LOADS), ["normal_load has no effect, as contact_stiffness and friction_coeffic"]),
    (of_spring(**EFFECTIVE), []),
    (of_spring(cubic_stiffness=[0.1, 0.2]), []),
    # Where the matrices and the band of a condensation are given.
    (lambda: sh.condense(ALONE, sh.forces.PointForce(), (600, 1800), places=[1]), ["times above"]),
    (lambda: sh.condense(ALONE, sh.forces.PointForce(), (10, 30), places=[1]), []),
    (peaks_of_a_damped_blade, ["at least 5 times the critical one"]),
    (design_of_a_damped_blade, ["at least 5 times the critical one"]),
    (
        lambda: frf(sh.HarmonicBalance(sh.single_blade(**BLADE), harmonics=(1,)), (10, 30)),
        ["no force oscillates"],
    ),
]


@pytest.mark.parametrize(("call", "words"), TOLD)
def test_what_is_doubted_is_told_once(call, words):
    text = said(call)
    assert bool(text) == bool(words)
    assert all(word in text for word in words), text


def test_all_doubts_are_one_warning():
    wrong = two_masses(damping=STIFFNESS, stiffness=DAMPING + np.array([[0, 0.3], [-0.1, 0]]))
    text = said(curve(wrong, (1000, 3000)))
    assert text.count(";") >= 3
    for word in ("not symmetric", "critical", "times above"):
        assert word in text


def test_natural_frequencies_of_a_large_structure():
    """A chain against its closed form; the bounds are on the right side."""
    n = 400
    ones = np.ones(n)
    chain = 1e4 * sp.diags_array([-ones[1:], 2 * ones, -ones[1:]], offsets=[-1, 0, 1])
    model = sh.Model(sp.eye_array(n), 0.5 * sp.eye_array(n), chain, contacts=[(0,)], **CONTACT)
    exact = 200 * np.sin(np.arange(1, n + 1) * np.pi / (2 * n + 2)) / (2 * np.pi)
    lowest, highest = _lowest(model, 1.0), _highest(model, model.groups.stuck_springs)
    assert exact[0] <= lowest < 1.2 * exact[0]
    assert exact[-1] / 2 < highest <= 1.01 * exact[-1]
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(n // 2))
    assert "lies 21" in said(lambda: sh.solve(problem, 21.0 * highest))
    assert not said(lambda: sh.solve(problem, 20.0))
    small = sh.Model(np.eye(3), 0 * np.eye(3), chain.toarray()[:3, :3])
    expected = 200 * np.sin(np.arange(1, 4) * np.pi / 8) / (2 * np.pi)
    for found in _resonances(small, small.groups.stuck_springs, 5.0):
        np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_natural_frequencies_without_inertia_or_stiffness():
    spring = np.array([[1e4, -1e4], [-1e4, 1e4]])
    none = np.zeros(0)
    massless = sh.Model(np.diag([1.0, 0.0]), 0 * ONE, STIFFNESS)
    low, high = _resonances(massless, none, 5.0)
    # A mass on the stiffness that is left: 2e4 - 1e8 / 2e4.
    np.testing.assert_allclose(low[0], np.sqrt(1.5e4) / (2 * np.pi))
    assert low[1] == high[1] == np.inf
    low, _ = _resonances(sh.Model(ONE, 0 * ONE, spring), none, 5.0)
    np.testing.assert_allclose(low, [0, np.sqrt(2e4) / (2 * np.pi)], atol=1e-6)


# Mean motions


def free_body(excitation, harmonics, **values):
    model = sh.Model([[1.0]], [[0.5]], [[0.0]], contacts=[(0,)], **CONTACT | values)
    return sh.HarmonicBalance(model, excitation, harmonics)


EVEN = sh.forces.HarmonicForce(cosine={1: [1.0], 2: [0.8]})
ODD = sh.forces.HarmonicForce(cosine={1: [1.0], 3: [0.8]})


def with_even_forces(harmonics):
    """What is asked of a body whose harmonics have no mean."""
    problem = free_body(EVEN, harmonics)
    loads, band = ("normal_load", (1, 2)), dict(frequency_band=(5, 20), progress=False)
    return (
        lambda: sh.solve(problem, 10.0),
        lambda: frf(problem, (5.0, 20.0)),
        lambda: sh.follow(problem, *loads, frequency=10.0, progress=False),
        lambda: sh.peak_curve(problem, *loads, **band),
        lambda: sh.minimise_peak(problem, *loads, **band),
    )


test_even_forces_need_a_mean = refused(
    (call, ValueError, r"expected 0 among them, .*try harmonics=\(0, 1, 2")
    for harmonics in ((1, 2), (1, 2, 3, 5))
    for call in with_even_forces(harmonics)
)


def test_cubic_springs_need_a_mean_beside_even_harmonics():
    model = sh.Model([[1.0]], [[0.1]], [[1.0]], contacts=[(0,)], cubic_stiffness=0.1)
    for harmonics in ((1, 3), (0, 1, 2)):
        sh.solve(sh.HarmonicBalance(model, sh.forces.PointForce(), harmonics), 0.1, throw=True)
    with pytest.raises(ValueError, match="a motion of even harmonics makes a mean force"):
        sh.solve(sh.HarmonicBalance(model, sh.forces.PointForce(), (1, 2)), 0.1)
    linear = sh.Model([[1.0]], [[0.1]], [[1.0]])
    assert sh.solve(sh.HarmonicBalance(linear, EVEN, (1, 2)), 0.1).converged


@pytest.mark.filterwarnings("ignore:the curve is incomplete")
@pytest.mark.parametrize("excitation", [EVEN, ODD], ids=["even", "odd"])
@pytest.mark.parametrize("samples", [None, 64])
def test_a_body_that_friction_alone_holds(excitation, samples):
    problem = free_body(excitation, (0, 1, 2, 3))
    problem = sh.HarmonicBalance(problem.model, excitation, (0, 1, 2, 3), samples)
    results = [sh.solve(problem, 10.0), frf(problem, (5.0, 20.0))]
    if samples is None:
        results.append(frf(problem, (5.0, 20.0), at=[6.0, 7.0], accuracy=0.01))
    for result in results:
        assert str(result.status.values) == sh.Status.NOT_HELD
        assert not result.converged.any()


def test_the_drift_of_a_body_is_no_periodic_motion():
    motion = sh.periodic_motion(free_body(EVEN, (0, 1, 2)), 8.0)
    assert str(motion.status.values) == sh.Status.NOT_HELD
    assert not motion.converged


def grounded(stiffness, **contact):
    force = sh.forces.HarmonicForce(cosine={1: np.ones(len(stiffness))})
    mass, contacts = np.eye(len(stiffness)), [(0, 1)]
    model = sh.Model(mass, 0.1 * mass, stiffness, contacts=contacts, **contact)
    return sh.HarmonicBalance(model, force, (0, 1, 2))


def test_what_holds_a_structure():
    # Rotated, so that round-off keeps the free motion from being exactly free.
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(5, 5)))[0]
    free = turn @ np.diag([0, 1, 2, 3, 4e6]) @ turn.T
    free = 0.5 * (free + free.T)
    stiff = turn @ np.diag([1e-4, 1, 2, 3, 4e6]) @ turn.T
    assert not is_held(grounded(free, **CONTACT))
    assert is_held(grounded(0.5 * (stiff + stiff.T), **CONTACT))
    # A cubic spring holds what it is attached to, between two bodies not both.
    chain = np.array([[1.0, -1.0], [-1.0, 1.0]])
    assert not is_held(grounded(chain, cubic_stiffness=0.1))
    assert not is_held(grounded(np.diag([0.0, 0.0]), cubic_stiffness=0.1))
    assert is_held(grounded(np.diag([0.0, 2.0]), cubic_stiffness=0.1))
    assert not is_held(grounded(np.diag([0.0, 2.0]), **CONTACT))


@pytest.mark.parametrize("spring", [0.0, 1e-3])
def test_what_holds_a_large_structure(spring):
    n = 800
    ones = np.ones(n)
    diagonal = 2 * ones
    diagonal[[0, -1]] = 1.0
    diagonal[0] += spring
    chain = sp.diags_array([-ones[1:], diagonal, -ones[1:]], offsets=[-1, 0, 1])
    model = sh.Model(sp.eye_array(n), 0.1 * sp.eye_array(n), chain, contacts=[(0,)], **CONTACT)
    assert is_held(sh.HarmonicBalance(model, sh.forces.PointForce(), (0, 1))) == bool(spring)


def test_a_condensed_structure_that_is_not_held():
    spring = 1e4 * np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    for held in (False, True):
        stiffness = spring + np.diag([1e4 * held, 0, 0])
        model = sh.Model(np.eye(3), 0.5 * np.eye(3), stiffness, contacts=[(0,)], **CONTACT)
        small = sh.condense(model, sh.forces.PointForce(0), (5, 30), (0, 1, 2))
        assert is_held(sh.HarmonicBalance(small, sh.forces.PointForce(0), (0, 1, 2))) == held
    even = sh.forces.HarmonicForce(cosine={1: [1.0, 0, 0], 2: [0, 0, 1.0]})
    small = sh.condense(model, even, (5, 30), (0, 1, 2))
    with pytest.raises(ValueError, match="expected 0 among them"):
        sh.solve(sh.HarmonicBalance(small, even, (1, 2)), 10.0)
    assert sh.solve(sh.HarmonicBalance(small, even, (0, 1, 2)), 10.0).converged


# Advice that applies


def test_degrees_of_freedom_with_nothing():
    """Neither inertia nor stiffness: that is no resonance, and the sentence says so."""
    model = sh.Model(np.diag([1.0, 0.0]), 0 * ONE, np.diag([1e4, 0.0]))
    found = sh.solve(sh.HarmonicBalance(model, sh.forces.PointForce()), 10.0)
    assert "neither stiffness nor inertia" in str(found.status.values)


def test_sentences_of_curves_do_not_speak_of_frequencies():
    """They are those of `follow` too."""
    for status in ("NO_START", "MINIMUM_STEP", "POINTS_MISSING", "TURNED_BACK"):
        assert "frequency" not in sh.Status[status]
    for status in sh.Status:
        assert "fewer harmonics" not in status
