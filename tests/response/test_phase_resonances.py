"""Phase resonances as events: closed forms of one blade, roots of chains, nonlinear modes."""

import numpy as np
import pytest
import scipy.optimize

import symhbm as sh
from tests.problems import one_blade, ring_of_blades
from tests.quick import quick_first

STIFFNESS, CONTACT, LIMIT = 1e4, 1e4, 1.5
DAMPING = 0.5


def blade(amplitude, harmonics=(1,)):
    model = one_blade(stiffness=STIFFNESS, damping=DAMPING, contact_stiffness=CONTACT)
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=amplitude), harmonics)


def masing(amplitude):
    """Stiffness and loss of the contact at an amplitude [m], of one harmonic."""
    angle = np.arccos(1 - 2 * LIMIT / (CONTACT * amplitude))
    loss = 4 * LIMIT * (amplitude - LIMIT / CONTACT) / (np.pi * amplitude**2)
    return CONTACT / np.pi * (angle - np.sin(2 * angle) / 2), loss


def kinds(result, name):
    return result.event_kind.values == name


def resonances(result, moving="frequency"):
    return result[f"event_{moving}"].values[kinds(result, "phase resonance")]


@pytest.mark.parametrize("force", [2.0, 10.0])
def test_one_blade_has_the_closed_form(force):
    """Stiffness and inertia cancel, and the force is what damping and friction take."""
    found = sh.frf(blade(force), (10, 30), phase_resonances=True, progress=False)
    [frequency] = resonances(found)
    at = found.isel(point=int(np.argmin(np.abs(found.frequency.values - frequency))))
    assert float(at.frequency) == frequency
    amplitude, omega = float(at.amplitude.squeeze()), 2 * np.pi * frequency
    stiffness, loss = masing(amplitude)
    assert omega**2 == pytest.approx(STIFFNESS + stiffness, rel=1e-11)
    assert force == pytest.approx((DAMPING * omega + loss) * amplitude, rel=1e-11)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3, 5)])
def test_they_are_the_backbone_that_modes_draw(harmonics):
    """Of one degree of freedom with one harmonic exactly; others excite none of their force."""
    problem = blade(3.0, harmonics)
    found = sh.frf(problem, (10, 30), phase_resonances=True, progress=False)
    [frequency] = resonances(found)
    at = found.isel(point=int(np.argmin(np.abs(found.frequency.values - frequency))))
    first = float(np.hypot(*at.coefficient.sel(harmonic=1).squeeze().values))
    mode = sh.nonlinear_modes(problem, band=(1e-5, 1e-1), at=[first], progress=False)
    near = 1e-11 if harmonics == (1,) else 1e-3
    assert float(mode.frequency.squeeze()) == pytest.approx(frequency, rel=near)


def test_over_the_force_at_one_frequency():
    hertz = 16.5
    found = sh.follow(
        blade(3.0),
        "force_amplitude",
        (0.1, 10),
        frequency=hertz,
        phase_resonances=True,
        progress=False,
    )
    [force] = resonances(found, "force_amplitude")
    omega = 2 * np.pi * hertz
    amplitude = scipy.optimize.brentq(
        lambda a: STIFFNESS + masing(a)[0] - omega**2, 1.0001 * LIMIT / CONTACT, 1.0, xtol=1e-16
    )
    expected = (DAMPING * omega + masing(amplitude)[1]) * amplitude
    assert force == pytest.approx(expected, rel=1e-10)


def test_a_ring_is_solved_by_sectors():
    """One wave excites one resonance; the same whether one sector is solved or all of them."""
    disk = ring_of_blades(6, contact_stiffness=1e5, normal_load=10)
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(2, amplitude=3.0), (1,))
    each = [
        resonances(
            sh.frf(problem.with_by_sector(s), (15, 150), phase_resonances=True, progress=False)
        )
        for s in (True, False)
    ]
    assert len(each[0]) == 1
    np.testing.assert_allclose(each[0], each[1], rtol=1e-11)


@pytest.mark.parametrize("seed", quick_first(range(12), 3))
def test_none_is_passed_over_on_linear_chains(seed):
    """Random chains of four masses, driven at any of them, against a scan of the exact response."""
    rng = np.random.default_rng(seed)
    springs = 1e4 * 10 ** rng.uniform(-1, 0.5, 5)
    stiffness = np.diag(springs[:4] + springs[1:]) - np.diag(springs[1:4], 1)
    stiffness = stiffness - np.diag(springs[1:4], -1)
    mass, damping = np.diag(rng.uniform(0.5, 2, 4)), 10 ** rng.uniform(-1, 1) * np.eye(4)
    driven = int(rng.integers(4))
    problem = sh.HarmonicBalance(
        sh.Model(mass, damping, stiffness), sh.forces.PointForce(place=driven)
    )
    found = sh.frf(problem, (0.5, 80), phase_resonances=True, progress=False)

    def in_phase(hertz):
        omega = 2 * np.pi * np.reshape(hertz, (-1, 1, 1))
        dynamic = stiffness - omega**2 * mass + 1j * omega * damping
        return np.linalg.solve(dynamic, np.eye(4)[driven][:, None])[:, driven, 0].real

    grid = np.linspace(0.5, 80, 40001)
    positive = in_phase(grid) > 0
    falls = np.flatnonzero(positive[:-1] & ~positive[1:])
    expected = [
        scipy.optimize.brentq(lambda at: in_phase(at)[0], *grid[[i, i + 1]], xtol=1e-13)
        for i in falls
    ]
    np.testing.assert_allclose(resonances(found), expected, rtol=1e-10)
