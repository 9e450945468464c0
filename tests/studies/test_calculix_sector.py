"""The study of a sector of CalculiX, from the files that are kept."""

import numpy as np
import pytest
from calculix import mesh

import symhbm as sh
from studies import calculix_sector as study
from studies.landmark import unmet


@pytest.fixture(scope="module")
def known():
    return study.case()


def test_frequencies_are_those_that_calculix_prints(known):
    for wave in (0, 4):
        found = sh.natural_modes(known.disk.at(0), nodal_diameter=wave, count=2).frequency
        np.testing.assert_allclose(found, known.modes[wave], rtol=study.PRINTED)


def test_loads_of_the_shroud_are_pressures_times_areas(known):
    """By the diagonals of the plane face, in the place of shape functions."""
    coordinates, sets = mesh(study.SMALL)
    nodes = sets["SHROUD_ARM"]
    x, y, z = coordinates[nodes - 1].T
    radius = np.hypot(x, y)
    low, high = np.isclose(z, z.min()), np.isclose(z, z.max())
    inner, outer = np.isclose(radius, radius.min()), np.isclose(radius, radius.max())
    corners = [
        coordinates[nodes[e & r] - 1][0]
        for e, r in zip((low, low, high, high), (inner, outer, outer, inner), strict=True)
    ]
    area = np.linalg.norm(np.cross(corners[2] - corners[0], corners[3] - corners[1])) / 2
    load = np.sum(
        known.disk.at(study.SPEED).with_contacts(s=study.shroud(known)).parameters["normal_load"]
    )
    pressure = [known.pressure[node] for node in nodes.tolist()]
    assert min(pressure) > 0
    assert min(pressure) * area < load < max(pressure) * area


def test_a_wedge_touches_both_ends_of_neighbouring_platforms(known):
    contacts = study.wedge(known)
    disk = known.disk.at(study.SPEED).with_contacts(wedge=contacts)
    assert disk.n_contacts == 2
    stuck = sh.natural_modes(disk, study.ORDER, count=1, stuck=True).frequency.item()
    slides = sh.natural_modes(disk, study.ORDER, count=1).frequency.item()
    assert 1.005 * slides < stuck < 1.1 * slides


def test_a_motion_is_written_on_the_mesh(known, tmp_path):
    meshio = pytest.importorskip("meshio")
    contacts = {"wedge": study.wedge(known)}
    problem = study.condensed(known, contacts, (500.0, 560.0))
    point = sh.solve(problem.with_parameters(normal_load=300.0), 529.8, throw=True)
    held = meshio.read(study.written(tmp_path / "peak.vtu", known, problem, point))
    [tip] = known.disk.structure.places.mesh.sets["TIP"].tolist()
    real, imaginary = (held.point_data[part][tip - 1, 1] for part in ("real", "imaginary"))
    first = point.coefficient.values[-1, 1]
    np.testing.assert_allclose([real, -imaginary], first, rtol=1e-9)
    assert np.isfinite(held.point_data["state"]).sum() == 2
    assert [block.type for block in held.cells] == ["hexahedron20"]


@pytest.mark.slow
def test_landmarks_can_be_missed(monkeypatch, known):
    monkeypatch.setattr(study, "MASSES", study.MASSES[[0, 3, 4]])
    monkeypatch.setattr(study, "N_SAMPLES", 1)
    dataset = study.compute(progress=False, known=known)
    assert unmet(study.landmarks(dataset)) == []
    other = dataset.assign(frequency=dataset.frequency * (1 + 2e-6))
    assert len(unmet(study.landmarks(other))) == 1
    assert dataset.best_amplitude < 0.3 * dataset.wedge_peak[0]
