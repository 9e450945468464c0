"""Signals over time and files of test programs become measurements, and bad ones are refused."""

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import symhbm as sh
from tests.measurements import complex_responses
from tests.problems import one_blade

FREQUENCY = np.array([0.0, 10.0, 15.0])
VALUES = np.array([9.0, 1 - 2j, 3 - 4j])
FUNCTION: dict[str, Any] = dict(
    type=58, func_type=4, rsp_node=7, rsp_dir=1, ref_node=1, ref_dir=1, x=FREQUENCY, data=VALUES,
    ordinate_spec_data_type=12, ordinate_axis_units_lab="m/s^2",
    orddenom_spec_data_type=13, orddenom_axis_units_lab="N",
)  # fmt: skip
MILLIMETRES = dict(type=164, length=1000.0, force=1000.0)
"""Length in mm, force in mN."""
NO_LABELS = dict(ordinate_axis_units_lab="NONE", orddenom_axis_units_lab="NONE")


@pytest.fixture
def file(monkeypatch, tmp_path):
    """A function that makes a file of some data sets, as a stand-in for pyuff reads it."""

    def made(*sets):
        reader = SimpleNamespace(read_sets=lambda: [*sets])
        monkeypatch.setitem(sys.modules, "pyuff", SimpleNamespace(UFF=lambda path: reader))
        (tmp_path / "sweep.uff").touch()
        return tmp_path / "sweep.uff"

    return made


def complex_of(data):
    return data.measured_value.values[::2] + 1j * data.measured_value.values[1::2]


def test_frequency_responses_become_responses_to_the_force_of_the_test(file):
    backwards = FUNCTION | dict(rsp_node=8, rsp_dir=-2)
    path = file(FUNCTION, backwards, FUNCTION | dict(func_type=6))
    data = sh.datasets.measured_functions(path, force_amplitude=2.0, deviation=0.1)
    assert data.measured_place.values.tolist() == ["7:x"] * 4 + ["8:y"] * 4
    expected = 2 * VALUES[1:]  # nothing is said at 0 Hz
    np.testing.assert_allclose(complex_of(data), [*expected, *-expected])
    np.testing.assert_allclose(data.measured_frequency[::2], [10, 15, 10, 15])
    assert set(data.measured_quantity.values) == {"acceleration"}
    np.testing.assert_allclose(data.measured_at_force_amplitude, 2.0)
    one = sh.datasets.measured_functions(path, places={"8:y": 3}, force_amplitude=1.0)
    assert set(one.measured_place.values) == {"3"}


@pytest.mark.parametrize(
    ("change", "given", "factor"),
    [
        (dict(ordinate_axis_units_lab="g"), {}, 9.80665),
        (dict(ordinate_axis_units_lab="m/s2/N", orddenom_axis_units_lab=""), {}, 1.0),
        (NO_LABELS, {}, 1.0),  # mm/s2 over mN
        (NO_LABELS | dict(func_type=12), {}, 0.5e-3),  # no ratio: a force is not multiplied
        (dict(ordinate_spec_data_type=8, ordinate_axis_units_lab="mm"), {}, 1e-3),
        (dict(ordinate_axis_units_lab="strange"), dict(units="mm"), 1e-3),
    ],
)
def test_units_are_those_of_labels_or_of_the_file(file, change, given, factor):
    path = file(MILLIMETRES, FUNCTION | change)
    data = sh.datasets.measured_functions(path, force_amplitude=2.0, **given)
    np.testing.assert_allclose(complex_of(data), 2 * factor * VALUES[1:])


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        ([], "expected frequency responses or spectra"),
        ([FUNCTION | NO_LABELS], "does not tell them"),
        ([MILLIMETRES, FUNCTION | dict(ordinate_axis_units_lab="furlong")], "label 'furlong'"),
        ([FUNCTION | dict(orddenom_axis_units_lab="lbf")], "over forces in N"),
        ([FUNCTION | dict(orddenom_spec_data_type=12, orddenom_axis_units_lab="")], "the type 12"),
    ],
)
def test_files_that_tell_too_little_are_refused(file, sets, words):
    with pytest.raises(ValueError, match=words):
        sh.datasets.measured_functions(file(*sets), force_amplitude=1.0)


def test_ratios_need_a_force_and_paths_a_file(file):
    with pytest.raises(ValueError, match="force_amplitude"):
        sh.datasets.measured_functions(file(FUNCTION))
    with pytest.raises(ValueError, match="there is none"):
        sh.datasets.measured_functions("nowhere.uff")


def test_files_that_pyuff_wrote(tmp_path):
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "sweep.uff"
    labels = dict(
        binary=0, func_type=4, rsp_node=7, rsp_dir=1, ref_node=1, ref_dir=1, id1="NONE", id2="NONE",
        abscissa_spec_data_type=18, ordinate_spec_data_type=12, ordinate_axis_units_lab="m/s^2",
        orddenom_spec_data_type=13, orddenom_axis_units_lab="N",
        abscissa_spacing=0, ord_data_type=6, num_pts=3, x=FREQUENCY, data=VALUES,
    )  # fmt: skip
    pyuff.UFF(str(path)).write_sets(pyuff.prepare_58(**labels), mode="overwrite")
    data = sh.datasets.measured_functions(path, force_amplitude=2.0)
    np.testing.assert_allclose(complex_of(data), 2 * VALUES[1:])


def test_harmonics_of_a_signal_with_their_errors():
    """Uneven instants, a mean, and a fifth harmonic that is none of those asked for."""
    data: Any = None
    rng, errors = np.random.default_rng(0), []
    time = np.sort(rng.uniform(0, 0.4, 200))
    exact = {1: 2 - 1j, 3: 0.3 + 0.2j, 5: 0.5}
    clean = 0.7 + sum((a * np.exp(2j * np.pi * 20 * n * time)).real for n, a in exact.items())
    given: Any = dict(harmonics=(3, 1), units="mm", place="tip", force_amplitude=2.0)
    for _ in range(300):
        noisy = clean + 0.05 * rng.standard_normal(len(time))
        data = sh.datasets.measured_signal(time, noisy, 20.0, **given)
        true = 1e-3 * np.array([0.3, 0.2, 2, -1])
        errors.append((data.measured_value.values - true) / data.measured_deviation.values)
    assert data.measured_harmonic.values.tolist() == [3, 3, 1, 1]
    assert np.abs(np.mean(errors, axis=0)).max() < 4 / np.sqrt(300)
    assert np.abs(np.std(errors, axis=0) - 1).max() < 0.15


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (dict(time=np.linspace(0, 0.04, 50)), "a period of 0.05 s"),
        (dict(time=np.linspace(0, 0.2, 9)), "expected as many values"),
        (dict(time=np.arange(50) * 0.05), "instants that tell"),
        (dict(frequency=0.0), "frequency"),
        (dict(harmonics=(0,)), "harmonics"),
        (dict(highest=0), "highest"),
    ],
)
def test_bad_signals_are_refused(change, words):
    given: Any = dict(time=np.linspace(0, 0.2, 50), signal=np.ones(50), frequency=20.0) | change
    with pytest.raises(ValueError, match=words):
        sh.datasets.measured_signal(**given, units="m")


def test_signals_of_an_accelerometer_on_a_shaken_blade_tell_the_contact():
    """Base motion drives, a strain gauge and an accelerometer read: the true values to 1e-8."""
    true = {"normal_load": 3.0, "contact_stiffness": 1e4}
    shaken: Any = sh.forces.BaseMotion(displacement=2e-4, motion="absolute")

    def problem(**changes):
        model = one_blade(damping=2.0, **changes).with_outputs({"strain": [{0: 0.5}]}, "1")
        return sh.HarmonicBalance(model, shaken, (1, 3))

    data, time = [], np.linspace(0, 0.5, 400)
    for frequency in (15.0, 17.0, 19.0, 22.0):
        at = problem(), [problem().excitation.amplitude], [frequency]
        parts = {n: complex_responses(*at, harmonic=n).item() for n in (1, 3)}
        turn = 2 * np.pi * frequency
        moves = {n: part * np.exp(1j * n * turn * time) for n, part in parts.items()}
        acceleration = sum(-((n * turn) ** 2) * move.real for n, move in moves.items())
        strain = sum(0.5 * move.real for move in moves.values())
        for signal, given in (
            (acceleration, dict(units="m s-2")),
            (strain, dict(units="1", quantity="strain")),
        ):
            options: Any = given | dict(harmonics=(1, 3))
            data.append(sh.datasets.measured_signal(time, signal, frequency, **options))
    wrong = problem(normal_load=6.0, contact_stiffness=5e3)
    for one in data:  # what round-off leaves of exact signals tells no errors
        one["measured_deviation"] = 1e-6 + 0 * one.measured_deviation
    fit = sh.identify(wrong, data, [*true], profiles=False, progress=False)
    np.testing.assert_allclose(fit.estimate, [*true.values()], rtol=1e-8)
