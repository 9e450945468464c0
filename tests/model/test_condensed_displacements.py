"""Condensed to displacements of contacts: the same responses from half as many unknowns."""

import pickle

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from symhbm.model.linear import RelativeCoordinates
from tests.problems import mistuned
from tests.quick import quick_first
from tests.refusals import refused

N = 60
FORCE = (
    sh.forces.PointForce(place=20)
    + sh.forces.PointForce(place=40, amplitude=0.3)
    + sh.forces.PointForce(place=10)
)
BAND = (0.4, 1.6)
HARMONICS = (0, 1, 3)
EQUAL = 1e-10


def chain(contacts, damping="mass", places=None):
    """A chain of 60 masses, its ends held."""
    neighbours = sp.eye_array(N, k=1) + sp.eye_array(N, k=-1)
    stiffness = 1e3 * (2.0 * sp.eye_array(N) - neighbours)
    mass = sp.diags_array(np.linspace(0.8, 1.2, N))
    viscous = {
        "mass": 0.3 * mass,
        "local": 0.2 * mass + sp.diags_array(3.0 * (np.arange(N) % 7 == 0)),
        "gyroscopic": 0.3 * mass + 0.5 * (sp.eye_array(N, k=9) - sp.eye_array(N, k=-9)),
        "modal": sh.ModalDamping(0.02),
        "structural": sh.StructuralDamping(0.04),
    }[damping]
    return sh.Model(
        mass, viscous, stiffness, contacts=contacts, places=places,
        contact_stiffness=400.0, friction_coefficient=0.4, normal_load=1.0,
    )  # fmt: skip


def both(model, force=FORCE, **options):
    """Problems of both kinds of condensation."""
    kinds = "touched", "displacements"
    small = [sh.condense(model, force, BAND, HARMONICS, keep=kind, **options) for kind in kinds]
    return [sh.HarmonicBalance(each, force, HARMONICS) for each in small]


def difference(problems, hertz):
    """Largest difference of two responses of all degrees of freedom, over the largest."""
    points = [sh.solve(problem, hertz) for problem in problems]
    assert (points[0].contact_state.values > 0).any()
    assert np.array_equal(*(point.contact_state for point in points))
    whole = [sh.datasets.recover(*pair) for pair in zip(problems, points, strict=True)]
    assert whole[1].residual_norm < 1e-11
    assert whole[1].condensation_error < EQUAL
    first, second = (each.coefficient.values for each in whole)
    return abs(first - second).max() / abs(first).max()


@pytest.mark.parametrize(
    "damping", quick_first(["mass", "local", "gyroscopic", "modal", "structural"], 2)
)
def test_responses_are_those_of_both_sides(damping):
    """Contacts that share degrees of freedom, have weights, or reach to the ground."""
    contacts = [(10, 40), (40, 11), (25, 50), (30,), {12: 1.0, 33: 0.5, 52: -1.5}]
    problems = both(chain(contacts, damping), places=[5])
    assert [problem.n_dof for problem in problems] == [10, 6]
    assert problems[1].model.kept.tolist() == [5, *range(N, N + 5)]
    assert problems[1].model.certificate.error < EQUAL
    for hertz in (0.52, 0.9, 1.31):
        assert difference(problems, hertz) < EQUAL


def test_outputs_given_afterwards_are_of_the_structure():
    """A degree of freedom that a displacement is in the place of, and a displacement."""
    problems = both(chain([(10, 40)]), places=[10])
    for weights in ({40: 1.0}, {10: 1.0, 40: -1.0}):
        with_output = [
            problem.with_model(problem.model.with_outputs({"seen": weights}, "m"))
            for problem in problems
        ]
        one, other = (sh.solve(each, 0.9).seen_amplitude.item() for each in with_output)
        assert other == pytest.approx(one, rel=1e-10)


@pytest.mark.parametrize("dofs", [[50], [10, 40], [11, 20]])
def test_displacements_that_others_tell(dofs):
    """Contacts side by side, in a ring, and of degrees of freedom that are kept."""
    contacts = [(10, 40), (40, 11), (11, 10), (10, 40), (50,)]
    problems = both(chain(contacts), places=dofs)
    free = {(50,): 2, (10, 40): 2, (11, 20): 3}[tuple(dofs)]  # of 4 that are two of a ring and one
    assert problems[1].n_dof == len(dofs) + free
    assert difference(problems, 0.9) < EQUAL


def test_places_name_displacements():
    places = sh.Places(np.arange(100, 100 + N), "x", np.outer(np.arange(N), [1.0, 0, 0]))
    model = chain([("110:x", "140:x"), ("125:x", "150:x")], places=places)
    problem = both(model, sh.forces.PointForce(place=20), places=["105:x"])[1]
    point = sh.solve(problem, 0.9)
    assert point.structure_dof.values.tolist() == [5, N, N + 1]
    names = [f"displacement of contact {j}" for j in range(2)]
    assert point.label.values.tolist() == ["", *names]
    assert point.dof_x.values.tolist() == [5, 25, 37.5]
    told = f"1 degrees of freedom kept of {N} and 2 displacements of contacts"
    assert point.attrs["largest_of"] == told
    assert sh.datasets.recover(problem, point).node.values.tolist() == list(range(100, 100 + N))
    assert problem.model.structure.contact_coordinates[:, 0].tolist() == [25, 37.5]
    by_place = sh.HarmonicBalance(problem.model, sh.forces.PointForce(place="120:x"), HARMONICS)
    assert np.array_equal(sh.solve(by_place, 0.9).coefficient, point.coefficient)


def test_copies_and_archives():
    problem = both(chain([(10, 40)]), places=[5])[1]
    point = sh.solve(problem, 0.9)
    again = sh.solve(pickle.loads(pickle.dumps(problem)), 0.9)
    assert np.array_equal(again.coefficient, point.coefficient)
    with pytest.raises(sh.datasets.ArchiveError, match="do not hold displacements of contacts"):
        sh.datasets.rebuild(point)
    with pytest.raises(TypeError, match="has its structure"):
        sh.datasets.recover(problem, point, structure=chain([(10, 40)]))
    varied = problem.with_parameters(normal_load=2.0)
    whole = sh.datasets.recover(varied, sh.solve(varied, 0.9))
    assert whole.residual_norm < 1e-11


def test_archives_hold_rings_whose_displacements_all_follow_from_what_is_watched():
    ring, force = mistuned("coulomb"), sh.forces.EngineOrder(1, 1.2, pattern={1: 1.0})
    options = dict(places=[1, 6, 11, 16], keep="displacements", progress=False)
    small = sh.condense(ring, force, (22, 26), **options)
    point = sh.solve(sh.HarmonicBalance(small, force), 24.0)
    again = sh.solve(sh.datasets.rebuild(point), 24.0)
    np.testing.assert_array_equal(again.coefficient, point.coefficient)


def disk():
    near = np.eye(3, k=1) + np.eye(3, k=-1)
    blade = sh.Model(np.eye(3), 0.1 * np.eye(3), 10 * np.eye(3) - 2 * near)
    shroud = sh.Friction(
        tangential=(0, sh.next_sector(0)),
        contact_stiffness=1.0, friction_coefficient=0.3, normal_load=1.0,
    )  # fmt: skip
    return sh.Sector(blade, [1], [2], 6).with_contacts(shroud=shroud)


def displaced(structure, force=FORCE, keep="displacements"):
    return sh.condense(structure, force, BAND, keep=keep)


test_bad_keep = refused([
    (lambda: displaced(chain([(10, 40)]), keep="sides"), ValueError, "keep='sides'"),
    (lambda: displaced(chain([])), ValueError, "expected at least one"),
    (lambda: displaced(disk(), sh.forces.EngineOrder(2, pattern={0: 1.0})),
     ValueError, "in the same way in all waves"),
])  # fmt: skip


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_displacements_follow_from_those_chosen_or_are_refused(scale):
    directions = scale * sp.csr_array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [1.0, 0.0, -1.0]])
    found = RelativeCoordinates.of(directions, np.zeros(0, dtype=int))
    moved = (directions @ found.change(directions)).toarray()
    np.testing.assert_allclose(moved[np.ix_(found.rows, found.pivots)], np.eye(2), atol=1e-12)
    few = RelativeCoordinates(found.rows[:1], found.pivots[:1], found.held)
    with pytest.raises(ValueError, match="displacements depend on each other"):
        few.change(directions)
