"""Files of Ansys that come with ansys-mapdl-reader, where it is installed."""

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import symhbm as sh
from symhbm.model.files.programs import ansys
from symhbm.model.mesh import Mesh

PUBLISHED = 1283.2004, 1283.2004, 5781.9749, 6919.3989
"""Natural frequencies of ``file.full`` [Hz], by the manual of the reader."""


@pytest.fixture(scope="module")
def examples():
    reader = pytest.importorskip("ansys.mapdl.reader")
    return Path(reader.__file__).parent / "examples"


def test_without_the_reader_it_says_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "sector.full").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "ansys.mapdl", None)
    with pytest.raises(ImportError, match=r"pip install symhbm\[ansys\]"):
        sh.read_structure(tmp_path / "sector.full")


def test_matrices_have_the_published_frequencies(examples, tmp_path):
    shutil.copy(examples / "file.full", tmp_path / "beam.full")
    with pytest.warns(UserWarning, match=r"without \.cdb or \.rst beside.*63 zero rows dropped"):
        beam = sh.read_structure(tmp_path / "beam.full")
    assert beam.n_dof == 900
    found = sh.natural_modes(beam, count=4).frequency
    np.testing.assert_allclose(found, PUBLISHED, rtol=0, atol=5e-5)


def test_an_archive_beside_tells_places_and_components(examples, tmp_path):
    shutil.copy(examples / "file.full", tmp_path / "beam.full")
    shutil.copy(examples / "HexBeam.cdb", tmp_path / "beam.cdb")
    with pytest.warns(UserWarning, match="63 zero rows dropped"):
        beam = sh.read_structure(tmp_path / "beam.full")
    mesh = beam.places.mesh
    assert {kind: len(each) for kind, each in mesh.elements.items()} == {"hexahedron20": 40}
    assert {name: len(nodes) for name, nodes in mesh.sets.items() if "N" in name} == {
        "NCOMP2": 98,
        "NODE_SELECTION": 164,
    }
    # Volume by bricks whose nodes are in the right order.
    mass, *_ = mesh.weighed({"hexahedron20": np.ones(40)})
    assert mass.sum() == pytest.approx(1.0 * 1.0 * 5.0)
    held = np.setdiff1d(mesh.node, beam.places.nodes)
    assert len(held) == 21
    assert np.ptp(mesh.points(held)[:, 2]) == 0
    told = beam.places.program.held
    assert sorted(told.tolist()) == [[node, way] for node in held.tolist() for way in range(3)]


def test_results_of_another_model_are_told(examples, tmp_path):
    """The results of the example are those of a beam that is free."""
    for suffix in ("full", "rst"):
        shutil.copy(examples / f"file.{suffix}", tmp_path / f"beam.{suffix}")
    words = "(?s)units='in-lbf-s' found by the material.*another speed, mesh, material or support"
    with pytest.warns(UserWarning, match=words):
        beam = sh.read_structure(tmp_path / "beam.full")
    found = sh.natural_modes(beam, count=4).frequency
    np.testing.assert_allclose(found, PUBLISHED, rtol=0, atol=5e-5)
    assert np.ptp(beam.places.mesh.coordinates[:, 2]) == pytest.approx(5 * 0.0254)


def test_collapsed_bricks_are_wedges(examples, tmp_path):
    shutil.copy(examples / "sector.cdb", tmp_path / "rotor.cdb")
    contents = ansys.read({"": tmp_path / "rotor.cdb"}, {})
    count = {kind: len(each) for kind, each in contents.mesh.elements.items()}
    assert count == {"hexahedron": 101, "wedge": 4}
    densities = {kind: np.ones(n) for kind, n in count.items()}
    assert np.all(contents.mesh.weighed(densities)[0] >= 0)
    assert len(contents.mesh.sets["REFINE"]) == 25
    with pytest.raises(ValueError, match=r"expected matrices, .* wrote none"):
        sh.read_structure(tmp_path / "rotor.cdb")


def test_other_meshes_and_damage_are_refused(examples, tmp_path):
    shutil.copy(examples / "file.full", tmp_path / "beam.full")
    lines = (examples / "HexBeam.cdb").read_text().splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("NBLOCK")) + 2
    shutil.copy(examples / "file.rst", tmp_path / "beam.rst")
    lines[start + 2] = lines[start + 2].replace("2.5000", "2.6000")
    (tmp_path / "beam.cdb").write_text("\n".join(lines) + "\n")
    with pytest.raises(ValueError, match="different meshes"):
        sh.read_structure(tmp_path / "beam.full")
    for damaged in ("full", "rst"):
        content = (examples / f"file.{damaged}").read_bytes()
        (tmp_path / f"half.{damaged}").write_bytes(content[: len(content) // 2])
        with pytest.raises(ValueError, match="truncated, damaged, or no"):
            sh.read_structure(tmp_path / f"half.{damaged}")
        (tmp_path / f"half.{damaged}").unlink()


def test_rotated_nodes_are_refused(examples, tmp_path):
    reader = pytest.importorskip("ansys.mapdl.reader")
    archive = reader.Archive(str(examples / "HexBeam.cdb"))
    angles = archive.node_angles.copy()
    angles[3] = 30, 0, 0

    class Turned:
        nnum, node_angles = archive.nnum, angles

    with pytest.raises(ValueError, match=r"1 nodes have directions of their own .*4\); turn them"):
        ansys._check_turned(Turned, {"mass": 1})
    ansys._check_turned(Turned, {})


class Cyclic:
    """Results of a sector as ansys-mapdl-reader gives them, whose wave goes from node to node."""

    n_sector, version, materials = 6, 18.2, {}
    harmonic_indices, time_values = [0, 1, -1], [10.0, 20.0, 20.0]
    _resultheader = {"kan": 2}  # noqa: RUF012

    def nodal_solution(self, number, as_complex=False):
        assert as_complex
        wave = np.exp(1j * self.harmonic_indices[number] * np.arange(4.0))
        return np.array([4, 3, 2, 1]), np.outer(wave, [1.0, 2.0, 3.0])[::-1]


def test_waves_of_cyclic_results_are_modes_with_senses():
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    edges = {"CYCLIC_M01H": [1, 2], "CYCLIC_M01L": [3, 4], "CYCLIC": [1]}
    mesh = Mesh([1, 2, 3, 4], corners, {"tetra": [[1, 2, 3, 4]]}, edges)
    program = ansys._program(Cyclic(), mesh, {})
    assert (program.n_sectors, program.sides) == (6, ("CYCLIC_M01L", "CYCLIC_M01H"))
    frequency, waves, shape = program.modes
    assert frequency.tolist() == [10.0, 20.0, 20.0]
    assert waves.tolist() == [0, 1, -1]
    assert np.all(shape[0] == [1.0, 2.0, 3.0])
    np.testing.assert_allclose(shape[1], np.outer(np.exp(1j * np.arange(4.0)), [1, 2, 3]))
    np.testing.assert_allclose(shape[2], shape[1].conj())
    # Of several pairs of edges none is taken.
    more = mesh.with_sets({"CYCLIC_M02H": [1], "CYCLIC_M02L": [3]})
    assert ansys._program(Cyclic(), more, {}).sides is None


WAVES = os.environ.get("SYMHBM_ANSYS_CYCLIC", "")
"""``file_cyclic.rst`` of the package ansys-dpf-core 0.3 to 0.9: a ring of 8 sectors."""


@pytest.mark.skipif(not WAVES, reason="SYMHBM_ANSYS_CYCLIC names no file_cyclic.rst")
def test_waves_of_a_file_of_ansys_go_all_around_in_one_sense(examples, tmp_path):
    shutil.copy(WAVES, tmp_path / "ring.rst")
    contents = ansys.read({"": tmp_path / "ring.rst"}, {})
    mesh, program = contents.mesh, contents.program
    assert {kind: len(each) for kind, each in mesh.elements.items()} == {"hexahedron20": 4}
    frequency, waves, shape = program.modes
    assert np.bincount(abs(waves)).tolist() == [6, 6, 6, 6, 6]
    np.testing.assert_allclose(frequency[[0, 6, 7]], [670386.3252, 679667.3932, 679667.3932])
    low, high = (mesh.sets[side] for side in program.sides)
    c = np.sqrt(0.5)
    turn = np.array([[c, 0, c], [0, 1, 0], [-c, 0, c]])  # about y, the axis of this ring
    apart = np.linalg.norm((mesh.points(low) @ turn.T)[:, None] - mesh.points(high), axis=2)
    pairs = mesh.at(low), mesh.at(high[apart.argmin(axis=1)])
    ahead = shape[:, pairs[0]] @ turn.T
    senses = set()
    for wave, one, other in zip(waves, ahead, shape[:, pairs[1]], strict=True):
        left = [np.linalg.norm(other - np.exp(s * 1j * np.pi / 4 * wave) * one) for s in (-1, 1)]
        assert min(left) < 1e-6 * np.linalg.norm(other)
        if wave % 4:
            assert max(left) > 0.1 * np.linalg.norm(other)
            senses.add(int(np.argmin(left)))
    assert len(senses) == 1
