"""Meshes of gmsh beside matrices that are assembled from them."""

import sys

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

import symhbm as sh

MESH = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
2 1 "flank"
3 2 "steel"
$EndPhysicalNames
$Entities
0 0 1 1
1 0 0 0 1 1 0 1 1 0
1 0 0 0 1 1 1 1 2 0
$EndEntities
$Nodes
1 4 11 14
3 1 0 4
11
12
13
14
0 0 0
1 0 0
0 1 0
0 0 1
$EndNodes
$Elements
2 2 1 2
2 1 2 1
1 11 12 13
3 1 4 1
2 11 12 13 14
$EndElements
"""


def write(folder, n=12):
    """A tetrahedron and matrices of so many rows, of which those of the first node are held."""
    (folder / "wedge.msh").write_text(MESH)
    held = sp.diags_array(np.where(np.arange(n) < 3, 1e36, 4e9))
    scipy.io.mmwrite(folder / "wedge_mass.mtx", sp.eye_array(n))
    scipy.io.mmwrite(folder / "wedge_stiffness.mtx", held)
    return dict(path=folder / "wedge.mtx", places=folder / "wedge.msh")


def test_without_meshio_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(ImportError, match=r"pip install symhbm\[gmsh\]"):
        sh.read_structure(**write(tmp_path))


def test_physical_groups_are_sets_and_surfaces(tmp_path):
    pytest.importorskip("meshio")
    with pytest.warns(UserWarning, match="3 supports of stiffness 1e36 dropped .*: 1:x"):
        model = sh.read_structure(**write(tmp_path), units="mm-t-s")
    mesh = model.places.mesh
    assert mesh.sets["steel"].tolist() == [1, 2, 3, 4]
    assert model.places.nodes_of("flank").tolist() == [2, 3]
    assert mesh.shares(mesh.surfaces["flank"]).area.sum() == pytest.approx(0.5e-6)
    np.testing.assert_allclose(model.places.coordinates[model.number_of("4:x")], [0, 0, 1e-3])


def test_other_sizes_and_damage_are_refused(tmp_path):
    pytest.importorskip("meshio")
    with pytest.raises(ValueError, match=r"expected 12 rows, .* the matrices have 9"):
        sh.read_structure(**write(tmp_path, 9))
    given = write(tmp_path)
    given["places"].write_text(MESH[:200])
    with pytest.raises(ValueError, match="no mesh of gmsh"):
        sh.read_structure(**given)
