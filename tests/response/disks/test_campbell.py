"""Natural frequencies over the speed: modes followed by their shapes, and critical speeds."""

import numpy as np
import pytest
from scipy.optimize import brentq

import symhbm as sh

PER_MINUTE = 2 * np.pi / 60


def veering(coupling: float) -> sh.RotatingModel:
    """Two blades, one of which stiffens: their frequencies would cross at about 415 1/min."""
    at_rest = np.array([[1.2e4 + coupling, -coupling], [-coupling, 1e4 + coupling]])
    stiffer = at_rest + np.diag([0, 1.2 * (PER_MINUTE * 500) ** 2])
    blades = sh.Model(np.eye(2), np.zeros((2, 2)), at_rest)
    return sh.RotatingModel(blades, {0: at_rest, 500: stiffer})


def disk(n_sectors: int = 12, coriolis: float = 0.0) -> sh.Sector:
    """Sectors of two masses that stiffen differently, the first coupled to the next one."""
    coupled = np.array([[9e4, -2e4, -3e4], [-2e4, 6e4, 0], [-3e4, 0, 3e4]])
    stiffening = np.diag([1.0, 2.0, 0])
    skew = np.zeros((3, 3))
    skew[0, 1], skew[1, 0] = -coriolis, coriolis
    sector = sh.Model(np.diag([1.0, 0.5, 0]), np.zeros((3, 3)), coupled)
    runs = {speed: coupled + (PER_MINUTE * speed) ** 2 * stiffening for speed in (0, 1000)}
    rotor = sh.RotatingModel(sector, runs, skew if coriolis else None)
    return sh.Sector(rotor, left=[0], right=[2], n_sectors=n_sectors)


def test_a_critical_speed_is_a_closed_form():
    blade = sh.Model([[1.0]], [[0.5]], [[1e4]])
    rotor = sh.RotatingModel(blade, {0: [[1e4]], 600: [[2e4]]})
    lines = sh.campbell(rotor, np.linspace(0, 900, 7), orders=[2, 3, 5], count=1)
    stiffening = 1e4 / (PER_MINUTE * 600) ** 2
    exact = [np.sqrt(1e4 / (order**2 - stiffening)) / PER_MINUTE for order in (5, 3, 2)]
    np.testing.assert_allclose(lines.crossing_speed, exact, rtol=1e-11)
    assert lines.crossing_order.values.tolist() == [5, 3, 2]
    np.testing.assert_allclose(
        lines.crossing_frequency, lines.crossing_order * lines.crossing_speed / 60
    )


@pytest.mark.parametrize("coupling", [0.0, 50.0])
def test_modes_that_cross_or_veer_are_followed(coupling):
    lines = sh.campbell(veering(coupling), np.linspace(0, 700, 6), count=2)
    frequency = lines.frequency.values
    if coupling < 1:
        # They cross: each keeps its shape, and goes on.
        np.testing.assert_allclose(frequency[:, 1], np.sqrt(1.2e4) / (2 * np.pi), rtol=1e-9)
        assert np.all(np.diff(frequency[:, 0]) > 0)
        assert frequency[-1, 0] > frequency[-1, 1]
    else:
        # They veer: the lower one stays below, and shapes pass into each other.
        assert np.all(frequency[:, 0] < frequency[:, 1])
    assert np.nanmin(lines.mac) > 0.8


def test_a_veering_has_more_speeds_where_shapes_change():
    gentle, sharp = (
        sh.campbell(veering(coupling), [0, 350, 700], count=2).speed.values
        for coupling in (2e3, 50.0)
    )
    assert len(sharp) > len(gentle)


@pytest.mark.parametrize("coriolis", [0.0, 0.3])
def test_an_order_meets_the_waves_that_it_drives(coriolis):
    turning = disk(coriolis=coriolis)
    lines = sh.campbell(turning, [0, 1500, 3000], orders=[3, 9, 15, 4], count=2)
    assert lines.attrs["n_sectors"] == 12
    assert lines.nodal_diameter.values.tolist() == [*range(-5 if coriolis else 0, 7)]
    pairs = lines.crossing_order.values.tolist(), lines.crossing_nodal_diameter.values.tolist()
    # Order 9 of 12 sectors has three nodal diameters in the other sense.
    backwards = -3 if coriolis else 3
    assert {*zip(*pairs, strict=True)} == {(3, 3), (9, backwards), (15, 3), (4, 4)}


def test_crossings_of_a_sector_solve_for_the_speed():
    rotor = disk()
    lines = sh.campbell(rotor, [500, 2000], orders=[4], count=2, nodal_diameter=4)

    def excess(speed: float) -> float:
        modes = sh.natural_modes(rotor.at(speed), nodal_diameter=4, count=1)
        return modes.frequency.item() - 4 * speed / 60

    assert lines.crossing_speed.values[0] == pytest.approx(brentq(excess, 500, 2000), rel=1e-9)


def test_crossings_beside_a_veering_are_natural_frequencies():
    """Whichever of two modes it is that a line meets, its frequency is one at that speed."""
    for coupling in (5.0, 50.0, 500.0):
        rotor = veering(coupling)
        lines = sh.campbell(rotor, [0, 400, 700], orders=[2, 3], count=2)
        assert lines.sizes["crossing"] >= 2
        for crossing in range(lines.sizes["crossing"]):
            speed, frequency = (
                lines[f"crossing_{name}"].values[crossing] for name in ("speed", "frequency")
            )
            natural = sh.natural_modes(rotor.at(speed), count=2).frequency.values
            assert np.abs(natural / frequency - 1).min() < 1e-9


def test_no_more_modes_than_there_are():
    massless = sh.Model(np.diag([1.0, 0]), np.zeros((2, 2)), [[3.0, -1], [-1, 2]])
    with pytest.raises(ValueError, match="count=2: expected at most 1"):
        sh.campbell(massless, [0, 100])


def whirling(damping=None):
    """A mass on equal springs, seen from the rotating frame: whirls at |w0 - W| and w0 + W."""
    stiffness, turn = 1e4 * np.eye(2), np.array([[0.0, -1], [1, 0]])
    runs = {s: stiffness - (2 * np.pi * s / 60) ** 2 * np.eye(2) for s in (0, 300)}
    model = sh.Model(np.eye(2), 0.5 * np.eye(2) if damping is None else damping, stiffness)
    return sh.RotatingModel(model, runs, coriolis=2 * turn)


def test_whirls_are_followed_above_the_critical_speed():
    """One of them is overtaken by the rotation at w0, and has the other sense from there."""
    speeds = np.array([0.0, 600, 900, 1200, 1500])
    lines = sh.campbell(whirling(), speeds, orders=[1, 4])
    omega, natural = speeds / 60, 100 / 2 / np.pi
    found = np.sort(lines.frequency.sel(speed=speeds).values, axis=0).T
    both = np.sort([np.abs(natural - omega), natural + omega], axis=0)
    np.testing.assert_allclose(np.sort(lines.frequency.sel(speed=speeds).values.T, 0), both, 1e-9)
    assert found.shape == both.shape
    one = lines.isel(mode=np.argmin(lines.frequency.sel(speed=900).values)).frequency
    np.testing.assert_allclose(one, np.abs(natural - one.speed / 60), rtol=1e-9)
    crossings = 60 * natural / np.array([5, 3, 2])  # order 4 meets both, order 1 the lower one
    np.testing.assert_allclose(np.sort(lines.crossing_speed), np.sort(crossings), rtol=1e-9)


def test_motions_that_rotation_does_not_hold_are_refused():
    model = sh.Model(np.eye(1), [[0.5]], [[1e4]])
    rotor = sh.RotatingModel(model, {0: [[1e4]], 300: [[1e4 - (10 * np.pi) ** 2]]})
    assert sh.natural_modes(rotor.at(900)).frequency.item() > 0
    two = sh.Model(np.eye(2), np.eye(2), 1e4 * np.eye(2))
    soft = {0: 1e4 * np.eye(2), 100: np.diag([-1e4, 1e4])}
    skew = np.array([[0, 1e-3], [-1e-3, 0]])
    with pytest.raises(ValueError, match="Coriolis forces that hold"):
        sh.natural_modes(sh.RotatingModel(two, soft, coriolis=skew).at(100))


def test_a_motion_that_grows_without_coriolis_forces_has_no_frequency():
    """It was told as a mode of 0 Hz; the speed is named, and the wave of a sector."""
    blade = sh.Model(np.eye(2), np.eye(2), 1e4 * np.eye(2))
    softer = {0: np.diag([1e4, 2e4]), 600: np.diag([-1e4, 2e4])}
    rotor = sh.RotatingModel(blade, softer)
    with pytest.raises(ValueError, match=r"Coriolis forces.*a square is -10000 rad"):
        sh.natural_modes(rotor.at(600))
    assert sh.natural_modes(rotor.at(400)).frequency.min() > 0
    with pytest.raises(ValueError, match=r"^speeds: at 600 1/min stiffness_matrix: expected"):
        sh.campbell(rotor, [0, 400, 600, 800])
    disk = sh.Sector(rotor, left=[0], right=[1], n_sectors=5)
    with pytest.raises(ValueError, match=r"^speeds: at 900 1/min and 0 nodal diameters"):
        sh.campbell(disk, [0, 400, 900])


def test_damping_by_a_rule_is_no_part_of_modes():
    """Modal damping has no matrix above a critical speed, and needs none here."""
    damped, speeds = whirling(sh.ModalDamping(0.01)), [0.0, 900, 1200]
    of_matrix, of_rule = (sh.campbell(rotor, speeds) for rotor in (whirling(), damped))
    np.testing.assert_array_equal(of_matrix.frequency, of_rule.frequency)
    np.testing.assert_array_equal(
        *(sh.natural_modes(rotor.at(1200)).frequency for rotor in (whirling(), damped))
    )
