"""Loads of contacts that grow with the square of the speed of rotation."""

import numpy as np
import pytest

import symhbm as sh

ORDER = 3
MATRICES = np.eye(2), np.diag([2.0, 3.0]), np.diag([1e4, 2.25e4])


def shroud(load: float = 1.0, **more: float) -> sh.Contacts:
    """A contact between both masses that varies, with or without a load by rotation."""
    return sh.Friction(
        tangential=(0,),
        normal=(1,),
        contact_stiffness=1e4,
        normal_stiffness=1e4,
        friction_coefficient=0.3,
        normal_load=load,
        **more,
    )


def slider(load: float = 1.0, **more: float) -> sh.Contacts:
    """A contact with a load that the motion leaves."""
    return sh.Friction(
        tangential=(0, 1), contact_stiffness=1e4, friction_coefficient=0.5, normal_load=load, **more
    )


def disc(load: float = 1.0, **more: float) -> sh.Contacts:
    """Planar friction under a load that the motion leaves."""
    return sh.Friction(
        tangential=(0,),
        across=(1,),
        contact_stiffness=1e4,
        friction_coefficient=0.5,
        normal_load=load,
        **more,
    )


def stop(load: float = 1.0, **more: float) -> sh.Contacts:
    """A stop under a preload."""
    return sh.Gap(normal=(1,), normal_stiffness=1e4, normal_load=load, **more)


EACH = [shroud, slider, disc, stop]
FORCE = sh.forces.HarmonicForce(cosine={1: [10, 0]}, sine={1: [0, 10]})


def problem_of(group: sh.Contacts, harmonics=(0, 1, 2, 3)) -> sh.HarmonicBalance:
    return sh.HarmonicBalance(sh.Model(*MATRICES, contacts={"own": group}), FORCE, harmonics)


@pytest.mark.parametrize("contact", EACH)
def test_at_one_frequency_it_is_a_constant_load(contact):
    frequency, by_speed = 17.0, 4e-3
    turning = problem_of(contact(centrifugal_load=by_speed, engine_order=ORDER))
    load = 1.0 + by_speed * (2 * np.pi * frequency / ORDER) ** 2
    still = problem_of(contact(load))
    one, other = (sh.solve(problem, frequency) for problem in (turning, still))
    np.testing.assert_allclose(one.coefficient, other.coefficient, rtol=1e-9, atol=1e-15)
    assert abs(one.coefficient.values).max() > 1e-4


@pytest.mark.parametrize("contact", EACH)
def test_peaks_of_a_path_are_those_of_single_frequencies(contact):
    by_speed = 4e-3
    turning = problem_of(contact(centrifugal_load=by_speed, engine_order=ORDER), (0, 1))
    response = sh.frf(turning, (12, 24), progress=False, throw=True)
    peak = int(np.argmax(response.peak_amplitude.values))
    at, amplitude = response.peak_frequency.values[peak], response.peak_amplitude.values[peak]
    beside = []
    for frequency in at * (1 + np.array([-1e-5, 0, 1e-5])):
        load = 1.0 + by_speed * (2 * np.pi * frequency / ORDER) ** 2
        point = sh.solve(problem_of(contact(load), (0, 1)), frequency)
        beside.append(point.amplitude.values.max())
    assert beside[1] == pytest.approx(amplitude, rel=1e-9)
    assert max(beside) == beside[1]


@pytest.mark.parametrize("contact", EACH)
def test_sensitivities_by_the_load_agree_with_differences(contact):
    turning = problem_of(contact(centrifugal_load=4e-3, engine_order=ORDER), (0, 1))
    response = sh.frf(turning, (12, 24), progress=False, throw=True)
    found = sh.datasets.sensitivity(response)
    step = 1e-6
    ends = []
    for way in (1, -1):
        moved = turning.with_parameters(centrifugal_load=4e-3 * (1 + way * step))
        ends.append(sh.frf(moved, (12, 24), progress=False, throw=True).peak_amplitude.max().item())
    quotient = (ends[0] - ends[1]) / (2 * step * 4e-3)
    peak = int(np.argmax(response.peak_amplitude.values))
    slopes = found.peak_amplitude_by_centrifugal_load.isel(peak=peak).values
    slope = np.nansum(slopes)
    round_off = 1e-16 / (step * 4e-3)
    assert slope == pytest.approx(quotient, rel=1e-4, abs=round_off)


def test_archives_keep_the_engine_order(tmp_path):
    turning = problem_of(slider(centrifugal_load=4e-3, engine_order=ORDER), (1,))
    response = sh.frf(turning, (12, 24), progress=False)
    sh.save(response, tmp_path / "turning.nc")
    rebuilt = sh.datasets.rebuild(sh.load(tmp_path / "turning.nc"))
    assert rebuilt.model.groups[0].law == turning.model.groups[0].law
    assert rebuilt.model.groups[0].law.engine_order == ORDER


def test_one_without_the_other_is_refused():
    with pytest.raises(ValueError, match=r"centrifugal_load=0\.1, engine_order=None"):
        slider(centrifugal_load=0.1)
    with pytest.raises(ValueError, match="engine_order=0"):
        slider(centrifugal_load=0.1, engine_order=0)


@pytest.mark.parametrize("force", [sh.forces.EngineOrder(2), sh.forces.EngineOrder(3, harmonic=2)])
def test_the_force_has_the_same_order(force):
    model = sh.Model(*MATRICES, contacts={"own": slider(centrifugal_load=0.1, engine_order=ORDER)})
    with pytest.raises(ValueError, match="engine_order"):
        sh.HarmonicBalance(model, force, (1, 2))
    sh.HarmonicBalance(model, sh.forces.EngineOrder(ORDER), (1,))
    sh.HarmonicBalance(model, sh.forces.EngineOrder(2 * ORDER, harmonic=2), (1, 2))


def test_results_tell_the_speed(tmp_path):
    turning = problem_of(slider(centrifugal_load=4e-3, engine_order=ORDER), (1,))
    response = sh.frf(turning, (12, 24), over={"friction_coefficient": [0.2, 0.5]}, progress=False)
    sh.save(response, tmp_path / "turning.nc")
    for dataset in (response, sh.load(tmp_path / "turning.nc"), sh.solve(turning, 15.0)):
        np.testing.assert_allclose(dataset.speed, 60 * dataset.frequency / ORDER)
        assert dataset.speed.attrs["units"] == "min-1"
        assert "speed" in dataset.coords
    np.testing.assert_allclose(response.peak_speed, 60 * response.peak_frequency / ORDER)
    still = sh.frf(problem_of(slider(), (1,)), (12, 24), progress=False)
    assert "speed" not in still.coords
