"""Whoever computes an ensemble, every set comes back, the same to the bit."""

import os
import signal
import threading
import warnings
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext
from functools import cache
from multiprocessing import get_context

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.continuation.correctors import programs
from symhbm.numerics import c_library
from symhbm.response import ensemble
from symhbm.results.provenance import evaluated_by
from tests.problems import ring_of_blades
from tests.quick import quick_first

DISK = ring_of_blades(3)
RING = sh.HarmonicBalance(DISK, sh.forces.EngineOrder(1), harmonics=(1, 3))
BAND, GRID = (15.0, 24.0), [16.0, 18.0, 20.0, 22.0]
N_SETS = 9
LOADS = xr.DataArray(
    np.random.default_rng(5).uniform(2, 4, (N_SETS, 3)), dims=("sample", "contact")
)
FATAL = float(LOADS[4, 0])
MAIN = os.getpid()


def call(problem=RING, **options):
    return sh.frf(problem, BAND, at=GRID, over={"normal_load": LOADS}, progress=False, **options)


@cache
def expected():
    return call()


def processes(method):
    return ProcessPoolExecutor(2, mp_context=get_context(method))


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed", reason="the package distributed is absent")
    with (
        warnings.catch_warnings(),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.mark.parametrize("pool", ["threads", "fork", "cluster"])
def test_executors_change_nothing(pool, request, tmp_path):
    if pool == "cluster":
        opened = request.getfixturevalue("cluster").get_executor()
    else:
        opened = ThreadPoolExecutor(3) if pool == "threads" else processes("fork")
    with opened as executor:
        xr.testing.assert_identical(call(executor=executor), expected())
        with call(executor=executor, archive=tmp_path / "x.nc") as archive:
            xr.testing.assert_identical(archive, expected())


def fatal(problem):
    """Whether this is the set that kills its worker."""
    return float(problem.parameters["normal_load"][0]) == FATAL and os.getpid() != MAIN


def test_a_worker_that_dies_costs_only_time(monkeypatch, tmp_path):
    compute = ensemble.compute_curve

    def dying(problem, task):
        if fatal(problem):
            os.kill(os.getpid(), signal.SIGKILL)
        return compute(problem, task)

    monkeypatch.setattr(ensemble, "compute_curve", dying)
    with processes("fork") as executor:
        with pytest.warns(RuntimeWarning, match=r"a worker died .* in this process") as told:
            archive = call(executor=executor, archive=tmp_path / "x.nc")
        assert len(told) == 1
        with archive:
            xr.testing.assert_identical(archive, expected())
        # The pool is broken for good: nothing can be submitted any more.
        with pytest.warns(RuntimeWarning, match="a worker died"):
            xr.testing.assert_identical(call(executor=executor), expected())


def test_a_set_that_fails_is_recorded(monkeypatch):
    """The others go on, and nothing of it is taken for a number."""
    compute, right = ensemble.compute_curve, expected()
    errors = [ArithmeticError("no\n  number"), np.linalg.LinAlgError("Singular"), MemoryError()]

    def failing(problem, task):
        number = LOADS[:, 0].values.tolist().index(float(problem.parameters["normal_load"][0]))
        if number < len(errors):
            raise errors[number]
        return compute(problem, task)

    monkeypatch.setattr(ensemble, "compute_curve", failing)
    with pytest.warns(RuntimeWarning, match="3 of .* curves are incomplete"):
        alone = call()
    with (
        processes("fork") as executor,
        pytest.warns(RuntimeWarning, match="3 of .* curves are incomplete"),
    ):
        xr.testing.assert_identical(call(executor=executor), alone)
    failed, others = alone.isel(sample=slice(3)), alone.isel(sample=slice(3, None))
    begin = str(sh.Status.COMPUTATION_FAILED)
    assert failed.status.values.tolist() == [
        f"{begin} (ArithmeticError: no number)",
        f"{begin} (LinAlgError: Singular)",
        f"{begin} (MemoryError:)",
    ]
    assert not failed.converged.any()
    for name in ("amplitude", "coefficient", "residual_norm", "peak_amplitude", "stick_fraction"):
        assert failed[name].isnull().all(), name
    assert not failed.n_peaks.any()
    xr.testing.assert_identical(others, right.isel(sample=slice(3, None)))
    with pytest.raises(sh.SolveError, match="3 of 9 curves"):
        call(throw=True)
    with pytest.warns(RuntimeWarning, match="3 of 4 curves are incomplete, 1 of them"):
        path = sh.frf(RING, BAND, over={"normal_load": LOADS[:4]}, progress=False)
    assert path.frequency[:3].isnull().all()
    assert path.n_points.values[:3].tolist() == [0] * 3


def test_interrupts_are_not_recorded(monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(ensemble, "compute_curve", interrupted)
    with pytest.raises(KeyboardInterrupt):
        call()
    with ThreadPoolExecutor(1) as executor, pytest.raises(KeyboardInterrupt):
        call(executor=executor)


def test_an_executor_that_closes_on_the_way(monkeypatch):
    """What waits is cancelled."""
    compute, executor = ensemble.compute_curve, ThreadPoolExecutor(1)

    def closing(problem, task):
        executor.shutdown(wait=False, cancel_futures=True)
        return compute(problem, task)

    monkeypatch.setattr(ensemble, "compute_curve", closing)
    with pytest.warns(RuntimeWarning, match="in this process"):
        xr.testing.assert_identical(call(executor=executor), expected())


class _Unwilling(ThreadPoolExecutor):
    """An executor that loses every third task."""

    lost = 0

    def submit(self, fn, /, *args, **kwargs):
        self.lost += 1
        if self.lost % 3:
            return super().submit(fn, *args, **kwargs)
        future: Future = Future()
        future.set_exception(OSError("connection lost"))
        return future


def test_tasks_that_are_lost():
    with (
        _Unwilling(2) as executor,
        pytest.warns(RuntimeWarning, match="OSError connection lost") as told,
    ):
        xr.testing.assert_identical(call(executor=executor), expected())
    assert len(told) == 1


def test_a_problem_is_compiled_once_per_worker(monkeypatch):
    """Once by each thread, however many sets it computes."""
    made, loads = [], ensemble.pickle.loads

    def counting(payload):
        made.append(threading.get_ident())
        return loads(payload)

    monkeypatch.setattr(ensemble.pickle, "loads", counting)
    with ThreadPoolExecutor(2) as executor:
        call(executor=executor)
    assert len(made) == len(set(made)) <= 2


def make_fatal():
    """In a worker of a cluster: one set kills it."""
    compute = ensemble.compute_curve

    def dying(problem, task):
        if float(problem.parameters["normal_load"][0]) == FATAL:
            os.kill(os.getpid(), signal.SIGKILL)
        return compute(problem, task)

    ensemble.compute_curve = dying


@pytest.mark.slow
@pytest.mark.filterwarnings("default::ResourceWarning")
def test_a_cluster_that_loses_workers():
    """Its tasks are retried elsewhere; one that kills every worker is computed in this process."""
    distributed = pytest.importorskip("distributed", reason="the package distributed is absent")

    class Fatal(distributed.WorkerPlugin):
        def setup(self, worker):
            make_fatal()

    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster) as client,
        client.get_executor() as executor,
    ):
        client.run(make_fatal)
        # The workers that follow are not fatal.
        xr.testing.assert_identical(call(executor=executor), expected())
        client.register_plugin(Fatal())
        with pytest.warns(RuntimeWarning, match="KilledWorker"):
            xr.testing.assert_identical(call(executor=executor), expected())


def mistuned(harmonics):
    """Curves of mistuned rings, on whole paths."""

    def curves(executor, archive=None):
        problem = sh.HarmonicBalance(DISK, sh.forces.EngineOrder(1), harmonics)
        draws = sh.mistuning.uniform(
            problem, n_samples=6, seed=2, contact_stiffness=0.2, normal_load=0.3, mass=0.02
        )
        options = dict(executor=executor, archive=archive, progress=False)
        return sh.frf(problem, BAND, over=draws, **options)

    return curves


ENSEMBLES = {"one harmonic": mistuned((1,)), "several harmonics": mistuned((1, 3))}
BY, VIRTUAL = "equations_evaluated_by", "the virtual machine of CasADi"


@cache
def in_this_process(ensemble):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(c_library.COMPILER, "")
        programs._programs.cache_clear()
        return ENSEMBLES[ensemble](None)


@pytest.fixture
def often(monkeypatch, tmp_path):
    """Each structure becomes machine code at its first curve, as it does after many."""
    monkeypatch.setattr(programs, "_OFTEN", 1)
    monkeypatch.setenv(c_library.CACHE, str(tmp_path / "cache"))
    programs._programs.cache_clear()
    yield
    programs._programs.cache_clear()


@pytest.mark.parametrize("compiler", quick_first(["with", "without"], 1))
@pytest.mark.parametrize(
    "pool",
    [
        pytest.param(nullcontext, id="none"),
        pytest.param(lambda: ThreadPoolExecutor(3), id="threads"),
        pytest.param(lambda: processes("spawn"), id="processes", marks=pytest.mark.slow),
    ],
)
@pytest.mark.usefixtures("often")
def test_neither_executors_nor_machine_code_change_a_bit(pool, compiler, monkeypatch):
    if compiler == "without":
        monkeypatch.setenv(c_library.COMPILER, "")
    elif c_library.compiler() is None:
        pytest.skip("no compiler of C")
    expected = {name: in_this_process(name) for name in ENSEMBLES}
    programs._programs.cache_clear()
    with pool() as executor:
        for name, curves in ENSEMBLES.items():
            found = curves(executor)
            made = compiler == "with" and name == "one harmonic"
            assert found.attrs[BY] == ("machine code" if made else VIRTUAL)
            xr.testing.assert_identical(found.assign_attrs({BY: VIRTUAL}), expected[name])


def test_results_tell_of_workers_without_a_compiler():
    assert evaluated_by([0, 1, 0]) == {BY: f"machine code and {VIRTUAL}"}
