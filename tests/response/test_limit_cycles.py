"""Limit cycles: closed forms, waves and rings, exact motions and their stability, bad input."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import symhbm as sh
from symhbm.balance import unforced
from symhbm.continuation import newton
from symhbm.continuation.unforced import LimitCycleProblem, first_harmonic
from symhbm.numerics import unknowns_of
from symhbm.response.accuracy.truncation import embed
from symhbm.time_domain.event_march import march
from symhbm.time_domain.linear_motion import LinearMotion
from symhbm.time_domain.periodic_orbit import state_of
from tests.problems import one_blade, ring_of_blades
from tests.published import van_der_pol
from tests.quick import quick_first
from tests.reference import STATED

LIMIT, STIFFNESS = 1.5, 1e4
"""Of the contact of that blade [N, N/m]."""


def blade(damping, **values):
    return one_blade(damping=damping, **values)


def cycles(structure, *given, harmonics=(1,), **options):
    problem = sh.HarmonicBalance(structure, harmonics=harmonics)
    return sh.limit_cycles(problem, *given, **dict(progress=False) | options)


def closed_form(amplitude, limit=LIMIT):
    """Damping [N s/m] and angular frequency of the cycle of an amplitude, under one harmonic."""
    angle = np.arccos(1 - 2 * limit / (STIFFNESS * amplitude))
    omega = np.sqrt(1e4 + STIFFNESS * (angle - np.sin(2 * angle) / 2) / np.pi)
    return -4 * limit * (amplitude - limit / STIFFNESS) / (np.pi * omega * amplitude**2), omega


# One blade


@pytest.mark.parametrize(
    ("damping", "highest", "amplitudes", "frequencies"),
    [tuple(row.values()) for row in STATED["limit_cycles_of_one_blade"]],
)
def test_values_of_one_blade(damping, highest, amplitudes, frequencies):
    found = cycles(blade(damping), harmonics=range(1, highest + 1, 2))
    assert found.status == "the end of the band was reached"
    np.testing.assert_allclose(found.amplitude, amplitudes, rtol=4e-10)
    if frequencies is not None:
        np.testing.assert_allclose(2 * np.pi * found.frequency, frequencies, rtol=6e-10)
    assert found.stability.values.tolist() == [1, 0]
    assert (found.residual_norm < 1e-11).all()
    assert (found.contact_state == 1).all()


@pytest.mark.parametrize(("load", "damping"), [(0.3, -25.0), (3.0, -0.2), (30.0, -5.0)])
def test_closed_form_of_one_blade(load, damping):
    found = cycles(blade(damping, normal_load=load), amplitudes=(1e-6, 10.0))
    assert found.sizes["point"] == 2
    at = [closed_form(a, 0.5 * load) for a in found.amplitude.values]
    np.testing.assert_allclose([c for c, _ in at], damping, rtol=1e-10)
    np.testing.assert_allclose(2 * np.pi * found.frequency, [w for _, w in at], rtol=1e-11)


@pytest.mark.slow
def test_cycles_over_the_damping_meet_at_the_fold():
    found = cycles(blade(-0.5), "damping", (-30, 0), stability=True)
    assert found.status == "the end of the band was reached"
    most = minimize_scalar(lambda a: closed_form(a)[0], (2e-4, 3e-4, 5e-4), tol=1e-12)
    assert found.fold_damping.item() == pytest.approx(most.fun, rel=1e-12)
    assert found.fold_damping.item() == pytest.approx(-26.295299586, abs=5e-10)
    assert found.event_kind.values.tolist() == ["fold"]
    assert found.event_damping.item() == found.fold_damping.item()
    assert found.event_amplitude.item() == pytest.approx(most.x, rel=1e-6)
    assert found.fold_damping.units == "N s m-1"
    assert "beyond which none was found" in found.fold_damping.long_name
    assert found.amplitude[0].item() == pytest.approx(1.5e-4, rel=1e-12)
    assert found.amplitude[-1].item() == pytest.approx(1.0, rel=1e-6)
    slips = found.amplitude.values > 1.5e-4 * (1 + 1e-9)
    expected = np.array([closed_form(a)[0] for a in found.amplitude.values[slips]])
    np.testing.assert_allclose(found.damping[slips], expected, rtol=1e-10, atol=1e-12)
    # Those below the fold are stable, those above it are not.
    at = found.amplitude.values - found.event_amplitude.item()
    assert (found.stability.values[slips & (at < -1e-9)] == 1).all()
    # One harmonic does not tell which side of the exact fold a cycle next to it is on.
    assert (found.stability.values[at > 1e-9] < 1).all()
    assert (found.stability.values[at > 1e-4] == 0).all()


def test_grid_over_the_damping():
    grid = [-28.0, -26.0, -5.0, -1.0]
    found = cycles(blade(0.5), "damping", (-30, 0), grid)
    assert found.n_solutions.values.tolist() == [0, 2, 2, 2]
    for value in grid[1:]:
        low, high = found.amplitude.sel(damping=value).values
        exact = [
            brentq(lambda a, value=value: closed_form(a)[0] - value, *ends, xtol=1e-16, rtol=1e-13)
            for ends in ((1.5001e-4, 3.36808e-4), (3.36808e-4, 0.1))
        ]
        np.testing.assert_allclose([low, high], exact, rtol=1e-8)
    assert np.isnan(found.amplitude.sel(damping=-28.0)).all()
    assert "stability" not in found.variables


@pytest.mark.slow
def test_nothing_is_found_beyond_the_fold():
    found = cycles(blade(-30.0))
    assert found.sizes["point"] == 0
    assert found.status == "the end of the band was reached"
    with pytest.warns(RuntimeWarning, match="no limit cycle was found"):
        over = cycles(blade(-30.0), "damping", (-40, -30))
    assert over.sizes["point"] == 0
    assert np.isnan(over.fold_damping)


def test_motions_without_damping_are_no_cycles():
    assert cycles(blade(0.0)).sizes["point"] == 0


def test_cycles_of_other_amplitudes_are_not_looked_for():
    found = cycles(blade(-0.5), amplitudes=(1e-6, 1e-2))
    np.testing.assert_allclose(found.amplitude, [1.508422732e-4], rtol=1e-9)
    assert "modes 0, for amplitudes of 1e-06 to 0.01 m" in found.searched
    assert "not looked for" in found.searched


def test_a_force_takes_no_part():
    problem = sh.HarmonicBalance(blade(-0.5), sh.forces.PointForce())
    found = sh.limit_cycles(problem, progress=False)
    np.testing.assert_array_equal(found.amplitude, cycles(blade(-0.5)).amplitude)
    assert "oscillates" in found.force_left_out


def test_cycles_of_an_oscillator_of_van_der_pol():
    model = van_der_pol()
    over = cycles(model, "c", (-1, 1), amplitudes=(1e-2, 5), stability=True)
    np.testing.assert_allclose(over.amplitude, 2 * np.sqrt(-over.c.values), rtol=1e-9)
    assert (over.stability == 1).all()
    assert over.amplitude[0].item() == pytest.approx(1e-2, rel=1e-6)
    found = cycles(model, harmonics=range(1, 26, 2), amplitudes=(1.0, 3.0))
    told = STATED["van_der_pol"]
    assert 1 / found.frequency.item() == pytest.approx(told["period"], rel=1e-9)
    assert found.largest_displacement.item() == pytest.approx(told["amplitude"], rel=1e-8)
    assert found.growth_rate.item() == pytest.approx(-1.059376995, rel=1e-4)


# Exact motions in time


def shroud(damping):
    """Two displacements of a contact whose normal load moves, and which opens far out."""
    law = sh.Friction(
        tangential=[(0,)], normal=[(1,)], contact_stiffness=1e4, normal_stiffness=2e4,
        friction_coefficient=0.4, normal_load=4.0,
    )  # fmt: skip
    matrices = np.eye(2), np.diag([damping, 3.0]), np.array([[1e4, 1e3], [1e3, 2.25e4]])
    return sh.Model(*matrices, contacts={"shroud": law})


def stop(damping):
    """A blade that rubs, and leans on a stop which opens."""
    rubs = sh.Contacts(
        sh.laws.Coulomb(), [(0,)], contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3
    )
    leans = sh.Gap(normal=(0,), normal_stiffness=2e4, normal_load=10.0)
    return sh.Model([[1.0]], [[damping]], [[1e4]], contacts={"rubs": rubs, "stop": leans})


def fine(problem, dataset, harmonics):
    """Cycles of a dataset solved again with more harmonics: balance, coefficients and frequency."""
    alone = unforced(problem.with_harmonics(tuple(harmonics)))
    size, phase = first_harmonic(alone, 0)
    curve = LimitCycleProblem(alone, None, phase, size=size)
    for i in range(dataset.sizes["point"]):
        point = dataset.isel(point=i)
        coarse = unknowns_of(problem.basis, problem.harmonics, point.coefficient.values)
        start = np.append(embed(problem, alone, coarse), 2 * np.pi * point.frequency.item())
        result = newton(lambda unknowns: curve.evaluate(unknowns, 0.0), start)
        assert result.converged
        yield alone, result.unknowns[:-1], result.unknowns[-1]


def shot(alone, motion, frequency):
    """The exact cycle near a balanced one: its motions by the angle, a march, and its frequency."""
    linear = LinearMotion(alone, frequency)
    state = linear.of_active(state_of(alone, motion, frequency))
    slope, fixed = alone.n_dof, state[alone.n_dof]

    def ends(omega, start):
        moves = LinearMotion(alone, omega)
        return march(moves, start, 2 * np.pi), moves

    for _ in range(8):
        run, linear = ends(frequency, state)
        step = 1e-6 * frequency
        high, low = (ends(frequency + sign * step, state)[0].end for sign in (1, -1))
        matrix = np.zeros((len(state) + 1,) * 2)
        matrix[:-1, :-1] = run.jacobian - np.eye(len(state))
        matrix[:-1, -1] = (high - low) / (2 * step)
        matrix[-1, slope] = 1.0
        residual = np.append(run.end - state, state[slope] - fixed)
        # Of one size; forces of contacts that never slip are not determined.
        scale = np.append(np.abs(state) + np.abs(state[:slope]).max(), frequency)
        moved = np.linalg.lstsq(matrix * scale, -residual, rcond=1e-11)[0] * scale
        state, frequency = state + moved[:-1], frequency + moved[-1]
    run, linear = ends(frequency, state)
    assert np.abs(run.end - state)[: 2 * slope].max() < 1e-11 * np.abs(state[:slope]).max()
    return linear, state, run, frequency


EXACT = [
    (blade(-0.5), (1, 3, 5), range(1, 162, 2), 1e-9),
    (blade(-20.0), (1, 3, 5), range(1, 162, 2), 1e-9),
    (stop(-0.5), range(6), range(41), 2e-8),
    (shroud(-1.0), range(6), range(31), 2e-6),
]


@pytest.mark.slow
@pytest.mark.parametrize(("structure", "coarse", "harmonics", "error"), quick_first(EXACT, 1))
def test_cycles_are_exact_motions(structure, coarse, harmonics, error):
    problem = sh.HarmonicBalance(structure, harmonics=coarse)
    found = sh.limit_cycles(problem, progress=False)
    assert found.sizes["point"] == 2
    assert found.stability.values.tolist() == [1, 0]
    rates = found.growth_rate.values
    several = zip(fine(problem, found, harmonics), rates, strict=True)
    for (alone, motion, balanced), rate in several:
        linear, state, run, frequency = shot(alone, motion, balanced)
        assert balanced == pytest.approx(frequency, rel=error)
        tau = 2 * np.pi * np.arange(4096) / 4096
        waves = np.fft.rfft(run.cells.evaluate(linear, tau)[0].T) / 2048
        row, basis = motion.reshape(alone.n_dof, -1), alone.basis
        for n in (1, 3):
            cosine, sine = row[:, basis.component(n)], row[:, basis.component(n, sine=True)]
            size = np.abs(waves[:, 1]).max()
            np.testing.assert_allclose(
                np.hypot(cosine, sine), np.abs(waves[:, n]), atol=error * size
            )
        # From both sides motions come nearer, or go away, as the growth rate tells.
        periods = int(np.clip(frequency / abs(rate) / (2 * np.pi), 2, 20))
        reference = largest(run, linear)
        expected = np.exp(rate * periods * 2 * np.pi / frequency)
        for share in (-1e-6, 1e-6):
            moved, left = state.copy(), []
            moved[: alone.n_dof] *= 1 + share
            for _ in range(periods + 3):
                again = march(linear, moved, 2 * np.pi)
                left.append(largest(again, linear) / reference - 1)
                moved = again.end
            assert (abs(left[-1]) < abs(share)) == (rate < 0)
            if rate > 0:
                assert left[-1] / left[2] == pytest.approx(expected, rel=0.01)


def largest(run, linear):
    """Largest displacement of the first degree of freedom over a march."""
    return np.abs(run.cells.evaluate(linear, np.linspace(0, 2 * np.pi, 4001))[0][:, 0]).max()


# Disks


def ring_on_ground(damping, n=13):
    """Blades that rub on each other and on the ground."""
    ring = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3)
    ground = ring | dict(contact_stiffness=5e3)
    shrouds = sh.Contacts(sh.laws.Coulomb(), [(j, (j + 1) % n) for j in range(n)], **ring)
    roots = sh.Contacts(sh.laws.Coulomb(), [(j,) for j in range(n)], **ground)
    eye = np.eye(n)
    return sh.Model(eye, damping * eye, 1e4 * eye, contacts={"shrouds": shrouds, "roots": roots})


def test_waves_are_disturbed_by_all_waves():
    # All blades of a ring without contacts to the ground move together without friction.
    ring = ring_of_blades(13, damping=-2.0)
    found = cycles(ring, harmonics=(1, 3), nodal_diameter=6)
    assert found.stability.values.tolist() == [0, 0]
    np.testing.assert_allclose(found.growth_rate[0], 1.0, rtol=1e-9)
    held = cycles(ring_on_ground(-2.0), harmonics=(1, 3), nodal_diameter=0)
    assert held.stability.values[-1] == 0


N, AT = 8, 30.0
COEFFICIENTS = {-1: 60 + 300j, 0: -100 - 900j, 1: 30 - 250j}
SHAPE = {1: 1.0, 0: 0.3}
MASS, DAMPING = np.diag([1.0, 0.5, 0]), np.diag([0.5, 0.25, 0])
SPRINGS = np.array([[9e4, -2e4, -3e4], [-2e4, 6e4, 0], [-3e4, 0, 3e4]])
RUBS = dict(contact_stiffness=2e4, friction_coefficient=0.5, normal_load=1.0)


def sectors():
    """A disk whose blades rub on the ground, in an air flow that drives some waves."""
    disk = sh.Sector(sh.Model(MASS, DAMPING, SPRINGS), [0], [2], N)
    disk = disk.with_contacts(root=sh.Friction(tangential=(1,), **RUBS))
    return disk.with_influences(sh.Influence(SHAPE, COEFFICIENTS, AT))


def all_sectors():
    """The same disk by the matrices of all its blades."""
    join, following = np.zeros((N, 3, 2 * N)), np.roll(np.arange(N), -1)
    for j in range(N):
        join[j, 0, 2 * j] = join[j, 1, 2 * j + 1] = join[j, 2, 2 * following[j]] = 1
    mass, damping, stiffness = (
        sum(each.T @ matrix @ each for each in join) for matrix in (MASS, DAMPING, SPRINGS)
    )
    along = np.zeros((N, 2 * N))
    for j in range(N):
        along[j, [2 * j, 2 * j + 1]] = SHAPE[0], SHAPE[1]
    for distance, value in COEFFICIENTS.items():
        ahead = along[(np.arange(N) + distance) % N]
        stiffness = stiffness + value.real * along.T @ ahead
        damping = damping + value.imag / (2 * np.pi * AT) * along.T @ ahead
    roots = sh.Friction(tangential=[(2 * j + 1,) for j in range(N)], **RUBS)
    return sh.Model(mass, damping, stiffness, contacts={"root": roots})


@pytest.mark.parametrize("wave", [0, -3])
def test_air_drives_waves_by_its_coefficients(wave):
    found = [
        cycles(disk, harmonics=(1, 3), nodal_diameter=wave, place=1, stability=False)
        for disk in (sectors(), all_sectors())
    ]
    assert found[0].sizes["point"] == 2
    for name in ("amplitude", "frequency"):
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=1e-9)


# What is asked for


@pytest.mark.slow
def test_several_modes():
    matrices = np.eye(2), -2.0 * np.eye(2), np.array([[2e4, -1e4], [-1e4, 3e4]])
    values = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3)
    model = sh.Model(*matrices, contacts=[(0,), (1,)], **values)
    both = cycles(model, mode=(0, 1), place=0)
    alone = [cycles(model, mode=mode, place=0) for mode in (0, 1)]
    assert [one.sizes["point"] for one in alone] == [2, 2]
    amplitudes = np.sort(np.concatenate([one.amplitude for one in alone]))
    np.testing.assert_allclose(both.amplitude, amplitudes, rtol=1e-10)
    assert "modes 0, 1" in both.searched


def test_responses_under_negative_damping_may_be_several():
    problem = sh.HarmonicBalance(blade(-0.5), sh.forces.PointForce())
    assert not problem.single_valued
    found = sh.frf(problem, (15, 30), at=[16.0, 20.0], progress=False)
    assert "solution" in found.dims
    assert "stability" in found.variables
    positive = sh.HarmonicBalance(blade(0.5), sh.forces.PointForce())
    assert positive.single_valued
    over = sh.follow(positive, "damping", (1.0, -1.0), [0.5], frequency=20.0, progress=False)
    assert "solution" in over.dims
    coupled = sh.Model(np.eye(2), [[1.0, 2.0], [2.0, 1.0]], 1e4 * np.eye(2))
    assert not sh.HarmonicBalance(coupled, sh.forces.PointForce()).single_valued
    turns = sh.Model(np.eye(2), [[0.0, 2.0], [-2.0, 0.0]], 1e4 * np.eye(2))
    assert sh.HarmonicBalance(turns, sh.forces.PointForce()).single_valued


def test_what_takes_no_negative_damping_says_so():
    chain = sh.Model(np.eye(3), -0.1 * np.eye(3), 1e4 * np.diag([2.0, 2.0, 1.0]))
    with pytest.raises(ValueError, match="gives energy to no motion"):
        sh.condense(
            chain, sh.forces.PointForce(), frequency_band=(10, 30), places=[0], progress=False
        )
    problem = sh.HarmonicBalance(blade(0.5), sh.forces.PointForce())
    with pytest.raises(ValueError, match="values must stay >= 0"):
        sh.mistuning.uniform(problem, 5, seed=1, damping=1.5)
