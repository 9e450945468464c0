"""Cost beside the path: compilations, evaluations, messages to workers and commits."""

import threading
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.balance import harmonic_balance
from symhbm.balance.equations import Equations
from symhbm.continuation.correctors import corrector_of, programs
from symhbm.continuation.following import solution_beside
from symhbm.continuation.problem import FrequencyProblem
from symhbm.continuation.start import solve_point
from symhbm.numerics import c_library
from symhbm.numerics.check import RADIANS
from symhbm.response import curve, ensemble
from symhbm.response import describe as point
from symhbm.response.describe import describe, describe_each
from symhbm.results import tables
from symhbm.results.archive.working_files import Store
from tests.problems import BLADE
from tests.quick import quick_first

BAND = (18.0, 21.0)
LOADS = np.linspace(1, 4, 12)


def blade(harmonics=(1,)):
    return sh.HarmonicBalance(sh.single_blade(**BLADE), sh.forces.PointForce(), harmonics)


def disk(harmonics=(1,)):
    return sh.HarmonicBalance(sh.bladed_disk(5, **BLADE), sh.forces.EngineOrder(1), harmonics)


@pytest.fixture
def compiled(monkeypatch):
    """A list of what is compiled from now on."""
    made = []

    class Counted(Equations):
        def __init__(self, model, basis, groups, symmetry=None, powers=(0,)):
            names = tuple(group.name for group in groups)
            made.append((basis.harmonics, names, symmetry is not None))
            super().__init__(model, basis, groups, symmetry, powers)

    monkeypatch.setattr(harmonic_balance, "Equations", Counted)
    return made


def test_a_sector_is_compiled_once_for_all_copies(compiled):
    problem = disk()
    first = sh.frf(problem, BAND, progress=False)
    assert compiled == [((1,), ("friction",), False), ((1,), ("friction",), True)]
    assert int(first.n_sectors) == 5
    xr.testing.assert_identical(sh.frf(problem, BAND, progress=False), first)
    sh.frf(problem, BAND, over={"normal_load": [1.0, 2.0]}, progress=False)
    sh.frf(problem.with_parameters(mass=1.1), BAND, progress=False)
    assert len(compiled) == 2
    # Another travelling wave is another sector.
    sh.frf(problem.with_parameters(engine_order=2), BAND, progress=False)
    assert len(compiled) == 3


def test_sets_of_harmonics_are_compiled_once_for_all_copies(compiled):
    problem = blade()
    first = sh.frf(problem, BAND, accuracy=1e-2, progress=False)
    before = len(compiled)
    assert before > 1
    xr.testing.assert_identical(sh.frf(problem, BAND, accuracy=1e-2, progress=False), first)
    assert len(compiled) == before
    sh.frf(problem.with_parameters(normal_load=2.9), BAND, accuracy=1e-2, progress=False)
    assert len(compiled) == len(set(compiled))


def test_each_stored_point_is_evaluated_once(monkeypatch):
    """With its contacts free, whatever states the path held."""
    evaluated, check = [], point.check_each

    def counted(problems, unknowns, frequencies, *options):
        evaluated.extend(frequencies)
        return check(problems, unknowns, frequencies, *options)

    monkeypatch.setattr(point, "check_each", counted)
    for problem in (blade(), blade((1, 3)), disk()):
        evaluated.clear()
        curve = sh.frf(problem, BAND, progress=False)
        np.testing.assert_array_equal(np.array(evaluated) / RADIANS, curve.frequency)
        assert curve.converged.all()


@pytest.mark.parametrize(("harmonics", "samples"), [((1,), None), ((0, 1, 2), None), ((1, 3), 64)])
def test_points_at_once_are_points_alone(harmonics, samples):
    """Also of problems whose values differ, and where some are no solutions."""
    base = sh.HarmonicBalance(
        sh.bladed_disk(3, **BLADE), sh.forces.PointForce(), harmonics, samples=samples
    )
    problems = [base.with_parameters(normal_load=load) for load in (0.5, 1, 2, 500)]
    hz = np.array([18.0, 19.0, 20.0, 21.0])
    located = base if samples is None else base.located()
    solutions = [
        sh.solve(located.with_parameters(normal_load=problem.parameters["normal_load"]), f)
        for problem, f in zip(problems, hz, strict=True)
    ]
    coefficients = np.array([point.coefficient.values for point in solutions])
    order, sine = base.basis.order, base.basis.is_sine
    at = np.searchsorted(harmonics, order), sine.astype(int)
    unknowns = coefficients[:, :, *at].reshape(len(hz), -1)
    unknowns[1] *= 1.1
    together = describe_each(problems, unknowns, hz, [1, 2, 3, 4], stability=samples is None)
    for i, problem in enumerate(problems):
        alone = describe(problem, unknowns[i], hz[i], i + 1, stability=samples is None)
        assert together.keys() == alone.keys()
        for name, value in alone.items():
            # Round-off of sums in another order; the residual is nothing else.
            tolerance: dict[str, Any] = dict(atol=1e-14) if "norm" in name else dict(rtol=1e-9)
            np.testing.assert_allclose(together[name][i], value, **tolerance, err_msg=name)
    assert not together["converged"][1]
    assert np.isnan(together["amplitude"][1]).all()
    if samples is None:
        assert together["converged"].tolist() == [True, False, True, True]


@pytest.fixture
def quick(monkeypatch):
    """Sets that take no time: each curve is that of the first."""
    compute, curves = ensemble.compute_curve, []

    def same(problem, task):
        if not curves:
            curves.append(compute(problem, task))
        return curves[0]

    monkeypatch.setattr(ensemble, "compute_curve", same)


class _Watched(ThreadPoolExecutor):
    """An executor that knows what it was given, and how much of it was not finished, at most."""

    def __init__(self, workers):
        super().__init__(workers)
        self.pieces, self.sent, self.done, self.most = [], [], [], 0

    def submit(self, fn, /, *args, **kwargs):
        _, payload, chosen, _ = args
        self.pieces.append(len(chosen))
        self.sent.append(0 if payload is None else len(payload))
        self.most = max(self.most, len(self.pieces) - len(self.done))
        future = super().submit(fn, *args, **kwargs)
        future.add_done_callback(self.done.append)
        return future


def call(problem, loads: Any = LOADS, **options):
    return sh.frf(problem, BAND, over={"normal_load": loads}, progress=False, **options)


@pytest.mark.parametrize("seconds", quick_first([0.0, 1e9], 1))
def test_the_size_of_pieces_changes_nothing(seconds, monkeypatch, tmp_path):
    expected = call(blade())
    monkeypatch.setattr(ensemble, "_PIECE", seconds)
    xr.testing.assert_identical(call(blade()), expected)
    with _Watched(2) as executor:
        xr.testing.assert_identical(call(blade(), executor=executor), expected)
        with call(blade(), executor=executor, archive=tmp_path / "x.nc") as archive:
            xr.testing.assert_identical(archive, expected)
    if not seconds:
        assert set(executor.pieces) == {1}


@pytest.mark.usefixtures("quick")
def test_short_sets_are_sent_together():
    with _Watched(2) as executor:
        call(blade(), np.linspace(1, 2, 2000), executor=executor)
    assert sum(executor.pieces) >= 2000
    assert max(executor.pieces) <= ensemble._MOST
    # Up to 100 each while there are many, fewer at the end so that all workers end together.
    assert len(executor.pieces) < 500
    assert executor.most <= 2 * (1 + ensemble._WAITING)  # few of them wait


def test_sets_that_take_longer_are_sent_again(monkeypatch):
    """Pieces of five, with time for one."""
    expected = call(blade())
    monkeypatch.setattr(ensemble, "_PIECE", 0.0)
    monkeypatch.setattr(ensemble._Shared, "_size", lambda self, _: min(5, len(self._waiting)))
    with _Watched(1) as executor:
        xr.testing.assert_identical(call(blade(), executor=executor), expected)
    assert len(executor.pieces) == len(LOADS)
    assert sum(executor.pieces) > 2 * len(LOADS)


@pytest.mark.usefixtures("quick")
def test_a_large_problem_is_sent_to_those_that_do_not_know_it(monkeypatch):
    monkeypatch.setattr(ensemble, "_PIECE", 0.0)
    monkeypatch.setattr(ensemble, "_SMALL", 0)
    with _Watched(2) as executor:
        call(blade(), np.linspace(1, 2, 60), executor=executor)
    sent = [n for n in executor.sent if n]
    # Once per worker, and for the pieces that waited meanwhile at a worker that did not know it.
    assert len(sent) <= 2 + 2 * (1 + ensemble._WAITING) < 60


def test_a_worker_asks_for_a_problem_that_it_does_not_know():
    outcomes = []

    def ask():
        outcomes.append(ensemble._work("a problem of nobody", None, [{}], "a call"))

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    assert outcomes == [None]


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(("seconds", "commits"), [(0.0, 50), (1e9, 1)])
def test_short_sets_are_written_together(seconds, commits, monkeypatch, tmp_path):
    written, add = [], Store.add

    def counted(self, encoded):
        written.append(len(encoded))
        add(self, encoded)

    monkeypatch.setattr(Store, "add", counted)
    monkeypatch.setattr(ensemble, "_PIECE", seconds)
    call(blade(), np.linspace(1, 2, 50), archive=tmp_path / "x.nc").close()
    assert sum(written) == 50
    assert len([n for n in written if n]) == commits


def test_a_failed_set_has_the_kept_variables(monkeypatch):
    compute = ensemble.compute_curve

    def failing(problem, task):
        if problem.parameters["normal_load"][0] == 2.0:
            raise ArithmeticError("no number")
        return compute(problem, task)

    monkeypatch.setattr(ensemble, "compute_curve", failing)
    with pytest.warns(RuntimeWarning, match="1 of 2 curves are incomplete: .*ArithmeticError"):
        curves = call(blade(), [1.0, 2.0], keep=["peak_amplitude"])
    assert "ArithmeticError" in str(curves.status.values[1])
    assert np.isfinite(curves.peak_amplitude[0]).all()
    assert curves.peak_amplitude[1].isnull().all()
    assert "amplitude" not in curves


def test_spooled_results_do_not_stay_in_memory(monkeypatch):
    """Beside what they become: 20 MB of them in one."""
    monkeypatch.setattr(tables, "_MEMORY", 2**20)
    row = np.arange(1250.0)
    tracemalloc.start()
    with tables.Spool() as kept:
        for number in reversed(range(2000)):
            kept.add([(number, tables.encode({"value": number + row}))])
        waiting = tracemalloc.get_traced_memory()[1]
        stacked = kept.stacked()["value"]
        largest = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    np.testing.assert_array_equal(stacked, np.arange(2000)[:, None] + row)
    # Once its place in memory is full, a spool moves to a file: both are there for a moment.
    assert waiting < 4e6
    assert largest < 1.2 * stacked.nbytes


@pytest.mark.slow
@pytest.mark.skipif(c_library.compiler() is None, reason="no compiler of C")
def test_checks_of_a_large_sweep_are_machine_code(tmp_path, monkeypatch):
    """To the same bits, and not where corrections are none."""
    folder = tmp_path / "cache"
    monkeypatch.setenv(c_library.CACHE, str(folder))
    monkeypatch.setattr(programs, "_OFTEN", 3)
    monkeypatch.setattr(curve, "_MANY", 4)
    programs._programs.cache_clear()
    loads = np.linspace(1, 4, 4)
    plain = [call(blade(), [load]) for load in loads]
    assert not folder.exists() or not [*folder.glob("*.so")]
    call(blade(), loads[:3])
    assert len([*folder.glob("*.so")]) == 1
    several = call(blade(), loads)
    assert len([*folder.glob("*.so")]) == 2
    assert several.attrs["equations_evaluated_by"] == "machine code"
    programs._programs.cache_clear()
    for i, alone in enumerate(plain):
        assert alone.attrs["equations_evaluated_by"] != "machine code"
        n = int(alone.n_points.item())
        for name in ("residual_norm", "amplitude", "theta_star", "dissipation", "contact_state"):
            np.testing.assert_array_equal(several[name].values[i][:n], alone[name].values[0])


def test_copies_do_not_see_each_others_springs():
    problem = blade()
    sprung = problem.with_parameters(cubic_stiffness=1e6)
    assert sprung.residual.n_in() == problem.residual.n_in() + 1
    problem.derivative("cubic_stiffness")
    assert problem.residual.n_in() == sprung.residual.n_in()
    assert blade().residual.n_in() == sprung.residual.n_in() - 1


def test_points_between_others_are_found_in_few_solves():
    """On a path that bends sharply over the frequency: 152 solves, most of which found nothing."""
    ring = sh.bladed_disk(13, **BLADE | dict(contact_stiffness=1e6, normal_load=10.0))
    response = sh.frf(sh.HarmonicBalance(ring, sh.forces.EngineOrder(3)), (150, 280))
    assert response.n_points.item() > 24
    assert response.linear_solves.item() <= 120


def test_a_search_beside_an_end_takes_few_solves():
    """From two starts; the contact opens, so that there might be another response."""
    gap = sh.Gap(normal=[(0,)], normal_stiffness=1e4, gap=1e-3)
    model = sh.Model(np.eye(1), 5 * np.eye(1), 1e4 * np.eye(1), contacts={"stop": gap})
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=20.0), (0, 1, 2))
    corrector = corrector_of(FrequencyProblem(problem))
    known = solve_point(problem, 10 * RADIANS).unknowns
    assert solution_beside(corrector, 10 * RADIANS, [known]) is None
    assert 0 < corrector.solves <= 80


def test_points_are_corrected_where_their_contacts_were_held_alone():
    """What does not solve the equations is told everywhere else."""
    problem = blade()
    exact = sh.solve(problem, 20.0)
    unknowns = exact.coefficient.values.reshape(1, -1) * (1 + 1e-9)
    arguments = [problem], unknowns, np.array([20.0]), [0]
    off = describe_each(*arguments)
    assert not off["converged"].any()
    held = describe_each(*arguments, held=np.array([True]))
    assert held["converged"].all()
    np.testing.assert_allclose(held["coefficient"][0], exact.coefficient, rtol=1e-11)
    far = [problem], 1.01 * unknowns, np.array([20.0]), [0]
    assert not describe_each(*far, held=np.array([True]))["converged"].any()
