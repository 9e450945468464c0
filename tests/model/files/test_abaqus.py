"""Text of Abaqus: one triangle by nodes and directions, supports of 1e36."""

import numpy as np
import pytest
import rods

import symhbm as sh

FIXED = (0, 1, 2)


def write(folder, upper=False, separator=",", head="", fixed=FIXED):
    """Files of the rod, whose first node is held; the numbers of its nodes are not in order."""
    node, order = np.repeat([40, 7, 9, 8], 3), np.tile([1, 2, 3], 4)
    mass, damping, stiffness = (matrix.toarray() for matrix in rods.matrices())
    stiffness[fixed, fixed] = 1e36
    for name, matrix in dict(MASS2=mass, DMPV2=damping, STIF2=stiffness).items():
        lines = [head] if head else []
        for i, j in np.argwhere(matrix):
            if i == j or (i < j) == upper:
                entry = node[i], order[i], node[j], order[j], f"{matrix[i, j]:.17e}"
                lines.append(separator.join(map(str, entry)))
        (folder / f"Job-1_{name}.mtx").write_text("\n".join(lines) + "\n")
    return folder / "Job-1_STIF2.mtx"


def expected(matrix):
    """What is left of a matrix without the first node, by ascending nodes 7, 8, 9."""
    kept = np.r_[3:6, 9:12, 6:9]
    return matrix.toarray()[np.ix_(kept, kept)]


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("separator", [",", ", ", " "])
def test_triangles_and_supports(tmp_path, upper, separator):
    path = write(tmp_path, upper, separator, head="** made by hand\n*MATRIX, TYPE=ANY")
    with pytest.warns(UserWarning, match="3 supports of stiffness 1e36 dropped .*: 40:x") as told:
        model = sh.read_structure(path)
    assert len(told) == 1
    assert "\n" not in str(told[0].message)
    assert model.places.node.tolist() == [7, 7, 7, 8, 8, 8, 9, 9, 9]
    assert model.number_of("9:y") == 7
    for kind, matrix in zip(("mass", "damping", "stiffness"), rods.matrices(), strict=True):
        given = getattr(model, f"{kind}_matrix").toarray()
        np.testing.assert_allclose(given, expected(matrix), rtol=1e-14, atol=0)


def test_nodes_get_coordinates_and_labels_from_a_table(tmp_path):
    path = write(tmp_path, fixed=())
    table = tmp_path / "nodes.csv"
    table.write_text("node,x,y,z,label\n9,1,2,3,tip\n40,0,0,0,\n7,4,0,0,\n8,5,0,0,\n")
    model = rods.read(path, places=table)
    assert model.number_of("tip:z") == 8
    assert model.places.coordinates[8].tolist() == [1, 2, 3]
    table.write_text("node,x,y,z\n9,1,2,3\n40,0,0,0\n")
    with pytest.raises(ValueError, match="node 7 is not in the table"):
        sh.read_structure(path, places=table)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,1,1,1,5.0\n1,2,1,", "truncated, damaged"),
        ("1,1,5.0\n2,2,5.0\n", "got 3 columns"),
        ("1,11,1,11,5.0\n", "directions from 1 to 6"),
        ("1.5,1,1,1,5.0\n", "integers"),
        ("", "no matrix of Abaqus"),
        ("** a comment\n", "no matrix of Abaqus"),
    ],
)
def test_files_that_are_none(tmp_path, text, words):
    path = tmp_path / "Job-1_STIF2.mtx"
    path.write_text(text)
    with pytest.raises(ValueError, match=words) as caught:
        sh.read_structure(path)
    assert "\n" not in str(caught.value)


def test_all_supports(tmp_path):
    path = write(tmp_path, fixed=tuple(range(12)))
    with pytest.raises(ValueError, match="that are not fixed"):
        sh.read_structure(path)


DECK = """*NODE
7,0,0,0
8,1,0,0
9,0,1,0
40,0,0,1
*ELEMENT, TYPE=C3D4, ELSET=ALL
1,7,8,9,40
*NSET, NSET=TIP
8,9
*SURFACE, NAME=FLANK
ALL, S1
*MATERIAL, NAME=STEEL
*DENSITY
7850
*ELASTIC
2e11,.3
*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL
"""


def test_a_deck_beside_tells_sets_surfaces_and_materials(tmp_path):
    path = write(tmp_path)
    (tmp_path / "Job-1.inp").write_text(DECK)
    with pytest.warns(UserWarning, match="3 supports of stiffness 1e36 dropped"):
        model = sh.read_structure(path)
    mesh = model.places.mesh
    assert model.places.nodes_of("TIP").tolist() == [8, 9]
    assert mesh.shares(mesh.surfaces["FLANK"]).area.sum() == pytest.approx(0.5)
    assert model.places.program.materials["STEEL"]["density"] == 7850
    assert model.places.program.mass.sum() == pytest.approx(7850 / 6)
    np.testing.assert_array_equal(model.places.coordinates[model.number_of("8:y")], [1, 0, 0])


def dropped(path):
    with pytest.warns(UserWarning, match="3 supports of stiffness 1e36 dropped"):
        return sh.read_structure(path)


def test_supports_are_told_by_the_matrices_and_the_deck(tmp_path):
    path = write(tmp_path)
    for name in ("40, PINNED", "40, 1, 3", "40, ENCASTRE", "Feet, 1, 3, 0.0"):
        deck = DECK.replace("*NSET", "*NSET, NSET=FEET\n40\n*NSET")
        (tmp_path / "Job-1.inp").write_text(f"{deck}*BOUNDARY\n{name}\n")
        model = dropped(path)
        assert model.places.program.held.tolist() == [[40, 0], [40, 1], [40, 2]]
        assert not any("supports are free" in line for line in model.places.program.account)
    (tmp_path / "Job-1.inp").write_text(f"{DECK}*BOUNDARY\n8, ZSYMM\n")
    with pytest.warns(UserWarning, match="1 directions of supports are free .*: 8:z"):
        model = sh.read_structure(path)
    # A stress beside the support needs no held= any more.
    assert model.places.stress("TIP")["xx"].shape == (2, 9)


TWO_PARTS = """*NODE
1,0,0,0
2,1,0,0
3,0,1,0
4,0,0,1
5,1,1,1
*ELEMENT, TYPE=C3D4, ELSET=LOW
1,1,2,3,4
*ELEMENT, TYPE=C3D4, ELSET=HIGH
2,2,3,4,5
*MATERIAL, NAME=STEEL
*DENSITY
7850
*ELASTIC
2e11,.3
*MATERIAL, NAME=LIGHT
*DENSITY
2700
*ELASTIC
7e10,.33
*SOLID SECTION, ELSET=LOW, MATERIAL=steel
*SOLID SECTION, ELSET=HIGH, MATERIAL=Light
"""


def test_masses_of_two_materials_are_those_by_hand(tmp_path):
    """Volumes 1/6 and 1/3, by the determinants of three edges; centres the means of corners."""
    node, way = np.repeat(np.arange(1, 6), 3), np.tile([1, 2, 3], 5)
    steel, light = 7850 / 6, 2700 / 3
    share = np.array([steel, steel + light, steel + light, steel + light, light]) / 4
    for name, values in (("MASS1", np.repeat(share, 3)), ("STIF1", np.full(15, 1e9))):
        rows = zip(node, way, node, way, values.tolist(), strict=True)
        lines = "\n".join(",".join(map(str, row)) for row in rows)
        (tmp_path / f"Job-2_{name}.mtx").write_text(lines + "\n")
    (tmp_path / "Job-2.inp").write_text(TWO_PARTS)
    places = rods.read(tmp_path / "Job-2_STIF1.mtx").places
    np.testing.assert_allclose(places.program.mass, share, rtol=1e-14)
    # Of linear tetrahedra: each corner has the centre and a fifth of the way to itself.
    corners = {1: [0, 0, 0], 2: [1, 0, 0], 3: [0, 1, 0], 4: [0, 0, 1], 5: [1, 1, 1]}
    centre = steel * np.full(3, 1 / 4) + light * np.full(3, 1 / 2)
    np.testing.assert_allclose(places.program.moment.sum(axis=0), centre, rtol=1e-14)
    own = light / 4 * (0.8 * np.full(3, 0.5) + 0.2 * np.array(corners[5]))
    np.testing.assert_allclose(places.program.moment[4], own, rtol=1e-14)
    account = "\n".join(places.program.account)
    for words in ("mass 2208.33 kg", "1 elements of 1308.33 kg", "1 elements of 900 kg"):
        assert words in account
    assert "the mass matrix" not in account
    assert {k: v.tolist() for k, v in places.mesh.materials.items()} == {
        "tetra": ["STEEL", "LIGHT"]
    }
    # Of another density a lumped matrix is found by its sum.
    (tmp_path / "Job-2.inp").write_text(TWO_PARTS.replace("2700", "2900"))
    with pytest.warns(UserWarning, match="mass matrix has 2208.33 kg, elements 2275 kg"):
        sh.read_structure(tmp_path / "Job-2_STIF1.mtx")


def test_decks_of_moved_parts_and_turned_nodes_are_refused(tmp_path):
    path = write(tmp_path)
    for more, words in (
        ("*INSTANCE, NAME=A, PART=B\n1.,0.,0.\n*END INSTANCE\n", "neither moved nor turned"),
        ("*TRANSFORM, NSET=TIP\n0,1,0,1,0,0\n", "TRANSFORM turns some"),
    ):
        (tmp_path / "Job-1.inp").write_text(DECK + more)
        with pytest.raises(ValueError, match=words):
            sh.read_structure(path)
