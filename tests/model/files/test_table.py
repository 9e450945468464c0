"""Tables of places from files, and units of files."""

import numpy as np
import pytest
import rods

import symhbm as sh

LINES = "\n".join(
    f"{node},{direction},{i},0,0,{'tip' if node == 13 else ''}"
    for i, node in enumerate(rods.NODES)
    for direction in ("UX", "2", "T3")
)


def test_a_line_per_degree_of_freedom(tmp_path):
    table = tmp_path / "places.csv"
    table.write_text(f"# from the mapping\nNode, direction, x, y, z, label\n{LINES}\n")
    model = rods.read(rods.saved(tmp_path / "rod.npz"), places=table)
    assert model.places.direction.tolist() == rods.AXES * 4
    assert model.number_of("tip:z") == 11
    np.testing.assert_array_equal(model.places.coordinates, rods.places().coordinates)


def test_directions_by_number(tmp_path):
    table = tmp_path / "places.csv"
    lines = [f"{node},{way}" for node in rods.NODES for way in (1, 2, 3)]
    table.write_text("\n".join(["node,direction", *lines]))
    assert rods.read(rods.saved(tmp_path / "rod.npz"), places=table).number_of("13:z") == 11


@pytest.mark.parametrize("table", [dict(node=rods.NODES), "node\n3\n5\n8\n13\n"])
def test_a_line_per_node(tmp_path, table):
    if isinstance(table, str):
        (tmp_path / "nodes.csv").write_text(table)
        table = tmp_path / "nodes.csv"
    with pytest.warns(UserWarning, match="'direction', x, y, z taken for each of 4 nodes"):
        model = sh.read_structure(
            rods.saved(tmp_path / "rod.npz"), places=table, labels={"tip": 13, "root": [3, 5]}
        )
    assert model.number_of("tip:x") == 9
    assert model.places.nodes_of("root").tolist() == [3, 5]


def test_a_table_of_other_nodes_that_fits_is_told(tmp_path):
    """Twelve nodes for the twelve degrees of freedom of four."""
    with pytest.warns(UserWarning, match="'direction', x taken for each of 12 nodes"):
        sh.read_structure(rods.saved(tmp_path / "rod.npz"), places=dict(node=range(1, 13)))


@pytest.mark.parametrize(
    ("units", "length", "mass", "time"),
    [
        ("mm-t-s", 1e-3, 1e3, 1.0),
        ("mm-kg-ms", 1e-3, 1.0, 1e-3),
        ("in-lbf-s", 0.0254, 175.126835246, 1.0),
    ],
)
def test_units_are_changed_once_and_told(tmp_path, units, length, mass, time):
    in_si = rods.matrices()
    powers = (0, 1, 2)
    held = {
        name: matrix.toarray() / (mass / time**power)
        for name, matrix, power in zip("MCK", in_si, powers, strict=True)
    }
    table = rods.places()
    places = dict(
        node=table.node, direction=table.direction, coordinates=table.coordinates / length
    )
    path = rods.saved(tmp_path / "rod.npz", **held)
    with pytest.warns(UserWarning, match=f"{units} changed to SI$"):
        model = sh.read_structure(path, units=units, places=places)
    for kind, matrix in zip(("mass", "damping", "stiffness"), in_si, strict=True):
        given = getattr(model, f"{kind}_matrix").toarray()
        np.testing.assert_allclose(given, matrix.toarray(), rtol=1e-9)
    np.testing.assert_allclose(model.places.coordinates, table.coordinates)
    with pytest.warns(UserWarning, match="all degrees of freedom taken as displacements"):
        sh.read_structure(path, units=units)


def test_rotations_have_units_of_their_own(tmp_path):
    """Strain energy is the same number of joules, whatever the units are."""
    stiffness = np.array([[12.0, 6.0], [6.0, 4.0]])  # N/mm, N and N mm of a beam's end
    np.savez(tmp_path / "beam.npz", M=np.diag([1.0, 1.0]) * 1e-6, K=stiffness)
    places = dict(node=[1, 1], direction=["y", "rz"])
    with pytest.warns(UserWarning, match="changed to SI"):
        model = sh.read_structure(tmp_path / "beam.npz", units="mm-t-s", places=places)
    motion, energy = np.array([0.3, 0.2]), 1e-3  # mm and rad; N mm
    in_si = motion * [1e-3, 1.0]
    given = in_si @ model.stiffness_matrix.toarray() @ in_si
    assert given == pytest.approx(energy * motion @ stiffness @ motion, rel=1e-12)
    assert model.mass_matrix.toarray()[1, 1] == pytest.approx(1e-9)
