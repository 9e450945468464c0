"""Archives that outlive their process: no set is lost, computed twice, or differs from memory."""

import json
import os
import shutil
import subprocess
import sys
import textwrap
from functools import cache
from pathlib import Path

import pytest
import xarray as xr

import symhbm as sh
from symhbm.continuation.correctors import programs
from symhbm.numerics.c_library import COMPILER
from symhbm.response import ensemble
from symhbm.results.archive import from_working_file
from symhbm.results.archive.working_files import Store, working_file
from tests.archives import counted, interrupt
from tests.problems import BLADE as VALUES
from tests.problems import duffing
from tests.quick import quick_first

BLADE = sh.HarmonicBalance(sh.single_blade(**VALUES), sh.forces.PointForce(), harmonics=(1,))
DUFFING = duffing()
LOADS = [0.5, 1.0, 3.0, 500.0]
BAND, GRID = (18.0, 21.0), [18.5, 19.0, 20.0]
SAMPLES = {
    name: xr.DataArray(
        [[2.0], [4.0], [6.0]],
        dims=("sample", dim),
        coords={"sample": ["a", "b", "c"], "seed": ("sample", [7, 8, 9])},
    )
    for name, dim in (("normal_load", "contact"), ("damping", "dof"))
}
DAMPINGS = [0.5, 0.7, 0.9]

CALLS = {
    "path": (sh.frf, (BLADE, BAND), dict(over={"normal_load": LOADS})),
    "grid": (sh.frf, (BLADE, BAND), dict(at=GRID, over={"normal_load": LOADS})),
    "one curve": (sh.frf, (BLADE, BAND), {}),
    "samples": (sh.frf, (BLADE, BAND), dict(over=SAMPLES)),
    "product": (sh.frf, (BLADE, BAND), dict(over={"normal_load": LOADS, "damping": DAMPINGS})),
    "no peaks": (sh.frf, (BLADE, (5.0, 6.0)), dict(over={"normal_load": [500.0, 600.0]})),
    "accuracy": (sh.frf, (BLADE, BAND), dict(over={"normal_load": LOADS}, accuracy=0.02)),
    "folds": (
        sh.frf,
        (DUFFING, (0.32, 0.08)),
        dict(at=[0.15, 0.19, 0.21], over={"force_amplitude": [0.01, 0.18]}),
    ),
    "follow": (
        sh.follow,
        (BLADE, "normal_load", (0.5, 100)),
        dict(frequency=19.5, over={"damping": DAMPINGS}),
    ),
    "follow a grid": (
        sh.follow,
        (BLADE, "normal_load", (0.5, 100)),
        dict(frequency=19.5, at=[1.0, 3.0], over={"damping": DAMPINGS}),
    ),
    "kept": (
        sh.frf,
        (BLADE, BAND),
        dict(
            over={"normal_load": LOADS}, keep=["event_kind", "amplitude", "peak_frequency"], at=GRID
        ),
    ),
}


def call(name, **options):
    verb, arguments, given = CALLS[name]
    return verb(*arguments, **given | {"progress": False} | options)


@cache
def in_memory(name):
    return call(name)


@pytest.fixture(autouse=True)
def _one_evaluator():
    """Results tell what evaluates the equations: the same throughout, however many curves."""
    programs._programs.cache_clear()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(COMPILER, "")
        yield


@pytest.fixture
def interrupted(tmp_path):
    """Archive of a call of four sets of which two are finished."""
    interrupt(2, call, "path", archive=tmp_path / "x.nc")
    assert sorted(os.listdir(tmp_path)) == ["x.nc.partial", "x.nc.partial-journal"]
    return tmp_path / "x.nc"


def assert_archive_of(name, path):
    """The archive is what the call gives in memory, saved, and nothing lies beside it."""
    saved = sh.load(sh.save(in_memory(name), path.with_name("memory.nc")))
    path.with_name("memory.nc").unlink()
    assert os.listdir(path.parent) == [path.name]
    loaded = sh.load(path)
    xr.testing.assert_identical(loaded, saved)
    xr.testing.assert_identical(loaded, in_memory(name))
    for variable in saved.variables:
        assert loaded[variable].dtype == saved[variable].dtype, variable


@pytest.mark.parametrize("name", quick_first(CALLS, 2))
def test_an_interrupted_archive_goes_on(name, tmp_path, monkeypatch):
    """From the file alone it ends as what is computed in memory, and nothing is computed twice."""
    path, size = tmp_path / "x.nc", in_memory(name).status.size
    interrupt(size // 2, call, name, archive=path)
    made = counted(monkeypatch)
    with sh.resume(path, progress=False) as result:
        xr.testing.assert_identical(result, in_memory(name))
    assert len(made) == size - size // 2
    assert_archive_of(name, path)
    for again in (lambda: sh.resume(path, progress=False), lambda: call(name, archive=path)):
        again().close()
        assert len(made) == size - size // 2


@pytest.mark.parametrize("slab", [1, 50_000])
def test_slabs_change_nothing(slab, tmp_path, monkeypatch):
    """Written set by set, a few at a time, and several dampings at a time."""
    monkeypatch.setattr(from_working_file, "_SLAB", slab)
    call("product", archive=tmp_path / "x.nc").close()
    assert_archive_of("product", tmp_path / "x.nc")


def test_what_is_finished_can_be_read(interrupted):
    part = sh.load(f"{interrupted}.partial")
    assert part.status.values.tolist() == [
        "the end of the band was reached",
        "the end of the band was reached",
        *[str(sh.Status.NOT_STARTED)] * 2,
    ]
    done = part.isel(normal_load=slice(2))
    first = {axis: slice(done.sizes[axis]) for axis in ("point", "peak", "event", "normal_load")}
    xr.testing.assert_identical(done, in_memory("path").isel(first))
    rest = part.isel(normal_load=slice(2, None))
    assert not rest.converged.any()
    assert not rest.n_points.any()
    assert rest.amplitude.isnull().all()
    assert rest.frequency.isnull().all()
    sh.save(part, interrupted.with_name("part.nc"))
    sh.plot.response(done)


def test_the_same_call_goes_on(interrupted, monkeypatch):
    made = counted(monkeypatch)
    call("path", archive=interrupted).close()
    assert [problem.parameters["normal_load"] for problem in made] == LOADS[2:]
    assert_archive_of("path", interrupted)


def test_an_unfinished_archive_is_reported(interrupted):
    with pytest.raises(FileNotFoundError, match=r"2 of its 4 .*symhbm\.resume.*symhbm\.load"):
        sh.load(interrupted)


OTHERS = {
    "normal_load": dict(over={"normal_load": [0.5, 1.0, 3.0, 501.0]}),
    "swept": dict(over={"damping": LOADS}),
    "mass": dict(problem=BLADE.with_parameters(mass=1.1)),
    "harmonics": dict(problem=sh.HarmonicBalance(BLADE.model, BLADE.excitation, (1, 3))),
    "samples": dict(problem=sh.HarmonicBalance(BLADE.model, BLADE.excitation, (1,), 64)),
    "excitation": dict(problem=sh.HarmonicBalance(BLADE.model, sh.forces.PointForce(phase=0.1))),
    "band": dict(band=(15.0, 26.0)),
    "frequency": dict(at=GRID),
    "accuracy": dict(accuracy=0.02),
    "peaks": dict(peaks="each"),
    "stability": dict(stability=True),
    "keep": dict(keep=["amplitude"]),
    "max_points": dict(max_points=4999),
}


@pytest.mark.slow
@pytest.mark.parametrize("finished", [False, True])
def test_an_archive_of_another_computation_is_refused(interrupted, finished, monkeypatch):
    if finished:
        call("path", archive=interrupted).close()
    made = counted(monkeypatch)
    for part, change in OTHERS.items():
        given = dict(problem=BLADE, band=BAND, over={"normal_load": LOADS}, progress=False)
        with pytest.raises(sh.datasets.ArchiveError, match=rf"different in [^;]*\b{part}\b"):
            sh.frf(**given | change, archive=interrupted)
    assert not made
    call("path", archive=interrupted).close()
    assert_archive_of("path", interrupted)


@pytest.mark.parametrize("again", [sh.resume, lambda path: call("path", archive=path)])
def test_killed_before_the_last_step(again, tmp_path, monkeypatch):
    """The archive is there, and so is its working file."""
    path, remove = tmp_path / "x.nc", Store.remove
    monkeypatch.setattr(Store, "remove", Store.close)
    call("path", archive=path).close()
    assert len(os.listdir(tmp_path)) == 3
    monkeypatch.setattr(Store, "remove", remove)
    made = counted(monkeypatch)
    again(path).close()
    assert not made
    assert_archive_of("path", path)


def test_any_other_file_is_refused(tmp_path):
    path = tmp_path / "x.nc"
    path.write_text("no archive")
    with pytest.raises(sh.datasets.ArchiveError, match="no NetCDF file"):
        call("path", archive=path)
    sh.save(sh.solve(BLADE, 20.0), path, overwrite=True)
    with pytest.raises(sh.datasets.ArchiveError, match="another computation"):
        call("path", archive=path)
    path.unlink()
    working_file(path).write_text("no database, and longer than its header" * 100)
    for use in (sh.load, sh.resume):
        with pytest.raises(sh.datasets.ArchiveError, match="damaged"):
            use(path if use is sh.resume else working_file(path))
    with pytest.raises(sh.datasets.ArchiveError, match="damaged"):
        call("path", archive=path)
    for bad in (tmp_path, tmp_path / "no" / "x.nc", f"{path}.partial"):
        with pytest.raises(sh.datasets.ArchiveError, match="archive="):
            call("path", archive=bad)
    with pytest.raises(TypeError, match="archive=3"):
        call("path", archive=3)
    with pytest.raises(FileNotFoundError):
        sh.resume(path.with_name("y.nc"))


def test_results_are_kept_in_any_order(tmp_path, monkeypatch):
    """The last set first."""
    path, compute = tmp_path / "x.nc", ensemble.compute

    def backwards(problem, sweep, *options):
        yield from reversed(list(compute(problem, sweep, *options)))

    monkeypatch.setattr(sys.modules["symhbm.response.run"], "compute", backwards)
    call("product", archive=path).close()
    assert_archive_of("product", path)


def test_kept_names_alone_are_stored(tmp_path):
    whole, kept = in_memory("grid"), in_memory("kept")
    names = {"amplitude", "peak_frequency", "event_kind", "status", "converged"}
    # What the peaks are verified by.
    names |= {"peak_amplitude", "peak_dof", "peak_coefficient"}
    names |= {"contact_model_valid", "residual_norm", "n_points", "n_peaks", "n_events"}
    names |= {"rejected_steps", "linear_solves", "n_sectors"}
    names |= {"problem_numbers"}
    parameters = set(BLADE.parameters) - {"normal_load"} | {"normal_load_nominal"}
    assert set(kept.data_vars) == names | parameters
    for name in kept.variables:
        xr.testing.assert_identical(kept[name], whole[name])
    assert "left_out" not in whole.attrs
    sh.save(kept, tmp_path / "kept.nc")
    xr.testing.assert_identical(sh.load(tmp_path / "kept.nc"), kept)
    sh.plot.response(kept)
    assert json.loads(sh.verify(kept, progress=False).attrs["verification"])["passed"]
    left = {*json.loads(kept.attrs["left_out"])}
    assert left == {*whole.data_vars} - {*kept.data_vars} > {"coefficient", "event_frequency"}
    assert sh.datasets.rebuild(kept).harmonics == (1,)
    none = sh.frf(BLADE, BAND, at=GRID, keep=[], verifiable=False, progress=False)
    peaks = {name for name in names if name.startswith("peak_")}
    assert set(none.data_vars) == names - {"amplitude", "event_kind"} - peaks | set(
        BLADE.parameters
    )
    with pytest.raises(TypeError, match="verifiable='no'"):
        sh.frf(BLADE, BAND, keep=[], verifiable="no")


def test_unknown_names_to_keep(tmp_path):
    with pytest.raises(KeyError, match=r"'amplitud' is no variable to keep; .*'amplitude'"):
        sh.frf(BLADE, BAND, keep=["amplitud"], archive=tmp_path / "x.nc")
    with pytest.raises(KeyError, match="stability"):
        sh.frf(BLADE, BAND, keep=["stability"])
    for bad in ("amplitude", 3, [3]):
        with pytest.raises(TypeError, match="keep="):
            sh.frf(BLADE, BAND, keep=bad)
    assert not os.listdir(tmp_path)


def test_an_incomplete_archive_can_be_raised(tmp_path):
    for _ in range(2):
        with pytest.raises(sh.SolveError, match="4 of 4 curves") as caught:
            call("path", archive=tmp_path / "x.nc", max_points=3, throw=True)
        with caught.value.result as result:
            assert result.sizes["normal_load"] == 4


def test_lazy_datasets_are_read_where_they_are_asked(tmp_path):
    path = sh.save(in_memory("samples"), tmp_path / "x.nc")
    with sh.load(path, lazy=True) as lazy:
        assert lazy.amplitude.isel(sample=0).shape
        assert not lazy.amplitude.variable._in_memory
    with pytest.raises(TypeError, match="lazy="):
        sh.load(path, lazy="yes")


def test_one_process_writes_an_archive(tmp_path, monkeypatch):
    """A second call is refused at once, in this process and in another, and told by whom."""
    path, compute = tmp_path / "x.nc", ensemble.compute_curve
    code = "import sys, symhbm as sh; sh.resume(sys.argv[1])"
    told = []

    def busy(problem, task):
        if not told:
            told.append("")
            with pytest.raises(sh.datasets.ArchiveError, match="in use") as caught:
                call("path", archive=path)
            told[0] = str(caught.value)
            other = subprocess.run(
                [sys.executable, "-c", code, path], capture_output=True, text=True, check=False
            )
            told.append(other.stderr.splitlines()[-1])
            part = sh.load(f"{path}.partial")
            assert (part.status == str(sh.Status.NOT_STARTED)).all()
        return compute(problem, task)

    monkeypatch.setattr(ensemble, "compute_curve", busy)
    call("path", archive=path).close()
    assert len(told) == 2
    for message in told:
        assert f"in use by process {os.getpid()} on " in message
    assert_archive_of("path", path)


@pytest.mark.parametrize("removed", ["directory", "x.nc.partial"])
def test_removed_while_it_is_written(removed, tmp_path, monkeypatch):
    path, compute = tmp_path / "here" / "x.nc", ensemble.compute_curve
    path.parent.mkdir()

    def removing(problem, task):
        if float(problem.parameters["normal_load"][0]) == LOADS[2]:
            if removed == "directory":
                shutil.rmtree(path.parent)
            else:
                working_file(path).unlink()
        return compute(problem, task)

    monkeypatch.setattr(ensemble, "compute_curve", removing)
    with pytest.raises(sh.datasets.ArchiveError, match=f"{removed}.* was removed, and with it all"):
        call("path", archive=path)
    monkeypatch.undo()
    path.parent.mkdir(exist_ok=True)
    call("path", archive=path).close()
    assert_archive_of("path", path)


def test_removed_while_the_archive_is_written(tmp_path, monkeypatch):
    path, fill = tmp_path / "here" / "x.nc", from_working_file._fill
    path.parent.mkdir()

    def removing(*given):
        shutil.rmtree(path.parent)
        fill(*given)

    monkeypatch.setattr(from_working_file, "_fill", removing)
    with pytest.raises(
        sh.datasets.ArchiveError, match="directory was removed, and with it all results"
    ):
        call("path", archive=path)
    assert not os.listdir(tmp_path)


def test_a_full_disk_keeps_what_is_committed(tmp_path, monkeypatch):
    path, begin = tmp_path / "x.nc", Store.begin

    def small(self, *given):
        begin(self, *given)
        [[size]] = self._execute("PRAGMA page_count")
        self._execute(f"PRAGMA max_page_count={size + 2}").fetchall()

    monkeypatch.setattr(Store, "begin", small)
    monkeypatch.setattr(ensemble, "_PIECE", 0)
    with pytest.raises(
        sh.datasets.ArchiveError, match=r"full\); [1-3] of 4 parameter sets are safe"
    ):
        call("path", archive=path)
    n_safe = int((sh.load(f"{path}.partial").status != str(sh.Status.NOT_STARTED)).sum())
    monkeypatch.undo()
    made = counted(monkeypatch)
    call("path", archive=path).close()
    assert len(made) == 4 - n_safe < 4
    assert_archive_of("path", path)


def test_no_room_for_the_archive(tmp_path, monkeypatch):
    """Files that may not grow, as on a full disk: every set stays safe until there is room."""
    resource = pytest.importorskip("resource")
    path, write = tmp_path / "x.nc", from_working_file.write
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)

    def limited(dataset, draft):
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
        write(dataset, draft)

    monkeypatch.setattr(from_working_file, "write", limited)
    text = r"bytes free\); 4 of 4 parameter sets are safe in 'x\.nc\.partial'"
    try:
        with pytest.raises(sh.datasets.ArchiveError, match=text):
            call("path", archive=path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    monkeypatch.undo()
    assert sorted(os.listdir(tmp_path)) == ["x.nc.partial", "x.nc.partial-journal"]
    sh.resume(path, progress=False).close()
    assert_archive_of("path", path)


KILLING = """
    import os, random, signal, sys
    from concurrent.futures import ProcessPoolExecutor
    import symhbm as sh
    import test_archive_streaming as own

    path, kills, workers = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    random.seed(kills)

    def run():
        if not workers:
            return own.call("product", archive=path)
        with ProcessPoolExecutor(workers) as pool:
            return own.call("product", archive=path, executor=pool)

    def counted(last, then):
        # Calls of functions of a run, of which the last one does something.
        count = 0
        def event(*_):
            nonlocal count
            count += 1
            if count == last:
                then()
        sys.setprofile(event)
        run().close()
        sys.setprofile(None)
        return count

    # How many calls a whole run makes.
    once, path = path, f"{path}-once"
    whole = counted(-1, None)
    os.unlink(path)
    path, groups = once, []
    while len(groups) < kills:
        # A tenth of a run: several kills before it is finished, and then from anew.
        last = random.randrange(1, whole // 5)
        told, tell = os.pipe()
        child = os.fork()
        if not child:
            os.setpgid(0, 0)
            counted(last, lambda: os.write(tell, b"."))
            os._exit(0)
        os.close(tell)
        os.read(told, 1)  # until the call is made, or the run is finished
        os.close(told)
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        if os.WIFSIGNALED(status):
            groups.append(child)
        elif os.path.exists(path):
            os.unlink(path)
    # Workers outlive the process that made them; they hold nothing.
    own.call("product", archive=path).close()
    for group in groups:
        try:
            os.killpg(group, signal.SIGKILL)
        except ProcessLookupError:
            pass
"""


@pytest.mark.parametrize("workers", [0, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kills", [3, pytest.param(20, marks=pytest.mark.slow)])
def test_killed_at_any_instant(kills, workers, tmp_path):
    path = tmp_path / "x.nc"
    subprocess.run(
        [sys.executable, "-c", textwrap.dedent(KILLING), path, str(kills), str(workers)],
        env=os.environ | {"PYTHONPATH": f"{Path(__file__).parent}:{Path(sh.__file__).parents[1]}"},
        check=True,
    )
    assert_archive_of("product", path)
