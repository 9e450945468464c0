"""Closed forms and marches that studies of modes and cycles are compared with."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

import symhbm as sh
from studies import damping_of_modes as damping
from studies import flutter
from studies.unforced import InTime, Wave, complex_stiffness, march

VALUES = 1.0, 1e4, 1e4, 1.5
"""Mass, both stiffnesses and the limit of friction of the blade of known values."""


def wave(value):
    mass, *others = VALUES
    return Wave(mass, value, *others)


def in_time(value):
    mass, *others = VALUES
    return InTime(mass, value, *others)


@pytest.mark.slow
def test_known_cycles_and_fold():
    """Those of T12 by two other programs: one harmonic, and harmonics up to 21."""
    assert wave(-0.5).cycles(1.0) == pytest.approx([1.508422732e-4, 3.803857572e-2], rel=1e-9)
    assert wave(-2.0).cycles(1.0) == pytest.approx([1.534837042e-4, 9.380589451e-3], rel=1e-9)
    assert wave(-30.0).cycles(1.0) == []
    # The exact ones are as far off as harmonics beyond the 21st.
    for ends, amplitude in (((1.5001e-4, 3e-4), 1.535626339e-4), ((1e-3, 0.1), 9.386874915e-3)):
        found, frequency, slope = in_time(-2.0).cycle(*ends)
        assert found == pytest.approx(amplitude, rel=2e-6)
        assert 100 / (2 * np.pi) < frequency < np.sqrt(2e4) / (2 * np.pi)
        assert (slope < 1) == (amplitude < 1e-3)
    ends = np.log([2e-4, 6e-4])
    grid = np.linspace(ends[0], ends[1], 2001)
    damped = [flutter._cycle_damping(log) for log in grid]
    assert min(damped) == pytest.approx(-26.295299585998, abs=1e-5)
    assert np.exp(grid[np.argmin(damped)]) == pytest.approx(3.36808e-4, rel=1e-3)


@pytest.mark.parametrize(
    ("amplitude", "omega", "ratio"),
    [(3e-4, 122.5968696, 0.107773337), (6e-4, 109.2761159, 0.103061696)],
)
def test_known_modes(amplitude, omega, ratio):
    """Those of T13, harmonics up to 21."""
    frequency, found = in_time(0.5).mode(amplitude)
    assert 2 * np.pi * frequency == pytest.approx(omega, rel=1e-6)
    assert found == pytest.approx(ratio, rel=1e-5)


def test_first_harmonic_of_one_harmonic():
    assert wave(0.5).mode(3e-4)[0] * 2 * np.pi == pytest.approx(122.4744871, rel=1e-9)
    assert wave(0.5).mode(3e-4)[1] == pytest.approx(0.108144537, rel=1e-8)


@pytest.mark.parametrize("amplitude", [1e-4, 2e-4, 1e-3])
def test_complex_stiffness_is_that_of_the_loop(amplitude):
    """The force from reversal to reversal, by quadrature."""
    stiffness, limit = 1e4, 1.5

    def force(angle):
        if stiffness * amplitude <= limit:
            return stiffness * amplitude * np.cos(angle)
        return max(limit - stiffness * amplitude * (1 - np.cos(angle)), -limit)

    slip = np.arccos(max(1 - 2 * limit / (stiffness * amplitude), -1))
    parts = [
        2 / np.pi * quad(lambda t, of=of: force(t) * of(t), 0, np.pi, points=[slip])[0]
        for of in (np.cos, np.sin)
    ]
    # A force that lags behind takes energy: minus the sine is ahead.
    expected = complex(parts[0], -parts[1]) / amplitude
    assert complex_stiffness(amplitude, stiffness, limit) == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_march_of_blades_that_move_against_each_other():
    """Two blades and two contacts between them: one blade with a contact that moves twice as much.

    From rest at an amplitude it decays as that of the exact map, whose force begins at its limit.
    """
    start, step = 6e-4, 2e-6
    one = np.eye(2)
    found = march((one, 0.5 * one, 1e4 * one), 1e4, 1.5, np.array([start, -start]), step, 60_000)
    np.testing.assert_allclose(found[:, 0], -found[:, 1], rtol=0, atol=1e-15)
    level = found[:, 0]
    turns = np.flatnonzero((level[1:-1] - level[:-2]) * (level[2:] - level[1:-1]) <= 0) + 1
    # Both contacts move twice as much as a blade: 2 * 2 of the stiffness, twice the limit.
    blade = InTime(1.0, 0.5, 1e4, 4e4, 3.0)
    amplitudes = np.abs(level[turns])
    for before, after in pairwise(amplitudes[1:4]):
        if before > 2 * blade.limit / blade.contact_stiffness:
            assert after == pytest.approx(blade.half(before)[0], rel=1e-4)
    assert amplitudes[1] < start


@pytest.mark.parametrize("wind", [False, True])
@pytest.mark.slow
def test_equations_of_a_whole_sector_have_its_modes(wind):
    """One harmonic: a damper as a complex stiffness, and as the library has it."""
    found = damping.disk((1, 3, 1, 2))
    whole = found.wave(5)
    model, air = found.whole, (0.0, 0.0)
    if wind:
        given = sh.Influence({found.tip: 1.0}, flutter.disk_air(), flutter.DISK_FREQUENCY)
        model, air = model.with_influences(given), flutter.disk_air_of_wave(whole)
    problem = sh.HarmonicBalance(model, harmonics=(1,))
    at = [1e-6, 2e-5]
    modes = sh.nonlinear_modes(
        problem, at=at, band=(1e-6, 2e-5), place=found.tip, nodal_diameter=5, progress=False
    ).isel(solution=0)
    for i, amplitude in enumerate(at):
        frequency, ratio = modes.frequency.values[i], modes.damping_ratio.values[i]
        limit = damping.FRICTION * damping.NORMAL_LOAD
        expected = whole.mode(amplitude, limit, frequency * 1.001, air)
        assert (frequency, ratio) == pytest.approx(expected, rel=1e-8)
    assert modes.damping_ratio.values[1] > 1.1 * modes.damping_ratio.values[0]


def test_waves_of_a_march_are_told_apart_by_their_sense():
    time = np.arange(1400) / 7000
    turning = 3e-4 * np.exp(2j * np.pi * 26.3 * time) + 1e-4 * np.exp(-2j * np.pi * 33.1 * time)
    sizes = flutter._forwards(turning[None, :, None])
    assert sizes.item() == pytest.approx(3e-4, rel=1e-3)


def test_air_of_the_ring_is_that_of_influence_coefficients():
    """A wave of the ring with matrices between blades has the damping of the sum over blades."""
    for n in (2, -3):
        problem = flutter.ring((1,))
        at = sh.nonlinear_modes(
            problem, at=[1e-6], band=(1e-6, 1e-5), nodal_diameter=n, progress=False
        )
        expected = flutter.ring_wave(n).mode(1e-6)
        found = at.frequency.item(), at.damping_ratio.item()
        assert found == pytest.approx(expected, rel=1e-10)
