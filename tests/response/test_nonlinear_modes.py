"""Nonlinear modes: closed forms, disks and their sectors, exact motions, and what is refused."""

import numpy as np
import pytest
from closed_forms import OneBlade
from scipy.optimize import minimize_scalar
from sectors import random_disk, with_friction

import symhbm as sh
from symhbm.balance import SustainedMotion, unforced
from symhbm.continuation import newton
from symhbm.continuation.unforced import NonlinearModeProblem
from symhbm.numerics import unknowns_of
from symhbm.response.accuracy.truncation import embed
from symhbm.response.unforced.curve import _solutions_at
from symhbm.time_domain import exact_motion_of
from tests.problems import BLADE
from tests.reference import STATED

RING = sh.bladed_disk(13, **BLADE)


def modes(problem, *given, **options):
    return sh.nonlinear_modes(problem, *given, **dict(progress=False) | options)


def at_points(found):
    """Values of a grid where there is one solution at each."""
    assert (found.n_solutions == 1).all()
    return found.isel(solution=0)


def of_coefficients(problem, point):
    """All unknowns of a mode from a point of its dataset."""
    motion = unknowns_of(problem.basis, problem.harmonics, point.coefficient.values)
    own = 2 * np.pi * point.frequency.item(), point.damping_ratio.item()
    return np.concatenate([motion, own])


# One blade


@pytest.mark.parametrize(
    ("highest", "amplitude", "frequency", "damping_ratio"),
    [tuple(row.values()) for row in STATED["modes_of_one_blade"]],
)
def test_values_of_one_blade(highest, amplitude, frequency, damping_ratio):
    harmonics = range(1, highest + 1, 2)
    problem = sh.HarmonicBalance(sh.single_blade(**BLADE), harmonics=harmonics)
    found = at_points(modes(problem, at=[amplitude]))
    assert 2 * np.pi * found.frequency.item() == pytest.approx(frequency, abs=5e-8)
    assert found.damping_ratio.item() == pytest.approx(damping_ratio, abs=5e-10)


@pytest.mark.parametrize(("damping", "load"), [(0.0, 3.0), (0.5, 3.0), (0.5, 300.0), (20.0, 0.3)])
def test_closed_form_of_one_blade_at_all_amplitudes(damping, load):
    given = BLADE | dict(damping=damping, normal_load=load)
    blade = OneBlade(1, damping, 1e4, 1e4, slip_limit=0.5 * load)
    grid = np.geomspace(1e-6, 1e-2, 41)
    problem = sh.HarmonicBalance(sh.single_blade(**given), sh.forces.PointForce())
    found = modes(problem, at=grid)
    expected = np.array([blade.mode(a) for a in grid])
    found = at_points(found)
    np.testing.assert_allclose(2 * np.pi * found.frequency, expected[:, 0], rtol=1e-12)
    np.testing.assert_allclose(found.damping_ratio, expected[:, 1], rtol=1e-10, atol=1e-16)
    np.testing.assert_allclose(found.modal_amplitude, grid, rtol=1e-12)
    slips = grid > 0.5 * load / 1e4
    np.testing.assert_array_equal(found.contact_state[:, 0], slips)
    path = modes(problem)
    onset = path.event_amplitude.values[path.event_kind == "onset of slip"]
    np.testing.assert_allclose(onset, [5e-5 * load] if 5e-5 * load < 1e-2 else [], rtol=1e-12)
    turns = path.event_kind == "damping turns"
    if load == 3.0 and damping < 1:
        best = minimize_scalar(lambda a: -blade.mode(a)[1], (2e-4, 4e-4, 8e-4), tol=1e-12)
        assert path.event_damping_ratio[turns].item() == pytest.approx(-best.fun, rel=1e-13)
        assert path.event_amplitude[turns].item() == pytest.approx(best.x, rel=1e-6)
    # Straight lines between points tell the mode.
    for name, column in (
        ("frequency", expected[:, 0] / (2 * np.pi)),
        ("damping_ratio", expected[:, 1]),
    ):
        drawn = np.interp(np.log(grid), np.log(path.amplitude), path[name])
        np.testing.assert_allclose(drawn, column, atol=3e-3 * column.max())


@pytest.mark.slow
def test_mode_of_many_harmonics_is_the_exact_motion():
    problem = sh.HarmonicBalance(sh.single_blade(**BLADE), harmonics=(1, 3, 5))
    assert exact_difference(problem, range(1, 182, 2), 3e-4) < 1e-9


def exact_difference(problem, harmonics, amplitude, mode=0, dof=0):
    """Difference from the exact motion under the force that sustains a mode, over its amplitude.

    The mode is solved for with more harmonics, which the force and its exact motion have as well.
    """
    found = modes(problem, mode=mode, band=(1e-6, 2e-2), place=dof, at=[amplitude])
    coarse = of_coefficients(problem, at_points(found).isel(amplitude=0))
    fine = NonlinearModeProblem(unforced(problem.with_harmonics(tuple(harmonics))), dof)
    basis, n = fine.problem.basis, fine.problem.n_unknowns
    unknowns = np.concatenate([embed(problem, fine.problem, coarse[:-2]), coarse[-2:]])
    result = newton(lambda u: fine.evaluate(u, np.log10(amplitude)), unknowns)
    assert result.converged
    motion, frequency = result.unknowns[:n], fine.frequency(result.unknowns)
    damping_ratio = fine.damping_ratio(result.unknowns)
    force = SustainedMotion(fine.problem).force(motion, frequency, damping_ratio)
    cosine, sine = {}, {}
    for h in basis.harmonics:
        if h:
            columns = [basis.component(h), basis.component(h, sine=True)]
            cosine[h], sine[h] = force.reshape(problem.n_dof, -1)[:, columns].T
    driven = sh.HarmonicBalance(
        problem.model, sh.forces.HarmonicForce(cosine, sine), basis.harmonics
    )
    exact = exact_motion_of(driven, frequency, (driven, motion))
    assert exact.converged
    difference = exact.coefficients(basis.harmonics)[0] - motion.reshape(problem.n_dof, -1)
    return np.abs(difference).max() / amplitude


# Disks


@pytest.mark.parametrize(
    ("harmonics", "wave"), [((1,), 0), ((1,), 3), ((1,), 6), ((1, 3, 5), 0), ((1, 3, 5), 3)]
)
def test_one_sector_of_a_ring_is_the_whole_ring(harmonics, wave):
    problem = sh.HarmonicBalance(RING, harmonics=harmonics)
    grid = np.array([1e-5, 1e-4, 3e-4, 1e-3, 9e-3])
    found = at_points(modes(problem, at=grid, nodal_diameter=wave))
    assert found.n_sectors == 13
    if harmonics == (1,):
        ratio = 2 * np.sin(np.pi * wave / 13)
        blade = OneBlade(1, 0.5, 1e4, 1e4, slip_limit=1.5, ratio=ratio)
        expected = np.array([blade.mode(a) for a in grid])
        np.testing.assert_allclose(2 * np.pi * found.frequency, expected[:, 0], rtol=1e-12)
        np.testing.assert_allclose(found.damping_ratio, expected[:, 1], rtol=1e-10)
    other = at_points(modes(problem, at=grid, nodal_diameter=-wave))
    for name in ("frequency", "damping_ratio", "modal_amplitude"):
        np.testing.assert_allclose(other[name], found[name], rtol=1e-12)
    whole = NonlinearModeProblem(unforced(problem), 0)
    for k, amplitude in enumerate(grid):
        point = found.isel(amplitude=k)
        unknowns, value = of_coefficients(whole.problem, point), np.log10(amplitude)
        assert whole.evaluate(unknowns, value).norm < 1e-11
        first = point.coefficient.sel(harmonic=1).values @ [1, -1j]
        lag = np.exp(-2j * np.pi * wave * np.arange(13) / 13)
        np.testing.assert_allclose(first, amplitude * lag, atol=1e-12 * amplitude)
        square = (point.coefficient**2).sum().item()
        assert point.modal_amplitude.item() == pytest.approx(np.sqrt(square), rel=1e-12)


def test_wave_of_a_sector_is_that_of_its_engine_order():
    disk = with_friction(random_disk(5, cartesian=False))
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(2, pattern={1: {5: 1.0}}), (0, 1))
    own = modes(problem, band=(1e-5, 1e-4), place=5, at=[1e-4])
    alone = sh.HarmonicBalance(disk, None, (0, 1))
    given = modes(alone, band=(1e-5, 1e-4), place=5, at=[1e-4], nodal_diameter=2)
    np.testing.assert_allclose(own.frequency, given.frequency, rtol=1e-13)


# Contacts that open


def stop(**given):
    return sh.Gap(normal=(0,), normal_stiffness=2e4, **given)


def held_blade(contact):
    return sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"stop": contact})


def test_stop_closes_at_its_gap_and_opens_at_its_preload():
    for given, kind, amplitude, stiffness in (
        (dict(gap=1e-3), "onset of contact", 1e-3, 1e4),
        (dict(normal_load=10.0), "onset of opening", 10.0 / 2e4, 3e4),
    ):
        problem = sh.HarmonicBalance(held_blade(stop(**given)), harmonics=range(8))
        path = modes(problem, band=(1e-6, 10.0))
        assert path.event_kind.item() == kind
        assert path.event_amplitude.item() == pytest.approx(amplitude, rel=1e-12)
        assert path.frequency[0] == pytest.approx(np.sqrt(stiffness) / (2 * np.pi), rel=1e-12)
        # Far beyond, gap and load do not matter any more.
        both = np.array([1e4, 3e4]) ** -0.5
        assert path.frequency[-1].item() == pytest.approx(1 / (np.pi * both.sum()), rel=2e-4)


@pytest.mark.slow
def test_stop_that_just_touches_never_moves_linearly():
    problem = sh.HarmonicBalance(held_blade(stop(gap=0.0)), harmonics=range(40))
    path = modes(problem, band=(1e-6, 1e-2))
    both = np.array([1e4, 3e4]) ** -0.5
    np.testing.assert_allclose(path.frequency, 1 / (np.pi * both.sum()), rtol=1e-7)


def shroud(**given):
    friction = sh.Friction(
        tangential=[(0,)], normal=[(1,)], contact_stiffness=1e4, normal_stiffness=1e4,
        friction_coefficient=0.3, **given,
    )  # fmt: skip
    stiffness = np.array([[1e4, 1e3], [1e3, 2.25e4]])
    return sh.Model(np.eye(2), np.diag([2.0, 3.0]), stiffness, contacts={"shroud": friction})


@pytest.mark.parametrize(
    ("model", "mode", "amplitude", "highest", "bound"),
    [
        (held_blade(stop(normal_load=10.0)), 0, 2e-3, 40, 1e-7),
        pytest.param(shroud(normal_load=5.0), 0, 1e-3, 40, 2e-7, marks=pytest.mark.slow),
        pytest.param(shroud(normal_load=5.0), 1, 1e-3, 60, 1e-9, marks=pytest.mark.slow),
    ],
)
def test_contact_that_opens_moves_as_the_exact_motion(model, mode, amplitude, highest, bound):
    """The difference is that of the harmonics left out, which falls with their fourth power."""
    problem = sh.HarmonicBalance(model, harmonics=range(8))
    coarse, fine = (
        exact_difference(problem, range(n + 1), amplitude, mode, mode)
        for n in (highest // 2, highest)
    )
    assert fine < bound
    assert fine < coarse / 10


# What is refused, and datasets


def test_force_does_not_drive_modes_and_static_loads_stay():
    model = held_blade(stop(gap=1e-3))
    force = sh.forces.PointForce(amplitude=5.0) + sh.forces.StaticLoad([5.0])
    problem = sh.HarmonicBalance(model, force, range(4))
    path = modes(problem)
    # The load has moved the blade by half of the gap.
    assert path.event_amplitude[0].item() == pytest.approx(5e-4, rel=1e-12)
    assert path.coefficient.sel(harmonic=0, component="cos")[0].item() == pytest.approx(5e-4)
    assert "static loads act" in path.attrs["force_left_out"]
    rebuilt = sh.datasets.rebuild(path)
    np.testing.assert_array_equal(modes(rebuilt).damping_ratio, path.damping_ratio)
    alone = modes(sh.HarmonicBalance(model, sh.forces.StaticLoad([5.0]), range(4)))
    np.testing.assert_array_equal(alone.damping_ratio, path.damping_ratio)
    assert "force_left_out" not in alone.attrs


def test_frequency_that_falls_to_zero_ends_the_path():
    spring = sh.Contacts(sh.laws.CubicSpring(), [(0,)], cubic_stiffness=-1e8)
    model = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"soft": spring})
    problem = sh.HarmonicBalance(model, harmonics=(1,))
    with pytest.warns(RuntimeWarning, match="falls to 0"):
        path = modes(problem, band=(1e-6, 1e-1))
    assert path.amplitude[-1].item() == pytest.approx(np.sqrt(1e4 / 0.75e8), rel=1e-3)
    with pytest.raises(sh.SolveError, match="falls to 0"):
        modes(problem, band=(1e-6, 1e-1), throw=True)


def test_an_amplitude_that_turns_back_goes_on_beyond_zero():
    """The third harmonic takes over, in the second mode, and the first one changes its sign."""
    hard = sh.laws.SmoothLaw(lambda y, v, p: p["k"] * y**3, {"k": (1e10, "N/m^3")}, [(0,)])
    model = sh.Model(np.eye(2), np.eye(2), [[2e4, -1e4], [-1e4, 2e4]], contacts={"hard": hard})
    path = modes(sh.HarmonicBalance(model, harmonics=(1, 3)))
    assert path.status.item() == sh.Status.REACHED_END
    assert "fold" in path.event_kind
    _, before, after = np.flatnonzero(path.amplitude == path.amplitude[0])
    assert after == before + 1
    share = np.abs(path.coefficient.sel(harmonic=3)).max(("dof", "component"))
    first = np.abs(path.coefficient.sel(harmonic=1, dof=0)).max("component")
    assert (share > 10 * first)[[before, after]].all()
    assert path.residual_norm.max() < 1e-11
    with_the_first_alone = modes(sh.HarmonicBalance(model))
    assert with_the_first_alone.status.item() == sh.Status.REACHED_END


def test_other_verbs_refuse_modes():
    path = modes(sh.HarmonicBalance(sh.single_blade(**BLADE)))
    for verb in (sh.plot.response, sh.statistics.envelope):
        with pytest.raises(ValueError, match="responses to a force"):
            verb(path)


def test_degree_of_freedom_that_moves_most():
    pair = sh.Model(np.eye(2), np.eye(2), [[1e4, -1e3], [-1e3, 2e4]])
    for mode in (0, 1):
        problem = sh.HarmonicBalance(pair)
        most, given = (
            modes(problem, mode=mode, band=(1e-6, 1e-5), place=dof) for dof in (None, mode)
        )
        np.testing.assert_array_equal(most.coefficient, given.coefficient)
        assert most.attrs["followed"] == given.attrs["followed"]
    disk = with_friction(random_disk(5, cartesian=False))
    alone = sh.HarmonicBalance(disk, None, (0, 1))
    path = modes(alone, band=(1e-6, 1e-5), place=None, nodal_diameter=1)
    size = np.hypot(*path.coefficient.sel(harmonic=1)[0].values.T)
    assert size.max() == pytest.approx(1e-6, rel=1e-12)


def test_reduced_structure_is_told_by_the_numbers_of_the_whole():
    stiffness = 2e4 * np.eye(12) - 1e4 * (np.eye(12, k=1) + np.eye(12, k=-1))
    rubs = dict(contact_stiffness=5e3, friction_coefficient=0.5, normal_load=3.0)
    whole = sh.Model(np.eye(12), 0.5 * np.eye(12), stiffness, contacts=[(9,)], **rubs)
    reduced = sh.craig_bampton(whole, 11, (1, 40), places=[9])  # as many modes as there are
    found = []
    for model in (whole, reduced):
        problem = sh.HarmonicBalance(model, harmonics=(1, 3))
        found.append(modes(problem, band=(1e-6, 1e-2), place=9, at=[1e-5, 1e-3, 5e-3]))
    for name in ("frequency", "damping_ratio", "modal_amplitude"):
        np.testing.assert_allclose(found[1][name], found[0][name], rtol=1e-8)
    small = sh.HarmonicBalance(sh.craig_bampton(whole, 2, (1, 20)))
    gone = next(dof for dof in range(12) if dof not in small.model.kept)
    with pytest.raises(
        ValueError, match=f"place={gone}: expected a degree of freedom that is kept"
    ):
        modes(small, place=gone)


@pytest.mark.slow
def test_archives_of_a_reduced_sector_know_its_degree_of_freedom():
    """They number anew what is kept; the request tells the number of the whole sector."""
    n = 6
    chain = 3e4 * np.eye(n) - 1e4 * (np.eye(n, k=1) + np.eye(n, k=-1))
    sector = sh.Model(np.eye(n), 0.5 * np.eye(n), chain)
    rubs = sh.Friction(
        tangential=(4,), contact_stiffness=5e3, friction_coefficient=0.5, normal_load=3
    )
    disk = sh.Sector(sector, left=[0], right=[5], n_sectors=8).with_contacts(root=rubs)
    small = sh.craig_bampton(disk, 2, (1, 60), places=[4])
    problem = sh.HarmonicBalance(small, harmonics=(1,))
    path = modes(problem, band=(1e-5, 1e-3), place=4, nodal_diameter=2)
    assert sh.datasets.rebuild(path).model.kept.tolist() != small.kept.tolist()
    verified = sh.verify(path, exact="none", progress=False)
    assert verified.residual_stored.max() < 1e-9
    assert verified.amplitude_mismatch.max() < 1e-12
    force = sh.forces.EngineOrder(2, pattern={4: 1.0})
    assert (
        sh.datasets.synthesised_response(path, force, errors=False).sizes["point"]
        == path.sizes["point"]
    )


def test_where_no_branch_is_one_motion_was_not_found_without_a_solve():
    [found] = _solutions_at(None, 1.0)
    assert (found.unknowns, found.solves) == (None, 0)
