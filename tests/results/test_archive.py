"""Saved datasets come back equal, explain themselves, and rebuild their problem."""

import json
from functools import cache

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.results.problem import record_of
from tests.archives import three_rings, two_masses
from tests.problems import BLADE as VALUES

BLADE = sh.HarmonicBalance(sh.single_blade(**VALUES), sh.forces.PointForce(phase=0.2))
RING = sh.HarmonicBalance(sh.bladed_disk(3, **VALUES), sh.forces.EngineOrder(1), harmonics=(1, 3))
GENERAL = two_masses()

CASES = {
    "path": lambda: sh.frf(BLADE, (10, 30), over={"normal_load": [0.5, 3.0, 500.0]}),
    "grid": lambda: sh.frf(BLADE, (15, 25), at=np.linspace(15, 25, 11)),
    "ensemble": lambda: sh.frf(RING, (14, 24), over=three_rings()),
    "engine orders": lambda: sh.frf(RING, (14, 18), at=[15, 17], over={"engine_order": [0, 1, 4]}),
    "blades": lambda: sh.frf(
        sh.HarmonicBalance(RING.model, sh.forces.EngineOrder(1, places=(2, 0, 1))), (14, 16)
    ),
    "general": lambda: sh.frf(GENERAL, (0.3, 0.7), over={"force_amplitude": [1.0, 2.0]}),
    "point": lambda: sh.solve(RING, 17.0),
}
INNER = {"point", "frequency", "dof", "contact", "harmonic", "component", "peak", "event"}
every_case = pytest.mark.parametrize("case", CASES)


@cache
def dataset(case):
    return CASES[case]()


def swept_dims(ds):
    return [dim for dim in ds.status.dims if dim not in INNER]


def assert_same_problem(problem, other):
    (told, numbers), (expected, known) = record_of(problem), record_of(other)
    assert told == expected
    np.testing.assert_array_equal(numbers, known)
    assert problem.parameters.keys() == other.parameters.keys()
    for name, value in problem.parameters.items():
        np.testing.assert_array_equal(value, other.parameters[name])


def test_save_replaces_an_archive_if_asked_and_returns_its_path(tmp_path):
    path = tmp_path / "archive.nc"
    assert sh.save(dataset("path"), str(path)) == path
    with pytest.raises(
        FileExistsError, match=r"archive\.nc': there is such a file; overwrite=True"
    ):
        sh.save(dataset("point"), path)
    xr.testing.assert_identical(sh.load(path), dataset("path"))
    assert sh.save(dataset("point"), path, overwrite=True) == path
    xr.testing.assert_identical(sh.load(str(path)), dataset("point"))
    with pytest.raises(TypeError, match="overwrite='yes'"):
        sh.save(dataset("point"), path, overwrite="yes")


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("archive", "archive.nc"),
        ("load_0.5", "load_0.5.nc"),
        ("archive.nc", "archive.nc"),
        ("archive.cdf", "archive.cdf"),
        (".hidden", ".hidden.nc"),
    ],
)
def test_a_name_without_a_suffix(name, written, tmp_path):
    path = sh.save(dataset("point"), tmp_path / name)
    assert path == tmp_path / written
    assert [file.name for file in tmp_path.iterdir()] == [written]
    for path_name in (name, written):
        xr.testing.assert_identical(sh.load(tmp_path / path_name), dataset("point"))
    with pytest.raises(FileExistsError):
        sh.save(dataset("point"), tmp_path / name)


def test_a_working_file_is_not_written_over(tmp_path):
    with pytest.raises(
        sh.datasets.ArchiveError, match=r"'\.partial', the end of the name of a working"
    ):
        sh.save(dataset("point"), tmp_path / "archive.nc.partial", overwrite=True)


@every_case
def test_rebuilt_problem_is_the_original(tmp_path, case):
    originals = {"path": BLADE, "grid": BLADE, "general": GENERAL}
    original = originals.get(case, RING)
    if case == "blades":
        original = sh.HarmonicBalance(RING.model, sh.forces.EngineOrder(1, places=(2, 0, 1)))
    assert_same_problem(sh.datasets.rebuild(dataset(case)), original)
    path = sh.save(dataset(case), tmp_path / "archive.nc")
    assert_same_problem(sh.datasets.rebuild(sh.load(path)), original)


@pytest.mark.parametrize("case", ["path", "ensemble", "engine orders", "general"])
def test_rebuild_takes_the_values_that_were_selected(case):
    ds = dataset(case)
    (dim,) = swept_dims(ds)
    names = {"ensemble": ["normal_load", "stiffness"]}.get(case, [dim])
    for i in range(ds.sizes[dim]):
        chosen = ds.isel({dim: i})
        problem = sh.datasets.rebuild(chosen)
        for name in names:
            expected = np.broadcast_to(chosen[name].values, np.shape(problem.parameters[name]))
            np.testing.assert_array_equal(problem.parameters[name], expected)


@pytest.mark.parametrize("case", ["path", "ensemble", "general"])
def test_padding(tmp_path, case):
    ds = sh.load(sh.save(dataset(case), tmp_path / "archive.nc"))
    (swept,) = swept_dims(ds)
    padded = set()
    for axis in ("point", "peak", "event"):
        counts = ds[f"n_{axis}s"].values
        assert ds.sizes[axis] == counts.max()
        for name, variable in ds.variables.items():
            if axis not in variable.dims:
                continue
            kind = variable.dtype.kind
            for i, count in enumerate(counts):
                inside = variable.isel({swept: i, axis: slice(count)}).values
                beyond = variable.isel({swept: i, axis: slice(count, None)}).values
                padded |= {axis} if beyond.size else set()
                if kind == "f":
                    assert np.isnan(beyond).all(), name
                    # Contacts that stick have no onset, unbounded peaks no coefficients.
                    assert np.isfinite(inside).all() or name in ("theta_0", "theta_star"), name
                else:
                    fill = {"i": -1, "b": False, "O": ""}[kind]
                    assert (beyond == fill).all(), name
                if name in ("peak_kind", "event_kind"):
                    assert all(inside), name
                if name == "converged":
                    assert inside.all()
    assert padded


def test_archives_of_before_the_first_release_are_refused(tmp_path):
    """Their schema had other numbers, and one of them was 1 too."""
    curve = sh.frf(BLADE, (15, 17))
    description = json.loads(curve.attrs["problem"])
    del description["digest"]
    for old in (
        curve.assign_attrs(symhbm_schema=2),
        curve.assign_attrs(problem=json.dumps(description)),
    ):
        path = sh.save(old, tmp_path / "old.nc", overwrite=True)
        for call in (lambda: sh.load(path), lambda: sh.datasets.rebuild(old)):  # noqa: B023
            with pytest.raises(sh.datasets.ArchiveError, match="this version reads 1 alone"):
                call()
