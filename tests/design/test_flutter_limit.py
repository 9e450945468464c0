"""Parameters that damp most and hold the most: closed forms, scans, limit cycles and marching."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from closed_forms import OneBlade
from scipy.optimize import brentq

import symhbm as sh
from symhbm.continuation import SolveError, Status
from symhbm.design.flutter.limits import Row
from symhbm.design.flutter.optimum import best_limit
from tests.problems import BLADE
from tests.quick import quick_first

ALONE = sh.HarmonicBalance(sh.single_blade(**BLADE), harmonics=(1,))
PROBLEM = ALONE.with_harmonics((1, 3, 5))
AMPLITUDE = 3e-4


def two_dampers(load=3.0, damping=0.5, stiffness=4e3):
    rub = sh.Friction(
        tangential=((0,), (0,)), contact_stiffness=[1e4, stiffness],
        friction_coefficient=0.5, normal_load=[3.0, load],
    )  # fmt: skip
    model = sh.Model([[1.0]], [[damping]], [[1e4]], contacts={"dampers": rub})
    return sh.HarmonicBalance(model, harmonics=(1, 3))


def most_damped(problem, *given, **options):
    return sh.maximise_damping(problem, *given, **dict(progress=False) | options)


def most_held(problem, *given, **options):
    return sh.maximise_flutter_limit(problem, *given, **dict(progress=False) | options)


def limits(problem, *given, **options):
    return sh.flutter_limit(problem, *given, **dict(progress=False) | options)


def of_load(load, amplitude=AMPLITUDE):
    """Damping ratio of the blade, one harmonic, also for a complex load while it slips."""
    slip, kd = 0.5 * load, 1e4
    angle = np.arccos(1 - 2 * slip / (kd * amplitude) + 0j)
    in_phase = kd / np.pi * (angle - np.sin(2 * angle) / 2)
    frequency = np.sqrt(1e4 + in_phase)
    quadrature = 4 * slip / np.pi * (1 - slip / (kd * amplitude))
    return (0.5 + quadrature / (amplitude * frequency)) / (2 * frequency)


def slope_of_load(load):
    return of_load(load + 1e-30j).imag / 1e-30


def most_per_load():
    """Largest damping ratio of one blade over the amplitude, and that amplitude at 1 N."""
    blade = OneBlade(1, 0.5, 1e4, 1e4, slip_limit=0.5)

    def slope(amplitude):
        return (of_load(1.0, amplitude + 1e-30j)).imag

    amplitude = brentq(slope, 0.7e-4, 3e-4, xtol=1e-20, rtol=1e-15)
    return blade.mode(amplitude)[1], amplitude


# Most damping at one amplitude


@pytest.mark.parametrize("bounds", quick_first([[10, 0.1], [0.1, 10], [0.0, 10.0]], 1))
def test_closed_form_of_the_load_that_damps_most(bounds):
    best = most_damped(ALONE, "normal_load", bounds, AMPLITUDE)
    load = brentq(slope_of_load, 1.0, 5.0, xtol=1e-15, rtol=1e-15)
    assert best.design_value.item() == pytest.approx(load, rel=1e-9)
    assert best.design_damping_ratio.item() == pytest.approx(of_load(load).real, rel=1e-12)
    assert best.status.item() == Status.DAMPING_LARGEST
    assert (best.design_from == best.design_to).all()
    assert abs(best.design_slope) < 1e-9
    text = best.certificate.item()
    assert text.startswith(f"{Status.DAMPING_LARGEST}\nFound: at 2.34232797")
    assert "a maximum" in text
    assert "none is larger" in text


@pytest.mark.slow
@pytest.mark.parametrize("wave", quick_first([3, 1], 1))
def test_ring_is_damped_most_as_a_scan_tells(wave):
    ring = sh.HarmonicBalance(sh.bladed_disk(13, **BLADE), harmonics=(1, 3, 5))
    best = most_damped(ring, "normal_load", (0.1, 20), AMPLITUDE, nodal_diameter=wave)
    load = best.design_value.item()
    loads = load * np.array([0.9, 1 - 1e-4, 1.0, 1 + 1e-4, 1.1])
    scan = sh.nonlinear_modes(
        ring, at=[AMPLITUDE], over={"normal_load": loads}, nodal_diameter=wave, progress=False
    )
    ratios = scan.damping_ratio.values[:, 0, 0]
    assert ratios.argmax() == 2
    assert ratios[2] == pytest.approx(best.design_damping_ratio.item(), rel=1e-11)
    # As much is lost on both sides of a maximum.
    assert ratios[2] - ratios[1] == pytest.approx(ratios[2] - ratios[3], rel=1e-2)


@pytest.mark.slow
def test_bounds_and_ranges_are_told():
    at_bound = most_damped(ALONE, "normal_load", (0.1, 2), AMPLITUDE)
    assert at_bound.design_value.item() == 2
    assert at_bound.status.item() == Status.DAMPING_AT_BOUND
    assert at_bound.design_slope > 0
    stuck = most_damped(ALONE, "normal_load", (7, 10), AMPLITUDE)
    assert np.isnan(stuck.design_value.item())
    assert stuck.status.item() == Status.DAMPING_WITHOUT_EFFECT
    assert (stuck.design_from.item(), stuck.design_to.item()) == (7, 10)
    with pytest.raises(SolveError, match="changes nothing"):
        most_damped(ALONE, "normal_load", (7, 10), AMPLITUDE, throw=True)
    # Where the air takes more than friction gives, the best is the least bad.
    fed = ALONE.with_parameters(damping=-60.0)
    assert "not positive" in most_damped(fed, "normal_load", (1, 9), AMPLITUDE).certificate.item()


@pytest.mark.slow
def test_path_that_begins_where_slip_begins_is_followed_the_other_way():
    best = most_damped(PROBLEM, "friction_coefficient", (1, 0.01), AMPLITUDE)
    alike = most_damped(PROBLEM, "normal_load", (0.1, 10), AMPLITUDE)
    assert best.status.item() == Status.DAMPING_LARGEST
    limit = best.design_value.item() * 3
    assert limit == pytest.approx(alike.design_value.item() * 0.5, rel=1e-9)


# The most negative damping that is held


def test_closed_form_of_the_limits_of_one_blade():
    ratio, per_load = most_per_load()
    given = dict(amplitudes=(1e-6, 4e-4), disturbance=[1e-6, 2e-4])
    loads = [0.5, 1.0, 3.0, 5.0, 20.0]
    found = limits(ALONE, "normal_load", (0.5, 20), at=loads, **given)
    for i, load in enumerate(loads):
        blade = OneBlade(1, 0.5, 1e4, 1e4, slip_limit=0.5 * load)
        for k, disturbance in enumerate((1e-6, 2e-4)):
            fold = load * per_load
            place = min(max(fold, disturbance), 4e-4)
            expected, kind = blade.mode(place)[1], "fold"
            if place == disturbance or load == 20:
                place, kind = disturbance, "disturbance"
                expected = blade.mode(disturbance)[1]
            elif place == 4e-4:
                kind = "largest amplitude"
            assert found.limit_kind.values[i, k] == kind
            assert found.limit_amplitude.values[i, k] == pytest.approx(place, rel=1e-8)
            assert found.flutter_limit.values[i, k] == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(found.flutter_limit[2], ratio, rtol=1e-12)
    step = 1e-6
    sides = limits(ALONE, "normal_load", (1, 9), at=[5 - step, 5 + step], **given)
    slope = np.diff(sides.flutter_limit.values, axis=0)[0] / (2 * step)
    np.testing.assert_allclose(found.flutter_limit_slope[3], slope, rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("disturbance", [2e-4, 1e-6])
def test_limit_that_loads_do_not_change_is_a_range(disturbance):
    ratio, per_load = most_per_load()
    best = most_held(ALONE, "normal_load", (0.1, 10), (disturbance, 4e-4))
    assert np.isnan(best.design_value.item())
    assert best.status.item() == Status.DAMPING_ON_RANGE
    assert best.design_damping_ratio.item() == pytest.approx(ratio, rel=1e-12)
    assert best.design_from.item() == pytest.approx(max(0.1, disturbance / per_load), rel=1e-9)
    assert best.design_to.item() == pytest.approx(4e-4 / per_load, rel=1e-9)
    assert "every value from" in best.certificate.item()


@pytest.mark.parametrize(
    ("top", "kind"), [(0.1, "maximum"), (1.9, "maximum"), (0, "bound"), (2, "bound"), (3, "bound")]
)
def test_largest_limit_next_to_a_bound(top, kind):
    def row(value):
        limit: Any = SimpleNamespace(damping_ratio=1 - (value - top) ** 2, slope=2 * (top - value))
        return Row(value, Status.DAMPING_LARGEST, (limit,))

    limits: Any = SimpleNamespace(row=row, sample=lambda _: [row(v) for v in (0.0, 1.0, 2.0)])
    best = best_limit(limits, (0.0, 2.0)).best
    assert (best.value, best.kind) == (pytest.approx(min(top, 2.0)), kind)


def test_limit_that_nothing_changes():
    whole = most_held(ALONE, "normal_load", (0.1, 2), (1e-6, 4e-4))
    assert whole.status.item() == Status.DAMPING_WITHOUT_EFFECT
    assert (whole.design_from.item(), whole.design_to.item()) == (0.1, 2)


@pytest.mark.slow
def test_second_damper_holds_most_where_both_slip_alike():
    problem = two_dampers()
    best = most_held(problem, "normal_load[1]", (0.1, 10))
    load = best.design_value.item()
    assert load == pytest.approx(1.2, rel=1e-7)  # both let go at one amplitude
    assert best.status.item() == Status.DAMPING_LARGEST
    assert best.variable.item() == "normal_load[1]"
    # A dense scan over loads and amplitudes.
    grid = np.geomspace(1e-5, 1e-2, 60)
    scanned = [
        sh.nonlinear_modes(two_dampers(n), at=grid, progress=False).damping_ratio.max().item()
        for n in (0.6, 1.1, load, 1.3, 2.4, 9.0)
    ]
    assert int(np.argmax(scanned)) == 2
    assert scanned[2] == pytest.approx(best.design_damping_ratio.item(), rel=3e-3)
    assert max(scanned) <= best.design_damping_ratio.item()


def test_limit_cycle_under_the_limit_is_the_one_told():
    found = limits(two_dampers(), "normal_load[1]", (0.5, 2), at=[1.0])
    ratio, frequency = found.flutter_limit.item(), found.limit_frequency.item()
    air = 2 * ratio * 2 * np.pi * frequency
    under = two_dampers(1.0, 0.5 - air)
    cycles = sh.limit_cycles(under, amplitudes=(1e-6, 1e-1), progress=False)
    distance = np.abs(cycles.amplitude.values / found.limit_amplitude.item() - 1)
    assert distance.min() < 1e-7
    assert cycles.frequency.values[distance.argmin()] == pytest.approx(frequency, rel=1e-8)
    less = sh.limit_cycles(two_dampers(1.0, 0.5 - 0.97 * air), progress=False)
    assert less.stability.values.tolist() == [1, 0]
    assert less.amplitude.values[0] < found.limit_amplitude.item() < less.amplitude.values[1]
    assert sh.limit_cycles(two_dampers(1.0, 0.5 - 1.1 * air), progress=False).sizes["point"] == 0


def marched(load, air, disturbance, periods=1000):
    """Largest displacement of a weakly damped blade in its last periods, marched in small steps."""
    stiffness, weak, steps = 1e4, 200.0, 200
    step = 2 * np.pi / 100 / steps
    position, velocity, friction, largest = disturbance, 0.0, 0.0, 0.0
    for i in range(periods * steps):
        velocity += step * (air * velocity - stiffness * position - friction)
        position += step * velocity
        friction += weak * step * velocity
        friction = min(max(friction, -0.5 * load), 0.5 * load)
        if abs(position) > 1.0:
            return abs(position)
        if i > 0.9 * periods * steps:
            largest = max(largest, abs(position))
    return largest


@pytest.mark.parametrize("disturbance", [1e-3, 4e-2])
def test_disturbances_are_held_below_the_limit_and_lost_above(disturbance):
    weak = sh.single_blade(**BLADE | dict(contact_stiffness=200.0, damping=0.0))
    problem = sh.HarmonicBalance(weak, harmonics=(1, 3))
    found = limits(
        problem, "normal_load", (1, 10), at=[3.0], amplitudes=(1e-3, 5e-2), disturbance=disturbance
    )
    for share in (0.9, 1.2):
        air = share * 2 * found.flutter_limit.item() * 2 * np.pi * found.limit_frequency.item()
        held = marched(3.0, air, disturbance) < 5e-2
        assert held == (share < 1)


@pytest.mark.slow
def test_missing_limits_are_told():
    soft = sh.single_blade(**BLADE | dict(cubic_stiffness=-1e9))
    problem = sh.HarmonicBalance(soft, harmonics=(1,))
    with pytest.warns(RuntimeWarning, match="flutter limit is not told"):
        found = limits(problem, "normal_load", (2, 5), at=[3.0], amplitudes=(1e-5, 1e-2))
    assert found.status.item() == Status.LIMIT_MISSING
    assert found.limit_status.values.tolist() == [Status.NO_FREQUENCY]
    assert np.isnan(found.flutter_limit).all()
    best = most_held(problem, "normal_load", (2, 5), (1e-5, 1e-2))
    assert best.status.item() == Status.DAMPING_NOT_FOLLOWED
    assert best.certificate.item().splitlines()[1].startswith("Nothing was found")
    with pytest.raises(ValueError, match="nothing to draw"):
        sh.plot.flutter_limit(best)


# Datasets, pictures, arguments


def test_bad_input_is_named():
    for words, given, options in (
        ("disturbance=", ("normal_load", (1, 2)), dict(disturbance=[1e-8])),
        ("disturbance=", ("normal_load", (1, 2)), dict(disturbance=[1e-3, 1e-4])),
        ("amplitudes=.*smallest", ("normal_load", (1, 2)), dict(amplitudes=(1e-3, 1e-4))),
        ("mass matrix", ("mass", (1, 2)), {}),
        ("band=", ("normal_load", (1, 1)), {}),
        ("nodal_diameter=1", ("normal_load", (1, 2)), dict(nodal_diameter=1)),
        ("mode=3", ("normal_load", (1, 2)), dict(mode=3)),
    ):
        with pytest.raises(ValueError, match=words):
            limits(PROBLEM, *given, **options)
    with pytest.raises(ValueError, match="amplitude="):
        most_damped(PROBLEM, "normal_load", (1, 2), -1.0)
    with pytest.raises(TypeError, match="problem"):
        most_held("blade", "normal_load", (1, 2))  # type: ignore[arg-type]
