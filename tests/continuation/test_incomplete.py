"""Curves that do not reach their end: one warning per call, or SolveError where it is asked for."""

import warnings
from concurrent.futures import ThreadPoolExecutor

import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from tests.problems import duffing, one_blade

LOADS = {"normal_load": [1, 3, 10]}
TOO_FEW = "the largest number of points was reached"


def with_warning(call):
    """The result of a call, and its one warning, which names the line of the caller."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = call()
    (warning,) = caught
    assert warning.category is RuntimeWarning
    assert warning.filename == __file__
    return result, str(warning.message)


@pytest.mark.parametrize("parallel", [False, True])
def test_sweep_in_which_every_curve_fails_says_so_once(parallel):
    with ThreadPoolExecutor(2) as pool:
        executor = pool if parallel else None
        result, text = with_warning(
            lambda: sh.frf(fig03.problem(), (10, 30), over=LOADS, max_points=5, executor=executor)
        )
    assert text.startswith(f"3 of 3 curves are incomplete: {TOO_FEW}")
    assert "try max_points" in text
    assert result.n_peaks.sum() == 0


def test_some_curves_that_fail_are_counted_and_the_most_common_reason_told():
    """The response is unique in this band for a force of 0.01 N, not for the others."""
    forces = {"force_amplitude": [0.01, 0.15, 0.18, 0.2]}
    result, text = with_warning(lambda: sh.frf(duffing(), (0.08, 0.19), over=forces))
    assert text.startswith(f"3 of 4 curves are incomplete: {result.status[-1].item()}")
    assert result.status[0] == sh.Status.REACHED_END != result.status[1]
    # The longest path now ends for another reason than the other three.
    most = int(result.n_points[0] + result.n_points[1]) // 2
    cut, text = with_warning(lambda: sh.frf(duffing(), (0.08, 0.19), over=forces, max_points=most))
    assert TOO_FEW in cut.status[0].item()
    assert text.startswith(f"4 of 4 curves are incomplete, 3 of them: {result.status[-1].item()}")
    with pytest.raises(sh.SolveError, match="4 of 4 curves are incomplete, 3 of them") as raised:
        sh.frf(duffing(), (0.08, 0.19), over=forces, max_points=most, throw=True)
    assert str(raised.value) == text
    assert raised.value.result.identical(cut)


def test_archives_say_so_whenever_they_are_returned(tmp_path):
    path = tmp_path / "few.nc"
    options = dict(over=LOADS, max_points=5, archive=path)
    for call in (
        lambda: sh.frf(fig03.problem(), (10, 30), **options),
        lambda: sh.frf(fig03.problem(), (10, 30), **options),  # finished: opened, not computed
        lambda: sh.resume(path),
    ):
        result, text = with_warning(call)
        result.close()
        assert text.startswith(f"3 of 3 curves are incomplete: {TOO_FEW}")


FREE = sh.HarmonicBalance(one_blade(damping=-0.5))
AIMS = {"peak": lambda peaks, _: peaks["largest"], "load": lambda _, given: given["normal_load"][0]}
SEARCH = fig03.problem(), "normal_load", (1.0, 9.0), (5, 40)
VERBS = {
    "frf": lambda **run: sh.frf(fig03.problem(), (10, 30), **run),
    "follow": lambda **run: sh.follow(*SEARCH[:3], frequency=19, **run),
    "peak_curve": lambda **run: sh.peak_curve(*SEARCH[:3], frequency_band=(5, 40), **run),
    "minimise_peak": lambda **run: sh.minimise_peak(*SEARCH, **run),
    "pareto_front": lambda **run: sh.pareto_front(*SEARCH, aims=AIMS, **run),
    "limit_cycles": lambda **run: sh.limit_cycles(FREE, **run),
    "nonlinear_modes": lambda **run: sh.nonlinear_modes(FREE, **run),
}


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize(
    ("given", "words"),
    [
        (dict(throw="no"), "throw='no': expected True or False"),
        (dict(progress=3), "progress=3: expected True or False"),
        (dict(executor=4), "executor=4: expected a concurrent.futures.Executor"),
    ],
)
def test_bad_running_options_are_refused(verb, given, words):
    with pytest.raises(TypeError, match=words):
        VERBS[verb](**given)
