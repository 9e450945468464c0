"""Names of degrees of freedom: in tables of places, contacts, forces, condensation and results."""

import pickle

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from tests import pressed_contact
from tests.problems import rub
from tests.refusals import refused

NODES = [7, 7, 9, 9]
DIRECTIONS = ["x", "y", "x", "y"]
COORDINATES = [[0.0, 0, 0], [0, 0, 0], [1, 0, 2], [1, 0, 2]]
LABELS = ["tip", "tip", "", ""]
MATRICES = np.eye(4), np.diag([2.0, 3, 2, 3]), np.diag([1e4, 2.25e4, 1.04e4, 2.3e4])


def places(**changes):
    columns = dict(node=NODES, direction=DIRECTIONS, coordinates=COORDINATES, label=LABELS)
    return sh.Places(**(columns | changes))


def shroud(tangential=("tip:x", "9:x"), normal=("7:y", "9:y")):
    return pressed_contact.shroud(tangential, normal)


def pair(**groups):
    return sh.Model(*MATRICES, places=places()).with_contacts(**groups)


def test_numbers_of_names():
    table = places()
    assert [table.number(name) for name in ("tip:x", "7:y", "9:x", "9:y")] == [0, 1, 2, 3]
    assert table.number(2) == 2
    assert [table.name(dof) for dof in range(4)] == ["tip:x", "tip:y", "9:x", "9:y"]


def test_degrees_of_freedom_in_any_order():
    order = [2, 1, 3, 0]
    table = places().of(order)
    assert [table.number(places().name(dof)) for dof in order] == [0, 1, 2, 3]
    assert table.coordinates[0].tolist() == [1, 0, 2]


def rubbing(tangential):
    return pair(shroud=shroud(tangential))


def model(**table):
    return sh.Model(*MATRICES, places=table)


def under(force):
    return sh.HarmonicBalance(pair(), force, (0, 1))


UNKNOWN = sh.forces.PointForce("tpi:x"), sh.forces.StaticLoad({"tpi:x": 1.0})
test_what_is_no_place_is_told = refused([
    *((lambda name=name: pair().number_of(name), error, words) for name, error, words in (
        ("tpi:y", KeyError, "nearest are 'tip'"),
        ("11:x", KeyError, "nearest are 9, 7"),
        ("tip:z", KeyError, "tip has x, y"),
        ("tip", TypeError, "as 'tip:y'"),
        ("tip:", TypeError, "as 'tip:y'"),
        ("a:b:c", TypeError, "as 'tip:y'"),
        (4, ValueError, "from 0 to 3"),
    )),
    (lambda: places(label="rim").number("rim:x"), KeyError, "nodes 7, 9; say which"),
    (lambda: places().labelled({"root": 8}), KeyError, "8 is no node"),
    (lambda: places().labelled({"root": [7, 9], "foot": 9}), ValueError, "no other name"),
    *((lambda changes=changes: places(**changes), ValueError, words) for changes, words in (
        (dict(direction=["x", "x", "x", "y"]), "node 7 has 'x' twice"),
        (dict(direction=["x", "y", "x", "up"]), "direction='up'"),
        (dict(direction=["x", "y"]), "expected 4 texts"),
        (dict(node=[7, 7, 9.5, 9]), "expected integers, the numbers of nodes"),
        (dict(label=["tip", "", "", ""]), "label: node 7 has different ones"),
        (dict(coordinates=np.arange(12.0).reshape(4, 3)), "coordinates: node 7 has different"),
        (dict(coordinates=np.zeros((4, 2))), r"shape \(4, 3\)"),
        (dict(coordinates=np.full((4, 3), np.nan)), "finite"),
        (dict(label=["8", "8", "", ""]), "no number"),
        (dict(label=["a:b", "a:b", "", ""]), "no colon"),
    )),
    (lambda: model(nodes=NODES, direction=DIRECTIONS), KeyError, "did you mean 'node'"),
    (lambda: model(node=[1], direction=["x"]), ValueError, "expected 4 "),
    (lambda: model(node=NODES), ValueError, "column 'direction'"),
    (lambda: sh.Model(*MATRICES, places=[1, 2, 3, 4]), TypeError, r"symhbm\.Places"),
    (lambda: sh.Model(*MATRICES).number_of("tip:x"), KeyError, "give it places="),
    (lambda: rubbing(("tip:x", "7:x")), ValueError, "two different"),
    (lambda: rubbing({"tip:x": 1.0, "7:x": 1.0}), ValueError, "each place once"),
    (lambda: rubbing(("tpi:x",)), KeyError, r"contacts\['shroud'\], tangential\[0\].*nearest"),
    (lambda: rubbing(("tip",)), TypeError, "as 'tip:y'"),
    (lambda: rubbing("tip:x"), TypeError, "sequence of DOF pairs"),
    (lambda: rubbing(("tip:x", 4)), ValueError, "from 0 to 3"),
    *((lambda force=force: under(force), KeyError, "nearest are 'tip'") for force in UNKNOWN),
    (lambda: under(sh.forces.StaticLoad({"tip:x": 1.0, 0: 1.0})), ValueError, "each place once"),
])  # fmt: skip


def test_a_label_of_several_nodes_is_no_place_but_a_set_of_nodes():
    table = places(label="rim")
    assert table.nodes_of("rim").tolist() == [7, 9]
    assert table.name(3) == "9:y"


def test_labels_by_node():
    table = places(label=None).labelled({"tip": 7, "shroud": [9]})
    assert table.label.tolist() == ["tip", "tip", "shroud", "shroud"]


def test_tables_of_a_model():
    assert model(node=NODES, direction=DIRECTIONS).number_of("9:y") == 3


def test_contacts_by_name_are_those_by_number():
    named, numbered = pair(shroud=shroud()), pair(shroud=shroud((0, 2), (1, 3)))
    assert named.contacts == numbered.contacts == (((0, 2), (1, 3)),)
    weighted = pair(shroud=shroud({"tip:x": 0.8, 2: -0.6}))
    expected = pair(shroud=shroud({0: 0.8, 2: -0.6}))
    np.testing.assert_array_equal(weighted.directions.toarray(), expected.directions.toarray())
    friction = dict(contact_stiffness=1e4, friction_coefficient=0.3, normal_load=2.0)
    short = sh.Model(*MATRICES, contacts=[("tip:x", "9:x")], places=places(), **friction)
    assert short.contacts == ((0, 2),)


def test_other_contacts_replace_those_there_were():
    first = pair(shroud=shroud())
    root = sh.Contacts(sh.laws.CubicSpring(), [("9:x",)], cubic_stiffness=1e7)
    second = first.with_contacts(root=root)
    assert second.parameters.keys() == {"cubic_stiffness"}
    assert second.contacts == ((2,),)
    assert first.n_contacts == 1
    assert second.with_contacts().n_contacts == 0
    assert not hasattr(second, "normal_load") or second.normal_load is None
    assert pickle.loads(pickle.dumps(second)).number_of("tip:y") == 1


@pytest.mark.parametrize(
    ("named", "numbered"),
    [
        (sh.forces.PointForce("tip:y", 3.0), sh.forces.PointForce(1, 3.0)),
        (sh.forces.StaticLoad({"tip:x": 5.0, 2: 1.0}), sh.forces.StaticLoad({0: 5.0, 2: 1.0})),
        (
            sh.forces.EngineOrder(1, places=["tip:x", "9:x"]),
            sh.forces.EngineOrder(1, places=[0, 2]),
        ),
        (
            sh.forces.PointForce("tip:x") + sh.forces.StaticLoad({"9:y": 2.0}),
            sh.forces.PointForce(0) + sh.forces.StaticLoad({3: 2.0}),
        ),
    ],
)
def test_forces_by_name_are_those_by_number(named, numbered):
    problem = sh.HarmonicBalance(pair(), named, (0, 1))
    assert problem.excitation == numbered


def test_results_have_places_and_problems_are_rebuilt_with_them(tmp_path):
    problem = sh.HarmonicBalance(pair(shroud=shroud()), sh.forces.PointForce("tip:x", 3.0), (0, 1))
    response = sh.frf(problem, (14, 18), progress=False, archive=tmp_path / "pair.nc")
    assert response.node.values.tolist() == NODES
    assert response.direction.values.tolist() == DIRECTIONS
    assert response.label.values.tolist() == LABELS
    assert response.dof_z.values.tolist() == [0, 0, 2, 2]
    middle = [response[f"contact_{axis}"].item() for axis in "xyz"]
    assert middle == [0.5, 0.0, 1.0]
    loaded = sh.load(tmp_path / "pair.nc")
    assert loaded.identical(response)
    again = sh.datasets.rebuild(loaded)
    for column in ("node", "direction", "coordinates", "label"):
        expected = getattr(places(), column)
        np.testing.assert_array_equal(getattr(again.model.places, column), expected)
    assert again.model.number_of("tip:y") == 1
    figure = sh.plot.response(loaded, place="tip:y")
    assert "tip:y" in figure.axes[0].get_ylabel()
    with pytest.raises(KeyError, match="nearest"):
        sh.plot.response(loaded, place="tpi:y")


def test_condensed_structures_know_places():
    n = 30
    mass = sp.eye_array(n)
    stiffness = 1e4 * (2 * mass - sp.eye_array(n, k=1) - sp.eye_array(n, k=-1))
    chain = sh.Model(
        mass,
        0.5 * mass,
        stiffness,
        contacts=[("end:x",)],
        **rub(1e4, 0.5, 0.5),
        places=sh.Places(np.arange(100, 100 + n), "x").labelled({"end": 129, "middle": 115}),
    )
    force = sh.forces.PointForce("110:x")
    small = sh.condense(chain, force, (1, 4), places=["middle:x"])
    assert small.dofs.tolist() == [15, 29]
    assert small.number_of("110:x") == 10
    problem = sh.HarmonicBalance(small, force)
    response = sh.frf(problem, (1, 4), progress=False)
    assert response.node.values.tolist() == [115, 129]
    assert response.label.values.tolist() == ["middle", "end"]
    whole = sh.datasets.recover(problem, response.isel(point=3))
    assert whole.label.values[15] == "middle"
    with pytest.raises(TypeError, match="condense the structure"):
        small.with_contacts()
    with pytest.raises(KeyError, match="nearest are 'middle'"):
        sh.condense(chain, force, (1, 4), places=["midle:x"])
