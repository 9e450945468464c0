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


def test_decks_of_moved_parts_and_turned_nodes_are_refused(tmp_path):
    path = write(tmp_path)
    for more, words in (
        ("*INSTANCE, NAME=A, PART=B\n1.,0.,0.\n*END INSTANCE\n", "neither moved nor turned"),
        ("*TRANSFORM, NSET=TIP\n0,1,0,1,0,0\n", "TRANSFORM turns some"),
    ):
        (tmp_path / "Job-1.inp").write_text(DECK + more)
        with pytest.raises(ValueError, match=words):
            sh.read_structure(path)
